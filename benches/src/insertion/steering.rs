//! `stylet bench steering`: the curvature of the path of a bevelled wire against what it should, and should not, depend on.

use super::page;
use super::setup::{BEVEL, FRAME, GEL, Layers, Leg, Numerics, SPEED, Scene, Stuff, Tissue, wire};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use stylet_mesh::generate::{kuhn_box, mirrored_kuhn_box};
use stylet_physics::insertion::{NeedleSettings, UniformInteraction};
use stylet_physics::rod::RodStiffness;
use stylet_plot::{Chart, Series, Style};
use stylet_solver::team::Team;

/// Box, m, wide where the needle bends to, and cells across its short side: a coarse mesh, the standard, a fine one.
const BOX: [f64; 3] = [0.1, 0.1, 0.06];
const CELLS: [usize; 3] = [6, 9, 12];
/// How deep the tip goes, m, and the part of the way after which its path is looked at, at so many depths.
const DEPTH: f64 = 0.08;
const FROM: f64 = 0.5;
const LOOKS: usize = 100;
/// Bending stiffness of the wire, N m².
const BENDING: f64 = 1.40e-3;
/// Lateral stiffness of the tissue by length of the needle over Young's modulus: 1 to 1.5.
const LATERAL: f64 = 1.25;
/// What the theory of a beam in an elastic bed has for the exponents, and how far they may be from it.
const EXPONENTS: [(&str, f64, f64); 3] = [("tan psi", 1.0, 0.05), ("E", 0.25, 0.05), ("EI", -0.25, 0.05)];
/// Cutting force, N: the standard, none, and that of the phantom.
const CUTTING: [f64; 3] = [0.05, 0.0, 0.2];
/// How far curvatures may differ that should be equal, %.
const INDEPENDENT: f64 = 10.0;
/// Sideways drift of a symmetric tip over its depth, %.
const DRIFT: f64 = 0.1;
/// Where a needle goes in, m off the middle: off the edges and faces of the mesh.
const OFF: [f64; 2] = [0.31e-3, -0.23e-3];
/// Other places for a symmetric tip.
const PLACES: [(&str, [f64; 2]); 5] = [
    ("symmetric tip at (1.3, 0.7) mm", [1.3e-3, 0.7e-3]),
    ("symmetric tip at (-2.1, 1.6) mm", [-2.1e-3, 1.6e-3]),
    ("symmetric tip at (2.7, -0.4) mm", [2.7e-3, -0.4e-3]),
    ("symmetric tip at (-0.9, -2.3) mm", [-0.9e-3, -2.3e-3]),
    ("symmetric tip at (0.6, 3.0) mm", [0.6e-3, 3.0e-3]),
];

const ABOUT: &str = "A wire (0.83 mm, EI 1.40e-3 N m², bevel 5°) pushed 80 mm into gel (E 15 kPa, ν 0.45, 0.1 × 0.1 × 0.06 m, \
    cubes of 6.7 mm, each the mirror image of its neighbours, held on all sides but that of the entry) at 20 mm/s with steps of \
    20 ms, friction 12 N/m, 200 N s/m², cutting 0.05 N; each row changes what it names.\n\n\
    Each row is two runs, the second with the wire rolled by 180°. The path that is looked at is that of the tip in the undeformed \
    body, in the plane of the bevel: half the difference of the two, which the bevel makes. Half their sum is what the mesh makes: \
    `drift_%` is its distance from the axis at the end over the depth, `uneven_%` the difference of the curvatures of the two runs \
    over their mean. `curvature_per_m` is that of the circle through the second half of the path by least squares, and `rms_mm` \
    the distance of the path from it. `beam_per_m` is `(k/4EI)^(1/4) tan psi` with `k = 1.25 E`: a beam in an elastic bed whose tip \
    cuts at psi to itself, to which the exponents and not the absolute values are compared. In a body of this size the exponents \
    of that beam itself are 1/4 to 0.28, and the stiffness `k` of a solid falls slowly with the length over which it is bent, \
    over the size of its cells.\n\n\
    Friction and cutting act at nodes, and a force along the needle moves a node aside where the cells around it are not symmetric, by \
    a part of its way that does not depend on their size. The tissue is relieved of that (`relieve_aside` of the coupled step): the \
    path of a symmetric tip is straight along a line of symmetry of the mesh (`symmetric tip and mesh`) and nearly so at any other \
    place (`symmetric tip`). `nodal loads` has the same forces without relief, as published. Where all diagonals run the same way, \
    as in Kuhn's mesh, the cells beside the needle act together, and more of the drift is left.\n\n![Paths of the tip](steering.svg)";

