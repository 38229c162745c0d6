//! What forces along a needle do aside, by the shapes of the cells alone.
//!
//! In tissue that is the same all around a needle, a force along it moves its points along it. A node of a mesh is moved aside as
//! well, by a part of the way that depends on how the cells around it lie, not on their size: a force of so much by length bends
//! the path of a symmetric tip in an unsymmetric mesh, however fine that is. The needle need not follow: the tissue gets the
//! load `-K e u_a` that takes the ways `u_a` aside off its nodes, and changes nothing at any other.
//!
//! The ways are those of the nodes of the needle and of what is [beside the last](BESIDE), all else held.

use super::shaft::{difference, inner, length, triple};
use super::system::Link;
use super::{CouplingNode, Shaft, SlipState};
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::BlockJacobi;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// Number of nodes at the tip, where the path is made, whose neighbours move along: with their neighbours held, nodes yield by a
/// part of what they do. The neighbours of all nodes would be ten times the cost, for little.
const BESIDE: usize = 3;
/// Ways along the needle, in reaches of a step, of which there is no relief any more, and less and less before: they are no small
/// moves that the stiffness at hand could tell.
const FAR: f64 = 4.0;
/// Of the forces, to which the ways are solved for: what is left is nothing beside what is corrected.
const TOLERANCE: f64 = 1e-3;
/// Most iterations; as far as that they go anyway.
const MAX_ITERATIONS: usize = 60;

/// Finds the load; what it needs is kept between steps.
pub(super) struct Aside {
    /// Vertices that move, ascending.
    set: Vec<u32>,
    /// By vertex, its place in the set, one more than it; zero for others, and for all between calls.
    place: Vec<u32>,
    matrix: BlockCsr<3>,
    force: Vec<f64>,
    way: Vec<f64>,
    columns: Vec<u32>,
    blocks: Vec<[[f64; 3]; 3]>,
    cg: CgWorkspace,
}

impl Aside {
    pub fn new() -> Self {
        Self {
            set: Vec::new(),
            place: Vec::new(),
            matrix: BlockCsr::new(0),
            force: Vec::new(),
            way: Vec::new(),
            columns: Vec::new(),
            blocks: Vec::new(),
            cg: CgWorkspace::new(),
        }
    }

    /// Adds the load to `rhs`, N, from the stiffness of the tissue and the forces that its nodes bear now, or have borne last
    /// where they stick. A tissue whose stiffness is not definite there gets none, nor where nodes move by more than a few `reach`,
    /// how far a needle may slide in a step, m.
    pub fn relieve(
        &mut self,
        stiffness: &BlockCsr<3>,
        subspace: &Subspace<3>,
        (needles, links): (&[Shaft], &[Link]),
        reach: f64,
        rhs: &mut [f64],
    ) {
        let nodes = || needles.iter().flat_map(|needle| &needle.nodes).zip(links);
        if !nodes().any(|(node, _)| node.is_even && along(node) != 0.0) {
            return;
        }
        self.gather(stiffness, subspace, needles, links);
        self.force.clear();
        self.force.resize(3 * self.set.len(), 0.0);
        for (node, link) in nodes() {
            // A held vertex is not in the set.
            if let Some(i) = (self.place[link.vertex] as usize).checked_sub(1) {
                let force = along(node);
                (0..3).for_each(|k| self.force[3 * i + k] += force * link.tangent[k]);
            }
        }
        if self.solve(stiffness).is_some() {
            for (_, link) in nodes().filter(|(node, _)| node.is_even) {
                let Some(i) = (self.place[link.vertex] as usize).checked_sub(1) else { continue };
                let way = triple(&self.way, i);
                let far = inner(&link.tangent, &way);
                let aside = difference(&way, &link.tangent.map(|t| far * t));
                let part = (1.0 - (far / (FAR * reach)).powi(2)).max(0.0);
                // More aside than along is not the shape of cells.
                if part > 0.0 && length(&aside) < far.abs() {
                    take_off(stiffness, link.vertex, &aside.map(|way| part * way), rhs);
                }
            }
        }
        self.set.iter().for_each(|&vertex| self.place[vertex as usize] = 0);
    }

