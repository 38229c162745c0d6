//! What a scene says that can be computed but is hardly meant: most often a number in another unit, such as millimetres.

use crate::geometry::Geometry;
use crate::scene::Scene;
use crate::tissue::Tissue;
use stylet_scene::{Row, number};

/// The magnitudes that something has in scenes of needles in tissue.
struct Usual {
    least: f64,
    most: f64,
    unit: &'static str,
}

const fn usual(least: f64, most: f64, unit: &'static str) -> Usual {
    Usual { least, most, unit }
}

/// Largest side of a body.
const BODY: Usual = usual(1e-3, 2.0, "m");
/// Columns of `[[needle]]`.
const NEEDLE: [(&str, Usual); 6] = [
    ("length", usual(1e-4, 2.0, "m")),
    ("diameter", usual(1e-5, 0.02, "m")),
    ("young", usual(1e6, 1e13, "Pa")),
    ("density", usual(100.0, 3e4, "kg/m^3")),
    // From a hair to a rod of steel of 20 mm.
    ("bending", usual(1e-7, 2e3, "N m^2")),
    ("linear_density", usual(1e-7, 1.0, "kg/m")),
];
const DEPTH: Usual = usual(1e-5, 2.0, "m");
const SPEED: Usual = usual(0.0, 10.0, "m/s");
const THICKNESS: Usual = usual(1e-6, 0.1, "m");
const TISSUE_YOUNG: Usual = usual(10.0, 1e12, "Pa");
const TISSUE_DENSITY: Usual = usual(10.0, 3e4, "kg/m^3");

impl Usual {
    /// A line about a key whose number is of another magnitude.
    fn doubt(&self, key: &str, found: f64) -> Option<String> {
        let Self { least, most, unit } = self;
        let line = || {
            let [found, least, most] = [found, *least, *most].map(number);
            format!("{key}: found {found} {unit}, expected from {least} to {most} {unit}; check the units of the scene")
        };
        (!(*least..=*most).contains(&found)).then(line)
    }
}

/// A line for each key whose number is of a magnitude that is hardly meant: the key, what was found and what was expected.
pub(crate) fn doubts(scene: &Scene, geometry: &Geometry, tissues: &[Tissue]) -> Vec<String> {
    let mut doubts = Vec::new();
    let mesh = &scene.mesh;
    let key = if mesh.shape.is_some() {
        "mesh.shape"
    } else if mesh.file.is_some() {
        "mesh.file"
    } else {
        "mesh.size"
    };
    let side = (0..3).map(|k| geometry.bounds[1][k] - geometry.bounds[0][k]).fold(0.0, f64::max);
    doubts.extend(BODY.doubt(key, side));
    for (region, tissue) in geometry.regions.iter().zip(tissues).filter(|(_, tissue)| !tissue.fixed) {
        let young = tissue.law.lame().young();
        doubts.extend(TISSUE_YOUNG.doubt(&format!("young of region {}", region.name), young));
        doubts.extend(TISSUE_DENSITY.doubt(&format!("density of region {}", region.name), tissue.density));
    }
    for (k, row) in scene.needles.iter().enumerate() {
        doubts.extend(of_needle(row, k + 1, scene.time.pace));
    }
    for (k, row) in scene.membranes.iter().enumerate() {
        let thickness = row.get("thickness");
        doubts.extend(
            thickness.and_then(|x| THICKNESS.doubt(&format!("friction.membrane.thickness (row {})", k + 1), x)),
        );
    }
    doubts
}

/// Doubts about the needle of a row.
fn of_needle(row: &Row, count: usize, pace: f64) -> Vec<String> {
    let key = |column: &str| format!("needle.{column} (row {count})");
    let mut doubts = Vec::new();
    for (column, usual) in &NEEDLE {
        doubts.extend(row.get(column).and_then(|x| usual.doubt(&key(column), x)));
    }
    let depths = row.value("release").and_then(|depths| depths.floats().ok()).unwrap_or(&[]);
    doubts.extend(depths.iter().find_map(|&depth| DEPTH.doubt(&key("release"), depth)));
    let motion = row.value("motion").and_then(|rows| rows.rows().ok()).unwrap_or(&[]);
    let speeds = motion.iter().filter_map(|row| row.get("insert"));
    let fastest = speeds.map(|speed| pace * speed.abs()).fold(0.0, f64::max);
    doubts.extend(SPEED.doubt(&key("motion"), fastest));
    doubts
}
