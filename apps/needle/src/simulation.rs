//! A scene brought to life: the one interface that the command line, the benches and other programs drive.

use crate::error::NeedleError;
use crate::frames;
use crate::history::{CycleRow, columns, depth_and_force};
use crate::insertion::Insertion;
use crate::needle::Needle;
use crate::picture;
use crate::scene::{MaterialStage, Scene, Tissue};
use crate::shaft::Hold;
use crate::slab::Slab;
use crate::stages::Stages;
use crate::state::{Experiment as SavedExperiment, State};
use crate::static_load::StaticLoad;
use crate::tip::find_in_reference;
use std::path::Path;
use std::time::Instant;
use stylet_mesh::{SimplexMesh, VertexId, quality};
use stylet_physics::material::{Hyperelastic, PlaneStress, Solid};
use stylet_solver::sparse::BlockCsr;
use stylet_tissue::Simulation as _;
use stylet_tissue::history::{Columns, HistoryRow};
use stylet_tissue::simulation::FrameSeries;
use stylet_tissue::state::Saved;
use stylet_tissue::summary::{NeedleSummary, Probe, QualitySummary, SolverSummary, Summary};

/// A running needle scene, whatever its material: what it shows beside what every scene does. In a slab (`<2, 3>`) unless
/// said otherwise, in a cube `<3, 4>`.
pub trait Simulation<const D: usize = 2, const N: usize = 3>: stylet_tissue::Simulation {
    /// The scene.
    fn scene(&self) -> &Scene;

    /// The mesh.
    fn mesh(&self) -> &SimplexMesh<D, N>;

    /// The needle.
    fn needle(&self) -> Option<&Needle<D>>;

    /// Vertices on the needle, from the tip backwards, and whether each sticks.
    fn needle_nodes(&self) -> Vec<(VertexId, bool)>;

    /// The stiffness matrix of the last solve, N/m.
    fn stiffness(&self) -> &BlockCsr<D>;

    /// First Piola-Kirchhoff stress of each live cell in ascending order, Pa, row by row: `P11, P12, ...`.
    fn stresses(&self) -> Vec<f64>;
}

/// Makes the starting state of a slab. `threads` is the most that any stage may use.
///
/// # Errors
/// [`NeedleError`] if the scene's keys do not go together, if it is not one of a slab, or a layer below refuses.
pub fn start(scene: &Scene, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
    open_slab(scene, threads, None)
}

/// As [`start`], of a cube.
///
/// # Errors
/// As [`start`].
pub fn start_cube(scene: &Scene, threads: usize) -> Result<Box<dyn Simulation<3, 4>>, NeedleError> {
    open_cube(scene, threads, None)
}

/// Goes on from a saved state of a slab, with the same bits as the run that was saved.
///
/// # Errors
/// [`NeedleError::State`] if the state does not fit together.
pub fn resume(state: State<2, 3>, threads: usize) -> Result<Box<dyn Simulation>, NeedleError> {
    let scene = state.scene.clone();
    open_slab(&scene, threads, Some(state))
}

/// As [`resume`], of a cube.
///
/// # Errors
/// As [`resume`].
pub fn resume_cube(state: State<3, 4>, threads: usize) -> Result<Box<dyn Simulation<3, 4>>, NeedleError> {
    let scene = state.scene.clone();
    open_cube(&scene, threads, Some(state))
}

/// Whether the material is linear is looked at once, here; everything below is compiled for it. The nonlinear laws share a
/// type, whose kernels are compiled with it.
fn open_slab(scene: &Scene, threads: usize, state: Option<State<2, 3>>) -> Result<Box<dyn Simulation>, NeedleError> {
    check(scene, Tissue::Slab)?;
    match law(scene)? {
        Solid::Linear(law) => Run::open(scene, PlaneStress::new(law), threads, state),
        law => Run::open(scene, PlaneStress::new(law), threads, state),
    }
}

/// As [`open_slab`].
fn open_cube(
    scene: &Scene,
    threads: usize,
    state: Option<State<3, 4>>,
) -> Result<Box<dyn Simulation<3, 4>>, NeedleError> {
    check(scene, Tissue::Cube)?;
    match law(scene)? {
        Solid::Linear(law) => Run::open(scene, law, threads, state),
        law => Run::open(scene, law, threads, state),
    }
}

fn check(scene: &Scene, expected: Tissue) -> Result<(), NeedleError> {
    crate::check::check(scene, &scene.name)?;
    if scene.mesh.kind == expected {
        return Ok(());
    }
    let reason = format!("mesh.kind: found {:?}, expected {expected:?} here", scene.mesh.kind);
    Err(NeedleError::Inconsistent { source_name: scene.name.clone(), reason })
}

