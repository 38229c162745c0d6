//! What a step did, and what it took.

use crate::coupling::{CoupledReport, CoupledTimes};
use crate::dynamics::{Spent, StageTimes};

/// What a step did, all its parts together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InsertionReport {
    /// Parts that it was made of.
    pub substeps: u32,
    /// How often a part was given up and halved.
    pub halvings: u32,
    /// Sets of friction states that were tried.
    pub trials: usize,
    /// Most sets of a part.
    pub most_trials: usize,
    /// Iterations of conjugate gradients.
    pub iterations: usize,
    /// Those of condensed systems among them.
    pub condensed_iterations: usize,
    /// Iterations of solves with the states that were found, if they are
    /// [counted](crate::coupling::SearchSettings::count_known).
    pub known_iterations: usize,
    /// Fewest and most iterations of one linear solve.
    pub fewest_iterations: usize,
    /// Most iterations of one linear solve.
    pub most_iterations: usize,
    /// Parts whose friction states satisfy all conditions.
    pub consistent: u32,
    /// Element stiffnesses that were evaluated.
    pub elements_updated: u64,
    /// Tips that the mesh could not follow; they stay behind until the next step.
    pub blocked: u32,
    /// Residual of the last solve, N.
    pub residual: f64,
    /// What it was compared with, N.
    pub threshold: f64,
}

impl InsertionReport {
    pub(super) fn add(&mut self, part: &CoupledReport) {
        self.trials += part.search.trials;
        self.most_trials = self.most_trials.max(part.search.trials);
        self.iterations += part.search.iterations;
        self.condensed_iterations += part.search.condensed_iterations;
        self.known_iterations += part.search.known_iterations;
        let fewest = part.search.fewest_iterations;
        self.fewest_iterations = if self.substeps == 0 { fewest } else { self.fewest_iterations.min(fewest) };
        self.most_iterations = self.most_iterations.max(part.search.most_iterations);
        self.consistent += u32::from(part.search.consistent);
        self.elements_updated += part.elements_updated;
        (self.residual, self.threshold) = (part.residual, part.threshold);
    }
}

/// What all steps took, by stage; stages do not overlap.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InsertionTimes {
    /// Forces and stiffness of the tissue, and its matrix.
    pub tissue: StageTimes,
    /// Needle forces, the coupled block, states and solutions.
    pub coupled: CoupledTimes,
    /// Limits of the friction, and copies of the needles that a step moves.
    pub prepare: Spent,
    /// The mesh follows the tips.
    pub remesh: Spent,
    /// Needles are read anew at the nodes that they have.
    pub reparameterise: Spent,
}
