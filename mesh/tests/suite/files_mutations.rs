//! Damaged files: an error or sound data, never a panic, and memory within a small multiple of the file.
//!
//! One test, so that nothing else allocates meanwhile.

use crate::files_support::{folder, mixed, sample, tetrahedra, triangles};
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::{fs, path::Path};
use stylet_mesh::io::{Collection, Format, TetgenFiles, read_bytes, read_tetgen, write};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Bytes that a reader may allocate, at once, for a file of so many.
fn limit(bytes: usize) -> usize {
    (2 << 20) + 64 * bytes
}

/// Every sample, and every format of three meshes.
fn files() -> Vec<(Option<Format>, Vec<u8>)> {
    let mut files: Vec<(Option<Format>, Vec<u8>)> = Vec::new();
    let mut paths: Vec<_> = fs::read_dir(sample("")).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    files.extend(paths.iter().map(|path| (Format::of_extension(path), fs::read(path).unwrap())));
    let folder = folder("mutations");
    for format in Format::ALL {
        for data in [triangles(), tetrahedra(), mixed()] {
            let path = folder.join("mesh").with_extension(format.extension());
            write(&path, &data, format).unwrap();
            files.push((Some(format), fs::read(&path).unwrap()));
        }
    }
    files
}

fn read(format: Option<Format>, bytes: &[u8]) -> usize {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    match format {
        // As each of the files of a mesh, the others sound.
        Some(Format::Tetgen) => {
            let node = fs::read(sample("two.node")).unwrap();
            for files in [
                TetgenFiles { node: bytes, ..TetgenFiles::default() },
                TetgenFiles { node: &node, ele: Some(bytes), ..TetgenFiles::default() },
                TetgenFiles { node: &node, face: Some(bytes), edge: Some(bytes), ..TetgenFiles::default() },
            ] {
                if let Ok((data, _)) = read_tetgen(&files) {
                    assert_eq!(data.check(), Ok(()));
                }
            }
        }
        Some(format) => match read_bytes(format, bytes) {
            Ok((data, _)) => assert_eq!(data.check(), Ok(())),
            Err(error) => assert!(!error.to_string().is_empty()),
        },
        None => drop(Collection::from_bytes(bytes)),
    }
    MEMORY.peak_usage().saturating_sub(before)
}

/// A change of a file at a place: a byte overwritten, digits put in, bytes cut out, a part doubled.
#[derive(Clone, Debug)]
enum Change {
    Byte(u8),
    Digits(u64),
    Cut(usize),
    Double(usize),
}

fn apply(bytes: &mut Vec<u8>, place: usize, change: &Change) {
    if bytes.is_empty() {
        return;
    }
    let at = place % bytes.len();
    match *change {
        Change::Byte(byte) => bytes[at] = byte,
        Change::Digits(n) => drop(bytes.splice(at..at, n.to_string().into_bytes())),
        Change::Cut(n) => drop(bytes.drain(at..(at + n).min(bytes.len()))),
        Change::Double(n) => {
            let part = bytes[at..(at + n).min(bytes.len())].to_vec();
            drop(bytes.splice(at..at, part));
        }
    }
}

