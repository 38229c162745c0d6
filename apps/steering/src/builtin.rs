//! The scenes of flexible needles that come with the program, and opening scenes.

use crate::geometry::{Geometry, Surface};
use crate::interaction::Fields;
use crate::keys::{TABLE, name_of};
use crate::markers::Measured;
use crate::motion::Motion;
use crate::run::{APP, Run, SavedRun};
use crate::scene::Scene;
use crate::tissue::{Tissue, subspace, tissues};
use crate::{aim, needle, plausible};
use std::sync::Arc;
use std::time::Instant;
use stylet_physics::insertion::NeedleSettings;
use stylet_scene::{Column, Key, Kind, Place, Problem, SceneError, Value, nearest};
use stylet_solver::subspace::Subspace;
use stylet_tissue::source::{BuiltIn, Source};
use stylet_tissue::stages::{Stage, Stages};
use stylet_tissue::state::{Saved, check_same_scene};
use stylet_tissue::{RunError, Scenario, Simulation};

/// Needles at most: the history has columns for each.
pub const MOST_NEEDLES: usize = 4;

macro_rules! built_in {
    ($name:literal, $about:literal) => {
        BuiltIn { name: $name, about: $about, toml: include_str!(concat!("../scenes/", $name, ".toml")) }
    };
    // The scene `$of` at another pace.
    ($name:literal, $about:literal, $of:literal at $pace:literal) => {
        BuiltIn {
            name: $name,
            about: $about,
            toml: concat!(include_str!(concat!("../scenes/", $of, ".toml")), "\n[time]\npace = ", $pace, "\n"),
        }
    };
}

/// The scenes of flexible needles that come with the program.
pub const SCENES: &[BuiltIn] = &[
    built_in!("prostate-flexible", "a flexible bevel-tip needle into a prostate and back, leaving seeds"),
    built_in!("prostate-flexible-slow", "the same, a quarter as fast", "prostate-flexible" at "0.25"),
    built_in!("prostate-flexible-vigorous", "the same needle pushed fast, pulled and turned about"),
    built_in!("prostate-stiff", "a stiff needle with a symmetric tip into the same tissue"),
    built_in!("prostate-stiff-slow", "the same, a quarter as fast", "prostate-stiff" at "0.25"),
    built_in!("prostate-stiff-vigorous", "the same, four times as fast", "prostate-stiff" at "4.0"),
    built_in!("two-cylinders", "a bevel-tip needle turned so that it passes two rigid cylinders and meets a target"),
    built_in!("two-cylinders-slow", "the same, a quarter as fast", "two-cylinders" at "0.25"),
    built_in!("two-cylinders-vigorous", "the same, twice as fast", "two-cylinders" at "2.0"),
    built_in!("gel-single-bend", "a bevel-tip needle bends through a gelatine phantom with markers"),
    built_in!("gel-single-bend-slow", "the same, a quarter as fast", "gel-single-bend" at "0.25"),
    built_in!("gel-double-bend", "the same phantom; the needle is turned by half a turn half way"),
    built_in!("gel-double-bend-slow", "the same, a quarter as fast", "gel-double-bend" at "0.25"),
    built_in!("gel-double-bend-vigorous", "the same, four times as fast", "gel-double-bend" at "4.0"),
    built_in!("gel-vigorous", "the same phantom, with fast pushes and reversals"),
    built_in!("two-needles", "two needles side by side in a gel, withdrawn one after the other"),
    built_in!("two-needles-slow", "the same, a quarter as fast", "two-needles" at "0.25"),
    built_in!("two-needles-vigorous", "the same, four times as fast", "two-needles" at "4.0"),
];

/// A scene that was read and checked, with its mesh.
pub struct Opened(Arc<Setup>);

/// All that a run is started from.
pub(crate) struct Setup {
    pub(crate) scene: Scene,
    pub(crate) geometry: Geometry,
    pub(crate) tissues: Vec<Tissue>,
    pub(crate) held: Subspace<3>,
    pub(crate) fields: Fields,
    pub(crate) needles: Vec<NeedleSettings>,
    pub(crate) motions: Vec<Motion>,
    pub(crate) releases: Vec<Vec<f64>>,
    /// Names and places of the markers.
    pub(crate) points: Vec<(String, [f64; 3])>,
    pub(crate) measured: Option<Measured>,
    /// Surfaces of what is held.
    pub(crate) fixed: Vec<Surface>,
    /// End of the run, s.
    pub(crate) end: f64,
    pub(crate) stages: Stages,
    /// What is hardly meant, a line each.
    pub(crate) doubts: Vec<String>,
}

