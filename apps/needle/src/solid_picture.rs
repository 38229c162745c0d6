//! The cube cut open along the needle.

use crate::needle::Needle;
use crate::picture::{mesh_title, visible_shaft};
use crate::simulation::Simulation;
use crate::tip::deformed;
use std::path::Path;
use stylet_mesh::VertexId;
use stylet_plot::{Colour, Cut, PlotError, SolidPicture, SpaceLine};

/// The deformed cube coloured by the magnitude of the displacement, without the half on the needle's right, and in grey
/// the jagged surface that the needle's nodes are in the mesh.
pub(crate) fn cut_open<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    path: &Path,
) -> Result<(), PlotError> {
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let points: Vec<[f64; 3]> =
        (0..mesh.n_vertex_slots()).map(|v| space(deformed(mesh, u, VertexId::new(v)))).collect();
    let tetrahedra: Vec<[u32; 4]> = mesh.cells().map(|cell| corners(mesh.cell(cell))).collect();
    let triangles = jagged_surface(simulation, &tetrahedra);
    let length = |v: u32| {
        let u = &u[D * v as usize..][..D];
        1e3 * u.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let mut values: Vec<f64> = tetrahedra.iter().map(|v| 0.25 * v.iter().map(|&v| length(v)).sum::<f64>()).collect();
    // Grey: what has no value.
    values.resize(tetrahedra.len() + triangles.len(), f64::NAN);
    let needle = simulation.needle();
    let line = |needle: &Needle<D>| SpaceLine {
        points: visible_shaft(needle, simulation.scene().mesh.side).map(space).to_vec(),
        colour: Colour::INK,
        width: 1.5,
        label: "needle and tip".to_owned(),
        tip: true,
    };
    let picture = SolidPicture {
        points: &points,
        tetrahedra: &tetrahedra,
        triangles: &triangles,
        values: &values,
        title: mesh_title(simulation),
        colour_label: "displacement (mm)".to_owned(),
        cut: needle.map(|needle| Cut::through(space(needle.tip()), space(needle.normal()).map(|x| -x))),
        lines: needle.map(line).into_iter().collect(),
        ..SolidPicture::default()
    };
    picture.write(path)
}

/// The faces between needle nodes that are not within the needle: those of one tetrahedron of needle nodes alone, and
/// those of none.
fn jagged_surface<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    tetrahedra: &[[u32; 4]],
) -> Vec<[u32; 3]> {
    let mut on_needle = vec![false; simulation.mesh().n_vertex_slots()];
    simulation.needle_nodes().iter().for_each(|(vertex, _)| on_needle[vertex.index()] = true);
    // Each face by its vertices in ascending order, and whether its tetrahedron is within the needle.
    let mut faces: Vec<([u32; 3], bool)> = Vec::new();
    for v in tetrahedra {
        let within = v.iter().all(|&v| on_needle[v as usize]);
        for facet in 0..4 {
            let mut face = [1, 2, 3].map(|step| v[(facet + step) % 4]);
            if face.iter().all(|&v| on_needle[v as usize]) {
                face.sort_unstable();
                faces.push((face, within));
            }
        }
    }
    faces.sort_unstable();
    let of_one_face = faces.chunk_by(|a, b| a.0 == b.0);
    of_one_face.filter(|sides| sides.iter().filter(|side| side.1).count() < 2).map(|sides| sides[0].0).collect()
}

fn space<const D: usize>(p: [f64; D]) -> [f64; 3] {
    [p[0], p[1], p[2]]
}

fn corners<const N: usize>(v: [VertexId; N]) -> [u32; 4] {
    [v[0].0, v[1].0, v[2].0, v[3].0]
}
