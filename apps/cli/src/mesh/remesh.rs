//! `stylet mesh remesh`.

use super::args::RemeshArgs;
use super::path::TipPath;
use super::source::{AnyMesh, Loaded, Start};
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, count, print_json, seconds};
use crate::interrupt;
use crate::progress::{Meter, Place};
use serde_json::json;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use stylet_mesh::geometry::distance2;
use stylet_mesh::remesh::{CycleReport, CycleSettings, CycleStep, Motion, Operations, RemeshError, Remesher, drive};
use stylet_mesh::{Rule, SimplexMesh};

/// Part of the mean edge that is a step unless told otherwise.
const STEP: f64 = 0.2;
/// A tip that has just passed the skin cannot but make flat cells: steps up to this depth do not count.
const SHALLOW: usize = 20;
/// More steps than this are a typing error.
const MOST_STEPS: f64 = 1e6;

/// Drives a needle into a mesh and out again.
///
/// # Errors
/// Bad input; a step for which there is no operation.
pub fn execute(args: &RemeshArgs) -> Result<Exit, Failure> {
    let refuse = |what: &str| {
        let line = format!("--mesh: found {what}, expected triangles in 2 or tetrahedra in 3 dimensions");
        Err(Failure::bad_input(line))
    };
    match AnyMesh::open("--mesh", &args.mesh, Rule::default())? {
        AnyMesh::Plane(mesh) => run(args, mesh),
        AnyMesh::Solid(mesh) => run(args, mesh),
        AnyMesh::Surface(mesh) => refuse(&format!("{}, a surface in space", mesh.name)),
        AnyMesh::Hyper(mesh) => refuse(&mesh.name),
    }
}

/// The mesh with the needle at its deepest, for the picture.
struct Deepest<const D: usize, const N: usize> {
    mesh: SimplexMesh<D, N>,
    needle: Vec<[f64; D]>,
}

fn run<const D: usize, const N: usize>(args: &RemeshArgs, loaded: Loaded<D, N>) -> Result<Exit, Failure> {
    files::check_plot::<D>(args.plot.as_deref())?;
    let table = args.out.as_deref().map(table_path).transpose()?;
    let path = TipPath::<D>::open(&args.path, args.seed)?;
    let Start { mut mesh, left_out: notes, .. } = loaded.mesh()?;
    let (bounds, edge) = (bounds(&mesh), mean_edge(&mesh));
    let step = args.step.unwrap_or(STEP * edge);
    let settings = CycleSettings { step, measure_angles: true, shallow_steps: SHALLOW + 1 };

    let stop = interrupt::flag();
    let mut meter = Meter::start("remesh", Some(0.0), args.output.quiet);
    let mut total = Total::default();
    let mut rows = String::from("cycle,step,motion,depth,min_angle_deg,max_angle_deg,operations,microseconds\n");
    let mut deepest = None;
    for cycle in 0..args.cycles {
        let points = path.points(cycle, bounds, edge);
        let n_steps = length(&points) / step;
        // A length that overflows is that of points farther away than a tip may be, which is refused below.
        if n_steps > MOST_STEPS && n_steps.is_finite() {
            meter.end();
            let least = n_steps / MOST_STEPS * step;
            let line = format!("--step: found {step:?}, expected at least {least:.3e} for a path this long");
            return Err(Failure::bad_input(line));
        }
        let draw = cycle == 0 && args.plot.is_some();
        let mut remesher = Remesher::new();
        let outcome = drive(&mut mesh, &mut remesher, &points, &settings, |step, mesh, remesher, needle, _| {
            if table.is_some() {
                row(&mut rows, cycle, step);
            }
            // Only near the end of the path, lest the mesh be copied at every step.
            if draw && step.motion == Motion::Penetrating && step.depth as f64 + 2.0 >= n_steps {
                let nodes = remesher.nodes(needle).map(|v| mesh.point(v));
                let needle = points.first().copied().into_iter().chain(nodes).collect();
                deepest = Some(Deepest { mesh: mesh.clone(), needle });
            }
            meter.tick(|| {
                let way = if step.motion == Motion::Penetrating { "in" } else { "out" };
                let text = format!("cycle {} of {}, step {}, {way}", cycle + 1, args.cycles, step.step + 1);
                let within = (step.step as f64 / (2.0 * n_steps).max(1.0)).min(1.0);
                Place { share: Some((f64::from(cycle) + within) / f64::from(args.cycles)), text, is_last: false }
            });
        });
        match outcome {
            Ok(report) => total.add(&report),
            Err(error) => {
                meter.end();
                return Err(refuse(&error, args, cycle));
            }
        }
        if interrupt::is_set(&stop) {
            break;
        }
    }
    meter.end();

    if let Some(table) = &table {
        write_table(table, &rows)?;
    }
    if let (Some(plot), Some(deepest)) = (&args.plot, &deepest) {
        let nodes = count(deepest.needle.len() - 1, "node", "nodes");
        let cells = if N == 3 { "triangles" } else { "tetrahedra" };
        let title = format!("{}, needle of {nodes}: {} {cells}", args.mesh, deepest.mesh.n_cells());
        picture::draw_needle(&deepest.mesh, &deepest.needle, &title, plot)?;
    }
    let interrupted = interrupt::is_set(&stop) && total.cycles < args.cycles;
    if args.output.json {
        print_json(&json!({
            "schema": 1, "mesh": args.mesh, "dimension": D, "cells": mesh.n_cells(), "vertices": mesh.n_vertices(),
            "path": args.path, "seed": args.seed, "mean_edge": edge, "step": step, "cycles": total.cycles,
            "steps": total.steps, "substeps": total.substeps,
            "operations": total.operations(), "most_nodes": total.most_nodes,
            "min_angle_deg": total.angles.map(|a| a[0]), "max_angle_deg": total.angles.map(|a| a[1]),
            "angles_beyond_step": SHALLOW, "topology_restored": total.restored == total.cycles,
            "cycles_restored": total.restored, "max_position_error": total.position_error,
            "seconds": total.seconds, "microseconds_per_step": total.microseconds(),
            "interrupted": interrupted, "notes": notes,
        }))?;
    } else {
        let mut facts = Facts::new(&format!("{} along {}, steps of {step:.4e}", args.mesh, args.path));
        total.tell(&mut facts, &mesh);
        notes.iter().for_each(|note| facts.add("left out", note));
        for path in [&table, &args.plot].into_iter().flatten() {
            facts.add("wrote", path.display());
        }
        facts.print()?;
    }
    if interrupted {
        let line = format!("mesh remesh: stopped by Ctrl-C after {} of {} cycles", total.cycles, args.cycles);
        return Err(Failure { line, exit: Exit::Interrupted });
    }
    Ok(Exit::Done)
}