/// Reads the text of a scene with `key=value` assignments on top, makes or reads its mesh, and checks that all goes together.
///
/// # Errors
/// [`RunError`] in one line: the file, the key or line, what was found and what was expected.
pub fn open(source: &Source, assignments: &[String]) -> Result<Opened, RunError> {
    let Source { name, label, folder, .. } = source.clone();
    let mut scene = Scene { name, label, folder, ..Scene::default() };
    TABLE.read(&source.label, &source.text, &mut scene)?;
    for assignment in assignments {
        set(&mut scene, assignment)?;
    }
    of_scene(scene).map(|setup| Opened(Arc::new(setup)))
}

/// Sets `key=value`. A column of an array of tables, such as `needle.bevel`, is that of its only row.
fn set(scene: &mut Scene, assignment: &str) -> Result<(), RunError> {
    let Some((key, columns, name, raw)) = column_of(assignment) else { return Ok(TABLE.set(scene, assignment)?) };
    let array = key.path;
    if let Some((table, _)) = name.split_once('.')
        && columns.iter().any(|column| column.name == table)
    {
        let reason = format!("found one column, expected all rows together: {array}.{table}=[{{ ... }}, ...]");
        let problem = Problem::Rejected { key: format!("{array}.{}", name.escape_debug()), reason };
        return Err(SceneError { place: Place::Set, problem }.into());
    }
    let Some(column) = columns.iter().find(|column| column.name == name) else {
        let nearest = format!("{array}.{}", nearest(name, columns.iter().map(|column| column.name)));
        let problem = Problem::UnknownKey { key: format!("{array}.{}", name.escape_debug()), nearest };
        return Err(SceneError { place: Place::Set, problem }.into());
    };
    let rows = match (key.get)(scene) {
        Some(Value::Rows(rows)) => rows,
        _ => Vec::new(),
    };
    let [row] = &rows[..] else {
        let reason = format!(
            "found {} rows of [[{array}]], expected exactly one; rows are set together: {array}=[{{ {name} = ..., ... }}, ...]",
            rows.len()
        );
        return Err(SceneError {
            place: Place::Set,
            problem: Problem::Rejected { key: format!("{array}.{name}"), reason },
        }
        .into());
    };
    let others = row.cells().iter().filter(|(other, _)| *other != name);
    let mut cells: Vec<String> = others.map(|(name, value)| format!("{name} = {value}")).collect();
    let is_word = matches!(column.kind, Kind::Text | Kind::Choice(_)) && !raw.starts_with(['"', '\'']);
    let value = if is_word { Value::Text(raw.to_owned()).to_string() } else { raw.to_owned() };
    cells.push(format!("{name} = {value}"));
    Ok(TABLE.set(scene, &format!("{array} = [{{ {} }}]", cells.join(", ")))?)
}

/// The array of tables that an assignment names, its columns, and the column and the value that it gives.
fn column_of(assignment: &str) -> Option<(&'static Key<Scene>, &'static [Column], &str, &str)> {
    let (path, raw) = assignment.split_once('=')?;
    TABLE.keys.iter().find_map(|key| {
        let name = path.trim().strip_prefix(key.path)?.strip_prefix('.')?;
        let Kind::Rows(columns) = key.kind else { return None };
        Some((key, columns, name, raw.trim()))
    })
}

