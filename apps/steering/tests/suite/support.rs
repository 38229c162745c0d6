//! A coarse gel with a needle.

use std::path::PathBuf;
use stylet_steering::builtin::Opened;
use stylet_tissue::history::HistoryRow;
use stylet_tissue::source::Source;
use stylet_tissue::{RunError, Scenario, Simulation};

/// In for 40 mm, held, and out again in 1.6 s.
pub const GEL: &str = r#"
[mesh]
size = [0.08, 0.06, 0.06]
cells = [6, 5, 5]
[support]
sides = "bottom, right"
[friction]
cutting = 0.2
[[needle]]
base = [-0.021, 0.031, 0.029]
direction = [1.0, 0.0, 0.0]
bevel = 0.1
release = [0.02, 0.03]
motion = [
    { t = 0.0, insert = 0.05, spin = 0.0 }, { t = 0.8, insert = 0.05, spin = 4.0 },
    { t = 0.8, insert = 0.0, spin = 0.0 }, { t = 0.9, insert = 0.0 },
    { t = 0.9, insert = -0.07 }, { t = 1.6, insert = -0.07 },
]
[[markers.point]]
name = "a"
at = [0.03, 0.03, 0.06]
[[markers.point]]
name = "b"
at = [0.05, 0.04, 0.02]
"#;

pub fn try_open(text: &str, assignments: &[&str]) -> Result<Opened, RunError> {
    let source = Source { name: "gel".into(), label: "gel.toml".into(), text: text.into(), folder: PathBuf::new() };
    let assignments: Vec<String> = assignments.iter().map(|&a| a.to_owned()).collect();
    stylet_steering::open(&source, &assignments)
}

pub fn open(text: &str) -> Opened {
    try_open(text, &[]).unwrap_or_else(|error| panic!("{error}"))
}

pub fn start(text: &str, threads: usize) -> Box<dyn Simulation> {
    open(text).start(threads).unwrap_or_else(|error| panic!("{error}"))
}

/// Goes on for so many steps, or to the end.
pub fn go_on(run: &mut dyn Simulation, steps: usize) -> Vec<HistoryRow> {
    let mut rows = Vec::new();
    while rows.len() < steps && !run.finished() {
        rows.push(run.step().unwrap_or_else(|error| panic!("{error}")));
    }
    rows
}

/// All numbers of a row but times, as bits.
pub fn bits(row: &HistoryRow) -> (usize, Vec<u64>, u64, u64, Vec<u64>, usize, usize) {
    let numbers = row.quantities.iter().map(|x| x.to_bits()).collect();
    (row.step, numbers, row.iterations, row.cycles, row.counts.clone(), row.nodes, row.elements)
}
