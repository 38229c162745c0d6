//! A running scene of flexible needles.

use crate::builtin::{MOST_NEEDLES, Setup};
use crate::record::{Record, Trace};
use crate::scene::{Coupling, PreconditionerKind, SchemeKind, SearchKind, TwistKind};
use crate::tissue::common_damping;
use crate::two_level::TwoLevelSteps;
use crate::{frames, keys, picture, tissue};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use stylet_mesh::{VertexId, quality};
use stylet_physics::coupling::{CoupledSettings, CouplingMethod, SearchMethod, SearchSettings, SlipState};
use stylet_physics::dynamics::{Damping, DynamicsSettings, Scheme};
use stylet_physics::insertion::{BaseMotion, Insertion, InsertionError, InsertionState, InsertionTimes, Needle};
use stylet_physics::material::Solid;
use stylet_physics::rod::Tangent;
use stylet_solver::team::Team;
use stylet_tissue::history::{Columns, HistoryRow};
use stylet_tissue::simulation::FrameSeries;
use stylet_tissue::stages::{Stage, Stages};
use stylet_tissue::state::Saved;
use stylet_tissue::summary::{
    FlexibleNeedle, MarkerSummary, NeedleSummary, Probe, QualitySummary, SolverSummary, SteeringSummary, Summary,
};
use stylet_tissue::{RunError, Simulation};

/// The name of this application in a state file.
pub(crate) const APP: &str = "steering";

/// What a state file keeps: the scene as TOML, and what cannot be derived from it.
#[derive(Serialize, Deserialize)]
pub(crate) struct SavedRun {
    pub toml: String,
    steps: usize,
    insertion: InsertionState,
    record: Record,
}

/// A running scene.
pub(crate) struct Run {
    pub(crate) opened: Arc<Setup>,
    pub(crate) insertion: Insertion<Solid>,
    pub(crate) record: Record,
    steps: usize,
    n_steps: usize,
    /// The step after which the picture of the needles in the tissue is taken.
    deepest: usize,
    stages: Stages,
    /// Wall time of each step of this process, s.
    step_seconds: Vec<f64>,
    threads: usize,
    wall: f64,
}

impl Run {
    /// A scene at its start.
    ///
    /// # Errors
    /// [`RunError`] if a layer below refuses.
    pub fn start(opened: Arc<Setup>, threads: usize) -> Result<Self, RunError> {
        let refuse = |reason: String| RunError::Inconsistent { source_name: opened.scene.label.clone(), reason };
        let (since, mut stages, team) = (Instant::now(), opened.stages, Team::new(threads));
        let mesh = opened.geometry.mesh.clone();
        let body = tissue::body(&mesh, &opened.tissues, &opened.scene, &team).map_err(refuse)?;
        stages.lap(Stage::Assemble, since);
        let settings = settings(&opened);
        let mut insertion =
            Insertion::new(mesh, body, opened.held.clone(), settings, opened.fields.clone(), [0.0; 3], &team)
                .map_err(|error| refuse(error.to_string()))?;
        for needle in &opened.needles {
            insertion.add_needle(needle.clone()).map_err(|error| refuse(named(&error)))?;
        }
        let u = &insertion.state().u;
        let mut record = Record::new(opened.needles.len(), &opened.geometry, &opened.points, u);
        let at_rest = quality::summary(insertion.mesh());
        record.totals.see_angles((at_rest.min_angle_deg, at_rest.max_angle_deg));
        Ok(Self::new(opened, insertion, record, 0, stages, threads))
    }

    /// A scene where a run was saved.
    ///
    /// # Errors
    /// [`RunError::State`] if the state does not fit together.
    pub fn resume(opened: Arc<Setup>, saved: SavedRun, threads: usize) -> Result<Self, RunError> {
        let refuse = |reason: String| RunError::State { path: "state".to_owned(), reason };
        let SavedRun { steps, insertion, record, .. } = saved;
        let team = Team::new(threads);
        if record.traces.len() != opened.needles.len() {
            let (found, expected) = (record.traces.len(), opened.needles.len());
            return Err(refuse(format!("found the state of {found} needles, expected {expected}")));
        }
        let body = tissue::body(insertion.mesh(), &opened.tissues, &opened.scene, &team).map_err(refuse)?;
        let insertion = Insertion::resume(insertion, body, settings(&opened), opened.fields.clone(), [0.0; 3], &team)
            .map_err(|error| refuse(error.to_string()))?;
        let stages = opened.stages;
        Ok(Self::new(opened, insertion, record, steps, stages, threads))
    }

