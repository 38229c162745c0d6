//! A running scene of a body: one static solve, or time steps.

use super::geometry::{Fingerprint, Geometry};
use super::instants::{self, Instant as Drawn};
use super::law::Law;
use super::material::Tissue;
use super::scene::{LazyWord, MassWord, Method, NewtonKind, PreconditionerKind, Scene, SchemeKind, TimeStage};
use super::setup::Setup;
use super::{frames, keys, picture, shape};
use crate::error::RunError;
use crate::history::{Columns, HistoryRow};
use crate::simulation::{FrameSeries, Simulation};
use crate::stages::{Stage, Stages};
use crate::state::Saved;
use crate::summary::{BodySummary, Bytes, Probe, QualitySummary, SolverSummary, Summary};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use stylet_mesh::{CellId, quality};
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::dynamics::{
    Adaptive, Damping, Drive, DynamicsSettings, Integrator, Scheme, Solution, State as Motion,
};
use stylet_physics::statics::{
    Preconditioning, StaticMethod, StaticSettings, StaticWorkspace, inverted_cells, solve_static_program,
};
use stylet_solver::linear::direct::Method as Factors;
use stylet_solver::nonlinear::{Direction, StepModel};
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::team::Team;
use stylet_solver::vector;

/// The name of this application in a state file.
pub(super) const APP: &str = "body";

/// Residual as a share of `E L^2` that rounding errors may leave of a static solve.
const ROUND_OFF: f64 = 1e-12;

/// As [`ROUND_OFF`], of a time step: a body without loads that has come to rest leaves no force to measure the residual
/// against. The share is eps_round of eq. (6.9) of Nienhuys (2003) in the scenes with a needle.
const ROUND_OFF_IN_MOTION: f64 = 1e-8;

/// What a state file keeps: the scene as TOML, and what cannot be derived from it.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct SavedRun {
    pub toml: String,
    mesh: Fingerprint,
    motion: Motion,
    measures: Measures,
    solved: bool,
    drawn: Vec<Drawn>,
}

/// What is measured after each step.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
struct Measures {
    kinetic: f64,
    load: f64,
    residual: f64,
    scale: f64,
    solves: u64,
    inner: u64,
    most: u64,
    nonlinear: u64,
    load_steps: usize,
    failed: u64,
}

/// A running scene of one material type.
pub(super) struct Run<const D: usize, const N: usize, M: Law<D>> {
    scene: Scene,
    geometry: Arc<Geometry<D, N>>,
    setup: Setup<D>,
    body: Body<D, N, M>,
    /// `u` at rest; `u`, `v`, `a` in motion.
    motion: Motion,
    integrator: Option<Integrator<D>>,
    team: Team,
    measures: Measures,
    solved: bool,
    /// Bytes that the workspace of the static solve took.
    static_bytes: usize,
    /// States so far that stand in the picture of instants.
    drawn: Vec<Drawn>,
    stages: Stages,
    threads: usize,
    wall: f64,
    first_step: usize,
}

