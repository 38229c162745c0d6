//! The cube cut open along the needle.

use crate::needle::{Needle, along, dot, minus};
use crate::picture::{mesh_title, visible_shaft};
use crate::simulation::Simulation;
use crate::tip::deformed;
use std::path::Path;
use stylet_mesh::VertexId;
use stylet_plot::{Colour, PlotError, SolidPicture, SpaceLine};

/// The deformed cube coloured by the magnitude of the displacement, without the half on the needle's right. What the needle
/// is in the mesh, the tetrahedra between needle nodes alone, stands out whole and grey; where a coarse mesh has none, a
/// line shows where the needle is.
pub(crate) fn cut_open<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    path: &Path,
) -> Result<(), PlotError> {
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let places: Vec<[f64; D]> = (0..mesh.n_vertex_slots()).map(|v| deformed(mesh, u, VertexId::new(v))).collect();
    let points: Vec<[f64; 3]> = places.iter().map(|&p| space(p)).collect();
    let mut on_needle = vec![false; places.len()];
    simulation.needle_nodes().iter().for_each(|(vertex, _)| on_needle[vertex.index()] = true);
    let within = |v: &[VertexId; N]| v.iter().all(|v| on_needle[v.index()]);
    let is_left = |needle: &Needle<D>, v: &[VertexId; N]| {
        let to_left = |v: &VertexId| dot(minus(places[v.index()], needle.tip()), needle.normal());
        v.iter().map(to_left).sum::<f64>() >= 0.0
    };
    let stays = |v: &[VertexId; N]| simulation.needle().is_none_or(|needle| is_left(needle, v)) || within(v);
    let millimetres = |v: &VertexId| 1e3 * u[D * v.index()..][..D].iter().map(|x| x * x).sum::<f64>().sqrt();
    let (mut tetrahedra, mut values, mut solid) = (Vec::new(), Vec::new(), false);
    for v in mesh.cells().map(|cell| mesh.cell(cell)).filter(stays) {
        tetrahedra.push([v[0].0, v[1].0, v[2].0, v[3].0]);
        // Grey: what has no value.
        values.push(if within(&v) { f64::NAN } else { v.iter().map(millimetres).sum::<f64>() / N as f64 });
        solid |= within(&v);
    }
    let picture = SolidPicture {
        points: &points,
        tetrahedra: &tetrahedra,
        values: &values,
        title: mesh_title(simulation),
        colour_label: "displacement (mm)".to_owned(),
        lines: simulation.needle().map(|needle| shaft(simulation, needle, solid)).into_iter().collect(),
        ..SolidPicture::default()
    };
    picture.write(path)
}

/// The needle to its tip; one that stands out in the mesh only as far as its last node.
fn shaft<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    needle: &Needle<D>,
    solid: bool,
) -> SpaceLine {
    let [start, tip] = visible_shaft(needle, simulation.scene().mesh.side);
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let behind = |vertex| needle.frame_of(deformed(mesh, u, vertex)).behind;
    let last = simulation.needle_nodes().last().map_or(0.0, |&(vertex, _)| behind(vertex));
    let end = if solid { along(tip, -last, needle.tangent()) } else { tip };
    SpaceLine {
        points: [start, end].map(space).to_vec(),
        colour: Colour::INK,
        label: if solid { "needle, grey in the mesh" } else { "needle and tip" }.to_owned(),
        tip: !solid,
        ..SpaceLine::default()
    }
}

fn space<const D: usize>(p: [f64; D]) -> [f64; 3] {
    [p[0], p[1], p[2]]
}