    fn new(
        opened: Arc<Setup>,
        mut insertion: Insertion<Solid>,
        record: Record,
        steps: usize,
        stages: Stages,
        threads: usize,
    ) -> Self {
        if opened.scene.solver.preconditioner == PreconditionerKind::TwoLevel {
            insertion.integrator().set_preconditioner(TwoLevelSteps::default());
        }
        let dt = opened.scene.time.dt;
        let in_steps = |t: f64| (t / dt).round().max(1.0) as usize;
        let n_steps = in_steps(opened.end);
        let deepest = in_steps(opened.motions[0].deepest(opened.end, dt));
        let (step_seconds, wall) = (Vec::new(), 0.0);
        Self { opened, insertion, record, steps, n_steps, deepest, stages, step_seconds, threads, wall }
    }

    /// Time after so many steps, s.
    fn time(&self, steps: usize) -> f64 {
        steps as f64 * self.opened.scene.time.dt
    }

    fn add_stages(&mut self, before: &InsertionTimes) {
        let now = self.insertion.times();
        let mut add = |stage, pairs: &[(stylet_physics::dynamics::Spent, stylet_physics::dynamics::Spent)]| {
            let seconds = pairs.iter().map(|(after, before)| after.seconds - before.seconds).sum();
            let calls = pairs.iter().map(|(after, before)| after.calls - before.calls).max().unwrap_or(0);
            self.stages.add(stage, seconds, calls);
        };
        let (tissue, coupled) = (now.tissue, now.coupled);
        add(
            Stage::Tissue,
            &[
                (tissue.forces, before.tissue.forces),
                (tissue.linearize, before.tissue.linearize),
                (tissue.matrix, before.tissue.matrix),
            ],
        );
        add(Stage::Search, &[(coupled.couple, before.coupled.couple), (coupled.search, before.coupled.search)]);
        add(Stage::Needle, &[(coupled.needle, before.coupled.needle), (now.prepare, before.prepare)]);
        add(Stage::Remesh, &[(now.remesh, before.remesh)]);
        add(Stage::Reparameterise, &[(now.reparameterise, before.reparameterise)]);
    }

    /// What went wrong, with where the needles are.
    fn failure(&self, error: &InsertionError) -> RunError {
        let place = |(k, needle): (usize, &Needle)| {
            let (tip, node) = (needle.shaft.tip(), needle.shaft.n_nodes() - 1);
            format!(
                "needle {} has its tip, node {node}, at ({:.5}, {:.5}, {:.5}) m, {:.5} m deep",
                k + 1,
                tip[0],
                tip[1],
                tip[2],
                needle.depth()
            )
        };
        let places: Vec<String> = self.insertion.needles().iter().enumerate().map(place).collect();
        RunError::Step { step: self.steps + 1, reason: format!("{}; {}", named(error), places.join("; ")) }
    }

    fn steering_summary(&self) -> SteeringSummary {
        let (record, totals) = (&self.record, &self.record.totals);
        let mut sorted = self.step_seconds.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| sorted.get((share * (sorted.len().max(1) - 1) as f64) as usize).copied();
        let marker = |(marker, closest): (&crate::markers::Tracked, &Option<f64>)| MarkerSummary {
            name: marker.name.clone(),
            at: marker.at,
            place: marker.place,
            closest_tip_m: *closest,
        };
        SteeringSummary {
            time_s: self.time(self.steps),
            needles: self.insertion.needles().iter().zip(&record.traces).map(|(n, t)| self.needle(n, t)).collect(),
            trials_mean: totals.trials as f64 / totals.steps.max(1) as f64,
            trials_max: totals.most_trials,
            substeps: totals.substeps,
            halvings: totals.halvings,
            consistent_share: totals.consistent as f64 / totals.substeps.max(1) as f64,
            blocked: totals.blocked,
            elements_updated: totals.elements_updated,
            angles_deg: totals.angles_deg,
            step_s: [0.5, 0.99, 1.0].map(|share| quantile(share).unwrap_or(0.0)),
            clearance_m: record.clearance,
            markers: record.markers.iter().zip(&record.closest).map(marker).collect(),
            seeds: record.seed_summaries(),
            marker_error: self.opened.measured.as_ref().map(|measured| measured.error(&record.track)),
        }
    }

