//! The steps that L-BFGS remembers: a ring that is written in place.

use crate::memory::bytes_of_all;
use crate::team::Team;
use crate::vector::dot;

/// Pairs `s = x₁ − x₀`, `y = g₁ − g₀`, the oldest given up for a new one.
#[derive(Clone, Debug, Default)]
pub(super) struct Pairs {
    /// Entries of a vector, and pairs that there is room for.
    n: usize,
    room: usize,
    s: Vec<f64>,
    y: Vec<f64>,
    /// `s·y` of each pair.
    sy: Vec<f64>,
    alpha: Vec<f64>,
    /// How many pairs are kept, and the place of the next one.
    len: usize,
    next: usize,
    /// Of the initial matrix.
    scale: f64,
}

impl Pairs {
    /// Forgets everything and makes room for `room` pairs of vectors of `n` entries.
    pub fn clear(&mut self, room: usize, n: usize) {
        (self.room, self.n) = (room, n);
        self.s.resize(room * n, 0.0);
        self.y.resize(room * n, 0.0);
        self.sy.resize(room, 0.0);
        self.alpha.resize(room, 0.0);
        self.forget();
    }

    /// Forgets all pairs.
    pub fn forget(&mut self) {
        (self.len, self.next, self.scale) = (0, 0, 1.0);
    }

    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The place of the next pair, for `s` and `y`. It does not count until it is [kept](Self::keep); a full ring gives up its
    /// oldest pair already now.
    pub fn next(&mut self) -> (&mut [f64], &mut [f64]) {
        self.len = self.len.min(self.room - 1);
        let range = self.next * self.n..(self.next + 1) * self.n;
        (&mut self.s[range.clone()], &mut self.y[range])
    }

    /// Keeps the pair that was written last, and the scale of the initial matrix that goes with it.
    pub fn keep(&mut self, sy: f64, scale: f64) {
        self.sy[self.next] = sy;
        self.scale = scale;
        self.next = (self.next + 1) % self.room;
        self.len += 1;
    }

    /// `q ← (I − ρ y sᵀ) … q`, the newest pair first.
    ///
    /// Source: Nocedal & Wright, *Numerical Optimization*, 2nd ed. (2006), Algorithm 7.4.
    pub fn first_loop(&mut self, team: &Team, q: &mut [f64]) {
        for back in 1..=self.len {
            let place = self.place(back);
            let range = place * self.n..(place + 1) * self.n;
            let alpha = dot(&self.s[range.clone()], q) / self.sy[place];
            team.axpy(-alpha, &self.y[range], q);
            self.alpha[place] = alpha;
        }
    }

    /// `r ← … (I − ρ s yᵀ) γ r + s α`, the oldest pair first; `r` is the initial matrix times what the first loop left.
    pub fn second_loop(&self, team: &Team, r: &mut [f64]) {
        if self.scale != 1.0 {
            r.iter_mut().for_each(|r| *r *= self.scale);
        }
        for back in (1..=self.len).rev() {
            let place = self.place(back);
            let range = place * self.n..(place + 1) * self.n;
            let beta = dot(&self.y[range.clone()], r) / self.sy[place];
            team.axpy(self.alpha[place] - beta, &self.s[range], r);
        }
    }

    /// Place of the pair that was kept `back` ago, 1 being the last one.
    fn place(&self, back: usize) -> usize {
        (self.next + self.room - back) % self.room
    }

    /// Bytes that it keeps, spare room included.
    pub fn memory_bytes(&self) -> usize {
        bytes_of_all([&self.s, &self.y, &self.sy, &self.alpha])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vector::axpy;
    use proptest::prelude::*;

    proptest! {
        /// The two loops against the BFGS formula `H ← (I − ρ s yᵀ) H (I − ρ y sᵀ) + ρ s sᵀ` on a dense matrix, for the pairs
        /// that are still remembered.
        #[test]
        fn two_loops_are_the_bfgs_matrix(
            numbers in proptest::collection::vec(-1.0..1.0f64, 7 * 4),
            room in 1usize..5, v in proptest::collection::vec(-1.0..1.0f64, 4), scale in 0.1..3.0f64,
        ) {
            const N: usize = 4;
            let mut pairs = Pairs::default();
            pairs.clear(room, N);
            let mut written: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
            for (i, s) in numbers.chunks(N).enumerate() {
                // y = A s with a positive definite A makes the curvature positive.
                let total: f64 = s.iter().sum();
                let y: Vec<f64> = s.iter().enumerate().map(|(k, s)| (1.0 + k as f64) * s + 0.5 * total).collect();
                let sy = dot(s, &y);
                prop_assume!(sy > 1e-3);
                let (to_s, to_y) = pairs.next();
                to_s.copy_from_slice(s);
                to_y.copy_from_slice(&y);
                if i % 3 == 2 {
                    // Not kept: it costs the oldest pair of a full ring, nothing else.
                    if written.len() == room {
                        written.remove(0);
                    }
                    continue;
                }
                pairs.keep(sy, scale);
                written.push((s.to_vec(), y));
                if written.len() > room {
                    written.remove(0);
                }
            }
            let mut h: Vec<Vec<f64>> =
                (0..N).map(|i| (0..N).map(|j| if i == j { scale } else { 0.0 }).collect()).collect();
            for (s, y) in &written {
                let rho = 1.0 / dot(s, y);
                let hy: Vec<f64> = h.iter().map(|row| dot(row, y)).collect();
                let yhy = dot(y, &hy);
                for i in 0..N {
                    for j in 0..N {
                        h[i][j] += rho * (rho * yhy + 1.0) * s[i] * s[j] - rho * (hy[i] * s[j] + s[i] * hy[j]);
                    }
                }
            }
            let mut r = v.clone();
            pairs.first_loop(&Team::serial(), &mut r);
            pairs.second_loop(&Team::serial(), &mut r);
            let mut expected: Vec<f64> = h.iter().map(|row| dot(row, &v)).collect();
            let size = dot(&expected, &expected).sqrt();
            axpy(-1.0, &r, &mut expected);
            prop_assert!(dot(&expected, &expected).sqrt() <= 1e-8 * (1.0 + size), "{r:?}");
        }
    }
}
