//! Solved scenes and the difference between two of them.

use crate::{BenchError, Numbers, Row};
use stylet_mesh::SimplexMesh;
use stylet_needle::simulation::{self, Simulation};
use stylet_needle::{NeedleError, builtin};
use stylet_plot::MeshPicture;

/// A displacement field on a mesh.
pub struct Field {
    /// The triangles.
    pub mesh: SimplexMesh<2, 3>,
    /// Displacements, m.
    pub u: Vec<f64>,
}

/// A field ready to be drawn, coloured by displacement.
pub struct Drawn {
    points: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    /// Displacements, mm.
    values: Vec<f64>,
}

impl Field {
    /// The mesh with `scale` times its displacement: 1 as deformed, 0 undeformed.
    pub fn drawn(&self, scale: f64) -> Drawn {
        let place = |(x, u): (&[f64; 2], &[f64])| [x[0] + scale * u[0], x[1] + scale * u[1]];
        Drawn {
            points: self.mesh.points().iter().zip(self.u.chunks(2)).map(place).collect(),
            triangles: self.mesh.cells().map(|cell| self.mesh.cell(cell).map(|v| v.0)).collect(),
            values: self.u.chunks(2).map(|u| 1e3 * u[0].hypot(u[1])).collect(),
        }
    }
}

impl Drawn {
    /// Its picture, without title and lines.
    pub fn picture(&self) -> MeshPicture<'_> {
        MeshPicture { points: &self.points, triangles: &self.triangles, values: &self.values, ..MeshPicture::default() }
    }
}

/// A scene that has run to its end.
pub struct Solved {
    /// The run.
    pub run: Box<dyn Simulation>,
    /// Iterations in all.
    pub iterations: u64,
    /// Seconds in its cycles.
    pub seconds: f64,
    /// Whether every solve reached its tolerance.
    pub converged: bool,
}

impl Solved {
    /// Its displacement.
    pub fn field(&self) -> Field {
        Field { mesh: self.run.mesh().clone(), u: self.run.displacement().to_vec() }
    }
}

/// Runs a built-in scene, with assignments on top, to its end.
///
/// # Errors
/// [`NeedleError`] of the scene or of the run.
pub fn solve(scene: &str, assignments: &[String], threads: usize) -> Result<Solved, NeedleError> {
    let scene = builtin::open(scene, assignments)?;
    let mut run = simulation::start(&scene, threads)?;
    let since = std::time::Instant::now();
    while !run.finished() {
        run.step()?;
    }
    let seconds = since.elapsed().as_secs_f64();
    let summary = run.summary(&[]);
    Ok(Solved { run, iterations: summary.solver.iterations_total, seconds, converged: summary.converged })
}

/// Assignments from pairs.
pub fn with(pairs: &[(&str, &dyn std::fmt::Display)]) -> Vec<String> {
    pairs.iter().map(|(key, value)| format!("{key}={value}")).collect()
}

/// Lengths (m) of the difference between `field`, interpolated, and `reference`, at the nodes of the reference mesh.
///
/// A reference node that no triangle of the field's mesh holds would be an error of location: it gives NaN.
pub fn differences(field: &Field, reference: &Field) -> Vec<f64> {
    let at = |index: usize| {
        let point = reference.mesh.points()[index];
        let Some(place) = field.mesh.locate(point) else { return f64::NAN };
        let vertices = field.mesh.cell(place.cell);
        let component = |k: usize| {
            let ours: f64 = (0..3).map(|i| place.barycentric[i] * field.u[2 * vertices[i].index() + k]).sum();
            ours - reference.u[2 * index + k]
        };
        component(0).hypot(component(1))
    };
    (0..reference.mesh.n_vertex_slots()).map(at).collect()
}

/// Mean and maximum of lengths, in mm.
pub fn mean_max_mm(lengths: &[f64]) -> (f64, f64) {
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    (1e3 * mean, 1e3 * lengths.iter().fold(0.0, |a: f64, &b| if b.is_nan() { b } else { a.max(b) }))
}

/// The two errors as a row holds them.
pub fn errors((mean, max): (f64, f64)) -> Numbers {
    Numbers::from([("mean_mm", mean), ("max_mm", max)])
}

/// A row for a run that failed.
pub fn failed(case: String, threads: usize, error: &NeedleError) -> Row {
    Row { case, threads, ok: false, note: error.to_string(), ..Row::default() }
}

/// The reference solution of the static load: uniform h7, solved to 1e-8.
///
/// # Errors
/// [`BenchError::Needle`].
pub fn static_reference(scene: &str, assignments: &[String], threads: usize) -> Result<Field, BenchError> {
    let mut all = with(&[
        ("mesh.h_start", &7),
        ("mesh.h_ref", &7),
        ("solver.tolerance", &1e-8),
        ("solver.preconditioner", &"block-jacobi"),
    ]);
    all.extend_from_slice(assignments);
    Ok(solve(scene, &all, threads)?.field())
}
