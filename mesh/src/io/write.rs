//! The door for files: from mesh data to a path.

use super::{Format, IoError, MeshData, atomic, gmsh, stl, tetgen, vtk};
use std::path::Path;

/// Writes a mesh to a file, which replaces an older one only when it is whole, and returns a line for each thing that the
/// format does not hold and that was therefore left out.
///
/// TetGen's files get the name of `path` with their own extensions, one after the other, each whole. Those that have no
/// cells are not written, but an old one of that name is replaced by one that says so: readers take all that lie beside
/// each other.
///
/// # Errors
/// [`IoError::Data`] for data that [`MeshData::check`] refuses, [`IoError::DoesNotFit`] where leaving something out would
/// make nonsense of the rest, [`IoError::System`]. Each names the path.
pub fn write(path: impl AsRef<Path>, data: &MeshData, format: Format) -> Result<Vec<String>, IoError> {
    let path = path.as_ref();
    data.check().map_err(|source| IoError::Data { path: path.to_path_buf(), source })?;
    let mut notes = Vec::new();
    let does_not_fit = |what: String| IoError::DoesNotFit { path: path.to_path_buf(), format: format.name(), what };
    let bytes = match format {
        Format::Msh22 => gmsh::write_2(data, false, &mut notes).map_err(does_not_fit)?,
        Format::Msh22Binary => gmsh::write_2(data, true, &mut notes).map_err(does_not_fit)?,
        Format::Msh41 => gmsh::write_4(data, false, &mut notes).map_err(does_not_fit)?,
        Format::Msh41Binary => gmsh::write_4(data, true, &mut notes).map_err(does_not_fit)?,
        Format::Vtk => vtk::write_legacy(data, false, &mut notes).map_err(does_not_fit)?,
        Format::VtkBinary => vtk::write_legacy(data, true, &mut notes).map_err(does_not_fit)?,
        Format::Vtu => vtk::write_xml(data, &mut notes),
        Format::Stl => stl::write_text(data, &mut notes),
        Format::StlBinary => stl::write_binary(data, &mut notes).map_err(does_not_fit)?,
        Format::Tetgen => {
            write_tetgen(path, &tetgen::write(data, &mut notes), data.dimension)?;
            return Ok(notes);
        }
    };
    atomic::write(path, &bytes)?;
    Ok(notes)
}

fn write_tetgen(path: &Path, contents: &[Option<String>; 4], dimension: usize) -> Result<(), IoError> {
    for (content, extension) in contents.iter().zip(tetgen::EXTENSIONS) {
        let path = path.with_extension(extension);
        match content {
            Some(text) => atomic::write(&path, text.as_bytes())?,
            None if path.exists() => {
                let none = if extension == "ele" { format!("0 {} 0\n", dimension + 1) } else { "0 0\n".to_owned() };
                atomic::write(&path, none.as_bytes())?;
            }
            None => {}
        }
    }
    Ok(())
}
