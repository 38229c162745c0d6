//! Element stiffnesses kept between lazy linearisations.

use super::assembly::{MAX_PAIRS, upper_index};
use stylet_solver::Block;

/// Blocks `K_ab`, `1 <= a <= b`, of a P1 element in single precision: a quarter of the whole in double.
///
/// Rigid translations take no force, `sum_b K_ab = 0`, so that the blocks of local vertex 0 follow, up to the rounding
/// errors of double precision. The others are rounded to a relative `6e-8`, far below what a lazy threshold leaves.
pub(super) type Stored<const D: usize> = [[[f32; D]; D]; 6];

/// Rounds the blocks of an upper triangle.
pub(super) fn pack<const D: usize, const N: usize>(upper: &[Block<D>]) -> Stored<D> {
    let mut stored = [[[0.0; D]; D]; 6];
    for a in 1..N {
        for b in a..N {
            let block = &upper[upper_index(N, a, b)];
            stored[upper_index(D, a - 1, b - 1)] = block.map(|row| row.map(|k| k as f32));
        }
    }
    stored
}

/// The whole upper triangle.
#[inline]
pub(super) fn unpack<const D: usize, const N: usize>(stored: &Stored<D>) -> [Block<D>; MAX_PAIRS] {
    let mut upper = [[[0.0; D]; D]; MAX_PAIRS];
    for a in 1..N {
        for b in a..N {
            let block = stored[upper_index(D, a - 1, b - 1)].map(|row| row.map(f64::from));
            upper[upper_index(N, a, b)] = block;
            for i in 0..D {
                for j in 0..D {
                    upper[b][i][j] -= block[i][j];
                    if a != b {
                        upper[a][i][j] -= block[j][i];
                    }
                }
            }
        }
    }
    for b in 1..N {
        for i in 0..D {
            for j in 0..D {
                // The mean of both halves is symmetric to the last bit.
                upper[0][i][j] -= 0.5 * (upper[b][i][j] + upper[b][j][i]);
            }
        }
    }
    upper
}

#[cfg(test)]
mod tests {
    use super::*;
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
        let back = unpack::<3, 4>(&pack::<3, 4>(&upper));
        for (a, b) in upper.iter().flatten().flatten().zip(back.iter().flatten().flatten()) {
            assert!((a - b).abs() < 1e-6 * size, "{a} and {b} of {size}");
        }
        for a in 0..4 {
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
                let block = |b: usize| match a <= b {
                    true => back[upper_index(4, a, b)][i][j],
                    false => back[upper_index(4, b, a)][j][i],
                };
                let sum: f64 = (0..4).map(block).sum();
                assert!(sum.abs() < 1e-14 * size, "translations take a force of {sum} of {size}");
            }
        }
    }
}
