//! A step of tissue and needles together.
//!
//! ```text
//! tissue: forces, tangents, matrix (dynamics)     rods: forces, tangents, sleeves
//!                   '------- null-space form, states by trials -------'
//!                        accelerations -> end of the step, in the integrator, until it is taken
//! ```

use super::aside::Aside;
use super::rods::{RodSystem, ShaftEnd};
use super::settings::{CoupledReport, CoupledSettings, CoupledTimes};
use super::shaft::{SleeveMotion, difference, inner, length, set_triple, triple};
use super::system::{Link, System, SystemVectors};
use super::{Answer, CouplingError, SearchWorkspace, Shaft, SlipLimits, SlipState, search};
use crate::body::Body;
use crate::dynamics::attempt::{Attempt, Unsolved};
use crate::dynamics::error::Setback;
use crate::dynamics::scheme::Coefficients;
use crate::dynamics::{Drive, Integrator, StageTimes, State, StepPreconditioner};
use crate::material::Hyperelastic;
use std::time::Instant;
use stylet_solver::energy::Energy;
use stylet_solver::linear::{Attachment, CgWorkspace, NullSpace, NullSpaceWorkspace};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// No node of a needle moves by more than this many times the reach in a step: five edges of a mesh whose reach is a fifth of one.
/// Tissue that recoils from a puncture stays well below.
const THROWN: f64 = 25.0;

/// Makes steps of tissue and needles together; what it found stays in it until [`take`](Self::take).
pub struct CoupledIntegrator {
    settings: CoupledSettings,
    tissue: Integrator<3>,
    vectors: SystemVectors,
    ws: NullSpaceWorkspace,
    search: SearchWorkspace,
    answer: Answer,
    aside: Aside,
    rods: Vec<RodSystem>,
    ends: Vec<ShaftEnd>,
    links: Vec<Link>,
    limits: Vec<SlipLimits>,
    states: Vec<SlipState>,
    times: CoupledTimes,
    past: Past,
}

/// Accelerations of the tissue at the starts of the last steps, the latest first, m/s^2: what the solution of the next one is
/// likely to be a combination of. Empty where there was no such step.
pub type Past = [Vec<f64>; 2];

impl CoupledIntegrator {
    /// Steps whose passes over the tissue are shared by a team; the bits do not depend on it.
    #[must_use]
    pub fn new(settings: CoupledSettings, team: &Team) -> Self {
        Self {
            settings,
            tissue: Integrator::new(settings.dynamics, team),
            vectors: SystemVectors::default(),
            ws: CgWorkspace::on(team).into(),
            search: SearchWorkspace::new(),
            answer: Answer::default(),
            aside: Aside::new(),
            rods: Vec::new(),
            ends: Vec::new(),
            links: Vec::new(),
            limits: Vec::new(),
            states: Vec::new(),
            times: CoupledTimes::default(),
            past: Past::default(),
        }
    }

    /// Preconditions the tissue by another method from now on.
    pub fn set_preconditioner(&mut self, preconditioner: impl StepPreconditioner<3> + 'static) {
        self.tissue.set_preconditioner(preconditioner);
    }

    /// The settings.
    #[must_use]
    pub fn settings(&self) -> &CoupledSettings {
        &self.settings
    }

    /// What the tissue's stages took, but for the solution.
    #[must_use]
    pub fn tissue_times(&self) -> &StageTimes {
        self.tissue.times()
    }

    /// What the others took.
    #[must_use]
    pub fn times(&self) -> &CoupledTimes {
        &self.times
    }

    /// The integrator of the tissue, for starts and resumptions.
    pub fn tissue(&mut self) -> &mut Integrator<3> {
        &mut self.tissue
    }

    /// Where solutions start from, beside the motion of the tissue; a step from other vectors has another rounding.
    #[must_use]
    pub fn past(&self) -> &Past {
        &self.past
    }

    /// The same, for vertices that come and go, and for resumptions. Vectors of another length than the tissue's are not used.
    pub fn past_mut(&mut self) -> &mut Past {
        &mut self.past
    }