/// Checks a scene and makes its mesh.
fn of_scene(scene: Scene) -> Result<Setup, RunError> {
    let label = scene.label.clone();
    let refuse = |reason: String| RunError::Inconsistent { source_name: label.clone(), reason };
    let count = scene.needles.len();
    if !(1..=MOST_NEEDLES).contains(&count) {
        return Err(refuse(format!("needle: found {count} needles, expected from 1 to {MOST_NEEDLES}")));
    }
    let by_row = |index: usize, reason: String| refuse(format!("needle (row {}): {reason}", index + 1));
    let rows = || scene.needles.iter().enumerate();
    let pace = scene.time.pace;
    let motion = |(k, row)| Motion::of(row).map(|motion| motion.at_pace(pace)).map_err(|e| by_row(k, e));
    let motions: Vec<Motion> = rows().map(motion).collect::<Result<_, _>>()?;
    let needles: Vec<NeedleSettings> =
        rows().map(|(k, row)| needle::settings(row).map_err(|e| by_row(k, e))).collect::<Result<_, _>>()?;
    let releases: Vec<Vec<f64>> =
        rows().map(|(k, row)| needle::release(row).map_err(|e| by_row(k, e))).collect::<Result<_, _>>()?;
    let end = scene.time.end.unwrap_or_else(|| motions.iter().map(Motion::end).fold(0.0, f64::max));
    if end < scene.time.dt {
        let dt = scene.time.dt;
        return Err(refuse(match scene.time.end {
            Some(_) => format!("time.end: found an end at {end} s, expected at least time.dt = {dt} s"),
            None => format!(
                "needle.motion: found a last row at {end} s, where the run ends, expected one at time.dt = {dt} s or \
                 later, or time.end"
            ),
        }));
    }
    for (k, (needle, motion)) in needles.iter().zip(&motions).enumerate() {
        aim::check_edges(needle, motion, end)
            .map_err(|reason| refuse(format!("needle.edge (row {}): {reason}", k + 1)))?;
    }
    let mut stages = Stages::default();
    let since = Instant::now();
    let mut geometry = Geometry::of(&scene)?;
    stages.lap(Stage::Mesh, since);
    let tissues = tissues(&scene, &geometry).map_err(refuse)?;
    for (region, tissue) in geometry.regions.iter_mut().zip(&tissues) {
        region.fixed = tissue.fixed;
    }
    let held = subspace(&scene, &geometry, &tissues).map_err(refuse)?;
    let fields = Fields::of(&scene, &geometry).map_err(refuse)?;
    for (k, (settings, motion)) in needles.iter().zip(&motions).enumerate() {
        aim::check(settings, motion, end, &geometry).map_err(|reason| by_row(k, reason))?;
        aim::check_withdrawal(settings, motion, end)
            .map_err(|reason| refuse(format!("needle.motion (row {}): {reason}", k + 1)))?;
    }
    let points = points(&scene, &geometry).map_err(refuse)?;
    let measured = measured(&scene, &points, &geometry.bounds, end)?;
    let held_regions = geometry.regions.iter().filter(|region| region.fixed);
    let fixed: Result<_, String> = held_regions.map(|region| geometry.surface(&region.name)).collect();
    let fixed = fixed.map_err(refuse)?;
    let doubts = plausible::doubts(&scene, &geometry, &tissues);
    Ok(Setup {
        scene,
        geometry,
        tissues,
        held,
        fields,
        needles,
        motions,
        releases,
        points,
        measured,
        fixed,
        end,
        stages,
        doubts,
    })
}

/// The markers of the shape and those of the scene.
fn points(scene: &Scene, geometry: &Geometry) -> Result<Vec<(String, [f64; 3])>, String> {
    let mut points = geometry.markers.clone();
    for (index, row) in scene.points.iter().enumerate() {
        let refuse = |reason: String| Err(format!("markers.point (row {}): {reason}", index + 1));
        let name = name_of(row);
        let at: [f64; 3] = row.value("at").map_or(Ok([0.0; 3]), |at| at.point())?;
        if name.is_empty() || name.contains(',') {
            return refuse(format!("name: found {name:?}, expected a word without commas"));
        }
        if points.iter().any(|(known, _)| known == name) {
            return refuse(format!("name: found {name} once more, expected one marker of each name"));
        }
        if geometry.mesh.locate(at).is_none() {
            return refuse(format!(
                "at: found {at:?}, expected a point of the body, which reaches {}",
                geometry.extent()
            ));
        }
        points.push((name.to_owned(), at));
    }
    Ok(points)
}

fn measured(
    scene: &Scene,
    points: &[(String, [f64; 3])],
    bounds: &[[f64; 3]; 2],
    end: f64,
) -> Result<Option<Measured>, RunError> {
    let Some(file) = &scene.marker_file else { return Ok(None) };
    let path = scene.folder.join(file);
    let refuse = |reason: String| RunError::Inconsistent { source_name: path.display().to_string(), reason };
    let bytes = std::fs::read(&path).map_err(|error| refuse(error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let read = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + read.iter().filter(|byte| **byte == b'\n').count();
        refuse(format!("line {line}: found a byte that is not UTF-8, expected text"))
    })?;
    let names: Vec<&str> = points.iter().map(|(name, _)| name.as_str()).collect();
    Measured::read(&text, &names, bounds, end).map(Some).map_err(refuse)
}