/// What all cycles did.
#[derive(Default)]
struct Total {
    cycles: u32,
    steps: usize,
    substeps: usize,
    operations: Operations,
    most_nodes: usize,
    /// Smallest and largest; `None` if no step was deep enough.
    angles: Option<[f64; 2]>,
    restored: u32,
    position_error: f64,
    seconds: f64,
}

impl Total {
    fn add(&mut self, report: &CycleReport) {
        self.cycles += 1;
        self.steps += report.steps;
        self.substeps += report.substeps;
        self.operations.add(&report.operations);
        self.most_nodes = self.most_nodes.max(report.most_nodes);
        if report.min_angle_deg <= report.max_angle_deg {
            let [min, max] = self.angles.unwrap_or([180.0, 0.0]);
            self.angles = Some([report.min_angle_deg.min(min), report.max_angle_deg.max(max)]);
        }
        self.restored += u32::from(report.topology_restored);
        self.position_error = self.position_error.max(report.max_position_error);
        self.seconds += report.seconds;
    }

    fn microseconds(&self) -> f64 {
        1e6 * self.seconds / self.steps.max(1) as f64
    }

    fn operations(&self) -> serde_json::Value {
        let [snaps, edges, faces, cells, ..] = self.operations.on_faces;
        json!({
            "snaps": snaps, "edge_splits": edges, "face_splits": faces, "cell_splits": cells,
            "undone": self.operations.undone,
        })
    }

