//! Passes over vectors: the same sums as one thread makes, and one thread below a measured length.

use super::Team;
use crate::real::Real;
use crate::vector::{self, Sums, group_len};
use std::ops::Range;

/// Shorter vectors are left to the calling thread.
const CROSSOVER: usize = 1 << 14;

/// The entries that `member` of `size` takes: whole groups, the same number or one less for each.
pub(super) fn share(len: usize, member: usize, size: usize) -> Range<usize> {
    let group = group_len(len);
    let groups = len.div_ceil(group);
    let at = |k: usize| (groups * k / size * group).min(len);
    at(member)..at(member + 1)
}

impl Team {
    /// [`vector::dot`].
    #[must_use]
    pub fn dot<T: Real>(&self, x: &[T], y: &[T]) -> f64 {
        let n = x.len();
        if n < CROSSOVER || self.size() == 1 || y.len() != n {
            return vector::dot(x, y);
        }
        let mut sums = Sums::new();
        self.each(&mut self.split_sums(n, &mut sums)[..self.size()], |member, sums| {
            let range = self.share(n, member);
            vector::dot_groups(group_len(n), &x[range.clone()], &y[range], sums);
        });
        sums.total(n)
    }

    /// [`vector::norm2`].
    #[must_use]
    pub fn norm2<T: Real>(&self, x: &[T]) -> f64 {
        self.dot(x, x).sqrt()
    }

    /// [`vector::axpy`]: `y ← y + α x`.
    pub fn axpy<T: Real>(&self, alpha: T, x: &[T], y: &mut [T]) {
        self.update(x, y, |x, y| vector::axpy(alpha, x, y));
    }

    /// [`vector::xpby`]: `y ← x + β y`.
    pub fn xpby<T: Real>(&self, x: &[T], beta: T, y: &mut [T]) {
        self.update(x, y, |x, y| vector::xpby(x, beta, y));
    }

    /// `pass` on pieces of `x` and `y` at the same places.
    fn update<T: Real>(&self, x: &[T], y: &mut [T], pass: impl Fn(&[T], &mut [T]) + Sync) {
        if y.len() < CROSSOVER || self.size() == 1 || x.len() != y.len() {
            return pass(x, y); // which refuses lengths that differ
        }
        let mut parts = self.split(y);
        self.each(&mut parts[..self.size()], |member, y| {
            let range = self.share(x.len(), member);
            pass(&x[range], y);
        });
    }

    /// Each member's share of the sums over a vector of `len` entries.
    pub(crate) fn split_sums<'a>(&self, len: usize, sums: &'a mut Sums) -> [&'a mut [f64]; Self::MAX_MEMBERS] {
        let group = group_len(len);
        let mut rest = sums.groups();
        std::array::from_fn(|member| {
            let n = if member < self.size() { self.share(len, member).len().div_ceil(group) } else { 0 };
            let (part, after) = std::mem::take(&mut rest).split_at_mut(n);
            rest = after;
            part
        })
    }

    /// Each member's share of a vector.
    pub(crate) fn split<'a, T>(&self, v: &'a mut [T]) -> [&'a mut [T]; Self::MAX_MEMBERS] {
        let len = v.len();
        let mut rest = v;
        std::array::from_fn(|member| {
            if member >= self.size() {
                return &mut [][..];
            }
            let (part, after) = std::mem::take(&mut rest).split_at_mut(self.share(len, member).len());
            rest = after;
            part
        })
    }
}
