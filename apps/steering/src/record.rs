//! What a run remembers of its steps: sums for the summary, and what its pictures show.

use crate::geometry::Geometry;
use crate::markers::Tracked;
use serde::{Deserialize, Serialize};
use stylet_mesh::{SimplexMesh, VertexId};
use stylet_physics::coupling::SlipState;
use stylet_physics::insertion::{Insertion, InsertionReport, Needle};
use stylet_physics::material::Solid;
use stylet_tissue::summary::SeedSummary;

/// Sums and extremes over all steps.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Totals {
    pub steps: u64,
    pub trials: u64,
    pub most_trials: u64,
    pub iterations: u64,
    pub most_iterations: u64,
    pub substeps: u64,
    pub halvings: u64,
    pub consistent: u64,
    pub blocked: u64,
    pub elements_updated: u64,
    pub angles_deg: [f64; 2],
    pub residual: f64,
    pub threshold: f64,
}

impl Default for Totals {
    fn default() -> Self {
        Self {
            steps: 0,
            trials: 0,
            most_trials: 0,
            iterations: 0,
            most_iterations: 0,
            substeps: 0,
            halvings: 0,
            consistent: 0,
            blocked: 0,
            elements_updated: 0,
            angles_deg: [180.0, 0.0],
            residual: 0.0,
            threshold: 0.0,
        }
    }
}

impl Totals {
    fn add(&mut self, report: &InsertionReport) {
        self.steps += 1;
        self.trials += report.trials as u64;
        self.most_trials = self.most_trials.max(report.most_trials as u64);
        self.iterations += report.iterations as u64;
        self.most_iterations = self.most_iterations.max(report.most_iterations as u64);
        self.substeps += u64::from(report.substeps);
        self.halvings += u64::from(report.halvings);
        self.consistent += u64::from(report.consistent);
        self.blocked += u64::from(report.blocked);
        self.elements_updated += report.elements_updated;
        (self.residual, self.threshold) = (report.residual, report.threshold);
    }

    /// Takes note of angles, degrees.
    pub fn see_angles(&mut self, (least, most): (f64, f64)) {
        self.angles_deg = [self.angles_deg[0].min(least), self.angles_deg[1].max(most)];
    }
}

/// A needle after a step.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Trace {
    pub t: f64,
    pub tip: [f64; 3],
    /// The material point at the tip; `None` where it is outside.
    pub reference: Option<[f64; 3]>,
    pub depth: f64,
    pub force: [f64; 3],
    /// By node in the tissue: distance from the entry, m, and state.
    pub states: Vec<(f32, SlipState)>,
}

/// Tissue and needles at one time, for a picture, in numbers no finer than one shows.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Snapshot {
    pub t: f64,
    pub points: Vec<[f32; 3]>,
    pub tetrahedra: Vec<[u32; 4]>,
    pub regions: Vec<u32>,
    /// Displacement of each tetrahedron, m.
    pub moved: Vec<f32>,
    pub shafts: Vec<Vec<[f64; 3]>>,
    pub markers: Vec<[f64; 3]>,
    /// Seeds left so far.
    pub seeds: Vec<[f64; 3]>,
}

/// What a run remembers.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Record {
    pub totals: Totals,
    /// By needle, step by step.
    pub traces: Vec<Vec<Trace>>,
    pub markers: Vec<Tracked>,
    /// Time and places of the markers, the start included.
    pub track: Vec<(f64, Vec<[f64; 3]>)>,
    /// Seeds, with needle and depth.
    pub seeds: Vec<(usize, f64, Tracked)>,
    /// By marker, the least distance of a tip in the undeformed body.
    pub closest: Vec<Option<f64>>,
    /// Least distance of a needle from what is fixed, in the undeformed body.
    pub clearance: Option<f64>,
    /// Tissue and needles at the instants that pictures show, in order of time.
    pub snapshots: Vec<Snapshot>,
    /// Mean edge of the mesh, m.
    edge: f64,
}

impl Record {
    /// At the start.
    pub fn new(n_needles: usize, geometry: &Geometry, points: &[(String, [f64; 3])], u: &[f64]) -> Self {
        let markers: Vec<Tracked> =
            points.iter().map(|(name, at)| Tracked::new(name.clone(), *at, &geometry.mesh, u)).collect();
        let places = markers.iter().map(|marker| marker.place).collect();
        let closest = vec![None; markers.len()];
        let (traces, edge) = (vec![Vec::new(); n_needles], geometry.mean_edge());
        let mut record = Self { markers, closest, traces, edge, ..Self::default() };
        record.track.push((0.0, places));
        record
    }

