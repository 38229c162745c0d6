//! Frames for ParaView: the tissue, and the needles as lines.

use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_mesh::io::{Field, VtuData, write_vtu};
use stylet_physics::coupling::SlipState;
use stylet_physics::insertion::Insertion;
use stylet_physics::material::Solid;
use stylet_tissue::RunError;
use stylet_tissue::output::{mesh_file_error, output_error};

/// The deformed tissue with `displacement` (m), `region` and `det_f`.
pub(crate) fn write_tissue(insertion: &Insertion<Solid>, u: &[f64], path: &Path) -> Result<(), RunError> {
    let (mesh, body) = (insertion.mesh(), insertion.body());
    let jacobians: Vec<f64> = mesh.cells().map(|cell| body.jacobian(cell, u).unwrap_or(f64::NAN)).collect();
    let fields = [Field { name: "det_f", components: 1, values: &jacobians }];
    let data = VtuData { displacement: Some(u), point_fields: &[], cell_fields: &fields };
    write_vtu(mesh, path, &data).map_err(|error| mesh_file_error(path, error))
}

/// The needles as lines, at each node with the number of the needle from 1, `state` (0 outside, 1 sticks, 2 slides forward, 3
/// backward), `force` on the tissue along the needle (N) and `slip` of the last step (m).
pub(crate) fn write_needles(insertion: &Insertion<Solid>, path: &Path) -> Result<(), RunError> {
    let (mut points, mut segments) = (Vec::<[f64; 3]>::new(), Vec::<[u32; 2]>::new());
    let [mut numbers, mut states, mut forces, mut slips] = [const { Vec::<f64>::new() }; 4];
    for (k, needle) in insertion.needles().iter().enumerate() {
        let (shaft, first) = (&needle.shaft, points.len() as u32);
        let (n, entry) = (shaft.n_nodes(), shaft.entry());
        points.extend((0..n).map(|node| shaft.place(node)));
        segments.extend((0..n as u32 - 1).map(|node| [first + node, first + node + 1]));
        for node in 0..n {
            let coupled = node.checked_sub(entry);
            let value = |of: &[f64]| coupled.and_then(|i| of.get(i).copied()).unwrap_or(0.0);
            let state = coupled.and_then(|i| needle.nodes().get(i)).map_or(0.0, |node| match node.state {
                SlipState::Static => 1.0,
                SlipState::Forward => 2.0,
                SlipState::Backward => 3.0,
            });
            numbers.push(k as f64 + 1.0);
            states.push(state);
            forces.push(value(&needle.forces));
            slips.push(value(&needle.slips));
        }
    }
    let lines = SimplexMesh::<3, 2>::new(points, segments).map_err(|error| output_error(path, error))?;
    let field = |name, values| Field { name, components: 1, values };
    let fields = [field("needle", &numbers), field("state", &states), field("force", &forces), field("slip", &slips)];
    let data = VtuData { displacement: None, point_fields: &fields, cell_fields: &[] };
    write_vtu(&lines, path, &data).map_err(|error| mesh_file_error(path, error))
}
