//! Where the time of a run goes: seconds and calls of each stage. A stage that never ran is not listed.

use serde::ser::{Serialize, SerializeMap, Serializer};
use std::time::Instant;

/// The stages of all scenes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(usize)]
pub enum Stage {
    /// Making or reading the starting mesh.
    Mesh,
    /// Building and patching the body: element gradients and, for a linear material, its stiffness.
    Assemble,
    /// Masses of the nodes.
    Mass,
    /// Finding the nodes that constraints pick.
    Constrain,
    /// Loads: from a line density, gravity, tractions.
    Load,
    /// Moving the base and the nodes that stick to it.
    Move,
    /// Following the tip through the mesh.
    Locate,
    /// Refinement around the tip, with the fields carried over.
    Refine,
    /// Taking nodes onto the needle.
    Capture,
    /// Moving needle nodes onto the needle in the mesh; within the capture of an insertion.
    Relocate,
    /// Finding the equilibrium.
    Solve,
    /// Within the solve: evaluating the elastic forces of a nonlinear material.
    Force,
    /// Within the solve: evaluating the tangent stiffness of a nonlinear material.
    Linearize,
    /// Judging and changing friction states.
    Rearrange,
    /// Letting go of nodes ahead of the tip.
    Release,
    /// Finding out what keeps a solve from an equilibrium.
    Diagnose,
    /// Forces, stiffness and matrix of the tissue around a flexible needle.
    Tissue,
    /// Friction states along a flexible needle, and the solution of the coupled system.
    Search,
    /// Forces and matrix of flexible needles, and the limits of friction.
    Needle,
    /// The mesh follows the tip.
    Remesh,
    /// A flexible needle is read anew at the nodes that it has.
    Reparameterise,
}

/// Number of stages.
pub const N_STAGES: usize = 21;

const NAMES: [&str; N_STAGES] = [
    "mesh",
    "assemble",
    "mass",
    "constrain",
    "load",
    "move",
    "locate",
    "refine",
    "capture",
    "relocate",
    "solve",
    "force",
    "linearize",
    "rearrange",
    "release",
    "diagnose",
    "tissue",
    "search",
    "needle",
    "remesh",
    "reparameterise",
];

/// The name of a stage that stands within another one, whose seconds it shares.
pub const WITHIN_SOLVE: [&str; 2] = ["force", "linearize"];

/// Seconds and calls of each stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stages {
    seconds: [f64; N_STAGES],
    calls: [u64; N_STAGES],
    /// Seconds of what came before the run's own time began.
    before: [f64; N_STAGES],
}

impl Stages {
    /// The names of all stages, in order.
    pub fn names() -> &'static [&'static str] {
        &NAMES
    }

    /// Adds one call that began at `since`, and returns the present.
    #[inline]
    pub fn lap(&mut self, stage: Stage, since: Instant) -> Instant {
        let now = Instant::now();
        self.add(stage, (now - since).as_secs_f64(), 1);
        now
    }

    /// Adds to the call that a [`lap`](Self::lap) of this cycle has counted already, and returns the present.
    #[inline]
    pub fn lap_on(&mut self, stage: Stage, since: Instant) -> Instant {
        let now = Instant::now();
        self.add(stage, (now - since).as_secs_f64(), 0);
        now
    }

    /// Adds seconds and calls.
    #[inline]
    pub fn add(&mut self, stage: Stage, seconds: f64, calls: u64) {
        self.seconds[stage as usize] += seconds;
        self.calls[stage as usize] += calls;
    }

    /// Ends the preparation: what was added so far is no part of the wall time of the steps.
    pub fn begin_steps(&mut self) {
        self.before = self.seconds;
    }

    /// The stages that ran while the run was prepared: name and seconds, which [`iter`](Self::iter) has as well.
    pub fn before_steps(&self) -> impl Iterator<Item = (&'static str, f64)> + '_ {
        (0..NAMES.len()).filter(|&k| self.before[k] > 0.0).map(|k| (NAMES[k], self.before[k]))
    }

    /// Seconds of every stage since an earlier reading, in the order of [`Stages::names`].
    pub fn seconds_since(&self, before: &Self) -> [f64; N_STAGES] {
        std::array::from_fn(|k| self.seconds[k] - before.seconds[k])
    }

    /// The stages that ran: name, seconds, calls.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, f64, u64)> + '_ {
        (0..NAMES.len()).filter(|&k| self.calls[k] > 0).map(|k| (NAMES[k], self.seconds[k], self.calls[k]))
    }
}

impl Serialize for Stages {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for (name, seconds, calls) in self.iter() {
            map.serialize_entry(name, &serde_json::json!({ "seconds": seconds, "calls": calls }))?;
        }
        map.end()
    }
}
