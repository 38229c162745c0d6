//! A rod alone in time.
//!
//! ```text
//! M a + D v = F(x),   D = damping.mass M + damping.stiffness K,   x1 = x^ + cx a1,  v1 = v^ + cv a1  (see Scheme)
//!
//! linearised  (M + cv D + cx K) a1 = F(x0) - K (x^ - x0) - D v^        one banded factor and solve
//! Newton      x1 minimises the incremental potential                   one for each iteration
//! ```

mod error;
mod incremental;
mod settings;
mod state;

pub use error::RodDynamicsError;
pub use settings::RodDynamicsSettings;
pub use state::{RodBalance, RodState};

use super::banded::{BandedError, BandedFactor};
use super::check_finite;
use super::error::shape;
use super::potential::Twist;
use super::{HeldEnds, Rod, RodError, RodLoad, RodPotential, Tangent, parallel_transport};
use crate::dynamics::{Coefficients, Solution};
use incremental::{Incremental, add_mass, apply_damping, copy_scaled};
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::nonlinear::{NewtonSettings, NewtonWorkspace, newton_cg_with};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector::norm2;

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodStepReport {
    /// Time at its end, s.
    pub t: f64,
    /// Factors that were made.
    pub factors: usize,
    /// Whether the exact tangent was given up for Gauss-Newton's.
    pub gauss_newton: bool,
    /// Residual of Newton's method, N; zero after a linearised step.
    pub residual: f64,
}

/// Takes a rod through time; keeps what steps need to work.
#[derive(Debug, Default)]
pub struct RodIntegrator {
    mass: Vec<f64>,
    stiffness: BlockCsr<3>,
    matrix: BlockCsr<3>,
    factor: BandedFactor,
    newton: NewtonWorkspace<3>,
    x_hat: Vec<f64>,
    v_hat: Vec<f64>,
    force: Vec<f64>,
    twist: Vec<f64>,
    /// Angles before the step.
    angles: Vec<f64>,
    /// The state at its end.
    next: RodState,
    scratch: [Vec<f64>; 2],
}

/// What acts on the rod in a step.
#[derive(Clone, Copy, Debug)]
pub struct RodStep<'a> {
    /// How the step is made.
    pub settings: &'a RodDynamicsSettings,
    /// The load at the end of the step.
    pub load: &'a RodLoad,
    /// How the ends are kept from spinning.
    pub ends: &'a HeldEnds,
    /// Which nodes move how.
    pub subspace: &'a Subspace<3>,
}

impl RodIntegrator {
    /// An integrator that has kept nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Settles the angles and finds the accelerations of free nodes from the forces on them; those of constrained ones become
    /// zero where they are constrained. To be called before the first step, and when the rod has been changed.
    ///
    /// # Errors
    /// [`RodDynamicsError`]; the accelerations are then as they were.
    pub fn start(&mut self, rod: &mut Rod, step: &RodStep<'_>, state: &mut RodState) -> Result<(), RodDynamicsError> {
        self.begin(rod, step, state)?;
        self.forces(rod, step, state);
        rod.tangent(&state.x, &state.base_director, Tangent::Exact, step.settings.implicit_twist, &mut self.stiffness);
        let [_, damping] = &mut self.scratch;
        apply_damping(step.settings.damping, &self.stiffness, &self.mass, &state.v, damping);
        let mut a: Vec<f64> = (0..state.x.len()).map(|i| (self.force[i] - damping[i]) / self.mass[i / 3]).collect();
        step.subspace.project(&mut a);
        state.a = a;
        Ok(())
    }

    /// One step. Constrained moves go on at the velocity that the state has there.
    ///
    /// # Errors
    /// [`RodDynamicsError`]; state and angles are then those before the step.
    pub fn step(
        &mut self,
        rod: &mut Rod,
        step: &RodStep<'_>,
        state: &mut RodState,
    ) -> Result<RodStepReport, RodDynamicsError> {
        self.angles.clear();
        self.angles.extend_from_slice(rod.angles());
        match self.begin(rod, step, state).and_then(|()| self.attempt(rod, step, state)) {
            Ok(report) => {
                std::mem::swap(state, &mut self.next);
                Ok(report)
            }
            Err(error) => {
                rod.set_angles(&self.angles)?;
                Err(error)
            }
        }
    }

