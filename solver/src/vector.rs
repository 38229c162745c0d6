//! Vector kernels whose sums have a fixed shape.
//!
//! A sum runs over chunks of [`CHUNK`] entries; inside a chunk sixteen lanes accumulate independently, in the format of the
//! vector, and are folded pairwise; the chunk sums are added in order, in `f64`. Long vectors are cut into at most 64 groups
//! of chunks, whose sums are added in order too, so that threads can work out groups apart. That shape depends on the length alone, so the result has the same
//! bits on any number of threads and at any SIMD level. No fused multiply-add is used, for the same reason.
//!
//! # Panics
//!
//! Every function of this module panics if its slices differ in length: that is an error of the caller's code, never
//! of its data.

use crate::real::Real;

/// Entries per chunk: enough to hide the cost of folding its lanes, few enough to share 7,000 entries among threads evenly;
/// blocks of 1, 2, 3, 4, 6 or 8 entries divide it.
pub const CHUNK: usize = 384;

const LANES: usize = 16;

/// A sum has at most this many groups.
const GROUPS: usize = 64;

/// Runs a block with the instructions that the processor has. The block becomes a named type: a closure that occurs in
/// several places was not inlined into the function that enables those instructions, and lost them.
macro_rules! with_simd {
    (<$real:ident $(, $size:ident)?> |$($name:ident: $type:ty),* $(,)?| -> $output:ty $body:block) => {{
        struct Kernel<'a, $real: $crate::real::Real $(, const $size: usize)?> {
            $($name: $type,)*
            lifetime: std::marker::PhantomData<&'a $real>,
        }
        impl<'a, $real: $crate::real::Real $(, const $size: usize)?> pulp::NullaryFnOnce for Kernel<'a, $real $(, $size)?> {
            type Output = $output;

            #[inline(always)]
            fn call(self) -> $output {
                let Self { $($name,)* .. } = self;
                $body
            }
        }
        $crate::simd::dispatch(Kernel::<$real $(, $size)?> { $($name,)* lifetime: std::marker::PhantomData })
    }};
}

/// Entries of each group of a vector of `len` entries; a multiple of [`CHUNK`].
pub(crate) fn group_len(len: usize) -> usize {
    len.div_ceil(CHUNK * GROUPS).max(1) * CHUNK
}

/// The sums of the groups of one vector, to be added up in order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sums([f64; GROUPS]);

impl Sums {
    pub fn new() -> Self {
        Self([0.0; GROUPS])
    }

    /// All groups, for writing.
    pub fn groups(&mut self) -> &mut [f64] {
        &mut self.0
    }

    /// The sum over a vector of `len` entries.
    pub fn total(&self, len: usize) -> f64 {
        self.0[..len.div_ceil(group_len(len))].iter().fold(0.0, |total, sum| total + sum)
    }
}

/// `xᵀy`.
#[must_use]
pub fn dot<T: Real>(x: &[T], y: &[T]) -> f64 {
    assert_eq!(x.len(), y.len(), "dot: lengths differ");
    let mut sums = Sums::new();
    dot_groups(group_len(x.len()), x, y, sums.groups());
    sums.total(x.len())
}

/// The sums of `xᵀy` by group: `x` and `y` begin with a group.
pub(crate) fn dot_groups<T: Real>(group: usize, x: &[T], y: &[T], sums: &mut [f64]) {
    with_simd!(<T> |group: usize, x: &'a [T], y: &'a [T], sums: &'a mut [f64]| -> () {
        for ((x, y), sum) in x.chunks(group).zip(y.chunks(group)).zip(sums) {
            *sum = 0.0;
            for (x, y) in x.chunks(CHUNK).zip(y.chunks(CHUNK)) {
                *sum += chunk_dot(x, y);
            }
        }
    });
}

/// `‖x‖₂`, the square root of [`dot`]`(x, x)`: infinite once a square overflows, i.e. for entries above 1e154.
#[must_use]
pub fn norm2<T: Real>(x: &[T]) -> f64 {
    dot(x, x).sqrt()
}

