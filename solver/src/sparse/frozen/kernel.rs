//! The product of a frozen matrix.
//!
//! The rows of a slice keep `B²` running sums each, one per place of a block, and add them up at the end: the order of operations of
//! the dynamic matrix, so that both give the same bits. The loops over lanes are for the compiler to turn into SIMD.

use super::{Frozen, NONE, Slice};
use crate::LinearOperator;
use crate::real::Real;
use crate::simd;
use crate::sparse::kernel::CROSSOVER;
use crate::team::Team;
use crate::vector::{self, CHUNK, Sums};
use pulp::NullaryFnOnce;
#[cfg(target_arch = "x86_64")]
use pulp::x86::V3;
use std::ops::Range;

impl<const B: usize, T: Real> LinearOperator<T> for Frozen<B, T> {
    fn dim(&self) -> usize {
        self.n_rows * B
    }

    fn apply(&self, x: &[T], y: &mut [T]) {
        self.check_lengths(x, y);
        self.multiply(0, x, y, None);
    }

    fn apply_dot(&self, x: &[T], y: &mut [T]) -> f64 {
        self.check_lengths(x, y);
        let mut sums = Sums::new();
        self.multiply(0, x, y, Some(sums.groups()));
        sums.total(x.len())
    }

    fn apply_on(&self, team: &Team, x: &[T], y: &mut [T]) {
        self.check_lengths(x, y);
        if !self.pays(team) {
            return self.multiply(0, x, y, None);
        }
        let n = y.len();
        team.each(&mut team.split(y)[..team.size()], |member, y| {
            self.multiply(team.share(n, member).start, x, y, None)
        });
    }

    fn apply_many(&self, team: &Team, k: usize, x: &[T], y: &mut [T], _: &mut [T]) {
        self.multiply_many(team, k, x, y);
    }

    fn apply_dot_on(&self, team: &Team, x: &[T], y: &mut [T]) -> f64 {
        self.check_lengths(x, y);
        if !self.pays(team) {
            return self.apply_dot(x, y);
        }
        let n = y.len();
        let mut sums = Sums::new();
        let mut y = team.split(y).into_iter();
        let mut parts = team.split_sums(n, &mut sums).map(|sums| (y.next(), sums));
        team.each(&mut parts[..team.size()], |member, (y, sums)| {
            let y = y.take().unwrap_or_default();
            self.multiply(team.share(n, member).start, x, y, Some(sums));
        });
        sums.total(n)
    }
}

impl<const B: usize, T: Real> Frozen<B, T> {
    /// Whether a product is long enough to be shared.
    fn pays(&self, team: &Team) -> bool {
        team.size() > 1 && self.streamed * B * B >= CROSSOVER
    }

    fn check_lengths(&self, x: &[T], y: &[T]) {
        let n = self.dim();
        assert!(x.len() == n && y.len() == n, "matrix of {n} rows applied to {} and {} entries", x.len(), y.len());
    }

    /// `y ← A x` for the rows that hold the entries from `first` on, as many as `y` has; `first` is the start of a group. Puts the
    /// sums of `xᵀy` by group into `sums`.
    fn multiply(&self, first: usize, x: &[T], y: &mut [T], sums: Option<&mut [f64]>) {
        let windows = first / CHUNK..(first + y.len()).div_ceil(CHUNK);
        #[cfg(target_arch = "x86_64")]
        if let Some(ops) = V3::try_new() {
            // For AVX-512 the same operations, with registers for all sums of a slice.
            return simd::dispatch(Product { ops, frozen: self, windows, first, x, y, sums });
        }
        simd::dispatch(Product { ops: Portable, frozen: self, windows, first, x, y, sums });
    }
}

/// How the lanes of a slice are worked through.
trait LaneOps<T: Real>: Copy {
    /// `sum + a b` lane by lane, rounded twice.
    fn add_product(self, sum: T::Lanes, a: T::Lanes, b: T::Lanes) -> T::Lanes;

    /// Entry `[j][lane]` is number `j` of block `cols[lane]` of `x`.
    #[inline(always)]
    fn gather<const B: usize>(self, x: &[[T; B]], cols: &[u32]) -> [T::Lanes; B] {
        let mut lanes = [T::Lanes::default(); B];
        for (lane, &col) in cols.iter().enumerate() {
            let x = x[col as usize];
            for j in 0..B {
                lanes[j][lane] = x[j];
            }
        }
        lanes
    }
}

