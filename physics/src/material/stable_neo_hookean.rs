//! A neo-Hookean solid that is defined under inversion.

use super::contracted::{add_dyad, add_isotropic, add_volume_curvature, closed_or_principal, mapped};
use super::lame::law_of_lame;
use super::principal::{self, Curvature, Elements, Principal, Products, finite_or_infinite, methods_by_packs};
use super::{Hyperelastic, Lame, MaterialError, Tangent};
use crate::lanes::{
    Lane, Pack, PackMatrix, array_of, cofactor, cofactor_differential, contract, determinant_by, lane_of, matrix_of,
    pack, single, unpack,
};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = m/2 (I - 3) - m/2 ln((I + 1)/4) - 3 m/4 (J - 1) + l/2 (J - 1)^2` with `I = tr F^T F` of the three-dimensional
/// `F`, `m = 4 mu/3` and `l = lambda + 5 mu/6`; `mu`, `lambda` in Pa.
///
/// Defined for every `F`, and smooth: no singular values are needed. The two constants are those for which small strains
/// see Lamé's `mu` and `lambda`, and the rest state is free of stress and energy. In two dimensions this is the law at
/// `F33 = 1` (plane strain).
///
/// Source: Smith, de Goes & Kim (2018), *Stable neo-Hookean flesh simulation*, (14), constants of section 3.4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct StableNeoHookean {
    lame: Lame,
}

law_of_lame!(StableNeoHookean);

impl StableNeoHookean {
    /// `m = 4 mu/3`, Pa.
    #[inline(always)]
    fn shear(&self) -> f64 {
        4.0 / 3.0 * self.lame.mu()
    }

    /// `l = lambda + 5 mu/6`, Pa; positive for every stable pair of constants.
    #[inline(always)]
    fn volume(&self) -> f64 {
        self.lame.lambda() + 5.0 / 6.0 * self.lame.mu()
    }

    /// In `H = F - I`, so that the constants cancel before they are rounded.
    #[inline(always)]
    fn energy<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> Pack<L> {
        let (mut stretch, dj) = (Pack::ZERO, determinant_by(f, &cofactor(f)) - Pack::ONE);
        for i in 0..D {
            for k in 0..D {
                let h = if i == k { f[i][i] - Pack::ONE } else { f[i][k] };
                stretch += h * h;
                if i == k {
                    stretch += h + h;
                }
            }
        }
        finite_or_infinite(self.of_invariants(stretch, dj))
    }

    /// `W` from `I - 3` and `J - 1`.
    #[inline(always)]
    fn of_invariants<const L: usize>(&self, stretch: Pack<L>, dj: Pack<L>) -> Pack<L> {
        let isochoric = stretch - (stretch * 0.25).map(f64::ln_1p);
        (isochoric * 0.5 - dj * 0.75) * self.shear() + dj * dj * (0.5 * self.volume())
    }

    /// `dW/dI = a/2` and `dW/dJ = u` as `(a, u)`; also `1/(I + 1)`.
    #[inline(always)]
    fn invariants<const L: usize>(&self, square: Pack<L>, j: Pack<L>, dimension: usize) -> [Pack<L>; 3] {
        // The stretches outside the plane are one.
        let weight = Pack::ONE / (square + Pack::splat((4 - dimension) as f64));
        let shear = (Pack::ONE - weight) * self.shear();
        [shear, (j - Pack::ONE) * self.volume() - Pack::splat(0.75 * self.shear()), weight]
    }

    /// `P = m (1 - 1/(I + 1)) F + (l (J - 1) - 3 m/4) cof F`.
    #[inline(always)]
    fn stress<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let cof = cofactor(f);
        let [shear, pressure, _] = self.invariants(contract(f, f), determinant_by(f, &cof), D);
        let mut p = *f;
        for i in 0..D {
            for k in 0..D {
                p[i][k] = shear * f[i][k] + pressure * cof[i][k];
            }
        }
        p
    }

    /// `K_ab = weight (a (g_a.g_b) I + 2 m/(I + 1)^2 f_a f_b^T + l c_a c_b^T + u J''_ab)` with `f = F g`, `c = cof(F) g`,
    /// see [`add_volume_curvature`].
    #[inline(always)]
    fn stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        project: bool,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let cof = cofactor(f);
        let [shear, pressure, ratio] = self.invariants(contract(f, f), determinant_by(f, &cof), D);
        let (fg, cg) = (mapped(f, g), mapped(&cof, g));
        let growth = weight * (ratio * ratio * (2.0 * self.shear()));
        let (shear, pressure, volume) = (weight * shear, weight * pressure, weight * self.volume());
        closed_or_principal(
            Elements { law: self, f, gradients: g, weight, project },
            &[!project; L],
            #[inline(always)]
            |a, b| {
                let mut k = [[Pack::ZERO; D]; D];
                add_isotropic(&mut k, shear, &g[a], &g[b]);
                add_dyad(&mut k, growth, &fg[a], &fg[b]);
                add_dyad(&mut k, volume, &cg[a], &cg[b]);
                add_volume_curvature(&mut k, pressure, f, &g[a], &g[b]);
                k
            },
            put,
        );
    }
}

impl Principal for StableNeoHookean {
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let mut stretch = Pack::ZERO;
        for s in s {
            let h = *s - Pack::ONE;
            stretch += h * h + h + h;
        }
        self.of_invariants(stretch, Products::of(s).j - Pack::ONE)
    }

    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let products = Products::of(s);
        let [shear, pressure, _] = self.invariants(sum_of_squares(s), products.j, D);
        array_of(|i| shear * s[i] + pressure * products.first[i])
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let products = Products::of(s);
        let [shear, pressure, weight] = self.invariants(sum_of_squares(s), products.j, D);
        let growth = weight * weight * (2.0 * self.shear());
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                let volume = pressure * products.second[i][k];
                let coupling = growth * (s[i] * s[k]) + products.first[i] * products.first[k] * self.volume();
                c.scaling[i][k] = coupling + if i == k { shear } else { volume };
                c.flip[i][k] = shear - volume;
                c.twist[i][k] = shear + volume;
            }
        }
        c
    }
}

/// `sum s_i^2`.
#[inline(always)]
fn sum_of_squares<const D: usize, const L: usize>(s: &[Pack<L>; D]) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for s in s {
        sum += *s * *s;
    }
    sum
}

impl<const D: usize> Hyperelastic<D> for StableNeoHookean {
    const REQUIRES_POSITIVE_J: bool = false;
    methods_by_packs!(D);

    /// `dP = a dF + 2 m (F : dF) F/(I + 1)^2 + l (cof F : dF) cof F + u d(cof F)`.
    fn stress_differential(&self, f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        let (f, df) = (single(f), single(df));
        let cof = cofactor(&f);
        let [shear, pressure, weight] = self.invariants(contract(&f, &f), determinant_by(&f, &cof), D);
        let stretching = weight * weight * (2.0 * self.shear()) * contract(&f, &df);
        let swelling = contract(&cof, &df) * self.volume();
        let dcof = cofactor_differential(&f, &df);
        let mut dp = f;
        for i in 0..D {
            for k in 0..D {
                dp[i][k] = shear * df[i][k] + stretching * f[i][k] + swelling * cof[i][k] + pressure * dcof[i][k];
            }
        }
        lane_of(&dp, 0)
    }

    fn projected_tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        principal::tangent(self, f, true)
    }
}
