//! Steps in time: the door, halving and adaptive length.

use super::attempt::{Attempt, Outcome};
use super::error::Setback;
use super::following::Following;
use super::{Balance, DynamicsError, DynamicsSettings, StageTimes, State, StepPreconditioner, StepReport};
use crate::body::Body;
use crate::material::Hyperelastic;
use stylet_mesh::CellId;
use stylet_solver::LinearOperator;
use stylet_solver::energy::Energy;
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::NewtonWorkspace;
use stylet_solver::precondition::{BlockJacobi, Identity};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use stylet_solver::vector::{self, first_not_finite};

/// What drives a body at one time, filled in by the caller. Vectors are flat, and hold what they held at the last call.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drive {
    /// External forces, N; zero at the first call.
    pub load: Vec<f64>,
    /// Where constrained nodes are, m: read on the constrained directions alone.
    pub displacement: Vec<f64>,
    /// How they move there, m/s.
    pub velocity: Vec<f64>,
}

/// Takes a body through time.
///
/// It owns matrices and vectors, sized by the first step: a second one on the same mesh allocates nothing but for what
/// conjugate gradients do. What moves is the [`State`].
pub struct Integrator<const D: usize> {
    pub(crate) settings: DynamicsSettings,
    pub(crate) team: Team,
    pub(crate) preconditioner: Box<dyn StepPreconditioner<D>>,
    pub(crate) drive: Drive,
    pub(crate) matrix: Following<D>,
    pub(crate) frozen: Frozen<D>,
    pub(crate) lagged: BlockCsr<D>,
    pub(crate) lagged_number: u64,
    pub(crate) cg: CgWorkspace,
    pub(crate) newton: NewtonWorkspace<D>,
    pub(crate) u_hat: Vec<f64>,
    pub(crate) v_hat: Vec<f64>,
    pub(crate) rhs: Vec<f64>,
    pub(crate) scratch: [Vec<f64>; 3],
    /// The end of the step that is being attempted.
    pub(crate) u: Vec<f64>,
    pub(crate) v: Vec<f64>,
    pub(crate) a: Vec<f64>,
    /// What rounding errors leave of a residual, N, and the number of elements that it was found for.
    pub(crate) round_off: f64,
    /// The same of the strain energy, J.
    pub(crate) energy_round_off: f64,
    round_off_of: usize,
    pub(crate) times: StageTimes,
    /// The state at the start of a part of a step that is made of several.
    part: State,
}

impl<const D: usize> Integrator<D> {
    /// Steps whose linear solves are shared by a team; the bits do not depend on it. Preconditioned by block Jacobi.
    #[must_use]
    pub fn new(settings: DynamicsSettings, team: &Team) -> Self {
        Self {
            settings,
            team: team.clone(),
            preconditioner: Box::new(BlockJacobi::<D>::default()),
            drive: Drive::default(),
            matrix: Following::default(),
            frozen: Frozen::default(),
            lagged: BlockCsr::new(0),
            lagged_number: 0,
            cg: CgWorkspace::on(team),
            newton: NewtonWorkspace::on(team),
            u_hat: Vec::new(),
            v_hat: Vec::new(),
            rhs: Vec::new(),
            scratch: Default::default(),
            u: Vec::new(),
            v: Vec::new(),
            a: Vec::new(),
            round_off: 0.0,
            energy_round_off: 0.0,
            round_off_of: 0,
            times: StageTimes::default(),
            part: State::default(),
        }
    }

    /// Preconditions by another method from now on.
    pub fn set_preconditioner(&mut self, preconditioner: impl StepPreconditioner<D> + 'static) {
        self.preconditioner = Box::new(preconditioner);
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &DynamicsSettings {
        &self.settings
    }

    /// What it has spent so far, by stage.
    #[must_use]
    pub fn times(&self) -> &StageTimes {
        &self.times
    }

    /// Bytes of matrices, vectors and solvers, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let Drive { load, displacement, velocity } = &self.drive;
        let [x, y, z] = &self.scratch;
        let State { u, v, a, .. } = &self.part;
        let (u_hat, v_hat, rhs) = (&self.u_hat, &self.v_hat, &self.rhs);
        let vectors = [load, displacement, velocity, u_hat, v_hat, rhs, x, y, z, &self.u, &self.v, &self.a, u, v, a];
        self.matrix.memory_bytes()
            + self.lagged.memory_bytes()
            + self.frozen.memory_bytes()
            + self.preconditioner.memory_bytes()
            + self.cg.memory_bytes()
            + self.newton.memory_bytes()
            + size_of::<f64>() * vectors.map(Vec::capacity).iter().sum::<usize>()
    }