/// Left to the compiler.
#[derive(Clone, Copy)]
struct Portable;

impl<T: Real> LaneOps<T> for Portable {
    #[inline(always)]
    fn add_product(self, mut sum: T::Lanes, a: T::Lanes, b: T::Lanes) -> T::Lanes {
        for lane in 0..T::LANES {
            sum[lane] += a[lane] * b[lane];
        }
        sum
    }
}

#[cfg(target_arch = "x86_64")]
impl<T: Real> LaneOps<T> for V3 {
    #[inline(always)]
    fn add_product(self, sum: T::Lanes, a: T::Lanes, b: T::Lanes) -> T::Lanes {
        T::add_product(self, sum, a, b)
    }

    #[inline(always)]
    fn gather<const B: usize>(self, x: &[[T; B]], cols: &[u32]) -> [T::Lanes; B] {
        let mut lanes = [T::Lanes::default(); B];
        let cols = &cols[..T::LANES];
        if B == 1 {
            lanes[0] = T::lanes(
                #[inline(always)]
                |lane| x[cols[lane] as usize][0],
            );
            return lanes;
        }
        // Two numbers a load: placing all of them one by one takes half as long again.
        [lanes[0], lanes[1]] = T::sort_pairs(
            self,
            #[inline(always)]
            |lane| {
                let x = &x[cols[lane] as usize];
                [x[0], x[1]]
            },
        );
        for j in 2..B {
            lanes[j] = T::lanes(
                #[inline(always)]
                |lane| x[cols[lane] as usize][j],
            );
        }
        lanes
    }
}

/// One pass over a range of windows.
struct Product<'a, const B: usize, T: Real, O> {
    ops: O,
    frozen: &'a Frozen<B, T>,
    windows: Range<usize>,
    /// Entry at which `y` begins.
    first: usize,
    x: &'a [T],
    y: &'a mut [T],
    /// Sums of `xᵀy` by group.
    sums: Option<&'a mut [f64]>,
}

impl<const B: usize, T: Real, O: LaneOps<T>> NullaryFnOnce for Product<'_, B, T, O> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { ops, frozen, windows, first, x, y, mut sums } = self;
        let group = vector::group_len(x.len());
        for (window, y) in windows.zip(y.chunks_mut(CHUNK)) {
            multiply_window(ops, frozen, window, x, y);
            if let Some(sums) = &mut sums {
                let at = window * CHUNK;
                sums[(at - first) / group] += vector::chunk_dot(&x[at..at + y.len()], y);
            }
        }
    }
}

#[inline(always)]
fn multiply_window<const B: usize, T: Real>(
    ops: impl LaneOps<T>,
    frozen: &Frozen<B, T>,
    window: usize,
    x: &[T],
    y: &mut [T],
) {
    let x = x.as_chunks::<B>().0;
    let y = y.as_chunks_mut::<B>().0;
    let per_window = Frozen::<B, T>::SLICES_PER_WINDOW;
    let first_row = window * Frozen::<B, T>::ROWS_PER_WINDOW;
    for slice in &frozen.slices[window * per_window..(window + 1) * per_window] {
        let sums = multiply_slice(ops, frozen, slice, x);
        for (lane, &row) in slice.rows[..T::LANES].iter().enumerate() {
            if row != NONE {
                y[row as usize - first_row] = std::array::from_fn(|i| sums[i][lane]);
            }
        }
    }
}

/// Entry `[i][lane]` is row `i` of the lane's block row.
#[inline(always)]
fn multiply_slice<const B: usize, T: Real>(
    ops: impl LaneOps<T>,
    frozen: &Frozen<B, T>,
    slice: &Slice,
    x: &[[T; B]],
) -> [T::Lanes; B] {
    let mut sums = [[T::Lanes::default(); B]; B];
    let range = slice.slot.range();
    let cols = &frozen.cols[range.start * T::LANES..range.end * T::LANES];
    for (cols, block) in cols.chunks_exact(T::LANES).zip(&frozen.vals[range]) {
        let lanes = ops.gather(x, cols);
        for i in 0..B {
            for j in 0..B {
                sums[i][j] = ops.add_product(sums[i][j], block[i][j], lanes[j]);
            }
        }
    }
    sums.map(|mut row| {
        for j in 1..B {
            for lane in 0..T::LANES {
                let term = row[j][lane];
                row[0][lane] += term;
            }
        }
        row[0]
    })
}
