//! `stylet mesh convert`.

use super::args::ConvertArgs;
use super::files;
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, print_json};
use serde_json::json;
use stylet_mesh::io::MeshData;

/// Reads a mesh in one format and writes it in another.
///
/// # Errors
/// Files that cannot be read or written.
pub fn execute(args: &ConvertArgs) -> Result<Exit, Failure> {
    let format = files::format_of("OUT", &args.to, args.format.as_deref())?;
    let (data, mut notes) = files::read(&args.from)?;
    notes.extend(files::write_data(&data, &args.to, format)?);
    let cells = cells(&data);
    if args.output.json {
        let cells: serde_json::Map<String, serde_json::Value> =
            cells.iter().map(|(name, n)| (name.to_string(), json!(n))).collect();
        print_json(&json!({
            "schema": 1, "from": args.from.display().to_string(), "to": args.to.display().to_string(),
            "format": format.name(), "dimension": data.dimension, "vertices": data.points.len(), "cells": cells,
            "point_fields": data.point_fields.len(), "cell_fields": data.cell_fields.len(), "left_out": notes,
        }))?;
    } else {
        let mut facts = Facts::new(&format!("{} to {}, {format}", args.from.display(), args.to.display()));
        facts.add("vertices", format!("{} in {} dimensions", data.points.len(), data.dimension));
        cells.iter().for_each(|(name, n)| facts.add(name, n));
        let names = data.point_fields.iter().chain(&data.cell_fields).map(|field| field.name.as_str());
        let names: Vec<&str> = names.collect();
        if !names.is_empty() {
            facts.add("fields", names.join(", "));
        }
        notes.iter().for_each(|note| facts.add("left out", note));
        facts.print()?;
    }
    Ok(Exit::Done)
}

/// How many cells there are of each kind.
fn cells(data: &MeshData) -> Vec<(&'static str, usize)> {
    let of = |n: usize| data.blocks.iter().filter(|b| b.vertices_per_cell == n).map(|b| b.n_cells()).sum();
    let kinds = [("points", 1), ("segments", 2), ("triangles", 3), ("tetrahedra", 4)];
    kinds.iter().map(|&(name, n)| (name, of(n))).filter(|(_, count)| *count > 0).collect()
}