    /// The vertices that move.
    fn gather(&mut self, stiffness: &BlockCsr<3>, subspace: &Subspace<3>, needles: &[Shaft], links: &[Link]) {
        if self.place.len() < stiffness.n_rows() {
            self.place.resize(stiffness.n_rows(), 0);
        }
        let set = &mut self.set;
        set.clear();
        set.extend(links.iter().map(|link| link.vertex as u32));
        for needle in needles {
            for node in needle.nodes.iter().rev().take(BESIDE) {
                set.extend_from_slice(stiffness.row(node.vertex as usize).0);
            }
        }
        set.retain(|&vertex| subspace.get(vertex as usize) == Constraint::Free);
        set.sort_unstable();
        set.dedup();
        for (i, &vertex) in set.iter().enumerate() {
            self.place[vertex as usize] = i as u32 + 1;
        }
    }

    fn solve(&mut self, stiffness: &BlockCsr<3>) -> Option<()> {
        let n = self.set.len();
        self.matrix = BlockCsr::new(n);
        for (i, &vertex) in self.set.iter().enumerate() {
            self.columns.clear();
            self.blocks.clear();
            let (columns, blocks) = stiffness.row(vertex as usize);
            for (&j, block) in columns.iter().zip(blocks) {
                if let Some(j) = self.place[j as usize].checked_sub(1) {
                    self.columns.push(j);
                    self.blocks.push(*block);
                }
            }
            self.matrix.set_row(i, &self.columns, &self.blocks).ok()?;
        }
        self.way.clear();
        self.way.resize(3 * n, 0.0);
        let free = Subspace::new(n);
        let preconditioner = BlockJacobi::new(&self.matrix, &free).ok()?;
        let stop = StopRule { tolerance: TOLERANCE, criterion: Criterion::External, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: MAX_ITERATIONS };
        projected_cg(&self.matrix, &preconditioner, &free, &self.force, &mut self.way, &settings, &mut self.cg).ok()?;
        Some(())
    }
}

/// Force along `t` on the tissue, N, without viscous friction, which is not known before the step.
fn along(node: &CouplingNode) -> f64 {
    match node.state {
        SlipState::Static => node.force,
        state => node.limits.slipping(state),
    }
}

