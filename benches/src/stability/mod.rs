//! What bodies survive: collapse, scrambles, inverted elements, contrast, hostile input, threads. Rows by material and
//! Poisson's ratio; laws that end at `J = 0` stand there with the error that they report.

mod contrast;
mod crush;
mod element;
mod hostile;
mod needle;
mod page;
mod threads;

use crate::{BenchError, BenchOptions, Report};
use stylet_physics::material::Solid;

/// Young's modulus, Pa.
const YOUNG: f64 = 34e3;
/// Poisson's ratios of the table.
const POISSON: [f64; 3] = [0.3, 0.45, 0.495];
/// Side of the cubes, m.
const SIDE: f64 = 0.1;
/// kg/m³.
const DENSITY: f64 = 1000.0;

/// Adds rows and figures of some tests to the report.
type Part = fn(&BenchOptions, &mut dyn FnMut(&str), &mut Report);

/// Tests that can be asked for one by one.
const PARTS: [(&str, Part); 12] = [
    ("crush", crush::run),
    ("element", element::run),
    ("contrast", contrast::run),
    ("hostile", hostile::run),
    ("threads", threads::run),
    ("incompressible", needle::incompressible::run),
    ("endurance", needle::endurance::run),
    ("extremes", needle::extremes::run),
    ("violence", needle::violence::run),
    ("friction", needle::violence::friction),
    ("paths", needle::paths::run),
    ("needle-threads", needle::threads::run),
];

/// Names of the parts, in their order.
pub(crate) fn parts() -> Vec<&'static str> {
    PARTS.iter().map(|(name, _)| *name).collect()
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("stability", options.threads);
    let asked = |name: &str| options.part.as_deref().is_none_or(|part| part == name);
    for (_, part) in PARTS.iter().filter(|(name, _)| asked(name)) {
        if options.stopped() {
            break;
        }
        part(options, say, &mut report);
    }
    if let Some(folder) = &options.out {
        let page = page::markdown(&report, options.quick);
        report.write(folder, "stability.md", &page)?;
    }
    Ok(report)
}

/// A law of [`Solid::MODELS`] with the modulus of soft tissue.
fn law(model: &str, poisson: f64) -> Solid {
    Solid::from_young_poisson(model, YOUNG, poisson).expect("a law of the list, and constants that all of them take")
}

/// The largest entry, by size; NaN if any is.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, x| if x.is_nan() || most.is_nan() { f64::NAN } else { most.max(x.abs()) })
}