/// `y ← y + α x`.
pub fn axpy<T: Real>(alpha: T, x: &[T], y: &mut [T]) {
    assert_eq!(x.len(), y.len(), "axpy: lengths differ");
    with_simd!(<T> |alpha: T, x: &'a [T], y: &'a mut [T]| -> () {
        for (y, x) in y.iter_mut().zip(x) {
            *y += alpha * *x;
        }
    });
}

/// `y ← x + β y`.
pub fn xpby<T: Real>(x: &[T], beta: T, y: &mut [T]) {
    assert_eq!(x.len(), y.len(), "xpby: lengths differ");
    with_simd!(<T> |x: &'a [T], beta: T, y: &'a mut [T]| -> () {
        for (y, x) in y.iter_mut().zip(x) {
            *y = *x + beta * *y;
        }
    });
}

/// `z ← x + α y`.
pub fn add_scaled<T: Real>(x: &[T], alpha: T, y: &[T], z: &mut [T]) {
    assert!(x.len() == y.len() && y.len() == z.len(), "add_scaled: lengths differ");
    with_simd!(<T> |x: &'a [T], alpha: T, y: &'a [T], z: &'a mut [T]| -> () {
        for (z, (x, y)) in z.iter_mut().zip(x.iter().zip(y)) {
            *z = *x + alpha * *y;
        }
    });
}

/// One pass of a conjugate-gradient update: `x ← x + α p`, `r ← r − α q`; returns `rᵀr`, equal to [`dot`]`(r, r)`.
pub fn step_residual<T: Real>(alpha: T, p: &[T], q: &[T], x: &mut [T], r: &mut [T]) -> f64 {
    let n = p.len();
    assert!(q.len() == n && x.len() == n && r.len() == n, "step_residual: lengths differ");
    let mut sums = Sums::new();
    step_residual_groups(group_len(n), alpha, p, q, x, r, sums.groups());
    sums.total(n)
}

/// [`step_residual`] of a part that begins with a group; leaves the sums of its groups.
pub(crate) fn step_residual_groups<T: Real>(
    group: usize,
    alpha: T,
    p: &[T],
    q: &[T],
    x: &mut [T],
    r: &mut [T],
    sums: &mut [f64],
) {
    with_simd!(<T> |group: usize, alpha: T, p: &'a [T], q: &'a [T], x: &'a mut [T], r: &'a mut [T], sums: &'a mut [f64]| -> () {
        for (x, p) in x.iter_mut().zip(p) {
            *x += alpha * *p;
        }
        for ((q, r), sum) in q.chunks(group).zip(r.chunks_mut(group)).zip(sums) {
            *sum = 0.0;
            for (q, r) in q.chunks(CHUNK).zip(r.chunks_mut(CHUNK)) {
                *sum += chunk_update_dot(alpha, q, r);
            }
        }
    });
}

/// `(xᵀy, xᵀz)` in one pass, each equal to its [`dot`].
#[must_use]
pub fn dot_pair<T: Real>(x: &[T], y: &[T], z: &[T]) -> (f64, f64) {
    assert!(x.len() == y.len() && y.len() == z.len(), "dot_pair: lengths differ");
    let group = group_len(x.len());
    let (mut xy, mut xz) = (Sums::new(), Sums::new());
    for (k, ((x, y), z)) in x.chunks(group).zip(y.chunks(group)).zip(z.chunks(group)).enumerate() {
        dot_groups(group, x, y, &mut xy.groups()[k..=k]);
        dot_groups(group, x, z, &mut xz.groups()[k..=k]);
    }
    (xy.total(x.len()), xz.total(x.len()))
}

/// Index of the first entry that is NaN or infinite.
#[must_use]
pub fn first_not_finite<T: Real>(x: &[T]) -> Option<usize> {
    x.iter().position(|v| !v.is_finite())
}

/// `xᵀy` over at most one chunk.
#[inline(always)]
pub(crate) fn chunk_dot<T: Real>(x: &[T], y: &[T]) -> f64 {
    let (x, x_rest) = x.as_chunks::<LANES>();
    let (y, y_rest) = y.as_chunks::<LANES>();
    let mut lanes = [T::ZERO; LANES];
    for (x, y) in x.iter().zip(y) {
        for k in 0..LANES {
            lanes[k] += x[k] * y[k];
        }
    }
    for (lane, (x, y)) in lanes.iter_mut().zip(x_rest.iter().zip(y_rest)) {
        *lane += *x * *y;
    }
    fold(lanes)
}

