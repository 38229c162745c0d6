//! Finding the equilibrium of a body under its load and constraints, by the method that the scene names.

use crate::scene::{CriterionKind, Method, Model, PreconditionerKind, Scene};
use crate::stages::{Stage, Stages};
use std::time::Instant;
use stylet_physics::body::{Body, Loaded};
use stylet_physics::material::Hyperelastic;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::linear::{CgError, CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::{
    Linearization, NewtonSettings, NewtonWorkspace, NonlinearCgSettings, NonlinearCgWorkspace, NonlinearReport,
    Preconditioning, StepModel, newton_cg, nonlinear_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

/// How a solve went.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SolveOutcome {
    /// Products with the stiffness in conjugate gradient iterations; steps of nonlinear conjugate gradients.
    pub iterations: u64,
    /// Whether the tolerance was reached.
    pub converged: bool,
    /// Norm of the residual over the norm of the forces that it is measured against.
    pub relative_residual: f64,
}

/// A solver with its settings, workspaces and preconditioner. Everything in it but the settings is derived data.
#[derive(Clone, Debug)]
pub struct Equilibrium<const D: usize> {
    method: Method,
    preconditioner: PreconditionerKind,
    tolerance: f64,
    criterion: Criterion,
    /// `E d H eps_round` of (6.9), N, in space `E H^2 eps_round`; over the root of the number of unknowns it is the rounding floor.
    round_force: f64,
    max_iterations: usize,
    totals: Totals,
    cg: CgWorkspace,
    /// The stiffness of a linear body, laid out for products; follows it from solve to solve.
    frozen: Frozen<D>,
    nonlinear_cg: NonlinearCgWorkspace,
    newton: NewtonWorkspace<D>,
    jacobi: Jacobi<D>,
    block_jacobi: BlockJacobi<D>,
    /// Nodes whose diagonal block or constraint has changed since the preconditioner was last brought up to date.
    touched: Vec<usize>,
}

/// Work over all solves.
#[derive(Clone, Copy, PartialEq, Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Totals {
    /// Solves.
    pub solves: u64,
    /// Iterations of all solves.
    pub iterations: u64,
    /// The most iterations of one solve.
    pub most: u64,
    /// Solves that ran out of iterations.
    pub unconverged: u64,
    /// Cycle of the first solve that ran out of iterations, from 1; 0 if none did.
    pub first_unconverged: usize,
    /// Relative residual of the last solve.
    pub relative_residual: f64,
}

impl<const D: usize> Equilibrium<D> {
    /// The solver of a scene. `threads` is the most that a linear solve may use; the bits do not depend on it.
    pub fn new(scene: &Scene, threads: usize) -> Self {
        let stage = &scene.solver;
        let by_model = if scene.material.model == Model::Linear { Method::Cg } else { Method::NewtonCg };
        let team = Team::new(threads);
        let [thickness, height] = scene.mesh.section();
        Self {
            method: stage.method.unwrap_or(by_model),
            preconditioner: stage.preconditioner,
            tolerance: stage.tolerance,
            criterion: match stage.criterion {
                CriterionKind::External => Criterion::External,
                CriterionKind::Reaction => Criterion::Reaction,
            },
            round_force: scene.material.young * thickness * height * stage.round_off,
            max_iterations: stage.max_iterations as usize,
            totals: Totals::default(),
            cg: CgWorkspace::on(&team),
            frozen: Frozen::default(),
            nonlinear_cg: NonlinearCgWorkspace::new(),
            newton: NewtonWorkspace::on(&team),
            jacobi: Jacobi::default(),
            block_jacobi: BlockJacobi::default(),
            touched: Vec::new(),
        }
    }

    /// Work so far.
    pub fn totals(&self) -> &Totals {
        &self.totals
    }

    /// Goes on with the work count of a saved state.
    pub fn set_totals(&mut self, totals: Totals) {
        self.totals = totals;
    }

    /// Whether the Newton method holds a stiffness that it may use again.
    pub fn holds_linearization(&self) -> bool {
        self.newton.is_linearized()
    }

    /// Tells the Newton method that the body's stiffness is one that it evaluated.
    pub fn hold_linearization(&mut self) {
        self.newton.assume_linearized();
    }

    /// Notes that the diagonal block or the constraint of a node has changed.
    pub fn touch(&mut self, node: usize) {
        if self.preconditioner != PreconditionerKind::None && self.method == Method::Cg {
            self.touched.push(node);
        }
    }

