//! A scene brought to life: the one interface that the command line, the benches and other programs drive.

use crate::error::NeedleError;
use crate::frames;
use crate::history::{CycleRow, columns, depth_and_force};
use crate::insertion::Insertion;
use crate::needle::{Needle, Vec2};
use crate::picture;
use crate::scene::{Model, Scene};
use crate::slab::Slab;
use crate::stages::Stages;
use crate::state::{Experiment as SavedExperiment, State};
use crate::static_load::StaticLoad;
use crate::tip::{TriMesh, find_in_reference};
use std::path::Path;
use std::time::Instant;
use stylet_mesh::quality;
use stylet_physics::material::{Hyperelastic, Linear, MaterialError, NeoHookean, PlaneStress, StVenantKirchhoff};
use stylet_solver::sparse::BlockCsr;
use stylet_tissue::Simulation as _;
use stylet_tissue::history::{Columns, HistoryRow};
use stylet_tissue::simulation::FrameSeries;
use stylet_tissue::state::Saved;
use stylet_tissue::summary::{NeedleSummary, Probe, QualitySummary, SolverSummary, Summary};

/// A running needle scene, whatever its material: what it shows beside what every scene does.
pub trait Simulation: stylet_tissue::Simulation {
    /// The scene.
    fn scene(&self) -> &Scene;

    /// The mesh.
    fn mesh(&self) -> &TriMesh;

    /// The needle.
    fn needle(&self) -> Option<&Needle>;

    /// Vertices on the needle, from the tip backwards, and whether each sticks.
    fn needle_nodes(&self) -> Vec<(stylet_mesh::VertexId, bool)>;

    /// The stiffness matrix of the last solve, N/m.
    fn stiffness(&self) -> &BlockCsr<2>;

    /// First Piola-Kirchhoff stress of each live triangle in ascending order, Pa: `[P11, P12, P21, P22]`.
    fn stresses(&self) -> Vec<[f64; 4]>;
}

/// Makes the scene's starting state. `threads` is the most that any stage may use.
///
/// # Errors
/// [`NeedleError`] if the scene's keys do not go together, or a layer below refuses.
pub fn start(scene: &Scene, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
    dispatch(scene, threads, None)
}

/// Goes on from a saved state, with the same bits as the run that was saved.
///
/// # Errors
/// [`NeedleError::State`] if the state does not fit together.
pub fn resume(state: State, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
    let scene = state.scene.clone();
    dispatch(&scene, threads, Some(state))
}

/// The material is looked at once, here; everything below is compiled for it.
fn dispatch(scene: &Scene, threads: usize, state: Option<State>) -> Result<Box<dyn Simulation>, NeedleError> {
    crate::check::check(scene, &scene.name)?;
    let (young, poisson) = (scene.material.young, scene.material.poisson);
    let refuse =
        |e: MaterialError| NeedleError::Inconsistent { source_name: scene.name.clone(), reason: e.to_string() };
    match scene.material.model {
        Model::Linear => {
            let material = Linear::from_young_poisson(young, poisson).map_err(refuse)?;
            Run::open(scene, PlaneStress::new(material), threads, state)
        }
        Model::StVenantKirchhoff => {
            let material = StVenantKirchhoff::from_young_poisson(young, poisson).map_err(refuse)?;
            Run::open(scene, PlaneStress::new(material), threads, state)
        }
        Model::NeoHookean => {
            let material = NeoHookean::from_young_poisson(young, poisson).map_err(refuse)?;
            Run::open(scene, PlaneStress::new(material), threads, state)
        }
    }
}

/// What a scene with a needle does.
enum Experiment<M: Hyperelastic<2>> {
    Static(Box<StaticLoad<M>>),
    Insertion(Box<Insertion<M>>),
}

/// A running scene of one material.
struct Run<M: Hyperelastic<2>> {
    scene: Scene,
    experiment: Experiment<M>,
    stages: Stages,
    threads: usize,
    wall: f64,
    /// Steps that an earlier run has done.
    first_step: usize,
}

