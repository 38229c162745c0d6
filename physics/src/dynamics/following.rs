//! A matrix with the pattern of a body's stiffness, row by row a sum of stiffness, mass and damping.

use crate::body::Body;
use crate::material::Hyperelastic;
use stylet_solver::Block;
use stylet_solver::sparse::{BlockCsr, SparseError};

/// `stiffness K + mass M + lagged L`, where `L` has the pattern of `K`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Weights {
    pub stiffness: f64,
    pub mass: f64,
    pub lagged: f64,
}

/// The sum, which writes the rows alone that have changed.
#[derive(Clone, Debug, Default)]
pub(crate) struct Following<const D: usize> {
    pub matrix: BlockCsr<D>,
    weights: Weights,
    /// Of each row, the revision of the stiffness and the number of the lagged matrix that it was made from.
    seen: Vec<(u64, u64)>,
    row: Vec<Block<D>>,
}

impl<const D: usize> Following<D> {
    /// Bytes that it takes, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let rows = size_of::<Block<D>>() * self.row.capacity() + size_of::<(u64, u64)>() * self.seen.capacity();
        self.matrix.memory_bytes() + rows
    }

    /// Forgets what it has seen: another body, or another mass.
    pub fn reset(&mut self) {
        self.seen.clear();
    }

    /// Follows the body, and `lagged` with its number, which must change when its numbers do.
    pub fn follow<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &Body<D, N, M>,
        weights: Weights,
        lagged: Option<(&BlockCsr<D>, u64)>,
    ) -> Result<(), SparseError> {
        let n = body.n_vertices();
        if self.matrix.n_rows() == 0 {
            // All rows at once: added one by one they would leave room for as many.
            self.matrix = body.stiffness().clone();
        }
        self.matrix.resize(n)?;
        if self.weights != weights {
            self.seen.clear();
            self.weights = weights;
        }
        self.seen.resize(n, (u64::MAX, 0));
        let number = lagged.map_or(0, |(_, number)| number);
        for (row, &revision) in body.row_revisions().iter().enumerate() {
            if self.seen[row] == (revision, number) {
                continue;
            }
            self.write(body, row, lagged.map(|(matrix, _)| matrix))?;
            self.seen[row] = (revision, number);
        }
        Ok(())
    }

    fn write<const N: usize, M: Hyperelastic<D>>(
        &mut self,
        body: &Body<D, N, M>,
        row: usize,
        lagged: Option<&BlockCsr<D>>,
    ) -> Result<(), SparseError> {
        let (columns, stiffness) = body.stiffness().row(row);
        if self.matrix.row(row).0 == columns {
            let (columns, target) = self.matrix.row_mut(row);
            fill(target, columns, stiffness, lagged, row, self.weights, body);
            return Ok(());
        }
        self.row.clear();
        self.row.resize(columns.len(), [[0.0; D]; D]);
        fill(&mut self.row, columns, stiffness, lagged, row, self.weights, body);
        self.matrix.set_row(row, columns, &self.row)
    }
}

#[inline]
fn fill<const D: usize, const N: usize, M: Hyperelastic<D>>(
    target: &mut [Block<D>],
    columns: &[u32],
    stiffness: &[Block<D>],
    lagged: Option<&BlockCsr<D>>,
    row: usize,
    weights: Weights,
    body: &Body<D, N, M>,
) {
    for (target, k) in
        target.as_flattened_mut().as_flattened_mut().iter_mut().zip(stiffness.as_flattened().as_flattened())
    {
        *target = weights.stiffness * k;
    }
    if let Some(lagged) = lagged {
        let lagged = lagged.row(row).1.as_flattened().as_flattened();
        for (target, l) in target.as_flattened_mut().as_flattened_mut().iter_mut().zip(lagged) {
            *target += weights.lagged * l;
        }
    }
    if weights.mass == 0.0 {
        return;
    }
    let mut add = |at: usize, m: f64| (0..D).for_each(|i| target[at][i][i] += weights.mass * m);
    if let Some(consistent) = body.consistent_mass() {
        // The same elements make both patterns.
        consistent.row(row).1.iter().enumerate().for_each(|(at, m)| add(at, m[0][0]));
    } else if let Ok(at) = columns.binary_search(&(row as u32)) {
        add(at, body.lumped_mass()[row]);
    }
}
