//! `stylet mesh refine`.

use super::args::{FeatureArgs, RefineArgs, RuleArg};
use super::feature::Feature;
use super::source::{AnyMesh, Job, Loaded, Start};
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, count, print_json, seconds};
use crate::interrupt;
use crate::progress::{Meter, Place};
use serde_json::{Value, json};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use stylet_mesh::quality::{self, Quality};
use stylet_mesh::{BisectError, CellId, MeshChange, SimplexMesh};

/// Slots that are made between two looks at the clock and at Ctrl-C: some tenths of a second.
const CHUNK: usize = 1 << 20;

/// Refines a start mesh, and prints what came out.
///
/// # Errors
/// Bad input; a size or a number of rounds that the mesh cannot reach; Ctrl-C.
pub fn execute(args: &RefineArgs) -> Result<Exit, Failure> {
    AnyMesh::open("--start", &args.feature.start, args.feature.rule.rule())?.give(Refine(args))
}

struct Refine<'a>(&'a RefineArgs);

impl Job for Refine<'_> {
    fn run<const D: usize, const N: usize>(self, loaded: Loaded<D, N>) -> Result<Exit, Failure> {
        let args = self.0;
        files::check_out::<D>("--out", args.out.as_deref())?;
        files::check_plot::<D>(args.plot.as_deref())?;
        let plan = Plan::<D>::parse(&args.feature)?;
        let Start { mut mesh, names, left_out } = loaded.mesh()?;
        let stop = interrupt::flag();
        let work = plan.carry_out(&mut mesh, args.output.quiet, &stop)?;

        let outcome = Outcome::of(&mesh, &work);
        let mut notes = left_out;
        if !work.interrupted {
            if let Some(path) = &args.out {
                notes.extend(files::write("--out", &mesh, &names, path)?);
            }
            if let Some(path) = &args.plot {
                picture::draw_refined(&mesh, &plan.feature, &plan.short_title(), path)?;
            }
        }
        if args.output.json {
            let mut report = plan.json(D);
            merge(&mut report, outcome.json());
            merge(&mut report, json!({ "interrupted": work.interrupted, "notes": notes }));
            print_json(&report)?;
        } else {
            let mut facts = Facts::new(&plan.title());
            outcome.tell::<N>(&mut facts);
            notes.iter().for_each(|note| facts.add("left out", note));
            for (what, path) in [("mesh", &args.out), ("picture", &args.plot)] {
                if let (Some(path), false) = (path, work.interrupted) {
                    facts.add("wrote", format!("{what} to {}", path.display()));
                }
            }
            facts.print()?;
        }
        work.exit("refine")
    }
}

/// What is to be refined.
pub struct Plan<'a, const D: usize> {
    args: &'a FeatureArgs,
    pub feature: Feature<D>,
    goal: Goal,
}

#[derive(Clone, Copy)]
enum Goal {
    Size(f64),
    Uniform(u32),
}

/// What was done.
#[derive(Default)]
pub struct Work {
    /// Cells bisected.
    pub bisections: u64,
    /// Bisections that were asked for.
    pub marks: u64,
    pub seconds: f64,
    pub interrupted: bool,
}

impl Work {
    /// The exit code.
    ///
    /// # Errors
    /// Ctrl-C.
    pub fn exit(&self, command: &str) -> Result<Exit, Failure> {
        if self.interrupted {
            let line = format!("mesh {command}: stopped by Ctrl-C; no files were written");
            return Err(Failure { line, exit: Exit::Interrupted });
        }
        Ok(Exit::Done)
    }
}

impl<'a, const D: usize> Plan<'a, D> {
    /// The plan that the arguments tell.
    ///
    /// # Errors
    /// A feature that is none in the dimension of the mesh.
    pub fn parse(args: &'a FeatureArgs) -> Result<Self, Failure> {
        let names = ["--point", "--segment"];
        let feature = Feature::parse(names, args.point.as_deref(), args.segment.as_deref(), &args.start)?;
        let goal = match (args.size, args.uniform) {
            (Some(size), _) => Goal::Size(size),
            (None, Some(rounds)) => Goal::Uniform(rounds),
            (None, None) => return Err(Failure::bad_input("--size: found none, expected one, or --uniform")),
        };
        Ok(Self { args, feature, goal })
    }

