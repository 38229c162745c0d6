//! What a run of flexible needles comes to in the end.

use super::Run;
use super::history::sticking;
use crate::record::Trace;
use stylet_mesh::{VertexId, quality};
use stylet_physics::insertion::Needle;
use stylet_tissue::Simulation;
use stylet_tissue::summary::{
    FlexibleNeedle, MarkerSummary, NeedleSummary, Probe, QualitySummary, SolverSummary, SteeringSummary, Summary,
};

impl Run {
    /// The summary, with the displacements at the probes.
    pub(super) fn summarise(&self, probes: &[Vec<f64>]) -> Summary {
        let (mesh, u, totals) = (self.insertion.mesh(), &self.insertion.state().u, &self.record.totals);
        let quality = quality::summary(mesh);
        let inverted = |cell: &_| !self.insertion.body().jacobian(*cell, u).is_some_and(|j| j > 0.0);
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
                inverted_elements: mesh.cells().filter(inverted).count(),
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
            trials_mean: totals.trials as f64 / totals.steps.max(1) as f64,
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
            marker_error: self.opened.measured.as_ref().map(|measured| measured.error(&record.track)),
        }
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
