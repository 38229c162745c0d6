//! VTK XML unstructured grids.

use super::{IoError, atomic};
use crate::SimplexMesh;
use std::path::Path;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, ElementType, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};

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
    let piece = UnstructuredGridPiece {
        points: positions(mesh, path, data.displacement)?.into(),
        cells: cells(mesh, path)?,
        data: Attributes { point: point_data(mesh, path, data)?, cell: cell_data(mesh, path, data)? },
    };
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        title: String::new(),
        byte_order: ByteOrder::LittleEndian,
        data: DataSet::inline(piece),
        file_path: None,
    };
    let mut bytes = Vec::new();
    vtk.write_xml(&mut bytes)
        .map_err(|error| IoError::Encode { path: path.to_path_buf(), reason: error.to_string() })?;
    atomic::write(path, &bytes)
}

/// The coordinates, displaced and padded to three.
fn positions<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    path: &Path,
    displacement: Option<&[f64]>,
) -> Result<Vec<f64>, IoError> {
    let mut positions = mesh.points().as_flattened().to_vec();
    if let Some(u) = displacement {
        check_length(path, &displacement_field::<D>(u), mesh.n_vertices())?;
        if let Some(at) = u.iter().position(|x| !x.is_finite()) {
            return Err(IoError::Position { path: path.to_path_buf(), vertex: at / D });
        }
        positions.iter_mut().zip(u).for_each(|(x, u)| *x += u);
    }
    Ok(padded(&positions, D))
}

fn displacement_field<const D: usize>(values: &[f64]) -> Field<'_> {
    Field { name: "displacement", components: D, values }
}

/// Entries of up to three numbers as entries of three.
fn padded(flat: &[f64], components: usize) -> Vec<f64> {
    if components >= 3 {
        return flat.to_vec();
    }
    let mut padded = Vec::with_capacity(3 * (flat.len() / components));
    for entry in flat.chunks_exact(components) {
        padded.extend((0..3).map(|k| entry.get(k).copied().unwrap_or(0.0)));
    }
    padded
}

fn cells<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, path: &Path) -> Result<Cells, IoError> {
    let kind = match N {
        2 => CellType::Line,
        3 => CellType::Triangle,
        4 => CellType::Tetra,
        _ => return Err(IoError::Dimension { path: path.to_path_buf(), d: D, n: N }),
    };
    if D > 3 {
        return Err(IoError::Dimension { path: path.to_path_buf(), d: D, n: N });
    }
    let connectivity = mesh.cells().flat_map(|c| mesh.oriented(c)).map(|v| u64::from(v.0)).collect();
    let offsets = (1..=mesh.n_cells() as u64).map(|k| k * N as u64).collect();
    Ok(Cells { cell_verts: VertexNumbers::XML { connectivity, offsets }, types: vec![kind; mesh.n_cells()] })
}

fn point_data<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    path: &Path,
    data: &VtuData<'_>,
) -> Result<Vec<Attribute>, IoError> {
    let displacement = data.displacement.map(displacement_field::<D>);
    let fields: Vec<Field<'_>> = displacement.into_iter().chain(data.point_fields.iter().copied()).collect();
    check_names(path, fields.iter().map(|field| field.name))?;
    fields.iter().map(|field| attribute(path, field, mesh.n_vertices())).collect()
}

fn cell_data<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    path: &Path,
    data: &VtuData<'_>,
) -> Result<Vec<Attribute>, IoError> {
    check_names(path, std::iter::once("region").chain(data.cell_fields.iter().map(|field| field.name)))?;
    let regions: Vec<u32> = mesh.cells().map(|c| mesh.region(c)).collect();
    let mut attributes = vec![Attribute::scalars("region", 1).with_data(regions)];
    for field in data.cell_fields {
        attributes.push(attribute(path, field, mesh.n_cells())?);
    }
    Ok(attributes)
}

fn attribute(path: &Path, field: &Field<'_>, entries: usize) -> Result<Attribute, IoError> {
    check_length(path, field, entries)?;
    let (elem, values) = match field.components {
        1 => (ElementType::Scalars { num_comp: 1, lookup_table: None }, field.values.to_vec()),
        2 | 3 => (ElementType::Vectors, padded(field.values, field.components)),
        n => (ElementType::Generic(n as u32), field.values.to_vec()),
    };
    Ok(Attribute::DataArray(DataArray { name: field.name.to_owned(), elem, data: values.into() }))
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
