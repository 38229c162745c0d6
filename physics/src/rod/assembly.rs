//! Energy, forces and their block-banded derivative, corner by corner.

use super::angles::Settling;
use super::corner::{Blocks, Corner, Edge, Pair};
use super::frames::{Frame, bishop, turned};
use super::{Rod, RodError};
use nalgebra::{Matrix3, Vector3};
use stylet_solver::Block;
use stylet_solver::sparse::BlockCsr;

/// Which derivative of the forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tangent {
    /// The second derivative of bending and stretch.
    Exact,
    /// Never indefinite: of bending what the first derivatives of the curvature give, of stretch nothing across a compressed
    /// edge.
    GaussNewton,
}

/// What a configuration makes of the rod; kept for its memory alone.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub edges: Vec<Edge>,
    /// `m1` and `m2` by edge.
    pub directors: Vec<[Vector3<f64>; 2]>,
    /// Diagonal block, and those one and two nodes to the right.
    band: Vec<[Matrix3<f64>; 3]>,
    pub settling: Settling,
}

impl Rod {
    /// Energy of bending, stretch and twist, J. `x`: the positions of the nodes, m, three numbers each; `base_director`: a unit
    /// vector perpendicular to the first edge, from which what it has along the edge is taken off.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn energy(&mut self, x: &[f64], base_director: &[f64; 3]) -> f64 {
        self.look(x, base_director);
        let bending = self.stiffness.bending;
        let mut energy = self.twist_energy();
        for (edge, &l) in self.scratch.edges.iter().zip(&self.rest_lengths) {
            energy += 0.5 * self.stiffness.stretching * (edge.length - l).powi(2) / l;
        }
        for node in 1..self.n_edges() {
            let (corner, length) = (self.corner(node), self.node_length(node));
            energy += if self.curved {
                bending * length * self.half_square_from_rest(node, &(corner.binormal() / length))
            } else {
                bending * corner.half_square() / length
            };
        }
        energy
    }

    /// Rounding errors of the forces at `x`, N: what one unit in the last place of a coordinate changes in the tension of the
    /// shortest edge, some times over. No solve can be asked for less.
    #[must_use]
    pub fn force_round_off(&self, x: &[f64]) -> f64 {
        let largest = x.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        let shortest = self.rest_lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let stiffness = self.stiffness.stretching / shortest + 8.0 * self.stiffness.bending / shortest.powi(3);
        8.0 * f64::EPSILON * largest * stiffness
    }

    /// Energy of twist, J: a part of [`energy`](Self::energy).
    #[must_use]
    pub fn twist_energy(&self) -> f64 {
        let of = |node: usize| self.twisting_moment(node) * (self.angles[node] - self.angles[node - 1]);
        (1..self.n_edges()).map(|node| 0.5 * of(node)).sum()
    }

    /// Adds the forces of bending and stretch, N, to `force`: minus the gradient of their energy with edges that do not spin.
    ///
    /// # Panics
    /// If `x` or `force` does not have three numbers for each node.
    pub fn add_force(&mut self, x: &[f64], base_director: &[f64; 3], force: &mut [f64]) {
        self.look(x, base_director);
        let force = nodal(force, self.n_nodes());
        for (j, (edge, &l)) in self.scratch.edges.iter().zip(&self.rest_lengths).enumerate() {
            let pull = edge.tangent * (self.stiffness.stretching * (edge.length / l - 1.0));
            add(&mut force[j], &pull);
            add(&mut force[j + 1], &-pull);
        }
        for node in 1..self.n_edges() {
            let corner = self.corner(node);
            let scale = self.stiffness.bending / self.node_length(node);
            let mut gradient = corner.half_square_gradient().map(|g| g * scale);
            if self.curved {
                let [q0, q1] = self.natural(node);
                let natural = corner.binormal_gradient(&((q0 + q1) * 0.5));
                gradient = [0, 1].map(|k| gradient[k] - natural[k] * self.stiffness.bending);
            }
            spread(force, node, &gradient);
        }
    }

    /// Adds the forces of twist, N, to `force`: at each inner node the [twisting moment](Rod::twisting_moment) times the
    /// change of the angle between the directors of its edges when these do not spin.
    ///
    /// # Panics
    /// If `x` or `force` does not have three numbers for each node.
    pub fn add_twist_force(&mut self, x: &[f64], base_director: &[f64; 3], force: &mut [f64]) {
        let _ = base_director; // the angles between neighbours are all that twist knows
        self.measure(x);
        let force = nodal(force, self.n_nodes());
        for node in 1..self.n_edges() {
            let moment = self.twisting_moment(node);
            if moment != 0.0 {
                spread(force, node, &self.corner(node).twist_gradient().map(|g| g * moment));
            }
        }
    }

    /// Overwrites `matrix` with the derivative of the gradient by the positions, N/m: minus that of
    /// [`add_force`](Self::add_force), in its symmetric part. With `twist` also minus that of
    /// [`add_twist_force`](Self::add_twist_force) at constant twisting moments, which is indefinite; angles in equilibrium keep
    /// the moment uniform, and what it changes by is not in the band.
    ///
    /// Rows hold nodes up to two away. Where the pattern is that already, numbers are rewritten in place.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn tangent(
        &mut self,
        x: &[f64],
        base_director: &[f64; 3],
        kind: Tangent,
        twist: bool,
        matrix: &mut BlockCsr<3>,
    ) {
        match kind {
            Tangent::Exact => self.look(x, base_director),
            Tangent::GaussNewton => self.measure(x),
        }
        let mut band = std::mem::take(&mut self.scratch.band);
        band.clear();
        band.resize(self.n_nodes(), [Matrix3::zeros(); 3]);
        for (j, (edge, &l)) in self.scratch.edges.iter().zip(&self.rest_lengths).enumerate() {
            let along = edge.tangent * edge.tangent.transpose();
            let (ea, tension) = (self.stiffness.stretching, self.stiffness.stretching * (edge.length / l - 1.0));
            let tension = if kind == Tangent::GaussNewton { tension.max(0.0) } else { tension };
            let block = along * (ea / l) + (Matrix3::identity() - along) * (tension / edge.length);
            band[j][0] += block;
            band[j][1] -= block;
            band[j + 1][0] += block;
        }
        for node in 1..self.n_edges() {
            let mut blocks = self.bending_tangent(node, kind);
            let moment = self.twisting_moment(node);
            if twist && moment != 0.0 {
                let twisted = self.corner(node).twist_hessian();
                blocks = [0, 1, 2].map(|k| blocks[k] + twisted[k] * moment);
            }
            spread_blocks(&mut band, node, &blocks);
        }
        store(&band, matrix);
        self.scratch.band = band;
    }

    fn bending_tangent(&self, node: usize, kind: Tangent) -> Blocks {
        let (corner, bending) = (self.corner(node), self.stiffness.bending);
        let scale = bending / self.node_length(node);
        if kind == Tangent::GaussNewton {
            return corner.gauss_newton().map(|b| b * scale);
        }
        let blocks = corner.half_square_hessian().map(|b| b * scale);
        if !self.curved {
            return blocks;
        }
        let [q0, q1] = self.natural(node);
        let natural = corner.binormal_hessian(&q0, &q1);
        [0, 1, 2].map(|k| blocks[k] - natural[k] * bending)
    }

    /// Overwrites `frames` with tangent and material directors of each edge.
    ///
    /// # Panics
    /// If `x` does not have three numbers for each node.
    pub fn frames(&self, x: &[f64], base_director: &[f64; 3], frames: &mut Vec<Frame>) {
        let x = nodes(x, self.n_nodes());
        let tangents = x.windows(2).map(|e| Edge::between(&e[0], &e[1]).tangent);
        frames.clear();
        frames.extend(bishop(tangents, base_director).zip(&self.angles).map(|(frame, &angle)| {
            let [m1, m2] = turned(&frame, angle);
            [frame[0].into(), m1.into(), m2.into()]
        }));
    }

    /// Edges at `x`, and directors where bending needs them.
    fn look(&mut self, x: &[f64], base_director: &[f64; 3]) {
        self.measure(x);
        if self.curved {
            let Scratch { edges, directors, .. } = &mut self.scratch;
            directors.clear();
            let frames = bishop(edges.iter().map(|e| e.tangent), base_director);
            directors.extend(frames.zip(&self.angles).map(|(frame, &angle)| turned(&frame, angle)));
        }
    }

    pub(super) fn measure(&mut self, x: &[f64]) {
        let x = nodes(x, self.n_nodes());
        self.scratch.edges.clear();
        self.scratch.edges.extend(x.windows(2).map(|e| Edge::between(&e[0], &e[1])));
    }

    #[inline]
    pub(super) fn corner(&self, node: usize) -> Corner {
        Corner::new(&self.scratch.edges[node - 1], &self.scratch.edges[node])
    }

    /// Half of the squared difference between curvature and natural curvature, mean of the two edges at a node.
    fn half_square_from_rest(&self, node: usize, binormal: &Vector3<f64>) -> f64 {
        let [k1, k2] = self.rest_curvatures[node - 1];
        let of = |[m1, m2]: &[Vector3<f64>; 2]| (binormal.dot(m2) - k1).powi(2) + (binormal.dot(m1) + k2).powi(2);
        0.25 * (of(&self.scratch.directors[node - 1]) + of(&self.scratch.directors[node]))
    }

    /// `q = kappa_1 m2 - kappa_2 m1` of the two edges at a node: `kb . q` is the product of the curvature that the rod has
    /// with the natural one.
    #[inline]
    fn natural(&self, node: usize) -> Pair {
        let [k1, k2] = self.rest_curvatures[node - 1];
        [node - 1, node].map(|j| {
            let [m1, m2] = &self.scratch.directors[j];
            m2 * k1 - m1 * k2
        })
    }

    /// Refuses a configuration that has no frames.
    pub(super) fn check_edges(&self) -> Result<(), RodError> {
        let edges = &self.scratch.edges;
        let bad = |j: usize| {
            let t = edges[j].tangent;
            !t.iter().all(|t| t.is_finite()) || (j > 0 && (t + edges[j - 1].tangent).norm_squared() < f64::EPSILON)
        };
        match (0..edges.len()).find(|&j| bad(j)) {
            Some(edge) => Err(RodError::Degenerate { edge }),
            None => Ok(()),
        }
    }
}

