//! How far a step may go before an element loses its volume.

use super::Body;
use super::kernel::{deformation_gradients, gradient_differentials};
use crate::lanes::{self, LANES, Lane, PackMatrix, lane_matrix, pack};
use crate::material::Hyperelastic;
use crate::small::{cofactor, contract, determinant};
use nalgebra::SMatrix;
use pulp::{Arch, NullaryFnOnce};

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// The largest `t` up to `limit` such that `det(F + s dF) > 0` in every element for `0 <= s < t`, where `dF` is the
    /// gradient of `p`; zero if an element is inverted at `u` or a number is not finite. Elements of laws that are defined for
    /// every `F` do not count.
    pub(super) fn step_to_inversion(&self, u: &[f64], p: &[f64], limit: f64) -> f64 {
        self.check_len(u);
        self.check_len(p);
        Arch::new().dispatch(Shortest { body: self, u, p, limit })
    }

    #[inline(always)]
    fn shortest(&self, u: &[f64], p: &[f64], limit: f64) -> f64 {
        let mut step = limit;
        for group in &self.elements.groups {
            if !self.materials[group.material as usize].requires_positive_j() {
                continue;
            }
            let (f, df) = (deformation_gradients(group, u), gradient_differentials(group, p));
            if all_clear(&f, &df, step) {
                continue;
            }
            for lane in 0..LANES {
                let polynomial = determinant_along(&lane_matrix(&f, lane), &lane_matrix(&df, lane));
                step = shorten(&polynomial, step);
            }
        }
        step
    }
}

/// [`Body::shortest`] for wide vectors.
struct Shortest<'a, const D: usize, const N: usize, M> {
    body: &'a Body<D, N, M>,
    u: &'a [f64],
    p: &'a [f64],
    limit: f64,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> NullaryFnOnce for Shortest<'_, D, N, M> {
    type Output = f64;
    #[inline(always)]
    fn call(self) -> f64 {
        self.body.shortest(self.u, self.p, self.limit)
    }
}

/// Whether the lower bound of [`shorten`] settles all lanes of a group at once; that it does not may mean nothing. Most
/// groups of a small step are settled here.
#[inline(always)]
fn all_clear<const D: usize>(f: &[[Lane; D]; D], df: &[[Lane; D]; D], limit: f64) -> bool {
    if !limit.is_finite() || D == 1 {
        return false;
    }
    if D == 3 {
        return all_clear_in_space(&pack(f), &pack(df), limit);
    }
    let mut clear = [false; LANES];
    for k in 0..LANES {
        let (a, b, c, d) = (f[0][0][k], f[0][1][k], f[1][0][k], f[1][1][k]);
        let (da, db, dc, dd) = (df[0][0][k], df[0][1][k], df[1][0][k], df[1][1][k]);
        let start = a * d - b * c;
        let falling = (a * dd + d * da - b * dc - c * db).abs() + limit * (da * dd - db * dc).abs();
        // False for a NaN.
        clear[k] = start - limit * falling > SAFELY_POSITIVE * start && start > 0.0;
    }
    clear.iter().all(|&c| c)
}

/// [`all_clear`] in space.
#[inline(always)]
fn all_clear_in_space<const D: usize>(f: &PackMatrix<D, LANES>, df: &PackMatrix<D, LANES>, limit: f64) -> bool {
    let (cofactor_f, cofactor_df) = (lanes::cofactor(f), lanes::cofactor(df));
    let start = lanes::determinant_by(f, &cofactor_f);
    let (first, second) = (lanes::contract(&cofactor_f, df).abs(), lanes::contract(f, &cofactor_df).abs());
    let third = lanes::determinant_by(df, &cofactor_df).abs();
    let lowest = start - (first + (second + third * limit) * limit) * limit;
    let mut clear = true;
    for k in 0..LANES {
        // False for a NaN.
        clear &= lowest.0[k] > SAFELY_POSITIVE * start.0[k] && start.0[k] > 0.0;
    }
    clear
}

