//! A numbering of the nodes and its inverse.

use crate::sparse::{BlockCsr, SparseError};
use crate::subspace::{Subspace, SubspaceError};

/// A one-to-one renumbering of nodes, known in both directions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Permutation {
    new_to_old: Vec<u32>,
    old_to_new: Vec<u32>,
}

/// What cannot be renumbered, or is no renumbering.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PermutationError {
    /// An entry names a node that does not exist.
    #[error("entry {position} is {node}: there are {n_nodes} nodes")]
    OutOfRange {
        /// Index of the entry.
        position: usize,
        /// The node it names.
        node: u32,
        /// Number of nodes.
        n_nodes: usize,
    },
    /// Two entries name the same node.
    #[error("entry {position} names node {node}, which an earlier entry does as well")]
    Repeated {
        /// Index of the second of the two.
        position: usize,
        /// The node.
        node: u32,
    },
    /// What is to be renumbered has another number of nodes.
    #[error("a permutation of {n_nodes} nodes does not fit {given}")]
    Shape {
        /// Nodes of the permutation.
        n_nodes: usize,
        /// Nodes given.
        given: usize,
    },
    /// A row of the matrix holds what a row may not hold.
    #[error(transparent)]
    Matrix(#[from] SparseError),
    /// A constraint could not be carried over.
    #[error(transparent)]
    Subspace(#[from] SubspaceError),
}

impl Permutation {
    /// Every node keeps its number.
    ///
    /// # Panics
    /// If there are more nodes than 32-bit indices can name.
    #[must_use]
    pub fn identity(n_nodes: usize) -> Self {
        let n = u32::try_from(n_nodes).expect("nodes have 32-bit numbers");
        Self::from_checked((0..n).collect())
    }

    /// Entry `k` is the old number of the node that gets the number `k`.
    ///
    /// # Errors
    /// [`PermutationError::OutOfRange`] or [`PermutationError::Repeated`] if this is not a bijection.
    pub fn from_new_to_old(new_to_old: Vec<u32>) -> Result<Self, PermutationError> {
        let n_nodes = new_to_old.len();
        let mut named = vec![false; n_nodes];
        for (position, &node) in new_to_old.iter().enumerate() {
            let named = named.get_mut(node as usize).ok_or(PermutationError::OutOfRange { position, node, n_nodes })?;
            if std::mem::replace(named, true) {
                return Err(PermutationError::Repeated { position, node });
            }
        }
        Ok(Self::from_checked(new_to_old))
    }

    /// Entry `i` is the number that node `i` gets.
    ///
    /// # Errors
    /// As [`from_new_to_old`](Self::from_new_to_old).
    pub fn from_old_to_new(old_to_new: Vec<u32>) -> Result<Self, PermutationError> {
        Ok(Self::from_new_to_old(old_to_new)?.inverse())
    }

    /// From entries that are known to be a bijection.
    pub(crate) fn from_checked(new_to_old: Vec<u32>) -> Self {
        let mut old_to_new = vec![0; new_to_old.len()];
        for (new, &old) in new_to_old.iter().enumerate() {
            old_to_new[old as usize] = new as u32; // at most as many nodes as `u32` can name
        }
        Self { new_to_old, old_to_new }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.new_to_old.len()
    }

    /// Whether there are no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.new_to_old.is_empty()
    }

    /// The old number of the node that is now `new`.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn old_of(&self, new: usize) -> usize {
        self.new_to_old[new] as usize
    }

    /// The new number of the node that was `old`.
    ///
    /// # Panics
    /// If there is no such node.
    #[must_use]
    pub fn new_of(&self, old: usize) -> usize {
        self.old_to_new[old] as usize
    }

    /// Old numbers in the new order.
    #[must_use]
    pub fn new_to_old(&self) -> &[u32] {
        &self.new_to_old
    }

    /// New numbers in the old order.
    #[must_use]
    pub fn old_to_new(&self) -> &[u32] {
        &self.old_to_new
    }

    /// The way back.
    #[must_use]
    pub fn inverse(self) -> Self {
        Self { new_to_old: self.old_to_new, old_to_new: self.new_to_old }
    }

    /// This renumbering, followed by `next`.
    ///
    /// # Errors
    /// [`PermutationError::Shape`].
    pub fn then(&self, next: &Self) -> Result<Self, PermutationError> {
        self.check(next.len())?;
        Ok(Self::from_checked(next.new_to_old.iter().map(|&middle| self.new_to_old[middle as usize]).collect()))
    }

    /// Writes the entries of `old`, `B` per node, to where the new numbers want them.
    ///
    /// # Panics
    /// If a vector does not hold `B` entries per node.
    pub fn permute<const B: usize, T: Copy>(&self, old: &[T], new: &mut [T]) {
        gather::<B, T>(&self.new_to_old, old, new);
    }

    /// The reverse of [`permute`](Self::permute).
    ///
    /// # Panics
    /// If a vector does not hold `B` entries per node.
    pub fn restore<const B: usize, T: Copy>(&self, new: &[T], old: &mut [T]) {
        gather::<B, T>(&self.old_to_new, new, old);
    }

    /// `Q A Qᵀ`: rows and columns in the new numbers.
    ///
    /// # Errors
    /// [`PermutationError::Shape`]; [`PermutationError::Matrix`] if a block was made not finite behind the matrix's back.
    pub fn matrix<const B: usize>(&self, matrix: &BlockCsr<B>) -> Result<BlockCsr<B>, PermutationError> {
        self.check(matrix.n_rows())?;
        let mut permuted = BlockCsr::new(self.len());
        let (mut places, mut cols, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
        for (new, &old) in self.new_to_old.iter().enumerate() {
            let (old_cols, old_blocks) = matrix.row(old as usize);
            places.clear();
            places.extend(old_cols.iter().enumerate().map(|(at, &col)| (self.old_to_new[col as usize], at)));
            places.sort_unstable();
            cols.clear();
            cols.extend(places.iter().map(|&(col, _)| col));
            blocks.clear();
            blocks.extend(places.iter().map(|&(_, at)| old_blocks[at]));
            permuted.set_row(new, &cols, &blocks)?;
        }
        Ok(permuted)
    }

    /// The same constraints on the nodes under their new numbers.
    ///
    /// # Errors
    /// [`PermutationError::Shape`].
    pub fn subspace<const B: usize>(&self, subspace: &Subspace<B>) -> Result<Subspace<B>, PermutationError> {
        self.check(subspace.n_nodes())?;
        let mut permuted = Subspace::new(self.len());
        let mut constrained: Vec<_> = subspace.constrained().map(|(old, &c)| (self.new_of(old), c)).collect();
        constrained.sort_unstable_by_key(|&(new, _)| new);
        for (new, constraint) in constrained {
            permuted.set(new, constraint)?;
        }
        Ok(permuted)
    }

    fn check(&self, given: usize) -> Result<(), PermutationError> {
        let n_nodes = self.len();
        if given == n_nodes { Ok(()) } else { Err(PermutationError::Shape { n_nodes, given }) }
    }
}

