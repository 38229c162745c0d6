//! What a flexible needle in tissue survives: near incompressibility, thousands of insertions, steps and speeds of all sizes,
//! violence, friction from nothing to infinity, degenerate paths, threads (J5 to J10, J12).

pub(super) mod endurance;
pub(super) mod extremes;
pub(super) mod incompressible;
pub(super) mod paths;
pub(super) mod threads;
pub(super) mod violence;

use super::{DENSITY, SIDE, YOUNG, largest};
use crate::insertion::setup::{Layers, Leg, Scene, Stuff, Tissue, distance, wire};

use stylet_mesh::VertexId;
use stylet_physics::insertion::{Insertion, UniformInteraction};
use stylet_physics::material::Solid;

/// Laws that go on where elements are turned inside out, or next to it.
const MODELS: [&str; 4] = ["linear", "corotated", "fixed-corotated", "stable-neo-hookean"];
/// Forces on the needle in gel.
const FORCES: UniformInteraction = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 };
/// Where the needle goes in: off the edges and faces of the mesh.
const ENTRY: [f64; 3] = [0.0, 0.0513, 0.0491];
/// A motion is bounded while nothing is displaced by more than this many sides.
const BOUNDED: f64 = 5.0;

/// A wire before a cube that is held opposite to the entry.
fn scene(cells: usize, poisson: f64, within: UniformInteraction, legs: Vec<Leg>) -> Scene {
    let stuff = Stuff { young: YOUNG, poisson, density: DENSITY };
    Scene {
        name: "a cube",
        tissue: Tissue::gel_box([SIDE; 3], [cells; 3], stuff, |x| x[0] > SIDE * (1.0 - 1e-9)),
        needle: wire(ENTRY, 0.0),
        layers: Layers { within, ..Layers::default() },
        legs,
    }
}

/// The law and Poisson's ratio as part of a case.
fn named(test: &str, model: &str, poisson: f64) -> String {
    format!("{test}, {model}, ν {poisson}")
}

/// What a run has shown so far.
#[derive(Clone, Copy, Debug)]
struct Watch {
    /// Least det F of all cells.
    smallest_j: f64,
    /// Largest displacement of the tissue, sides.
    largest: f64,
    /// Most that the needle was longer or shorter than its rods at rest, %.
    length: f64,
    /// Farthest that a needle node was from its node of the tissue, m.
    gap: f64,
    /// Nodes that follow each other on the needle and are not joined by an edge of the mesh.
    unjoined: usize,
    /// Most trials of a part of a step, and the parts whose states were not consistent.
    most_trials: usize,
    inconsistent: u32,
}

impl Watch {
    fn new() -> Self {
        Self {
            smallest_j: f64::INFINITY,
            largest: 0.0,
            length: 0.0,
            gap: 0.0,
            unjoined: 0,
            most_trials: 0,
            inconsistent: 0,
        }
    }

    /// Looks at the state after a step; false if it is not finite or not bounded.
    fn look(&mut self, insertion: &mut Insertion<Solid>, step: &stylet_physics::insertion::InsertionReport) -> bool {
        self.most_trials = self.most_trials.max(step.most_trials);
        self.inconsistent += step.substeps - step.consistent;
        let u = &insertion.state().u;
        let most = largest(u).max(largest(&insertion.needles()[0].shaft.v) * 1e-3) / SIDE;
        self.largest = if most.is_nan() { f64::INFINITY } else { self.largest.max(most) };
        if let Some((_, j)) = insertion.body().smallest_jacobian(u) {
            self.smallest_j = self.smallest_j.min(j);
        }
        self.length = self.length.max(100.0 * stretch(insertion));
        let (needle, mesh) = (&insertion.needles()[0], insertion.mesh());
        let entry = needle.shaft.entry();
        for (k, node) in needle.nodes().iter().enumerate() {
            let at = vertex_at(insertion, node.vertex);
            self.gap = self.gap.max(distance(&needle.shaft.place(entry + k), &at));
        }
        let mut star = Vec::new();
        for pair in needle.nodes().windows(2) {
            mesh.star(VertexId(pair[0].vertex), &mut star);
            let joined = star.iter().any(|&cell| mesh.cell(cell).contains(&VertexId(pair[1].vertex)));
            self.unjoined += usize::from(!joined);
        }
        self.largest < BOUNDED
    }
}

/// Where a vertex is in the deformed body.
fn vertex_at(insertion: &Insertion<Solid>, vertex: u32) -> [f64; 3] {
    let (x, k) = (insertion.mesh().points()[vertex as usize], 3 * vertex as usize);
    std::array::from_fn(|i| x[i] + insertion.state().u[k + i])
}

/// How much longer or shorter the needle is than at rest, outside its sleeve, as a part.
fn stretch(insertion: &Insertion<Solid>) -> f64 {
    let shaft = &insertion.needles()[0].shaft;
    let long: f64 = (1..shaft.n_nodes() - 1).map(|k| distance(&shaft.place(k), &shaft.place(k + 1))).sum();
    (long / shaft.rod.rest_lengths()[1..].iter().sum::<f64>() - 1.0).abs()
}