    /// Makes a step of length `h` (s) from `state` and the needles as they are, and keeps its end: nothing is moved yet.
    ///
    /// `sleeves` has one entry per needle. The tissue's constrained nodes move as `drive` says.
    ///
    /// # Errors
    /// [`CouplingError`]; a shorter step may do where it says so.
    pub fn attempt<M: Hyperelastic<3>>(
        &mut self,
        body: &mut Body<3, 4, M>,
        subspace: &Subspace<3>,
        drive: &mut dyn FnMut(f64, &mut Drive),
        (state, needles): (&State, &mut [Shaft]),
        sleeves: &[SleeveMotion],
        h: f64,
    ) -> Result<CoupledReport, CouplingError> {
        check(needles, sleeves)?;
        self.tissue.prepare(body, subspace, state)?;
        self.tissue.ask(state.t + h, drive)?;
        let c = self.settings.dynamics.scheme.coefficients(h);
        let mut report = CoupledReport::default();
        let mut attempt = Attempt { body, subspace, start: state, h };
        attempt.predict(&mut self.tissue, &c);
        if !M::IS_LINEAR {
            let since = Instant::now();
            attempt.body.linearize(&state.u);
            self.tissue.times.linearize.add(since);
            report.elements_updated = attempt.body.elements_updated() as u64;
        }
        let twist = self.settings.implicit_twist && needles.iter().any(|needle| !needle.rod.is_naturally_straight());
        let mut made = self.solve(&mut attempt, (state, &mut *needles), (sleeves, twist), &c, &mut report);
        let indefinite = |made: &Result<(), CouplingError>| matches!(made, Err(CouplingError::Indefinite));
        if indefinite(&made) && twist {
            attempt.predict(&mut self.tissue, &c);
            made = self.solve(&mut attempt, (state, &mut *needles), (sleeves, false), &c, &mut report);
        }
        if indefinite(&made) && !M::IS_LINEAR && !attempt.body.is_projected() {
            // As in steps of the tissue alone: the nearest semidefinite tangents.
            attempt.body.set_projection(true);
            attempt.predict(&mut self.tissue, &c);
            made = self.solve(&mut attempt, (state, &mut *needles), (sleeves, false), &c, &mut report);
            attempt.body.set_projection(false);
        }
        made?;
        attempt.place(&mut self.tissue, &c);
        attempt.finish(&mut self.tissue, &c).map_err(setback)?;
        self.end_needles(needles, sleeves, &c, h)?;
        Ok(report)
    }

    /// Displacement of the tissue at the end of the step that was attempted, m.
    #[must_use]
    pub fn displacement(&self) -> &[f64] {
        &self.tissue.u
    }

    /// Where the attempted step would leave the needles.
    #[must_use]
    pub fn ends(&self) -> &[ShaftEnd] {
        &self.ends
    }

    /// Takes the step that was attempted: moves the tissue and the needles to its end. Vertices that are coupled to a needle get
    /// the velocity that has moved them in this step, and the acceleration that goes with it, as backward Euler has them: a
    /// place that is prescribed is answered by the trapezoid rule with velocities that change sign with every step, and friction
    /// states that follow them.
    pub fn take(&mut self, state: &mut State, needles: &mut [Shaft], h: f64) {
        for link in &self.links {
            let of = |v: &[f64]| triple(v, link.vertex);
            let v = difference(&of(&self.tissue.u), &of(&state.u)).map(|u| u / h);
            let a = difference(&v, &of(&state.v)).map(|v| v / h);
            set_triple(&mut self.tissue.v, link.vertex, &v);
            set_triple(&mut self.tissue.a, link.vertex, &a);
        }
        self.tissue.commit(state, h);
        self.past.rotate_right(1);
        self.past[0].clone_from(&self.tissue.a);
        for (needle, end) in needles.iter_mut().zip(&mut self.ends) {
            std::mem::swap(&mut needle.x, &mut end.x);
            std::mem::swap(&mut needle.v, &mut end.v);
            std::mem::swap(&mut needle.a, &mut end.a);
            for (node, (state, force)) in needle.nodes.iter_mut().zip(end.states.iter().zip(&end.forces)) {
                (node.state, node.force) = (*state, *force);
            }
        }
    }