    /// Refines the mesh. Goes on in pieces, so that Ctrl-C is heard; a mesh that is refined in pieces is the same as one
    /// that is refined at once.
    ///
    /// # Errors
    /// What the mesh refuses.
    pub fn carry_out<const N: usize>(
        &self,
        mesh: &mut SimplexMesh<D, N>,
        quiet: bool,
        stop: &Arc<AtomicBool>,
    ) -> Result<Work, Failure> {
        let (mut work, before) = (Work::default(), mesh.work());
        let known = matches!(self.goal, Goal::Uniform(_)).then_some(0.0);
        let mut meter = Meter::start("refine", known, quiet);
        let outcome = match self.goal {
            Goal::Size(size) => self.to_size(mesh, size, &mut work, &mut meter, stop),
            Goal::Uniform(rounds) => uniformly(mesh, rounds, &mut work, &mut meter, stop),
        };
        meter.end();
        outcome.map_err(|error| self.refuse(&error))?;
        let after = mesh.work();
        (work.bisections, work.marks) = (after.bisections - before.bisections, after.marks - before.marks);
        Ok(work)
    }

    fn to_size<const N: usize>(
        &self,
        mesh: &mut SimplexMesh<D, N>,
        size: f64,
        work: &mut Work,
        meter: &mut Meter,
        stop: &AtomicBool,
    ) -> Result<(), BisectError> {
        let limit = mesh.slot_limit();
        let mut change = MeshChange::default();
        let mut room = CHUNK;
        loop {
            let before = mesh.n_slots();
            mesh.set_slot_limit(before.saturating_add(room).min(limit));
            change.clear();
            let began = Instant::now();
            let outcome = self.feature.refine(mesh, size, &mut change);
            work.seconds += began.elapsed().as_secs_f64();
            mesh.set_slot_limit(limit);
            match outcome {
                // Only the piece is full.
                Err(BisectError::SlotLimit { needed, .. }) if needed <= limit => {
                    room = if mesh.n_slots() == before { needed } else { CHUNK.max(mesh.n_slots() / 4) };
                }
                Err(BisectError::SlotLimit { needed, .. }) => return Err(BisectError::SlotLimit { needed, limit }),
                other => return other,
            }
            meter.tick(|| Place { share: None, text: format!("{} leaves", mesh.n_cells()), is_last: false });
            if interrupt::is_set(stop) {
                work.interrupted = true;
                return Ok(());
            }
        }
    }

    /// The size to refine to; `None` for uniform rounds.
    pub fn size(&self) -> Option<f64> {
        match self.goal {
            Goal::Size(size) => Some(size),
            Goal::Uniform(_) => None,
        }
    }

    fn refuse(&self, error: &BisectError) -> Failure {
        let argument = match self.goal {
            Goal::Size(size) => match error {
                BisectError::Point { .. } => self.feature.argument().to_owned(),
                _ => format!("--size: found {size:?}"),
            },
            Goal::Uniform(rounds) => format!("--uniform: found {rounds}"),
        };
        Failure::bad_input(format!("{argument}: {error}"))
    }

    /// What is done, in a line.
    pub fn title(&self) -> String {
        let goal = match self.goal {
            Goal::Size(size) => format!("{} to {size:?}", self.feature.describe()),
            Goal::Uniform(rounds) => count(rounds as usize, "uniform bisection", "uniform bisections"),
        };
        let rule = if self.args.rule == RuleArg::LongestEdge { String::new() } else { ", by colouring".to_owned() };
        format!("{}, {goal}{rule}", self.args.start)
    }

    /// The same for the head of a picture.
    pub fn short_title(&self) -> String {
        match self.goal {
            Goal::Size(size) => format!("{}, edges up to {size:?}", self.args.start),
            Goal::Uniform(_) => self.title(),
        }
    }

    /// What was asked for.
    pub fn json(&self, dimension: usize) -> Value {
        let (size, uniform) = match self.goal {
            Goal::Size(size) => (Some(size), None),
            Goal::Uniform(rounds) => (None, Some(rounds)),
        };
        let kind = match self.feature {
            _ if uniform.is_some() => "uniform",
            Feature::Point(_) => "point",
            Feature::Segment(..) => "segment",
            Feature::Everywhere => "everywhere",
        };
        json!({
            "schema": 1, "start": self.args.start, "dimension": dimension, "rule": self.args.rule.name(),
            "feature": { "kind": kind, "points": self.feature.json() }, "size": size, "uniform": uniform,
        })
    }
}

