//! `stylet mesh quality`.

use super::args::{ColourArg, QualityArgs};
use super::source::{AnyMesh, Job, Loaded, Soup};
use super::{files, picture};
use crate::exit::{Exit, Failure};
use crate::facts::{Facts, count, print_json};
use serde_json::json;
use stylet_mesh::Rule;
use stylet_mesh::check::{CheckSettings, Repair, RepairSettings, Report, check, repair};
use stylet_mesh::quality::{Histogram, Measure, MeasureReport, QualityReport, Side, normalized_volume, report_of};

/// Faults of one kind that are listed for people; JSON has them all.
const MOST_LINES: usize = 10;
/// Characters of the longest bar.
const BAR: usize = 44;

/// Measures a mesh, and looks for faults.
///
/// # Errors
/// Bad input, files that cannot be written.
pub fn execute(args: &QualityArgs) -> Result<Exit, Failure> {
    AnyMesh::open("MESH", &args.mesh, Rule::default())?.give(Look(args))
}

struct Look<'a>(&'a QualityArgs);

impl Job for Look<'_> {
    fn run<const D: usize, const N: usize>(self, mesh: Loaded<D, N>) -> Result<Exit, Failure> {
        let args = self.0;
        files::check_plot::<D>(args.plot.as_deref())?;
        files::check_out::<D>("--repair", args.repair.as_deref())?;
        let mut notes = mesh.left_out();
        let soup = mesh.soup();
        let faults = check(&soup.points, &soup.cells, &CheckSettings::default());
        let solid = measurable(&soup);
        let corners = |cell: u32| soup.cells[cell as usize].map(|v| soup.points[v as usize]);
        let quality = report_of(solid.iter().map(|&cell| (cell, corners(cell))));
        let repairs =
            args.repair.as_deref().map(|path| write_repaired(&soup, args.merge, path, &mut notes)).transpose()?;
        if let Some(path) = &args.plot {
            let mut values = vec![f64::NAN; soup.cells.len()];
            solid.iter().for_each(|&cell| values[cell as usize] = normalized_volume(&corners(cell)));
            let by_region = args.colour == ColourArg::Region;
            let look = picture::Look { by_region, ..picture::Look::default() };
            picture::draw_quality(&soup, &values, look, &quality, &mesh.name, path)?;
        }
        if args.output.json {
            print_json(&json!({
                "schema": 1, "mesh": mesh.name, "dimension": D, "vertices_per_cell": N,
                "vertices": soup.points.len(), "cells": soup.cells.len(), "parts": faults.n_parts,
                "is_mesh": faults.is_mesh(), "findings": faults.findings, "hanging_searched": faults.hanging_searched,
                "quality": quality, "repairs": repairs, "notes": notes,
            }))?;
        } else {
            let mut facts = Facts::new(&mesh.name);
            tell(&mut facts, &soup, &quality, &faults);
            if let Some(repairs) = &repairs {
                tell_repairs(&mut facts, repairs);
            }
            let files: Vec<_> = [&args.repair, &args.plot].into_iter().flatten().collect();
            if !(files.is_empty() && notes.is_empty()) {
                facts.line("");
            }
            notes.iter().for_each(|note| facts.add("left out", note));
            for path in files {
                facts.add("wrote", path.display());
            }
            facts.print()?;
        }
        Ok(Exit::Done)
    }
}

/// Cells whose vertices exist.
fn measurable<const D: usize, const N: usize>(soup: &Soup<D, N>) -> Vec<u32> {
    let exists = |cell: &u32| soup.cells[*cell as usize].iter().all(|&v| (v as usize) < soup.points.len());
    (0..soup.cells.len() as u32).filter(exists).collect()
}

/// Repairs the mesh and writes it.
fn write_repaired<const D: usize, const N: usize>(
    soup: &Soup<D, N>,
    merge: Option<f64>,
    path: &std::path::Path,
    notes: &mut Vec<String>,
) -> Result<Vec<Repair>, Failure> {
    let repaired = repair(&soup.points, &soup.cells, &RepairSettings { merge });
    if repaired.cells.is_empty() {
        return Err(Failure::bad_input("--repair: found no cell that is sound, expected some; nothing was written"));
    }
    let regions = repaired.of_cells(&soup.regions);
    let sound = Soup { points: repaired.points, cells: repaired.cells, regions };
    notes.extend(files::write_soup("--repair", sound, path)?);
    Ok(repaired.repairs)
}