#[test]
fn damaged_files_neither_panic_nor_take_memory() {
    let files = files();
    for (format, bytes) in &files {
        let used = read(*format, bytes);
        assert!(used <= limit(bytes.len()), "{format:?}: {used} bytes for {}", bytes.len());
    }

    for (what, format, text) in greedy() {
        let start = std::time::Instant::now();
        let used = read(format, text.as_bytes());
        println!(
            "{what}: {} bytes, {:.1} times that in memory, {:?}",
            text.len(),
            used as f64 / text.len() as f64,
            start.elapsed()
        );
        assert!(used <= limit(text.len()), "{what}: {used} bytes for {}", text.len());
    }

    let change = prop_oneof![
        4 => any::<u8>().prop_map(Change::Byte),
        3 => prop_oneof![0..10_u64, any::<u64>(), Just(u64::MAX), Just(1 << 31), Just(1 << 32)].prop_map(Change::Digits),
        2 => (1..200_usize).prop_map(Change::Cut),
        1 => (1..200_usize).prop_map(Change::Double),
    ];
    let changes = proptest::collection::vec((any::<usize>(), change), 1..6);
    let mut runner = TestRunner::new_with_rng(
        Config { cases: 20_000, failure_persistence: None, ..Config::default() },
        TestRng::deterministic_rng(RngAlgorithm::ChaCha),
    );
    let result = runner.run(&(0..files.len(), changes), |(file, changes)| {
        let (format, mut bytes) = files[file].clone();
        changes.iter().for_each(|(place, change)| apply(&mut bytes, *place, change));
        let used = read(format, &bytes);
        prop_assert!(used <= limit(bytes.len()), "{:?}: {} bytes for {}", format, used, bytes.len());
        Ok(())
    });
    result.unwrap();

    // What fuzzing found, each with the reader that it was found in.
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/fuzz")).unwrap() {
        let path = entry.unwrap().path();
        let bytes = fs::read(&path).unwrap();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        for format in Format::ALL.map(Some).into_iter().chain([None]) {
            let used = read(format, &bytes);
            assert!(used <= limit(bytes.len()), "{name} as {format:?}: {used} bytes for {}", bytes.len());
        }
    }
}

/// Files of many small things, each of which costs a reader more memory than bytes in the file.
fn greedy() -> Vec<(&'static str, Option<Format>, String)> {
    const N: usize = 20_000;
    let grid = |inner: &str| {
        format!("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{inner}</UnstructuredGrid></VTKFile>")
    };
    let attributes: String = (0..N).map(|i| format!(" a{i}=\"\"")).collect();
    let piece = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>";
    let field = "<DataArray type=\"Int8\" Name=\"\"/>";
    let fields =
        format!("<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><PointData>{}</PointData></Piece>", field.repeat(N));
    let mesh = |inner: &str| format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0 0\n$EndNodes\n{inner}");
    let elements: String = (0..N / 2).map(|_| "1 15 0 1\n1 1 0 1 1\n").collect();
    let data = "$NodeData\n0\n0\n3\n0 9 0\n$EndNodeData\n";
    vec![
        ("elements of XML", Some(Format::Vtu), grid(&"<a/>".repeat(N))),
        ("nested elements", Some(Format::Vtu), grid(&("<a>".repeat(N) + &"</a>".repeat(N)))),
        ("attributes of XML", Some(Format::Vtu), grid(&format!("<a{attributes}/>"))),
        ("name spaces", Some(Format::Vtu), grid(&(0..N).map(|i| format!("<a xmlns:a{i}=\"b\">")).collect::<String>())),
        ("pieces", Some(Format::Vtu), grid(&piece.repeat(N))),
        ("fields without values", Some(Format::Vtu), grid(&fields)),
        (
            "frames",
            None,
            format!(
                "<VTKFile type=\"Collection\"><Collection>{}</Collection></VTKFile>",
                "<DataSet file=\"\"/>".repeat(N)
            ),
        ),
        ("blocks of one cell", Some(Format::Msh22), mesh(&format!("$Elements\n{N}\n{elements}$EndElements\n"))),
        (
            "unknown sections",
            Some(Format::Msh22),
            mesh(&(0..N).map(|i| format!("$A{i}\n$EndA{i}\n")).collect::<String>()),
        ),
        ("sparse fields", Some(Format::Msh22), mesh(&format!("$Elements\n0\n$EndElements\n{}", data.repeat(N)))),
        (
            "fields of no tuples",
            Some(Format::Vtk),
            format!(
                "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 0 int\nPOINT_DATA 0\n{}",
                "SCALARS a int\n".repeat(N)
            ),
        ),
        ("solids", Some(Format::Stl), "solid a\nendsolid\n".repeat(N)),
        ("attributes of a point", Some(Format::Tetgen), format!("1 2 {N}\n0 0 0{}\n", " 1".repeat(N))),
    ]
}

#[test]
#[ignore = "measures; run alone with --ignored --nocapture"]
fn bytes_of_memory_per_byte_of_file() {
    for (format, bytes) in files() {
        let used = read(format, &bytes);
        println!("{format:?}: {} bytes, {:.1} times that in memory", bytes.len(), used as f64 / bytes.len() as f64);
    }
}