impl<const D: usize, const N: usize, M: Law<D>> Run<D, N, M> {
    /// A scene at its start, or where a run was saved.
    ///
    /// # Errors
    /// [`RunError`] if a layer below refuses.
    pub fn open(
        scene: &Scene,
        geometry: Arc<Geometry<D, N>>,
        setup: Setup<D>,
        laws: &[(u32, M)],
        threads: usize,
        saved: Option<SavedRun>,
        mut stages: Stages,
    ) -> Result<Self, RunError> {
        // The time of a run begins here, after its mesh was made and its nodes were picked.
        stages.begin_steps();
        let began = Instant::now();
        let refuse = |reason: String| RunError::Inconsistent { source_name: scene.label.clone(), reason };
        if let Some(saved) = &saved {
            let (found, expected) = (saved.mesh, geometry.fingerprint());
            if found != expected {
                let reason =
                    format!("found the state of a mesh of {found}, expected {expected}, the mesh of this scene");
                return Err(RunError::State { path: "state".to_owned(), reason });
            }
        }
        let mut body = Body::with_materials(&geometry.mesh, laws, scene.mesh.thickness)
            .map_err(|e| refuse(format!("body: {e}")))?;
        body.set_threads(threads);
        let since = stages.lap(Stage::Assemble, began);
        let team = Team::new(threads);
        let subspace = setup.subspace(&geometry, 0.0);
        let u = shape::displacement(scene.start.as_ref(), &geometry, &subspace);
        let mut integrator = None;
        let mut motion = Motion { u, ..Motion::default() };
        if let Some(time) = &scene.time {
            let densities = setup.tissues.iter().enumerate().map(|(k, tissue)| (k as u32, tissue.density)).collect();
            let kind = match time.mass {
                MassWord::Lumped => MassKind::Lumped,
                MassWord::Consistent => MassKind::Consistent,
            };
            body.set_mass(kind, &Density::ByRegion(densities)).map_err(|e| refuse(format!("mass: {e}")))?;
            for (region, tissue) in setup.tissues.iter().enumerate() {
                if let Some(viscosity) = tissue.viscosity {
                    body.set_viscosity(region as u32, viscosity).map_err(|e| refuse(format!("damping_time: {e}")))?;
                }
            }
            stages.lap(Stage::Mass, since);
            if time.lazy > 0.0 {
                body.set_lazy_rule(match time.lazy_measure {
                    LazyWord::Strain => LazyRule::Strain(time.lazy),
                    LazyWord::Stiffness => LazyRule::Stiffness(time.lazy),
                    LazyWord::Rotation => LazyRule::Rotation(time.lazy),
                });
            }
            let mut one = Integrator::new(settings(scene, time, geometry.size(), &setup.tissues), &team);
            let fail = |e: stylet_physics::dynamics::DynamicsError| RunError::Step { step: 0, reason: e.to_string() };
            match &saved {
                Some(saved) => one
                    .resume(&mut body, &setup.subspace(&geometry, saved.motion.t), &saved.motion)
                    .map_err(|e| RunError::State { path: "state".to_owned(), reason: e.to_string() })?,
                None => {
                    let mut drive = drive(&setup, geometry.mesh.points(), time);
                    let v = vec![0.0; motion.u.len()];
                    motion = one.start_moving(&mut body, &subspace, &mut drive, motion.u, v).map_err(fail)?;
                }
            }
            integrator = Some(one);
        }
        let (mut measures, mut solved, mut drawn) = (Measures::default(), false, Vec::new());
        if let Some(saved) = saved {
            (motion, measures, solved, drawn) = (saved.motion, saved.measures, saved.solved, saved.drawn);
        } else if integrator.is_some() {
            instants::keep(&mut drawn, instants_of(scene), None, motion.t, &motion.u);
        }
        let wall = began.elapsed().as_secs_f64();
        let mut run = Self {
            scene: scene.clone(),
            geometry,
            setup,
            body,
            motion,
            integrator,
            team,
            measures,
            solved,
            static_bytes: 0,
            drawn,
            stages,
            threads,
            wall,
            first_step: 0,
        };
        run.first_step = run.steps();
        Ok(run)
    }

