//! What a run of flexible needles comes to in the end.

use super::Run;
use super::history::sticking;
use crate::record::Trace;
use stylet_mesh::{CellId, VertexId, quality};
use stylet_physics::insertion::Needle;
use stylet_tissue::Simulation;
use stylet_tissue::summary::{
    FlexibleNeedle, MarkerError, MarkerSummary, NeedleSummary, Probe, QualitySummary, SolverSummary, SteeringSummary,
    Summary,
};

/// Dihedral angles of cells beside needles that are as they should be, degrees.
const SOUND_DEG: [f64; 2] = [8.0, 165.0];

impl Run {
    /// The summary, with the displacements at the probes.
    pub(super) fn summarise(&self, probes: &[Vec<f64>]) -> Summary {
        let (mesh, totals) = (self.insertion.mesh(), &self.record.totals);
        let quality = quality::summary(mesh);
        let first = &self.insertion.needles()[0];
        Summary {
            schema: 1,
            scene: self.opened.scene.name.clone(),
            converged: self.finished(),
            interrupted: !self.finished(),
            failure: None,
            dofs: 3 * mesh.n_vertices(),
            nodes: mesh.n_vertices(),
            elements: mesh.n_cells(),
            steps: self.steps,
            threads: self.threads,
            wall_s: self.wall,
            update_hz: if self.wall > 0.0 { self.step_seconds.len() as f64 / self.wall } else { 0.0 },
            energy_j: self.strain_energy(),
            solver: SolverSummary {
                iterations_total: totals.iterations,
                iterations_mean: totals.iterations as f64 / totals.trials.max(1) as f64,
                iterations_max: totals.most_iterations,
                relative_residual: if totals.threshold > 0.0 {
                    totals.residual / totals.threshold * self.opened.scene.solver.tolerance
                } else {
                    0.0
                },
                unconverged_solves: 0,
                first_unconverged_cycle: 0,
            },
            needle: Some(NeedleSummary {
                tip: first.shaft.tip().to_vec(),
                tip_reference: self.reference(first).to_vec(),
                base_force: first.base_force.to_vec(),
                base_torque: first.base_moment.to_vec(),
                rearrangements: usize::try_from(totals.trials).unwrap_or(usize::MAX),
                unsettled: usize::try_from(totals.substeps - totals.consistent).unwrap_or(usize::MAX),
                nodes: first.nodes().len(),
                sticking: sticking(first),
            }),
            steering: Some(self.steering_summary()),
            body: None,
            bytes: None,
            probes: probes.iter().map(|at| Probe { at: at.clone(), displacement: self.displacement_at(at) }).collect(),
            quality: QualitySummary {
                min_angle_deg: quality.min_angle_deg,
                max_angle_deg: quality.max_angle_deg,
                min_quality: quality.min_quality,
                inverted_elements: self.inverted(),
            },
            stages: self.stages,
        }
    }

    fn steering_summary(&self) -> SteeringSummary {
        let (record, totals) = (&self.record, &self.record.totals);
        let mut sorted = self.step_seconds.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| sorted.get((share * (sorted.len().max(1) - 1) as f64) as usize).copied();
        let marker = |(marker, closest): (&crate::markers::Tracked, &Option<f64>)| MarkerSummary {
            name: marker.name.clone(),
            at: marker.at,
            place: marker.place,
            closest_tip_m: *closest,
        };
        SteeringSummary {
            time_s: self.time(self.steps),
            needles: self.insertion.needles().iter().zip(&record.traces).map(|(n, t)| self.needle(n, t)).collect(),
            trials_mean: totals.trials as f64 / totals.substeps.max(1) as f64,
            trials_max: totals.most_trials,
            substeps: totals.substeps,
            halvings: totals.halvings,
            consistent_share: totals.consistent as f64 / totals.substeps.max(1) as f64,
            blocked: totals.blocked,
            elements_updated: totals.elements_updated,
            angles_deg: totals.angles_deg,
            step_s: [0.5, 0.99, 1.0].map(|share| quantile(share).unwrap_or(0.0)),
            clearance_m: record.clearance,
            markers: record.markers.iter().zip(&record.closest).map(marker).collect(),
            seeds: record.seed_summaries(),
            notes: self.notes(),
            marker_error: self.marker_error().filter(|error| error.count > 0),
        }
    }

    fn marker_error(&self) -> Option<MarkerError> {
        self.opened.measured.as_ref().map(|measured| measured.error(&self.record.track))
    }

    /// What is hardly meant, and what did not come about although the scene asks for it.
    fn notes(&self) -> Vec<String> {
        let mut notes = self.opened.doubts.clone();
        notes.extend(self.trouble());
        let (last, dt) = (self.time(self.n_steps), self.opened.scene.time.dt);
        if let Some(end) = self.opened.scene.time.end
            && (end - last).abs() > 1e-6 * dt
        {
            notes
                .push(format!("time.end: the run ends at {last} s, as {end} s are no whole number of steps of {dt} s"));
        }
        let edge = self.opened.geometry.mean_edge();
        for (k, (needle, traces)) in self.insertion.needles().iter().zip(&self.record.traces).enumerate() {
            let made = self.needle(needle, traces);
            let touched = traces.iter().any(|trace| trace.reference.is_some());
            notes.extend(entry_note(k + 1, touched, &made, edge));
            let left: Vec<f64> = self.record.seeds.iter().filter(|seed| seed.0 == k).map(|seed| seed.1).collect();
            notes.extend(seed_note(k + 1, &self.opened.releases[k], &left, made.max_depth_m));
        }
        if self.marker_error().is_some_and(|error| error.count == 0) {
            let end = self.time(self.steps);
            notes.push(format!("markers.file has no position within the run, which ended at {end:.4} s"));
        }
        notes
    }