    /// The state of a body at rest: see [`start_moving`](Self::start_moving).
    ///
    /// # Errors
    /// As [`start_moving`](Self::start_moving).
    pub fn start<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        drive: &mut dyn FnMut(f64, &mut Drive),
    ) -> Result<State, DynamicsError> {
        let rest = vec![0.0; body.dim()];
        self.start_moving(body, subspace, drive, rest.clone(), rest)
    }

    /// The state at `t = 0` of a body with displacement `u` (m) and velocity `v` (m/s): finds the acceleration that
    /// balances the equation of motion on the free moves; on the others it is zero.
    ///
    /// # Errors
    /// [`DynamicsError`].
    pub fn start_moving<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        drive: &mut dyn FnMut(f64, &mut Drive),
        u: Vec<f64>,
        v: Vec<f64>,
    ) -> Result<State, DynamicsError> {
        let state = State { dt: self.settings.dt, a: vec![0.0; u.len()], u, v, ..State::default() };
        self.prepare(body, subspace, &state)?;
        self.check_start(body, &state)?;
        self.ask(0.0, drive)?;
        let damping = self.settings.damping;
        let [product, force, _] = &mut self.scratch;
        body.internal_force(&state.u, force);
        for (rhs, (load, force)) in self.rhs.iter_mut().zip(self.drive.load.iter().zip(force)) {
            *rhs = load - *force;
        }
        if damping.mass > 0.0 {
            body.apply_mass(&state.v, product);
            vector::axpy(-damping.mass, product, &mut self.rhs);
        }
        if damping.stiffness > 0.0 && state.v.iter().any(|&v| v != 0.0) {
            body.linearize(&state.u);
            body.stiffness().apply(&state.v, product);
            vector::axpy(-damping.stiffness, product, &mut self.rhs);
        }
        if body.is_viscous() && state.v.iter().any(|&v| v != 0.0) {
            body.evaluate_damping(&state.u)?;
            if let Some((matrix, _)) = body.damping() {
                matrix.apply(&state.v, product);
                vector::axpy(-1.0, product, &mut self.rhs);
            }
        }
        let mut state = state;
        let stop = StopRule { tolerance: START_TOLERANCE, criterion: Criterion::External, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: self.settings.max_inner_iterations };
        let mass = MassOperator { body };
        projected_cg(&mass, &Identity, subspace, &self.rhs, &mut state.a, &settings, &mut self.cg)
            .map_err(DynamicsError::Start)?;
        Ok(state)
    }

    /// Makes one step of length [`State::dt`], in parts where it cannot be made as a whole; adaptive steps may be shorter.
    /// `drive` is asked for load and prescribed motion at the end of each part.
    ///
    /// # Errors
    /// [`DynamicsError`]; the state is then that before the step.
    pub fn step<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        drive: &mut dyn FnMut(f64, &mut Drive),
        state: &mut State,
    ) -> Result<StepReport<D>, DynamicsError> {
        self.prepare(body, subspace, state)?;
        self.check_start(body, state)?;
        let mut report = StepReport {
            t: state.t,
            dt: state.dt,
            substeps: 0,
            halvings: 0,
            residual: 0.0,
            threshold: 0.0,
            iterations: 0,
            newton_iterations: 0,
            unconverged: 0,
            elements_updated: 0,
            error: 0.0,
            balance: None,
        };
        if let Some(adaptive) = self.settings.adaptive {
            let mut dt = state.dt.clamp(adaptive.smallest, adaptive.largest);
            loop {
                let outcome = self.parts(body, subspace, drive, state, dt, &mut report)?;
                if outcome.error <= adaptive.tolerance || dt <= adaptive.smallest {
                    report.dt = dt;
                    self.commit(state, dt);
                    let grows = outcome.error <= REGROWTH * adaptive.tolerance && report.substeps == 1;
                    state.dt = if grows { (2.0 * dt).min(adaptive.largest) } else { dt };
                    break;
                }
                report.halvings += 1;
                dt = (0.5 * dt).max(adaptive.smallest);
            }
        } else {
            self.parts(body, subspace, drive, state, state.dt, &mut report)?;
            self.commit(state, state.dt);
        }
        report.t = state.t;
        report.balance = self.settings.balance.then(|| self.balance(body, state));
        Ok(report)
    }

    /// The state with what a resumed run needs besides: store this one.
    pub fn save<const N: usize, M: Hyperelastic<D>>(&self, body: &Body<D, N, M>, state: &State) -> State {
        State { linearization: body.linearization(), ..state.clone() }
    }

    /// Brings a body of the same mesh and settings to where it was when a state was saved.
    ///
    /// # Errors
    /// [`DynamicsError::Shape`], [`DynamicsError::Body`].
    pub fn resume<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        state: &State,
    ) -> Result<(), DynamicsError> {
        self.prepare(body, subspace, state)?;
        body.restore_linearization(&state.linearization)?;
        Ok(())
    }

    /// Energies and momentum of a state under the load of the last step.
    pub fn balance<const N: usize, M: Hyperelastic<D>>(&self, body: &mut Body<D, N, M>, state: &State) -> Balance<D> {
        Balance {
            strain: body.value(&state.u),
            kinetic: body.kinetic_energy(&state.v),
            load: -vector::dot(&self.drive.load, &state.u),
            momentum: body.momentum(&state.v),
        }
    }

    /// One step in one part, or in several whose length is halved after each failure and doubled again after successes.
    fn parts<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &mut Body<D, N, M>,
        subspace: &Subspace<D>,
        drive: &mut dyn FnMut(f64, &mut Drive),
        state: &State,
        dt: f64,
        report: &mut StepReport<D>,
    ) -> Result<Outcome, DynamicsError> {
        let whole = 1u32 << self.settings.max_halvings;
        let (mut done, mut size) = (0, whole);
        let mut part = std::mem::take(&mut self.part);
        copy_motion(state, &mut part);
        report.substeps = 0;
        let last = loop {
            let h = dt * f64::from(size) / f64::from(whole);
            let t = state.t + dt * f64::from(done + size) / f64::from(whole);
            let outcome = self
                .ask(t, drive)
                .map_err(Setback::from)
                .and_then(|()| Attempt { body: &mut *body, subspace, start: &part, h }.make(self, report));
            match outcome {
                Ok(outcome) => {
                    (done, report.substeps) = (done + size, report.substeps + 1);
                    if done == whole {
                        break Ok(outcome);
                    }
                    std::mem::swap(&mut part.u, &mut self.u);
                    std::mem::swap(&mut part.v, &mut self.v);
                    std::mem::swap(&mut part.a, &mut self.a);
                    if done % (2 * size) == 0 && done + 2 * size <= whole {
                        size *= 2;
                    }
                }
                Err(Setback::Final(error)) => break Err(error),
                Err(Setback::Curable(reason)) => {
                    report.halvings += 1;
                    if size == 1 {
                        let (cell, jacobian) = body.smallest_jacobian(&self.u).unwrap_or((CellId(0), f64::NAN));
                        break Err(DynamicsError::Failed { t: state.t, smallest: h, cell, jacobian, reason });
                    }
                    size /= 2;
                }
            }
        };
        self.part = part;
        last
    }

    pub(crate) fn commit(&mut self, state: &mut State, dt: f64) {
        std::mem::swap(&mut state.u, &mut self.u);
        std::mem::swap(&mut state.v, &mut self.v);
        std::mem::swap(&mut state.a, &mut self.a);
        state.t += dt;
        state.step += 1;
    }

    /// The mesh has changed: rounding errors are estimated anew, as they would be after a resumption.
    pub(crate) fn remeshed(&mut self) {
        self.round_off_of = usize::MAX;
    }

    /// Checks shapes and sizes vectors.
    pub(crate) fn prepare<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &Body<D, N, M>,
        subspace: &Subspace<D>,
        state: &State,
    ) -> Result<(), DynamicsError> {
        self.settings.validate()?;
        if body.mass_kind().is_none() {
            return Err(DynamicsError::NoMass);
        }
        let dim = body.dim();
        let fields = [("u", &state.u), ("v", &state.v), ("a", &state.a)];
        let lengths = fields.map(|(what, field)| (what, field.len()));
        for (what, len) in lengths.into_iter().chain([("the subspace", subspace.dim())]) {
            if len != dim {
                return Err(DynamicsError::Shape { what, dim, len });
            }
        }
        for (what, field) in fields {
            if let Some(index) = first_not_finite(field) {
                return Err(DynamicsError::NotFinite { what, index, t: state.t });
            }
        }
        let massless = |&vertex: &usize| body.lumped_mass()[vertex] == 0.0 && subspace.get(vertex).dofs() > 0;
        if let Some(vertex) = (0..body.n_vertices()).find(massless) {
            return Err(DynamicsError::MasslessVertex { vertex });
        }
        if self.drive.load.len() != dim {
            self.drive = Drive { load: vec![0.0; dim], displacement: vec![0.0; dim], velocity: vec![0.0; dim] };
        }
        if self.round_off_of != body.n_elements() {
            self.round_off = ROUND_OFF_UNITS * body.force_round_off();
            self.energy_round_off = body.energy_round_off();
            self.round_off_of = body.n_elements();
        }
        let [x, y, z] = &mut self.scratch;
        for v in [&mut self.u, &mut self.v, &mut self.a, &mut self.u_hat, &mut self.v_hat, &mut self.rhs, x, y, z] {
            v.resize(dim, 0.0);
        }
        Ok(())
    }

    fn check_start<const N: usize, M: Hyperelastic<D>>(
        &self,
        body: &Body<D, N, M>,
        state: &State,
    ) -> Result<(), DynamicsError> {
        if !body.requires_positive_j() || self.settings.solution == super::Solution::Linearised && state.step > 0 {
            return Ok(());
        }
        match body.smallest_jacobian(&state.u) {
            Some((cell, jacobian)) if jacobian.is_nan() || jacobian <= 0.0 => {
                Err(DynamicsError::Inverted { cell, jacobian, t: state.t })
            }
            _ => Ok(()),
        }
    }

    /// Asks the caller for load and motion at `t`.
    pub(crate) fn ask(&mut self, t: f64, drive: &mut dyn FnMut(f64, &mut Drive)) -> Result<(), DynamicsError> {
        let dim = self.drive.load.len();
        drive(t, &mut self.drive);
        let Drive { load, displacement, velocity } = &self.drive;
        for (what, vector) in
            [("the load", load), ("the prescribed displacement", displacement), ("the prescribed velocity", velocity)]
        {
            if vector.len() != dim {
                return Err(DynamicsError::Shape { what, dim, len: vector.len() });
            }
            if let Some(index) = first_not_finite(vector) {
                return Err(DynamicsError::NotFinite { what, index, t });
            }
        }
        Ok(())
    }
}

/// Relative residual of the first acceleration.
const START_TOLERANCE: f64 = 1e-13;
/// Units of rounding error that a residual may hold.
const ROUND_OFF_UNITS: f64 = 4.0;
/// Share of the tolerance below which an adaptive step grows: the error of a step falls eightfold when it is halved.
const REGROWTH: f64 = 0.125;

fn copy_motion(from: &State, to: &mut State) {
    to.u.clone_from(&from.u);
    to.v.clone_from(&from.v);
    to.a.clone_from(&from.a);
}

/// `M`, for conjugate gradients.
struct MassOperator<'a, const D: usize, const N: usize, M> {
    body: &'a Body<D, N, M>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> LinearOperator for MassOperator<'_, D, N, M> {
    fn dim(&self) -> usize {
        self.body.dim()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        self.body.apply_mass(x, y);
    }
}
