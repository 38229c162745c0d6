//! The door for files: from a path to mesh data.

use super::{Format, MeshData, Place, Problem, ReadError, TetgenFiles, gmsh, stl, tetgen, vtk};
use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Reads a mesh from a file, in the format that its extension names, or else its content. Of TetGen's files any one
/// stands for all that lie beside it under the same name.
///
/// # Errors
/// [`ReadError`] with the file, the line or byte, what was found and what was expected.
pub fn read(path: impl AsRef<Path>) -> Result<MeshData, ReadError> {
    read_with_notes(path).map(|(data, _)| data)
}

/// As [`read`], with a line for each thing in the file that mesh data do not hold.
///
/// # Errors
/// As [`read`].
pub fn read_with_notes(path: impl AsRef<Path>) -> Result<(MeshData, Vec<String>), ReadError> {
    let path = path.as_ref();
    let bytes = load(path)?;
    let whole = |problem| ReadError::new(Place::File, problem).in_file(path);
    if bytes.trim_ascii().is_empty() {
        return Err(whole(Problem::Empty));
    }
    match Format::of_file(path, &bytes).map_err(whole)? {
        Format::Tetgen => read_tetgen_beside(path),
        format => read_bytes(format, &bytes).map_err(|error| error.in_file(path)),
    }
}

/// Reads a mesh from the content of a file, and tells text from binary, and one version from another, by that content
/// (whichever variant of the format is given). For [`Format::Tetgen`] it is that of a `.node` file: see
/// [`read_tetgen`].
///
/// # Errors
/// As [`read`], without a file name.
pub fn read_bytes(format: Format, bytes: &[u8]) -> Result<(MeshData, Vec<String>), ReadError> {
    if bytes.trim_ascii().is_empty() {
        return Err(ReadError::new(Place::File, Problem::Empty));
    }
    let mut notes = Vec::new();
    let data = match format {
        Format::Msh22 | Format::Msh22Binary | Format::Msh41 | Format::Msh41Binary => gmsh::read(bytes, &mut notes),
        Format::Vtu => vtk::read_xml(bytes, &mut notes),
        Format::Vtk | Format::VtkBinary => vtk::read_legacy(bytes, &mut notes),
        Format::Tetgen => return read_tetgen(&TetgenFiles { node: bytes, ..TetgenFiles::default() }),
        Format::Stl | Format::StlBinary => stl::read(bytes),
    }?;
    debug_assert_eq!(data.check(), Ok(()));
    Ok((data, notes))
}

/// Reads a mesh from the contents of TetGen's or Triangle's files.
///
/// # Errors
/// As [`read`], with the extension of the file.
pub fn read_tetgen(files: &TetgenFiles<'_>) -> Result<(MeshData, Vec<String>), ReadError> {
    let mut notes = Vec::new();
    let read = tetgen::read(files, &mut notes);
    let data = read.map_err(|(error, extension)| error.in_file(&PathBuf::from(format!(".{extension}"))))?;
    debug_assert_eq!(data.check(), Ok(()));
    Ok((data, notes))
}

/// Reads TetGen's files with the name of `path`: points, and whatever of the others is there.
fn read_tetgen_beside(path: &Path) -> Result<(MeshData, Vec<String>), ReadError> {
    let mut contents: [Option<Vec<u8>>; 4] = Default::default();
    for (content, extension) in contents.iter_mut().zip(tetgen::EXTENSIONS) {
        let beside = path.with_extension(extension);
        *content = match load(&beside) {
            Ok(bytes) => Some(bytes),
            Err(error) if extension != "node" && is_absent(&error) => None,
            Err(error) => return Err(error),
        };
    }
    let [node, ele, face, edge] = contents.each_ref().map(Option::as_deref);
    let files = TetgenFiles { node: node.unwrap_or_default(), ele, face, edge };
    let mut notes = Vec::new();
    let data = tetgen::read(&files, &mut notes)
        .map_err(|(error, extension)| error.in_file(&path.with_extension(extension)))?;
    Ok((data, notes))
}

fn is_absent(error: &ReadError) -> bool {
    matches!(&*error.problem, Problem::System(error) if error.kind() == io::ErrorKind::NotFound)
}

/// The bytes of a file.
pub(super) fn load(path: &Path) -> Result<Vec<u8>, ReadError> {
    let failed = |problem| ReadError::new(Place::File, problem).in_file(path);
    if path.is_dir() {
        return Err(failed(Problem::Folder));
    }
    fs::read(path).map_err(|error| failed(Problem::System(error)))
}
