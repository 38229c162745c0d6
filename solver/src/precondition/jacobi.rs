//! Jacobi, i.e. diagonal scaling.

use super::restricted::{check_node, check_shape, restricted_inverse};
use super::{PreconditionRows, Preconditioner, PreconditionerError};
use crate::Block;
use crate::memory::bytes_of;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};

/// Divides by the diagonal; at a constrained node by the diagonal restricted to its allowed moves, `T (Tᵀ D T)⁻¹ Tᵀ` with
/// `D = diag(d₁ … d_B)`.
#[derive(Clone, Debug, Default)]
pub struct Jacobi<const B: usize> {
    /// `1/d` of the free nodes, zero at constrained ones.
    inverses: Vec<[f64; B]>,
    /// Nodes that are neither free nor fixed, ascending.
    constrained: Vec<(usize, Block<B>)>,
}

impl<const B: usize> Jacobi<B> {
    /// The preconditioner of `P_W A P_W`.
    ///
    /// # Errors
    /// [`PreconditionerError::Shape`]; [`PreconditionerError::NotPositive`] names a row whose diagonal is not positive.
    pub fn new(matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<Self, PreconditionerError> {
        let mut this = Self::default();
        this.rebuild(matrix, subspace)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand.
    ///
    /// # Errors
    /// As [`new`](Self::new); the preconditioner is then of no use until a rebuild succeeds.
    pub fn rebuild(&mut self, matrix: &BlockCsr<B>, subspace: &Subspace<B>) -> Result<(), PreconditionerError> {
        self.constrained.clear();
        self.update_nodes(matrix, subspace, 0..matrix.n_rows())
    }

    /// Follows a change of the diagonal or of the constraints of `nodes` alone, and a change of their number as long as
    /// all new ones are listed.
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
        let n_rows = matrix.n_rows();
        self.inverses.resize(n_rows, [0.0; B]);
        let kept = self.constrained.partition_point(|c| c.0 < n_rows);
        self.constrained.truncate(kept);
        for node in nodes {
            check_node(subspace, node)?;
            self.set(node, &matrix.diagonal(node), &subspace.get(node))
                .map_err(|pivot| PreconditionerError::NotPositive { row: node, pivot })?;
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

    fn set(&mut self, node: usize, block: &Block<B>, constraint: &Constraint<B>) -> Result<(), f64> {
        let diagonal: Block<B> =
            std::array::from_fn(|i| std::array::from_fn(|j| if i == j { block[i][i] } else { 0.0 }));
        let inverse = restricted_inverse(&diagonal, constraint)?;
        self.inverses[node] = match constraint {
            Constraint::Free => std::array::from_fn(|k| 1.0 / diagonal[k][k]),
            _ => [0.0; B],
        };
        let place = self.constrained.binary_search_by_key(&node, |c| c.0);
        let in_list = matches!(constraint, Constraint::Line(_) | Constraint::Plane(_));
        match (place, in_list) {
            (Ok(at), true) => self.constrained[at].1 = inverse,
            (Ok(at), false) => drop(self.constrained.remove(at)),
            (Err(at), true) => self.constrained.insert(at, (node, inverse)),
            (Err(_), false) => {}
        }
        Ok(())
    }

    /// Bytes that it keeps, spare room included.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        bytes_of(&self.inverses) + bytes_of(&self.constrained)
    }
}

impl<const B: usize> Preconditioner for Jacobi<B> {
    /// # Panics
    /// If a vector does not have the length of the matrix.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        let n = self.inverses.len() * B;
        assert!(r.len() == n && z.len() == n, "Jacobi of {n} rows");
        self.apply_rows(0, r, z);
    }

    fn by_rows(&self) -> Option<&dyn PreconditionRows> {
        Some(self)
    }
}

impl<const B: usize> PreconditionRows for Jacobi<B> {
    fn apply_rows(&self, first: usize, r: &[f64], z: &mut [f64]) {
        for ((z, r), inverse) in z.iter_mut().zip(r).zip(&self.inverses.as_flattened()[first..]) {
            *z = inverse * r;
        }
        let nodes = first / B..(first + r.len()) / B;
        let (r, z) = (r.as_chunks::<B>().0, z.as_chunks_mut::<B>().0);
        let from = self.constrained.partition_point(|(node, _)| *node < nodes.start);
        for (node, inverse) in self.constrained[from..].iter().take_while(|(node, _)| *node < nodes.end) {
            let r = r[node - nodes.start];
            z[node - nodes.start] = inverse.map(|row| row.iter().zip(&r).map(|(a, r)| a * r).sum());
        }
    }
}
