//! The mesh layer: exact counts and angles, times, bytes, and the long runs that the test suite does a hundredth of.
//!
//! Everything runs on one thread. `published` holds the exact counts that a correct kernel must give, measured on other
//! programs or derived; times are medians.

mod local;
mod locate;
mod needle;
mod starts;
mod uniform;

use crate::{BenchError, BenchOptions, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::{SimplexMesh, quality};

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("mesh", 1);
    let parts: [(&str, Part); 5] = [
        ("refinement around points and along a needle", local::run),
        ("uniform refinement", uniform::run),
        ("location", locate::run),
        ("random start meshes", starts::run),
        ("needle remesher", needle::run),
    ];
    for (name, part) in parts {
        if options.stopped() {
            break;
        }
        say(name);
        part(options, say, &mut report);
    }
    Ok(report)
}

type Part = fn(&BenchOptions, &mut dyn FnMut(&str), &mut Report);

/// Seconds of `work` on a fresh value of `make`, once each of `repeats` times, and the last result.
fn times<S, T>(repeats: usize, make: impl Fn() -> S, mut work: impl FnMut(&mut S) -> T) -> (Vec<f64>, S, T) {
    let mut seconds = Vec::with_capacity(repeats);
    let mut last = None;
    for _ in 0..repeats.max(1) {
        let mut state = make();
        let since = Instant::now();
        let result = work(&mut state);
        seconds.push(since.elapsed().as_secs_f64());
        last = Some((state, result));
    }
    let (state, result) = last.expect("at least one repeat");
    (seconds, state, result)
}

/// What a mesh is like: counts, angles, shapes, bytes.
fn description<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Numbers {
    let quality = quality::summary(mesh);
    Numbers::from([
        ("leaves", mesh.n_cells() as f64),
        ("vertices", mesh.n_vertices() as f64),
        ("shapes", quality::shapes(mesh) as f64),
        ("min_angle_deg", quality.min_angle_deg),
        ("max_angle_deg", quality.max_angle_deg),
        ("bytes_per_leaf", mesh.bytes() as f64 / mesh.n_cells() as f64),
    ])
}

/// Fails a row whose numbers are not those expected: exactly for counts, to a billionth for angles.
fn expect(row: &mut Row, expected: &[(&'static str, f64)]) {
    row.published = expected.iter().copied().collect();
    let differs = |(name, value): &&(&'static str, f64)| {
        let found = row.more.get(name).copied().unwrap_or(f64::NAN);
        let difference = (found - value).abs();
        difference.is_nan() || difference > 1e-9 * value.abs()
    };
    let wrong: Vec<String> =
        expected.iter().filter(differs).map(|(name, value)| format!("{name} is not {value}")).collect();
    if !wrong.is_empty() {
        row.ok = false;
        row.note = wrong.join(", ");
    }
}
