//! The start mesh, solved exactly.

use super::MultilevelError;
use super::galerkin::Galerkin;
use crate::dense::Cholesky;

/// The factored matrix of the start nodes on their allowed moves.
#[derive(Clone, Debug, Default)]
pub(super) struct Coarse<const B: usize> {
    nodes: Vec<u32>,
    dense: Vec<f64>,
    factor: Cholesky,
    /// By node of the matrix, its place among the start nodes.
    places: Vec<u32>,
}

impl<const B: usize> Coarse<B> {
    /// Factors the rows of `nodes` of the level that `galerkin` has come to.
    pub fn rebuild(&mut self, galerkin: &Galerkin<B>, nodes: &[u32], n_nodes: usize) -> Result<(), MultilevelError> {
        self.nodes.clear();
        self.nodes.extend(nodes.iter().filter(|&&node| galerkin.constraint(node).is_none_or(|c| c.dofs() > 0)));
        self.places.clear();
        self.places.resize(n_nodes, u32::MAX);
        for (place, &node) in self.nodes.iter().enumerate() {
            self.places[node as usize] = place as u32;
        }
        let n = self.nodes.len() * B;
        self.dense.clear();
        self.dense.resize(n * n, 0.0);
        for place in 0..self.nodes.len() {
            self.fill_row(galerkin, place);
        }
        self.factor
            .factor(n, |i, j| self.dense[i * n + j])
            .map_err(|e| MultilevelError::Coarse { node: self.nodes[e.row / B] as usize, pivot: e.pivot })
    }

    /// One block row; moves that are not allowed get a diagonal of the size of the others.
    fn fill_row(&mut self, galerkin: &Galerkin<B>, place: usize) {
        let node = self.nodes[place];
        let n = self.nodes.len() * B;
        for (col, block) in galerkin.row(node) {
            let to = self.places[col as usize] as usize;
            if to >= self.nodes.len() {
                continue; // a node that the hierarchy does not list
            }
            for i in 0..B {
                self.dense[(place * B + i) * n + to * B..][..B].copy_from_slice(&block[i]);
            }
        }
        let Some(constraint) = galerkin.constraint(node) else { return };
        let diagonal = galerkin.diagonal(node);
        let size: f64 = (0..B).map(|k| diagonal[k][k]).sum();
        for k in 0..B {
            let unit: [f64; B] = std::array::from_fn(|l| f64::from(k == l));
            let allowed = constraint.project(unit);
            for l in 0..B {
                self.dense[(place * B + k) * n + place * B + l] += size * (unit[l] - allowed[l]);
            }
        }
    }

    /// Length of the vector that [`solve`](Self::solve) works in.
    pub fn dim(&self) -> usize {
        self.nodes.len() * B
    }

    /// Writes `A₀⁻¹ r` of the start nodes into `z`, by node; `x` is working memory of [`dim`](Self::dim) numbers.
    pub fn solve(&self, r: &[[f64; B]], z: &mut [[f64; B]], x: &mut [f64]) {
        let nodal = x.as_chunks_mut::<B>().0;
        for (x, &node) in nodal.iter_mut().zip(&self.nodes) {
            *x = r[node as usize];
        }
        self.factor.solve(x);
        for (x, &node) in x.as_chunks::<B>().0.iter().zip(&self.nodes) {
            z[node as usize] = *x;
        }
    }
}