pub(super) fn nodes(x: &[f64], n: usize) -> &[[f64; 3]] {
    assert_eq!(x.len(), 3 * n, "a rod of {n} nodes has three numbers for each");
    x.as_chunks::<3>().0
}

fn nodal(x: &mut [f64], n: usize) -> &mut [[f64; 3]] {
    assert_eq!(x.len(), 3 * n, "a rod of {n} nodes has three numbers for each");
    x.as_chunks_mut::<3>().0
}

#[inline]
fn add(to: &mut [f64; 3], v: &Vector3<f64>) {
    for k in 0..3 {
        to[k] += v[k];
    }
}

/// Adds the forces of a corner from the gradient by its edges.
#[inline]
fn spread(force: &mut [[f64; 3]], node: usize, [g0, g1]: &Pair) {
    add(&mut force[node - 1], g0);
    add(&mut force[node], &(g1 - g0));
    add(&mut force[node + 1], &-g1);
}

/// Adds the second derivatives by the edges `e0 = x_i - x_(i-1)`, `e1 = x_(i+1) - x_i` to those by the three nodes.
#[inline]
fn spread_blocks(band: &mut [[Matrix3<f64>; 3]], node: usize, [b00, b01, b11]: &Blocks) {
    band[node - 1][0] += b00;
    band[node - 1][1] += b01 - b00;
    band[node - 1][2] -= b01;
    band[node][0] += b00 + b11 - b01 - b01.transpose();
    band[node][1] += b01 - b11;
    band[node + 1][0] += b11;
}