    /// The static solve.
    fn rest(&mut self) -> Result<(), RunError> {
        let Some(statics) = self.scene.statics.clone() else { return Ok(()) };
        let since = Instant::now();
        let Self { scene, geometry, setup, body, motion, measures, .. } = self;
        let by_model = if M::IS_LINEAR { Method::Cg } else { Method::NewtonCg };
        let method = statics.method.unwrap_or(by_model);
        let step = if M::IS_LINEAR { StepModel::Curvature } else { StepModel::Secant };
        let conjugate = |direction| StaticMethod::NonlinearCg { direction, step };
        let method = match method {
            Method::Cg => StaticMethod::Cg,
            Method::Llt => StaticMethod::Direct(Factors::Llt),
            Method::Ldlt => StaticMethod::Direct(Factors::Ldlt),
            Method::NewtonCg => StaticMethod::NewtonCg,
            Method::PolakRibiere => conjugate(Direction::PolakRibierePlus),
            Method::FletcherReeves => conjugate(Direction::FletcherReeves),
            Method::HagerZhang => conjugate(Direction::HagerZhang { eta: 0.01 }),
            Method::Lbfgs => StaticMethod::Lbfgs,
        };
        let subspace = setup.subspace(geometry, 0.0);
        let settings = StaticSettings {
            preconditioning: preconditioning(scene.solver.preconditioner),
            first_step: statics.first_step,
            smallest_step: statics.smallest_step,
            max_iterations: usize::try_from(scene.solver.max_iterations).unwrap_or(usize::MAX),
            ..StaticSettings::new(
                method,
                stop_rule(scene, ROUND_OFF, Criterion::Reaction, geometry.size(), &setup.tissues),
            )
        };
        let points = geometry.mesh.points();
        let mut program = |share: f64, load: &mut [f64], u: &mut [f64]| {
            setup.load(0.0, load);
            load.iter_mut().for_each(|f| *f *= share);
            if setup.moves() {
                setup.prescribe(points, share, 1.0, u);
            }
        };
        let mut workspace = StaticWorkspace::on(&self.team);
        let result = solve_static_program(body, &subspace, &mut program, &mut motion.u, &settings, &mut workspace);
        self.static_bytes = workspace.memory_bytes();
        let since = self.stages.lap(Stage::Solve, since);
        match result {
            Ok(report) => {
                let mut load = vec![0.0; self.motion.u.len()];
                self.setup.load(0.0, &mut load);
                *measures = Measures {
                    kinetic: 0.0,
                    load: -vector::dot(&load, &self.motion.u),
                    residual: report.residual_norm,
                    scale: report.reaction_norm.hypot(vector::norm2(&load)),
                    solves: (report.load_steps + report.failed_steps) as u64,
                    inner: report.inner_iterations as u64,
                    most: report.inner_iterations as u64,
                    nonlinear: report.iterations as u64,
                    load_steps: report.load_steps,
                    failed: report.failed_steps as u64,
                };
                self.solved = true;
                Ok(())
            }
            Err(error) => {
                let mut reason = error.to_string();
                if let Some(finding) = inverted_cells(&self.body, &self.geometry.mesh, &self.motion.u) {
                    reason = format!("{reason}; {finding}");
                }
                for warning in &self.setup.warnings {
                    reason = format!("{reason}; {warning}");
                }
                self.stages.lap(Stage::Diagnose, since);
                Err(RunError::Step { step: 1, reason })
            }
        }
    }

    /// One time step.
    fn go_on(&mut self) -> Result<(), RunError> {
        let (Some(time), Some(integrator)) = (&self.scene.time, &mut self.integrator) else { return Ok(()) };
        let since = Instant::now();
        let (step, before) = (self.motion.step as usize + 1, self.motion.t);
        let subspace = self.setup.subspace(&self.geometry, self.motion.t);
        let mut drive = drive(&self.setup, self.geometry.mesh.points(), time);
        if time.adaptive > 0.0 {
            // Steps of one length end where they end; those that adapt, at the end of the run.
            self.motion.dt = self.motion.dt.min(time.end - self.motion.t);
        }
        let times = *integrator.times();
        let result = integrator.step(&mut self.body, &subspace, &mut drive, &mut self.motion);
        self.stages.lap(Stage::Solve, since);
        if !M::IS_LINEAR {
            let now = integrator.times();
            for (stage, before, now) in
                [(Stage::Force, times.forces, now.forces), (Stage::Linearize, times.linearize, now.linearize)]
            {
                self.stages.add(stage, now.seconds - before.seconds, now.calls - before.calls);
            }
        }
        let report = result.map_err(|error| {
            let mut reason = error.to_string();
            if let Some(finding) = inverted_cells(&self.body, &self.geometry.mesh, &self.motion.u) {
                reason = format!("{reason}; {finding}");
            }
            RunError::Step { step, reason }
        })?;
        instants::keep(&mut self.drawn, instants_of(&self.scene), Some(before), self.motion.t, &self.motion.u);
        let measures = &mut self.measures;
        if let Some(balance) = report.balance {
            (measures.kinetic, measures.load) = (balance.kinetic, balance.load);
        }
        measures.residual = report.residual;
        measures.scale = report.threshold / self.scene.solver.tolerance;
        measures.solves += 1;
        measures.inner += report.iterations as u64;
        measures.most = measures.most.max(report.iterations as u64);
        measures.nonlinear += report.newton_iterations as u64;
        measures.failed += u64::from(report.halvings);
        Ok(())
    }

    fn smallest_jacobian(&self) -> f64 {
        self.body.smallest_jacobian(&self.motion.u).map_or(f64::NAN, |(_, j)| j)
    }

    fn largest_displacement(&self) -> f64 {
        self.motion.u.chunks_exact(D).map(vector::norm2).fold(0.0, f64::max)
    }