    fn needle(&self, needle: &Needle, traces: &[Trace]) -> FlexibleNeedle {
        let direction = needle.settings.direction;
        let push = |trace: &Trace| (0..3).map(|k| trace.force[k] * direction[k]).sum::<f64>();
        FlexibleNeedle {
            tip: needle.shaft.tip().to_vec(),
            tip_reference: self.reference(needle).to_vec(),
            depth_m: needle.depth(),
            max_depth_m: traces.iter().map(|trace| trace.depth).fold(0.0, f64::max),
            base_force: needle.base_force.to_vec(),
            base_torque: needle.base_moment.to_vec(),
            max_push_n: traces.iter().map(push).fold(0.0, f64::max),
            nodes: needle.nodes().len(),
            sticking: sticking(needle),
        }
    }

    /// The material point at the tip; where the tip is outside, the tip.
    fn reference(&self, needle: &Needle) -> [f64; 3] {
        let inside = needle.nodes().last().map(|node| self.insertion.mesh().point(VertexId(node.vertex)));
        inside.unwrap_or_else(|| needle.shaft.tip())
    }

    fn displacement_at(&self, at: &[f64]) -> Vec<f64> {
        let mesh = self.insertion.mesh();
        let found = <[f64; 3]>::try_from(at).ok().and_then(|at| mesh.locate(at));
        let Some(inside) = found else { return vec![f64::NAN; 3] };
        let (vertices, u) = (mesh.cell(inside.cell), self.displacement());
        (0..3).map(|k| (0..4).map(|i| inside.barycentric[i] * u[3 * vertices[i].index() + k]).sum()).collect()
    }
}

fn sticking(needle: &Needle) -> usize {
    needle.nodes().iter().filter(|node| node.state == SlipState::Static).count()
}

/// An error with needles counted from 1, as in scene files.
fn named(error: &InsertionError) -> String {
    match error {
        InsertionError::SharedElement { needle, other, cell } => format!(
            "needles {} and {} share cell {cell}: they must be in disjoint elements, or be withdrawn in reverse order",
            needle + 1,
            other + 1
        ),
        InsertionError::LeftTissue { needle, at } => format!(
            "needle {} has left the tissue at ({:.4}, {:.4}, {:.4}) m: a needle that comes out at the back is not followed",
            needle + 1,
            at[0],
            at[1],
            at[2]
        ),
        InsertionError::SleeveAtSkin { needle, length } => {
            format!("needle {}: its sleeve is {length:e} m from the tissue, too close to push on", needle + 1)
        }
        other => other.to_string(),
    }
}

