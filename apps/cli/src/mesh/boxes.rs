//! `stylet mesh box`.

use super::args::BoxArgs;
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, print_json};
use crate::probe::numbers;
use serde_json::json;
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{MeshError, SimplexMesh, quality};

/// Makes a box and writes it.
///
/// # Errors
/// Arguments that make no box, files that cannot be written.
pub fn execute(args: &BoxArgs) -> Result<Exit, Failure> {
    let lower = numbers(&args.lower).map_err(|found| refuse("--lower", &found, "2 or 3 numbers"))?;
    match lower.len() {
        2 => made::<2, 3>(args, &lower, kuhn_box),
        3 => made::<3, 4>(args, &lower, kuhn_box),
        n => Err(refuse("--lower", &format!("{n} in {}", args.lower), "2 or 3 numbers")),
    }
}

fn made<const D: usize, const N: usize>(
    args: &BoxArgs,
    lower: &[f64],
    kuhn_box: impl Fn([f64; D], [f64; D], [usize; D]) -> Result<SimplexMesh<D, N>, MeshError>,
) -> Result<Exit, Failure> {
    files::check_out::<D>("--out", args.out.as_deref())?;
    files::check_plot::<D>(args.plot.as_deref())?;
    let expected = format!("{D} numbers, as many as in --lower");
    let upper = numbers(&args.upper).map_err(|found| refuse("--upper", &found, &expected))?;
    let upper: [f64; D] = upper.try_into().map_err(|_| refuse("--upper", &args.upper, &expected))?;
    let lower: [f64; D] = std::array::from_fn(|k| lower[k]);
    let expected = format!("{D} whole numbers, at least 1, as many as in --lower");
    let cells: Option<Vec<usize>> = args.cells.split(',').map(|n| n.trim().parse().ok().filter(|n| *n > 0)).collect();
    let cells: Option<[usize; D]> = cells.and_then(|cells| cells.try_into().ok());
    let cells = cells.ok_or_else(|| refuse("--cells", &args.cells, &expected))?;
    let mesh = kuhn_box(lower, upper, cells).map_err(|error| {
        let argument = if matches!(error, MeshError::TooManyCells { .. }) { "--cells" } else { "--upper" };
        Failure::bad_input(format!("{argument}: {error}"))
    })?;

    let notes = args.out.as_deref().map_or(Ok(Vec::new()), |path| files::write("--out", &mesh, &[], path))?;
    if let Some(path) = &args.plot {
        picture::draw_refined(&mesh, &super::feature::Feature::Everywhere, "box", path)?;
    }
    let angles = quality::summary(&mesh);
    if args.output.json {
        print_json(&json!({
            "schema": 1, "dimension": D, "lower": lower.to_vec(), "upper": upper.to_vec(), "parts": cells.to_vec(),
            "cells": mesh.n_cells(), "vertices": mesh.n_vertices(), "volume": mesh.total_volume(),
            "min_angle_deg": angles.min_angle_deg, "max_angle_deg": angles.max_angle_deg, "notes": notes,
        }))?;
    } else {
        let mut facts = Facts::new("box");
        facts.add("cells", format!("{} {}", mesh.n_cells(), if N == 3 { "triangles" } else { "tetrahedra" }));
        facts.add("vertices", mesh.n_vertices());
        facts.add(if N == 3 { "area" } else { "volume" }, super::quality::short(mesh.total_volume()));
        facts.add("angles", format!("{:.4} to {:.4} degrees", angles.min_angle_deg, angles.max_angle_deg));
        notes.iter().for_each(|note| facts.add("left out", note));
        for path in [&args.out, &args.plot].into_iter().flatten() {
            facts.add("wrote", path.display());
        }
        facts.print()?;
    }
    Ok(Exit::Done)
}

fn refuse(argument: &str, found: &str, expected: &str) -> Failure {
    let found = if found.is_empty() { "nothing" } else { found };
    Failure::bad_input(format!("{argument}: found {found}, expected {expected}"))
}