    fn bytes(&self) -> Bytes {
        let vectors = (self.motion.u.capacity() + self.motion.v.capacity() + self.motion.a.capacity()) * 8;
        let loads: usize = self.setup.forces.iter().map(|force| force.nodal.capacity() * 8).sum();
        let matrices = self.integrator.as_ref().map_or(0, Integrator::memory_bytes);
        let solver = matrices + self.static_bytes;
        let total = self.geometry.memory_bytes() + self.body.memory_bytes() + vectors + loads + solver;
        Bytes { total, per_element: total as f64 / self.geometry.mesh.n_cells().max(1) as f64 }
    }

    fn body_summary(&self) -> BodySummary {
        let (mesh, u) = (&self.geometry.mesh, &self.motion.u);
        let (mut volume, mut rest, mut mean) = (0.0, 0.0, vec![0.0; D]);
        for cell in mesh.cells() {
            let own = mesh.volume(cell) * self.scene.mesh.thickness;
            rest += own;
            volume +=
                own * self.body.jacobian(cell, u).unwrap_or(f64::NAN) * self.thickness_stretch(cell).unwrap_or(1.0);
            for v in mesh.cell(cell) {
                (0..D).for_each(|k| mean[k] += own * u[D * v.index() + k] / N as f64);
            }
        }
        mean.iter_mut().for_each(|x| *x /= rest);
        let measures = &self.measures;
        let moves = self.integrator.is_some();
        BodySummary {
            time_s: self.motion.t,
            kinetic_energy_j: measures.kinetic,
            load_energy_j: measures.load,
            momentum: if moves { self.body.momentum(&self.motion.v).to_vec() } else { Vec::new() },
            max_displacement_m: self.largest_displacement(),
            mean_displacement_m: mean,
            min_j: self.smallest_jacobian(),
            volume_m3: volume,
            residual_n: measures.residual,
            nonlinear_iterations: measures.nonlinear,
            load_steps: measures.load_steps,
            failed_steps: measures.failed,
            elements_linearized: if M::IS_LINEAR { 0 } else { self.body.elements_linearized() },
            warnings: self.setup.warnings.iter().cloned().chain(self.lost_thickness()).collect(),
        }
    }

    /// Stretch of the thickness of a cell in plane stress.
    fn thickness_stretch(&self, cell: CellId) -> Option<f64> {
        thickness_stretch(&self.body, cell, &self.motion.u)
    }

    /// Triangles in plane stress of which no thickness is left: what their material is not made for.
    fn lost_thickness(&self) -> Option<String> {
        let lost = |cell: &CellId| self.thickness_stretch(*cell).is_some_and(|q| q.is_nan() || q <= 0.0);
        let cells: Vec<CellId> = self.geometry.mesh.cells().filter(lost).collect();
        let first = cells.first()?.0;
        Some(format!(
            "material.plane: found {} elements (the first is {first}) stretched until no thickness is left, in which no \
             positive stretch of it frees them of stress across the plane; expected smaller strains or another material.model",
            cells.len(),
        ))
    }

    fn displacement_at(&self, at: &[f64]) -> Vec<f64> {
        let found = at.try_into().ok().and_then(|at: [f64; D]| self.geometry.mesh.locate(at));
        let Some(inside) = found else { return vec![f64::NAN; D] };
        let vertices = self.geometry.mesh.cell(inside.cell);
        let u = &self.motion.u;
        (0..D).map(|k| (0..N).map(|i| inside.barycentric[i] * u[D * vertices[i].index() + k]).sum()).collect()
    }
}

/// Stretch of the thickness of a cell in plane stress.
pub(super) fn thickness_stretch<const D: usize, const N: usize, M: Law<D>>(
    body: &Body<D, N, M>,
    cell: CellId,
    u: &[f64],
) -> Option<f64> {
    body.material_of(cell)?.thickness_stretch(&body.deformation_gradient(cell, u)?)
}