fn settings(opened: &Setup) -> CoupledSettings {
    let (time, solver) = (&opened.scene.time, &opened.scene.solver);
    let scheme = match time.scheme {
        SchemeKind::Newmark => Scheme::Newmark { beta: time.beta, gamma: time.gamma },
        SchemeKind::Trapezoid => Scheme::TRAPEZOID,
        SchemeKind::BackwardEuler => Scheme::BackwardEuler,
    };
    let whole = |n: i64| usize::try_from(n).unwrap_or(usize::MAX);
    let search = match solver.search {
        SearchKind::Trials => SearchSettings::default(),
        SearchKind::Published => SearchSettings::published(),
        SearchKind::Condensed => SearchSettings { method: SearchMethod::Condensed, ..SearchSettings::default() },
    };
    CoupledSettings {
        dynamics: DynamicsSettings {
            scheme,
            max_inner_iterations: whole(solver.max_iterations),
            damping: Damping { mass: 0.0, stiffness: common_damping(&opened.tissues, &opened.scene).unwrap_or(0.0) },
            ..DynamicsSettings::new(time.dt)
        },
        search: SearchSettings {
            check_tolerance: solver.check_tolerance.max(solver.tolerance),
            solve_tolerance: solver.tolerance,
            max_trials: whole(solver.max_trials),
            ..search
        },
        coupling: match solver.coupling {
            Coupling::NullSpace => CouplingMethod::NullSpace,
            Coupling::KktCg => CouplingMethod::KktCg,
            Coupling::KktMinres => CouplingMethod::KktMinres,
            Coupling::Constraint => CouplingMethod::ConstraintPreconditioned,
        },
        tangent: Tangent::GaussNewton,
        implicit_twist: time.twist == TwistKind::Implicit,
        needle_scheme: Scheme::BackwardEuler,
        reach: time.reach.unwrap_or_else(|| 0.2 * opened.geometry.mean_edge()),
        gravity: [0.0; 3],
    }
}

/// Names of the numbers of one needle.
macro_rules! columns {
    ($prefix:literal) => {
        [
            concat!($prefix, "depth_m"),
            concat!($prefix, "tip_x"),
            concat!($prefix, "tip_y"),
            concat!($prefix, "tip_z"),
            concat!($prefix, "base_force_x"),
            concat!($prefix, "base_force_y"),
            concat!($prefix, "base_force_z"),
            concat!($prefix, "base_torque_x"),
            concat!($prefix, "base_torque_y"),
            concat!($prefix, "base_torque_z"),
        ]
    };
}

const QUANTITIES: [[&str; 10]; MOST_NEEDLES] =
    [columns!(""), columns!("needle2_"), columns!("needle3_"), columns!("needle4_")];

impl Simulation for Run {
    fn name(&self) -> &str {
        &self.opened.scene.name
    }

    fn dim(&self) -> usize {
        3
    }

    fn step(&mut self) -> Result<HistoryRow, RunError> {
        let since = Instant::now();
        let (stages, times) = (self.stages, self.insertion.times());
        let (t, h) = (self.time(self.steps), self.opened.scene.time.dt);
        let motions: Vec<BaseMotion> = self.opened.motions.iter().map(|motion| motion.mean(t, h)).collect();
        let result = self.insertion.step(&motions, h);
        let seconds = since.elapsed().as_secs_f64();
        self.wall += seconds;
        self.step_seconds.push(seconds);
        self.add_stages(&times);
        let report = result.map_err(|error| self.failure(&error))?;
        self.steps += 1;
        let t = self.time(self.steps);
        let opened = Arc::clone(&self.opened);
        self.record.note(t, &report, &mut self.insertion, &opened.releases, &opened.fixed);
        if self.steps == self.deepest {
            self.record.take_snapshot(t, &self.insertion);
        }
        let mut quantities = Vec::new();
        for needle in self.insertion.needles() {
            quantities.push(needle.depth());
            quantities.extend(needle.shaft.tip().iter().chain(&needle.base_force).chain(&needle.base_moment));
        }
        let needles = self.insertion.needles();
        Ok(HistoryRow {
            step: self.steps,
            time_s: t,
            quantities,
            iterations: report.iterations as u64,
            cycles: report.trials as u64,
            counts: vec![
                u64::from(report.substeps),
                u64::from(report.substeps - report.consistent.min(report.substeps)),
                u64::from(report.blocked),
                needles.iter().map(|needle| needle.nodes().len() as u64).sum(),
                needles.iter().map(|needle| sticking(needle) as u64).sum(),
            ],
            nodes: self.insertion.mesh().n_vertices(),
            elements: self.insertion.mesh().n_cells(),
            stage_seconds: self.stages.seconds_since(&stages),
        })
    }

    fn finished(&self) -> bool {
        self.steps >= self.n_steps
    }

    fn steps(&self) -> usize {
        self.steps
    }

    fn progress(&self) -> f64 {
        self.steps as f64 / self.n_steps as f64
    }

