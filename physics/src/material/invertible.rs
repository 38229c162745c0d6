//! Laws that end at `J = 0`, continued to inverted elements.

use super::principal::{
    self, Curvature, Principal, Products, differentials_by_principal_stretches, methods_by_packs, pair_sum,
};
use super::{Hyperelastic, Lame, MaterialError, NeoHookean, StVenantKirchhoff, Tangent};
use crate::lanes::{Lane, Pack, array_of, lane_of, matrix_of, pack, single, unpack};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// A law continued below a principal stretch `e`, the threshold: there the stress of a stretch is continued linearly (the
/// others held), so that it grows with the depth of an inversion and points back.
///
/// The energy is continued, not the stress alone, so that force and stiffness stay derivatives of one energy. Written with
/// the signed singular values `s` (the smallest takes the sign of `det F`):
///
/// | law | what is continued | default `e` |
/// |---|---|---|
/// | [`NeoHookean`] | `-mu ln s`, quadratically; `lambda/2 (J - 1)^2` is linear in each stretch's stress as it is | 0.25 |
/// | [`StVenantKirchhoff`] | `mu/4 (s^2 - 1)^2`, quadratically, and `s^2` linearly in `lambda/8 (sum s^2 - D)^2` | 0.65 |
///
/// At and above the threshold nothing changes. The threshold of St. Venant-Kirchhoff lies above `1/sqrt(3)`, where the law
/// loses its stiffness in compression: what is continued must still push back.
///
/// Source: Irving, Teran & Fedkiw (2004), *Invertible finite elements for robust simulation of large deformation*, section
/// 5; the energy by terms, in the sense of Stomakhin, Howes, Schroeder & Teran (2012).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked<M>", bound(deserialize = "M: Deserialize<'de> + Continued"))]
pub struct Invertible<M> {
    solid: M,
    threshold: f64,
}

/// What a file holds, before it is checked.
#[derive(Deserialize)]
#[serde(rename = "Invertible")]
struct Unchecked<M> {
    solid: M,
    threshold: f64,
}

impl<M: Continued> TryFrom<Unchecked<M>> for Invertible<M> {
    type Error = MaterialError;
    fn try_from(raw: Unchecked<M>) -> Result<Self, MaterialError> {
        Self::with_threshold(raw.solid, raw.threshold)
    }
}

/// A law that [`Invertible`] knows how to continue. Sealed.
pub trait Continued: sealed::Sealed {
    /// The stretch below which the law is continued unless another is named.
    const DEFAULT_THRESHOLD: f64;
    /// Stretches at and below this one cannot be the threshold, nor can 1 and larger ones.
    const LOWEST_THRESHOLD: f64;
    /// The range in words.
    #[doc(hidden)]
    const REQUIREMENT: &'static str;
}

mod sealed {
    pub trait Sealed {}
    impl Sealed for super::NeoHookean {}
    impl Sealed for super::StVenantKirchhoff {}
}

impl Continued for NeoHookean {
    const DEFAULT_THRESHOLD: f64 = 0.25;
    const LOWEST_THRESHOLD: f64 = 0.0;
    const REQUIREMENT: &'static str = "0 < threshold < 1";
}

impl Continued for StVenantKirchhoff {
    const DEFAULT_THRESHOLD: f64 = 0.65;
    /// `1/sqrt(3)`, rounded up.
    const LOWEST_THRESHOLD: f64 = 0.577_350_27;
    const REQUIREMENT: &'static str = "1/sqrt(3) < threshold < 1";
}

impl<M: Continued> Invertible<M> {
    /// The law continued below its default threshold.
    pub fn new(solid: M) -> Self {
        Self { solid, threshold: M::DEFAULT_THRESHOLD }
    }

    /// The law continued below this stretch.
    ///
    /// # Errors
    /// [`MaterialError::Threshold`] unless `LOWEST_THRESHOLD < threshold < 1`.
    pub fn with_threshold(solid: M, threshold: f64) -> Result<Self, MaterialError> {
        if threshold > M::LOWEST_THRESHOLD && threshold < 1.0 {
            Ok(Self { solid, threshold })
        } else {
            Err(MaterialError::Threshold { threshold, requirement: M::REQUIREMENT })
        }
    }

    /// The law that is continued.
    pub fn solid(&self) -> &M {
        &self.solid
    }

    /// The stretch below which it is.
    pub fn threshold(&self) -> f64 {
        self.threshold
    }

    /// A stretch split at the threshold: `max(s, e)` and what is missing to it, `min(s - e, 0)`.
    #[inline(always)]
    fn split<const L: usize>(&self, s: Pack<L>) -> (Pack<L>, Pack<L>) {
        let bound = Pack::splat(self.threshold);
        let kept = s.where_less(bound, bound, s);
        (kept, s - kept)
    }

    /// The share of the way from `s_i` to `s_k` on which the law is itself: the weight of its own divided difference
    /// against the slope of the continuation.
    #[inline(always)]
    fn share<const L: usize>(&self, a: Pack<L>, b: Pack<L>) -> Pack<L> {
        let ((kept_a, _), (kept_b, _)) = (self.split(a), self.split(b));
        let (way, kept) = (a - b, kept_a - kept_b);
        let at_a = a.where_less(Pack::splat(self.threshold), Pack::ZERO, Pack::ONE);
        Pack::ZERO.where_less(way.abs(), kept / way, at_a)
    }
}

