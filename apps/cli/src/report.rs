//! The summary of a run for people.

use std::fmt::Write as _;
use std::path::Path;
use stylet_tissue::stages::WITHIN_SOLVE;
use stylet_tissue::summary::{BodySummary, MarkerSummary, NeedleSummary, SteeringSummary, Summary};

/// So many markers have a line each.
const FEW: usize = 3;

/// The summary as text: what came out, where the time went, where the files are.
pub fn text(summary: &Summary, folder: Option<&Path>) -> String {
    let mut text = headline(summary);
    for (name, value) in facts(summary) {
        line(&mut text, &format!("  {name:<13} {value}"));
    }
    text.push('\n');
    stages(summary, &mut text);
    if let Some(folder) = folder {
        text.push('\n');
        files(folder, &mut text);
    }
    text
}

fn line(text: &mut String, line: &str) {
    text.push_str(line);
    text.push('\n');
}

fn headline(summary: &Summary) -> String {
    let outcome = match (&summary.failure, summary.converged, summary.interrupted) {
        (Some(_), ..) => "failed",
        (None, true, false) => "converged",
        (None, true, true) => "converged as far as it went",
        (None, false, true) => "stopped early",
        (None, false, false) => "NOT converged",
    };
    let step = step_word(summary);
    let steps = if summary.steps == 1 { format!("1 {step}") } else { format!("{} {step}s", summary.steps) };
    let threads = if summary.threads == 1 { "1 thread".to_owned() } else { format!("{} threads", summary.threads) };
    let rate = if summary.steps > 1 { format!("{:.0} {step}s/s, ", summary.update_hz) } else { String::new() };
    format!("{}: {outcome}, {steps} in {} ({rate}up to {threads})\n\n", summary.scene, seconds(summary.wall_s))
}

/// What a step of this run is called.
pub fn step_word(summary: &Summary) -> &'static str {
    if summary.needle.is_some() && summary.steering.is_none() { "cycle" } else { "step" }
}

fn seconds(s: f64) -> String {
    if s < 0.1 { format!("{:.2} ms", 1e3 * s) } else { format!("{s:.2} s") }
}

/// What came out: name and value.
fn facts(summary: &Summary) -> Vec<(&'static str, String)> {
    let quality = &summary.quality;
    let mut facts = vec![
        (
            "mesh",
            format!("{} nodes, {} {}, {} unknowns", summary.nodes, summary.elements, cells_word(summary), summary.dofs),
        ),
        (
            "quality",
            format!(
                "angles {:.1} to {:.1} degrees, worst {} {:.3} (1 is equilateral)",
                quality.min_angle_deg,
                quality.max_angle_deg,
                cell_word(summary),
                quality.min_quality
            ),
        ),
    ];
    if let Some(steering) = &summary.steering {
        steering_facts(steering, &mut facts);
    } else if let Some(needle) = &summary.needle {
        needle_facts(needle, &mut facts);
    }
    if let Some(body) = &summary.body {
        body_facts(body, &mut facts);
    }
    facts.push(("strain energy", format!("{:.4e} J", summary.energy_j)));
    let solver = &summary.solver;
    facts.push((
        "solver",
        format!(
            "{} iterations, {:.1} a solve, at most {}; last relative residual {:.1e}",
            solver.iterations_total, solver.iterations_mean, solver.iterations_max, solver.relative_residual
        ),
    ));
    if let Some(bytes) = &summary.bytes {
        let each = bytes.per_element;
        facts.push(("memory", format!("{:.1} MB, {each:.0} bytes an element", 1e-6 * bytes.total as f64)));
    }
    if solver.unconverged_solves > 0 {
        let (count, first) = (solver.unconverged_solves, solver.first_unconverged_cycle);
        facts.push(("NOT converged", format!("{count} solves, the first in {} {first}", step_word(summary))));
    }
    for probe in &summary.probes {
        let at: Vec<String> = probe.at.iter().map(f64::to_string).collect();
        facts.push(("probe", format!("({}) m moved by {}", at.join(", "), millimetres(&probe.displacement, 4))));
    }
    facts
}

fn cells_word(summary: &Summary) -> &'static str {
    if cell_word(summary) == "triangle" { "triangles" } else { "tetrahedra" }
}

