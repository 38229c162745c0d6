//! One row a step: the numbers that every scene has, and those that an application adds.

use crate::stages::{N_STAGES, Stage};
use serde::{Deserialize, Serialize};

/// One row of `history.csv`.
#[derive(Clone, PartialEq, Debug, Default, Deserialize, Serialize)]
pub struct HistoryRow {
    /// Step or cycle, from 1.
    pub step: usize,
    /// Seconds; 0 in quasi-static scenes.
    pub time_s: f64,
    /// The application's numbers, in the order of [`Columns::quantities`].
    pub quantities: Vec<f64>,
    /// Iterations of the solver in this step.
    pub iterations: u64,
    /// Solves of this step; for a needle, cycles at this position of the base, this one included.
    pub cycles: u64,
    /// The application's counts, in the order of [`Columns::counts`].
    pub counts: Vec<u64>,
    /// Mesh vertices.
    pub nodes: usize,
    /// Simplices.
    pub elements: usize,
    /// Seconds of each stage in this step, in the order of [`Stages::names`](crate::stages::Stages::names).
    pub stage_seconds: [f64; N_STAGES],
}

/// What the rows of a scene hold beside the columns of every scene.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Columns {
    /// Names of the application's numbers, such as `depth_m`.
    pub quantities: Vec<&'static str>,
    /// Names of the application's counts.
    pub counts: Vec<&'static str>,
    /// The stages that a step of this scene can run, in their order; those before the first step are in the summary.
    pub stages: Vec<Stage>,
}
