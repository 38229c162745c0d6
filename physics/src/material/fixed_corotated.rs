//! The corotated law with its volume term exact.

use super::contracted::{RotationGradient, add_dyad, add_isotropic, add_volume_curvature, closed_or_principal, mapped};
use super::corotated::{distance_squared, strains_squared};
use super::lame::law_of_non_negative_lame;
use super::principal::{
    self, Curvature, Elements, Principal, Products, differentials_by_principal_stretches, finite_or_infinite,
    methods_by_packs, pair_sum,
};
use super::{Hyperelastic, Lame, MaterialError, Tangent};
use crate::lanes::{
    Lane, Pack, PackMatrix, array_of, cofactor, determinant_by, lane_of, matrix_of, pack, single, unpack,
};
use crate::svd::{Polar, polar};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = mu |F - R|^2 + lambda/2 (J - 1)^2` with the rotation `R` closest to `F`; `mu`, `lambda` in Pa.
///
/// Defined for every `F`, see [`Corotated`](super::Corotated) for the rotation; the volume term is that of the neo-Hookean
/// law.
///
/// Source: Stomakhin, Howes, Schroeder & Teran (2012), *Energetically consistent invertible elasticity*, section 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FixedCorotated {
    #[serde(deserialize_with = "Lame::deserialize_non_negative")]
    lame: Lame,
}

law_of_non_negative_lame!(FixedCorotated);

impl FixedCorotated {
    #[inline(always)]
    fn energy<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> Pack<L> {
        let distance = distance_squared(f, &polar(f).rotation);
        let dj = determinant_by(f, &cofactor(f)) - Pack::ONE;
        finite_or_infinite(distance * self.lame.mu() + dj * dj * (0.5 * self.lame.lambda()))
    }

    /// `P = 2 mu (F - R) + lambda (J - 1) cof F`.
    #[inline(always)]
    fn stress<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let (r, cof) = (polar(f).rotation, cofactor(f));
        let pressure = (determinant_by(f, &cof) - Pack::ONE) * self.lame.lambda();
        let mut p = *f;
        for i in 0..D {
            for k in 0..D {
                p[i][k] = (f[i][k] - r[i][k]) * (2.0 * self.lame.mu()) + pressure * cof[i][k];
            }
        }
        p
    }

    /// `K_ab = weight (2 mu (g_a.g_b) I + lambda c_a c_b^T + lambda (J - 1) J''_ab - 2 mu [h_a]^T Q [h_b])` with
    /// `c = cof(F) g` and `h = R g`, see [`RotationGradient`] and [`add_volume_curvature`].
    #[inline(always)]
    fn stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        project: bool,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let (cof, Polar { rotation: r, regular }) = (cofactor(f), polar(f));
        let (c, h, gradient) = (mapped(&cof, g), mapped(&r, g), RotationGradient::new(f, &r));
        let (two_mu, lambda) = (weight * (2.0 * self.lame.mu()), weight * self.lame.lambda());
        let pressure = lambda * (determinant_by(f, &cof) - Pack::ONE);
        closed_or_principal(
            Elements { law: self, f, gradients: g, weight, project },
            &if project { [false; L] } else { regular },
            #[inline(always)]
            |a, b| {
                let mut k = [[Pack::ZERO; D]; D];
                add_isotropic(&mut k, two_mu, &g[a], &g[b]);
                add_dyad(&mut k, lambda, &c[a], &c[b]);
                add_volume_curvature(&mut k, pressure, f, &g[a], &g[b]);
                gradient.add(&mut k, -two_mu, &h[a], &h[b]);
                k
            },
            put,
        );
    }
}

impl Principal for FixedCorotated {
    /// `mu sum((s - 1)^2) + lambda/2 (J - 1)^2`.
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let dj = Products::of(s).j - Pack::ONE;
        strains_squared(s) * self.lame.mu() + dj * dj * (0.5 * self.lame.lambda())
    }

    /// `2 mu (s_i - 1) + lambda (J - 1) dJ/ds_i`.
    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let products = Products::of(s);
        let pressure = (products.j - Pack::ONE) * self.lame.lambda();
        array_of(|i| (s[i] - Pack::ONE) * (2.0 * self.lame.mu()) + pressure * products.first[i])
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        let products = Products::of(s);
        let pressure = (products.j - Pack::ONE) * lambda;
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                c.scaling[i][k] = products.first[i] * products.first[k] * lambda;
                if i == k {
                    c.scaling[i][i] += Pack::splat(2.0 * mu);
                    continue;
                }
                let volume = pressure * products.second[i][k];
                c.scaling[i][k] += volume;
                c.flip[i][k] = Pack::splat(2.0 * mu) - volume;
                let pair = (s[i] - Pack::ONE) + (s[k] - Pack::ONE);
                c.twist[i][k] = pair * (2.0 * mu) / pair_sum(s[i], s[k]) + volume;
            }
        }
        c
    }
}

impl<const D: usize> Hyperelastic<D> for FixedCorotated {
    const REQUIRES_POSITIVE_J: bool = false;
    methods_by_packs!(D);
    differentials_by_principal_stretches!(D);
}