impl Scenario for Opened {
    fn name(&self) -> &str {
        &self.0.scene.name
    }

    fn dim(&self) -> usize {
        3
    }

    fn warnings(&self) -> Vec<String> {
        self.0.doubts.clone()
    }

    fn frames_every(&self) -> usize {
        usize::try_from(self.0.scene.output.frames).unwrap_or(0)
    }

    fn check_probes(&self, probes: &[Vec<f64>]) -> Result<(), RunError> {
        let inside =
            |at: &Vec<f64>| <[f64; 3]>::try_from(&at[..]).is_ok_and(|at| self.0.geometry.mesh.locate(at).is_some());
        match probes.iter().find(|at| !inside(at)) {
            Some(at) => {
                let body = format!("body, which reaches {}", self.0.geometry.extent());
                Err(RunError::Probe { at: at.clone(), body })
            }
            None => Ok(()),
        }
    }

    fn start(&self, threads: usize) -> Result<Box<dyn Simulation>, RunError> {
        Ok(Box::new(Run::start(Arc::clone(&self.0), threads)?))
    }

    fn resume(&self, saved: &Saved, threads: usize) -> Result<Box<dyn Simulation>, RunError> {
        let refuse = |reason| RunError::State { path: "state".to_owned(), reason };
        let saved: SavedRun = saved.decode(APP).map_err(refuse)?;
        let mut scene = Scene::default();
        TABLE.read("state", &saved.toml, &mut scene)?;
        check_same_scene(&TABLE, &scene, &self.0.scene).map_err(refuse)?;
        Ok(Box::new(Run::resume(Arc::clone(&self.0), saved, threads)?))
    }

    fn unreached(&self) -> String {
        let solver = &self.0.scene.solver;
        format!("solver.tolerance = {:e} within solver.max_iterations = {}", solver.tolerance, solver.max_iterations)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_an_only_row_are_set() {
        let scene = |assignments: &[&str]| {
            let built_in = SCENES.iter().find(|scene| scene.name == "prostate-flexible").unwrap();
            let mut scene = Scene::default();
            TABLE.read(built_in.name, built_in.toml, &mut scene).unwrap();
            let all: Result<(), RunError> = assignments.iter().try_for_each(|one| set(&mut scene, one));
            all.map(|()| scene).map_err(|error| error.to_string())
        };
        let (before, after) = (scene(&[]).unwrap(), scene(&["needle.bevel = 0.1", "needle.edge=0.004"]).unwrap());
        let (row, was) = (&after.needles[0], &before.needles[0]);
        assert_eq!((row.get("bevel"), row.get("edge")), (Some(0.1), Some(0.004)));
        for name in ["base", "direction", "release", "motion"] {
            assert_eq!(row.value(name), was.value(name), "{name}");
        }
        let refusal = |assignment: &str| scene(&[assignment]).unwrap_err();
        assert_eq!(
            refusal("needle.bevel=1.2"),
            "--set: needle.bevel (row 1): found 1.2, expected a number > -1.2 and < 1.2"
        );
        assert_eq!(refusal("needle.bevl=1"), "--set: needle.bevl: unknown key; nearest known key is needle.bevel");
        assert_eq!(
            refusal("friction.membrane.thickness=1e-3"),
            "--set: friction.membrane.thickness: found 2 rows of [[friction.membrane]], expected exactly one; \
             rows are set together: friction.membrane=[{ thickness = ..., ... }, ...]"
        );
        // Words need no quotes.
        let region = ["region=[{ name = \"prostate\" }]", "region.model=corotated"];
        assert_eq!(scene(&region).unwrap().regions[0].value("model"), Some(&Value::Text("corotated".into())));
    }

    #[test]
    fn built_in_scenes_survive_writing() {
        for built_in in SCENES {
            assert!(built_in.toml.lines().count() <= 60, "{}", built_in.name);
            let mut scene = Scene::default();
            TABLE.read(built_in.name, built_in.toml, &mut scene).unwrap();
            let mut again = Scene::default();
            TABLE.read("written", &TABLE.write(&scene), &mut again).unwrap();
            assert_eq!(scene, again);
        }
    }
}
