//! Compressible neo-Hookean solid, and the family of laws `mu/2 |F|^2 + U(J)` it belongs to.

use super::lame::law_of_non_negative_lame;
use super::principal::{self, Curvature, Principal, Products};
use super::{Hyperelastic, Lame, MaterialError, Tangent, fill_upper, lane_by_lane, lane_gradients};
use crate::lanes::{self, LANES, Lane, Pack, PackMatrix, array_of, lane_matrix, matrix_of, pack};
use crate::small::{cofactor, contract, determinant_minus_one, dot, map_gradients, times};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = mu/2 (tr F^T F - D) - mu ln J + lambda/2 (J - 1)^2`, with `J = det F > 0` and `mu`, `lambda` in Pa.
///
/// In two dimensions this is the three-dimensional law at `F33 = 1` (plane strain): the out-of-plane entry adds one to
/// `tr F^T F` and one to `D`, and nothing to `J`.
///
/// Source: Nienhuys, *Cutting in deformable objects*, PhD thesis, Utrecht (2003), eq. (4.6).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NeoHookean {
    #[serde(deserialize_with = "Lame::deserialize_non_negative")]
    pub(super) lame: Lame,
}

law_of_non_negative_lame!(NeoHookean);

impl NeoHookean {
    /// `J U'(J)` and `J (J U'(J))'` for `U = -mu ln J + lambda/2 (J - 1)^2`.
    #[inline(always)]
    fn volumetric(&self, j: f64) -> Volumetric {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        Volumetric { stress: lambda * (j - 1.0) * j - mu, slope: lambda * (2.0 * j - 1.0) * j }
    }
}

impl<const D: usize> Hyperelastic<D> for NeoHookean {
    #[inline(always)]
    fn energy_density(&self, f: &SMatrix<f64, D, D>) -> f64 {
        // In H = F - I, so that the constants cancel before they are rounded.
        let h = f - SMatrix::<f64, D, D>::identity();
        let dj = determinant_minus_one(&h);
        let energy =
            self.lame.mu() * (h.trace() + 0.5 * h.norm_squared() - dj.ln_1p()) + 0.5 * self.lame.lambda() * dj * dj;
        if 1.0 + dj > 0.0 && !energy.is_nan() { energy } else { f64::INFINITY }
    }

    /// `P = mu (F - F^-T) + lambda (J - 1) J F^-T`, arranged as `mu (F - C) + (J - 1)(lambda + mu/J) C` with the
    /// cofactor matrix `C = J F^-T`: exactly zero at rest, one division.
    #[inline(always)]
    fn first_piola_kirchhoff(&self, f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        let dj = determinant_minus_one(&(f - SMatrix::<f64, D, D>::identity()));
        let (c, j) = (cofactor(f), 1.0 + dj);
        let pressure = if j > 0.0 { dj * (lambda + mu / j) } else { f64::NAN };
        (f - c) * mu + c * pressure
    }

    #[inline(always)]
    fn stress_differential(&self, f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let (j, inverse) = inverse_transpose(f);
        self.volumetric(j).stress_differential(self.lame.mu(), &inverse, df)
    }

    #[inline(always)]
    fn element_stiffness<const N: usize>(
        &self,
        f: &SMatrix<f64, D, D>,
        gradients: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        let (j, inverse) = inverse_transpose(f);
        self.volumetric(j).element_stiffness(self.lame.mu(), &inverse, gradients, weight, upper);
    }

    fn projected_tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        principal::tangent(self, f, true)
    }

    #[inline(always)]
    fn element_stiffness_lanes<const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        project: bool,
        upper: &mut [[[Lane; D]; D]],
    ) {
        if D == 1 {
            return lane_by_lane(
                upper,
                #[inline(always)]
                |lane, blocks| {
                    let g = lane_gradients(gradients, lane);
                    self.element_stiffness(&lane_matrix(f, lane), &g, weight[lane], blocks);
                },
            );
        }
        let g = matrix_of::<N, D, LANES>(|a, i| Pack(gradients[a][i]));
        let mut put = principal::put_lanes::<D, N>(upper);
        if !project {
            return self.stiffness(&pack(f), &g, Pack(*weight), put);
        }
        let (f, weight) = (pack(f), Pack(*weight));
        let blocks = principal::Elements { law: self, f: &f, gradients: &g, weight, project }.blocks();
        for at in 0..N * (N + 1) / 2 {
            put(at, blocks[at]);
        }
    }
}

