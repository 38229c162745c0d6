//! A factor that is made again in its own memory.

use super::numeric::{Memory, Numeric};
use super::{DirectError, FactorNumber, Method, Symbolic};
use crate::LinearOperator;
use crate::memory::{bytes_of, bytes_of_all};
use crate::precondition::Preconditioner;
use crate::real::Real;
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;
use crate::vector::first_not_finite;
use std::fmt;
use std::sync::{Arc, Mutex, PoisonError};

/// A factor of `P A P + s (I − P)`, with `P` the projection of a subspace and `s` as large as the diagonal.
///
/// As a [`Preconditioner`] it solves with the projected matrix; what it is given and what it returns lie in the subspace.
/// A factor in `f32` takes half the memory and time, and gives six digits.
pub struct Factor<const B: usize, T: FactorNumber = f64> {
    symbolic: Arc<Symbolic<B>>,
    numeric: Numeric<T>,
    ready: bool,
    lower: Vec<T>,
    largest: Vec<f64>,
    /// A known solution, and what comes back.
    known: Vec<f64>,
    probe: Vec<f64>,
    work: Mutex<Work<T>>,
}

/// Right sides in the order of elimination, and what faer needs to solve for them.
#[derive(Debug)]
struct Work<T> {
    columns: Vec<T>,
    memory: Memory,
}

impl<const B: usize, T: FactorNumber> Factor<B, T> {
    /// Factors `a` on the subspace `w`.
    ///
    /// # Errors
    /// [`DirectError`]: the matrix does not fit the analysis or the subspace, is not symmetric, not finite, not definite, or
    /// singular. A matrix that [`Method::Lblt`] is to factor must have been analysed by [`Symbolic::indefinite`], or be so large
    /// that its factor has supernodes all the same; it is [`DirectError::NoPivots`] otherwise.
    pub fn new(
        symbolic: Arc<Symbolic<B>>,
        method: Method,
        a: &BlockCsr<B>,
        w: &Subspace<B>,
    ) -> Result<Self, DirectError> {
        if !symbolic.suits(method) {
            return Err(DirectError::NoPivots);
        }
        let n = symbolic.dim();
        let work = Work { columns: vec![T::ZERO; n], memory: Memory::for_solves::<B, T>(&symbolic, 1)? };
        let mut this = Self {
            numeric: Numeric::new(&symbolic, method)?,
            ready: false,
            lower: vec![T::ZERO; symbolic.lower.columns().1.len()],
            largest: vec![0.0; n / B.max(1)],
            known: vec![0.0; n],
            probe: vec![0.0; n],
            work: Mutex::new(work),
            symbolic,
        };
        this.refactor(a, w)?;
        Ok(this)
    }

    /// Factors other values, on the same or another subspace. Allocates nothing.
    ///
    /// # Errors
    /// As [`new`](Self::new); the factor is then of no use until a refactorisation succeeds.
    pub fn refactor(&mut self, a: &BlockCsr<B>, w: &Subspace<B>) -> Result<(), DirectError> {
        self.ready = false;
        let (expected, len) = (a.n_rows(), w.n_nodes());
        if len != expected {
            return Err(DirectError::Shape { what: "the subspace, in nodes,", expected, len });
        }
        self.symbolic.lower.gather(a, w, &mut self.largest, &mut self.lower)?;
        self.numeric.factor(&self.symbolic, &self.lower)?;
        self.ready = true;
        let checked = self.check_known_solution(a, w);
        self.ready = checked.is_ok();
        checked
    }

    /// The analysis that the factor is of.
    #[must_use]
    pub fn symbolic(&self) -> &Arc<Symbolic<B>> {
        &self.symbolic
    }

