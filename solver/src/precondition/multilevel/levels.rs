//! What both preconditioners keep of each level: which nodes are smoothed, and with what.

use super::MultilevelError;
use super::coarse::Coarse;
use super::galerkin::Galerkin;
use super::hierarchy::{Birth, BisectionHierarchy};
use crate::Block;
use crate::precondition::restricted::restricted_inverse;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};
use std::ops::Range;

/// A node that a level smooths.
#[derive(Clone, Copy, Debug)]
pub(super) struct Smoothed<const B: usize> {
    pub node: u32,
    /// `T (Tᵀ A_kk T)⁻¹ Tᵀ` of the level's diagonal block.
    pub inverse: Block<B>,
}

/// Parts of the lists of [`Levels`].
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub smoothed: Range<usize>,
    pub births: Range<usize>,
    pub constrained: Range<usize>,
}

/// All levels, finest first: first all nodes, then each generation's births and their parents.
#[derive(Clone, Debug, Default)]
pub(super) struct Levels<const B: usize> {
    pub n_nodes: usize,
    pub levels: Vec<Level>,
    pub smoothed: Vec<Smoothed<B>>,
    pub births: Vec<Birth>,
    /// Constrained ones among the smoothed nodes of each level, fixed ones included.
    pub constrained: Vec<(u32, Constraint<B>)>,
    pub coarse: Coarse<B>,
    galerkin: Galerkin<B>,
    /// By node, the last level that smoothed it.
    seen: Vec<u32>,
}

impl<const B: usize> Levels<B> {
    /// Goes through all levels in O(n); `on_node` sees the matrix of the level for each node that is smoothed, in order.
    pub fn rebuild(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        hierarchy: &BisectionHierarchy,
        mut on_node: impl FnMut(&Galerkin<B>, u32),
    ) -> Result<(), MultilevelError> {
        let (rows, nodes, listed) = (matrix.n_rows(), subspace.n_nodes(), hierarchy.n_nodes());
        if rows != nodes || rows != listed {
            return Err(MultilevelError::Shape { rows, nodes, listed });
        }
        self.n_nodes = rows;
        self.levels.clear();
        self.smoothed.clear();
        self.births.clear();
        self.constrained.clear();
        self.seen.clear();
        self.seen.resize(rows, 0);
        self.galerkin.load(matrix, subspace);

        self.level(0..rows as u32, &[], &mut on_node)?;
        for generation in (1..=hierarchy.n_generations()).rev() {
            let births = hierarchy.births(generation);
            // Parents first: with the births first the V-cycle takes seven iterations instead of five for the Laplacian.
            let nodes = births.iter().map(|birth| birth.node);
            let parents = births.iter().flat_map(|birth| birth.parents);
            self.level(parents.chain(nodes), births, &mut on_node)?;
            for birth in births {
                self.galerkin.take_out(birth);
            }
        }
        self.coarse.rebuild(&self.galerkin, hierarchy.start(), rows)
    }

    /// Appends a level that smooths each of `nodes` once.
    fn level(
        &mut self,
        nodes: impl Iterator<Item = u32>,
        births: &[Birth],
        on_node: &mut impl FnMut(&Galerkin<B>, u32),
    ) -> Result<(), MultilevelError> {
        let starts = (self.smoothed.len(), self.births.len(), self.constrained.len());
        let stamp = self.levels.len() as u32 + 1;
        for node in nodes {
            if std::mem::replace(&mut self.seen[node as usize], stamp) == stamp {
                continue;
            }
            let constraint = self.galerkin.constraint(node).copied();
            self.constrained.extend(constraint.map(|constraint| (node, constraint)));
            let constraint = constraint.unwrap_or(Constraint::Free);
            if constraint.dofs() == 0 {
                continue;
            }
            let inverse = restricted_inverse(&self.galerkin.diagonal(node), &constraint).map_err(|pivot| {
                MultilevelError::NotPositive { node: node as usize, level: self.levels.len(), pivot }
            })?;
            on_node(&self.galerkin, node);
            self.smoothed.push(Smoothed { node, inverse });
        }
        self.births.extend_from_slice(births);
        self.levels.push(Level {
            smoothed: starts.0..self.smoothed.len(),
            births: starts.1..self.births.len(),
            constrained: starts.2..self.constrained.len(),
        });
        Ok(())
    }

    /// `r ← Pᵀ r`: what a level without the births of this one sees.
    pub fn restrict(&self, level: &Level, r: &mut [[f64; B]]) {
        for birth in &self.births[level.births.clone()] {
            let half = r[birth.node as usize].map(|v| 0.5 * v);
            for parent in birth.parents {
                for (sum, half) in r[parent as usize].iter_mut().zip(half) {
                    *sum += half;
                }
            }
        }
        self.project(level, r);
    }

    /// `z ← P z`: interpolates the births of a level.
    pub fn prolong(&self, level: &Level, z: &mut [[f64; B]]) {
        for birth in &self.births[level.births.clone()] {
            let [l, r] = birth.parents.map(|parent| z[parent as usize]);
            z[birth.node as usize] = std::array::from_fn(|k| 0.5 * (l[k] + r[k]));
        }
        self.project(level, z);
    }

    fn project(&self, level: &Level, v: &mut [[f64; B]]) {
        for (node, constraint) in &self.constrained[level.constrained.clone()] {
            let v = &mut v[*node as usize];
            *v = constraint.project(*v);
        }
    }
}

/// `A x` of one block.
#[inline(always)]
pub(super) fn product<const B: usize>(a: &Block<B>, x: &[f64; B]) -> [f64; B] {
    std::array::from_fn(|i| (1..B).fold(a[i][0] * x[0], |sum, j| sum + a[i][j] * x[j]))
}
