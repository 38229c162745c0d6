//! The matrices of the coarser levels, made by taking one node after the other out of the finest.

use super::hierarchy::Birth;
use crate::Block;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};

const NONE: u32 = u32::MAX;

/// A block of a row, and where the next one of the row is.
#[derive(Clone, Copy, Debug)]
struct Entry<const B: usize> {
    col: u32,
    next: u32,
    block: Block<B>,
}

/// The matrix of the current level, restricted to the allowed moves of each node; rows are linked lists.
///
/// Taking out a node `p` midway between `l` and `r` replaces `A` by `Pᵀ A P`, where `P` interpolates `p`. Every edge of the
/// coarser mesh but `l r` is one of the finer mesh, so a list gains one entry at most, and the cost of `p` is that of its
/// neighbours.
#[derive(Clone, Debug, Default)]
pub(super) struct Galerkin<const B: usize> {
    heads: Vec<u32>,
    entries: Vec<Entry<B>>,
    free: Vec<u32>,
    /// By node, its constraint if it has one.
    constraints: Vec<Option<Constraint<B>>>,
    /// Neighbours of the node that is taken out: column, `A_pw`, `A_wp`.
    star: Vec<(u32, Block<B>, Block<B>)>,
}

impl<const B: usize> Galerkin<B> {
    /// Starts at the finest level: `P_W A P_W`.
    pub fn load(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) {
        self.constraints.clear();
        self.constraints.resize(matrix.n_rows(), None);
        for (node, constraint) in subspace.constrained() {
            self.constraints[node] = Some(*constraint);
        }
        self.heads.clear();
        self.entries.clear();
        self.free.clear();
        for row in 0..matrix.n_rows() {
            let mut head = NONE;
            let (cols, blocks) = matrix.row(row);
            for (&col, block) in cols.iter().zip(blocks).rev() {
                if let Some(block) = self.projected(row as u32, col, *block) {
                    self.entries.push(Entry { col, next: head, block });
                    head = self.entries.len() as u32 - 1;
                }
            }
            self.heads.push(head);
        }
    }

    /// The constraint on a node, if it has one.
    pub fn constraint(&self, node: u32) -> Option<&Constraint<B>> {
        self.constraints[node as usize].as_ref()
    }

    /// Columns and blocks of a row of the current level, in no particular order that depends on anything but the matrix
    /// and the hierarchy.
    pub fn row(&self, node: u32) -> impl Iterator<Item = (u32, &Block<B>)> {
        let first = self.heads[node as usize];
        std::iter::successors(self.entries.get(first as usize), |entry| self.entries.get(entry.next as usize))
            .map(|entry| (entry.col, &entry.block))
    }

    /// The diagonal block of a row of the current level.
    pub fn diagonal(&self, node: u32) -> Block<B> {
        self.row(node).find(|(col, _)| *col == node).map_or([[0.0; B]; B], |(_, block)| *block)
    }

    /// Goes on to the level without the node.
    pub fn take_out(&mut self, birth: &Birth) {
        let p = birth.node;
        let mut star = std::mem::take(&mut self.star);
        let pp = self.take_row(p, &mut star);
        for &(w, pw, wp) in &star {
            for q in birth.parents {
                self.add(q, w, scaled(0.5, &pw));
                self.add(w, q, scaled(0.5, &wp));
            }
        }
        for q in birth.parents {
            for s in birth.parents {
                self.add(q, s, scaled(0.25, &pp));
            }
        }
        self.star = star;
    }

    /// Unlinks row and column `p`; returns the diagonal block.
    fn take_row(&mut self, p: u32, star: &mut Vec<(u32, Block<B>, Block<B>)>) -> Block<B> {
        star.clear();
        let mut diagonal = [[0.0; B]; B];
        let mut at = std::mem::replace(&mut self.heads[p as usize], NONE);
        while let Some(&Entry { col, next, block }) = self.entries.get(at as usize) {
            self.free.push(at);
            at = next;
            if col == p {
                diagonal = block;
            } else {
                let transposed = self.take_entry(col, p);
                star.push((col, block, transposed));
            }
        }
        diagonal
    }

    /// Unlinks a block; zero if there is none.
    fn take_entry(&mut self, row: u32, col: u32) -> Block<B> {
        let mut before = NONE;
        let mut at = self.heads[row as usize];
        while let Some(&entry) = self.entries.get(at as usize) {
            if entry.col == col {
                match self.entries.get_mut(before as usize) {
                    Some(before) => before.next = entry.next,
                    None => self.heads[row as usize] = entry.next,
                }
                self.free.push(at);
                return entry.block;
            }
            (before, at) = (at, entry.next);
        }
        [[0.0; B]; B]
    }

    fn add(&mut self, row: u32, col: u32, block: Block<B>) {
        let Some(block) = self.projected(row, col, block) else { return };
        let mut at = self.heads[row as usize];
        while let Some(entry) = self.entries.get_mut(at as usize) {
            if entry.col == col {
                for (sum, term) in entry.block.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
                    *sum += term;
                }
                return;
            }
            at = entry.next;
        }
        let entry = Entry { col, next: self.heads[row as usize], block };
        let at = self.free.pop().unwrap_or(self.entries.len() as u32);
        match self.entries.get_mut(at as usize) {
            Some(unused) => *unused = entry,
            None => self.entries.push(entry),
        }
        self.heads[row as usize] = at;
    }

    /// `P_i A_ij P_j`; `None` if one of the nodes cannot move.
    fn projected(&self, i: u32, j: u32, mut block: Block<B>) -> Option<Block<B>> {
        let (row, col) = (&self.constraints[i as usize], &self.constraints[j as usize]);
        if [row, col].into_iter().flatten().any(|constraint| constraint.dofs() == 0) {
            return None;
        }
        if let Some(constraint) = col {
            block = block.map(|line| constraint.project(line));
        }
        if let Some(constraint) = row {
            block = transposed(&transposed(&block).map(|line| constraint.project(line)));
        }
        Some(block)
    }
}

fn scaled<const B: usize>(factor: f64, block: &Block<B>) -> Block<B> {
    block.map(|line| line.map(|v| factor * v))
}

fn transposed<const B: usize>(block: &Block<B>) -> Block<B> {
    std::array::from_fn(|i| std::array::from_fn(|j| block[j][i]))
}