    /// Minimises the strain energy minus the work of `load` over the moves that `subspace` allows, from `u`. `cycle` is what
    /// the totals name should the iterations run out.
    ///
    /// # Errors
    /// What the method says when it can go no further. Running out of iterations is no error.
    pub fn solve<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        cycle: usize,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        load: &[f64],
        u: &mut [f64],
        stages: &mut Stages,
    ) -> Result<SolveOutcome, String> {
        let stop = StopRule {
            tolerance: self.tolerance,
            criterion: self.criterion,
            round_floor: self.round_force / (subspace.dofs().max(1) as f64).sqrt(),
        };
        if self.criterion == Criterion::External && stop.round_floor == 0.0 && load.iter().all(|&f| f == 0.0) {
            let found = "solver.criterion: found external where no external force acts and solver.round_off is 0";
            return Err(format!(
                "{found}, so that no residual is small enough; expected reaction, or a round_off above 0"
            ));
        }
        let outcome = match self.method {
            Method::Cg => self.by_cg(body, subspace, load, u, stop),
            Method::NonlinearCg => self.by_nonlinear_cg(body, subspace, load, u, stop, stages),
            Method::NewtonCg => self.by_newton(body, subspace, load, u, stop, stages),
        }?;
        let totals = &mut self.totals;
        totals.solves += 1;
        totals.iterations += outcome.iterations;
        totals.most = totals.most.max(outcome.iterations);
        totals.relative_residual = outcome.relative_residual;
        if !outcome.converged {
            totals.unconverged += 1;
            if totals.first_unconverged == 0 {
                totals.first_unconverged = cycle;
            }
        }
        Ok(outcome)
    }

    fn by_cg<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &Body<D, N, M>,
        subspace: &Subspace<D>,
        load: &[f64],
        u: &mut [f64],
        stop: StopRule,
    ) -> Result<SolveOutcome, String> {
        let a = body.stiffness();
        let settings = CgSettings { stop, max_iterations: self.max_iterations };
        self.follow_touched(a, subspace)?;
        self.frozen.refresh(a);
        let (a, cg) = (&self.frozen, &mut self.cg);
        let report = match self.preconditioner {
            PreconditionerKind::None => projected_cg(a, &Identity, subspace, load, u, &settings, cg),
            PreconditionerKind::Jacobi => projected_cg(a, &self.jacobi, subspace, load, u, &settings, cg),
            PreconditionerKind::BlockJacobi => projected_cg(a, &self.block_jacobi, subspace, load, u, &settings, cg),
        }
        .map_err(|e| format!("conjugate gradients: {e}"))?;
        if report.stop == Stop::Stalled {
            return Err(stalled("conjugate gradients", report.iterations, report.residual_norm, report.threshold));
        }
        Ok(SolveOutcome {
            iterations: report.iterations as u64,
            converged: report.stop == Stop::Converged,
            relative_residual: self.relative(report.residual_norm, norm2(load), report.reaction_norm),
        })
    }

    /// Brings the preconditioner of a linear solve up to date.
    fn follow_touched(&mut self, a: &BlockCsr<D>, subspace: &Subspace<D>) -> Result<(), String> {
        let touched = std::mem::take(&mut self.touched);
        let result = match self.preconditioner {
            PreconditionerKind::None => Ok(()),
            PreconditionerKind::Jacobi if self.totals.solves == 0 => self.jacobi.rebuild(a, subspace),
            PreconditionerKind::Jacobi => self.jacobi.update_nodes(a, subspace, touched.iter().copied()),
            PreconditionerKind::BlockJacobi if self.totals.solves == 0 => self.block_jacobi.rebuild(a, subspace),
            PreconditionerKind::BlockJacobi => self.block_jacobi.update_nodes(a, subspace, touched.iter().copied()),
        };
        self.touched = touched;
        self.touched.clear();
        result.map_err(|e| format!("preconditioner: {e}"))
    }

    fn by_nonlinear_cg<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        load: &[f64],
        u: &mut [f64],
        stop: StopRule,
        stages: &mut Stages,
    ) -> Result<SolveOutcome, String> {
        let step = if M::IS_LINEAR { StepModel::Curvature } else { StepModel::Secant };
        let settings =
            NonlinearCgSettings { max_iterations: self.max_iterations, step, ..NonlinearCgSettings::new(stop) };
        // The diagonal of the tangent at the start serves the whole solve; where it is not positive definite, nothing does.
        let mut usable = true;
        if self.preconditioner != PreconditionerKind::None {
            let since = Instant::now();
            body.linearize(u);
            if !M::IS_LINEAR {
                stages.lap(Stage::Linearize, since);
            }
            let a = body.stiffness();
            usable = match self.preconditioner {
                PreconditionerKind::Jacobi => self.jacobi.rebuild(a, subspace),
                _ => self.block_jacobi.rebuild(a, subspace),
            }
            .is_ok();
        }
        let preconditioner: &dyn Preconditioner = match self.preconditioner {
            PreconditionerKind::Jacobi if usable => &self.jacobi,
            PreconditionerKind::BlockJacobi if usable => &self.block_jacobi,
            _ => &Identity,
        };
        let external = norm2(load);
        let mut timed = Timed { inner: Loaded::new(body, load), stages };
        let mut energy: &mut dyn BlockHessian<D> = &mut timed;
        let report =
            nonlinear_cg(&mut energy, preconditioner, subspace, external, u, &settings, &mut self.nonlinear_cg)
                .map_err(|e| format!("nonlinear conjugate gradients: {e}"))?;
        self.outcome("nonlinear conjugate gradients", &report, report.iterations, external)
    }

    fn by_newton<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        load: &[f64],
        u: &mut [f64],
        stop: StopRule,
        stages: &mut Stages,
    ) -> Result<SolveOutcome, String> {
        let settings = NewtonSettings {
            max_iterations: self.max_iterations,
            max_inner_iterations: self.max_iterations,
            linearization: Linearization::WhenSlow,
            preconditioning: match self.preconditioner {
                PreconditionerKind::None => Preconditioning::None,
                PreconditionerKind::Jacobi => Preconditioning::Jacobi,
                PreconditionerKind::BlockJacobi => Preconditioning::BlockJacobi,
            },
            ..NewtonSettings::new(stop)
        };
        let external = norm2(load);
        let mut timed = Timed { inner: Loaded::new(body, load), stages };
        let mut energy: &mut dyn BlockHessian<D> = &mut timed;
        let report = newton_cg(&mut energy, subspace, external, u, &settings, &mut self.newton)
            .map_err(|e| format!("Newton-CG: {e}"))?;
        self.outcome("Newton-CG", &report, report.inner_iterations, external)
    }

    fn outcome(
        &self,
        method: &str,
        report: &NonlinearReport,
        iterations: usize,
        external: f64,
    ) -> Result<SolveOutcome, String> {
        if report.stop == Stop::Stalled {
            return Err(stalled(method, report.iterations, report.residual_norm, report.threshold));
        }
        Ok(SolveOutcome {
            iterations: iterations as u64,
            converged: report.stop == Stop::Converged,
            relative_residual: self.relative(report.residual_norm, external, report.reaction_norm),
        })
    }

    fn relative(&self, residual: f64, external: f64, reaction: f64) -> f64 {
        let scale = match self.criterion {
            Criterion::External => external,
            Criterion::Reaction => external.hypot(reaction),
        };
        if scale > 0.0 { residual / scale } else { 0.0 }
    }

    /// Sets the tolerance of the following solves to `share` of the scene's, and returns the one before.
    pub fn tighten(&mut self, share: f64) -> f64 {
        let before = self.tolerance;
        self.tolerance = (share * before).max(1e-12);
        before
    }

    /// Sets the tolerance back.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// Moves the nodes that are not constrained along with those that are: the free part of `way` solves `K way = 0`, to a
    /// tolerance that suits a first guess. A stiffness that is not positive definite leaves it where it has come to.
    ///
    /// # Errors
    /// What the solver says.
    pub fn carry_along(&mut self, a: &BlockCsr<D>, subspace: &Subspace<D>, way: &mut [f64]) -> Result<(), String> {
        let stop = StopRule { tolerance: 1e-2, criterion: Criterion::Reaction, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: 1000 };
        let nothing = vec![0.0; way.len()];
        match projected_cg(a, &Identity, subspace, &nothing, way, &settings, &mut self.cg) {
            Ok(_) | Err(CgError::NotPositiveDefinite { .. }) => Ok(()),
            Err(e) => Err(format!("moving the tissue along with the needle: {e}")),
        }
    }

    /// The gradient of the strain energy at a node after a solve, N.
    pub fn elastic_force(&self, load: &[f64], node: usize) -> [f64; D] {
        let of =
            |gradient: &[f64], sign: f64| std::array::from_fn(|k| load[D * node + k] + sign * gradient[D * node + k]);
        match self.method {
            Method::Cg => of(self.cg.residual(), -1.0),
            Method::NonlinearCg => of(self.nonlinear_cg.gradient(), 1.0),
            Method::NewtonCg => of(self.newton.gradient(), 1.0),
        }
    }
}