    /// Number of rows, `B` per node.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.symbolic.dim()
    }

    /// `x ← (P A P + s (I − P))⁻¹ x` for one or more right sides, one after the other: several at once take less time each.
    /// Allocates nothing unless there are more of them than ever before.
    ///
    /// # Errors
    /// [`DirectError::Shape`] if the length is no multiple of [`dim`](Self::dim), [`DirectError::RightSideNotFinite`],
    /// [`DirectError::NoFactor`]; `x` is then as it was.
    pub fn solve(&self, x: &mut [f64]) -> Result<(), DirectError> {
        let n = self.dim();
        if !self.ready {
            return Err(DirectError::NoFactor);
        }
        if !x.len().is_multiple_of(n) {
            return Err(DirectError::Shape { what: "the right side", expected: n, len: x.len() });
        }
        if let Some(index) = first_not_finite(x) {
            return Err(DirectError::RightSideNotFinite { index });
        }
        if x.is_empty() {
            return Ok(());
        }
        let mut work = self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let Work { columns, memory } = &mut *work;
        if columns.len() < x.len() {
            *memory = Memory::for_solves::<B, T>(&self.symbolic, x.len() / n)?;
            columns.resize(x.len(), T::ZERO);
        }
        let columns = &mut columns[..x.len()];
        let order = self.symbolic.order();
        for (x, column) in x.chunks_exact_mut(n).zip(columns.chunks_exact_mut(n)) {
            let (column, x) = (column.as_chunks_mut::<B>().0, x.as_chunks_mut::<B>().0);
            let scale = power_of_two_above(x.as_flattened());
            for (to, &from) in column.iter_mut().zip(order.new_to_old()) {
                *to = x[from as usize].map(|v| <T as Real>::from_f64(v / scale));
            }
            // Kept where the result will go: nothing else remembers it.
            x.as_flattened_mut()[0] = scale;
        }
        self.numeric.solve(&self.symbolic, columns, memory);
        for (x, column) in x.chunks_exact_mut(n).zip(columns.chunks_exact(n)) {
            let scale = x[0];
            let (column, x) = (column.as_chunks::<B>().0, x.as_chunks_mut::<B>().0);
            for (to, &from) in x.iter_mut().zip(order.old_to_new()) {
                *to = column[from as usize].map(|v| v.to_f64() * scale);
            }
        }
        Ok(())
    }

    /// Solves for a known vector: a singular matrix has a factor by rounding alone, and one without pivots across supernodes may
    /// have a wrong one. The vector leans to one side, so that it is no stranger to a translation that costs nothing. Takes
    /// one product in `f64` and one solve.
    fn check_known_solution(&mut self, a: &BlockCsr<B>, w: &Subspace<B>) -> Result<(), DirectError> {
        let (mut x, mut known) = (std::mem::take(&mut self.probe), std::mem::take(&mut self.known));
        let sign = |i: usize| if (i.wrapping_mul(0x9e37_79b9) >> 13) & 1 == 0 { 1.0 } else { -1.0 };
        known.iter_mut().enumerate().for_each(|(i, known)| *known = 1.0 + 0.5 * sign(i));
        w.project(&mut known);
        a.apply(&known, &mut x);
        w.project(&mut x);
        let solved = self.solve(&mut x);
        // NaN counts as infinite.
        let error = x.iter().zip(&known).map(|(x, known)| (x - known).abs());
        let worst = error.fold(0.0, |worst, e| if e <= worst { worst } else { e });
        (self.probe, self.known) = (x, known);
        solved?;
        if worst <= T::KNOWN_SOLUTION { Ok(()) } else { Err(DirectError::IllConditioned { error: worst }) }
    }

    /// Bytes that it keeps, spare room and the analysis included, but for the tree that the analysis is kept as.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let numbers = bytes_of(&self.lower) + bytes_of_all([&self.largest, &self.known, &self.probe]);
        let work = self.work.lock().map_or(0, |work| bytes_of(&work.columns) + work.memory.bytes());
        self.symbolic.memory_bytes() + self.numeric.memory_bytes() + numbers + work
    }
}

impl<const B: usize, T: FactorNumber> Preconditioner for Factor<B, T> {
    /// An `r` that is not finite gives a `z` of NaN, which a solver finds and names.
    ///
    /// # Panics
    /// If a vector does not have the length of the matrix, or the last refactorisation failed.
    fn apply(&self, r: &[f64], z: &mut [f64]) {
        assert_eq!(r.len(), self.dim(), "right side of a factor");
        z.copy_from_slice(r);
        match self.solve(z) {
            Ok(()) => {}
            Err(DirectError::RightSideNotFinite { .. }) => z.fill(f64::NAN),
            Err(error) => panic!("{error}"),
        }
    }
}

impl<const B: usize, T: FactorNumber> fmt::Debug for Factor<B, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { symbolic, numeric, ready, .. } = self;
        let mut summary = f.debug_struct("Factor");
        summary.field("method", &numeric.method).field("dim", &symbolic.dim()).field("stored", &symbolic.stored());
        summary.field("ready", ready).finish_non_exhaustive()
    }
}

/// The power of two that brings the largest entry near one, so that a small right side does not vanish in `f32`.
fn power_of_two_above(x: &[f64]) -> f64 {
    let largest = x.iter().fold(0.0f64, |largest, v| largest.max(v.abs()));
    if largest < f64::MIN_POSITIVE / f64::EPSILON { 1.0 } else { largest.log2().ceil().clamp(-960.0, 1020.0).exp2() }
}
