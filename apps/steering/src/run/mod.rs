//! A running scene of flexible needles.

mod checkpoint;
mod failure;
mod history;
mod settings;
mod summary;

use crate::builtin::Setup;
use crate::instants::Instants;
use crate::record::Record;
use crate::{frames, keys, picture, tissue};
use checkpoint::{Checkpoint, precondition, revive};
use serde::{Deserialize, Serialize};
use settings::settings;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use stylet_mesh::quality;
use stylet_physics::insertion::{BaseMotion, Insertion, InsertionState};
use stylet_physics::material::Solid;
use stylet_solver::team::Team;
use stylet_tissue::history::{Columns, HistoryRow};
use stylet_tissue::simulation::FrameSeries;
use stylet_tissue::stages::{Stage, Stages};
use stylet_tissue::state::Saved;
use stylet_tissue::summary::Summary;
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
    checkpoint: Checkpoint,
    pub(crate) record: Record,
    steps: usize,
    n_steps: usize,
    /// The steps after which pictures of the needles in the tissue are taken; `None` where nothing will be drawn.
    instants: Option<Instants>,
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
            insertion.add_needle(needle.clone()).map_err(|error| refuse(error.to_string()))?;
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
        let insertion = revive(&opened, insertion, &team).map_err(refuse)?;
        let stages = opened.stages;
        Ok(Self::new(opened, insertion, record, steps, stages, threads))
    }

    fn new(
        opened: Arc<Setup>,
        mut insertion: Insertion<Solid>,
        record: Record,
        steps: usize,
        mut stages: Stages,
        threads: usize,
    ) -> Self {
        // The time of a run is that of its steps.
        stages.begin_steps();
        precondition(&opened, &mut insertion);
        let checkpoint = Checkpoint::of(steps, &insertion);
        let dt = opened.scene.time.dt;
        let in_steps = |t: f64| (t / dt).round().max(1.0) as usize;
        let n_steps = in_steps(opened.end);
        let instants = Some(Instants::of(&opened.motions, opened.end, dt));
        let (step_seconds, wall) = (Vec::new(), 0.0);
        Self { opened, insertion, checkpoint, record, steps, n_steps, instants, stages, step_seconds, threads, wall }
    }

    /// Time after so many steps, s.
    fn time(&self, steps: usize) -> f64 {
        let time = steps as f64 * self.opened.scene.time.dt;
        // What is left of decimal steps, such as 5.0200000000000005, to the picosecond.
        (time * 1e12).round() / 1e12
    }
}

/// What the bases do in the step after so many.
fn motions(opened: &Setup, steps: usize) -> Vec<BaseMotion> {
    let h = opened.scene.time.dt;
    opened.motions.iter().map(|motion| motion.mean(steps as f64 * h, h)).collect()
}

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
        let h = self.opened.scene.time.dt;
        let motions = motions(&self.opened, self.steps);
        let result = self.insertion.step(&motions, h);
        let seconds = since.elapsed().as_secs_f64();
        self.wall += seconds;
        self.step_seconds.push(seconds);
        self.add_stages(&times);
        let made = result.map_err(|error| self.failure(&error));
        let report = match made.and_then(|report| self.check_tips().map(|()| report)) {
            Ok(report) => report,
            Err(error) => {
                self.go_back();
                return Err(error);
            }
        };
        self.steps += 1;
        self.checkpoint.follow(self.steps, &self.insertion);
        let t = self.time(self.steps);
        let opened = Arc::clone(&self.opened);
        self.record.note(t, &report, &mut self.insertion, &opened.releases, &opened.fixed);
        if self.instants.is_some_and(|instants| instants.contains(self.steps)) {
            self.record.take_snapshot(t, &self.insertion);
        }
        Ok(self.row(&report, &stages))
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
        history::columns(self.insertion.needles().len())
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
        self.summarise(probes)
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

    fn forgo_pictures(&mut self) {
        self.instants = None;
    }

    fn draw(&self, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError> {
        picture::draw(self, folder, rows)
    }
}
