//! `stylet mesh coarsen`.

use super::args::CoarsenArgs;
use super::feature::Feature;
use super::refine::{Plan, merge};
use super::source::{AnyMesh, Job, Loaded, Start};
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, print_json, seconds};
use crate::interrupt;
use crate::progress::{Meter, Place};
use serde_json::{Value, json};
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use stylet_mesh::{CellId, MeshChange, SimplexMesh};

/// Refines a start mesh, coarsens it again, and compares.
///
/// # Errors
/// Bad input; a size or a number of rounds that the mesh cannot reach; Ctrl-C.
pub fn execute(args: &CoarsenArgs) -> Result<Exit, Failure> {
    AnyMesh::open("--start", &args.feature.start, args.feature.rule.rule())?.give(Coarsen(args))
}

struct Coarsen<'a>(&'a CoarsenArgs);

impl Job for Coarsen<'_> {
    fn run<const D: usize, const N: usize>(self, loaded: Loaded<D, N>) -> Result<Exit, Failure> {
        let args = self.0;
        files::check_out::<D>("--out", args.out.as_deref())?;
        files::check_plot::<D>(args.plot.as_deref())?;
        let plan = Plan::<D>::parse(&args.feature)?;
        let kept = Kept::parse(args, plan.size())?;
        let Start { mut mesh, names, left_out: mut notes } = loaded.mesh()?;
        let start = mesh.clone();
        let stop = interrupt::flag();
        let mut work = plan.carry_out(&mut mesh, args.output.quiet, &stop)?;
        let (leaves_refined, vertices_refined) = (mesh.n_cells(), mesh.n_vertices());

        let mut removed = 0;
        let began = Instant::now();
        if !work.interrupted {
            removed = kept.coarsen(&mut mesh, args.output.quiet, &stop);
            work.interrupted = interrupt::is_set(&stop);
        }
        let seconds_coarsen = began.elapsed().as_secs_f64();
        let restored = Restored::of(&start, &mesh);
        if !work.interrupted {
            if let Some(path) = &args.out {
                notes.extend(files::write("--out", &mesh, &names, path)?);
            }
            if let Some(path) = &args.plot {
                picture::draw_refined(&mesh, &kept.feature, &format!("{}, coarsened", args.feature.start), path)?;
            }
        }
        if args.output.json {
            let mut report = plan.json(D);
            merge(
                &mut report,
                json!({
                    "leaves_start": start.n_cells(), "vertices_start": start.n_vertices(),
                    "leaves_refined": leaves_refined, "vertices_refined": vertices_refined,
                    "leaves": mesh.n_cells(), "vertices": mesh.n_vertices(), "vertices_removed": removed,
                    "seconds_refine": work.seconds, "seconds_coarsen": seconds_coarsen,
                    "keep": kept.size.map(|size| json!({ "points": kept.feature.json(), "size": size })),
                    "restored": (!work.interrupted).then(|| restored.json()),
                    "interrupted": work.interrupted, "notes": notes,
                }),
            );
            print_json(&report)?;
        } else {
            let mut facts = Facts::new(&format!("{}; {}", plan.title(), kept.title()));
            facts.add("start", format!("{} leaves, {} vertices", start.n_cells(), start.n_vertices()));
            let time = seconds(work.seconds);
            facts.add("refined", format!("{leaves_refined} leaves, {vertices_refined} vertices, in {time}"));
            let (leaves, vertices, time) = (mesh.n_cells(), mesh.n_vertices(), seconds(seconds_coarsen));
            facts.add("coarsened", format!("{leaves} leaves, {vertices} vertices, {removed} removed, in {time}"));
            let compared = restored.describe(kept.size.is_some());
            facts.add("start mesh", if work.interrupted { "not compared".to_owned() } else { compared });
            notes.iter().for_each(|note| facts.add("left out", note));
            for (what, path) in [("mesh", &args.out), ("picture", &args.plot)] {
                if let (Some(path), false) = (path, work.interrupted) {
                    facts.add("wrote", format!("{what} to {}", path.display()));
                }
            }
            facts.print()?;
        }
        work.exit("coarsen")
    }
}