/// `r ← r − α q` and `rᵀr` over at most one chunk.
#[inline(always)]
fn chunk_update_dot<T: Real>(alpha: T, q: &[T], r: &mut [T]) -> f64 {
    let (q, q_rest) = q.as_chunks::<LANES>();
    let (r, r_rest) = r.as_chunks_mut::<LANES>();
    let mut lanes = [T::ZERO; LANES];
    for (q, r) in q.iter().zip(r) {
        let mut new = *r; // a copy of known length: updated in place, the lanes became scalar code
        for k in 0..LANES {
            new[k] -= alpha * q[k];
        }
        for k in 0..LANES {
            lanes[k] += new[k] * new[k];
        }
        *r = new;
    }
    for (lane, (q, r)) in lanes.iter_mut().zip(q_rest.iter().zip(r_rest)) {
        *r -= alpha * *q;
        *lane += *r * *r;
    }
    fold(lanes)
}

/// Pairwise sum of the lanes, halves first.
#[inline(always)]
fn fold<T: Real>(mut lanes: [T; LANES]) -> f64 {
    let mut width = LANES / 2;
    while width > 0 {
        for k in 0..width {
            lanes[k] += lanes[k + width];
        }
        width /= 2;
    }
    lanes[0].to_f64()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pair() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
        prop_oneof![0usize..4000, Just(64 * CHUNK), 64 * CHUNK + 1..70 * CHUNK]
            .prop_flat_map(|n| (proptest::collection::vec(-1e3..1e3, n), proptest::collection::vec(-1e3..1e3, n)))
    }

    /// Sum of the chunk sums with the lanes written out one by one: the shape that the module promises.
    fn dot_by_definition(x: &[f64], y: &[f64]) -> f64 {
        let group = CHUNK * x.len().div_ceil(CHUNK).div_ceil(64).max(1);
        let mut sum = 0.0;
        let mut group_sum = 0.0;
        for start in (0..x.len()).step_by(CHUNK) {
            if start % group == 0 {
                sum += group_sum;
                group_sum = 0.0;
            }
            let end = (start + CHUNK).min(x.len());
            let mut lanes = [0.0; LANES];
            for k in start..end {
                lanes[(k - start) % LANES] += x[k] * y[k];
            }
            let a: Vec<f64> = (0..8).map(|k| lanes[k] + lanes[k + 8]).collect();
            let b: Vec<f64> = (0..4).map(|k| a[k] + a[k + 4]).collect();
            group_sum += (b[0] + b[2]) + (b[1] + b[3]);
        }
        sum + group_sum
    }

    proptest! {
        #[test]
        fn dot_has_the_promised_shape((x, y) in pair()) {
            prop_assert_eq!(dot(&x, &y).to_bits(), dot_by_definition(&x, &y).to_bits());
        }

        #[test]
        fn fused_passes_equal_separate_ones((x, y) in pair(), alpha in -2.0..2.0) {
            let (mut x1, mut r1) = (x.clone(), y.clone());
            let rr = step_residual(alpha, &x, &y, &mut x1, &mut r1);
            let (mut x2, mut r2) = (x.clone(), y.clone());
            axpy(alpha, &x, &mut x2);
            axpy(-alpha, &y, &mut r2);
            prop_assert_eq!(&x1, &x2);
            prop_assert_eq!(&r1, &r2);
            prop_assert_eq!(rr.to_bits(), dot(&r2, &r2).to_bits());
            let (a, b) = dot_pair(&x, &y, &r1);
            prop_assert_eq!(a.to_bits(), dot(&x, &y).to_bits());
            prop_assert_eq!(b.to_bits(), dot(&x, &r1).to_bits());
            let mut z = vec![0.0; x.len()];
            add_scaled(&y, alpha, &x, &mut z);
            let mut x3 = x.clone();
            xpby(&y, alpha, &mut x3);
            prop_assert_eq!(&z, &x3);
        }
    }

    #[test]
    fn first_not_finite_names_the_entry() {
        assert_eq!(first_not_finite(&[1.0, f64::NAN, f64::INFINITY]), Some(1));
        assert_eq!(first_not_finite(&[1.0, f64::MAX]), None);
    }
}