/// `to[k] = from[source[k]]`, node by node.
fn gather<const B: usize, T: Copy>(source: &[u32], from: &[T], to: &mut [T]) {
    let n = source.len() * B;
    assert!(from.len() == n && to.len() == n, "a permuted vector has {n} entries");
    let (from, to) = (from.as_chunks::<B>().0, to.as_chunks_mut::<B>().0);
    for (to, &at) in to.iter_mut().zip(source) {
        *to = from[at as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearOperator;
    use crate::subspace::Constraint;
    use proptest::prelude::*;

    fn permutation(n: usize) -> impl Strategy<Value = Permutation> {
        Just((0..n as u32).collect::<Vec<u32>>())
            .prop_shuffle()
            .prop_map(|order| Permutation::from_new_to_old(order).unwrap())
    }

    /// A matrix with a random pattern, a random vector and two permutations.
    fn case() -> impl Strategy<Value = (BlockCsr<2>, Vec<f64>, Permutation, Permutation)> {
        (1usize..12).prop_flat_map(|n| {
            let numbers = |len| proptest::collection::vec(-1.0..1.0f64, len);
            (
                proptest::collection::vec(any::<bool>(), n * n),
                numbers(4 * n * n),
                numbers(2 * n),
                permutation(n),
                permutation(n),
            )
                .prop_map(move |(stored, numbers, x, p, q)| {
                    let mut a = BlockCsr::new(n);
                    for i in 0..n {
                        let cols: Vec<u32> = (0..n as u32).filter(|&j| stored[i * n + j as usize]).collect();
                        let block = |&j: &u32| {
                            let v = &numbers[4 * (i * n + j as usize)..];
                            [[v[0], v[1]], [v[2], v[3]]]
                        };
                        let blocks: Vec<_> = cols.iter().map(block).collect();
                        a.set_row(i, &cols, &blocks).unwrap();
                    }
                    (a, x, p, q)
                })
        })
    }

    proptest! {
        #[test]
        fn a_renumbered_matrix_does_the_same((a, x, p, q) in case()) {
            let (n, dim) = (a.n_rows(), x.len());
            // Products agree up to the order of summation.
            let (mut y, mut px, mut py, mut back) = (vec![0.0; dim], vec![0.0; dim], vec![0.0; dim], vec![0.0; dim]);
            a.apply(&x, &mut y);
            p.permute::<2, f64>(&x, &mut px);
            p.matrix(&a).unwrap().apply(&px, &mut py);
            p.restore::<2, f64>(&py, &mut back);
            for (a, b) in y.iter().zip(&back) {
                prop_assert!((a - b).abs() <= 1e-13);
            }
            p.restore::<2, f64>(&px, &mut back);
            prop_assert_eq!(&back, &x);
            // Composition and inverse.
            let both = p.then(&q).unwrap();
            prop_assert_eq!(both.matrix(&a).unwrap(), q.matrix(&p.matrix(&a).unwrap()).unwrap());
            prop_assert_eq!(p.then(&p.clone().inverse()).unwrap(), Permutation::identity(n));
            for old in 0..n {
                prop_assert_eq!(p.old_of(p.new_of(old)), old);
            }
            prop_assert_eq!(Permutation::from_old_to_new(p.old_to_new().to_vec()).unwrap(), p);
        }

        #[test]
        fn a_renumbered_subspace_projects_the_same(p in permutation(7), kinds in proptest::array::uniform7(0..4u8), x in proptest::array::uniform14(-1.0..1.0f64)) {
            let mut w = Subspace::<2>::new(7);
            for (node, kind) in kinds.into_iter().enumerate() {
                let constraint = [Constraint::Free, Constraint::Fixed, Constraint::Line([0.6, 0.8]), Constraint::Plane([0.8, -0.6])];
                w.set(node, constraint[kind as usize]).unwrap();
            }
            let mut expected = x;
            w.project(&mut expected);
            let (mut px, mut back) = ([0.0; 14], [0.0; 14]);
            p.permute::<2, f64>(&x, &mut px);
            p.subspace(&w).unwrap().project(&mut px);
            p.restore::<2, f64>(&px, &mut back);
            prop_assert_eq!(back, expected);
        }
    }

    #[test]
    fn what_is_no_bijection_is_refused() {
        let error = Permutation::from_new_to_old(vec![0, 3, 1]).unwrap_err();
        assert_eq!(error, PermutationError::OutOfRange { position: 1, node: 3, n_nodes: 3 });
        let error = Permutation::from_old_to_new(vec![1, 0, 1]).unwrap_err();
        assert_eq!(error, PermutationError::Repeated { position: 2, node: 1 });
        let p = Permutation::identity(3);
        let shape = |given| Some(PermutationError::Shape { n_nodes: 3, given });
        assert_eq!(p.matrix(&BlockCsr::<2>::new(2)).err(), shape(2));
        assert_eq!(p.subspace(&Subspace::<2>::new(4)).err(), shape(4));
        assert_eq!(p.then(&Permutation::identity(0)).err(), shape(0));
        assert!(Permutation::identity(0).is_empty());
    }
}
