//! Frames for ParaView: the deformed mesh, and the needle.

use crate::needle::Needle;
use crate::picture::visible_shaft;
use crate::simulation::Simulation;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_mesh::io::{Field, VtuData, write_vtu};
use stylet_tissue::RunError;
use stylet_tissue::output::{mesh_file_error, output_error};
use stylet_tissue::simulation::FrameSeries;

/// The body and the needle.
pub(crate) const SERIES: &[FrameSeries] = &[FrameSeries::BODY, FrameSeries { name: "needle", prefix: "needle" }];

/// Deformed mesh with `displacement` (m), `needle_node` (0 none, 1 slipping or loaded, 2 sticking), the first
/// Piola-Kirchhoff stress `stress_p` (Pa, row by row: P11, P12, ...) and `region`.
pub(crate) fn write_body<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    path: &Path,
) -> Result<(), RunError> {
    let mesh = simulation.mesh();
    let mut on_needle = vec![0.0; mesh.n_vertex_slots()];
    for (vertex, sticks) in simulation.needle_nodes() {
        on_needle[vertex.index()] = if sticks { 2.0 } else { 1.0 };
    }
    let stresses = simulation.stresses();
    let data = VtuData {
        displacement: Some(simulation.displacement()),
        point_fields: &[Field { name: "needle_node", components: 1, values: &on_needle }],
        cell_fields: &[Field { name: "stress_p", components: D * D, values: &stresses }],
    };
    write_vtu(mesh, path, &data).map_err(|e| mesh_file_error(path, e))
}

/// The needle as one line, from a point before the tissue to the tip.
pub(crate) fn write_needle<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    needle: &Needle<D>,
    path: &Path,
) -> Result<(), RunError> {
    let ends = visible_shaft(needle, simulation.scene().mesh.side);
    let line = SimplexMesh::<D, 2>::new(ends.to_vec(), vec![[0, 1]]).map_err(|e| output_error(path, e))?;
    write_vtu(&line, path, &VtuData::default()).map_err(|e| mesh_file_error(path, e))
}