/// Subtracts `K e way` of a vertex.
fn take_off(stiffness: &BlockCsr<3>, vertex: usize, way: &[f64; 3], rhs: &mut [f64]) {
    let (columns, blocks) = stiffness.row(vertex);
    for (&j, block) in columns.iter().zip(blocks) {
        // The block across the diagonal is the transpose.
        for (k, rhs) in rhs[3 * j as usize..3 * j as usize + 3].iter_mut().enumerate() {
            *rhs -= (0..3).map(|l| block[l][k] * way[l]).sum::<f64>();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::coupling::{CouplingNode, SlipLimits};
    use crate::material::Linear;
    use crate::rod::{Rod, RodStiffness};
    use stylet_mesh::SimplexMesh;
    use stylet_mesh::generate::{kuhn_box, mirrored_kuhn_box};
    use stylet_solver::precondition::Jacobi;

    const FORCE: f64 = 0.1;

    /// A box of unit cubes whose outside is held, and a needle along the middle of it, by `depth` cubes.
    fn needle_in(mesh: &SimplexMesh<3, 4>, depth: usize) -> (Body<3, 4, Linear>, Subspace<3>, Shaft, Vec<Link>) {
        let body = Body::new(mesh, Linear::from_young_poisson(15e3, 0.45).unwrap(), 1.0).unwrap();
        let mut held = Subspace::new(mesh.n_vertex_slots());
        for (vertex, x) in mesh.points().iter().enumerate() {
            if x.iter().any(|x| *x < 1e-9 || *x > 8.0 - 1e-9) {
                held.set(vertex, Constraint::Fixed).unwrap();
            }
        }
        let vertex = |x: f64| mesh.points().iter().position(|p| *p == [x, 4.0, 4.0]).unwrap();
        let stiffness = RodStiffness::round(60e9, 0.33, 0.83e-3).unwrap();
        let rod = Rod::new(vec![1.0; depth + 1], stiffness, 1e-3).unwrap();
        let x: Vec<f64> = (0..depth + 2).flat_map(|i| [i as f64 - 1.0, 4.0, 4.0]).collect();
        let zero = vec![0.0; x.len()];
        let bears = |i: usize| CouplingNode {
            state: SlipState::Forward,
            limits: SlipLimits { dynamic: [-FORCE, FORCE], fixed: [-FORCE, FORCE] },
            is_even: true,
            ..CouplingNode::new(vertex(i as f64) as u32)
        };
        let nodes: Vec<CouplingNode> = (1..=depth).map(bears).collect();
        let links = nodes.iter().enumerate().map(|(small, node)| Link {
            small,
            vertex: node.vertex as usize,
            tangent: [1.0, 0.0, 0.0],
            drag: 0.0,
            slip: 0.0,
        });
        let links = links.collect();
        let shaft = Shaft { rod, v: zero.clone(), a: zero, x, director: [0.0, 1.0, 0.0], damping: 0.0, nodes };
        (body, held, shaft, links)
    }

    /// The ways of the nodes of a needle aside, without the load and with it, m, and the sum of the load, N.
    fn ways(mesh: &SimplexMesh<3, 4>, depth: usize) -> ([f64; 2], [f64; 3]) {
        let (body, held, shaft, links) = needle_in(mesh, depth);
        let k = body.stiffness();
        let mut friction = vec![0.0; 3 * mesh.n_vertex_slots()];
        links.iter().for_each(|link| friction[3 * link.vertex] = FORCE);
        let mut relieved = friction.clone();
        Aside::new().relieve(k, &held, (std::slice::from_ref(&shaft), &links), 0.2, &mut relieved);
        let stop = StopRule { tolerance: 1e-10, criterion: Criterion::External, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: 1000 };
        let preconditioner = Jacobi::new(k, &held).unwrap();
        let aside = [&friction, &relieved].map(|load| {
            let mut u = vec![0.0; load.len()];
            projected_cg(k, &preconditioner, &held, load, &mut u, &settings, &mut CgWorkspace::new()).unwrap();
            let tip = links.last().unwrap().vertex;
            u[3 * tip + 1].hypot(u[3 * tip + 2])
        });
        let sum = |k: usize| relieved.iter().zip(&friction).skip(k).step_by(3).map(|(b, f)| b - f).sum();
        (aside, std::array::from_fn(sum))
    }

    #[test]
    fn a_tip_is_moved_aside_by_a_fourth_of_what_it_was() {
        let mesh = kuhn_box::<3, 4>([0.0; 3], [8.0; 3], [8; 3]).unwrap();
        for depth in 1..=5 {
            let (aside, sum) = ways(&mesh, depth);
            println!("{depth}: {aside:?} m aside");
            assert!(aside[1] < aside[0] / 4.0, "{depth}: {aside:?}");
            assert!(sum.iter().all(|f| f.abs() < 1e-12 * FORCE), "no force as a whole: {sum:?}");
        }
    }

    #[test]
    fn symmetric_cells_need_no_load() {
        let mesh = mirrored_kuhn_box::<3, 4>([0.0; 3], [8.0; 3], [8; 3]).unwrap();
        let (aside, _) = ways(&mesh, 4);
        assert!(aside.iter().all(|way| *way < 1e-12), "{aside:?}");
    }
}
