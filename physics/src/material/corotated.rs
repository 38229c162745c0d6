//! Linear elasticity in a frame that turns with the element.

use super::contracted::{RotationGradient, add_dyad, add_isotropic, closed_or_principal, mapped};
use super::principal::{
    self, Curvature, Elements, Principal, balanced_stiffness, finite_or_infinite, methods_by_packs, pair_sum,
};
use super::{Hyperelastic, Lame, MaterialError, Tangent};
use crate::lanes::{
    Lane, Pack, PackMatrix, array_of, lane_of, matrix_of, pack, single, times, transpose_times, unpack,
};
use crate::svd::{Polar, polar};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// How the tangent of [`Corotated`] treats the rotation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationTangent {
    /// `R` follows `F`: the true derivative of the stress, with which Newton's method converges quadratically. It may be
    /// indefinite under compression; methods that need a definite one take the projected tangent.
    #[default]
    Exact,
    /// `R` is held while the strain in the turned frame, `sym(R^T F) - I`, is differentiated: the constant stiffness of
    /// linear elasticity, turned. Always positive semidefinite, exact in an undeformed element however it is turned, and
    /// wrong by terms of the size of the stress elsewhere: Newton's method converges linearly.
    ///
    /// Source: Chentanez et al. (2009), *Interactive simulation of surgical needle insertion and steering*, section 3.2.
    Held,
}

/// `W(F) = mu |F - R|^2 + lambda/2 tr(R^T F - I)^2` with the rotation `R` closest to `F`; `mu`, `lambda` in Pa.
///
/// Defined for every `F`: an inverted element is pushed back along its shortest way (the smallest principal stretch takes
/// the sign of `det F`). In two dimensions `R` is a rotation in the plane. The law is linear in the stretches, so that it
/// does not resist volume loss more than linearly, and for `nu` near 0.5 turns shear the wrong way at large strain.
///
/// Source: Irving, Teran & Fedkiw (2004), *Invertible finite elements for robust simulation of large deformation*.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Corotated {
    pub(super) lame: Lame,
    #[serde(default)]
    pub(super) rotation: RotationTangent,
}

impl Corotated {
    /// From Young's modulus (Pa, positive) and Poisson's ratio, `-1 < poisson < 0.5`; tangent
    /// [`RotationTangent::Exact`].
    ///
    /// # Errors
    /// [`MaterialError`] if a constant is out of range.
    pub fn from_young_poisson(young: f64, poisson: f64) -> Result<Self, MaterialError> {
        Ok(Self::from_lame(Lame::from_young_poisson(young, poisson)?))
    }

    /// From Lamé's constants.
    pub fn from_lame(lame: Lame) -> Self {
        Self { lame, rotation: RotationTangent::default() }
    }

    /// The same law with this tangent.
    #[must_use]
    pub fn with_rotation(self, rotation: RotationTangent) -> Self {
        Self { rotation, ..self }
    }

    /// Lamé's constants.
    pub fn lame(&self) -> Lame {
        self.lame
    }

    /// How the tangent treats the rotation.
    pub fn rotation(&self) -> RotationTangent {
        self.rotation
    }

    #[inline(always)]
    fn energy<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> Pack<L> {
        let r = polar(f).rotation;
        let (distance, strain) = (distance_squared(f, &r), trace_strain(f, &r));
        finite_or_infinite(distance * self.lame.mu() + strain * strain * (0.5 * self.lame.lambda()))
    }

    /// `P = 2 mu (F - R) + lambda tr(R^T F - I) R`.
    #[inline(always)]
    fn stress<const D: usize, const L: usize>(&self, f: &PackMatrix<D, L>) -> PackMatrix<D, L> {
        let r = polar(f).rotation;
        let pressure = trace_strain(f, &r) * self.lame.lambda();
        let mut p = *f;
        for i in 0..D {
            for k in 0..D {
                p[i][k] = (f[i][k] - r[i][k]) * (2.0 * self.lame.mu()) + pressure * r[i][k];
            }
        }
        p
    }

    /// `dP = R (2 mu e + lambda tr(e) I)` with `e = sym(R^T dF)`.
    #[inline(always)]
    fn held_differential<const D: usize>(&self, f: &PackMatrix<D, 1>, df: &PackMatrix<D, 1>) -> PackMatrix<D, 1> {
        let r = polar(f).rotation;
        let turned = transpose_times(&r, df);
        let mut dp = turned;
        let mut trace = Pack::ZERO;
        for i in 0..D {
            trace += turned[i][i];
            for k in 0..D {
                dp[i][k] = (turned[i][k] + turned[k][i]) * self.lame.mu();
            }
        }
        for i in 0..D {
            dp[i][i] += trace * self.lame.lambda();
        }
        times(&r, &dp)
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
        match self.rotation {
            RotationTangent::Exact => self.exact_stiffness(f, g, weight, project, put),
            RotationTangent::Held => self.held_stiffness(f, g, weight, put),
        }
    }

