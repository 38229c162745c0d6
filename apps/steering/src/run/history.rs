//! What a step adds to the history, and the columns of it.

use super::Run;
use crate::builtin::MOST_NEEDLES;
use stylet_physics::coupling::SlipState;
use stylet_physics::insertion::{InsertionReport, InsertionTimes, Needle};
use stylet_tissue::history::{Columns, HistoryRow};
use stylet_tissue::stages::{Stage, Stages};

/// Names of the numbers of one needle.
macro_rules! columns {
    ($prefix:literal) => {
        [
            concat!($prefix, "depth_m"),
            concat!($prefix, "tip_x"),
            concat!($prefix, "tip_y"),
            concat!($prefix, "tip_z"),
            concat!($prefix, "base_force_x"),
            concat!($prefix, "base_force_y"),
            concat!($prefix, "base_force_z"),
            concat!($prefix, "base_torque_x"),
            concat!($prefix, "base_torque_y"),
            concat!($prefix, "base_torque_z"),
        ]
    };
}

const QUANTITIES: [[&str; 10]; MOST_NEEDLES] =
    [columns!(""), columns!("needle2_"), columns!("needle3_"), columns!("needle4_")];

/// The columns of a history of so many needles.
pub(super) fn columns(n_needles: usize) -> Columns {
    Columns {
        quantities: QUANTITIES[..n_needles].concat(),
        counts: vec!["substeps", "inconsistent", "blocked", "needle_nodes", "sticking"],
        stages: vec![Stage::Tissue, Stage::Search, Stage::Needle, Stage::Remesh, Stage::Reparameterise],
    }
}

impl Run {
    /// The row of the last step; `before` are the stages at its start.
    pub(super) fn row(&self, report: &InsertionReport, before: &Stages) -> HistoryRow {
        let needles = self.insertion.needles();
        let mut quantities = Vec::new();
        for needle in needles {
            quantities.push(needle.depth());
            quantities.extend(needle.shaft.tip().iter().chain(&needle.base_force).chain(&needle.base_moment));
        }
        HistoryRow {
            step: self.steps,
            time_s: self.time(self.steps),
            quantities,
            iterations: report.iterations as u64,
            cycles: report.trials as u64,
            counts: vec![
                u64::from(report.substeps),
                u64::from(report.substeps - report.consistent.min(report.substeps)),
                u64::from(report.blocked),
                needles.iter().map(|needle| needle.nodes().len() as u64).sum(),
                needles.iter().map(|needle| sticking(needle) as u64).sum(),
            ],
            nodes: self.insertion.mesh().n_vertices(),
            elements: self.insertion.mesh().n_cells(),
            stage_seconds: self.stages.seconds_since(before),
        }
    }

    /// Adds what a step took to the stages; `before` are the times at its start.
    pub(super) fn add_stages(&mut self, before: &InsertionTimes) {
        let now = self.insertion.times();
        let mut add = |stage, pairs: &[(stylet_physics::dynamics::Spent, stylet_physics::dynamics::Spent)]| {
            let seconds = pairs.iter().map(|(after, before)| after.seconds - before.seconds).sum();
            let calls = pairs.iter().map(|(after, before)| after.calls - before.calls).max().unwrap_or(0);
            self.stages.add(stage, seconds, calls);
        };
        let (tissue, coupled) = (now.tissue, now.coupled);
        add(
            Stage::Tissue,
            &[
                (tissue.forces, before.tissue.forces),
                (tissue.linearize, before.tissue.linearize),
                (tissue.matrix, before.tissue.matrix),
            ],
        );
        add(Stage::Search, &[(coupled.couple, before.coupled.couple), (coupled.search, before.coupled.search)]);
        add(Stage::Needle, &[(coupled.needle, before.coupled.needle), (now.prepare, before.prepare)]);
        add(Stage::Remesh, &[(now.remesh, before.remesh)]);
        add(Stage::Reparameterise, &[(now.reparameterise, before.reparameterise)]);
    }
}

/// Nodes that stick.
pub(super) fn sticking(needle: &Needle) -> usize {
    needle.nodes().iter().filter(|node| node.state == SlipState::Static).count()
}