/// Bisects every leaf, as many times as there are rounds.
fn uniformly<const D: usize, const N: usize>(
    mesh: &mut SimplexMesh<D, N>,
    rounds: u32,
    work: &mut Work,
    meter: &mut Meter,
    stop: &AtomicBool,
) -> Result<(), BisectError> {
    // Each round at least doubles the leaves: refuse at once what cannot be had.
    let needed = (mesh.n_cells() as f64 * 2_f64.powi(rounds.min(1000) as i32 + 1)).min(usize::MAX as f64) as usize;
    if needed > mesh.slot_limit() {
        return Err(BisectError::SlotLimit { needed, limit: mesh.slot_limit() });
    }
    let mut change = MeshChange::default();
    for round in 0..rounds {
        let leaves: Vec<CellId> = mesh.cells().collect();
        for piece in leaves.chunks(CHUNK / 4) {
            change.clear();
            let began = Instant::now();
            let outcome = mesh.bisect(piece, &mut change);
            work.seconds += began.elapsed().as_secs_f64();
            outcome?;
            meter.tick(|| {
                let share = mesh.n_slots() as f64 / needed as f64;
                let text = format!("round {} of {rounds}, {} leaves", round + 1, mesh.n_cells());
                Place { share: Some(share.min(1.0)), text, is_last: false }
            });
            if interrupt::is_set(stop) {
                work.interrupted = true;
                return Ok(());
            }
        }
    }
    Ok(())
}

/// What the mesh is like afterwards.
pub struct Outcome {
    leaves: usize,
    vertices: usize,
    deepest: u16,
    shapes: usize,
    quality: Quality,
    bytes: usize,
    bisections: u64,
    marks: u64,
    seconds: f64,
}

impl Outcome {
    /// Looks at a mesh.
    pub fn of<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, work: &Work) -> Self {
        Self {
            leaves: mesh.n_cells(),
            vertices: mesh.n_vertices(),
            deepest: mesh.cells().map(|c| mesh.level(c)).max().unwrap_or(0),
            shapes: quality::shapes(mesh),
            quality: quality::summary(mesh),
            bytes: mesh.bytes(),
            bisections: work.bisections,
            marks: work.marks,
            seconds: work.seconds,
        }
    }

    /// As JSON.
    pub fn json(&self) -> Value {
        json!({
            "leaves": self.leaves, "vertices": self.vertices, "bisections": self.bisections, "marks": self.marks,
            "shapes": self.shapes, "min_angle_deg": self.quality.min_angle_deg,
            "max_angle_deg": self.quality.max_angle_deg, "min_quality": self.quality.min_quality,
            "max_level": self.deepest, "seconds": self.seconds, "bytes": self.bytes,
        })
    }

    /// In lines.
    pub fn tell<const N: usize>(&self, facts: &mut Facts) {
        facts.add("leaves", self.leaves);
        facts.add("vertices", self.vertices);
        let Self { bisections, marks, deepest, bytes, .. } = self;
        facts.add("bisections", format!("{bisections}, {marks} of them asked for, up to {deepest} below a start cell"));
        facts.add("shapes", self.shapes);
        let kind = if N > 3 { "dihedral angles" } else { "angles" };
        let Quality { min_angle_deg, max_angle_deg, min_quality } = self.quality;
        facts.add(
            "quality",
            format!("{kind} {min_angle_deg:.4} to {max_angle_deg:.4} degrees, q at least {min_quality:.4}"),
        );
        let rate = self.leaves as f64 / self.seconds.max(1e-9);
        facts.add("time", format!("{}, {:.2} million leaves/s", seconds(self.seconds), 1e-6 * rate));
        facts.add("memory", format!("{bytes} bytes, {:.1} per leaf", *bytes as f64 / self.leaves.max(1) as f64));
    }
}

/// Adds the keys of one object to another.
pub fn merge(object: &mut Value, more: Value) {
    if let (Value::Object(object), Value::Object(more)) = (object, more) {
        object.extend(more);
    }
}