/// What drives a body at a time: loads, and prescribed motion whose velocity is a difference over a small share of the way.
fn drive<'a, const D: usize>(
    setup: &'a Setup<D>,
    points: &'a [[f64; D]],
    time: &'a TimeStage,
) -> impl FnMut(f64, &mut Drive) + 'a {
    let mut later = Vec::new();
    move |t, drive| {
        setup.load(t, &mut drive.load);
        if !setup.moves() {
            return;
        }
        let h = 1e-4 * time.dt;
        setup.prescribe(points, t, time.end, &mut drive.displacement);
        later.clone_from(&drive.displacement);
        setup.prescribe(points, t + h, time.end, &mut later);
        for ((v, after), now) in drive.velocity.iter_mut().zip(&later).zip(&drive.displacement) {
            *v = (after - now) / h;
        }
    }
}

fn instants_of(scene: &Scene) -> &[f64] {
    scene.output.as_ref().map_or(&[], |output| &output.instants)
}

fn settings(scene: &Scene, time: &TimeStage, size: f64, tissues: &[Tissue]) -> DynamicsSettings {
    let scheme = match time.scheme {
        SchemeKind::Newmark => Scheme::Newmark { beta: time.beta, gamma: time.gamma },
        SchemeKind::Trapezoid => Scheme::TRAPEZOID,
        SchemeKind::BackwardEuler => Scheme::BackwardEuler,
    };
    let solution = match time.newton {
        NewtonKind::One => Solution::Linearised,
        NewtonKind::Full => {
            Solution::Newton { max_iterations: usize::try_from(time.newton_iterations).unwrap_or(usize::MAX) }
        }
    };
    let dt = time.dt.min(time.end);
    let adaptive = Adaptive { tolerance: time.adaptive, smallest: dt / 1024.0, largest: time.end };
    DynamicsSettings {
        scheme,
        solution,
        damping: Damping { mass: time.damping_mass, stiffness: time.damping_stiffness },
        stop: stop_rule(scene, ROUND_OFF_IN_MOTION, Criterion::External, size, tissues),
        max_inner_iterations: usize::try_from(scene.solver.max_iterations).unwrap_or(usize::MAX),
        adaptive: (time.adaptive > 0.0).then_some(adaptive),
        balance: true,
        ..DynamicsSettings::new(dt)
    }
}

fn stop_rule(scene: &Scene, round_off: f64, criterion: Criterion, size: f64, tissues: &[Tissue]) -> StopRule {
    let stiffest = tissues.iter().map(|tissue| tissue.young).fold(0.0, f64::max);
    let round_floor = round_off * stiffest * size * size;
    StopRule { tolerance: scene.solver.tolerance, criterion, round_floor }
}

fn preconditioning(kind: PreconditionerKind) -> Preconditioning {
    match kind {
        PreconditionerKind::None => Preconditioning::None,
        PreconditionerKind::Jacobi => Preconditioning::Jacobi,
        PreconditionerKind::BlockJacobi => Preconditioning::BlockJacobi,
        PreconditionerKind::Ssor => Preconditioning::Ssor,
        PreconditionerKind::IncompleteCholesky => Preconditioning::IncompleteCholesky,
        PreconditionerKind::Chebyshev => Preconditioning::Chebyshev,
        PreconditionerKind::Aggregation => Preconditioning::Aggregation,
        PreconditionerKind::Factor => Preconditioning::Factor,
    }
}

impl<const D: usize, const N: usize, M: Law<D>> Simulation for Run<D, N, M> {
    fn name(&self) -> &str {
        &self.scene.name
    }

    fn dim(&self) -> usize {
        D
    }

    fn step(&mut self) -> Result<HistoryRow, RunError> {
        let since = Instant::now();
        let (before, last) = (self.stages, self.measures);
        let result = if self.integrator.is_some() { self.go_on() } else { self.rest() };
        self.wall += since.elapsed().as_secs_f64();
        result?;
        let measures = &self.measures;
        Ok(HistoryRow {
            step: self.steps(),
            time_s: self.motion.t,
            quantities: vec![
                self.strain_energy(),
                measures.kinetic,
                measures.load,
                self.largest_displacement(),
                self.smallest_jacobian(),
                measures.residual,
            ],
            iterations: measures.inner - last.inner,
            cycles: measures.solves - last.solves,
            counts: vec![measures.nonlinear - last.nonlinear, measures.failed - last.failed],
            nodes: self.geometry.mesh.n_vertices(),
            elements: self.geometry.mesh.n_cells(),
            stage_seconds: self.stages.seconds_since(&before),
        })
    }

    fn finished(&self) -> bool {
        match &self.scene.time {
            Some(time) => self.motion.t >= time.end * (1.0 - 1e-9),
            None => self.solved,
        }
    }

