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

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("stability", options.threads);
    for part in [crush::run, element::run, contrast::run, hostile::run, threads::run, needle::run] {
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
