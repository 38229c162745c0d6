//! The scenes of bodies that come with the program, and reading scenes from files.

use super::geometry::{AnyGeometry, Geometry};
use super::keys::TABLE;
use super::law::Law;
use super::material::all_linear;
use super::run::{APP, Run, SavedRun};
use super::scene::{PlaneKind, PreconditionerKind, Scene, Shape};
use super::setup::Setup;
use crate::error::RunError;
use crate::scenario::Scenario;
use crate::simulation::Simulation;
use crate::source::{BuiltIn, Source};
use crate::stages::{Stage, Stages};
use crate::state::{Saved, check_same_scene};
use std::convert::identity;
use std::sync::Arc;
use std::time::Instant;
use stylet_physics::material::{Hyperelastic, Linear, Plane, PlaneStress, Solid};

/// The scenes of bodies that come with the program.
pub const SCENES: &[BuiltIn] = &[
    BuiltIn {
        name: "block-drop",
        about: "a soft block hangs from its top under gravity and is let go",
        toml: include_str!("../../scenes/block-drop.toml"),
    },
    BuiltIn {
        name: "beam-bend",
        about: "a beam clamped at one end bends under its weight",
        toml: include_str!("../../scenes/beam-bend.toml"),
    },
    BuiltIn {
        name: "beam-twist",
        about: "a beam whose far end is turned by a quarter of a turn",
        toml: include_str!("../../scenes/beam-twist.toml"),
    },
    BuiltIn {
        name: "crush-recover",
        about: "a cube crushed to a point (start.shape: plane, line, scramble) comes back to rest",
        toml: include_str!("../../scenes/crush-recover.toml"),
    },
];

/// A scene that was read, with its mesh.
pub struct Opened {
    scene: Scene,
    geometry: AnyGeometry,
    stages: Stages,
}

/// Reads the text of a scene with `key=value` assignments on top, makes or reads its mesh, and checks that all goes together.
///
/// # Errors
/// [`RunError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(source: &Source, assignments: &[String]) -> Result<Opened, RunError> {
    let mut scene = Scene {
        name: source.name.clone(),
        label: source.label.clone(),
        folder: source.folder.clone(),
        ..Scene::default()
    };
    TABLE.read(&source.label, &source.text, &mut scene)?;
    for assignment in assignments {
        TABLE.set(&mut scene, assignment)?;
    }
    check(&scene).map_err(|reason| RunError::Inconsistent { source_name: source.label.clone(), reason })?;
    let mut stages = Stages::default();
    let since = Instant::now();
    let geometry = AnyGeometry::of(&scene)?;
    stages.lap(Stage::Mesh, since);
    if scene.material.plane.is_some() && matches!(geometry, AnyGeometry::Space(_)) {
        let reason = "material.plane: found in three dimensions, expected a mesh in the plane".to_owned();
        return Err(RunError::Inconsistent { source_name: source.label.clone(), reason });
    }
    let opened = Opened { scene, geometry, stages };
    // Places, loads and supports are input too: what is wrong with them is said before a run begins.
    match &opened.geometry {
        AnyGeometry::Plane(geometry) => Setup::new(&opened.scene, geometry, &mut Stages::default()).map(drop)?,
        AnyGeometry::Space(geometry) => Setup::new(&opened.scene, geometry, &mut Stages::default()).map(drop)?,
    }
    Ok(opened)
}

fn check(scene: &Scene) -> Result<(), String> {
    match (&scene.statics, &scene.time) {
        (None, None) => return Err("found neither [statics] nor [time], expected [statics], [time] or [needle]".into()),
        (Some(_), Some(_)) => return Err("time: found beside [statics], expected only one of the two".into()),
        _ => {}
    }
    check_instants(scene)?;
    let tissues = super::material::tissues(scene)?;
    if let Some(method) = scene.statics.as_ref().and_then(|statics| statics.method) {
        use super::scene::Method::{Cg, Ldlt, Llt};
        if matches!(method, Cg | Llt | Ldlt) && all_linear(&tissues).is_none() {
            return Err(
                "statics.method: found cg, llt or ldlt, expected newton-cg or another method for nonlinear materials"
                    .into(),
            );
        }
    }
    if scene.time.is_some() && scene.solver.preconditioner != PreconditionerKind::BlockJacobi {
        return Err("solver.preconditioner: found another one, expected block-jacobi in a scene with [time]".into());
    }
    let crushed = scene.start.as_ref().is_some_and(|start| start.shape != Shape::Rest);
    if crushed && tissues.iter().any(|tissue| Hyperelastic::<3>::requires_positive_j(&tissue.law)) {
        return Err(
            "start.shape: found a crushed start, expected rest: material.model does not bear elements turned inside out".into(),
        );
    }
    Ok(())
}

