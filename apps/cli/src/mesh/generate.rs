//! `stylet mesh generate`.

use super::args::{ColourArg, GenerateArgs};
use super::quality::short;
use super::source::Soup;
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, count, print_json, seconds};
use crate::progress::{Meter, Place};
use crate::{interrupt, output};
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::path::Path;
use stylet_anatomy::plan::{BUILT_IN, ContourPlan, Effort, Made, MadeRegion, Plan, PlanError, Stage, bounds, built_in};
use stylet_anatomy::shapes::{ShapeScene, TABLE};
use stylet_mesh::generate::contours::{ContourSet, ContourSettings};
use stylet_mesh::generate::improve::{Angles, ImproveSettings};
use stylet_mesh::generate::stuff::Step;
use stylet_mesh::io::{CellBlock, Format, MeshData};
use stylet_mesh::quality::{Measure, QualityReport, normalized_volume, report_of};

/// Parts of the extent of the organs that the lattice's cubes are, unless told otherwise.
const PARTS: f64 = 16.0;
/// Repairs of contours that are listed for people; JSON has them all.
const MOST_LINES: usize = 8;

/// Makes a mesh from shapes or contours.
///
/// # Errors
/// Bad input, files that cannot be written, Ctrl-C.
pub fn execute(args: &GenerateArgs) -> Result<Exit, Failure> {
    if let Some(name) = &args.show {
        return output::print(text_of(name)?).map(|()| Exit::Done);
    }
    if args.schema {
        return output::print(&TABLE.schema()).map(|()| Exit::Done);
    }
    files::check_out::<3>("--out", args.out.as_deref())?;
    files::check_plot::<3>(args.plot.as_deref())?;
    let Source { name, mut plan, notes } = open(args)?;
    if let Some(fixed) = &args.fixed {
        let names: Vec<&str> = fixed.split(',').map(str::trim).collect();
        plan.fix(&names).map_err(|error| Failure::bad_input(format!("--fixed: {error}")))?;
    }
    let effort = Effort { improve: (!args.straight).then(|| improvement(args)) };

    let stop = interrupt::flag();
    let mut meter = Meter::start(&name, None, args.output.quiet);
    let made = plan.mesh(&effort, &mut |stage| {
        meter.tick(|| Place { share: None, text: words(&stage, &plan), is_last: stage == Stage::Measuring });
        if interrupt::is_set(&stop) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    meter.end();
    if interrupt::is_set(&stop) {
        return Err(Failure { line: "stopped; nothing was written".into(), exit: Exit::Interrupted });
    }
    let made = made.map_err(|error| refuse(&name, &error))?;
    Report { args, name, plan: &plan, notes, made }.write()
}

/// What is to be meshed.
struct Source {
    name: String,
    plan: Plan,
    /// What was left out or repaired, a line for each.
    notes: Vec<String>,
}

fn open(args: &GenerateArgs) -> Result<Source, Failure> {
    let source = match (&args.shape, &args.contours) {
        (Some(shape), _) => {
            Source { name: stem(Path::new(shape)), plan: Plan::of_shapes(&scene(shape)?), notes: vec![] }
        }
        (None, Some(path)) => return contours(args, path),
        (None, None) => return Err(Failure::bad_input("found neither --shape nor --contours, expected one of them")),
    };
    let mut plan = match args.size {
        Some(size) => source.plan.with_size(size),
        None => source.plan,
    };
    plan.settings.coarsest = args.coarsest.unwrap_or(plan.settings.coarsest);
    Ok(Source { plan, ..source })
}

/// A scene of shapes: one that comes with the program, or a file.
fn scene(shape: &str) -> Result<ShapeScene, Failure> {
    let bad = |error: stylet_scene::SceneError| Failure::bad_input(error.to_string());
    if let Some(scene) = built_in(shape) {
        return scene.map_err(bad);
    }
    let path = Path::new(shape);
    if path.extension().is_none() && !path.exists() {
        return Err(unknown("--shape", shape));
    }
    ShapeScene::read(path).map_err(bad)
}

fn text_of(name: &str) -> Result<&'static str, Failure> {
    BUILT_IN.iter().find(|(known, ..)| *known == name).map(|(.., text)| *text).ok_or_else(|| unknown("--show", name))
}

fn unknown(argument: &str, name: &str) -> Failure {
    let names: Vec<&str> = BUILT_IN.iter().map(|(name, ..)| *name).collect();
    let near = stylet_scene::nearest(name, names.iter().copied());
    let names = names.join(", ");
    Failure::bad_input(format!("{argument}: found {name}, expected a file or one of {names}; nearest is {near}"))
}

fn contours(args: &GenerateArgs, path: &Path) -> Result<Source, Failure> {
    let mut study = stylet_anatomy::read(path).map_err(|error| Failure::bad_input(error.to_string()))?;
    if let Some(names) = &args.organs {
        let names: Vec<&str> = names.split(',').map(str::trim).collect();
        study = study.select(&names).map_err(|error| Failure::bad_input(format!("--organs: {error}")))?;
    }
    let settings = ContourSettings { cull: args.cull.unwrap_or(0.0), ..ContourSettings::default() };
    let refused = |error: &dyn std::fmt::Display| Failure::bad_input(format!("{}: {error}", path.display()));
    let (set, repairs) = study.check(&settings).map_err(|error| refused(&error))?;
    let size = args.size.unwrap_or_else(|| extent(&set) / PARTS);
    let how = ContourPlan {
        size,
        coarsest: args.coarsest.unwrap_or(4.0 * size),
        margin: args.margin.unwrap_or(2.0 * size),
        background: !args.bare,
    };
    let plan = Plan::of_contours(&set, &how).map_err(|error| refused(&error))?;
    let notes = study.notes.iter().cloned().chain(repairs.iter().map(ToString::to_string)).collect();
    Ok(Source { name: stem(path), plan, notes })
}

/// The longest side of the box around all organs, m.
fn extent(set: &ContourSet) -> f64 {
    bounds(&set.strata()).map_or(0.0, |[low, high]| (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max))
}

fn stem(path: &Path) -> String {
    path.file_stem().map_or_else(|| path.display().to_string(), |stem| stem.to_string_lossy().into_owned())
}

fn improvement(args: &GenerateArgs) -> ImproveSettings {
    let standard = ImproveSettings::default();
    ImproveSettings { sweeps: args.sweeps.unwrap_or(standard.sweeps), ..standard }
}

fn refuse(name: &str, error: &PlanError) -> Failure {
    Failure::bad_input(format!("{name}: {error}"))
}

fn words(stage: &Stage, plan: &Plan) -> String {
    match stage {
        Stage::Stuffing(Step::Cubes { level }) => format!("cubes of level {level}"),
        Stage::Stuffing(Step::Lattice { cubes }) => format!("a lattice in {cubes} cubes"),
        Stage::Stuffing(Step::Border { solid }) => format!("the border of {}", plan.name(*solid)),
        Stage::Stuffing(_) => "regions".into(),
        Stage::Improving(sweep) => {
            format!("sweep {}: {} moved, {} replaced", sweep.number, sweep.moved, sweep.replaced)
        }
        Stage::Measuring => "volumes".into(),
    }
}

/// A mesh, on its way to files and to the reader.
struct Report<'a> {
    args: &'a GenerateArgs,
    name: String,
    plan: &'a Plan,
    notes: Vec<String>,
    made: Made,
}

