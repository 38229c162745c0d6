//! Static equilibrium: `dW/du = f` on the free moves, by a method of choice, with load steps where one step is too far, and
//! a diagnosis of what stands in the way.

mod diagnosis;
mod error;
mod linear;
mod preconditioner;
mod report;
mod settings;
mod steps;

pub use diagnosis::{Finding, Motion, examine_constraints, examine_load, examine_material, inverted_cells};
pub use error::StaticError;
pub use report::StaticReport;
pub use settings::{Preconditioning, StaticMethod, StaticSettings};

use crate::body::Body;
use crate::material::Hyperelastic;
use linear::solve_linear;
use preconditioner::AnyPreconditioner;
use stylet_mesh::CellId;
use stylet_solver::energy::Energy;
use stylet_solver::linear::CgWorkspace;
use stylet_solver::nonlinear::{LbfgsWorkspace, NewtonWorkspace, NonlinearCgWorkspace};
use stylet_solver::sparse::Frozen;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// Vectors of static solves; a second one of the same size allocates little.
#[derive(Debug, Default)]
pub struct StaticWorkspace<const D: usize> {
    cg: CgWorkspace,
    frozen: Frozen<D>,
    nonlinear: NonlinearCgWorkspace,
    lbfgs: LbfgsWorkspace,
    newton: NewtonWorkspace<D>,
    preconditioner: AnyPreconditioner<D>,
    /// Bytes of the factor of the last direct solve, which is not kept.
    direct: usize,
}

impl<const D: usize> StaticWorkspace<D> {
    /// An empty workspace whose linear solves are shared by a team; the bits do not depend on it.
    #[must_use]
    pub fn on(team: &Team) -> Self {
        Self {
            cg: CgWorkspace::on(team),
            nonlinear: NonlinearCgWorkspace::on(team),
            lbfgs: LbfgsWorkspace::on(team),
            newton: NewtonWorkspace::on(team),
            ..Self::default()
        }
    }

    /// Bytes that vectors, matrices and the preconditioner take, spare room included, and those of the factor of a direct solve.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        self.cg.memory_bytes()
            + self.frozen.memory_bytes()
            + self.nonlinear.memory_bytes()
            + self.lbfgs.memory_bytes()
            + self.newton.memory_bytes()
            + self.preconditioner.memory_bytes()
            + self.direct
    }
}

/// Finds the displacement `u` (m) at which elastic forces balance the dead `load` (N) on the moves of `subspace`.
///
/// Vectors are flat, `D` entries per vertex. On entry `u` is the start and satisfies the constraints (prescribed
/// displacements are values of `u` on constrained nodes); on exit it is the equilibrium. Nonlinear materials try the load
/// in steps of adaptive size, each from the equilibrium of the one before.
///
/// # Errors
/// [`StaticError`].
pub fn solve_static<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    load: &[f64],
    u: &mut [f64],
    settings: &StaticSettings,
    workspace: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    check_len("the load", body.dim(), load.len())?;
    let mut scale = |factor: f64, scaled: &mut [f64], _: &mut [f64]| {
        scaled.iter_mut().zip(load).for_each(|(scaled, load)| *scaled = factor * load);
    };
    solve_static_program(body, subspace, &mut scale, u, settings, workspace)
}

/// What [`solve_static_program`] follows: `program(s, load, u)`.
pub type Program<'a> = dyn FnMut(f64, &mut [f64], &mut [f64]) + 'a;

/// As [`solve_static`], along a program: `program(s, load, u)` writes the load (N) at the share `s` of the way, in `[0, 1]`,
/// and into `u` the displacements that are prescribed there on constrained nodes, none else. Large prescribed motions, such
/// as a twist, are followed in as many steps as it takes.
///
/// # Errors
/// [`StaticError`].
pub fn solve_static_program<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &mut Body<D, N, M>,
    subspace: &Subspace<D>,
    program: &mut Program,
    u: &mut [f64],
    settings: &StaticSettings,
    workspace: &mut StaticWorkspace<D>,
) -> Result<StaticReport, StaticError> {
    let dim = body.dim();
    check_len("u", dim, u.len())?;
    check_len("the subspace", dim, subspace.dim())?;
    settings.validate()?;
    if settings.method.is_linear() {
        let mut load = vec![0.0; dim];
        program(1.0, &mut load, u);
        return solve_linear(body, subspace, &load, u, settings, workspace);
    }
    if body.requires_positive_j() && body.inverted(u).is_some() {
        let (cell, jacobian) = body.smallest_jacobian(u).unwrap_or((CellId(0), f64::NAN));
        return Err(StaticError::InvertedAtStart { cell, jacobian });
    }
    steps::step_load(body, subspace, program, u, settings, workspace)
}

fn check_len(what: &'static str, dim: usize, len: usize) -> Result<(), StaticError> {
    if len == dim { Ok(()) } else { Err(StaticError::Shape { what, dim, len }) }
}