fn store(band: &[[Matrix3<f64>; 3]], matrix: &mut BlockCsr<3>) {
    let n = band.len();
    let columns = |i: usize| i.saturating_sub(2)..(i + 3).min(n);
    let fits = matrix.n_rows() == n && (0..n).all(|i| matrix.row(i).0.iter().map(|&c| c as usize).eq(columns(i)));
    if !fits {
        *matrix = banded_pattern(n);
    }
    for i in 0..n {
        let (_, blocks) = matrix.row_mut(i);
        for (block, j) in blocks.iter_mut().zip(columns(i)) {
            // Columns first in nalgebra, rows first in a block.
            *block = if j < i { band[j][i - j].into() } else { transposed(&band[i][j - i]) };
        }
    }
}

fn transposed(m: &Matrix3<f64>) -> Block<3> {
    m.transpose().into()
}

/// Zero blocks up to two nodes from the diagonal.
fn banded_pattern(n: usize) -> BlockCsr<3> {
    let mut matrix = BlockCsr::new(n);
    for i in 0..n {
        let columns: Vec<u32> = (i.saturating_sub(2)..(i + 3).min(n)).map(|j| j as u32).collect();
        let zeros = vec![[[0.0; 3]; 3]; columns.len()];
        matrix.set_row(i, &columns, &zeros).expect("ascending columns within the matrix, finite blocks");
    }
    matrix
}