    /// `K_ab = weight (2 mu (g_a.g_b) I + lambda h_a h_b^T + p [h_a]^T Q [h_b])` with `h = R g` and
    /// `p = lambda tr(R^T F - I) - 2 mu`, see [`RotationGradient`].
    #[inline(always)]
    fn exact_stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        project: bool,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let Polar { rotation: r, mut regular } = polar(f);
        let (h, gradient) = (mapped(&r, g), RotationGradient::new(f, &r));
        let pressure = trace_strain(f, &r) * self.lame.lambda() - Pack::splat(2.0 * self.lame.mu());
        if project {
            let definite = gradient.is_definite_with(2.0 * self.lame.mu(), pressure);
            for l in 0..L {
                regular[l] &= definite[l];
            }
        }
        let (two_mu, lambda) = (weight * (2.0 * self.lame.mu()), weight * self.lame.lambda());
        let pressure = weight * pressure;
        closed_or_principal(
            Elements { law: self, f, gradients: g, weight, project },
            &regular,
            #[inline(always)]
            |a, b| {
                let mut k = [[Pack::ZERO; D]; D];
                add_isotropic(&mut k, two_mu, &g[a], &g[b]);
                add_dyad(&mut k, lambda, &h[a], &h[b]);
                gradient.add(&mut k, pressure, &h[a], &h[b]);
                k
            },
            put,
        );
    }

    /// `K_ab = weight (mu (g_a.g_b) I + mu h_b h_a^T + lambda h_a h_b^T)` with `h = R g`.
    #[inline(always)]
    fn held_stiffness<const D: usize, const N: usize, const L: usize>(
        &self,
        f: &PackMatrix<D, L>,
        g: &[[Pack<L>; D]; N],
        weight: Pack<L>,
        put: impl FnMut(usize, PackMatrix<D, L>),
    ) {
        let (mu, lambda) = (weight * self.lame.mu(), weight * self.lame.lambda());
        let h = mapped(&polar(f).rotation, g);
        balanced_stiffness::<D, L, N>(
            #[inline(always)]
            |a, b| {
                let mut k = [[Pack::ZERO; D]; D];
                add_isotropic(&mut k, mu, &g[a], &g[b]);
                add_dyad(&mut k, mu, &h[b], &h[a]);
                add_dyad(&mut k, lambda, &h[a], &h[b]);
                k
            },
            put,
        );
    }
}

/// `|F - R|^2`.
#[inline(always)]
pub(super) fn distance_squared<const D: usize, const L: usize>(f: &PackMatrix<D, L>, r: &PackMatrix<D, L>) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for i in 0..D {
        for k in 0..D {
            let x = f[i][k] - r[i][k];
            sum += x * x;
        }
    }
    sum
}

/// `tr(R^T F - I)`, as `R : (F - R)`.
#[inline(always)]
fn trace_strain<const D: usize, const L: usize>(f: &PackMatrix<D, L>, r: &PackMatrix<D, L>) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for i in 0..D {
        for k in 0..D {
            sum += r[i][k] * (f[i][k] - r[i][k]);
        }
    }
    sum
}

impl Principal for Corotated {
    /// `mu sum((s - 1)^2) + lambda/2 sum(s - 1)^2`.
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let strain = total_strain(s);
        strains_squared(s) * self.lame.mu() + strain * strain * (0.5 * self.lame.lambda())
    }

    /// `2 mu (s_i - 1) + lambda sum(s - 1)`.
    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let pressure = total_strain(s) * self.lame.lambda();
        array_of(|i| (s[i] - Pack::ONE) * (2.0 * self.lame.mu()) + pressure)
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda) = (self.lame.mu(), self.lame.lambda());
        let pressure = total_strain(s) * lambda;
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                c.scaling[i][k] = Pack::splat(if i == k { 2.0 * mu + lambda } else { lambda });
                c.flip[i][k] = Pack::splat(2.0 * mu);
                let pair = (s[i] - Pack::ONE) + (s[k] - Pack::ONE);
                c.twist[i][k] = (pair * mu + pressure) * 2.0 / pair_sum(s[i], s[k]);
            }
        }
        c
    }
}

/// `sum((s_i - 1)^2)`.
#[inline(always)]
pub(super) fn strains_squared<const D: usize, const L: usize>(s: &[Pack<L>; D]) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for s in s {
        let strain = *s - Pack::ONE;
        sum += strain * strain;
    }
    sum
}

/// `sum(s_i - 1)`.
#[inline(always)]
fn total_strain<const D: usize, const L: usize>(s: &[Pack<L>; D]) -> Pack<L> {
    let mut sum = Pack::ZERO;
    for s in s {
        sum += *s - Pack::ONE;
    }
    sum
}

impl<const D: usize> Hyperelastic<D> for Corotated {
    const REQUIRES_POSITIVE_J: bool = false;
    methods_by_packs!(D);

    fn stress_differential(&self, f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
        match self.rotation {
            RotationTangent::Exact => principal::stress_differential(self, f, df),
            RotationTangent::Held => lane_of(&self.held_differential(&single(f), &single(df)), 0),
        }
    }

    fn projected_tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        match self.rotation {
            RotationTangent::Exact => principal::tangent(self, f, true),
            RotationTangent::Held => self.tangent(f),
        }
    }
}