impl<M: Hyperelastic<2> + 'static> Run<M> {
    fn open(
        scene: &Scene,
        material: M,
        threads: usize,
        state: Option<State>,
    ) -> Result<Box<dyn Simulation>, NeedleError> {
        let mut stages = Stages::default();
        let since = Instant::now();
        let needle = scene.needle.as_ref();
        let experiment = match (needle, &scene.load, &scene.friction) {
            (Some(needle), Some(load), None) => {
                let slab = Slab::new(scene, material, threads, &mut stages)?;
                // A static load is one solve: there is nothing to go on from but its start or its end.
                Experiment::Static(Box::new(StaticLoad::new(scene, needle, load, slab, &mut stages)?))
            }
            (Some(needle), None, Some(friction)) => match state {
                None => {
                    let slab = Slab::new(scene, material, threads, &mut stages)?;
                    Experiment::Insertion(Box::new(Insertion::new(scene, needle, friction, slab)?))
                }
                Some(State { experiment: SavedExperiment::Insertion(saved), .. }) => {
                    let restored = Insertion::restore(scene, needle, friction, material, threads, *saved);
                    let refuse = |reason| NeedleError::State { path: "state".to_owned(), reason };
                    Experiment::Insertion(Box::new(restored.map_err(refuse)?))
                }
                Some(_) => {
                    let reason = "found the state of a static load, expected that of an insertion".to_owned();
                    return Err(NeedleError::State { path: "state".to_owned(), reason });
                }
            },
            _ => unreachable_stages(scene)?,
        };
        let wall = since.elapsed().as_secs_f64();
        let mut run = Self { scene: scene.clone(), experiment, stages, threads, wall, first_step: 0 };
        run.first_step = run.steps();
        Ok(Box::new(run))
    }

    fn slab(&self) -> &Slab<M> {
        match &self.experiment {
            Experiment::Static(load) => &load.slab,
            Experiment::Insertion(insertion) => &insertion.slab,
        }
    }

    fn needle_summary(&self) -> NeedleSummary {
        match &self.experiment {
            Experiment::Static(load) => NeedleSummary {
                tip: load.needle.tip().to_vec(),
                tip_reference: load.needle.tip().to_vec(),
                base_force: vec![0.0; 2],
                base_torque: vec![0.0],
                nodes: load.nodes.len(),
                ..NeedleSummary::default()
            },
            Experiment::Insertion(insertion) => {
                let (base_force, base_torque) = insertion.held_by();
                NeedleSummary {
                    tip: insertion.needle.tip().to_vec(),
                    tip_reference: insertion.tip_reference().to_vec(),
                    base_force: base_force.to_vec(),
                    base_torque: vec![base_torque],
                    rearrangements: insertion.cycles(),
                    unsettled: insertion.unsettled(),
                    nodes: insertion.shaft.nodes.len(),
                    sticking: insertion.shaft.nodes.iter().filter(|node| node.sticks()).count(),
                }
            }
        }
    }
}

/// The scene was checked before: this names the stages all the same, should that check ever miss something.
fn unreachable_stages<T>(scene: &Scene) -> Result<T, NeedleError> {
    let reason = "expected a [needle] stage with either [load] or [friction]".to_owned();
    Err(NeedleError::Inconsistent { source_name: scene.name.clone(), reason })
}

