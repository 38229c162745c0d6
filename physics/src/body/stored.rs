//! Element stiffnesses kept between lazy linearisations.

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

/// Blocks `K_ab` of one local vertex `a`, for all `b`: those of two vertices are each other's mirror images to the last bit.
#[inline(always)]
pub(super) fn row<const D: usize, const N: usize>(stored: &Stored<D>, a: usize) -> [Block<D>; N] {
    let mut row = [[[0.0; D]; D]; N];
    if a > 0 {
        for b in 1..N {
            row[b] = block(stored, a, b);
            subtract(&row[b].clone(), &mut row[0]);
        }
        return row;
    }
    let mut sum = [[0.0; D]; D];
    for b in 1..N {
        for c in 1..N {
            subtract(&block(stored, c, b), &mut row[b]);
        }
        subtract(&row[b].clone(), &mut sum);
    }
    for i in 0..D {
        for j in 0..D {
            // The mean of both halves is symmetric to the last bit.
            row[0][i][j] = 0.5 * (sum[i][j] + sum[j][i]);
        }
    }
    row
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
        let back: [[Block<3>; 4]; 4] = std::array::from_fn(|a| row::<3, 4>(&stored, a));
        for (a, b, i, j) in (0..144).map(|k| (k / 36, k / 9 % 4, k / 3 % 3, k % 3)) {
            let exact = if a <= b { upper[upper_index(4, a, b)][i][j] } else { upper[upper_index(4, b, a)][j][i] };
            assert!((back[a][b][i][j] - exact).abs() < 1e-6 * size, "{} and {exact} of {size}", back[a][b][i][j]);
            assert_eq!(back[a][b][i][j].to_bits(), back[b][a][j][i].to_bits());
            let sum: f64 = (0..4).map(|b| back[a][b][i][j]).sum();
            assert!(sum.abs() < 1e-14 * size, "translations take a force of {sum} of {size}");
        }
    }
}