    /// What makes the numbers of a run doubtful.
    fn trouble(&self) -> Vec<String> {
        let (totals, inverted) = (&self.record.totals, self.inverted());
        let mut trouble = Vec::new();
        if inverted > 0 {
            let of = self.insertion.mesh().n_cells();
            trouble
                .push(format!("{inverted} of {of} elements are inside out: what is computed with them is no tissue"));
        }
        if totals.consistent < totals.substeps {
            trouble.push(format!(
                "friction states of {} of {} steps are not consistent; the column inconsistent of history.csv says which",
                totals.substeps - totals.consistent,
                totals.substeps
            ));
        }
        let [least, most] = totals.angles_deg;
        if least < SOUND_DEG[0] || most > SOUND_DEG[1] {
            let [from, to] = SOUND_DEG;
            trouble.push(format!(
                "cells beside needles have angles of {least:.1} to {most:.1} degrees, expected {from} to {to}"
            ));
        }
        trouble
    }

    /// Elements that are inside out.
    fn inverted(&self) -> usize {
        let u = self.displacement();
        let is = |cell: &CellId| !self.insertion.body().jacobian(*cell, u).is_some_and(|j| j > 0.0);
        self.insertion.mesh().cells().filter(is).count()
    }

    fn needle(&self, needle: &Needle, traces: &[Trace]) -> FlexibleNeedle {
        let direction = needle.settings.direction;
        let push = |trace: &Trace| (0..3).map(|k| trace.force[k] * direction[k]).sum::<f64>();
        FlexibleNeedle {
            tip: needle.shaft.tip().to_vec(),
            tip_reference: self.reference(needle).to_vec(),
            depth_m: needle.depth(),
            max_depth_m: traces.iter().map(|trace| trace.depth).fold(0.0, f64::max),
            base_force: needle.base_force.to_vec(),
            base_torque: needle.base_moment.to_vec(),
            max_push_n: traces.iter().map(push).fold(0.0, f64::max),
            nodes: needle.nodes().len(),
            sticking: sticking(needle),
        }
    }

    /// The material point at the tip; where the tip is outside, the tip.
    fn reference(&self, needle: &Needle) -> [f64; 3] {
        let inside = needle.nodes().last().map(|node| self.insertion.mesh().point(VertexId(node.vertex)));
        inside.unwrap_or_else(|| needle.shaft.tip())
    }

    fn displacement_at(&self, at: &[f64]) -> Vec<f64> {
        let mesh = self.insertion.mesh();
        let found = <[f64; 3]>::try_from(at).ok().and_then(|at| mesh.locate(at));
        let Some(inside) = found else { return vec![f64::NAN; 3] };
        let (vertices, u) = (mesh.cell(inside.cell), self.displacement());
        (0..3).map(|k| (0..4).map(|i| inside.barycentric[i] * u[3 * vertices[i].index() + k]).sum()).collect()
    }
}

/// A line about a needle, counted from 1, that has not cut the skin: one that is pushed no deeper than a tenth of an edge (m) has
/// only pressed on it.
fn entry_note(number: usize, touched: bool, needle: &FlexibleNeedle, edge: f64) -> Option<String> {
    if !touched {
        return Some(format!("needle {number} was never in the tissue"));
    }
    let push = needle.max_push_n;
    (needle.max_depth_m < 0.1 * edge && push > 0.0)
        .then(|| format!("needle {number} dented the tissue but never cut it: pushed with {push:.3} N at most"))
}

/// A line about depths (m) at which a needle was to leave seeds, and has not.
fn seed_note(number: usize, asked: &[f64], left: &[f64], deepest: f64) -> Option<String> {
    let missing = asked.iter().filter(|depth| !left.contains(depth));
    let missing: Vec<String> = missing.map(|depth| format!("{:.2}", 1e3 * depth)).collect();
    (!missing.is_empty()).then(|| {
        format!(
            "needle {number} left no seed at {} mm of depth: it came to {:.2} mm at most, and leaves seeds on its way back",
            missing.join(", "),
            1e3 * deepest
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needles_that_did_not_cut_are_noted() {
        let note = |touched, max_depth_m, max_push_n| {
            entry_note(2, touched, &FlexibleNeedle { max_depth_m, max_push_n, ..FlexibleNeedle::default() }, 0.01)
        };
        assert_eq!(note(false, 0.0, 0.0).unwrap(), "needle 2 was never in the tissue");
        let dented = "needle 2 dented the tissue but never cut it: pushed with 1.500 N at most";
        assert_eq!(note(true, 0.9e-3, 1.5).unwrap(), dented);
        assert_eq!((note(true, 1.1e-3, 1.5), note(true, 0.9e-3, 0.0)), (None, None));
    }

    #[test]
    fn seeds_that_were_not_left_are_noted() {
        assert_eq!(seed_note(1, &[0.02, 0.03], &[0.03, 0.02], 0.04), None);
        let note = seed_note(1, &[0.05, 0.02, 0.06], &[0.02], 0.04).unwrap();
        assert!(note.starts_with("needle 1 left no seed at 50.00, 60.00 mm of depth: it came to 40.00 mm"), "{note}");
    }
}