/// One run.
#[derive(Clone)]
struct Case {
    /// What is varied, and to what.
    name: &'static str,
    value: f64,
    unit: &'static str,
    young: f64,
    bending: f64,
    bevel: f64,
    dt: f64,
    cells: usize,
    cutting: f64,
    /// Whether all diagonals of the mesh run the same way.
    kuhn: bool,
    /// Where the needle goes in, m off the middle; with an even number of cells the mesh is symmetric about that.
    off: [f64; 2],
    /// Whether nodes are relieved of what unsymmetric cells do to forces along the needle.
    relieved: bool,
    /// Angle of the bevel about the axis, rad, and turning, rad/s.
    roll: f64,
    spin: f64,
}

impl Case {
    fn standard(quick: bool) -> Self {
        Self {
            name: "standard",
            value: 1.0,
            unit: "",
            young: GEL.young,
            bending: BENDING,
            bevel: BEVEL,
            dt: FRAME,
            cells: if quick { CELLS[0] } else { CELLS[1] },
            cutting: CUTTING[0],
            kuhn: false,
            off: OFF,
            relieved: true,
            roll: 0.0,
            spin: 0.0,
        }
    }

    fn label(&self) -> String {
        if self.unit.is_empty() { self.name.into() } else { format!("{} {}{}", self.name, self.value, self.unit) }
    }

    fn scene(&self) -> Scene {
        let sides = |x: &[f64; 3]| x[0] > BOX[0] - 1e-9 || (1..3).any(|k| x[k] < 1e-9 || x[k] > BOX[k] - 1e-9);
        let gel = Stuff { young: self.young, ..GEL };
        let cells = BOX.map(|side| (side / BOX[2] * self.cells as f64).round() as usize);
        let divide = if self.kuhn { kuhn_box } else { mirrored_kuhn_box };
        let tissue = Tissue::of_gel(divide([0.0; 3], BOX, cells).expect("a box"), gel, sides);
        let plain = wire([0.0, 0.5 * BOX[1] + self.off[0], 0.5 * BOX[2] + self.off[1]], self.bevel);
        let scale = self.bending / plain.stiffness.bending;
        let stiffness =
            RodStiffness { bending: self.bending, twisting: scale * plain.stiffness.twisting, ..plain.stiffness };
        let bevel_direction = [0.0, self.roll.cos(), self.roll.sin()];
        Scene {
            name: self.name,
            tissue,
            needle: NeedleSettings { stiffness, bevel_direction, ..plain },
            layers: Layers {
                within: UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: self.cutting },
                ..Layers::default()
            },
            legs: vec![Leg {
                motion: stylet_physics::insertion::BaseMotion { spin: self.spin, ..Leg::insert(DEPTH, SPEED).motion },
                seconds: DEPTH / SPEED,
            }],
        }
    }

    /// What a beam in an elastic bed would have, 1/m.
    fn beam(&self) -> f64 {
        (LATERAL * self.young / (4.0 * self.bending)).powf(0.25) * self.bevel.tan()
    }
}

