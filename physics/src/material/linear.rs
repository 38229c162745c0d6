//! Small-strain linear elasticity.

use super::lame::law_of_lame;
use super::{Hyperelastic, Lame, MaterialError, Tangent, fill_upper};
use crate::small::dot;
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = mu |e|^2 + lambda/2 tr(e)^2` with the small strain `e = (F + F^T)/2 - I`; `mu`, `lambda` in Pa.
///
/// Defined for every `F`, inverted ones too. Not invariant under rotations: rotations by more than a few degrees show
/// as strain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Linear {
    pub(super) lame: Lame,
}

law_of_lame!(Linear);

impl<const D: usize> Hyperelastic<D> for Linear {
    const IS_LINEAR: bool = true;
    const REQUIRES_POSITIVE_J: bool = false;

    #[inline(always)]
    fn energy_density(&self, f: &SMatrix<f64, D, D>) -> f64 {
        let strain = small_strain(&(f - SMatrix::<f64, D, D>::identity()));
        let trace = strain.trace();
        let energy = self.lame.mu() * strain.norm_squared() + 0.5 * self.lame.lambda() * trace * trace;
        if energy.is_nan() { f64::INFINITY } else { energy }
    }

    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        self.stress_differential(f, &(f - SMatrix::<f64, D, D>::identity()))
    }

    #[inline(always)]
    fn stress_differential(&self, _: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let strain = small_strain(df);
        let pressure = self.lame.lambda() * strain.trace();
        let mut p = strain * (2.0 * self.lame.mu());
        for i in 0..D {
            p[(i, i)] += pressure;
        }
        p
    }

    /// The tangent itself: the constants are stable, so it has no negative eigenvalue.
    fn projected_tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        self.tangent(f)
    }

    /// `K_ab = weight (mu (g_a.g_b) I + mu g_b g_a^T + lambda g_a g_b^T)`.
    #[inline(always)]
    fn element_stiffness<const N: usize>(
        &self,
        _: &SMatrix<f64, D, D>,
        g: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        let (mu, lambda) = (weight * self.lame.mu(), weight * self.lame.lambda());
        fill_upper::<D, N>(upper, |a, b| {
            let mut k = [[0.0; D]; D];
            for i in 0..D {
                for l in 0..D {
                    k[i][l] = mu * g[b][i] * g[a][l] + lambda * g[a][i] * g[b][l];
                }
                k[i][i] += mu * dot(&g[a], &g[b]);
            }
            k
        });
    }
}

/// The symmetric part.
#[inline(always)]
fn small_strain<const D: usize>(h: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    (h + h.transpose()) * 0.5
}
