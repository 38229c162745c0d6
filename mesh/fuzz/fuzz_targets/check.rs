// What every reader promises, and what then holds of the writers. Included by each target.

use stylet_mesh::io::{Format, MeshData, ReadError, read_bytes};

type Reading = Result<(MeshData, Vec<String>), ReadError>;

/// Whatever a reader makes of some bytes is sound; and what it read can be written and read again as the same.
fn check(format: Format, reading: Reading) {
    match reading {
        Ok((data, _)) => {
            data.check().expect("a reader makes sound data");
            again(format, &data);
        }
        // Showing an error must not fail either.
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn again(format: Format, data: &MeshData) {
    let folder = std::env::temp_dir().join(format!("stylet-fuzz-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    let path = folder.join("mesh").with_extension(format.extension());
    // What does not fit is refused; that is an answer.
    if stylet_mesh::io::write(&path, data, format).is_ok() && format != Format::Tetgen {
        let bytes = std::fs::read(&path).expect("the file that was written");
        let (back, _) = read_bytes(format, &bytes).expect("what was written can be read");
        assert_eq!(back.blocks.iter().map(|b| b.n_cells()).sum::<usize>() > 0, back.n_cells() > 0);
        if !matches!(format, Format::Stl | Format::StlBinary) {
            assert_eq!(back.points, data.points);
            assert!(back.cells().eq(data.cells()));
        }
    }
}