fn cases(quick: bool) -> Vec<Case> {
    let standard = Case::standard(quick);
    let mut cases = vec![standard.clone()];
    for degrees in [2.5, 10.0] {
        let bevel = degrees * PI / 180.0;
        cases.push(Case { name: "tan psi", value: degrees, unit: "°", bevel, ..standard.clone() });
    }
    for factor in [0.25, 4.0] {
        let young = factor * GEL.young;
        cases.push(Case { name: "E", value: young / 1e3, unit: " kPa", young, ..standard.clone() });
    }
    for factor in [0.25, 4.0] {
        let bending = factor * BENDING;
        cases.push(Case { name: "EI", value: bending, unit: " N m²", bending, ..standard.clone() });
    }
    for ms in [5.0, 10.0, 40.0] {
        cases.push(Case { name: "dt", value: ms, unit: " ms", dt: 1e-3 * ms, ..standard.clone() });
    }
    for cells in if quick { &CELLS[1..2] } else { &[CELLS[0], CELLS[2]][..] } {
        cases.push(Case {
            name: "h",
            value: (1e4 * BOX[2] / *cells as f64).round() / 10.0,
            unit: " mm",
            cells: *cells,
            ..standard.clone()
        });
    }
    cases.push(Case { name: "rolled by 90°", roll: 0.5 * PI, ..standard.clone() });
    for cutting in &CUTTING[1..] {
        cases.push(Case { name: "cutting", value: *cutting, unit: " N", cutting: *cutting, ..standard.clone() });
    }
    cases.push(Case { name: "Kuhn's mesh", kuhn: true, ..standard.clone() });
    cases.push(Case { name: "spinning, 2 turns/s", spin: 4.0 * PI, ..standard.clone() });
    let straight = Case { bevel: 0.0, ..standard.clone() };
    for cutting in CUTTING {
        cases.push(Case { name: "symmetric tip, cutting", value: cutting, unit: " N", cutting, ..straight.clone() });
    }
    cases.extend(PLACES.map(|(name, off)| Case { name, off, ..straight.clone() }));
    // An even number of cells has planes of symmetry along the axis.
    for cutting in CUTTING {
        let centred = Case { cutting, cells: CELLS[0], off: [0.0; 2], ..straight.clone() };
        cases.push(Case { name: "symmetric tip and mesh, cutting", value: cutting, unit: " N", ..centred });
    }
    for cutting in CUTTING {
        let nodal = Case { cutting, relieved: false, ..straight.clone() };
        cases.push(Case { name: "nodal loads, symmetric tip, cutting", value: cutting, unit: " N", ..nodal });
    }
    cases.push(Case { name: "Kuhn's mesh, symmetric tip", kuhn: true, ..straight });
    cases
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("steering", options.threads);
    let team = Team::new(options.threads);
    let mut paths = Vec::new();
    for case in cases(options.quick) {
        if options.stopped() {
            break;
        }
        say(&case.label());
        let (row, path) = follow(&case, options, &team)?;
        report.rows.push(row);
        paths.push((case, path));
    }
    report.figures = figures(&report, &paths);
    if let Some(folder) = &options.out {
        report.write(folder, "steering.svg", &chart(&paths).to_svg()?)?;
        let page = page::markdown("Steering", ABOUT, &report, options.quick);
        report.write(folder, "steering.md", &page)?;
    }
    Ok(report)
}

/// Where the tip was in the undeformed body, from the start of the needle: along it, in the plane of the bevel, out of it.
type Path = Vec<[f64; 3]>;

/// What a run did.
#[derive(Default)]
struct Run {
    path: Path,
    blocked: u32,
    seconds: f64,
    failed: Option<String>,
}

