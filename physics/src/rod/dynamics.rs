//! A rod alone in time.
//!
//! ```text
//! M a + D v = F(x),   D = damping.mass M + damping.stiffness K,   x1 = x^ + cx a1,  v1 = v^ + cv a1  (see Scheme)
//!
//! linearised  (M + cv D + cx K) a1 = F(x0) - K (x^ - x0) - D v^        one banded factor and solve
//! Newton      x1 minimises the incremental potential                   one for each iteration
//! ```

use super::banded::{BandedError, BandedFactor};
use super::incremental::{Incremental, add_mass, apply_damping, combine};
use super::potential::Twist;
use super::{HeldEnds, Rod, RodError, RodLoad, RodPotential, Tangent, parallel_transport};
use crate::dynamics::{Coefficients, Damping, Scheme, Solution};
use serde::{Deserialize, Serialize};
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::nonlinear::{NewtonSettings, NewtonWorkspace, NonlinearError, newton_cg_with};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector::norm2;

/// How a rod is taken through time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodDynamicsSettings {
    /// The scheme.
    pub scheme: Scheme,
    /// Length of a step, s.
    pub dt: f64,
    /// What is solved in a step; in the minimisation the tangent is exact.
    pub solution: Solution,
    /// Tangent of linearised steps. Where the exact one does not give a definite matrix, Gauss-Newton's is taken instead, which
    /// leaves out the derivatives of twist and of the couple.
    pub tangent: Tangent,
    /// Whether twist is taken at the end of the step with the other forces, rather than at its start.
    pub implicit_twist: bool,
    /// Damping.
    pub damping: Damping,
    /// Residual of Newton's method as a share of elastic, inertial and external forces at the start of the step;
    /// [`Rod::force_round_off`] is always allowed besides.
    pub tolerance: f64,
}

impl RodDynamicsSettings {
    /// The trapezoid rule with one linearised step of length `dt` (s), exact tangent, explicit twist, no damping; 1e-8.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self {
            scheme: Scheme::TRAPEZOID,
            dt,
            solution: Solution::Linearised,
            tangent: Tangent::Exact,
            implicit_twist: false,
            damping: Damping::default(),
            tolerance: 1e-8,
        }
    }

    fn validate(&self) -> Result<(), RodDynamicsError> {
        let refuse = |name, value, expected| Err(RodDynamicsError::Setting { name, value, expected });
        let positive = |value: f64| value > 0.0 && value.is_finite();
        if !positive(self.dt) {
            return refuse("dt", self.dt, "a positive time, s");
        }
        if !positive(self.tolerance) {
            return refuse("tolerance", self.tolerance, "a positive number");
        }
        if let Scheme::Newmark { beta, gamma } = self.scheme {
            if !(beta > 0.0 && beta <= 0.5) {
                return refuse("beta", beta, "above 0 and at most 1/2");
            }
            if !(0.5..=1.0).contains(&gamma) {
                return refuse("gamma", gamma, "1/2 to 1");
            }
        }
        for (name, value) in [("damping.mass", self.damping.mass), ("damping.stiffness", self.damping.stiffness)] {
            if !(value >= 0.0 && value.is_finite()) {
                return refuse(name, value, "zero or more");
            }
        }
        Ok(())
    }
}

/// A rod in motion; with the angles of the rod all that a run needs to go on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RodState {
    /// Time, s.
    pub t: f64,
    /// Positions, m, three numbers for each node.
    pub x: Vec<f64>,
    /// Velocities, m/s. Constrained nodes keep theirs from step to step: they move as the caller sets it.
    pub v: Vec<f64>,
    /// Accelerations, m/s^2.
    pub a: Vec<f64>,
    /// The base director, across the first edge; it turns with that edge without spinning.
    pub base_director: [f64; 3],
}

impl RodState {
    /// At rest at time zero.
    #[must_use]
    pub fn at_rest(x: Vec<f64>, base_director: [f64; 3]) -> Self {
        let n = x.len();
        Self { t: 0.0, x, v: vec![0.0; n], a: vec![0.0; n], base_director }
    }

    fn first_tangent(&self) -> [f64; 3] {
        let edge: [f64; 3] = std::array::from_fn(|k| self.x[3 + k] - self.x[k]);
        let length = norm2(&edge);
        edge.map(|e| e / length)
    }
}

/// Energies and momenta of a rod in motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodBalance {
    /// Bending, stretch and twist, J.
    pub elastic: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Momentum, kg m/s.
    pub momentum: [f64; 3],
    /// Moment of momentum about the origin, kg m^2/s.
    pub angular_momentum: [f64; 3],
}