impl Invertible<NeoHookean> {
    fn lame(&self) -> Lame {
        self.solid.lame()
    }

    /// `d(-mu ln s)/ds` continued.
    #[inline(always)]
    fn logarithm_slope<const L: usize>(&self, s: Pack<L>) -> Pack<L> {
        let (mu, e) = (self.lame().mu(), self.threshold);
        let (kept, missing) = self.split(s);
        missing * (mu / (e * e)) - Pack::splat(mu) / kept
    }
}

impl Principal for Invertible<NeoHookean> {
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let (mu, e) = (self.lame().mu(), self.threshold);
        let dj = Products::of(s).j - Pack::ONE;
        let mut energy = dj * dj * (0.5 * self.lame().lambda());
        for s in s {
            let (kept, missing) = self.split(*s);
            let h = *s - Pack::ONE;
            let logarithm =
                (kept - Pack::ONE).map(f64::ln_1p) + missing * (1.0 / e) - missing * missing * (0.5 / (e * e));
            energy += (h + h * h * 0.5 - logarithm) * mu;
        }
        energy
    }

    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let products = Products::of(s);
        let pressure = (products.j - Pack::ONE) * self.lame().lambda();
        array_of(|i| s[i] * self.lame().mu() + self.logarithm_slope(s[i]) + pressure * products.first[i])
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda, e) = (self.lame().mu(), self.lame().lambda(), self.threshold);
        let products = Products::of(s);
        let pressure = (products.j - Pack::ONE) * lambda;
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                let (kept_i, kept_k) = (self.split(s[i]).0, self.split(s[k]).0);
                let (own, share) = (Pack::splat(mu) / (kept_i * kept_k), self.share(s[i], s[k]));
                let slope = share * own + (Pack::ONE - share) * (mu / (e * e));
                let volume = pressure * products.second[i][k];
                c.scaling[i][k] = products.first[i] * products.first[k] * lambda;
                c.scaling[i][k] += if i == k { Pack::splat(mu) + slope } else { volume };
                c.flip[i][k] = Pack::splat(mu) + slope - volume;
                let pair = (s[i] + s[k]) * mu + (self.logarithm_slope(s[i]) + self.logarithm_slope(s[k]));
                c.twist[i][k] = pair / pair_sum(s[i], s[k]) + volume;
            }
        }
        c
    }
}

impl Invertible<StVenantKirchhoff> {
    fn lame(&self) -> Lame {
        self.solid.lame()
    }

    /// `mu s (s^2 - 1)` continued.
    #[inline(always)]
    fn own_slope<const L: usize>(&self, s: Pack<L>) -> Pack<L> {
        let (mu, e) = (self.lame().mu(), self.threshold);
        let (kept, missing) = self.split(s);
        kept * (kept * kept - Pack::ONE) * mu + missing * (mu * (3.0 * e * e - 1.0))
    }

    /// `sum(s^2 - 1)`, each term continued.
    #[inline(always)]
    fn doubled_green_trace<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let mut sum = Pack::ZERO;
        for s in s {
            let (kept, missing) = self.split(*s);
            sum += (kept * kept - Pack::ONE) + missing * (2.0 * self.threshold);
        }
        sum
    }
}

impl Principal for Invertible<StVenantKirchhoff> {
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        let (mu, e) = (self.lame().mu(), self.threshold);
        let trace = self.doubled_green_trace(s);
        let mut energy = trace * trace * (0.125 * self.lame().lambda());
        for s in s {
            let (kept, missing) = self.split(*s);
            let strain = kept * kept - Pack::ONE;
            energy += (strain * strain * 0.25
                + missing * (e * (e * e - 1.0))
                + missing * missing * (0.5 * (3.0 * e * e - 1.0)))
                * mu;
        }
        energy
    }

    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let pressure = self.doubled_green_trace(s) * (0.5 * self.lame().lambda());
        array_of(|i| self.own_slope(s[i]) + pressure * self.split(s[i]).0)
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let (mu, lambda, e) = (self.lame().mu(), self.lame().lambda(), self.threshold);
        let pressure = self.doubled_green_trace(s) * (0.5 * lambda);
        let mut c = Curvature::ZERO;
        for i in 0..D {
            for k in 0..D {
                let (a, b) = (self.split(s[i]).0, self.split(s[k]).0);
                let own = (a * a + a * b + b * b - Pack::ONE) * mu;
                let share = self.share(s[i], s[k]);
                c.flip[i][k] = share * (own + pressure) + (Pack::ONE - share) * (mu * (3.0 * e * e - 1.0));
                c.scaling[i][k] = a * b * lambda;
                if i == k {
                    c.scaling[i][i] += c.flip[i][i];
                }
                let pair = self.own_slope(s[i]) + self.own_slope(s[k]) + pressure * (a + b);
                c.twist[i][k] = pair / pair_sum(s[i], s[k]);
            }
        }
        c
    }
}

/// Everything else follows from the principal derivatives.
macro_rules! hyperelastic {
    ($solid:ty) => {
        impl<const D: usize> Hyperelastic<D> for Invertible<$solid> {
            const REQUIRES_POSITIVE_J: bool = false;
            methods_by_packs!(D);
            differentials_by_principal_stretches!(D);
        }
    };
}
hyperelastic!(NeoHookean);
hyperelastic!(StVenantKirchhoff);
