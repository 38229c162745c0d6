//! `stylet bench threads`: the stages of a frame by the number of threads (Table 2), and how far a frame is from its budget.

use super::page;
use super::setup::{Leg, Numerics, SPEED, Scene, published_scenes};
use crate::timing::median;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use std::time::Instant;
use stylet_physics::body::LazyRule;
use stylet_physics::insertion::{Insertion, InsertionTimes};
use stylet_physics::material::Solid;
use stylet_physics::numbering::mean_bandwidth;
use stylet_solver::team::Team;

/// Table 2 of the 2009 paper, ms: run, threads, then total, LCP, tissue, needle, remeshing.
const PUBLISHED: [(&str, usize, [f64; 5]); 11] = [
    ("prostate flexible", 1, [130.9, 108.8, 13.4, 1.3, 0.5]),
    ("prostate flexible", 2, [77.7, 62.3, 7.7, 1.6, 0.5]),
    ("prostate flexible", 3, [64.1, 51.1, 4.7, 1.4, 0.4]),
    ("prostate flexible", 4, [56.6, 44.8, 3.9, 1.4, 0.7]),
    ("prostate flexible", 5, [47.6, 36.7, 3.3, 1.8, 0.4]),
    ("prostate flexible", 6, [39.6, 28.8, 3.0, 1.4, 0.5]),
    ("prostate flexible", 7, [38.5, 28.3, 2.2, 1.4, 0.3]),
    ("prostate stiff", 7, [38.2, 28.7, 2.1, 1.1, 0.5]),
    ("two cylinders", 7, [24.0, 14.4, 1.9, 0.6, 0.9]),
    ("gel single bend", 7, [22.8, 13.2, 1.1, 0.4, 0.9]),
    ("gel double bend", 7, [33.0, 23.6, 1.1, 0.5, 0.5]),
];
/// Columns of a frame: the median, then means of the stages.
const COLUMNS: [&str; 5] = ["1_total_ms", "2_search_ms", "3_tissue_ms", "4_needle_ms", "5_remesh_ms"];
/// Most ms of a frame, median and 99th percentile, at frames of 20 ms, and the median at steps of 1 ms; on two threads.
const BUDGET: ([f64; 2], f64) = ([5.0, 10.0], 1.5);
/// What spares most without being seen, see `lazy`.
const LAZY: LazyRule = LazyRule::Strain(0.01);
const LAZY_CASE: &str = "prostate flexible, lazy";
const SHORT_CASE: &str = "prostate flexible, lazy, steps of 1 ms";
/// Method of a run whose rows are given to threads by METIS; by the numbers of their vertices without a word.
const METIS: &str = "METIS";
/// The same with shorter steps, and nearer to incompressible.
const SHORT: f64 = 1e-3;
const HARDER: f64 = 0.49;
/// Entries of a vector that is handed to the team and back, how often at a time, and after how many frames.
const HANDED: usize = 8192;
const HANDS: usize = 16;
const EVERY: usize = 16;
/// Seconds that are simulated with short steps.
const SHORT_RUN: f64 = 1.0;