fn check_instants(scene: &Scene) -> Result<(), String> {
    let Some(output) = scene.output.as_ref().filter(|output| !output.instants.is_empty()) else { return Ok(()) };
    let Some(time) = &scene.time else {
        return Err("output.instants: found times in a scene with [statics], expected one with [time]".into());
    };
    let (times, end) = (&output.instants, time.end);
    if let Some(t) = times.iter().find(|t| !(0.0..=end).contains(*t)) {
        return Err(format!("output.instants: found {t} s, expected times from 0 to time.end = {end} s"));
    }
    match times.windows(2).find(|pair| pair[0] >= pair[1]) {
        Some([t, next]) => Err(format!("output.instants: found {t} s before {next} s, expected ascending times")),
        _ => Ok(()),
    }
}

impl Opened {
    fn run(&self, threads: usize, saved: Option<SavedRun>) -> Result<Box<dyn Simulation>, RunError> {
        match &self.geometry {
            AnyGeometry::Plane(geometry) => {
                let strain = self.scene.material.plane == Some(PlaneKind::Strain);
                let linear = |law: Linear| across(strain, law);
                self.run_in(geometry, linear, |law: Solid| across(strain, law), threads, saved)
            }
            AnyGeometry::Space(geometry) => {
                self.run_in(geometry, identity::<Linear>, identity::<Solid>, threads, saved)
            }
        }
    }

    /// The material is looked at once, here; everything below is compiled for it.
    fn run_in<const D: usize, const N: usize, L: Law<D> + 'static, S: Law<D> + 'static>(
        &self,
        geometry: &Arc<Geometry<D, N>>,
        linear: impl Fn(Linear) -> L,
        solid: impl Fn(Solid) -> S,
        threads: usize,
        saved: Option<SavedRun>,
    ) -> Result<Box<dyn Simulation>, RunError> {
        let mut stages = self.stages;
        let setup = Setup::new(&self.scene, geometry, &mut stages)?;
        let geometry = Arc::clone(geometry);
        if let Some(laws) = all_linear(&setup.tissues) {
            let laws: Vec<(u32, L)> = laws.into_iter().map(|(region, law)| (region, linear(law))).collect();
            return Ok(Box::new(Run::open(&self.scene, geometry, setup, &laws, threads, saved, stages)?));
        }
        let laws: Vec<(u32, S)> =
            setup.tissues.iter().enumerate().map(|(region, tissue)| (region as u32, solid(tissue.law))).collect();
        Ok(Box::new(Run::open(&self.scene, geometry, setup, &laws, threads, saved, stages)?))
    }
}

impl Scenario for Opened {
    fn name(&self) -> &str {
        &self.scene.name
    }

    fn dim(&self) -> usize {
        match self.geometry {
            AnyGeometry::Plane(_) => 2,
            AnyGeometry::Space(_) => 3,
        }
    }

    fn frames_every(&self) -> usize {
        self.scene.output.as_ref().map_or(0, |output| usize::try_from(output.frames).unwrap_or(0))
    }

    fn check_probes(&self, probes: &[Vec<f64>]) -> Result<(), RunError> {
        let outside = |at: &&Vec<f64>| match &self.geometry {
            AnyGeometry::Plane(geometry) => holds(geometry, at),
            AnyGeometry::Space(geometry) => holds(geometry, at),
        };
        let extent = match &self.geometry {
            AnyGeometry::Plane(geometry) => geometry.extent(),
            AnyGeometry::Space(geometry) => geometry.extent(),
        };
        match probes.iter().find(|at| !outside(at)) {
            Some(at) => Err(RunError::Probe { at: at.clone(), body: format!("body, which reaches {extent}") }),
            None => Ok(()),
        }
    }

    fn start(&self, threads: usize) -> Result<Box<dyn Simulation>, RunError> {
        self.run(threads, None)
    }

    fn resume(&self, saved: &Saved, threads: usize) -> Result<Box<dyn Simulation>, RunError> {
        let refuse = |reason| RunError::State { path: "state".to_owned(), reason };
        let saved: SavedRun = saved.decode(APP).map_err(refuse)?;
        let mut scene = Scene::default();
        TABLE.read("state", &saved.toml, &mut scene)?;
        check_same_scene(&TABLE, &scene, &self.scene).map_err(refuse)?;
        self.run(threads, Some(saved))
    }

    fn unreached(&self) -> String {
        let solver = &self.scene.solver;
        format!("solver.tolerance = {:e} within solver.max_iterations = {}", solver.tolerance, solver.max_iterations)
    }
}

/// A law with what holds across the plane.
fn across<M>(strain: bool, law: M) -> Plane<M> {
    if strain { Plane::Strain(law) } else { Plane::Stress(PlaneStress::new(law)) }
}