fn push(case: &Case, options: &BenchOptions, team: &Team) -> Result<Run, BenchError> {
    let scene = case.scene();
    let mut insertion =
        scene.start(&Numerics { dt: case.dt, relieve_aside: case.relieved, ..Numerics::default() }, team)?;
    let mut run = Run::default();
    let start = scene.needle.base;
    let followed = scene.follow(&mut insertion, case.dt, |insertion, step, frame| {
        run.blocked += step.blocked;
        run.seconds += frame;
        if let Some(tip) = insertion.needles()[0].nodes().last() {
            let x = insertion.mesh().points()[tip.vertex as usize];
            let [along, y, z]: [f64; 3] = std::array::from_fn(|k| x[k] - if k == 0 { 0.0 } else { start[k] });
            let (sin, cos) = case.roll.sin_cos();
            run.path.push([along, cos * y + sin * z, cos * z - sin * y]);
        }
        if options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    run.failed = followed.err().map(|error| error.to_string());
    Ok(run)
}

/// Two runs, the second rolled by 180 degrees; of both the path that the bevel makes. A symmetric tip needs but one.
fn follow(case: &Case, options: &BenchOptions, team: &Team) -> Result<(Row, Path), BenchError> {
    let first = push(case, options, team)?;
    let is_symmetric = case.bevel == 0.0;
    let second =
        if is_symmetric { None } else { Some(push(&Case { roll: case.roll + PI, ..case.clone() }, options, team)?) };
    // The second run is seen from its own bevel.
    let other = second.as_ref().map_or(&first.path, |run| &run.path);
    let sign = if is_symmetric { 1.0 } else { -1.0 };
    let depth = [&first.path, other].map(|path| path.last().map_or(f64::NAN, |end| end[0]));
    let depth = depth[0].min(depth[1]);
    let looks = |from: f64| (0..LOOKS).map(move |i| depth * (from + (1.0 - from) * (i + 1) as f64 / LOOKS as f64));
    let bent = |x: f64| [at(&first.path, x), at(other, x)];
    let half = |x: f64| bent(x).map(|p| 0.5 * p[0]).iter().sum::<f64>();
    let of_bevel: Path = looks(0.0).map(|x| [x, half(x), 0.0]).filter(|p| p[1].is_finite()).collect();
    let late = |f: &dyn Fn(f64) -> f64| circle(&looks(FROM).map(|x| [x, f(x)]).collect::<Vec<_>>());
    let [one, two] = [late(&|x| bent(x)[0][0]).0, late(&|x| bent(x)[1][0]).0];
    let (curvature, rms) = late(&half);
    let drift: [f64; 2] = std::array::from_fn(|k| 0.5 * (bent(depth)[0][k] + sign * bent(depth)[1][k]));
    let mut more = Numbers::from([
        ("depth_mm", 1e3 * depth),
        ("drift_%", 100.0 * drift[0].hypot(drift[1]) / depth),
        ("blocked", f64::from(first.blocked + second.as_ref().map_or(0, |run| run.blocked))),
    ]);
    if !is_symmetric {
        more.insert("curvature_per_m", curvature);
        more.insert("beam_per_m", case.beam());
        more.insert("uneven_%", 200.0 * (one - two).abs() / (one + two).abs());
        more.insert("rms_mm", 1e3 * rms);
    }
    let failed = first.failed.or(second.as_ref().and_then(|run| run.failed.clone()));
    let row = Row {
        case: case.label(),
        threads: options.threads,
        ok: failed.is_none(),
        note: failed.unwrap_or_default(),
        seconds: Some(first.seconds + second.map_or(0.0, |run| run.seconds)),
        more,
        ..Row::default()
    };
    Ok((row, if is_symmetric { first.path } else { of_bevel }))
}

/// Where a path is at a depth: in the plane of the bevel and out of it.
fn at(path: &Path, depth: f64) -> [f64; 2] {
    let Some(next) = path.iter().position(|p| p[0] >= depth) else { return [f64::NAN; 2] };
    let (a, b) = (path[next.saturating_sub(1)], path[next]);
    let part = if b[0] > a[0] { (depth - a[0]) / (b[0] - a[0]) } else { 1.0 };
    // Before its first place it was on the axis.
    if next == 0 { [0.0; 2] } else { std::array::from_fn(|k| a[k + 1] + part * (b[k + 1] - a[k + 1])) }
}

/// Signed curvature of the circle through points of the plane and their distance from it, both by least squares: the algebraic
/// fit of Kasa (1976), `|x|² + D x + E y + F = 0`, of points about their mean.
fn circle(points: &[[f64; 2]]) -> (f64, f64) {
    let n = points.len() as f64;
    let mean: [f64; 2] = std::array::from_fn(|k| points.iter().map(|p| p[k]).sum::<f64>() / n);
    let centred = || points.iter().map(|p| [p[0] - mean[0], p[1] - mean[1]]);
    let sum = |of: fn([f64; 2]) -> f64| centred().map(of).sum::<f64>();
    let (xx, xy, yy) = (sum(|[x, _]| x * x), sum(|[x, y]| x * y), sum(|[_, y]| y * y));
    let xs = sum(|[x, y]| x * (x * x + y * y));
    let ys = sum(|[x, y]| y * (x * x + y * y));
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-12 * xx * xx {
        return (0.0, 0.0); // A line.
    }
    let centre = [0.5 * (yy * xs - xy * ys) / determinant, 0.5 * (xx * ys - xy * xs) / determinant];
    let radius = (centre[0] * centre[0] + centre[1] * centre[1] + (xx + yy) / n).sqrt();
    let off = |[x, y]: [f64; 2]| (x - centre[0]).hypot(y - centre[1]) - radius;
    let rms = (centred().map(|p| off(p) * off(p)).sum::<f64>() / n).sqrt();
    (centre[1].signum() / radius, rms)
}

fn figures(report: &Report, paths: &[(Case, Path)]) -> Vec<Figure> {
    let of_row = |k: usize, what: &str| report.rows[k].more.get(what).copied().unwrap_or(f64::NAN);
    let curvature = |k: usize| of_row(k, "curvature_per_m");
    let of = |name: &str| (0..paths.len()).filter(|&k| paths[k].0.name == name).collect::<Vec<_>>();
    let mut figures = Vec::new();
    for (name, exponent, off) in EXPONENTS {
        let (Some(&low), Some(&high)) = (of(name).first(), of(name).last()) else { continue };
        let value = |case: &Case| match name {
            "E" => case.young,
            "EI" => case.bending,
            _ => case.bevel.tan(),
        };
        let found = (curvature(high) / curvature(low)).ln() / (value(&paths[high].0) / value(&paths[low].0)).ln();
        figures.push(Figure::within(format!("exponent of {name}"), found, exponent - off, exponent + off));
    }
    if paths.is_empty() {
        return figures;
    }
    let standard = curvature(0);
    for name in ["dt", "h", "cutting", "rolled by 90°"] {
        let off = |k: usize| 100.0 * (curvature(k) / standard - 1.0).abs();
        // What has failed has no curvature, and counts as the most.
        let most = of(name).into_iter().map(off).max_by(f64::total_cmp);
        let Some(most) = most else { continue };
        figures.push(Figure::at_most(format!("{name}: most change of the curvature, %"), most, INDEPENDENT));
    }
    figures.push(Figure::at_most("rolled by 180°: change of the curvature, %", of_row(0, "uneven_%"), INDEPENDENT));
    for (k, (case, _)) in paths.iter().enumerate().filter(|(_, (case, _))| case.bevel == 0.0) {
        let (name, drift) = (format!("{}: drift, %", case.label()), of_row(k, "drift_%"));
        let is_ours = case.relieved && !case.kuhn;
        figures.push(if is_ours { Figure::at_most(name, drift, DRIFT) } else { Figure::plain(name, drift) });
    }
    figures
}

fn chart(paths: &[(Case, Path)]) -> Chart {
    // Symmetric tips lie upon each other: those of the standard tell.
    let is_seen = |case: &Case| case.bevel != 0.0 || case.cutting == CUTTING[0] && case.off == OFF;
    let series = paths.iter().filter(|(case, _)| is_seen(case)).map(|(case, path)| Series {
        name: case.label(),
        points: path.iter().map(|p| (1e3 * p[0], 1e3 * p[1])).collect(),
        style: Style::Line,
        ..Series::default()
    });
    Chart {
        title: "Paths of the tip in the undeformed gel, in the plane of the bevel".into(),
        x_label: "depth (mm)".into(),
        y_label: "sideways (mm)".into(),
        series: series.collect(),
        ..Chart::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_have_their_curvature() {
        for curvature in [4.5, -1.2] {
            let points: Vec<[f64; 2]> = (0..100)
                .map(|i| {
                    let s = 0.03 + 1e-3 * f64::from(i);
                    [(curvature * s).sin() / curvature, (1.0 - (curvature * s).cos()) / curvature]
                })
                .collect();
            let (found, rms) = circle(&points);
            assert!((found / curvature - 1.0).abs() < 1e-9 && rms < 1e-12, "{found} {rms}");
        }
        assert_eq!(circle(&[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]), (0.0, 0.0));
    }

    /// The tip goes to the side that the bevel points to, whichever that is.
    #[test]
    fn a_bevel_steers() {
        let options = BenchOptions { threads: 1, quick: true, ..BenchOptions::default() };
        let base = Case { bevel: 0.1, dt: 0.04, ..Case::standard(true) };
        for roll in [0.0, 0.5 * PI] {
            let (row, _) = follow(&Case { roll, ..base.clone() }, &options, &Team::serial()).unwrap();
            assert!(row.ok && row.more["curvature_per_m"] > 1.0, "{row:?}");
        }
    }
}