fn stalled(method: &str, iterations: usize, residual: f64, threshold: f64) -> String {
    format!(
        "{method} stalls after {iterations} iterations at a residual of {residual:.3e} N, expected {threshold:.3e} N"
    )
}

/// An energy whose evaluations are entered into the stages of a run; a linear body has none of its own.
struct Timed<'a, E> {
    inner: E,
    stages: &'a mut Stages,
}

impl<E: MaybeLinear> Energy for Timed<'_, E> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        let since = Instant::now();
        let value = self.inner.value(x);
        if !E::LINEAR {
            self.stages.lap(Stage::Force, since);
        }
        value
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        let since = Instant::now();
        self.inner.gradient(x, g);
        if !E::LINEAR {
            self.stages.lap(Stage::Force, since);
        }
    }

    fn linearize(&mut self, x: &[f64]) {
        let since = Instant::now();
        self.inner.linearize(x);
        if !E::LINEAR {
            self.stages.lap(Stage::Linearize, since);
        }
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.inner.hessian_apply(p, hp);
    }

    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        self.inner.max_step(x, p, limit)
    }
}

impl<const D: usize, E: MaybeLinear + BlockHessian<D>> BlockHessian<D> for Timed<'_, E> {
    fn matrix(&self) -> &BlockCsr<D> {
        self.inner.matrix()
    }
}

/// An energy that says whether its gradient is a matrix product.
trait MaybeLinear: Energy {
    const LINEAR: bool;
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> MaybeLinear for Loaded<'_, Body<D, N, M>> {
    const LINEAR: bool = M::IS_LINEAR;
}