const ABOUT: &str = "The runs of Table 2 of Chentanez et al. (2009): the needle in, held, and out again, 20 mm/s, friction states \
    checked at 1e-3 and solved to 1e-5; *lazy*: Jacobians by `LazyRule::Strain(0.01)`, else all of them; *as made*: vertices in \
    the order in which the mesh was made, else reverse Cuthill-McKee, as runs have it; *METIS*: rows given to threads by METIS, \
    else by the numbers of vertices. Of all frames: the median, then the means of the search for friction states with its linear \
    solves (their LCP), forces, Jacobian and matrix of the tissue, forces and matrix of the needle, remeshing with \
    reparameterisation, and the 99th percentile. Published numbers in rows are those for as many threads; all of them are below. \
    The bits of the end are compared between numbers of threads and ways of sharing. `handed_us` says how far apart the cores were \
    during the run: the time in which 64 kB, a vector of a solve in the prostate, go to the other threads and back. A virtual \
    machine may be moved between cores that share a cache (3 µs where this was written) and such that do not (6 µs), where a \
    second thread is worth little.";

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("threads", options.threads);
    let mut scenes = published_scenes(options.quick)?;
    let as_made = scenes[0].clone();
    for scene in &mut scenes {
        scene.tissue = scene.tissue.in_rcm_order();
    }
    let mut teams = vec![(1, "")];
    if options.threads > 1 {
        teams.push((options.threads, ""));
    }
    for scene in &scenes {
        compare(scene, scene.name.into(), &Numerics::default(), &teams, options, say, &mut report)?;
    }
    let flexible = &scenes[0];
    let most = &[(options.threads, "")];
    let harder = Numerics { poisson: Some(HARDER), ..Numerics::default() };
    compare(flexible, format!("{}, ν {HARDER}", flexible.name), &harder, most, options, say, &mut report)?;
    let lazy = Numerics { lazy: LAZY, ..Numerics::default() };
    let both = &[(options.threads, ""), (options.threads, METIS)];
    compare(flexible, LAZY_CASE.into(), &lazy, both, options, say, &mut report)?;
    compare(&as_made, format!("{LAZY_CASE}, as made"), &lazy, both, options, say, &mut report)?;
    let legs = vec![Leg::insert(SPEED * if options.quick { 0.2 } else { SHORT_RUN }, SPEED)];
    let short = Scene { legs, ..flexible.clone() };
    let numerics = Numerics { dt: SHORT, ..lazy };
    compare(&short, SHORT_CASE.into(), &numerics, most, options, say, &mut report)?;
    for (order, scene) in [("as made", &as_made), ("RCM", flexible)] {
        let bandwidth = mean_bandwidth(&scene.tissue.mesh);
        report.figures.push(Figure::plain(format!("prostate, mean bandwidth, {order}"), bandwidth));
    }
    report.figures.extend(figures(&report, options));
    if let Some(folder) = &options.out {
        let page = page::markdown("Threads under a needle", ABOUT, &report, options.quick) + &published_table();
        report.write(folder, "threads.md", &page)?;
    }
    Ok(report)
}

