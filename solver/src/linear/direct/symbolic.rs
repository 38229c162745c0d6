//! What depends on the pattern alone.

use super::calls::analyse;
use super::elimination::{postordered, with_late_nodes};
use super::lower::Lower;
use super::{DirectError, Method};
#[cfg(feature = "metis")]
use crate::ordering::nested_dissection;
use crate::ordering::{Permutation, minimum_degree};
use crate::sparse::BlockCsr;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::SymbolicCholesky;

/// In which order nodes are eliminated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillOrder<'a> {
    /// As they are numbered.
    Natural,
    /// [`minimum_degree`]: quick to find.
    MinimumDegree,
    /// [`nested_dissection`]: less fill in 3D.
    #[cfg(feature = "metis")]
    NestedDissection,
    /// The caller's.
    Custom(&'a Permutation),
}

/// The analysis of a pattern: an order of elimination and the structure of the factor, for any values and constraints.
#[derive(Debug)]
pub struct Symbolic<const B: usize> {
    pub(super) lower: Lower<B>,
    pub(super) faer: SymbolicCholesky<usize>,
}

impl<const B: usize> Symbolic<B> {
    /// Analyses the pattern of `a`; its values are not looked at. Rows without a diagonal block are given one.
    ///
    /// # Errors
    /// [`DirectError::PatternNotSymmetric`], [`DirectError::Shape`] if a custom order has another number of nodes, an error of
    /// the ordering, or [`DirectError::Faer`] if memory runs out.
    pub fn new(a: &BlockCsr<B>, order: FillOrder<'_>) -> Result<Self, DirectError> {
        let order = fill_order(a, order)?;
        Self::with_order(a, postordered(a, &order), SupernodalThreshold::AUTO)
    }

    /// Analyses an indefinite matrix, such as that of a saddle-point system `[H Cᵀ; C 0]`: nodes of which a diagonal entry is not
    /// positive are eliminated right after the last of their neighbours, when their pivots have grown. Meant for
    /// [`Method::Ldlt`] and [`Method::Lblt`].
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn indefinite(a: &BlockCsr<B>, order: FillOrder<'_>) -> Result<Self, DirectError> {
        let order = fill_order(a, order)?;
        let late = |node: usize| (0..B).any(|k| a.diagonal(node)[k][k] <= 0.0);
        let order = Permutation::from_checked(with_late_nodes(a, &order, late));
        // Pivots are sought inside supernodes only: a simplicial factor would have none to choose from.
        Self::with_order(a, postordered(a, &order), SupernodalThreshold::FORCE_SUPERNODAL)
    }

    fn with_order(a: &BlockCsr<B>, order: Vec<u32>, threshold: SupernodalThreshold) -> Result<Self, DirectError> {
        let lower = Lower::new(a, Permutation::from_checked(order))?;
        let (starts, cols) = lower.upper_columns();
        let faer = analyse(&starts, &cols, threshold)?;
        Ok(Self { lower, faer })
    }

    /// The order of elimination of the nodes.
    #[must_use]
    pub fn order(&self) -> &Permutation {
        self.lower.order()
    }

    /// Number of rows, `B` per node.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.faer.nrows()
    }

    /// Numbers stored in a factor, zeros that fill up its dense parts included.
    #[must_use]
    pub fn stored(&self) -> usize {
        self.faer.len_val()
    }

    /// Whether `method` finds enough to choose its pivots from in this analysis.
    pub(super) fn suits(&self, method: Method) -> bool {
        use faer::sparse::linalg::cholesky::SymbolicCholeskyRaw::Supernodal;
        method != Method::Lblt || matches!(self.faer.raw(), Supernodal(_))
    }

    /// Bytes of the patterns that it keeps.
    pub(super) fn memory_bytes(&self) -> usize {
        self.lower.memory_bytes()
    }
}

fn fill_order<const B: usize>(a: &BlockCsr<B>, order: FillOrder<'_>) -> Result<Permutation, DirectError> {
    Ok(match order {
        FillOrder::Natural => Permutation::identity(a.n_rows()),
        FillOrder::MinimumDegree => minimum_degree(a)?,
        #[cfg(feature = "metis")]
        FillOrder::NestedDissection => nested_dissection(a)?,
        FillOrder::Custom(order) if order.len() == a.n_rows() => order.clone(),
        FillOrder::Custom(order) => {
            return Err(DirectError::Shape {
                what: "the order of elimination",
                expected: a.n_rows(),
                len: order.len(),
            });
        }
    })
}