fn tell<const D: usize, const N: usize>(
    facts: &mut Facts,
    soup: &Soup<D, N>,
    quality: &QualityReport,
    faults: &Report,
) {
    let cells = match N {
        3 => "triangles",
        4 => "tetrahedra",
        _ => "simplices",
    };
    let parts = count(faults.n_parts, "part", "parts");
    facts.add("cells", format!("{} {cells} in {D} dimensions, {parts}", soup.cells.len()));
    facts.add("vertices", soup.points.len());
    facts.add(if N == 3 { "area" } else { "volume" }, short(quality.volume));
    facts.add("edges", format!("{} to {}", short(quality.shortest_edge), short(quality.longest_edge)));
    facts.line("");
    facts.line(&row(["", "min", "1 %", "median", "mean", "99 %", "max"].map(str::to_owned), "beyond limits"));
    quality.measures.iter().for_each(|measure| facts.line(&measure_row::<N>(measure)));
    if let Some(angles) = quality.measure(Measure::Angle) {
        facts.line("");
        facts.line(&format!("  {}", angles.measure.name(N)));
        bars(&angles.histogram).iter().for_each(|line| facts.line(line));
    }
    facts.line("");
    tell_faults(facts, faults);
}

fn measure_row<const N: usize>(report: &MeasureReport) -> String {
    let p = &report.percentiles;
    let numbers = [report.min, p.p1, p.p50, report.mean, p.p99, report.max].map(short);
    let beyond = report.beyond.iter().filter(|beyond| beyond.count > 0).map(|beyond| {
        let side = if beyond.side == Side::Below { "<=" } else { ">=" };
        format!("{} {side} {}", beyond.count, beyond.limit)
    });
    let mut name_and_numbers = vec![report.measure.name(N).to_owned()];
    name_and_numbers.extend(numbers);
    let columns: [String; 7] = std::array::from_fn(|k| name_and_numbers[k].clone());
    row(columns, &beyond.collect::<Vec<_>>().join(", "))
}

fn row([name, numbers @ ..]: [String; 7], last: &str) -> String {
    let numbers: String = numbers.iter().map(|number| format!(" {number:>9}")).collect();
    format!("  {name:<21}{numbers}  {last}").trim_end().to_owned()
}

/// A bar for each bin from the first to the last that is not empty.
fn bars(histogram: &Histogram) -> Vec<String> {
    let filled: Vec<usize> = (0..histogram.counts.len()).filter(|&k| histogram.counts[k] > 0).collect();
    let (Some(&first), Some(&last)) = (filled.first(), filled.last()) else { return Vec::new() };
    let tallest = histogram.tallest();
    let bar = |k: usize| {
        let (low, high) = histogram.bin(k);
        let count = histogram.counts[k];
        // What is not empty shows.
        let length = (count * BAR).div_ceil(tallest);
        format!("  {low:>5} to {high:>5} {:<BAR$} {count}", "#".repeat(length)).trim_end().to_owned()
    };
    (first..=last).map(bar).collect()
}

fn tell_faults(facts: &mut Facts, faults: &Report) {
    if faults.is_clean() {
        facts.line("  No faults.");
    }
    for group in faults.findings.chunk_by(|a, b| a.kind() == b.kind()) {
        for finding in group.iter().take(MOST_LINES) {
            facts.add(finding.kind(), finding);
        }
        if group.len() > MOST_LINES {
            facts.add(group[0].kind(), format!("and {} more; --json names all", group.len() - MOST_LINES));
        }
    }
    if !faults.hanging_searched {
        facts.line("  Hanging vertices were not all looked for: too many facets of the boundary overlap.");
    }
    if !faults.is_mesh() {
        facts.line("  Not a mesh that can be refined.");
    }
}

fn tell_repairs(facts: &mut Facts, repairs: &[Repair]) {
    facts.line("");
    if repairs.is_empty() {
        facts.line("  Nothing to repair.");
    }
    repairs.iter().take(4 * MOST_LINES).for_each(|repair| facts.add("repaired", repair));
    if repairs.len() > 4 * MOST_LINES {
        facts.add("repaired", format!("and {} more; --json names all", repairs.len() - 4 * MOST_LINES));
    }
}

/// Four digits, and an exponent only where the number is long without.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    match x.abs() {
        a if !(1e-3..1e6).contains(&a) => format!("{x:.3e}"),
        a => {
            let digits = (3 - a.log10().floor() as i32).max(0) as usize;
            let text = format!("{x:.digits$}");
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let shown = [0.0, 45.0, 1.732_050_8, 123_456.7, 0.012_345_6, 1e-9, -2.5e8, f64::INFINITY, f64::NAN].map(short);
        assert_eq!(shown, ["0", "45", "1.732", "123457", "0.01235", "1.000e-9", "-2.500e8", "inf", "NaN"]);
    }

    #[test]
    fn bars_show_whatever_is_not_empty() {
        let mut histogram = Histogram::new(0.0, 40.0, 4);
        histogram.counts = vec![0, 1, 0, 1000];
        let lines = bars(&histogram);
        assert_eq!(lines.len(), 3);
        assert!(lines[0].starts_with("     10 to    20 # ") && lines[0].ends_with(" 1"), "{}", lines[0]);
        assert!(lines[1].ends_with(" 0") && !lines[1].contains('#'));
        assert_eq!(lines[2].matches('#').count(), BAR);
        assert!(bars(&Histogram::new(0.0, 1.0, 3)).is_empty());
    }
}