/// The law of a scene.
fn law(scene: &Scene) -> Result<Solid, NeedleError> {
    let MaterialStage { model, young, poisson } = scene.material;
    Solid::from_young_poisson(model.name(), young, poisson)
        .map_err(|e| NeedleError::Inconsistent { source_name: scene.name.clone(), reason: e.to_string() })
}

/// What a scene with a needle does.
enum Experiment<const D: usize, const N: usize, M: Hyperelastic<D>> {
    Static(Box<StaticLoad<D, N, M>>),
    Insertion(Box<Insertion<D, N, M>>),
}

/// A running scene of one material.
struct Run<const D: usize, const N: usize, M: Hyperelastic<D>> {
    scene: Scene,
    experiment: Experiment<D, N, M>,
    stages: Stages,
    threads: usize,
    wall: f64,
    /// Steps that an earlier run has done.
    first_step: usize,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D> + 'static> Run<D, N, M> {
    fn open(
        scene: &Scene,
        material: M,
        threads: usize,
        state: Option<State<D, N>>,
    ) -> Result<Box<dyn Simulation<D, N>>, NeedleError> {
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

    fn slab(&self) -> &Slab<D, N, M> {
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
                base_force: vec![0.0; D],
                base_torque: Hold::<D>::default().moment_components().to_vec(),
                nodes: load.nodes.len(),
                ..NeedleSummary::default()
            },
            Experiment::Insertion(insertion) => {
                let held_by = insertion.held_by();
                NeedleSummary {
                    tip: insertion.needle.tip().to_vec(),
                    tip_reference: insertion.tip_reference().to_vec(),
                    base_force: held_by.force.to_vec(),
                    base_torque: held_by.moment_components().to_vec(),
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

impl<const D: usize, const N: usize, M: Hyperelastic<D> + 'static> stylet_tissue::Simulation for Run<D, N, M> {
    fn name(&self) -> &str {
        &self.scene.name
    }

    fn dim(&self) -> usize {
        D
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
                held_by: Hold::default(),
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
        let (depth, _) = depth_and_force::<D>(row);
        let cells = if D == 2 { "triangles" } else { "tetrahedra" };
        format!("cycle {}, {:.1} mm in, {} {cells}", row.step, 1e3 * depth, row.elements)
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
            steering: None,
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

impl<const D: usize, const N: usize, M: Hyperelastic<D> + 'static> Simulation<D, N> for Run<D, N, M> {
    fn scene(&self) -> &Scene {
        &self.scene
    }

    fn mesh(&self) -> &SimplexMesh<D, N> {
        &self.slab().mesh
    }

    fn needle(&self) -> Option<&Needle<D>> {
        match &self.experiment {
            Experiment::Static(load) => Some(&load.needle),
            Experiment::Insertion(insertion) => Some(&insertion.needle),
        }
    }

    fn needle_nodes(&self) -> Vec<(VertexId, bool)> {
        match &self.experiment {
            Experiment::Static(load) => load.nodes.iter().rev().map(|&vertex| (vertex, false)).collect(),
            Experiment::Insertion(insertion) => {
                insertion.shaft.nodes.iter().map(|node| (node.vertex, node.sticks())).collect()
            }
        }
    }

    fn stiffness(&self) -> &BlockCsr<D> {
        self.slab().body.stiffness()
    }

    fn stresses(&self) -> Vec<f64> {
        let slab = self.slab();
        let mut stresses = Vec::with_capacity(D * D * slab.mesh.n_cells());
        for cell in slab.mesh.cells() {
            let stress = slab.body.stress(cell, &slab.u);
            // Every live cell of the mesh has its element.
            let component = |k: usize| stress.map_or(f64::NAN, |p| p[(k / D, k % D)]);
            stresses.extend((0..D * D).map(component));
        }
        stresses
    }
}

/// The P1 displacement at a point of the undeformed slab; NaN outside, which checked probes never are.
fn displacement_at<const D: usize, const N: usize, M: Hyperelastic<D>>(slab: &Slab<D, N, M>, at: &[f64]) -> Vec<f64> {
    let found = at.try_into().ok().and_then(|at: [f64; D]| find_in_reference(&slab.mesh, slab.mesh.cells(), at));
    let Some(inside) = found else { return vec![f64::NAN; D] };
    let vertices = slab.mesh.cell(inside.cell);
    let component = |k| (0..N).map(|i| inside.barycentric[i] * slab.u[D * vertices[i].index() + k]).sum();
    (0..D).map(component).collect()
}