    fn steps(&self) -> usize {
        if self.integrator.is_some() { self.motion.step as usize } else { usize::from(self.solved) }
    }

    fn progress(&self) -> f64 {
        match &self.scene.time {
            Some(time) => (self.motion.t / time.end).min(1.0),
            None => f64::from(u8::from(self.solved)),
        }
    }

    fn place(&self, row: &HistoryRow) -> String {
        format!("step {}, {:.4} s, {} elements", row.step, row.time_s, row.elements)
    }

    fn frame_time(&self) -> f64 {
        if self.integrator.is_some() { self.motion.t } else { self.steps() as f64 }
    }

    fn stages(&self) -> &Stages {
        &self.stages
    }

    fn columns(&self) -> Columns {
        Columns {
            quantities: vec!["strain_j", "kinetic_j", "load_j", "max_displacement_m", "min_j", "residual_n"],
            counts: vec!["nonlinear_iterations", "failed_steps"],
            stages: vec![Stage::Solve],
        }
    }

    fn points(&self) -> &[f64] {
        self.geometry.mesh.points().as_flattened()
    }

    fn cells(&self) -> Vec<u32> {
        let mesh = &self.geometry.mesh;
        mesh.cells().flat_map(|cell| mesh.cell(cell)).map(|vertex| vertex.0).collect()
    }

    fn displacement(&self) -> &[f64] {
        &self.motion.u
    }

    fn strain_energy(&self) -> f64 {
        self.body.strain_energy(&self.motion.u)
    }

    fn summary(&self, probes: &[Vec<f64>]) -> Summary {
        let (mesh, measures, steps) = (&self.geometry.mesh, &self.measures, self.steps());
        let quality = quality::summary(mesh);
        let inverted = |cell: &_| !self.body.jacobian(*cell, &self.motion.u).is_some_and(|j| j > 0.0);
        Summary {
            schema: 1,
            scene: self.scene.name.clone(),
            converged: self.finished(),
            interrupted: !self.finished(),
            failure: None,
            dofs: self.motion.u.len(),
            nodes: mesh.n_vertices(),
            elements: mesh.n_cells(),
            steps,
            threads: self.threads,
            wall_s: self.wall,
            update_hz: if self.wall > 0.0 { (steps - self.first_step) as f64 / self.wall } else { 0.0 },
            energy_j: self.strain_energy(),
            solver: SolverSummary {
                iterations_total: measures.inner,
                iterations_mean: measures.inner as f64 / measures.solves.max(1) as f64,
                iterations_max: measures.most,
                relative_residual: if measures.scale > 0.0 { measures.residual / measures.scale } else { 0.0 },
                unconverged_solves: 0,
                first_unconverged_cycle: 0,
            },
            needle: None,
            steering: None,
            body: Some(self.body_summary()),
            bytes: Some(self.bytes()),
            probes: probes.iter().map(|at| Probe { at: at.clone(), displacement: self.displacement_at(at) }).collect(),
            quality: QualitySummary {
                min_angle_deg: quality.min_angle_deg,
                max_angle_deg: quality.max_angle_deg,
                min_quality: quality.min_quality,
                inverted_elements: mesh.cells().filter(inverted).count(),
            },
            stages: self.stages,
        }
    }

    fn save(&self) -> Result<Saved, String> {
        let motion = match &self.integrator {
            Some(integrator) => integrator.save(&self.body, &self.motion),
            None => self.motion.clone(),
        };
        let toml = keys::TABLE.write(&self.scene);
        let (mesh, drawn) = (self.geometry.fingerprint(), self.drawn.clone());
        Saved::new(APP, &SavedRun { toml, mesh, motion, measures: self.measures, solved: self.solved, drawn })
    }

    fn frame_series(&self) -> &'static [FrameSeries] {
        &[FrameSeries::BODY]
    }

    fn write_frame(&self, _: usize, path: &Path) -> Result<(), RunError> {
        frames::write(&self.geometry.mesh, &self.body, &self.motion.u, path)
    }

    fn draw(&self, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError> {
        let mesh = &self.geometry.mesh;
        picture::draw(&self.scene.name, mesh, &self.motion.u, rows, folder)?;
        picture::draw_instants(&self.scene.name, mesh, &self.drawn, folder)
    }
}