/// What stays refined.
struct Kept<const D: usize> {
    feature: Feature<D>,
    /// Cells up to this size need not be bisected; `None` if nothing stays.
    size: Option<f64>,
}

impl<const D: usize> Kept<D> {
    fn parse(args: &CoarsenArgs, refined_to: Option<f64>) -> Result<Self, Failure> {
        let (point, segment) = (args.keep_point.as_deref(), args.keep_segment.as_deref());
        let feature = Feature::parse(["--keep-point", "--keep-segment"], point, segment, &args.feature.start)?;
        let asked = args.keep_size.is_some() || feature != Feature::Everywhere;
        let size = args.keep_size.or(refined_to).filter(|_| asked);
        if asked && size.is_none() {
            return Err(Failure::bad_input("--keep-size: found none, expected one, as there is no --size"));
        }
        Ok(Self { feature, size })
    }

    /// Coarsens all that need not stay, and returns the number of vertices removed. Once Ctrl-C is pressed, all that is
    /// left stays.
    fn coarsen<const N: usize>(&self, mesh: &mut SimplexMesh<D, N>, quiet: bool, stop: &AtomicBool) -> usize {
        let touched = self.size.and_then(|_| self.feature.touched(mesh));
        let touches = |cell: CellId| touched.as_ref().is_none_or(|touched| touched[cell.index()]);
        let mut meter = Meter::start("coarsen", None, quiet);
        let mut asked = 0_usize;
        let must_stay = |mesh: &SimplexMesh<D, N>, cell: CellId| {
            asked += 1;
            if asked.is_multiple_of(1 << 16) {
                let text = format!("{} leaves", mesh.n_cells());
                meter.tick(|| Place { share: None, text, is_last: false });
            }
            let is_kept = self.size.is_some_and(|size| touches(cell) && mesh.longest_edge(cell) > size);
            is_kept || interrupt::is_set(stop)
        };
        let removed = mesh.coarsen_unless(must_stay, &mut MeshChange::default());
        meter.end();
        removed
    }

    fn title(&self) -> String {
        match self.size {
            None => "coarsened".to_owned(),
            Some(size) => format!("coarsened but {} to {size:?}", self.feature.describe()),
        }
    }
}

/// What of the start mesh came back.
struct Restored {
    /// The same identifiers of cells and vertices.
    ids: bool,
    /// Each cell has the same vertices.
    vertex_sets: bool,
    /// The same bits in every coordinate.
    positions: bool,
}

impl Restored {
    fn of<const D: usize, const N: usize>(start: &SimplexMesh<D, N>, mesh: &SimplexMesh<D, N>) -> Self {
        let ids = start.cells().eq(mesh.cells()) && start.vertices().eq(mesh.vertices());
        let set = |mesh: &SimplexMesh<D, N>, cell| {
            let mut vertices = mesh.cell(cell);
            vertices.sort_unstable();
            vertices
        };
        let bits = |mesh: &SimplexMesh<D, N>, v| mesh.point(v).map(f64::to_bits);
        Self {
            ids,
            vertex_sets: ids && start.cells().all(|c| set(start, c) == set(mesh, c)),
            positions: ids && start.vertices().all(|v| bits(start, v) == bits(mesh, v)),
        }
    }

    fn json(&self) -> Value {
        json!({ "ids": self.ids, "vertex_sets": self.vertex_sets, "positions": self.positions })
    }

    fn describe(&self, is_kept: bool) -> String {
        let parts = [("ids", self.ids), ("vertex sets", self.vertex_sets), ("positions", self.positions)];
        let of = |wanted: bool| {
            let names: Vec<&str> = parts.iter().filter(|(_, is)| *is == wanted).map(|(name, _)| *name).collect();
            names.join(", ")
        };
        match (of(true), of(false)) {
            (back, other) if other.is_empty() => format!("back: same {back}"),
            _ if is_kept => "not back, as some of the refinement was kept".to_owned(),
            (_, other) => format!("NOT back: other {other}"),
        }
    }
}
