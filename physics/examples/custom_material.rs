//! A law of one's own: the solid of Gent, whose chains lock at a finite stretch, pulled as a bar.
//!
//! ```text
//! W = -mu Jm/2 ln(1 - (I - 3)/Jm) - mu ln J + lambda/2 (J - 1)^2,   I = tr F^T F
//!
//!   x = 0   |============================|  x = 1      free sides
//!  held     |                            | -> s - 1    (a quarter: symmetry planes y = 0, z = 0)
//! ```
//! The bar's stress is uniform: it must be that of one point whose sides are free. Energy, stress and its differential are
//! all that a law has to say; tangents, projections and groups of elements follow.
//!
//! Run: `cargo run --release -p stylet-physics --example custom_material`
//!
//! Source: Gent (1996), *A new constitutive relation for rubber*, Rubber Chem. Technol. 69.

use nalgebra::{Matrix3, SMatrix, Vector3};
use std::error::Error;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::Body;
use stylet_physics::material::Hyperelastic;
use stylet_physics::statics::{StaticMethod, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// Gent's solid; `mu`, `lambda` in Pa. Locks where `I - 3` reaches `limit`.
#[derive(Clone)]
struct Gent {
    mu: f64,
    lambda: f64,
    limit: f64,
}

impl Gent {
    /// `1 - (I - 3)/Jm`: positive inside the domain.
    fn slack(&self, f: &Matrix3<f64>) -> f64 {
        1.0 - (f.norm_squared() - 3.0) / self.limit
    }
}

impl Hyperelastic<3> for Gent {
    fn energy_density(&self, f: &Matrix3<f64>) -> f64 {
        let (slack, j) = (self.slack(f), f.determinant());
        if slack > 0.0 && j > 0.0 {
            -0.5 * self.mu * self.limit * slack.ln() - self.mu * j.ln() + 0.5 * self.lambda * (j - 1.0).powi(2)
        } else {
            f64::INFINITY
        }
    }

    /// `P = mu F/slack + (lambda (J - 1) J - mu) F^-T`.
    fn first_piola_kirchhoff(&self, f: &Matrix3<f64>) -> Matrix3<f64> {
        let (slack, j) = (self.slack(f), f.determinant());
        match f.try_inverse() {
            Some(inverse) if slack > 0.0 && j > 0.0 => {
                f * (self.mu / slack) + inverse.transpose() * (self.lambda * (j - 1.0) * j - self.mu)
            }
            _ => Matrix3::from_element(f64::NAN),
        }
    }

    fn stress_differential(&self, f: &Matrix3<f64>, df: &Matrix3<f64>) -> Matrix3<f64> {
        let (slack, j) = (self.slack(f), f.determinant());
        let Some(inverse) = f.try_inverse() else { return Matrix3::from_element(f64::NAN) };
        let inverse = inverse.transpose();
        let locking = 2.0 * self.mu * f.dot(df) / (self.limit * slack * slack);
        let volume = inverse * (self.lambda * (2.0 * j - 1.0) * j * inverse.dot(df));
        df * (self.mu / slack) + f * locking + volume
            - inverse * df.transpose() * inverse * (self.lambda * (j - 1.0) * j - self.mu)
    }
}

/// The stress of a point under the stretch `s`, its sides free, by Newton's method.
fn uniaxial_stress(law: &Gent, s: f64) -> f64 {
    let at = |b: f64| Matrix3::from_diagonal(&Vector3::new(s, b, b));
    let mut b = 1.0 / s.sqrt();
    for _ in 0..50 {
        let slope = law.stress_differential(&at(b), &Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0)))[(1, 1)];
        b -= law.first_piola_kirchhoff(&at(b))[(1, 1)] / slope;
    }
    law.first_piola_kirchhoff(&at(b))[(0, 0)]
}

/// What leaves a vertex free along the axes that are not held.
fn hold(held: [bool; 3]) -> Constraint<3> {
    let axis = |wanted: bool| {
        std::array::from_fn(|k| if k == held.iter().position(|&h| h == wanted).unwrap_or(3) { 1.0 } else { 0.0 })
    };
    match held.iter().filter(|&&h| h).count() {
        0 => Constraint::Free,
        1 => Constraint::Plane(axis(true)),
        2 => Constraint::Line(axis(false)),
        _ => Constraint::Fixed,
    }
}

/// The stress of the bar at the stretch `s`, and that of the point, Pa.
pub fn stresses(s: f64) -> Result<(f64, f64), Box<dyn Error>> {
    let law = Gent { mu: 12e3, lambda: 100e3, limit: 2.0 };
    let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0, 0.3, 0.3], [4, 2, 2])?;
    let mut body = Body::new(&mesh, law.clone(), 1.0)?;

    let mut subspace = Subspace::new(mesh.n_vertex_slots());
    let (mut u, load) = (vec![0.0; 3 * mesh.n_vertex_slots()], vec![0.0; 3 * mesh.n_vertex_slots()]);
    for (v, x) in mesh.points().iter().enumerate() {
        // Starts from a uniform stretch that keeps the volume; the ends stay where it puts them.
        u[3 * v] = (s - 1.0) * x[0];
        for k in 1..3 {
            u[3 * v + k] = (1.0 / s.sqrt() - 1.0) * x[k];
        }
        let held = [x[0] == 0.0 || x[0] == 1.0, x[1] == 0.0, x[2] == 0.0];
        subspace.set(v, hold(held))?;
    }
    let stop = StopRule { tolerance: 1e-10, criterion: Criterion::Reaction, round_floor: 0.0 };
    let settings = StaticSettings::new(StaticMethod::NewtonCg, stop);
    solve_static(&mut body, &subspace, &load, &mut u, &settings, &mut StaticWorkspace::default())?;

    let cell = mesh.cells().next().ok_or("the mesh is empty")?;
    let stress: SMatrix<f64, 3, 3> = body.stress(cell, &u).ok_or("the cell has no element")?;
    Ok((stress[(0, 0)], uniaxial_stress(&law, s)))
}

#[allow(dead_code)] // unused where a test includes this file
fn main() -> Result<(), Box<dyn Error>> {
    println!("stretch  bar (Pa)      point (Pa)");
    for s in [0.8, 1.2, 1.5] {
        let (bar, point) = stresses(s)?;
        println!("{s:7} {bar:12.4} {point:12.4}");
        if (bar - point).abs() > 1e-6 * point.abs() {
            return Err(format!("the stress of the bar, {bar} Pa, is not that of the point, {point} Pa").into());
        }
    }
    Ok(())
}