    fn begin(&mut self, rod: &mut Rod, step: &RodStep<'_>, state: &RodState) -> Result<(), RodDynamicsError> {
        step.settings.validate()?;
        let dim = 3 * rod.n_nodes();
        for (name, len) in [
            ("positions", state.x.len()),
            ("velocities", state.v.len()),
            ("accelerations", state.a.len()),
            ("loads", step.load.forces.len()),
            ("subspace", step.subspace.dim()),
        ] {
            shape(name, len, dim)?;
        }
        for (name, values) in [
            ("position", &state.x[..]),
            ("velocity", &state.v),
            ("acceleration", &state.a),
            ("load", &step.load.forces),
            ("couple", &step.load.couple),
        ] {
            check_finite(name, values)?;
        }
        rod.settle_held(&state.x, &state.base_director, step.ends)?;
        self.mass.clear();
        self.mass.extend((0..rod.n_nodes()).map(|node| rod.node_mass(node)));
        let [v, dv] = &mut self.scratch;
        for vector in [&mut self.x_hat, &mut self.v_hat, &mut self.force, &mut self.twist, v, dv] {
            vector.resize(dim, 0.0);
        }
        Ok(())
    }

    /// Elastic and external forces at the start of the step, and those of twist by themselves.
    fn forces(&mut self, rod: &mut Rod, step: &RodStep<'_>, state: &RodState) {
        self.force.fill(0.0);
        self.twist.fill(0.0);
        rod.add_force(&state.x, &state.base_director, &mut self.force);
        rod.add_twist_force(&state.x, &state.base_director, &mut self.twist);
        self.force.iter_mut().zip(&self.twist).for_each(|(f, t)| *f += t);
        step.load.add_force(&state.x, &mut self.force);
    }

    fn attempt(
        &mut self,
        rod: &mut Rod,
        step: &RodStep<'_>,
        state: &RodState,
    ) -> Result<RodStepReport, RodDynamicsError> {
        let settings = step.settings;
        let c = settings.scheme.coefficients(settings.dt);
        self.forces(rod, step, state);
        self.next.x.clone_from(&state.x);
        self.next.v.clone_from(&state.v);
        self.next.a.clone_from(&state.a);
        step.subspace.project(&mut self.next.a);
        for i in 0..state.x.len() {
            self.x_hat[i] = state.x[i] + c.h * state.v[i] + c.u_a0 * self.next.a[i];
            self.v_hat[i] = state.v[i] + c.v_a0 * self.next.a[i];
        }
        let report = match settings.solution {
            Solution::Linearised => self.linearised(rod, step, state, &c)?,
            Solution::Newton { max_iterations } => self.newton(rod, step, state, &c, max_iterations)?,
        };
        let next = &mut self.next;
        for i in 0..next.x.len() {
            next.x[i] = self.x_hat[i] + c.cx * next.a[i];
            next.v[i] = self.v_hat[i] + c.cv * next.a[i];
        }
        if let Some(i) = next.x.iter().position(|x| !x.is_finite()) {
            return Err(RodDynamicsError::NotFinite { node: i / 3, t: state.t });
        }
        next.t = report.t;
        next.base_director = parallel_transport(state.base_director, state.first_tangent(), next.first_tangent());
        if next.base_director.iter().any(|d| !d.is_finite()) {
            return Err(RodError::Degenerate { edge: 0 }.into());
        }
        rod.settle_held(&next.x, &next.base_director, step.ends)?;
        Ok(report)
    }

    /// Leaves the accelerations at the end in `next`.
    fn linearised(
        &mut self,
        rod: &mut Rod,
        step: &RodStep<'_>,
        state: &RodState,
        c: &Coefficients,
    ) -> Result<RodStepReport, RodDynamicsError> {
        let exact = step.settings.tangent == Tangent::Exact;
        let definite = exact && matches!(self.build(rod, step, state, c, Tangent::Exact), Ok(true));
        if !definite {
            let built = self.build(rod, step, state, c, Tangent::GaussNewton);
            built.map_err(|source| RodDynamicsError::Matrix { t: state.t, source })?;
        }
        self.solve_linearised(step.settings, state);
        let gauss_newton = exact && !definite;
        Ok(RodStepReport { t: state.t + c.h, factors: 1 + usize::from(gauss_newton), gauss_newton, residual: 0.0 })
    }