    /// Takes note of a step. `releases` are the depths at which each needle leaves seeds.
    pub fn note(
        &mut self,
        t: f64,
        report: &InsertionReport,
        insertion: &mut Insertion<Solid>,
        releases: &[Vec<f64>],
        fixed: &[crate::geometry::Surface],
    ) {
        self.totals.add(report);
        let angles = insertion.remeshed_angles_deg();
        let (mesh, u) = (insertion.mesh(), &insertion.state().u);
        for (k, needle) in insertion.needles().iter().enumerate() {
            let trace = trace(t, needle, mesh);
            let left = self.traces[k].last().map_or(Vec::new(), |before| left_between(before, &trace, &releases[k]));
            for (depth, at) in left {
                // Each depth leaves one seed, however often the needle goes back and forth.
                if !self.seeds.iter().any(|seed| (seed.0, seed.1) == (k, depth)) {
                    let name = format!("seed {}", self.seeds.len() + 1);
                    self.seeds.push((k, depth, Tracked::new(name, at, mesh, u)));
                }
            }
            if let Some(reference) = trace.reference {
                for (closest, marker) in self.closest.iter_mut().zip(&self.markers) {
                    let d = distance(&reference, &marker.at);
                    *closest = Some(closest.map_or(d, |least| least.min(d)));
                }
            }
            for x in along(needle, mesh) {
                let d = fixed.iter().map(|surface| surface.distance(&x)).fold(f64::INFINITY, f64::min);
                if d.is_finite() {
                    self.clearance = Some(self.clearance.map_or(d, |least| least.min(d)));
                }
            }
            self.traces[k].push(trace);
        }
        if !self.traces.iter().any(|traces| is_shallow(traces, self.edge)) {
            self.totals.see_angles(angles);
        }
        self.markers.iter_mut().for_each(|marker| marker.follow(mesh, u));
        self.seeds.iter_mut().for_each(|seed| seed.2.follow(mesh, u));
        self.track.push((t, self.markers.iter().map(|marker| marker.place).collect()));
    }

    /// The present state, as pictures show it.
    pub fn snapshot(&self, t: f64, insertion: &Insertion<Solid>) -> Snapshot {
        snapshot(t, insertion, &self.markers, &self.seeds)
    }

    /// Keeps the present state for the pictures.
    pub fn take_snapshot(&mut self, t: f64, insertion: &Insertion<Solid>) {
        self.snapshots.push(self.snapshot(t, insertion));
    }

    /// The seeds for a summary.
    pub fn seed_summaries(&self) -> Vec<SeedSummary> {
        let summary = |(needle, depth, seed): &(usize, f64, Tracked)| SeedSummary {
            needle: needle + 1,
            depth_m: *depth,
            at: seed.at,
            place: seed.place,
        };
        self.seeds.iter().map(summary).collect()
    }
}

fn snapshot(t: f64, insertion: &Insertion<Solid>, markers: &[Tracked], seeds: &[(usize, f64, Tracked)]) -> Snapshot {
    let (mesh, u) = (insertion.mesh(), &insertion.state().u);
    let place = |(i, x): (usize, &[f64; 3])| std::array::from_fn(|k| (x[k] + u[3 * i + k]) as f32);
    let length = |v: &VertexId| u[3 * v.index()..][..3].iter().map(|x| x * x).sum::<f64>().sqrt();
    let shaft = |needle: &Needle| (0..needle.shaft.n_nodes()).map(|node| needle.shaft.place(node)).collect();
    Snapshot {
        t,
        points: mesh.points().iter().enumerate().map(place).collect(),
        tetrahedra: mesh.cells().map(|cell| mesh.cell(cell).map(|v| v.0)).collect(),
        regions: mesh.cells().map(|cell| mesh.region(cell)).collect(),
        moved: mesh.cells().map(|cell| mesh.cell(cell).iter().map(length).sum::<f64>() as f32 / 4.0).collect(),
        shafts: insertion.needles().iter().map(shaft).collect(),
        markers: markers.iter().map(|marker| marker.place).collect(),
        seeds: seeds.iter().map(|(.., seed)| seed.place).collect(),
    }
}

/// Material points of the shaft in the tissue: its nodes and the middles between them.
fn along(needle: &Needle, mesh: &SimplexMesh<3, 4>) -> Vec<[f64; 3]> {
    let nodes: Vec<[f64; 3]> = needle.nodes().iter().map(|node| mesh.point(VertexId(node.vertex))).collect();
    let middle = |pair: &[[f64; 3]]| std::array::from_fn(|k| 0.5 * (pair[0][k] + pair[1][k]));
    let middles: Vec<[f64; 3]> = nodes.windows(2).map(middle).collect();
    nodes.into_iter().chain(middles).collect()
}

