//! Frames for ParaView.

use super::law::Law;
use super::run::thickness_stretch;
use crate::error::RunError;
use crate::output::mesh_file_error;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_mesh::io::{Field, VtuData, write_vtu};
use stylet_physics::body::Body;

/// The deformed mesh with `displacement` (m), the first Piola-Kirchhoff stress `stress_p` (Pa, row by row), `det_f`, in plane
/// stress `thickness_stretch`, and `region` (0, or the number of the `[[region]]`).
pub(super) fn write<const D: usize, const N: usize, M: Law<D>>(
    mesh: &SimplexMesh<D, N>,
    body: &Body<D, N, M>,
    u: &[f64],
    path: &Path,
) -> Result<(), RunError> {
    let (mut stresses, mut jacobians, mut thicknesses) = (Vec::new(), Vec::new(), Vec::new());
    for cell in mesh.cells() {
        match body.stress(cell, u) {
            Some(p) => stresses.extend((0..D * D).map(|k| p[(k / D, k % D)])),
            None => stresses.extend([f64::NAN; 9].iter().take(D * D)),
        }
        jacobians.push(body.jacobian(cell, u).unwrap_or(f64::NAN));
        thicknesses.extend(thickness_stretch(body, cell, u));
    }
    let mut fields = vec![
        Field { name: "stress_p", components: D * D, values: &stresses },
        Field { name: "det_f", components: 1, values: &jacobians },
    ];
    if !thicknesses.is_empty() {
        fields.push(Field { name: "thickness_stretch", components: 1, values: &thicknesses });
    }
    let data = VtuData { displacement: Some(u), point_fields: &[], cell_fields: &fields };
    write_vtu(mesh, path, &data).map_err(|e| mesh_file_error(path, e))
}
