//! St. Venant-Kirchhoff: linear elasticity in the Green strain.

use super::lame::law_of_lame;
use super::principal::{self, Curvature, Principal, projection_by_principal_stretches};
use super::{Hyperelastic, Lame, MaterialError, Tangent, fill_upper, lane_by_lane, lane_gradients};
use crate::lanes::{Lane, Pack, array_of, lane_matrix, matrix_of, pack};
use crate::small::{determinant_minus_one, dot, map_gradients, times, transpose_times};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = mu |G|^2 + lambda/2 tr(G)^2` with the Green strain `G = (F^T F - I)/2`; `mu`, `lambda` in Pa.
///
/// The formula itself is finite for inverted `F` (a reflected element is free of stress); this implementation takes
/// `J <= 0` as outside the domain and returns an infinite energy there, so that a line search backs away from an
/// inversion instead of settling behind it. The law softens in compression and collapses below a stretch of about 0.58.
///
/// Source: Bonet & Wood, *Nonlinear Continuum Mechanics for Finite Element Analysis*, 2nd ed. (2008), section 6.4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StVenantKirchhoff {
    pub(super) lame: Lame,
}

law_of_lame!(StVenantKirchhoff);

impl StVenantKirchhoff {
    /// Second Piola-Kirchhoff stress `S = 2 mu G + lambda tr(G) I`, Pa.
    #[inline(always)]
    fn second_piola_kirchhoff<const D: usize>(&self, green: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let pressure = self.lame.lambda() * green.trace();
        let mut s = green * (2.0 * self.lame.mu());
        for i in 0..D {
            s[(i, i)] += pressure;
        }
        s
    }
}

impl<const D: usize> Hyperelastic<D> for StVenantKirchhoff {
    #[inline(always)]
    fn energy_density(&self, f: &SMatrix<f64, D, D>) -> f64 {
        let h = f - SMatrix::<f64, D, D>::identity();
        let j = 1.0 + determinant_minus_one(&h);
        let green = green_strain(&h);
        let trace = green.trace();
        let energy = self.lame.mu() * green.norm_squared() + 0.5 * self.lame.lambda() * trace * trace;
        if j > 0.0 && !energy.is_nan() { energy } else { f64::INFINITY }
    }

    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let h = f - SMatrix::<f64, D, D>::identity();
        let inside = if 1.0 + determinant_minus_one(&h) > 0.0 { 1.0 } else { f64::NAN };
        times(f, &(self.second_piola_kirchhoff(&green_strain(&h)) * inside))
    }

    /// `dP = dF S + F dS` with `dG = sym(F^T dF)`.
    #[inline(always)]
    fn stress_differential(&self, f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let stress = self.second_piola_kirchhoff(&green_strain(&(f - SMatrix::<f64, D, D>::identity())));
        let fdf = transpose_times(f, df);
        let dstress = self.second_piola_kirchhoff(&((fdf + fdf.transpose()) * 0.5));
        times(df, &stress) + times(f, &dstress)
    }

    /// `K_ab = weight ((g_a.S g_b) I + mu (g_a.g_b) F F^T + mu h_b h_a^T + lambda h_a h_b^T)` with `h = F g`.
    #[inline(always)]
    fn element_stiffness<const N: usize>(
        &self,
        f: &SMatrix<f64, D, D>,
        g: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        let stress = self.second_piola_kirchhoff(&green_strain(&(f - SMatrix::<f64, D, D>::identity())));
        let (mu, lambda) = (weight * self.lame.mu(), weight * self.lame.lambda());
        let (h, stress_g, left) = (map_gradients(f, g), map_gradients(&stress, g), times(f, &f.transpose()));
        fill_upper::<D, N>(upper, |a, b| {
            let elastic = mu * dot(&g[a], &g[b]);
            let mut k = [[0.0; D]; D];
            for i in 0..D {
                for l in 0..D {
                    k[i][l] = elastic * left[(i, l)] + mu * h[b][i] * h[a][l] + lambda * h[a][i] * h[b][l];
                }
                k[i][i] += weight * dot(&g[a], &stress_g[b]);
            }
            k
        });
    }

    projection_by_principal_stretches!(D);
}

impl Principal for StVenantKirchhoff {
    /// `mu/4 sum((s^2 - 1)^2) + lambda/8 sum(s^2 - 1)^2`.
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let trace = doubled_green_trace(s);
        let mut energy = trace * trace * (0.125 * self.lame.lambda());
        for s in s {
            let strain = *s * *s - Pack::ONE;
            energy += strain * strain * (0.25 * self.lame.mu());
        }
        energy
    }

    /// `s_i (mu (s_i^2 - 1) + lambda/2 sum(s^2 - 1))`.
    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let pressure = doubled_green_trace(s) * (0.5 * self.lame.lambda());
        array_of(|i| s[i] * ((s[i] * s[i] - Pack::ONE) * self.lame.mu() + pressure))
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        let pressure = doubled_green_trace(s) * (0.5 * lambda);
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                let (squares, product) = (s[i] * s[i] + s[k] * s[k] - Pack::ONE, s[i] * s[k]);
                c.scaling[i][k] = product * lambda;
                c.flip[i][k] = (squares + product) * mu + pressure;
                c.twist[i][k] = (squares - product) * mu + pressure;
                if i == k {
                    c.scaling[i][i] += c.flip[i][i];
                }
            }
        }
        c
    }
}

/// `2 tr G = sum(s_i^2 - 1)`.
#[inline(always)]
fn doubled_green_trace<const D: usize, const L: usize>(s: &[Pack<L>; D]) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for s in s {
        sum += *s * *s - Pack::ONE;
    }
    sum
}

/// `G = (H + H^T + H^T H)/2`, accurate at small `H = F - I`.
#[inline(always)]
pub(super) fn green_strain<const D: usize>(h: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    (h + h.transpose() + transpose_times(h, h)) * 0.5
}