fn trace(t: f64, needle: &Needle, mesh: &SimplexMesh<3, 4>) -> Trace {
    let shaft = &needle.shaft;
    let lengths = shaft.rod.rest_lengths();
    let mut from_entry = 0.0;
    let states = needle.nodes().iter().enumerate().map(|(i, node)| {
        if i > 0 {
            from_entry += lengths[shaft.entry() + i - 1];
        }
        (from_entry as f32, node.state)
    });
    Trace {
        t,
        tip: shaft.tip(),
        reference: needle.nodes().last().map(|node| mesh.point(VertexId(node.vertex))),
        depth: needle.depth(),
        force: needle.base_force,
        states: states.collect(),
    }
}

/// Whether the edge from the skin to the tip is so short that cells beside it cannot but be flat: until the tip has been behind
/// the skin for twenty frames of 20 ms, as Chentanez et al. (2009) count (section 3.4.1), and later where it is back at less than
/// the depth that it had then, or than the mean edge if that is less. While it dents the skin, it is not behind it.
fn is_shallow(traces: &[Trace], edge: f64) -> bool {
    const FRAMES: f64 = 20.0 * 0.02;
    let Some(now) = traces.last().filter(|trace| trace.reference.is_some()) else { return false };
    let behind = traces.iter().rev().take_while(|trace| trace.reference.is_some() && trace.depth > 0.0).count();
    let since_puncture = &traces[traces.len() - behind..];
    let start = since_puncture.first().map_or(now.t, |first| first.t);
    let then = since_puncture.iter().find(|trace| trace.t - start >= FRAMES * (1.0 - 1e-9));
    then.is_none_or(|then| now.depth < then.depth.min(edge))
}

/// Depths that a tip has come back past in a step, and the material points where it was then: between its places at the start and
/// at the end, by the depth.
fn left_between(before: &Trace, after: &Trace, depths: &[f64]) -> Vec<(f64, [f64; 3])> {
    let Some(start) = before.reference else { return Vec::new() };
    let passed = depths.iter().filter(|depth| after.depth < **depth && **depth <= before.depth);
    passed
        .map(|&depth| {
            let part = (before.depth - depth) / (before.depth - after.depth);
            let end = after.reference.unwrap_or(start);
            (depth, std::array::from_fn(|k| start[k] + part * (end[k] - start[k])))
        })
        .collect()
}

pub(crate) fn distance(p: &[f64; 3], q: &[f64; 3]) -> f64 {
    (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_twenty_frames_are_shallow_and_so_is_what_is_no_deeper() {
        let at = |t: f64, depth: f64| Trace {
            t,
            tip: [0.0; 3],
            reference: (depth >= 0.0).then_some([depth, 0.0, 0.0]),
            depth,
            force: [0.0; 3],
            states: Vec::new(),
        };
        // Frames of 20 ms, and steps of a fifth of that.
        for (dt, frames) in [(0.02, 20), (0.004, 100)] {
            let mut t = 0.0;
            let mut trace = |depth: f64| {
                t += dt;
                at(t, depth)
            };
            let mut traces: Vec<Trace> = [(); 30].map(|()| trace(-1.0)).into();
            assert!(!is_shallow(&traces, 1.0));
            // It dents the skin first.
            traces.extend([(); 30].map(|()| trace(0.0)));
            assert!(is_shallow(&traces, 100.0));
            for step in 1..2 * frames {
                traces.push(trace(f64::from(step)));
                assert_eq!(is_shallow(&traces, 1e3), step <= frames, "step {step}");
            }
            traces.push(trace(f64::from(frames) + 0.5));
            assert!(is_shallow(&traces, 1e3) && !is_shallow(&traces, 10.0));
            // A second puncture counts anew.
            traces.push(trace(-1.0));
            assert!(!is_shallow(&traces, 10.0));
            traces.push(trace(30.0));
            assert!(is_shallow(&traces, 10.0));
        }
    }

    #[test]
    fn seeds_are_left_where_the_tip_comes_back_past_their_depth() {
        let trace = |depth: f64| Trace {
            t: 0.0,
            tip: [0.0; 3],
            reference: (depth > 0.0).then_some([depth, 0.0, 0.0]),
            depth,
            force: [0.0; 3],
            states: Vec::new(),
        };
        let left = left_between(&trace(0.05), &trace(0.03), &[0.04, 0.01, 0.06, 0.05]);
        assert_eq!(left.len(), 2);
        assert!((left[0].1[0] - 0.04).abs() < 1e-15 && left[1] == (0.05, [0.05, 0.0, 0.0]));
        assert!(left_between(&trace(0.03), &trace(0.05), &[0.04]).is_empty());
    }
}
