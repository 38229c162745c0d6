//! Block Jacobi.

use super::restricted::{check_node, check_shape, restricted_inverse};
use super::{PreconditionRows, Preconditioner, PreconditionerError};
use crate::Block;
use crate::memory::bytes_of;
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;

/// Inverts the diagonal block of every node on the moves that its constraint allows: `T (Tᵀ D T)⁻¹ Tᵀ`.
#[derive(Clone, Debug, Default)]
pub struct BlockJacobi<const B: usize, T: Real = f64> {
    inverses: Vec<Block<B, T>>,
    /// Stamps of the rows, and the subspace, that the inverses were made from; no stamps where that is not known.
    stamps: Vec<u64>,
    subspace: Subspace<B>,
}

impl<const B: usize> BlockJacobi<B> {
    /// The preconditioner of `P_W A P_W`.
    ///
    /// # Errors
    /// [`PreconditionerError::Shape`]; [`PreconditionerError::NotPositive`] names a row whose block has no inverse.
    pub fn new(matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace)?;
        Ok(this)
    }
}

impl<const B: usize> BlockJacobi<B, f32> {
    /// [`new`](BlockJacobi::new) for vectors in `f32`; the inverses are worked out in `f64`.
    ///
    /// # Errors
    /// As [`new`](BlockJacobi::new).
    pub fn in_single_precision(matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace)?;
        Ok(this)
    }
}

impl<const B: usize, T: Real> BlockJacobi<B, T> {
    /// Builds it anew, in the memory at hand.
    ///
    /// # Errors
    /// As [`new`](BlockJacobi::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<(), PreconditionerError> {
        self.update_nodes(matrix, subspace, 0..matrix.n_rows())
    }

    /// [`rebuild`](Self::rebuild) of the blocks alone whose rows were written, or whose nodes were constrained or freed,
    /// since the last call. Any matrix can be followed: rows are told apart by stamps that no two writes share.
    ///
    /// # Errors
    /// As [`rebuild`](Self::rebuild).
    pub fn follow(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<(), PreconditionerError> {
        let known = self.stamps.len() == matrix.n_rows() && self.inverses.len() == matrix.n_rows();
        let mut stamps = std::mem::take(&mut self.stamps);
        let before = std::mem::take(&mut self.subspace);
        if known && before == *subspace {
            let written = (0..matrix.n_rows()).filter(|&row| matrix.stamp(row) != stamps[row]);
            self.update_nodes(matrix, subspace, written)?;
        } else if known {
            let written = |&row: &usize| matrix.stamp(row) != stamps[row] || before.get(row) != subspace.get(row);
            self.update_nodes(matrix, subspace, (0..matrix.n_rows()).filter(written))?;
        } else {
            self.rebuild(matrix, subspace)?;
        }
        stamps.clear();
        stamps.extend((0..matrix.n_rows()).map(|row| matrix.stamp(row)));
        self.subspace = before;
        self.subspace.clone_from(subspace);
        self.stamps = stamps;
        Ok(())
    }

    /// Follows a change of the diagonal blocks or of the constraints of `nodes` alone, and a change of their number as
    /// long as all new ones are listed.
    ///
    /// # Errors
    /// As [`rebuild`](Self::rebuild), and [`PreconditionerError::NodeOutOfRange`].
    pub fn update_nodes(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        nodes: impl IntoIterator<Item = usize>,
    ) -> Result<(), PreconditionerError> {
        check_shape(matrix, subspace)?;
        self.stamps.clear();
        self.inverses.resize(matrix.n_rows(), [[T::ZERO; B]; B]);
        for node in nodes {
            check_node(subspace, node)?;
            let inverse = restricted_inverse(&matrix.diagonal(node), &subspace.get(node))
                .map_err(|pivot| PreconditionerError::NotPositive { row: node, pivot })?;
            self.inverses[node] = inverse.map(|row| row.map(T::from_f64));
        }
        Ok(())
    }

    /// [`update_nodes`](Self::update_nodes) for one node.
    ///
    /// # Errors
    /// As [`update_nodes`](Self::update_nodes).
    pub fn update_node(
        &mut self,
        matrix: &BlockCsr<B>,
        subspace: &Subspace<B>,
        node: usize,
    ) -> Result<(), PreconditionerError> {
        self.update_nodes(matrix, subspace, [node])
    }

    /// The restricted inverse of one node's diagonal block.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn inverse(&self, node: usize) -> &Block<B, T> {
        &self.inverses[node]
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        bytes_of(&self.inverses) + bytes_of(&self.stamps)
    }
}

impl<const B: usize, T: Real> Preconditioner<T> for BlockJacobi<B, T> {
    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply(&self, r: &[T], z: &mut [T]) {
        let n = self.inverses.len() * B;
        assert!(r.len() == n && z.len() == n, "block Jacobi of {n} rows");
        self.apply_rows(0, r, z);
    }

    fn by_rows(&self) -> Option<&dyn PreconditionRows<T>> {
        Some(self)
    }
}

impl<const B: usize, T: Real> PreconditionRows<T> for BlockJacobi<B, T> {
    fn apply_rows(&self, first: usize, r: &[T], z: &mut [T]) {
        multiply(&self.inverses[first / B..], r, z);
    }
}

/// `z ← D r` for the block diagonal matrix of `blocks`.
pub(super) fn multiply<const B: usize, T: Real>(blocks: &[Block<B, T>], r: &[T], z: &mut [T]) {
    let (r, z) = (r.as_chunks::<B>().0, z.as_chunks_mut::<B>().0);
    // Left as it is: compiled for wider vectors this takes half as long again, all of it in shuffles.
    for ((block, r), z) in blocks.iter().zip(r).zip(z) {
        for i in 0..B {
            z[i] = (1..B).fold(block[i][0] * r[0], |sum, j| sum + block[i][j] * r[j]);
        }
    }
}