/// Whether the undeformed body holds a point.
fn holds<const D: usize, const N: usize>(geometry: &Geometry<D, N>, at: &[f64]) -> bool {
    at.try_into().is_ok_and(|at: [f64; D]| geometry.mesh.locate(at).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::find;

    #[test]
    fn built_in_scenes_are_sound_and_survive_writing() {
        for built_in in SCENES {
            assert!(built_in.toml.lines().count() <= 40, "{}", built_in.name);
            let opened = open(&find(built_in.name, SCENES).unwrap(), &[]).unwrap();
            let Scene { name, label, folder, .. } = opened.scene.clone();
            let mut again = Scene { name, label, folder, ..Scene::default() };
            TABLE.read("written", &TABLE.write(&opened.scene), &mut again).unwrap();
            assert_eq!(opened.scene, again);
        }
    }

    /// Other numbers for the same vertices: every vertex goes the same way but for rounding.
    #[test]
    fn a_renumbered_box_moves_the_same_way() {
        let assignments = |all: &[&str]| all.iter().map(|&a| a.to_owned()).collect::<Vec<_>>();
        let [made, rcm] = ["mesh.order=made", "mesh.order=rcm"].map(|order| {
            let cells = ["mesh.cells=[3, 4, 5]", "time.end=0.2", "solver.tolerance=1e-12", order];
            let opened = open(&find("block-drop", SCENES).unwrap(), &assignments(&cells)).unwrap();
            let mut run = opened.start(1).unwrap();
            while !run.finished() {
                run.step().unwrap();
            }
            (run.points().to_vec(), run.displacement().to_vec())
        });
        assert!(made.0.len() == 3 * 120 && made.0 != rcm.0);
        let largest = made.1.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
        for (x, u) in rcm.0.as_chunks::<3>().0.iter().zip(rcm.1.as_chunks::<3>().0) {
            let same = made.0.as_chunks::<3>().0.iter().position(|y| y == x).unwrap();
            let (u, v) = (u, &made.1[3 * same..][..3]);
            assert!((0..3).all(|k| (u[k] - v[k]).abs() < 1e-8 * largest), "{x:?}: {u:?} and {v:?}");
        }
        // Constraints and loads name the points of a file by their numbers.
        let file = assignments(&["mesh.file=box.msh", "mesh.order=rcm"]);
        let reason = open(&find("block-drop", SCENES).unwrap(), &file).err().unwrap().to_string();
        assert!(reason.contains("mesh.order: found rcm beside mesh.file, expected made"), "{reason}");
    }

    #[test]
    fn a_material_that_no_cell_takes_is_reported() {
        let warnings = |assignments: &[&str]| {
            let assignments: Vec<String> = assignments.iter().map(|&a| a.to_owned()).collect();
            let opened = open(&find("block-drop", SCENES).unwrap(), &assignments).unwrap();
            let AnyGeometry::Space(geometry) = &opened.geometry else { panic!("a block is a solid") };
            Setup::new(&opened.scene, geometry, &mut Stages::default()).unwrap().warnings
        };
        let all = "region=[{ name = \"all\", box = [-9, -9, -9, 9, 9, 9], poisson = 0.3 }]";
        assert_eq!(
            warnings(&[all, "material.poisson=0.35"]),
            ["material.poisson: 0.35 is without effect: every cell is in a [[region]] with poisson of its own"]
        );
        // Nor does a tissue without cells lock.
        assert_eq!(
            warnings(&[all, "material.poisson=0.49"]),
            ["material.poisson: 0.49 is without effect: every cell is in a [[region]] with poisson of its own"]
        );
        // Some cells are enough.
        let low = "region=[{ name = \"low\", box = [-9, -9, -9, 9, 9, 0.05], poisson = 0.3 }]";
        assert!(warnings(&[low, "material.poisson=0.35"]).is_empty());
        let young = "region=[{ name = \"all\", box = [-9, -9, -9, 9, 9, 9], young = 1e4 }]";
        assert_eq!(warnings(&[young]).len(), 1);
    }

    #[test]
    fn instants_are_ascending_times_of_a_motion() {
        let refusal = |name: &str, instants: &str| {
            let assignment = format!("output.instants={instants}");
            open(&find(name, SCENES).unwrap(), &[assignment]).err().map_or_else(String::new, |e| e.to_string())
        };
        assert_eq!(refusal("crush-recover", "[0.0, 0.1, 1.0]"), "");
        assert!(
            refusal("crush-recover", "[0.0, 1.5]").contains("found 1.5 s, expected times from 0 to time.end = 1 s")
        );
        assert!(refusal("crush-recover", "[0.2, 0.2]").contains("found 0.2 s before 0.2 s, expected ascending"));
        assert!(refusal("beam-bend", "[0.2]").contains("expected one with [time]"));
    }
}