impl RodBalance {
    /// Of a rod in a state.
    ///
    /// # Panics
    /// If the state has another number of nodes than the rod.
    #[must_use]
    pub fn of(rod: &mut Rod, state: &RodState) -> Self {
        let elastic = rod.energy(&state.x, &state.base_director);
        let (mut kinetic, mut momentum, mut angular_momentum) = (0.0, [0.0; 3], [0.0; 3]);
        for (node, (x, v)) in state.x.as_chunks::<3>().0.iter().zip(state.v.as_chunks::<3>().0).enumerate() {
            let p = v.map(|v| rod.node_mass(node) * v);
            for k in 0..3 {
                let (k1, k2) = ((k + 1) % 3, (k + 2) % 3);
                kinetic += 0.5 * p[k] * v[k];
                momentum[k] += p[k];
                angular_momentum[k] += x[k1] * p[k2] - x[k2] * p[k1];
            }
        }
        Self { elastic, kinetic, momentum, angular_momentum }
    }
}

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

/// Why a step could not be made; the state is then that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodDynamicsError {
    /// A setting is out of range.
    #[error("{name} is {value}, expected {expected}")]
    Setting {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What was expected.
        expected: &'static str,
    },
    /// Rod, load or state are refused, or the angles do not settle.
    #[error(transparent)]
    Rod(#[from] RodError),
    /// The matrix of the step has no factor.
    #[error("the matrix of the step at t = {t} s: {source}")]
    Matrix {
        /// Time before the step, s.
        t: f64,
        /// Why.
        source: BandedError,
    },
    /// The minimisation is refused.
    #[error(transparent)]
    Nonlinear(#[from] NonlinearError),
    /// Newton's method ended above the tolerance.
    #[error(
        "step at t = {t} s: {stop:?} after {iterations} iterations, residual {residual:e} N, threshold {threshold:e} N"
    )]
    NotConverged {
        /// Time before the step, s.
        t: f64,
        /// Why it ended.
        stop: Stop,
        /// Iterations made.
        iterations: usize,
        /// Residual, N.
        residual: f64,
        /// What it should have come down to, N.
        threshold: f64,
    },
    /// A number of the state at the end of the step is not finite.
    #[error("node {node} has no finite place after the step at t = {t} s")]
    NotFinite {
        /// The first such node.
        node: usize,
        /// Time before the step, s.
        t: f64,
    },
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
        self.begin(rod, step, state)?;
        let angles = rod.angles().to_vec();
        let made = self.attempt(rod, step, state);
        match made {
            Ok(report) => {
                std::mem::swap(state, &mut self.next);
                Ok(report)
            }
            Err(error) => {
                rod.set_angles(&angles)?;
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
            super::error::shape(name, len, dim)?;
        }
        for (name, values) in [
            ("position", &state.x[..]),
            ("velocity", &state.v),
            ("acceleration", &state.a),
            ("load", &step.load.forces),
            ("couple", &step.load.couple),
        ] {
            super::check_finite(name, values)?;
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
        self.next.clone_from(state);
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
        let settings = step.settings;
        let mut kinds = match settings.tangent {
            Tangent::Exact => [Tangent::Exact, Tangent::GaussNewton].iter(),
            Tangent::GaussNewton => [Tangent::GaussNewton].iter(),
        };
        let mut factors = 0;
        while let Some(&kind) = kinds.next() {
            let exact = kind == Tangent::Exact;
            // The derivatives of twist and of the couple are indefinite too.
            rod.tangent(&state.x, &state.base_director, kind, exact && settings.implicit_twist, &mut self.stiffness);
            if exact {
                step.load.add_tangent(&state.x, &mut self.stiffness);
            }
            self.matrix.clone_from(&self.stiffness);
            combine(&mut self.matrix, c.cx + c.cv * settings.damping.stiffness, None);
            add_mass(&mut self.matrix, &self.mass, 1.0 + c.cv * settings.damping.mass);
            factors += 1;
            let factored = self.factor.factor(&self.matrix, step.subspace);
            let definite = factored.is_ok() && self.factor.n_negative() == 0;
            if definite || kinds.len() == 0 {
                factored.map_err(|source| RodDynamicsError::Matrix { t: state.t, source })?;
                self.solve_linearised(settings, state);
                let gauss_newton = !exact;
                return Ok(RodStepReport { t: state.t + c.h, factors, gauss_newton, residual: 0.0 });
            }
        }
        unreachable!("the last kind of tangent returns")
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