/// Coefficients of `det(F + t dF)`, ascending.
#[inline(always)]
fn determinant_along<const D: usize>(f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> [f64; 4] {
    match D {
        1 => [determinant(f), determinant(df), 0.0, 0.0],
        2 => [determinant(f), contract(&cofactor(f), df), determinant(df), 0.0],
        _ => [determinant(f), contract(&cofactor(f), df), contract(f, &cofactor(df)), determinant(df)],
    }
}

/// The smaller of `limit` and the first positive root of the cubic.
///
/// A root is found without regard to `limit`, and skipped only where it is safely beyond, so that the smallest of many
/// has the same bits in whatever order they come.
#[inline(always)]
fn shorten(c: &[f64; 4], limit: f64) -> f64 {
    // Most elements are far from inversion: a lower bound of the cubic on [0, limit] settles them.
    let falling = c[1].min(0.0) + limit * (c[2].min(0.0) + limit * c[3].min(0.0));
    // A NaN would slip through `min`.
    let finite = limit.is_finite() && (c[0] + c[1] + c[2] + c[3]).is_finite();
    if finite && c[0] > 0.0 && c[0] + limit * falling > SAFELY_POSITIVE * c[0] {
        return limit;
    }
    limit.min(first_root(c))
}

/// Share of the determinant at the start that tells a positive lower bound from rounding errors.
const SAFELY_POSITIVE: f64 = 1e-9;

/// The first positive zero of `c0 + c1 t + c2 t^2 + c3 t^3`, or infinity; zero if `c0 <= 0` or a coefficient is not
/// finite. What is returned lies at or before the root, so that the cubic is positive up to it.
fn first_root(c: &[f64; 4]) -> f64 {
    let positive_start = c[0] > 0.0;
    if !positive_start || c.iter().any(|x| !x.is_finite()) {
        return 0.0;
    }
    let value = |t: f64| c[0] + t * (c[1] + t * (c[2] + t * c[3]));
    let end = root_bound(c);
    // Between its turning points the cubic is monotone: the first piece with a change of sign holds the root.
    let (turns, n_turns) = turning_points(c, end);
    let mut left = 0.0;
    for &right in turns[..n_turns].iter().chain([&end]) {
        if value(right) <= 0.0 {
            return bisect(value, left, right);
        }
        left = right;
    }
    f64::INFINITY
}

/// A bound on the magnitude of every root, at most `1e30`.
///
/// Source: Fujiwara (1916), Tohoku Math. J. 10.
fn root_bound(c: &[f64; 4]) -> f64 {
    let Some(degree) = (1..4).rev().find(|&k| c[k] != 0.0) else { return 0.0 };
    let ratio = |k: usize| (c[degree - k] / c[degree]).abs().powf(1.0 / k as f64);
    let bound = 2.0 * (1..=degree).map(ratio).fold(0.0, f64::max);
    // NaN-free: numerators are finite and the denominator is not zero; an infinite ratio means "practically never".
    bound.min(1e30)
}

/// Zeros of the derivative in `(0, end)`, ascending, and their number.
fn turning_points(c: &[f64; 4], end: f64) -> ([f64; 2], usize) {
    let (mut found, mut n) = ([0.0; 2], 0);
    let (a, half_b, constant) = (3.0 * c[3], c[2], c[1]);
    let discriminant = half_b * half_b - a * constant;
    if discriminant >= 0.0 {
        // The form without cancellation; a zero denominator gives an infinity or NaN, which the range test drops.
        let q = -(half_b + discriminant.sqrt().copysign(half_b));
        for t in [q / a, constant / q] {
            if t > 0.0 && t < end {
                found[n] = t;
                n += 1;
            }
        }
    }
    if n == 2 && found[0] > found[1] {
        found.swap(0, 1);
    }
    (found, n)
}

/// The zero of a function that falls from positive at `left` to not positive at `right`, from the left: bisection to the
/// last bits, 100 evaluations at most.
fn bisect(value: impl Fn(f64) -> f64, mut left: f64, mut right: f64) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (left + right);
        if middle <= left || middle >= right {
            break;
        }
        if value(middle) > 0.0 {
            left = middle
        } else {
            right = middle
        }
        if right - left <= 4.0 * f64::EPSILON * right {
            break;
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn roots_of_known_cubics() {
        let inf = f64::INFINITY;
        for (c, root) in [
            ([1.0, -1.0, 0.0, 0.0], 1.0),
            ([1.0, 0.0, -4.0, 0.0], 0.5),
            ([6.0, -11.0, 6.0, -1.0], 1.0),
            ([1.0, 0.0, 0.0, -8.0], 0.5),
            ([1.0, 1.0, 1.0, 1.0], inf),
            ([1.0, -2.0, 1.5, 0.0], inf),
            ([1.0, 0.0, 0.0, 0.0], inf),
            ([1.0, -2.0, 1.0, 0.0], 1.0),
            ([1e-200, -1e-190, 0.0, 0.0], 1e-10),
        ] {
            let found = first_root(&c);
            // A double root is known to half the digits.
            assert!(found == root || (found - root).abs() <= 1e-7 * root, "{c:?}: {found}, expected {root}");
        }
        assert_eq!(first_root(&[0.0, 1.0, 0.0, 0.0]), 0.0);
        assert_eq!(first_root(&[1.0, f64::NAN, 0.0, 0.0]), 0.0);
        assert_eq!(shorten(&[1.0, -1.0, 0.0, 0.0], 0.3), 0.3);
        assert_eq!(shorten(&[1.0, f64::NAN, 0.0, 0.0], 0.3), 0.0);
    }

    proptest! {
        /// Positive on a fine grid up to the root, not positive just behind it.
        #[test]
        fn first_root_is_the_first(b in -5.0..5.0f64, c in -5.0..5.0f64, d in -5.0..5.0f64) {
            let cubic = [1.0, b, c, d];
            let value = |t: f64| 1.0 + t * (b + t * (c + t * d));
            let t = shorten(&cubic, 100.0);
            prop_assert!((0..1000).all(|k| value(t * f64::from(k) / 1000.0) > -1e-12));
            if t < 100.0 {
                prop_assert!(value(t * (1.0 + 1e-9)) <= 1e-8, "{t}: {}", value(t));
                // Whatever was found before.
                prop_assert_eq!(shorten(&cubic, t * (1.0 + 1e-14)), t);
                prop_assert_eq!(shorten(&cubic, f64::INFINITY), t);
            }
        }
    }
}
