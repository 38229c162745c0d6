//! Element stiffnesses kept between lazy linearisations.
//!
//! Rows are sums of the blocks off the diagonal, which changes of a few elements change alone; the block on the diagonal
//! balances them.

use super::assembly::upper_index;
use stylet_solver::Block;

/// Blocks `K_ab`, `1 <= a <= b`, of a P1 element in single precision: a quarter of the whole in double.
///
/// Rigid translations take no force, `sum_b K_ab = 0`, so that the blocks of local vertex 0 follow, up to the rounding
/// errors of double precision. The others are rounded to a relative `6e-8`, far below what a lazy threshold leaves.
pub(super) type Stored<const D: usize> = [[[f32; D]; D]; 6];

/// Rounds the blocks of an upper triangle.
#[inline(always)]
pub(super) fn pack<const D: usize, const N: usize>(upper: &[Block<D>]) -> Stored<D> {
    let mut stored = [[[0.0; D]; D]; 6];
    for a in 1..N {
        for b in a..N {
            let block = &upper[upper_index(N, a, b)];
            let into: &mut [[f32; D]; D] = &mut stored[upper_index(D, a - 1, b - 1)];
            for i in 0..D {
                for j in 0..D {
                    into[i][j] = block[i][j] as f32;
                }
            }
        }
    }
    stored
}

/// `K_ab` for `a != b`: those of two vertices are each other's mirror images to the last bit.
#[inline(always)]
pub(super) fn off_diagonal<const D: usize, const N: usize>(stored: &Stored<D>, a: usize, b: usize) -> Block<D> {
    if a > 0 && b > 0 {
        return block(stored, a, b);
    }
    let mut sum = [[0.0; D]; D];
    for c in 1..N {
        let other = if a == 0 { block(stored, c, b) } else { block(stored, a, c) };
        subtract(&other, &mut sum);
    }
    sum
}

/// The diagonal block at `diagonal` of a row whose others stand: their sum vanishes.
#[inline(always)]
pub(super) fn balance<const D: usize>(row: &mut [Block<D>], diagonal: usize) {
    let mut sum = [[0.0; D]; D];
    for (at, block) in row.iter().enumerate() {
        if at != diagonal {
            subtract(block, &mut sum);
        }
    }
    for i in 0..D {
        for j in 0..D {
            // The mean of both halves is symmetric to the last bit.
            row[diagonal][i][j] = 0.5 * (sum[i][j] + sum[j][i]);
        }
    }
}

/// `K_ab` with `a, b >= 1`.
#[inline(always)]
fn block<const D: usize>(stored: &Stored<D>, a: usize, b: usize) -> Block<D> {
    let (k, transposed) = (&stored[upper_index(D, a.min(b) - 1, a.max(b) - 1)], a > b);
    let mut out = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..D {
            out[i][j] = f64::from(if transposed { k[j][i] } else { k[i][j] });
        }
    }
    out
}

#[inline(always)]
fn subtract<const D: usize>(k: &Block<D>, from: &mut Block<D>) {
    for i in 0..D {
        for j in 0..D {
            from[i][j] -= k[i][j];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::assembly::MAX_PAIRS;
    use crate::material::{Hyperelastic, NeoHookean};
    use nalgebra::Matrix3;

    /// What is not stored follows from what is.
    #[test]
    fn the_blocks_come_back() {
        let material = NeoHookean::from_young_poisson(34e3, 0.45).unwrap();
        let f = Matrix3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.2);
        let g = [[3.0, -1.0, 2.0], [-1.0, 4.0, 0.5], [0.3, -2.0, 1.0]];
        let first = std::array::from_fn(|k| -g[0][k] - g[1][k] - g[2][k]);
        let mut upper = [[[0.0; 3]; 3]; MAX_PAIRS];
        material.element_stiffness(&f, &[first, g[0], g[1], g[2]], 1e-6, &mut upper);
        let size = upper.iter().flatten().flatten().fold(0.0f64, |m, k| m.max(k.abs()));
        let stored = pack::<3, 4>(&upper);
        let back = |a: usize, b: usize| -> Block<3> {
            let mut row: [Block<3>; 4] =
                std::array::from_fn(|b| if a == b { [[0.0; 3]; 3] } else { off_diagonal::<3, 4>(&stored, a, b) });
            balance(&mut row, a);
            row[b]
        };
        for (a, b, i, j) in (0..144).map(|k| (k / 36, k / 9 % 4, k / 3 % 3, k % 3)) {
            let exact = if a <= b { upper[upper_index(4, a, b)][i][j] } else { upper[upper_index(4, b, a)][j][i] };
            let found = back(a, b)[i][j];
            assert!((found - exact).abs() < 1e-6 * size, "{found} and {exact} of {size}");
            assert_eq!(found.to_bits(), back(b, a)[j][i].to_bits());
            let sum: f64 = (0..4).map(|b| back(a, b)[i][j]).sum();
            assert!(sum.abs() < 1e-14 * size, "translations take a force of {sum} of {size}");
        }
    }
}
