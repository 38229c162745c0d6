//! When the stiffness of an element has changed enough to be evaluated anew.

use super::element::Group;
use crate::lanes::{LANES, Lane};
use crate::material::Hyperelastic;
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};

/// Which elements a linearisation evaluates anew; `F` is the deformation gradient now, `F0` that of the last evaluation.
///
/// Energy and gradient stay exact, so an equilibrium is the same: only search directions, or the linearised step of a time
/// integrator, change. The outcome depends on the sequence of linearisations; [`Linearization`](super::Linearization) is
/// the state to keep for a resumed run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LazyRule {
    /// All.
    #[default]
    Always,
    /// Those with `|F - F0| > threshold |F0|`, Frobenius norms. The relative error of an element's stiffness is about
    /// `threshold` times `|d2P/dF2| |F| / |dP/dF|`, of order one for moderate strains and growing as `1/J` where an element
    /// is crushed.
    Strain(f64),
    /// Those with `e = (lambda + 2 mu) |F - F0| max|N| max|B|` above this threshold, N/m, where `N` holds the area-weighted
    /// normals of the faces (`D` volumes times the gradient of the opposite coordinate) and `B` the barycentric gradients:
    /// how much an entry of the stiffness of a corotated element may change, to first order; laws whose curvature grows, as
    /// `1/J` under compression, may change by more. Unlike [`Rotation`](Self::Rotation), whose unit it shares, it sees an
    /// element that turns as a whole, does not jump where two stretches coincide, and takes no decomposition.
    Stiffness(f64),
    /// Those with `e = (max|dU| max|dV|)^2 max|N| max|B| lambda` above this threshold, N/m, where `F = U S V^T` is the signed
    /// decomposition of Irving et al. (2004) and `dU`, `dV` the changes of its rotations since the last evaluation: the
    /// published measure. The damping modulus that it weighs against `lambda` is never larger here (it is that of
    /// `damping time lambda`, below a second). An element that turns as a whole (`dV = 0`) is never evaluated anew.
    ///
    /// Source: Chentanez et al. (2009), section 3.6.3, eq. (12). In one dimension nothing ever turns.
    Rotation(f64),
}

/// Moduli at rest, Pa.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moduli {
    /// `dP_11/dF_11 = lambda + 2 mu`.
    pub axial: f64,
    /// `dP_22/dF_11 = lambda`; in one dimension that of above.
    pub lateral: f64,
}

impl Moduli {
    pub fn at_rest<const D: usize>(material: &impl Hyperelastic<D>) -> Self {
        let mut df = SMatrix::zeros();
        df[(0, 0)] = 1.0;
        let dp: SMatrix<f64, D, D> = material.stress_differential(&SMatrix::identity(), &df);
        Self { axial: dp[(0, 0)], lateral: dp[(D - 1, D - 1)] }
    }
}

impl LazyRule {
    /// Whether no element is ever kept: a threshold that is not positive (or NaN) keeps none.
    pub fn is_eager(self) -> bool {
        match self {
            Self::Always => true,
            Self::Strain(threshold) | Self::Stiffness(threshold) | Self::Rotation(threshold) => {
                threshold.is_nan() || threshold <= 0.0
            }
        }
    }

    /// Which lanes to evaluate anew by a rule that compares deformation gradients.
    #[inline(always)]
    pub(super) fn changed<const D: usize, const N: usize>(
        self,
        group: &Group<D, N>,
        moduli: Moduli,
        f: &[[Lane; D]; D],
        f0: &[[Lane; D]; D],
    ) -> [bool; LANES] {
        let (difference, norm) = differences(f, f0);
        let mut limit = [f64::NEG_INFINITY; LANES];
        match self {
            Self::Always => {}
            Self::Strain(threshold) => {
                for k in 0..LANES {
                    limit[k] = threshold * threshold * norm[k];
                }
            }
            Self::Stiffness(threshold) => {
                let size = sizes(group);
                for k in 0..LANES {
                    let bound = threshold / (moduli.axial * size[k]);
                    limit[k] = bound * bound;
                }
            }
            Self::Rotation(_) => limit = [f64::INFINITY; LANES],
        }
        let mut changed = [false; LANES];
        for k in 0..LANES {
            // A free lane is no change.
            changed[k] = (group.weight[k] != 0.0) & exceeds(difference[k], limit[k]);
        }
        changed
    }

    /// Whether an element of a group can turn so far that it is evaluated anew: entries of rotations differ by 2 at most.
    #[inline(always)]
    pub(super) fn may_turn<const D: usize, const N: usize>(
        group: &Group<D, N>,
        moduli: Moduli,
        threshold: f64,
    ) -> bool {
        let size = sizes(group);
        let mut may = false;
        for k in 0..LANES {
            may |= (group.weight[k] != 0.0) & exceeds(16.0 * moduli.lateral * size[k], threshold);
        }
        may
    }

    /// Which lanes to evaluate anew where the product of the changes of both rotations is `turned`, eq. (12); none that has
    /// not moved: where stretches coincide, rounding errors turn the axes.
    #[inline(always)]
    pub(super) fn turned<const D: usize, const N: usize>(
        group: &Group<D, N>,
        moduli: Moduli,
        f: &[[Lane; D]; D],
        f0: &[[Lane; D]; D],
        turned: &[f32; LANES],
        threshold: f64,
    ) -> [bool; LANES] {
        let (size, (difference, _)) = (sizes(group), differences(f, f0));
        let mut changed = [false; LANES];
        for k in 0..LANES {
            let product = f64::from(turned[k]);
            let moved = (group.weight[k] != 0.0) & (difference[k] != 0.0);
            changed[k] = moved & exceeds(product * product * (moduli.lateral * size[k]), threshold);
        }
        changed
    }

    /// Whether this rule compares rotations.
    pub(super) fn compares_rotations(self) -> bool {
        matches!(self, Self::Rotation(_)) && !self.is_eager()
    }
}

/// `|F - F0|^2` and `|F0|^2` of each lane, Frobenius norms.
#[inline(always)]
fn differences<const D: usize>(f: &[[Lane; D]; D], f0: &[[Lane; D]; D]) -> (Lane, Lane) {
    let (mut difference, mut norm) = ([0.0; LANES], [0.0; LANES]);
    for i in 0..D {
        for k in 0..D {
            for lane in 0..LANES {
                let d = f[i][k][lane] - f0[i][k][lane];
                difference[lane] += d * d;
                norm[lane] += f0[i][k][lane] * f0[i][k][lane];
            }
        }
    }
    (difference, norm)
}

/// A NaN exceeds everything.
#[inline(always)]
fn exceeds(value: f64, limit: f64) -> bool {
    // Without a branch; a limit is never NaN where the value is not.
    (value > limit) | value.is_nan()
}

/// `max|N| max|B|` of each lane, m in three dimensions.
#[inline(always)]
fn sizes<const D: usize, const N: usize>(group: &Group<D, N>) -> Lane {
    let mut largest = [0.0f64; LANES];
    let mut first = [[0.0; LANES]; D];
    for a in 0..D {
        for k in 0..D {
            for lane in 0..LANES {
                largest[lane] = largest[lane].max(group.gradients[a][k][lane].abs());
                first[k][lane] -= group.gradients[a][k][lane];
            }
        }
    }
    for k in 0..D {
        for lane in 0..LANES {
            largest[lane] = largest[lane].max(first[k][lane].abs());
        }
    }
    for k in 0..LANES {
        largest[k] = D as f64 * group.weight[k] * largest[k] * largest[k];
    }
    largest
}
