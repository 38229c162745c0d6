//! Cook's membrane: a tapered panel of soft tissue, clamped on the left, pulled up on the right.
//!
//! ```text
//!             (48,60)        div P(I + grad u) = 0,   u = 0 on the left,
//!        ____----|           P n = (0, F/16) on the right
//! (0,44)-        | A
//!   //|    ____--|           neo-Hookean, plane strain, E 34, nu 0.45, F 10
//!   //|__--   (48,44)        reference: A rises by 5.321
//! (0,0)
//! ```
//! Run: `cargo run --release -p stylet-physics --example cook`
//!
//! Source: Cook (1974), J. Struct. Div. ASCE 100.

use std::error::Error;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, boundary_traction};
use stylet_physics::material::NeoHookean;
use stylet_physics::statics::{StaticMethod, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// The panel in `n x n` quadrilaterals, two triangles each.
fn panel(n: usize) -> Result<SimplexMesh<2, 3>, Box<dyn Error>> {
    let square = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [n, n])?;
    let place = |&[s, t]: &[f64; 2]| [48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s)];
    let points = square.points().iter().map(place).collect();
    let triangles = square.cells().map(|cell| square.cell(cell).map(|v| v.0)).collect();
    Ok(SimplexMesh::new(points, triangles)?)
}

/// How far A = (48, 52) rises on a mesh of `n x n` quadrilaterals.
pub fn rise(n: usize) -> Result<f64, Box<dyn Error>> {
    let mesh = panel(n)?;
    let mut body = Body::new(&mesh, NeoHookean::from_young_poisson(34.0, 0.45)?, 1.0)?;

    let mut subspace = Subspace::new(mesh.n_vertex_slots());
    for (v, x) in mesh.points().iter().enumerate() {
        if x[0] == 0.0 {
            subspace.set(v, Constraint::Fixed)?;
        }
    }
    let mut load = vec![0.0; 2 * mesh.n_vertex_slots()];
    boundary_traction(&mesh, 1.0, |x| x[0] == 48.0, &[0.0, 10.0 / 16.0], &mut load)?;

    let stop = StopRule { tolerance: 1e-8, criterion: Criterion::Reaction, round_floor: 0.0 };
    let settings = StaticSettings::new(StaticMethod::NewtonCg, stop);
    let mut u = vec![0.0; load.len()];
    solve_static(&mut body, &subspace, &load, &mut u, &settings, &mut StaticWorkspace::default())?;

    let a = mesh.locate([48.0, 52.0]).ok_or("A lies outside the panel")?;
    let corners = mesh.cell(a.cell);
    Ok(corners.iter().zip(a.barycentric).map(|(v, weight)| weight * u[2 * v.index() + 1]).sum())
}

#[allow(dead_code)] // unused where a test includes this file
fn main() -> Result<(), Box<dyn Error>> {
    println!("{:.4}", rise(64)?);
    Ok(())
}
