//! A needle driven along a path into a mesh and out again, with what that did to the mesh.

use super::{Motion, NeedleId, Operations, RemeshError, Remesher, StepReport};
use crate::{
    MeshChange, SimplexMesh, VertexId,
    geometry::{combine, distance2},
    quality,
};
use serde::{Deserialize, Serialize};
use std::time::Instant;

/// How to drive.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CycleSettings {
    /// Distance between successive positions of the tip, positive.
    pub step: f64,
    /// Whether to measure the angles of the whole mesh after each step, which takes longer than the step.
    pub measure_angles: bool,
    /// The angles count towards the extremes of the report where the tip is at least so many steps along the path, on
    /// its way in and on its way out: a tip that has just passed the skin cannot but make flat cells.
    pub shallow_steps: usize,
}

/// One step of a cycle.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CycleStep {
    /// Counted from zero, on the way in and out.
    pub step: usize,
    /// Which way.
    pub motion: Motion,
    /// Number of steps between the first point of the path and the tip.
    pub depth: usize,
    /// What the remesher did.
    pub report: StepReport,
    /// Extreme angles of the whole mesh after the step, degrees; 180 and 0 if they are not measured.
    pub min_angle_deg: f64,
    /// The largest.
    pub max_angle_deg: f64,
    /// Time in the remesher.
    pub seconds: f64,
}

/// What a cycle did.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct CycleReport {
    /// Steps in and out.
    pub steps: usize,
    /// Substeps that they were divided into.
    pub substeps: usize,
    /// What was done.
    pub operations: Operations,
    /// Smallest angle of the mesh after any step that is not shallow, degrees; 180 if there was none.
    pub min_angle_deg: f64,
    /// Largest angle.
    pub max_angle_deg: f64,
    /// Most nodes that the needle had.
    pub most_nodes: usize,
    /// Whether the live cells are the same as before, by identifier and by vertices in their order.
    pub topology_restored: bool,
    /// The farthest that a vertex ended from where it had been.
    pub max_position_error: f64,
    /// Time in the remesher.
    pub seconds: f64,
}

/// Drives a needle along the polyline `path`, which begins outside the mesh, to its end and back the same way, in steps
/// of equal length (the last one inwards may be shorter); calls `observe` with the mesh after each step.
///
/// # Errors
/// [`RemeshError`] from a step; [`RemeshError::Tip`] also for a step that is not positive and finite. The needle is then
/// left where it is.
pub fn drive<const D: usize, const N: usize>(
    mesh: &mut SimplexMesh<D, N>,
    remesher: &mut Remesher<D, N>,
    path: &[[f64; D]],
    settings: &CycleSettings,
    mut observe: impl FnMut(&CycleStep, &SimplexMesh<D, N>, &Remesher<D, N>, NeedleId, &MeshChange),
) -> Result<CycleReport, RemeshError> {
    let tips = tips(path, settings.step)?;
    let Some(&first) = tips.first() else {
        return Err(RemeshError::Tip { axis: 0, value: f64::NAN, limit: 0.0 });
    };
    let before = Fingerprint::of(mesh);
    let untouched = quality::summary(mesh);
    let needle = remesher.add_needle(mesh, first)?;
    let mut report = CycleReport {
        steps: 0,
        substeps: 0,
        operations: Operations::default(),
        min_angle_deg: 180.0,
        max_angle_deg: 0.0,
        most_nodes: 0,
        topology_restored: false,
        max_position_error: f64::INFINITY,
        seconds: 0.0,
    };
    let mut change = MeshChange::default();
    let inwards = (1..tips.len()).map(|depth| (depth, Motion::Penetrating));
    let outwards = (0..tips.len().saturating_sub(1)).rev().map(|depth| (depth, Motion::Retracting));
    for (depth, motion) in inwards.chain(outwards) {
        change.clear();
        let start = Instant::now();
        let done = remesher.advance(mesh, needle, tips[depth], motion, &mut change)?;
        let seconds = start.elapsed().as_secs_f64();
        let (mut min, mut max) = (180.0, 0.0);
        if settings.measure_angles {
            let (a, b) = remesher.angles_deg(mesh);
            (min, max) = (a.min(untouched.min_angle_deg), b.max(untouched.max_angle_deg));
        }
        if settings.measure_angles && depth >= settings.shallow_steps {
            report.min_angle_deg = report.min_angle_deg.min(min);
            report.max_angle_deg = report.max_angle_deg.max(max);
        }
        let step = CycleStep {
            step: report.steps,
            motion,
            depth,
            report: done,
            min_angle_deg: min,
            max_angle_deg: max,
            seconds,
        };
        report.steps += 1;
        report.substeps += done.substeps as usize;
        report.operations.add(&done.operations);
        report.most_nodes = report.most_nodes.max(remesher.nodes(needle).len());
        report.seconds += seconds;
        observe(&step, mesh, remesher, needle, &change);
    }
    let after = Fingerprint::of(mesh);
    report.topology_restored = before.cells == after.cells;
    report.max_position_error = before.farthest(&after);
    Ok(report)
}

/// The positions of the tip: equidistant along a polyline, and its end.
fn tips<const D: usize>(path: &[[f64; D]], step: f64) -> Result<Vec<[f64; D]>, RemeshError> {
    const MOST: f64 = 1e7;
    let length = |a: &[f64; D], b: &[f64; D]| distance2(a, b).sqrt();
    path.iter().try_for_each(super::check_tip)?;
    let total: f64 = path.windows(2).map(|ab| length(&ab[0], &ab[1])).sum();
    if !(step > 0.0 && step.is_finite() && total / step < MOST) {
        return Err(RemeshError::Tip { axis: 0, value: step, limit: total });
    }
    let mut tips: Vec<[f64; D]> = path.first().copied().into_iter().collect();
    let mut left = step;
    for ab in path.windows(2) {
        let long = length(&ab[0], &ab[1]);
        let mut at = left;
        while at < long {
            let t = at / long;
            tips.push(combine(&[ab[0], ab[1]], &[1.0 - t, t]));
            at += step;
        }
        left = at - long;
    }
    if let Some(&end) = path.last()
        && tips.last().is_some_and(|tip| length(tip, &end) > 1e-6 * step)
    {
        tips.push(end);
    }
    Ok(tips)
}

/// The live cells with their identifiers, and the positions of their vertices.
struct Fingerprint<const D: usize, const N: usize> {
    cells: Vec<(u32, [VertexId; N])>,
    points: Vec<[f64; D]>,
}

impl<const D: usize, const N: usize> Fingerprint<D, N> {
    fn of(mesh: &SimplexMesh<D, N>) -> Self {
        let cells = mesh.cells().map(|c| (c.0, mesh.cell(c))).collect();
        Self { cells, points: mesh.points().to_vec() }
    }

    fn farthest(&self, other: &Self) -> f64 {
        let pairs = self.points.iter().zip(&other.points);
        pairs.map(|(p, q)| distance2(p, q).sqrt()).fold(0.0, f64::max)
    }
}
