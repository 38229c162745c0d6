//! The numbers of a factor.

use super::calls::{Calls, Pivots};
use super::symbolic::Symbolic;
use super::{DirectError, Method};
use crate::memory::bytes_of_all;
use crate::real::Real;
use faer::dyn_stack::{MemBuffer, StackReq};
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymbolicCholeskyRaw};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};

/// The number formats that factors come in: `f64` and `f32`.
pub trait FactorNumber: Real + Calls {
    /// A known solution may come back with this relative error: where a factor of the format is still of use.
    #[doc(hidden)]
    const KNOWN_SOLUTION: f64;
}

impl FactorNumber for f64 {
    const KNOWN_SOLUTION: f64 = 1e-4;
}

impl FactorNumber for f32 {
    const KNOWN_SOLUTION: f64 = 0.25;
}

/// A pivot of `L Lᵀ` that is a smaller part of its diagonal entry than this many roundings, times the root of the number of rows,
/// is one by rounding alone.
const ROUNDINGS: f64 = 4.0;

/// `L`, `D` and the order of pivots, in memory that is made once.
#[derive(Debug)]
pub(super) struct Numeric<T> {
    pub(super) method: Method,
    values: Vec<T>,
    pivots: Pivots<T>,
    memory: Memory,
}

impl<T: FactorNumber> Numeric<T> {
    pub(super) fn new<const B: usize>(symbolic: &Symbolic<B>, method: Method) -> Result<Self, DirectError> {
        let pivoted = if method == Method::Lblt { symbolic.dim() } else { 0 };
        let pivots = Pivots {
            subdiagonal: vec![T::ZERO; pivoted],
            order: (0..pivoted).collect(),
            inverse: (0..pivoted).collect(),
        };
        let memory = Memory::new(T::factor_scratch(&symbolic.faer, method))?;
        Ok(Self { method, values: vec![T::ZERO; symbolic.stored()], pivots, memory })
    }

    /// Factors the lower triangle `lower`, in the order of elimination.
    pub(super) fn factor<const B: usize>(&mut self, symbolic: &Symbolic<B>, lower: &[T]) -> Result<(), DirectError> {
        let n = symbolic.dim();
        let (starts, rows) = symbolic.lower.columns();
        // Both are checked when they are made.
        let pattern = SymbolicSparseColMatRef::new_checked(n, n, starts, None, rows);
        let a = SparseColMatRef::new(pattern, lower);
        match self.method {
            Method::Llt => self.llt(symbolic, a),
            Method::Ldlt => {
                self.ldlt(&symbolic.faer, a);
                self.check_signed(symbolic)
            }
            Method::Lblt => {
                T::lblt(&symbolic.faer, a, &mut self.values, &mut self.pivots, &mut self.memory.0);
                self.check_signed(symbolic)
            }
        }
    }

    fn llt<const B: usize>(
        &mut self,
        symbolic: &Symbolic<B>,
        a: SparseColMatRef<'_, usize, T>,
    ) -> Result<(), DirectError> {
        let faer = &symbolic.faer;
        if !T::llt(faer, a, &mut self.values, &mut self.memory.0) {
            return Err(self.pivot_that_failed(symbolic, a));
        }
        let tolerance = ROUNDINGS * (symbolic.dim() as f64).sqrt() * <T as Real>::EPSILON.to_f64();
        let (starts, entries) = (a.col_ptr(), a.val());
        let square = |l: T| l.to_f64() * l.to_f64();
        // NaN is not above anything.
        let too_small = |row: usize, l: T| {
            let pivot = square(l);
            !(pivot > tolerance * entries[starts[row]].to_f64() && pivot.is_finite())
        };
        match find_on_diagonal(faer, &self.values, too_small) {
            Some((row, l)) => {
                Err(DirectError::NotPositiveDefinite { row: caller_row(symbolic, row), pivot: square(l) })
            }
            None => Ok(()),
        }
    }