impl NeoHookean {
    /// [`Volumetric::element_stiffness`] in packs, with its bits; two and three dimensions.
    #[inline(always)]
    fn stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        mut put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        let cofactor = lanes::cofactor(f);
        let j = Pack::ONE + lanes::determinant_minus_one(f);
        let reciprocal = Pack::ONE / j;
        let mut h = [[Pack::ZERO; D]; N];
        for a in 0..N {
            for i in 0..D {
                for k in 0..D {
                    h[a][i] += cofactor[i][k] * reciprocal * g[a][k];
                }
            }
        }
        let stress = weight * ((j - Pack::ONE) * lambda * j - Pack::splat(mu));
        let slope = weight * ((j * 2.0 - Pack::ONE) * lambda * j);
        let mu = weight * mu;
        let mut at = 0;
        for a in 0..N {
            for b in a..N {
                let mut k = [[Pack::ZERO; D]; D];
                let mut dot = Pack::ZERO;
                for i in 0..D {
                    dot += g[a][i] * g[b][i];
                    for l in 0..D {
                        k[i][l] = slope * (h[a][i] * h[b][l]) - stress * (h[b][i] * h[a][l]);
                    }
                }
                for i in 0..D {
                    k[i][i] += mu * dot;
                }
                put(at, k);
                at += 1;
            }
        }
    }
}

/// Where all stretches are positive.
impl Principal for NeoHookean {
    /// `mu sum(h + h^2/2 - ln(1 + h)) + lambda/2 (J - 1)^2` with `h = s - 1`.
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let dj = Products::of(s).j - Pack::ONE;
        let mut energy = dj * dj * (0.5 * self.lame.lambda());
        for s in s {
            let h = *s - Pack::ONE;
            energy += (h + h * h * 0.5 - h.map(f64::ln_1p)) * self.lame.mu();
        }
        energy
    }

    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let (mu, products) = (self.lame.mu(), Products::of(s));
        let pressure = (products.j - Pack::ONE) * self.lame.lambda() - Pack::splat(mu) / products.j;
        array_of(|i| s[i] * mu + pressure * products.first[i])
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda, products) = (self.lame.mu(), self.lame.lambda(), Products::of(s));
        // U' and U'' of U(J) = -mu ln J + lambda/2 (J - 1)^2.
        let pressure = (products.j - Pack::ONE) * lambda - Pack::splat(mu) / products.j;
        let slope = Pack::splat(lambda) + Pack::splat(mu) / (products.j * products.j);
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                let volume = pressure * products.second[i][k];
                let other = if i == k { Pack::splat(mu) } else { volume };
                c.scaling[i][k] = slope * (products.first[i] * products.first[k]) + other;
                c.flip[i][k] = Pack::splat(mu) - volume;
                c.twist[i][k] = Pack::splat(mu) + volume;
            }
        }
        c
    }
}

/// `J` and `F^-T`.
#[inline(always)]
pub(super) fn inverse_transpose<const D: usize>(f: &SMatrix<f64, D, D>) -> (f64, SMatrix<f64, D, D>) {
    let j = 1.0 + determinant_minus_one(&(f - SMatrix::<f64, D, D>::identity()));
    (j, cofactor(f) * (1.0 / j))
}

/// The second derivatives of `W = mu/2 |F|^2 + U(J)`, for which `P = mu F + s F^-T` with `s = J U'(J)`, and
/// `dP = mu dF - s F^-T dF^T F^-T + J s' (F^-T : dF) F^-T`.
pub(super) struct Volumetric {
    /// `s = J U'(J)`, Pa.
    pub stress: f64,
    /// `J s'(J)`, Pa.
    pub slope: f64,
}

impl Volumetric {
    /// `dP`, given `inverse = F^-T`.
    #[inline(always)]
    pub fn stress_differential<const D: usize>(
        &self,
        mu: f64,
        inverse: &SMatrix<f64, D, D>,
        df: &SMatrix<f64, D, D>,
    ) -> SMatrix<f64, D, D> {
        let turned = times(&times(inverse, &df.transpose()), inverse);
        df * mu - turned * self.stress + inverse * (self.slope * contract(inverse, df))
    }

    /// `K_ab = weight (mu (g_a.g_b) I - s h_b h_a^T + J s' h_a h_b^T)` with the spatial gradients `h = F^-T g`.
    #[inline(always)]
    pub fn element_stiffness<const D: usize, const N: usize>(
        &self,
        mu: f64,
        inverse: &SMatrix<f64, D, D>,
        g: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        let h = map_gradients(inverse, g);
        let (mu, stress, slope) = (weight * mu, weight * self.stress, weight * self.slope);
        fill_upper::<D, N>(upper, |a, b| {
            let mut k = [[0.0; D]; D];
            for i in 0..D {
                for l in 0..D {
                    k[i][l] = slope * (h[a][i] * h[b][l]) - stress * (h[b][i] * h[a][l]);
                }
                k[i][i] += mu * dot(&g[a], &g[b]);
            }
            k
        });
    }
}