/// What a cell of the mesh is called.
fn cell_word(summary: &Summary) -> &'static str {
    if summary.dofs == 3 * summary.nodes { "tetrahedron" } else { "triangle" }
}

fn body_facts(body: &BodySummary, facts: &mut Vec<(&'static str, String)>) {
    let (most, mean) = (fixed(1e3 * body.max_displacement_m, 4), millimetres(&body.mean_displacement_m, 4));
    facts.push(("displacement", format!("at most {most} mm, on average {mean}")));
    facts.push(("smallest J", format!("{:.4}", body.min_j)));
    if !body.momentum.is_empty() {
        facts.push(("time", format!("{:.4} s, kinetic energy {:.4e} J", body.time_s, body.kinetic_energy_j)));
    }
    facts.push(("residual", format!("{:.3e} N, {} nonlinear iterations", body.residual_n, body.nonlinear_iterations)));
    facts.extend(body.warnings.iter().map(|warning| ("warning", warning.clone())));
}

fn needle_facts(needle: &NeedleSummary, facts: &mut Vec<(&'static str, String)>) {
    let tip = millimetres(&needle.tip, 2);
    // A static load has no base that could be held, and acts on the undeformed slab.
    if needle.rearrangements > 0 {
        let reference = millimetres(&needle.tip_reference, 2);
        facts.push(("needle tip", format!("at {tip}, in tissue that was at {reference} before")));
        let (force, moment) = (tuple(&needle.base_force, 3), tuple(&needle.base_torque, 5));
        facts.push(("base force", format!("{force} N, moment {moment} N m")));
        facts.push(("needle nodes", format!("{}, of which {} stick", needle.nodes, needle.sticking)));
    } else {
        facts.push(("needle tip", format!("at {tip} in the undeformed slab")));
        facts.push(("needle nodes", needle.nodes.to_string()));
    }
}

/// How near a tip came to markers: to each of a few, or to the nearest of many.
fn closest(markers: &[MarkerSummary]) -> Vec<String> {
    let line = |marker: &MarkerSummary| {
        let closest = marker.closest_tip_m?;
        Some(format!("{}: a tip came within {} mm", marker.name, fixed(1e3 * closest, 2)))
    };
    if markers.len() <= FEW {
        return markers.iter().filter_map(line).collect();
    }
    let distance = |marker: &MarkerSummary| marker.closest_tip_m.unwrap_or(f64::INFINITY);
    let nearest = markers.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.and_then(line).map(|line| format!("of {} the nearest is {line}", markers.len())).into_iter().collect()
}

fn steering_facts(steering: &SteeringSummary, facts: &mut Vec<(&'static str, String)>) {
    for needle in &steering.needles {
        let (tip, depth) = (millimetres(&needle.tip, 2), fixed(1e3 * needle.depth_m, 2));
        let most = fixed(1e3 * needle.max_depth_m, 2);
        facts.push(("needle tip", format!("at {tip}, {depth} mm deep, at most {most} mm")));
        let (force, push) = (tuple(&needle.base_force, 3), fixed(needle.max_push_n, 3));
        facts.push(("base force", format!("{force} N, pushed with at most {push} N")));
        facts.push(("needle nodes", format!("{} in the tissue, of which {} stick", needle.nodes, needle.sticking)));
    }
    let [least, largest] = steering.angles_deg;
    facts.push((
        "all angles",
        format!("{least:.1} to {largest:.1} degrees, undeformed, from the twenty-first step inside on"),
    ));
    facts.push((
        "states",
        format!(
            "{:.2} trials a step, at most {}; {:.2} % of the steps consistent",
            steering.trials_mean,
            steering.trials_max,
            100.0 * steering.consistent_share
        ),
    ));
    let [median, late, longest] = steering.step_s.map(seconds);
    facts.push(("frame", format!("{median} median, {late} 99th percentile, {longest} longest")));
    if let Some(clearance) = steering.clearance_m {
        facts.push(("clearance", format!("{} mm from what is fixed", fixed(1e3 * clearance, 2))));
    }
    facts.extend(closest(&steering.markers).into_iter().map(|closest| ("marker", closest)));
    for seed in &steering.seeds {
        facts.push((
            "seed",
            format!("of {} mm depth, now at {}", fixed(1e3 * seed.depth_m, 1), millimetres(&seed.place, 2)),
        ));
    }
    facts.extend(steering.notes.iter().map(|note| ("note", note.clone())));
    if let Some(error) = &steering.marker_error {
        let shares = [error.below_1_mm, error.below_2_mm, error.below_3_mm].map(|share| fixed(100.0 * share, 1));
        let rms = fixed(1e3 * error.rms_m, 3);
        let [one, two, three] = shares;
        facts.push((
            "marker error",
            format!("RMS {rms} mm of {} positions; below 1, 2, 3 mm: {one}, {two}, {three} %", error.count),
        ));
    }
}

fn millimetres(metres: &[f64], digits: usize) -> String {
    let scaled: Vec<f64> = metres.iter().map(|x| 1e3 * x).collect();
    tuple(&scaled, digits) + " mm"
}

/// `(1.0, 2.0)`; a number alone has no brackets.
fn tuple(numbers: &[f64], digits: usize) -> String {
    let texts: Vec<String> = numbers.iter().map(|&x| fixed(x, digits)).collect();
    if let [one] = &texts[..] { one.clone() } else { format!("({})", texts.join(", ")) }
}

/// A number with that many digits after the point; rounding errors do not show as `-0.000`.
fn fixed(x: f64, digits: usize) -> String {
    let text = format!("{x:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_owned(),
        _ => text,
    }
}

/// Seconds, share of the steps' wall time and calls of each stage; stages within the solve stand below it, and what came before the
/// steps last, without a share.
fn stages(summary: &Summary, text: &mut String) {
    let wall = summary.wall_s.max(f64::MIN_POSITIVE);
    line(text, &format!("  {:<14} {:>9} {:>8} {:>9}", "stage", "seconds", "share", "calls"));
    let mut row = |name: &str, seconds: f64, share: &str, calls: &str| {
        line(text, format!("  {name:<14} {seconds:>9.4} {share:>8} {calls:>9}").trim_end());
    };
    let share = |seconds: f64| format!("{:.1} %", 100.0 * seconds / wall);
    let before = |name: &str| summary.stages.before_steps().find(|stage| stage.0 == name).map_or(0.0, |stage| stage.1);
    let mut listed = 0.0;
    let in_steps = summary.stages.iter().map(|(name, seconds, calls)| (name, seconds - before(name), calls));
    let mut stages: Vec<_> = in_steps.filter(|stage| stage.1 > 0.0).collect();
    stages.retain(|stage| !WITHIN_SOLVE.contains(&stage.0));
    stages.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (name, seconds, calls) in stages {
        listed += seconds;
        row(name, seconds, &share(seconds), &calls.to_string());
        if name == "solve" {
            for (inner, seconds, calls) in summary.stages.iter().filter(|stage| WITHIN_SOLVE.contains(&stage.0)) {
                row(&format!("  of it {inner}"), seconds, &share(seconds), &calls.to_string());
            }
        }
    }
    let other = (summary.wall_s - listed).max(0.0);
    row("other", other, &share(other), "");
    for (name, seconds) in summary.stages.before_steps() {
        row(name, seconds, "before", "");
    }
}

/// The files that are there, and what they are for.
fn files(folder: &Path, text: &mut String) {
    line(text, &format!("Files in {}:", folder.display()));
    for (name, about) in [
        ("mesh.svg", "the deformed mesh: look at this first"),
        ("force.svg", "force at the base"),
        ("path.svg", "path of the tip, from two sides"),
        ("states.svg", "friction states along the shaft over time"),
        ("stages.svg", "time of each step by stage"),
        ("markers.csv", "places of the markers over time"),
        ("seeds.csv", "seeds that were left"),
        ("iterations.svg", "iterations of each cycle"),
        ("energy.svg", "strain, kinetic and load energy over time"),
        ("history.csv", "one row a step or cycle"),
        ("summary.json", "this summary"),
        ("body.pvd", "frames of the mesh, for ParaView"),
        ("needle.pvd", "frames of the needle, for ParaView"),
        ("state", "states to go on from with --resume"),
    ] {
        if folder.join(name).exists() {
            let _ = writeln!(text, "  {name:<15} {about}");
        }
    }
}
