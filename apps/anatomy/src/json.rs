//! Contours as JSON.
//!
//! ```json
//! {
//!   "format": "stylet-contours",
//!   "version": 1,
//!   "unit": "mm",
//!   "organs": [
//!     {
//!       "name": "prostate",
//!       "contours": [
//!         {"z": -15.0, "points": [[-8.145, 3.077], [0.181, -9.05], [9.05, 2.896]]},
//!         {"z": -10.0, "points": [[-12.0, 4.0], [0.0, -13.5], [12.2, 4.1]]}
//!       ]
//!     }
//!   ]
//! }
//! ```
//!
//! | key | what it is |
//! |---|---|
//! | `format`, `version` | these values |
//! | `unit` | of all lengths: `mm` or `m` |
//! | `organs` | in order of precedence: where two overlap, the place belongs to the first |
//! | `name` | the organ's; each once |
//! | `contours` | in any order; several at one `z` are branches, or holes by even-odd |
//! | `z` | the plane |
//! | `points` | `[x, y]` in order, closed; the first may be repeated as the last |
//! | `open` | optional: `true` says that the contour is not closed, which the check refuses |
//!
//! Other keys are errors.

use crate::{
    error::{Problem, WriteError},
    length::{from_mm, to_mm},
    study::Study,
};
use serde::{Deserialize, Serialize};
use stylet_mesh::generate::contours::{Drawing, PlanarContour};

const FORMAT: &str = "stylet-contours";

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: String,
    version: u64,
    unit: Unit,
    organs: Vec<Organ>,
}

#[derive(Clone, Copy, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
enum Unit {
    Mm,
    M,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Organ {
    name: String,
    contours: Vec<Contour>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct Contour {
    z: f64,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    open: bool,
    points: Vec<[f64; 2]>,
}

/// The organs of a JSON file.
///
/// # Errors
/// [`Problem`] with line and column where the file leaves the schema.
pub fn read(bytes: &[u8]) -> Result<Study, Problem> {
    let file: File = serde_json::from_slice(bytes).map_err(|error| Problem::Json(error.to_string()))?;
    if file.format != FORMAT {
        return Err(Problem::Schema { key: "format", found: file.format, expected: FORMAT });
    }
    if file.version != 1 {
        return Err(Problem::Schema { key: "version", found: file.version.to_string(), expected: "1" });
    }
    let metres = |x: f64| match file.unit {
        Unit::Mm => from_mm(x),
        Unit::M => x,
    };
    let contour = |c: Contour| PlanarContour {
        points: c.points.iter().map(|p| [metres(p[0]), metres(p[1]), metres(c.z)]).collect(),
        open: c.open,
    };
    let drawing = |o: Organ| Drawing { name: o.name, contours: o.contours.into_iter().map(contour).collect() };
    Ok(Study { drawings: file.organs.into_iter().map(drawing).collect(), notes: Vec::new() })
}

/// The organs as JSON, in millimetres, a contour a line.
///
/// # Errors
/// [`WriteError`] for coordinates that are not finite, and contours that are not plane.
pub fn write(drawings: &[Drawing]) -> Result<Vec<u8>, WriteError> {
    let mut text = format!("{{\n\"format\": \"{FORMAT}\",\n\"version\": 1,\n\"unit\": \"mm\",\n\"organs\": [");
    for (i, drawing) in drawings.iter().enumerate() {
        let name = serde_json::Value::from(drawing.name.as_str());
        text += &format!("{}\n{{\"name\": {name}, \"contours\": [", if i > 0 { "," } else { "" });
        for (k, contour) in drawing.contours.iter().enumerate() {
            let line = serde_json::to_string(&written(&drawing.name, k, contour)?);
            text += if k > 0 { ",\n" } else { "\n" };
            text += &line.expect("finite numbers have a JSON form");
        }
        text += "\n]}";
    }
    text += "\n]\n}\n";
    Ok(text.into_bytes())
}

fn written(name: &str, contour: usize, drawn: &PlanarContour) -> Result<Contour, WriteError> {
    if !drawn.points.iter().flatten().all(|x| to_mm(*x).is_finite()) {
        return Err(WriteError::Coordinate { name: name.into(), contour });
    }
    let z = drawn.points.first().map_or(0.0, |p| to_mm(p[2]));
    if drawn.points.iter().any(|p| to_mm(p[2]) != z) {
        return Err(WriteError::NotPlanar { name: name.into(), contour });
    }
    let points = drawn.points.iter().map(|p| [to_mm(p[0]), to_mm(p[1])]).collect();
    Ok(Contour { z, open: drawn.open, points })
}
