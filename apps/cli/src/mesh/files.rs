//! Mesh files, by their names.

use super::source::Soup;
use crate::exit::Failure;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_mesh::import::{export, tagged_facets};
use stylet_mesh::io::{CellBlock, DataField, Format, MeshData, RegionName, read_with_notes};

/// Reads a mesh file, and says what of it was left out.
///
/// # Errors
/// A file that cannot be read, or holds no mesh.
pub fn read(path: &Path) -> Result<(MeshData, Vec<String>), Failure> {
    read_with_notes(path).map_err(|error| Failure::bad_input(error.to_string()))
}

/// The format to write a file in: by name, or by the extension of the file.
///
/// # Errors
/// A name, or an extension, that no format has.
pub fn format_of(argument: &str, path: &Path, name: Option<&str>) -> Result<Format, Failure> {
    let names = || Format::ALL.map(Format::name);
    match name {
        Some(name) => Format::ALL.into_iter().find(|format| format.name() == name).ok_or_else(|| {
            let near = stylet_scene::nearest(name, names());
            let names = names().join(", ");
            Failure::bad_input(format!("--format: found {name}, expected one of {names}; nearest is {near}"))
        }),
        None => Format::of_extension(path).ok_or_else(|| {
            let mut known: Vec<&str> = Format::ALL.map(Format::extension).to_vec();
            known.dedup();
            let known: Vec<String> = known.iter().map(|extension| format!(".{extension}")).collect();
            let found = path.display();
            Failure::bad_input(format!(
                "{argument}: found {found}, expected a name that ends with {}",
                known.join(", ")
            ))
        }),
    }
}

/// Refuses a name that no mesh can be written to, before any work is done.
///
/// # Errors
/// An extension that names no format; a mesh that files cannot hold.
pub fn check_out<const D: usize>(argument: &str, path: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    if D > 3 {
        let line = format!("{argument}: found a mesh in {D} dimensions, expected 2 or 3 for a file");
        return Err(Failure::bad_input(line));
    }
    format_of(argument, path, None).map(|_| ())
}

/// Writes mesh data, and says what the format does not hold.
///
/// # Errors
/// A file that cannot be written.
pub fn write_data(data: &MeshData, path: &Path, format: Format) -> Result<Vec<String>, Failure> {
    stylet_mesh::io::write(path, data, format).map_err(|error| Failure::bad_input(error.to_string()))
}

/// Writes the live cells of a mesh, each with its level of bisection, the tagged facets of its boundary, and the names of
/// regions and tags.
///
/// # Errors
/// A file that cannot be written.
pub fn write<const D: usize, const N: usize>(
    argument: &str,
    mesh: &SimplexMesh<D, N>,
    names: &[RegionName],
    path: &Path,
) -> Result<Vec<String>, Failure> {
    let format = format_of(argument, path, None)?;
    let Some((mut data, _)) = export(mesh) else { return check_out::<D>(argument, Some(path)).map(|()| Vec::new()) };
    let facets = tagged_facets(mesh).map(|(c, ..)| c);
    let values = mesh.cells().chain(facets).map(|c| f64::from(mesh.level(c))).collect();
    data.region_names = names.to_vec();
    data.cell_fields.push(DataField { name: "level".to_owned(), components: 1, values });
    write_data(&data, path, format)
}

/// Writes points and cells, whether or not they make a mesh.
///
/// # Errors
/// A file that cannot be written.
pub fn write_soup<const D: usize, const N: usize>(
    argument: &str,
    soup: Soup<D, N>,
    path: &Path,
) -> Result<Vec<String>, Failure> {
    let format = format_of(argument, path, None)?;
    let pad = |p: &[f64; D]| std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0));
    let vertices = soup.cells.into_iter().flatten().collect();
    let data = MeshData {
        dimension: D,
        points: soup.points.iter().map(pad).collect(),
        blocks: vec![CellBlock { vertices_per_cell: N, vertices, regions: soup.regions }],
        ..MeshData::default()
    };
    write_data(&data, path, format)
}

/// Refuses a name for a picture that is not one, before any work is done.
///
/// # Errors
/// An extension other than `svg`.
pub fn check_plot<const D: usize>(path: Option<&Path>) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    if D > 3 {
        let line = format!("--plot: found a mesh in {D} dimensions, expected 2 or 3 for a picture");
        return Err(Failure::bad_input(line));
    }
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("svg")) {
        let line = format!("--plot: found {}, expected a name that ends with .svg", path.display());
        return Err(Failure::bad_input(line));
    }
    Ok(())
}