    /// Factors the matrix of a linearised step; whether it is positive definite.
    fn build(
        &mut self,
        rod: &mut Rod,
        step: &RodStep<'_>,
        state: &RodState,
        c: &Coefficients,
        kind: Tangent,
    ) -> Result<bool, BandedError> {
        // The derivatives of twist and of the couple are indefinite, as what the exact tangent has besides Gauss-Newton's.
        let exact = kind == Tangent::Exact;
        let twist = exact && step.settings.implicit_twist;
        rod.tangent(&state.x, &state.base_director, kind, twist, &mut self.stiffness);
        if exact {
            step.load.add_tangent(&state.x, &mut self.stiffness);
        }
        let damping = step.settings.damping;
        copy_scaled(&mut self.matrix, &self.stiffness, c.cx + c.cv * damping.stiffness);
        add_mass(&mut self.matrix, &self.mass, 1.0 + c.cv * damping.mass);
        self.factor.factor(&self.matrix, step.subspace)?;
        Ok(self.factor.n_negative() == 0)
    }

    fn solve_linearised(&mut self, settings: &RodDynamicsSettings, state: &RodState) {
        let [moved, product] = &mut self.scratch;
        let a = &mut self.next.a;
        for i in 0..a.len() {
            moved[i] = self.x_hat[i] - state.x[i];
        }
        self.stiffness.apply(moved, product);
        for i in 0..a.len() {
            a[i] = self.force[i] - product[i];
        }
        apply_damping(settings.damping, &self.stiffness, &self.mass, &self.v_hat, product);
        a.iter_mut().zip(&*product).for_each(|(a, d)| *a -= d);
        self.factor.solve(a);
    }

    /// Leaves the accelerations at the end in `next`.
    fn newton(
        &mut self,
        rod: &mut Rod,
        step: &RodStep<'_>,
        state: &RodState,
        c: &Coefficients,
        max_iterations: usize,
    ) -> Result<RodStepReport, RodDynamicsError> {
        let settings = step.settings;
        if settings.damping.stiffness > 0.0 {
            rod.tangent(&state.x, &state.base_director, Tangent::GaussNewton, false, &mut self.stiffness);
        }
        let inertia = (0..state.x.len()).map(|i| (self.mass[i / 3] * state.v[i] / c.h).powi(2)).sum::<f64>().sqrt();
        let external = norm2(&self.force) + norm2(&step.load.forces) + inertia;
        // Accelerations that places cannot tell from each other, times the mass.
        let place = 4.0 * f64::EPSILON * state.x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let round_floor = rod.force_round_off(&state.x) + place * norm2(&self.mass) / c.cx;
        let stop = StopRule { tolerance: settings.tolerance, criterion: Criterion::External, round_floor };
        let newton = NewtonSettings { max_iterations, ..NewtonSettings::new(stop) };
        let twist = if settings.implicit_twist { Twist::Implicit } else { Twist::Explicit(&self.twist) };
        let potential = RodPotential::new(rod, state.base_director, step.load, step.ends)?;
        let mut energy = Incremental {
            potential: potential.with(twist, std::mem::take(&mut self.matrix)),
            coefficients: *c,
            damping: settings.damping,
            stiffness: &self.stiffness,
            mass: &self.mass,
            x_hat: &self.x_hat,
            v_hat: &self.v_hat,
            scratch: &mut self.scratch,
        };
        let x = &mut self.next.x;
        choose_start(&mut energy, step.subspace, &state.x, x);
        self.newton.invalidate();
        let solved =
            newton_cg_with(&mut energy, &mut self.factor, step.subspace, external, x, &newton, &mut self.newton);
        self.matrix = energy.potential.into_matrix();
        let solved = solved?;
        if solved.stop != Stop::Converged {
            let (stop, iterations) = (solved.stop, solved.iterations);
            let (residual, threshold) = (solved.residual_norm, solved.threshold);
            return Err(RodDynamicsError::NotConverged { t: state.t, stop, iterations, residual, threshold });
        }
        for i in 0..x.len() {
            self.next.a[i] = (x[i] - self.x_hat[i]) / c.cx;
        }
        let residual = solved.residual_norm;
        Ok(RodStepReport { t: state.t + c.h, factors: solved.linearizations, gauss_newton: false, residual })
    }
}

/// Leaves in `x` where an iteration starts: the prediction, or the old place where nodes are free if that has less energy, as
/// where the prediction has stretched a stiff rod.
fn choose_start(energy: &mut Incremental<'_>, w: &Subspace<3>, old: &[f64], x: &mut [f64]) {
    x.copy_from_slice(energy.x_hat);
    let predicted = energy.value(x);
    for ((x, old), hat) in x.iter_mut().zip(old).zip(energy.x_hat) {
        *x = old - hat;
    }
    w.project(x);
    x.iter_mut().zip(energy.x_hat).for_each(|(x, hat)| *x += hat);
    if energy.value(x) > predicted {
        x.copy_from_slice(energy.x_hat);
    }
}
