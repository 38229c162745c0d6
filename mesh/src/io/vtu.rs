//! VTK XML unstructured grids of a [`SimplexMesh`].

use super::{
    IoError, atomic,
    vtk::{Array, Grid, Values},
};
use crate::SimplexMesh;
use std::{borrow::Cow, path::Path};

/// A named field on the vertices or on the cells.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Field<'a> {
    /// How viewers list it; not empty, unique among the fields of its kind.
    pub name: &'a str,
    /// Numbers per entry: 1 for a scalar, `D` for a vector. Two are written as three, the last one zero, because viewers
    /// know no other vectors.
    pub components: usize,
    /// By vertex id, or by live cell in the order of [`SimplexMesh::cells`]; flat, `components` per entry.
    pub values: &'a [f64],
}

/// What a file shows besides the mesh.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct VtuData<'a> {
    /// Flat, `D` per vertex, in the units of the coordinates: the mesh is drawn displaced, and has the point field
    /// `displacement`.
    pub displacement: Option<&'a [f64]>,
    /// Fields on the vertices.
    pub point_fields: &'a [Field<'a>],
    /// Fields on the live cells; the field `region` is always written.
    pub cell_fields: &'a [Field<'a>],
}

/// Writes the live cells to a `.vtu` file: little-endian binary, 64-bit coordinates, cells with positive volume when
/// undisplaced, in the order of their ids. The file replaces an older one only when it is whole.
///
/// # Errors
/// Each names the path: [`IoError::Dimension`] for cells that VTK does not have, [`IoError::Name`],
/// [`IoError::Length`] and [`IoError::Position`] for data that do not fit, [`IoError::System`].
pub fn write_vtu<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    path: impl AsRef<Path>,
    data: &VtuData<'_>,
) -> Result<(), IoError> {
    let path = path.as_ref();
    if !(2..=4).contains(&N) || D > 3 {
        return Err(IoError::Dimension { path: path.to_path_buf(), d: D, n: N });
    }
    let displacement = data.displacement.map(displacement_field::<D>);
    let point_fields: Vec<Field<'_>> = displacement.into_iter().chain(data.point_fields.iter().copied()).collect();
    check_names(path, point_fields.iter().map(|field| field.name))?;
    check_names(path, std::iter::once("region").chain(data.cell_fields.iter().map(|field| field.name)))?;
    let point_values = entries_of_three(path, &point_fields, mesh.n_vertex_slots())?;
    let cell_values = entries_of_three(path, data.cell_fields, mesh.n_cells())?;
    let regions = Values::UInt32(mesh.cells().map(|c| mesh.region(c)).collect());
    let mut cell_data = vec![Array { name: "region", components: 1, values: regions }];
    cell_data.extend(arrays(data.cell_fields, &cell_values));
    let grid = Grid {
        points: positions(mesh, path, data.displacement)?,
        connectivity: mesh.cells().flat_map(|c| mesh.oriented(c)).map(|v| i64::from(v.0)).collect(),
        sizes: vec![N; mesh.n_cells()],
        point_data: arrays(&point_fields, &point_values).collect(),
        cell_data,
    };
    atomic::write(path, grid.to_xml().as_bytes())
}

/// The coordinates, displaced and padded to three.
fn positions<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    path: &Path,
    displacement: Option<&[f64]>,
) -> Result<Vec<f64>, IoError> {
    let mut positions = mesh.points().as_flattened().to_vec();
    if let Some(u) = displacement {
        check_length(path, &displacement_field::<D>(u), mesh.n_vertex_slots())?;
        if let Some(at) = u.iter().position(|x| !x.is_finite()) {
            return Err(IoError::Position { path: path.to_path_buf(), vertex: at / D });
        }
        positions.iter_mut().zip(u).for_each(|(x, u)| *x += u);
    }
    Ok(padded(&positions, D).into_owned())
}

fn displacement_field<const D: usize>(values: &[f64]) -> Field<'_> {
    Field { name: "displacement", components: D, values }
}

/// Entries of up to three numbers as entries of three.
fn padded(flat: &[f64], components: usize) -> Cow<'_, [f64]> {
    if components >= 3 {
        return flat.into();
    }
    let mut padded = Vec::with_capacity(3 * (flat.len() / components));
    for entry in flat.chunks_exact(components) {
        padded.extend((0..3).map(|k| entry.get(k).copied().unwrap_or(0.0)));
    }
    padded.into()
}

/// The values of fields, those of two components padded: viewers know no vectors but of three.
fn entries_of_three<'a>(path: &Path, fields: &[Field<'a>], entries: usize) -> Result<Vec<Cow<'a, [f64]>>, IoError> {
    let values = |field: &Field<'a>| {
        check_length(path, field, entries)?;
        Ok(if field.components == 2 { padded(field.values, 2) } else { field.values.into() })
    };
    fields.iter().map(values).collect()
}

fn arrays<'a>(fields: &'a [Field<'a>], values: &'a [Cow<'a, [f64]>]) -> impl Iterator<Item = Array<'a>> {
    let components = |n: usize| if n == 2 { 3 } else { n };
    fields.iter().zip(values).map(move |(field, values)| Array {
        name: field.name,
        components: components(field.components),
        values: Values::Reals(values),
    })
}

fn check_length(path: &Path, field: &Field<'_>, entries: usize) -> Result<(), IoError> {
    let (found, components) = (field.values.len(), field.components);
    if components > 0 && entries.checked_mul(components) == Some(found) {
        return Ok(());
    }
    Err(IoError::Length { path: path.to_path_buf(), name: field.name.to_owned(), found, entries, components })
}

fn check_names<'a>(path: &Path, names: impl Iterator<Item = &'a str>) -> Result<(), IoError> {
    let mut seen: Vec<&str> = Vec::new();
    for name in names {
        if name.is_empty() || seen.contains(&name) {
            return Err(IoError::Name { path: path.to_path_buf(), name: name.to_owned() });
        }
        seen.push(name);
    }
    Ok(())
}
