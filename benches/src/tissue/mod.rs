//! The tissue of a dynamic simulation: a cube of soft tissue that is clamped on one face and released under its weight.

pub(crate) mod lazy;
mod page;
pub(crate) mod threads;

use crate::BenchError;
use crate::solvers::jittered_cube;
use std::time::Instant;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::dynamics::{Damping, Drive, DynamicsSettings, Integrator, StageTimes, State, StepReport};
use stylet_physics::material::{Corotated, RotationTangent, Solid};
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::sparse::Frozen;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// Pa.
const YOUNG: f64 = 34e3;
const POISSON: f64 = 0.45;
/// kg/m³.
const DENSITY: f64 = 1000.0;
/// m/s².
const GRAVITY: f64 = 9.81;
/// Cells a side: 13,182 tetrahedra, near the 13,375 of the published prostate.
const CELLS: usize = 13;
/// Steps of a run.
const STEPS: usize = 200;
/// The same in a quick look.
const QUICK: (usize, usize) = (6, 20);

/// A cube that falls and swings: the corotated law with held rotations and one linearised step of the trapezoid rule, as
/// published.
struct Released {
    body: Body<3, 4, Solid>,
    held: Subspace<3>,
    weight: Vec<f64>,
    integrator: Integrator<3>,
    state: State,
}

/// What one step took.
struct Step {
    report: StepReport<3>,
    /// Of the whole step, s.
    seconds: f64,
    /// Forces, Jacobian and the rest, s.
    stages: [f64; 4],
}

impl Released {
    /// `damping` is the damping time of the stiffness, s.
    fn new(
        mesh: &SimplexMesh<3, 4>,
        dt: f64,
        damping: f64,
        rule: LazyRule,
        parts: Option<&[u32]>,
        team: &Team,
    ) -> Result<Self, BenchError> {
        let law = Corotated::from_young_poisson(YOUNG, POISSON).expect("constants in range");
        let mut body = Body::new(mesh, Solid::Corotated(law.with_rotation(RotationTangent::Held)), 1.0)?;
        body.set_team(team);
        if let Some(parts) = parts {
            body.set_partition(parts)?;
        }
        body.set_mass(MassKind::Lumped, &Density::Uniform(DENSITY))?;
        body.set_lazy_rule(rule);
        let mut weight = vec![0.0; body.dim()];
        body.add_gravity(&[0.0, -GRAVITY, 0.0], &mut weight);
        let mut held = Subspace::new(body.n_vertices());
        let end = mesh.points().iter().map(|x| x[0]).fold(f64::MIN, f64::max);
        for (vertex, x) in mesh.points().iter().enumerate() {
            if x[0] == end {
                held.set(vertex, Constraint::Fixed).expect("a vertex of the mesh");
            }
        }
        let damping = Damping { mass: 0.0, stiffness: damping };
        let mut integrator = Integrator::new(DynamicsSettings { damping, ..DynamicsSettings::new(dt) }, team);
        let state =
            integrator.start(&mut body, &held, &mut |_, drive: &mut Drive| drive.load.copy_from_slice(&weight))?;
        Ok(Self { body, held, weight, integrator, state })
    }

    fn step(&mut self) -> Result<Step, BenchError> {
        let Self { body, held, weight, integrator, state } = self;
        let (before, since) = (*integrator.times(), Instant::now());
        let report =
            integrator.step(body, held, &mut |_, drive: &mut Drive| drive.load.copy_from_slice(weight), state)?;
        let seconds = since.elapsed().as_secs_f64();
        let (before, after) = (seconds_of(&before), seconds_of(integrator.times()));
        Ok(Step { report, seconds, stages: std::array::from_fn(|k| after[k] - before[k]) })
    }

    /// Displacement in the middle of the face opposite to the clamped one, m: the mean of its nodes.
    fn probe(&self, mesh: &SimplexMesh<3, 4>) -> [f64; 3] {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for (x, u) in mesh.points().iter().zip(self.state.u.as_chunks::<3>().0) {
            if x[0] == 0.0 {
                (0..3).for_each(|k| sum[k] += u[k]);
                count += 1.0;
            }
        }
        sum.map(|sum| sum / count)
    }

    /// A product with the stiffness in the layout that solvers use: what other times are compared with.
    fn product(&mut self) -> Frozen<3> {
        self.body.linearize(&self.state.u);
        Frozen::new(self.body.stiffness())
    }
}

/// Forces, Jacobian, matrix of the step, solve.
fn seconds_of(times: &StageTimes) -> [f64; 4] {
    [times.forces, times.linearize, times.matrix, times.solve].map(|stage| stage.seconds)
}

/// Cells a side, and steps.
fn size(quick: bool) -> (usize, usize) {
    if quick { QUICK } else { (CELLS, STEPS) }
}

fn mesh(quick: bool) -> SimplexMesh<3, 4> {
    jittered_cube(size(quick).0)
}

/// Seconds of a product, from a few in a row after one that warms the caches.
fn product_seconds(frozen: &Frozen<3>, team: &Team, x: &[f64], y: &mut [f64]) -> f64 {
    const REPEATS: u32 = 8;
    frozen.apply_on(team, x, y);
    let since = Instant::now();
    for _ in 0..REPEATS {
        frozen.apply_on(team, std::hint::black_box(x), std::hint::black_box(y));
    }
    since.elapsed().as_secs_f64() / f64::from(REPEATS)
}