    fn solve<M: Hyperelastic<3>>(
        &mut self,
        attempt: &mut Attempt<'_, 3, 4, M>,
        (state, needles): (&State, &mut [Shaft]),
        (sleeves, twist): (&[SleeveMotion], bool),
        c: &Coefficients,
        report: &mut CoupledReport,
    ) -> Result<(), CouplingError> {
        let round_floor = attempt.assemble(&mut self.tissue, c).map_err(unsolved)?;
        let since = Instant::now();
        let small = self.needles_system(needles, (sleeves, twist), c)?;
        let since = self.times.needle.add(since);
        self.link(needles, state, c);
        if self.settings.relieve_aside {
            let stiffness = attempt.body.stiffness();
            let (needles, reach) = ((&*needles, &self.links[..]), self.settings.reach);
            self.aside.relieve(stiffness, attempt.subspace, needles, reach, &mut self.tissue.rhs);
        }
        let mut attachments: Vec<Attachment> = vec![Vec::new(); small.n_rows()];
        for link in &self.links {
            attachments[link.small].push((link.vertex, 1.0));
        }
        let free = vec![Constraint::Free; small.n_rows()];
        let it = &mut self.tissue;
        let mut form = NullSpace::new(&it.matrix.matrix, attempt.subspace, small, attachments, &free)?;
        self.vectors.start.clone_from(&it.a);
        for (node, value) in self.vectors.start.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let own = attempt.subspace.get(node).project(*value);
            *value = difference(value, &own);
        }
        let since = self.times.couple.add(since);
        self.states.clear();
        self.states.extend(needles.iter().flat_map(|needle| needle.nodes.iter().map(|node| node.state)));
        let [last, one_before] = &self.past;
        let moves = [&state.v[..], &state.a, last, one_before];
        // Without a step before there is none two steps before.
        let known = moves.iter().take_while(|v| v.len() == state.a.len()).count();
        let guesses = if self.settings.search.warm_start { &moves[..known] } else { &[] };
        let mut system = System {
            method: self.settings.coupling,
            matrix: &it.matrix.matrix,
            w: attempt.subspace,
            a: &it.frozen,
            m: &*it.preconditioner,
            form: &mut form,
            links: &self.links,
            limits: &self.limits,
            b: &it.rhs,
            x: &mut it.a,
            vectors: &mut self.vectors,
            ws: &mut self.ws,
            cx: c.cx,
            scale: 0.0,
            round_floor,
            max_iterations: self.settings.dynamics.max_inner_iterations,
            residual: 0.0,
            threshold: 0.0,
            moves: Vec::new(),
            guesses,
        };
        let found = search(&mut system, &mut self.states, &self.settings.search, &mut self.search, &mut self.answer);
        report.search = found?;
        (report.residual, report.threshold) = (system.residual, system.threshold);
        self.times.search.add(since);
        Ok(())
    }

    /// Matrix of all needle nodes but those in sleeves, `M + cv D + cx K`, and their right sides.
    fn needles_system(
        &mut self,
        needles: &mut [Shaft],
        (sleeves, twist): (&[SleeveMotion], bool),
        c: &Coefficients,
    ) -> Result<BlockCsr<3>, CouplingError> {
        while self.rods.len() < needles.len() {
            self.rods.push(RodSystem::new());
        }
        let n_small: usize = needles.iter().map(|needle| needle.n_nodes() - 2).sum();
        let mut small = BlockCsr::new(n_small);
        let b = &mut self.vectors.b_small;
        b.clear();
        b.resize(3 * n_small, 0.0);
        self.vectors.x_small.clear();
        self.vectors.x_small.resize(3 * n_small, 0.0);
        let mut first = 0;
        for (k, (needle, sleeve)) in needles.iter_mut().zip(sleeves).enumerate() {
            let system = &mut self.rods[k];
            system.first = first;
            let evaluated = system.evaluate(needle, (sleeve, twist), &self.settings, c);
            evaluated.map_err(|error| CouplingError::Rod { needle: k, error })?;
            system
                .add_to(needle, c, &mut small, &mut b[3 * first..3 * (first + needle.n_nodes() - 2)])
                .map_err(|_| CouplingError::Shape { needle: k, what: "its matrix does not fit" })?;
            first += needle.n_nodes() - 2;
        }
        Ok(small)
    }

    fn link(&mut self, needles: &[Shaft], state: &State, c: &Coefficients) {
        self.links.clear();
        self.limits.clear();
        let offsets = &mut self.vectors.offsets;
        offsets.clear();
        offsets.resize(self.vectors.b_small.len(), 0.0);
        for (needle, rod) in needles.iter().zip(&self.rods) {
            let entry = needle.entry();
            for (k, coupled) in needle.nodes.iter().enumerate() {
                let (node, vertex) = (entry + k, coupled.vertex as usize);
                let (tangent, small) = (needle.tangent(node), rod.first + node - 2);
                let p_tissue = difference(&triple(&self.tissue.u_hat, vertex), &triple(&state.u, vertex));
                let lag = difference(&p_tissue, &triple(&rod.p, node));
                set_triple(offsets, small, &lag.map(|p| p / c.cx));
                self.links.push(Link {
                    small,
                    vertex,
                    tangent,
                    // By the speed of the sliding in this step: velocities at its end may ring.
                    drag: coupled.drag / c.h,
                    slip: -inner(&tangent, &lag),
                });
                self.limits.push(coupled.limits);
            }
        }
    }

    /// Places, velocities and accelerations of the needles, and the forces of their sleeves.
    fn end_needles(
        &mut self,
        needles: &[Shaft],
        sleeves: &[SleeveMotion],
        c: &Coefficients,
        h: f64,
    ) -> Result<(), CouplingError> {
        self.ends.resize_with(needles.len(), ShaftEnd::default);
        let mut seen = 0;
        for (k, (needle, sleeve)) in needles.iter().zip(sleeves).enumerate() {
            let (rod, end) = (&self.rods[k], &mut self.ends[k]);
            rod.end(needle, sleeve, &self.vectors.x_small, c, h, end);
            let q = needle.nodes.len();
            end.states.clear();
            end.states.extend_from_slice(&self.states[seen..seen + q]);
            end.forces.clear();
            end.forces.extend_from_slice(&self.answer.force[seen..seen + q]);
            end.slips.clear();
            end.slips.extend_from_slice(&self.answer.slip[seen..seen + q]);
            seen += q;
            let most = THROWN * self.settings.reach;
            for node in 2..needle.n_nodes() {
                let moved = length(&difference(&triple(&end.x, node), &needle.place(node)));
                if moved.is_nan() || moved > most {
                    return Err(CouplingError::Thrown { needle: k, node, moved, most });
                }
            }
            for (node, &slip) in (needle.entry()..).zip(&end.slips) {
                let reach = self.settings.reach;
                if slip.abs() > reach {
                    return Err(CouplingError::Overrun { needle: k, node, slip, reach });
                }
            }
        }
        Ok(())
    }
}

fn check(needles: &[Shaft], sleeves: &[SleeveMotion]) -> Result<(), CouplingError> {
    for (k, needle) in needles.iter().enumerate() {
        let refuse = |what| Err(CouplingError::Shape { needle: k, what });
        let n = 3 * needle.n_nodes();
        if [&needle.x, &needle.v, &needle.a].iter().any(|v| v.len() != n) {
            return refuse("places, velocities and accelerations need three numbers per node of its rod");
        }
        if needle.n_nodes() < 3 || needle.entry() < 2 {
            return refuse("two nodes in the sleeve and at least one more are needed");
        }
        if k >= sleeves.len() {
            return refuse("it has no motion of its sleeve");
        }
    }
    Ok(())
}

fn unsolved(error: Unsolved) -> CouplingError {
    match error {
        Unsolved::Indefinite => CouplingError::Indefinite,
        Unsolved::Other(error) => setback(error),
    }
}

fn setback(error: Setback) -> CouplingError {
    match error {
        Setback::Curable(reason) => CouplingError::GivenUp(reason),
        Setback::Final(error) => error.into(),
    }
}
