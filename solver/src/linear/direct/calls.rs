//! The calls to faer. None is generic, so that its kernels are compiled with this crate, once for each number format, and not
//! again in every crate that factors something.

use super::Method;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::perm::PermRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, IntranodeLbltRef, LdltRef, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{FaerError, SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

/// Threads inside supernodes cost more than they save at the sizes of this library.
const PAR: Par = Par::Seq;

/// The structure of the factor of a matrix whose upper triangle has these columns, in their order.
pub(super) fn analyse(
    starts: &[usize],
    columns: &[usize],
    threshold: SupernodalThreshold,
) -> Result<SymbolicCholesky<usize>, FaerError> {
    let n = starts.len() - 1;
    let upper = SymbolicSparseColMatRef::new_checked(n, n, starts, None, columns);
    let params = CholeskySymbolicParams { supernodal_flop_ratio_threshold: threshold, ..Default::default() };
    // Without a permutation of its own, faer reads the upper triangle whatever side it is told.
    factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
}

/// The order of pivots and the parts beside the diagonal that [`Method::Lblt`] makes; empty for the others.
#[derive(Debug)]
pub struct Pivots<T> {
    pub(super) subdiagonal: Vec<T>,
    pub(super) order: Vec<usize>,
    pub(super) inverse: Vec<usize>,
}

/// What faer does for a number format; `lower` are the values of the lower triangle in a checked pattern.
pub trait Calls: faer::traits::RealField {
    /// Memory of a factorisation.
    fn factor_scratch(faer: &SymbolicCholesky<usize>, method: Method) -> StackReq;

    /// Memory of a solve with `k` right sides.
    fn solve_scratch(faer: &SymbolicCholesky<usize>, k: usize) -> StackReq;

    /// `L Lᵀ`; false if a pivot is not positive.
    fn llt(
        faer: &SymbolicCholesky<usize>,
        lower: SparseColMatRef<'_, usize, Self>,
        values: &mut [Self],
        memory: &mut MemBuffer,
    ) -> bool;

    /// `L D Lᵀ`, up to the first pivot that is zero.
    fn ldlt(
        faer: &SymbolicCholesky<usize>,
        lower: SparseColMatRef<'_, usize, Self>,
        values: &mut [Self],
        memory: &mut MemBuffer,
    );

    /// `L B Lᵀ`.
    fn lblt(
        faer: &SymbolicCholesky<usize>,
        lower: SparseColMatRef<'_, usize, Self>,
        values: &mut [Self],
        pivots: &mut Pivots<Self>,
        memory: &mut MemBuffer,
    );

    /// Overwrites columns of length `n` by those of the solution.
    fn solve(
        factor: (&SymbolicCholesky<usize>, Method, &[Self], &Pivots<Self>),
        n: usize,
        columns: &mut [Self],
        memory: &mut MemBuffer,
    );
}

macro_rules! compiled_here {
    ($number:ty) => {
        impl Calls for $number {
            fn factor_scratch(faer: &SymbolicCholesky<usize>, method: Method) -> StackReq {
                let ldlt = faer.factorize_numeric_ldlt_scratch::<$number>(PAR, Spec::default());
                match method {
                    // A factorisation that fails is done again as L D Lᵀ, to name the pivot.
                    Method::Llt => faer.factorize_numeric_llt_scratch::<$number>(PAR, Spec::default()).or(ldlt),
                    Method::Ldlt => ldlt,
                    Method::Lblt => faer.factorize_numeric_intranode_lblt_scratch::<$number>(PAR, Spec::default()),
                }
            }

            fn solve_scratch(faer: &SymbolicCholesky<usize>, k: usize) -> StackReq {
                faer.solve_in_place_scratch::<$number>(k, PAR)
            }

            fn llt(
                faer: &SymbolicCholesky<usize>,
                lower: SparseColMatRef<'_, usize, $number>,
                values: &mut [$number],
                memory: &mut MemBuffer,
            ) -> bool {
                let (stack, params) = (MemStack::new(memory), Spec::default());
                faer.factorize_numeric_llt(values, lower, Side::Lower, Default::default(), PAR, stack, params).is_ok()
            }

            fn ldlt(
                faer: &SymbolicCholesky<usize>,
                lower: SparseColMatRef<'_, usize, $number>,
                values: &mut [$number],
                memory: &mut MemBuffer,
            ) {
                let (stack, params) = (MemStack::new(memory), Spec::default());
                // Where it meets a pivot of zero, faer stops: that zero is left on the diagonal for the caller to find.
                let _ = faer.factorize_numeric_ldlt(values, lower, Side::Lower, Default::default(), PAR, stack, params);
            }

            fn lblt(
                faer: &SymbolicCholesky<usize>,
                lower: SparseColMatRef<'_, usize, $number>,
                values: &mut [$number],
                pivots: &mut Pivots<$number>,
                memory: &mut MemBuffer,
            ) {
                let Pivots { subdiagonal, order, inverse } = pivots;
                let (stack, params) = (MemStack::new(memory), Spec::default());
                faer.factorize_numeric_intranode_lblt(
                    values,
                    subdiagonal,
                    order,
                    inverse,
                    lower,
                    Side::Lower,
                    PAR,
                    stack,
                    params,
                );
            }

            fn solve(
                (faer, method, values, pivots): (&SymbolicCholesky<usize>, Method, &[$number], &Pivots<$number>),
                n: usize,
                columns: &mut [$number],
                memory: &mut MemBuffer,
            ) {
                let k = columns.len() / n;
                let x = MatMut::from_column_major_slice_mut(columns, n, k);
                let stack = MemStack::new(memory);
                match method {
                    Method::Llt => LltRef::new(faer, values).solve_in_place_with_conj(Conj::No, x, PAR, stack),
                    Method::Ldlt => LdltRef::new(faer, values).solve_in_place_with_conj(Conj::No, x, PAR, stack),
                    Method::Lblt => {
                        let order = PermRef::new_checked(&pivots.order, &pivots.inverse, n);
                        let factor = IntranodeLbltRef::new(faer, values, &pivots.subdiagonal, order);
                        factor.solve_in_place_with_conj(Conj::No, x, PAR, stack);
                    }
                }
            }
        }
    };
}

compiled_here!(f64);
compiled_here!(f32);