    /// Names the pivot at which `L Lᵀ` ended, which faer does not: the same elimination again as `L D Lᵀ`.
    fn pivot_that_failed<const B: usize>(
        &mut self,
        symbolic: &Symbolic<B>,
        a: SparseColMatRef<'_, usize, T>,
    ) -> DirectError {
        self.ldlt(&symbolic.faer, a);
        let mut smallest = (0, T::ZERO);
        let negative = find_on_diagonal(&symbolic.faer, &self.values, |row, d| {
            if row == 0 || d < smallest.1 {
                smallest = (row, d);
            }
            d <= T::ZERO || !Real::is_finite(d)
        });
        // Where rounding alone decides, the smallest pivot is the one.
        let (row, pivot) = negative.unwrap_or(smallest);
        DirectError::NotPositiveDefinite { row: caller_row(symbolic, row), pivot: pivot.to_f64() }
    }

    /// Where it meets a pivot of zero, faer stops: that zero is left on the diagonal for the check that follows.
    fn ldlt(&mut self, faer: &SymbolicCholesky<usize>, a: SparseColMatRef<'_, usize, T>) {
        self.values.fill(T::ZERO);
        T::ldlt(faer, a, &mut self.values, &mut self.memory.0);
    }

    /// Every pivot, or pair of them, has an inverse.
    fn check_signed<const B: usize>(&self, symbolic: &Symbolic<B>) -> Result<(), DirectError> {
        let mut pair = T::ZERO;
        let unusable = |at: usize, d: T| {
            let below = self.pivots.subdiagonal.get(at).copied().unwrap_or(T::ZERO);
            let alone = below == T::ZERO && pair == T::ZERO;
            pair = below;
            !(Real::is_finite(d) && Real::is_finite(below)) || (alone && d == T::ZERO)
        };
        match find_on_diagonal(&symbolic.faer, &self.values, unusable) {
            Some((at, d)) => {
                let row = caller_row(symbolic, self.pivots.order.get(at).copied().unwrap_or(at));
                Err(DirectError::Singular { row, pivot: d.to_f64() })
            }
            None => Ok(()),
        }
    }

    /// `x ← A⁻¹ x` for columns of length `n` one after the other, in the order of elimination.
    pub(super) fn solve<const B: usize>(&self, symbolic: &Symbolic<B>, columns: &mut [T], memory: &mut Memory) {
        let factor = (&symbolic.faer, self.method, &self.values[..], &self.pivots);
        T::solve(factor, symbolic.dim(), columns, &mut memory.0);
    }

    /// Bytes that it keeps, spare room included.
    pub(super) fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.values, &self.pivots.subdiagonal])
            + bytes_of_all([&self.pivots.order, &self.pivots.inverse])
            + self.memory.bytes()
    }
}

/// Working memory of faer.
pub(super) struct Memory(MemBuffer);

impl Memory {
    pub(super) fn new(scratch: StackReq) -> Result<Self, DirectError> {
        MemBuffer::try_new(scratch).map(Self).map_err(|_| DirectError::Faer(faer::sparse::FaerError::OutOfMemory))
    }

    /// Enough for solves with `k` right sides.
    pub(super) fn for_solves<const B: usize, T: FactorNumber>(
        symbolic: &Symbolic<B>,
        k: usize,
    ) -> Result<Self, DirectError> {
        Self::new(T::solve_scratch(&symbolic.faer, k))
    }

    /// How many there are.
    pub(super) fn bytes(&self) -> usize {
        self.0.len()
    }
}

impl std::fmt::Debug for Memory {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Memory").finish_non_exhaustive()
    }
}

fn caller_row<const B: usize>(symbolic: &Symbolic<B>, row: usize) -> usize {
    symbolic.order().old_of(row / B) * B + row % B
}

/// The first entry on the diagonal of `L` or `D`, in the order of elimination, that `test` picks.
fn find_on_diagonal<T: FactorNumber>(
    faer: &SymbolicCholesky<usize>,
    values: &[T],
    mut test: impl FnMut(usize, T) -> bool,
) -> Option<(usize, T)> {
    let mut pick = |row: usize, at: usize| test(row, values[at]).then(|| (row, values[at]));
    match faer.raw() {
        SymbolicCholeskyRaw::Simplicial(l) => (0..l.ncols()).find_map(|col| pick(col, l.col_ptr()[col])),
        SymbolicCholeskyRaw::Supernodal(l) => (0..l.n_supernodes()).find_map(|s| {
            let columns = l.supernode_begin()[s]..l.supernode_end()[s];
            let n_rows = columns.len() + l.supernode(s).pattern().len();
            let first = l.col_ptr_for_val()[s];
            columns.enumerate().find_map(|(j, col)| pick(col, first + j * (n_rows + 1)))
        }),
    }
}