impl<M: Hyperelastic<2> + 'static> stylet_tissue::Simulation for Run<M> {
    fn name(&self) -> &str {
        &self.scene.name
    }

    fn dim(&self) -> usize {
        2
    }

    fn step(&mut self) -> Result<HistoryRow, NeedleError> {
        let since = Instant::now();
        let before = self.stages;
        let result = match &mut self.experiment {
            Experiment::Insertion(insertion) => insertion.cycle(&mut self.stages),
            Experiment::Static(load) => load.solve(&mut self.stages).map(|iterations| CycleRow {
                step: 1,
                depth_m: load.needle.pose().insert,
                tip: load.needle.tip(),
                iterations,
                cycles: 1,
                needle_nodes: load.nodes.len(),
                nodes: load.slab.mesh.n_vertices(),
                elements: load.slab.mesh.n_cells(),
                ..CycleRow::default()
            }),
        };
        self.wall += since.elapsed().as_secs_f64();
        result.map(|row| HistoryRow { stage_seconds: self.stages.seconds_since(&before), ..row.into() })
    }

    fn finished(&self) -> bool {
        match &self.experiment {
            Experiment::Static(load) => load.solved,
            Experiment::Insertion(insertion) => insertion.finished(),
        }
    }

    fn steps(&self) -> usize {
        match &self.experiment {
            Experiment::Static(load) => usize::from(load.solved),
            Experiment::Insertion(insertion) => insertion.cycles(),
        }
    }

    fn progress(&self) -> f64 {
        match &self.experiment {
            Experiment::Static(load) => f64::from(u8::from(load.solved)),
            Experiment::Insertion(insertion) => insertion.progress(),
        }
    }

    fn place(&self, row: &HistoryRow) -> String {
        let (depth, _) = depth_and_force(row);
        format!("cycle {}, {:.1} mm in, {} triangles", row.step, 1e3 * depth, row.elements)
    }

    /// Cycles stand for the time that quasi-static scenes do not have.
    fn frame_time(&self) -> f64 {
        self.steps() as f64
    }

    fn stages(&self) -> &Stages {
        &self.stages
    }

    fn columns(&self) -> Columns {
        columns(&self.scene)
    }

    fn points(&self) -> &[f64] {
        self.slab().mesh.points().as_flattened()
    }

    fn cells(&self) -> Vec<u32> {
        let mesh = &self.slab().mesh;
        mesh.cells().flat_map(|cell| mesh.cell(cell)).map(|vertex| vertex.0).collect()
    }

    fn displacement(&self) -> &[f64] {
        &self.slab().u
    }

    fn strain_energy(&self) -> f64 {
        self.slab().strain_energy()
    }

    fn summary(&self, probes: &[Vec<f64>]) -> Summary {
        let slab = self.slab();
        let totals = slab.solver().totals();
        let steps = self.steps();
        let quality = quality::summary(&slab.mesh);
        Summary {
            schema: 1,
            scene: self.scene.name.clone(),
            converged: self.finished() && totals.unconverged == 0,
            interrupted: !self.finished(),
            failure: None,
            dofs: slab.u.len(),
            nodes: slab.mesh.n_vertices(),
            elements: slab.mesh.n_cells(),
            steps,
            threads: self.threads,
            wall_s: self.wall,
            update_hz: if self.wall > 0.0 { (steps - self.first_step) as f64 / self.wall } else { 0.0 },
            energy_j: slab.strain_energy(),
            solver: SolverSummary {
                iterations_total: totals.iterations,
                iterations_mean: totals.iterations as f64 / (totals.solves.max(1)) as f64,
                iterations_max: totals.most,
                relative_residual: totals.relative_residual,
                unconverged_solves: totals.unconverged,
                first_unconverged_cycle: totals.first_unconverged,
            },
            needle: Some(self.needle_summary()),
            body: None,
            bytes: None,
            probes: probes.iter().map(|at| Probe { at: at.clone(), displacement: displacement_at(slab, at) }).collect(),
            quality: QualitySummary {
                min_angle_deg: quality.min_angle_deg,
                max_angle_deg: quality.max_angle_deg,
                min_quality: quality.min_quality,
                inverted_elements: slab.inverted_elements(),
            },
            stages: self.stages,
        }
    }

    fn save(&self) -> Result<Saved, String> {
        let experiment = match &self.experiment {
            Experiment::Static(_) => SavedExperiment::Static,
            Experiment::Insertion(insertion) => SavedExperiment::Insertion(Box::new(insertion.save())),
        };
        State { scene: self.scene.clone(), experiment }.to_saved()
    }

    fn frame_series(&self) -> &'static [FrameSeries] {
        frames::SERIES
    }

    fn write_frame(&self, series: usize, path: &Path) -> Result<(), NeedleError> {
        match (series, self.needle()) {
            (0, _) => frames::write_body(self, path),
            (_, Some(needle)) => frames::write_needle(self, needle, path),
            _ => Ok(()),
        }
    }

    fn draw(&self, folder: &Path, rows: &[HistoryRow]) -> Result<(), NeedleError> {
        picture::draw(self, folder, rows)
    }
}

impl<M: Hyperelastic<2> + 'static> Simulation for Run<M> {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn mesh(&self) -> &TriMesh {
        &self.slab().mesh
    }

    fn needle(&self) -> Option<&Needle> {
        match &self.experiment {
            Experiment::Static(load) => Some(&load.needle),
            Experiment::Insertion(insertion) => Some(&insertion.needle),
        }
    }

    fn needle_nodes(&self) -> Vec<(stylet_mesh::VertexId, bool)> {
        match &self.experiment {
            Experiment::Static(load) => load.nodes.iter().rev().map(|&vertex| (vertex, false)).collect(),
            Experiment::Insertion(insertion) => {
                insertion.shaft.nodes.iter().map(|node| (node.vertex, node.sticks())).collect()
            }
        }
    }

    fn stiffness(&self) -> &BlockCsr<2> {
        self.slab().body.stiffness()
    }

    fn stresses(&self) -> Vec<[f64; 4]> {
        let slab = self.slab();
        let of = |cell| {
            // Every live cell of the mesh has its element.
            slab.body.stress(cell, &slab.u).map_or([f64::NAN; 4], |p| [p[(0, 0)], p[(0, 1)], p[(1, 0)], p[(1, 1)]])
        };
        slab.mesh.cells().map(of).collect()
    }
}

/// The P1 displacement at a point of the undeformed slab; NaN outside, which checked probes never are.
fn displacement_at<M: Hyperelastic<2>>(slab: &Slab<M>, at: &[f64]) -> Vec<f64> {
    let found = at.try_into().ok().and_then(|at: Vec2| find_in_reference(&slab.mesh, slab.mesh.cells(), at));
    let Some(inside) = found else { return vec![f64::NAN; 2] };
    let vertices = slab.mesh.cell(inside.cell);
    let component = |k| (0..3).map(|i| inside.barycentric[i] * slab.u[2 * vertices[i].index() + k]).sum();
    (0..2).map(component).collect()
}