impl Report<'_> {
    fn write(mut self) -> Result<Exit, Failure> {
        let tets = &self.made.tets;
        let corners = |cell: &[u32; 4]| cell.map(|v| tets.points[v as usize]);
        let quality = report_of(tets.cells.iter().enumerate().map(|(k, cell)| (k as u32, corners(cell))));
        // What comes out is a mesh that everything else takes, or it is refused here.
        let mesh = tets.clone().into_mesh().map_err(|error| Failure::bad_input(format!("{}: {error}", self.name)))?;
        let markers: Vec<Value> = self
            .plan
            .markers
            .iter()
            .map(|marker| {
                let cell = mesh.locate(marker.at).map(|found| found.cell.0);
                json!({ "name": marker.name, "at": marker.at, "cell": cell })
            })
            .collect();
        if let Some(path) = &self.args.out {
            let left_out = files::write_data(&self.data(), path, files::format_of("--out", path, None)?)?;
            self.notes.extend(left_out);
        }
        if let (Some(path), Some(out)) = (&self.args.scene, &self.args.out) {
            let gmsh = [Format::Msh22, Format::Msh22Binary, Format::Msh41, Format::Msh41Binary];
            let has_names = gmsh.contains(&files::format_of("--out", out, None)?);
            let text = self.plan.run_scene(&beside(out, path), has_names);
            std::fs::write(path, text).map_err(|e| Failure::bad_input(format!("{}: {e}", path.display())))?;
        }
        if let Some(path) = &self.args.plot {
            self.draw(&quality, path)?;
        }
        if self.args.output.json {
            self.print_json(&quality, &markers)?
        } else {
            self.print(&quality)?
        }
        Ok(Exit::Done)
    }

    /// The mesh as files hold it.
    fn data(&self) -> MeshData {
        let Made { tets, .. } = &self.made;
        let vertices = tets.cells.iter().flatten().copied().collect();
        let regions = tets.regions.iter().map(|&region| region as i32).collect();
        MeshData {
            dimension: 3,
            points: tets.points.clone(),
            blocks: vec![CellBlock { vertices_per_cell: 4, vertices, regions }],
            region_names: self.made.region_names(),
            ..MeshData::default()
        }
    }

    fn draw(&self, quality: &QualityReport, path: &Path) -> Result<(), Failure> {
        let Made { tets, .. } = &self.made;
        let soup = Soup {
            points: tets.points.clone(),
            cells: tets.cells.clone(),
            regions: tets.regions.iter().map(|&region| region as i32).collect(),
        };
        let values: Vec<f64> =
            tets.cells.iter().map(|cell| normalized_volume(&cell.map(|v| tets.points[v as usize]))).collect();
        let look = picture::Look {
            by_region: self.args.colour == ColourArg::Region,
            names: self.made.regions.iter().map(|region| region.name.clone()).collect(),
            cut: Some(self.args.cut.normal()),
        };
        picture::draw_quality(&soup, &values, look, quality, &self.name, path)
    }

    fn print_json(&self, quality: &QualityReport, markers: &[Value]) -> Result<(), Failure> {
        let Made { tets, stuffed, straight, improved, .. } = &self.made;
        let [stuffing, improving] = self.made.seconds;
        let angles = |angles: &Angles| {
            json!({
                "min_angle_deg": angles.min_deg, "max_angle_deg": angles.max_deg,
                "min_quality": angles.min_quality, "mean_quality": angles.mean_quality,
            })
        };
        let region = |region: &MadeRegion| {
            json!({
                "name": region.name, "conforming": region.conforming, "cells": region.cells, "volume": region.volume,
                "source_volume": region.source_volume,
                "relative_difference": region.volume / region.source_volume - 1.0,
            })
        };
        let improvement = improved.as_ref().map(|report| {
            json!({
                "sweeps": report.sweeps, "moved": report.moved, "replaced": report.replaced, "astray": report.astray,
                "after": angles(&report.after),
            })
        });
        print_json(&json!({
            "schema": 1, "mesh": self.name, "cells": tets.cells.len(), "vertices": tets.points.len(),
            "domain": self.plan.domain, "size": self.plan.settings.size, "cube": stuffed.cube,
            "regions": self.made.regions.iter().map(region).collect::<Vec<_>>(),
            "border_error": self.made.border_error(), "straight": angles(straight), "improved": improvement,
            "quality": quality, "markers": markers,
            "seconds": { "stuffing": stuffing, "improving": improving },
            "warnings": self.made.warnings(), "notes": self.notes,
        }))
    }

    fn print(&self, quality: &QualityReport) -> Result<(), Failure> {
        let Made { tets, straight, improved, .. } = &self.made;
        let [stuffing, improving] = self.made.seconds;
        let mut facts = Facts::new(&self.name);
        facts.add("cells", format!("{} tetrahedra", tets.cells.len()));
        facts.add("vertices", tets.points.len());
        facts.add("stuffed", format!("{}, {}", seconds(stuffing), shapes(straight)));
        if let Some(report) = improved {
            let work = count(report.sweeps, "sweep", "sweeps");
            facts.add("improved", format!("{}, {work}, {}", seconds(improving), shapes(&report.after)));
        }
        facts.add("border", format!("vertices within {} m of their surface", short(self.made.border_error())));
        for measure in [Measure::Aspect, Measure::RadiusEdge].into_iter().filter_map(|m| quality.measure(m)) {
            let beyond: Vec<String> =
                measure.beyond.iter().map(|beyond| format!("{} beyond {}", beyond.count, beyond.limit)).collect();
            facts.add(measure.measure.name(4), format!("up to {}; {}", short(measure.max), beyond.join(", ")));
        }
        facts.line("");
        facts.line(&format!(
            "  {:<24}{:>8}{:>13}{:>13}{:>10}",
            "region", "cells", "volume, m^3", "source, m^3", "apart"
        ));
        for region in &self.made.regions {
            let apart = 100.0 * (region.volume / region.source_volume - 1.0);
            let by = if region.conforming { "" } else { "  by element" };
            facts.line(&format!(
                "  {:<24}{:>8}{:>13.4e}{:>13.4e}{:>8.2} %{by}",
                region.name, region.cells, region.volume, region.source_volume, apart
            ));
        }
        facts.line("");
        self.made.warnings().iter().for_each(|warning| facts.add("warning", warning));
        self.notes.iter().take(MOST_LINES).for_each(|note| facts.add("note", note));
        if self.notes.len() > MOST_LINES {
            facts.add("note", format!("and {} more; --json has all", self.notes.len() - MOST_LINES));
        }
        for path in [&self.args.out, &self.args.scene, &self.args.plot].into_iter().flatten() {
            facts.add("wrote", path.display());
        }
        facts.print()
    }
}

/// `20.5 to 142.1 degrees, q 0.41 to 1, mean 0.82`
fn shapes(angles: &Angles) -> String {
    let Angles { min_deg, max_deg, min_quality, mean_quality } = angles;
    format!("{min_deg:.2} to {max_deg:.2} degrees, q at least {min_quality:.3}, mean {mean_quality:.3}")
}

/// The path of a file as a scene names it: relative to the scene's folder where both lie in one, absolute otherwise.
fn beside(file: &Path, scene: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned());
    match (file.parent() == scene.parent(), name(file)) {
        (true, Some(name)) => name,
        _ => std::path::absolute(file).unwrap_or_else(|_| file.into()).display().to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_name_meshes_beside_them() {
        assert_eq!(beside(Path::new("a/b.msh"), Path::new("a/c.toml")), "b.msh");
        assert_eq!(beside(Path::new("b.msh"), Path::new("c.toml")), "b.msh");
        assert!(Path::new(&beside(Path::new("b.msh"), Path::new("a/c.toml"))).is_absolute());
    }
}