fn compare(
    scene: &Scene,
    case: String,
    numerics: &Numerics,
    teams: &[(usize, &'static str)],
    options: &BenchOptions,
    say: &mut dyn FnMut(&str),
    report: &mut Report,
) -> Result<(), BenchError> {
    let mut first: Option<Vec<u64>> = None;
    for &(threads, method) in teams {
        if options.stopped() {
            return Ok(());
        }
        say(&format!("{case}, {threads} threads{}{method}", if method.is_empty() { "" } else { ", " }));
        let numerics = Numerics { metis: method == METIS, ..*numerics };
        let team = Team::new(threads);
        let mut insertion = scene.start(&numerics, &team)?;
        let (mut frames, mut hands) = (Vec::new(), Vec::new());
        let mut vector = vec![0.0; HANDED];
        let followed = scene.follow(&mut insertion, numerics.dt, |_, _, seconds| {
            if frames.len() % EVERY == 0 {
                hands.push(hand(&team, &mut vector));
            }
            frames.push(seconds);
            if options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let bits = bits(&insertion);
        let same = *first.get_or_insert_with(|| bits.clone()) == bits;
        let mut row = row(case.clone(), threads, &mut frames, &insertion.times());
        row.method = method.into();
        row.more.insert("handed_us", 1e6 * median(&mut hands));
        row.note = match followed {
            Err(error) => error.to_string(),
            Ok(()) if !same => "the bits differ from those of the first run".into(),
            Ok(()) => String::new(),
        };
        row.ok = row.note.is_empty();
        report.rows.push(row);
    }
    Ok(())
}

/// Seconds in which a vector goes from the calling thread to its team and back, the least of a few times.
fn hand(team: &Team, vector: &mut [f64]) -> f64 {
    let mut once = || {
        let since = Instant::now();
        vector.iter_mut().for_each(|x| *x += 1.0);
        let mut parts: Vec<&mut [f64]> = vector.chunks_mut(HANDED.div_ceil(team.size())).collect();
        team.each(&mut parts, |_, part| part.iter_mut().for_each(|x| *x += 1.0));
        since.elapsed().as_secs_f64()
    };
    (0..HANDS).map(|_| once()).fold(f64::INFINITY, f64::min)
}

/// Those of all that moves.
fn bits(insertion: &Insertion<Solid>) -> Vec<u64> {
    let state = insertion.state();
    let shaft = &insertion.needles()[0].shaft;
    [&state.u, &state.v, &state.a, &shaft.x, &shaft.v, &shaft.a].into_iter().flatten().map(|x| x.to_bits()).collect()
}

fn row(case: String, threads: usize, frames: &mut [f64], times: &InsertionTimes) -> Row {
    let (tissue, coupled) = (&times.tissue, &times.coupled);
    let seconds = [
        coupled.couple.seconds + coupled.search.seconds,
        tissue.forces.seconds + tissue.linearize.seconds + tissue.matrix.seconds,
        coupled.needle.seconds + times.prepare.seconds,
        times.remesh.seconds + times.reparameterise.seconds,
    ];
    let n = frames.len().max(1) as f64;
    let whole = median(frames);
    let published =
        PUBLISHED.iter().find(|(name, on, _)| *name == case && *on == threads).map(|(.., numbers)| *numbers);
    let mut row = Row { threads, seconds: Some(whole), ..Row::default() };
    row.more = COLUMNS.into_iter().zip([whole].into_iter().chain(seconds.map(|s| s / n)).map(|s| 1e3 * s)).collect();
    row.more.extend(Numbers::from([
        ("p99_ms", 1e3 * frames.get(frames.len() * 99 / 100).copied().unwrap_or(f64::NAN)),
        ("threads", threads as f64),
        ("frames", n),
    ]));
    row.published = published.map(|numbers| COLUMNS.into_iter().zip(numbers).collect()).unwrap_or_default();
    row.case = case;
    row
}

fn figures(report: &Report, options: &BenchOptions) -> Vec<Figure> {
    let differing = report.rows.iter().filter(|row| !row.ok).count();
    let mut figures = vec![Figure::at_most("runs that fail, or whose bits differ", differing as f64, 0.0)];
    let of = |case: &str, name: &str| {
        let ours = |row: &&Row| row.case == case && row.threads == options.threads && row.method.is_empty();
        let mut rows = report.rows.iter().filter(ours);
        rows.next_back().and_then(|row| row.more.get(name)).copied().unwrap_or(f64::NAN)
    };
    // Budgets are about whole runs on two threads.
    let at_most = |name: &str, value: f64, most: f64| {
        if options.quick || options.threads != 2 {
            Figure::plain(name, value)
        } else {
            Figure::at_most(name, value, most)
        }
    };
    let ([half, p99], short) = BUDGET;
    figures.push(at_most("prostate flexible, lazy: median frame, ms", of(LAZY_CASE, COLUMNS[0]), half));
    figures.push(at_most("prostate flexible, lazy: 99th percentile, ms", of(LAZY_CASE, "p99_ms"), p99));
    figures.push(at_most("prostate flexible, lazy, steps of 1 ms: median, ms", of(SHORT_CASE, COLUMNS[0]), short));
    figures
}

fn published_table() -> String {
    let mut text = "\nPublished, ms:\n\n| run | threads | total | LCP | tissue | needle | remesh |\n|---|---:|---:|---:|---:|---:|---:|\n"
        .to_owned();
    for (name, threads, numbers) in PUBLISHED {
        let cells: Vec<String> = numbers.iter().map(f64::to_string).collect();
        text += &format!("| {name} | {threads} | {} |\n", cells.join(" | "));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insertion::setup::{GEL, Layers, Tissue, wire};

    #[test]
    fn neither_threads_nor_parts_change_the_bits() {
        let scene = Scene {
            name: "a block",
            // Enough elements for a second thread to be woken.
            tissue: Tissue::gel_box([0.08; 3], [9; 3], GEL, |x| x[0] > 0.08 - 1e-9).in_rcm_order(),
            needle: wire([0.0, 0.0403, 0.0397], 0.1),
            layers: Layers::default(),
            legs: vec![Leg::insert(0.01, SPEED), Leg::insert(-0.004, SPEED)],
        };
        let options = BenchOptions { threads: 2, ..BenchOptions::default() };
        let mut report = Report::new("threads", 2);
        let teams = [(1, ""), (2, ""), (2, METIS)];
        compare(&scene, "a block".into(), &Numerics::default(), &teams, &options, &mut |_| {}, &mut report).unwrap();
        assert!(report.rows.len() == 3 && report.rows.iter().all(|row| row.ok), "{report:?}");
        let stages: f64 = COLUMNS[1..].iter().map(|name| report.rows[0].more[name]).sum();
        assert!(stages > 0.0 && report.rows[0].more["frames"] == 35.0, "{report:?}");
    }
}
