//! The element kernel: strains and forces of [`LANES`] elements side by side.
//!
//! Lanes never mix, and no product is fused with a sum, so that every vector width gives the bits of the scalar formula.

use super::element::Group;
use crate::lanes::{LANES, Lane};

/// `F` of each lane at the nodal displacement `u` (m).
#[inline(always)]
pub(super) fn deformation_gradients<const D: usize, const N: usize>(group: &Group<D, N>, u: &[f64]) -> [[Lane; D]; D] {
    let mut f = [[[0.0; LANES]; D]; D];
    for i in 0..D {
        f[i][i] = [1.0; LANES];
    }
    accumulate_gradient(group, u, &mut f);
    f
}

/// `dF` of each lane in the direction `p`.
#[inline(always)]
pub(super) fn gradient_differentials<const D: usize, const N: usize>(group: &Group<D, N>, p: &[f64]) -> [[Lane; D]; D] {
    let mut df = [[[0.0; LANES]; D]; D];
    accumulate_gradient(group, p, &mut df);
    df
}

#[inline(always)]
fn accumulate_gradient<const D: usize, const N: usize>(group: &Group<D, N>, u: &[f64], f: &mut [[Lane; D]; D]) {
    let nodes = u.as_chunks::<D>().0;
    let mut base = [[0.0; LANES]; D];
    for lane in 0..LANES {
        let node = nodes[group.vertices[0][lane] as usize];
        for i in 0..D {
            base[i][lane] = node[i];
        }
    }
    for a in 0..D {
        let mut relative = [[0.0; LANES]; D];
        for lane in 0..LANES {
            let node = nodes[group.vertices[a + 1][lane] as usize];
            for i in 0..D {
                relative[i][lane] = node[i];
            }
        }
        for i in 0..D {
            for lane in 0..LANES {
                relative[i][lane] -= base[i][lane];
            }
            for k in 0..D {
                for lane in 0..LANES {
                    f[i][k][lane] += relative[i][lane] * group.gradients[a][k][lane];
                }
            }
        }
    }
}

/// Elastic forces `dW/du_a = weight P grad_a` on the corners of each lane, N, under the stress `P` (Pa).
#[inline(always)]
pub(super) fn corner_forces<const D: usize, const N: usize>(
    group: &Group<D, N>,
    stress: &[[Lane; D]; D],
) -> [[Lane; D]; N] {
    let mut corners = [[[0.0; LANES]; D]; N];
    for i in 0..D {
        for a in 0..D {
            for lane in 0..LANES {
                let mut force = 0.0;
                for k in 0..D {
                    force += stress[i][k][lane] * group.gradients[a][k][lane];
                }
                force *= group.weight[lane];
                corners[a + 1][i][lane] = force;
                corners[0][i][lane] -= force;
            }
        }
    }
    corners
}
