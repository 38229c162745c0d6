//! `stylet bench steering`: the curvature of the path of a bevelled wire against what it should, and should not, depend on.

use super::page;
use super::setup::{BEVEL, FRAME, GEL, Layers, Leg, Numerics, SPEED, Scene, Stuff, Tissue, length, wire};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::f64::consts::PI;
use std::ops::ControlFlow;
use stylet_physics::insertion::{NeedleSettings, UniformInteraction};
use stylet_physics::rod::RodStiffness;
use stylet_plot::{Chart, Series, Style};
use stylet_solver::team::Team;

/// Box, m, wide where the needle bends to, and cells across its short side: a coarse mesh, the standard, a fine one.
const BOX: [f64; 3] = [0.1, 0.1, 0.06];
const CELLS: [usize; 3] = [6, 9, 12];
/// How deep the tip goes, m, and the part of the way after which its path is looked at.
const DEPTH: f64 = 0.08;
const FROM: f64 = 1.0 / 3.0;
/// Bending stiffness of the wire, N m².
const BENDING: f64 = 1.40e-3;
/// Lateral stiffness of the tissue by length of the needle over Young's modulus: 1 to 1.5.
const LATERAL: f64 = 1.25;
/// What the theory of a beam in an elastic bed has for the exponents, and how far they may be from it.
const EXPONENTS: [(&str, f64, f64); 3] = [("tan psi", 1.0, 0.05), ("E", 0.25, 0.05), ("EI", -0.25, 0.05)];
/// How far curvatures may differ that should be equal, %.
const INDEPENDENT: f64 = 10.0;
/// Sideways drift of a symmetric tip over its depth, %.
const DRIFT: f64 = 0.1;

const ABOUT: &str = "A wire (0.83 mm, EI 1.40e-3 N m², bevel 5°) pushed 80 mm into gel (E 15 kPa, ν 0.45, 0.1 × 0.1 × 0.06 m, \
    cells of 6.7 mm, held on all sides but that of the entry) at 20 mm/s with steps of 20 ms, friction 12 N/m, 200 N s/m², cutting \
    0.05 N, the least in gel: a force at a node strains the cells around it by `f / E h²`; each row changes what it names. `curvature_per_m` is that of the circle through the last two thirds of the path of the tip \
    in the undeformed body, by least squares in the plane of the bevel; `beam_per_m` is `(k/4EI)^(1/4) tan psi` with `k = 1.25 E`: \
    a beam in an elastic bed whose tip cuts at psi to itself, to which its slope and not the absolute value is compared; `rms_mm` \
    is the distance of the path from the circle, `out_mm` how far the tip leaves the plane, `drift_%` the distance of its end from \
    the axis over the depth.\n\n![Paths of the tip](steering.svg)";

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
        let tissue =
            Tissue::gel_box(BOX, BOX.map(|side| (side / BOX[2] * self.cells as f64).round() as usize), gel, sides);
        // Off the edges and faces of the mesh.
        let plain = wire([0.0, 0.5 * BOX[1] + 0.31e-3, 0.5 * BOX[2] - 0.23e-3], self.bevel);
        let scale = self.bending / plain.stiffness.bending;
        let stiffness =
            RodStiffness { bending: self.bending, twisting: scale * plain.stiffness.twisting, ..plain.stiffness };
        let bevel_direction = [0.0, self.roll.cos(), self.roll.sin()];
        Scene {
            name: self.name,
            tissue,
            needle: NeedleSettings { stiffness, bevel_direction, ..plain },
            layers: Layers {
                within: UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.05 },
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
    cases.push(Case { name: "symmetric tip", bevel: 0.0, ..standard.clone() });
    cases.push(Case { name: "rolled by 180°", roll: PI, ..standard.clone() });
    cases.push(Case { name: "rolled by 90°", roll: 0.5 * PI, ..standard.clone() });
    cases.push(Case { name: "spinning, 2 turns/s", spin: 4.0 * PI, ..standard });
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

fn follow(case: &Case, options: &BenchOptions, team: &Team) -> Result<(Row, Path), BenchError> {
    let scene = case.scene();
    let mut insertion = scene.start(&Numerics { dt: case.dt, ..Numerics::default() }, team)?;
    let mut path = Path::new();
    let start = scene.needle.base;
    let (mut blocked, mut seconds) = (0, 0.0);
    let followed = scene.follow(&mut insertion, case.dt, |insertion, step, frame| {
        blocked += step.blocked;
        seconds += frame;
        if let Some(tip) = insertion.needles()[0].nodes().last() {
            let x = insertion.mesh().points()[tip.vertex as usize];
            let [along, y, z]: [f64; 3] = std::array::from_fn(|k| x[k] - if k == 0 { 0.0 } else { start[k] });
            let (sin, cos) = case.roll.sin_cos();
            path.push([along, cos * y + sin * z, cos * z - sin * y]);
        }
        if options.stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let end = path.last().copied().unwrap_or([f64::NAN; 3]);
    let late: Vec<[f64; 2]> = path.iter().filter(|p| p[0] > FROM * end[0]).map(|p| [p[0], p[1]]).collect();
    let (curvature, rms) = circle(&late);
    let more = Numbers::from([
        ("curvature_per_m", curvature),
        ("beam_per_m", case.beam()),
        ("depth_mm", 1e3 * end[0]),
        ("rms_mm", 1e3 * rms),
        ("out_mm", 1e3 * end[2]),
        ("drift_%", 100.0 * length(&[0.0, end[1], end[2]]) / end[0]),
        ("blocked", f64::from(blocked)),
    ]);
    let row = Row {
        case: case.label(),
        threads: options.threads,
        ok: followed.is_ok(),
        note: followed.err().map_or_else(String::new, |error| error.to_string()),
        seconds: Some(seconds),
        more,
        ..Row::default()
    };
    Ok((row, path))
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
    let curvature = |k: usize| report.rows[k].more["curvature_per_m"];
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
    for name in ["dt", "h", "rolled by 180°", "rolled by 90°"] {
        let off = |k: &usize| 100.0 * (curvature(*k) / standard - 1.0).abs();
        let most = of(name).iter().map(off).fold(0.0, f64::max);
        figures.push(Figure::at_most(format!("{name}: most change of the curvature, %"), most, INDEPENDENT));
    }
    for k in of("symmetric tip") {
        figures.push(Figure::at_most("symmetric tip: drift, %", report.rows[k].more["drift_%"], DRIFT));
    }
    figures
}

fn chart(paths: &[(Case, Path)]) -> Chart {
    let series = paths.iter().map(|(case, path)| Series {
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