    fn place(&self, row: &HistoryRow) -> String {
        let depths: Vec<String> =
            self.insertion.needles().iter().map(|needle| format!("{:.1}", 1e3 * needle.depth())).collect();
        format!("step {}, {:.2} s, {} mm deep", row.step, row.time_s, depths.join(" and "))
    }

    fn frame_time(&self) -> f64 {
        self.time(self.steps)
    }

    fn stages(&self) -> &Stages {
        &self.stages
    }

    fn columns(&self) -> Columns {
        Columns {
            quantities: QUANTITIES[..self.insertion.needles().len()].concat(),
            counts: vec!["substeps", "inconsistent", "blocked", "needle_nodes", "sticking"],
            stages: vec![Stage::Tissue, Stage::Search, Stage::Needle, Stage::Remesh, Stage::Reparameterise],
        }
    }

    fn points(&self) -> &[f64] {
        self.insertion.mesh().points().as_flattened()
    }

    fn cells(&self) -> Vec<u32> {
        let mesh = self.insertion.mesh();
        mesh.cells().flat_map(|cell| mesh.cell(cell)).map(|vertex| vertex.0).collect()
    }

    fn displacement(&self) -> &[f64] {
        // The state keeps numbers of vertices that are gone.
        &self.insertion.state().u[..3 * self.insertion.mesh().n_vertex_slots()]
    }

    fn strain_energy(&self) -> f64 {
        self.insertion.body().strain_energy(&self.insertion.state().u)
    }

    fn summary(&self, probes: &[Vec<f64>]) -> Summary {
        let (mesh, u, totals) = (self.insertion.mesh(), &self.insertion.state().u, &self.record.totals);
        let quality = quality::summary(mesh);
        let inverted = |cell: &_| !self.insertion.body().jacobian(*cell, u).is_some_and(|j| j > 0.0);
        let first = &self.insertion.needles()[0];
        Summary {
            schema: 1,
            scene: self.opened.scene.name.clone(),
            converged: self.finished(),
            interrupted: !self.finished(),
            failure: None,
            dofs: 3 * mesh.n_vertices(),
            nodes: mesh.n_vertices(),
            elements: mesh.n_cells(),
            steps: self.steps,
            threads: self.threads,
            wall_s: self.wall,
            update_hz: if self.wall > 0.0 { self.step_seconds.len() as f64 / self.wall } else { 0.0 },
            energy_j: self.strain_energy(),
            solver: SolverSummary {
                iterations_total: totals.iterations,
                iterations_mean: totals.iterations as f64 / totals.trials.max(1) as f64,
                iterations_max: totals.most_iterations,
                relative_residual: if totals.threshold > 0.0 {
                    totals.residual / totals.threshold * self.opened.scene.solver.tolerance
                } else {
                    0.0
                },
                unconverged_solves: 0,
                first_unconverged_cycle: 0,
            },
            needle: Some(NeedleSummary {
                tip: first.shaft.tip().to_vec(),
                tip_reference: self.reference(first).to_vec(),
                base_force: first.base_force.to_vec(),
                base_torque: first.base_moment.to_vec(),
                rearrangements: usize::try_from(totals.trials).unwrap_or(usize::MAX),
                unsettled: usize::try_from(totals.substeps - totals.consistent).unwrap_or(usize::MAX),
                nodes: first.nodes().len(),
                sticking: sticking(first),
            }),
            steering: Some(self.steering_summary()),
            body: None,
            bytes: None,
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
        let toml = keys::TABLE.write(&self.opened.scene);
        let (insertion, record) = (self.insertion.save(), self.record.clone());
        Saved::new(APP, &SavedRun { toml, steps: self.steps, insertion, record })
    }

    fn frame_series(&self) -> &'static [FrameSeries] {
        &[FrameSeries::BODY, FrameSeries { name: "needle", prefix: "needle" }]
    }

    fn write_frame(&self, series: usize, path: &Path) -> Result<(), RunError> {
        match series {
            0 => frames::write_tissue(&self.insertion, self.displacement(), path),
            _ => frames::write_needles(&self.insertion, path),
        }
    }

    fn draw(&self, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError> {
        picture::draw(self, folder, rows)
    }
}
