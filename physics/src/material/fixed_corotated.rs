//! The corotated law with its volume term exact.

use super::corotated::{distance_squared, finite_or_infinite};
use super::principal::{
    self, Curvature, Principal, PrincipalTangent, Products, differentials_by_principal_stretches, methods_by_packs,
    pair_sum,
};
use super::{Hyperelastic, Lame, MaterialError, Tangent};
use crate::lanes::{Lane, Pack, PackMatrix, cofactor, determinant_by, lane_of, pack, single, unpack};
use crate::svd::polar_rotation_pack;
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// `W(F) = mu |F - R|^2 + lambda/2 (J - 1)^2` with the rotation `R` closest to `F`; `mu`, `lambda` in Pa.
///
/// Defined for every `F`, see [`Corotated`](super::Corotated) for the rotation; the volume term is that of the neo-Hookean
/// law.
///
/// Source: Stomakhin, Howes, Schroeder & Teran (2012), *Energetically consistent invertible elasticity*, section 4.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked")]
pub struct FixedCorotated {
    lame: Lame,
}

/// What a file holds, before it is checked.
#[derive(Deserialize)]
#[serde(rename = "FixedCorotated")]
struct Unchecked {
    lame: Lame,
}

impl TryFrom<Unchecked> for FixedCorotated {
    type Error = MaterialError;
    fn try_from(raw: Unchecked) -> Result<Self, MaterialError> {
        Self::from_lame(raw.lame)
    }
}

impl FixedCorotated {
    /// From Young's modulus (Pa, positive) and Poisson's ratio, `0 <= poisson < 0.5` (below 0 the energy has no lower
    /// bound).
    ///
    /// # Errors
    /// [`MaterialError`] if a constant is out of range.
    pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        Ok(Self { lame: Lame::from_young_non_negative_poisson(young, poisson)? })
    }

    /// From Lamé's constants.
    ///
    /// # Errors
    /// [`MaterialError::LameConstants`] if `lambda < 0`.
    pub fn from_lame(lame: Lame) -> Result<Self, MaterialError> {
        Ok(Self { lame: lame.non_negative()? })
    }

    /// Lamé's constants.
    pub fn lame(&self) -> Lame {
        self.lame
    }

    #[inline(always)]
    fn energy<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> Pack<L> {
        let distance = distance_squared(f, &polar_rotation_pack(f));
        let dj = determinant_by(f, &cofactor(f)) - Pack::ONE;
        finite_or_infinite(distance * self.lame.mu() + dj * dj * (0.5 * self.lame.lambda()))
    }

    /// `P = 2 mu (F - R) + lambda (J - 1) cof F`.
    #[inline(always)]
    fn stress<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let (r, cof) = (polar_rotation_pack(f), cofactor(f));
        let pressure = (determinant_by(f, &cof) - Pack::ONE) * self.lame.lambda();
        let mut p = *f;
        for i in 0..D {
            for k in 0..D {
                p[i][k] = (f[i][k] - r[i][k]) * (2.0 * self.lame.mu()) + pressure * cof[i][k];
            }
        }
        p
    }

    #[inline(always)]
    fn stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        project: bool,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        PrincipalTangent::new(self, f, project).element_stiffness(g, weight, put);
    }
}

impl Principal for FixedCorotated {
    /// `2 mu (s_i - 1) + lambda (J - 1) dJ/ds_i`.
    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let products = Products::of(s);
        let pressure = (products.j - Pack::ONE) * self.lame.lambda();
        std::array::from_fn(|i| (s[i] - Pack::ONE) * (2.0 * self.lame.mu()) + pressure * products.first[i])
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