    fn tell<const D: usize, const N: usize>(&self, facts: &mut Facts, mesh: &SimplexMesh<D, N>) {
        let cells = if N == 3 { "triangles" } else { "tetrahedra" };
        facts.add("cells", format!("{} {cells}, {} vertices", mesh.n_cells(), mesh.n_vertices()));
        let steps = count(self.steps, "step", "steps");
        facts.add("path", format!("{}, {steps}", count(self.cycles as usize, "cycle in and out", "cycles in and out")));
        let [snaps, edges, faces, splits, ..] = self.operations.on_faces;
        let undone = self.operations.undone;
        let snaps = count(snaps as usize, "snap", "snaps");
        let of = [(edges, "edge", "edges"), (faces, "face", "faces"), (splits, "cell", "cells")];
        // The faces of triangles are these themselves.
        let names = if N == 3 { [0, 2, 2] } else { [0, 1, 2] };
        let split = (0..N - 1).map(|k| count(of[k].0 as usize, of[names[k]].1, of[names[k]].2));
        let split = split.collect::<Vec<_>>().join(", ");
        facts.add("operations", format!("{snaps}; splits of {split}; {undone} splits undone"));
        match self.most_nodes {
            0 => facts.add("needle", "never in the mesh"),
            n => facts.add("needle", format!("at most {}", count(n, "node", "nodes"))),
        }
        let kind = if N > 3 { "dihedral, " } else { "" };
        match self.angles {
            Some([min, max]) => facts.add("angles", format!("{kind}{min:.3} to {max:.3} degrees after step {SHALLOW}")),
            None => facts.add("angles", format!("none told: the path has no step beyond {SHALLOW}")),
        }
        let back = if self.restored == self.cycles { "topology back" } else { "topology NOT back" };
        let of = format!("in {} of {}", self.restored, count(self.cycles as usize, "cycle", "cycles"));
        facts.add("restored", format!("{back} {of}, positions to {:e}", self.position_error));
        facts.add("time", format!("{} a step, without measuring angles", seconds(1e-6 * self.microseconds())));
    }
}

fn refuse(error: &RemeshError, args: &RemeshArgs, cycle: u32) -> Failure {
    let exit = match error {
        RemeshError::NoCandidate { .. } => Exit::NotConverged,
        _ => Exit::BadInput,
    };
    Failure { line: format!("--path: found {}, in cycle {}: {error}", args.path, cycle + 1), exit }
}

/// The file for the table: as given, or in the folder given.
fn table_path(out: &Path) -> Result<PathBuf, Failure> {
    let extension = out.extension().map(|extension| extension.to_ascii_lowercase());
    match extension {
        Some(extension) if extension == "csv" => Ok(out.to_owned()),
        Some(_) if !out.is_dir() => {
            let found = out.display();
            Err(Failure::bad_input(format!("--out: found {found}, expected a folder or a name that ends with .csv")))
        }
        _ if out.as_os_str().is_empty() => {
            Err(Failure::bad_input("--out: found nothing, expected a folder or a name that ends with .csv"))
        }
        _ => Ok(out.join("steps.csv")),
    }
}

fn write_table(path: &Path, rows: &str) -> Result<(), Failure> {
    let refuse = |error: std::io::Error| Failure::bad_input(format!("{}: {error}", path.display()));
    if let Some(folder) = path.parent().filter(|_| path.ends_with("steps.csv")) {
        std::fs::create_dir_all(folder).map_err(refuse)?;
    }
    std::fs::write(path, rows).map_err(refuse)
}

fn row(rows: &mut String, cycle: u32, step: &CycleStep) {
    let Operations { on_faces, undone } = step.report.operations;
    let operations = on_faces.iter().sum::<u32>() + undone;
    let way = if step.motion == Motion::Penetrating { "in" } else { "out" };
    let CycleStep { step, depth, min_angle_deg, max_angle_deg, seconds, .. } = step;
    // A String takes everything.
    let _ = writeln!(
        rows,
        "{cycle},{step},{way},{depth},{min_angle_deg:.6},{max_angle_deg:.6},{operations},{:.3}",
        1e6 * seconds
    );
}

fn length<const D: usize>(points: &[[f64; D]]) -> f64 {
    points.windows(2).map(|ab| distance2(&ab[0], &ab[1]).sqrt()).sum()
}

/// The box around the live cells.
fn bounds<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> [[f64; D]; 2] {
    let mut bounds = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    for p in mesh.vertices().map(|v| mesh.point(v)) {
        for k in 0..D {
            bounds[0][k] = bounds[0][k].min(p[k]);
            bounds[1][k] = bounds[1][k].max(p[k]);
        }
    }
    bounds
}

/// The mean length of the edges.
fn mean_edge<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> f64 {
    let mut edges = Vec::with_capacity(mesh.n_cells() * N * (N - 1) / 2);
    for v in mesh.cells().map(|c| mesh.cell(c)) {
        for i in 1..N {
            edges.extend((0..i).map(|j| (v[i].min(v[j]), v[i].max(v[j]))));
        }
    }
    edges.sort_unstable();
    edges.dedup();
    let sum: f64 = edges.iter().map(|&(a, b)| distance2(&mesh.point(a), &mesh.point(b)).sqrt()).sum();
    sum / edges.len().max(1) as f64
}
