//! When the stiffness of an element has changed enough to be evaluated anew.

use super::element::Group;
use crate::lanes::{LANES, Lane, Pack, PackMatrix, pack};
use crate::material::Hyperelastic;
use crate::svd::{rotations_near, signed_svd_pack};
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

    /// Which lanes to evaluate anew.
    #[inline(always)]
    pub(super) fn changed<const D: usize, const N: usize>(
        self,
        group: &Group<D, N>,
        moduli: Moduli,
        f: &[[Lane; D]; D],
        f0: &[[Lane; D]; D],
        turn: Option<&Turn<D>>,
    ) -> [bool; LANES] {
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
        // A free lane is no change.
        let beyond = |limit: Lane| std::array::from_fn(|k| group.weight[k] != 0.0 && exceeds(difference[k], limit[k]));
        match self {
            Self::Always => beyond([f64::NEG_INFINITY; LANES]),
            Self::Strain(threshold) => beyond(norm.map(|n| threshold * threshold * n)),
            Self::Stiffness(threshold) => {
                let size = sizes(group);
                beyond(size.map(|size| (threshold / (moduli.axial * size)).powi(2)))
            }
            Self::Rotation(threshold) => {
                let scale = sizes(group).map(|size| moduli.lateral * size);
                // Entries of rotations differ by 2 at most.
                let moved = beyond([0.0; LANES]);
                let mut changed = [false; LANES];
                let Some(turn) = turn else { return changed };
                for k in 0..LANES {
                    changed[k] = moved[k] && exceeds(16.0 * scale[k], threshold);
                }
                if !changed.contains(&true) {
                    return changed;
                }
                let turned = turn.product(f);
                for k in 0..LANES {
                    changed[k] &= exceeds(turned[k] * turned[k] * scale[k], threshold);
                }
                changed
            }
        }
    }

    /// Whether this rule compares rotations.
    pub(super) fn compares_rotations(self) -> bool {
        matches!(self, Self::Rotation(_)) && !self.is_eager()
    }
}

/// The rotations `U`, `V` of the elements of a group where they were evaluated, in single precision: a function of `F`
/// there alone.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turn<const D: usize> {
    u: [[[f32; LANES]; D]; D],
    v: [[[f32; LANES]; D]; D],
}

impl<const D: usize> Turn<D> {
    /// Those of an element at rest.
    pub fn at_rest() -> Self {
        let mut identity = [[[0.0; LANES]; D]; D];
        for i in 0..D {
            identity[i][i] = [1.0; LANES];
        }
        Self { u: identity, v: identity }
    }

    /// Those of an evaluation at `f`. In one dimension nothing turns.
    pub fn of(f: &[[Lane; D]; D]) -> Self {
        match D {
            2 => Self::decomposed::<2>(f),
            3 => Self::decomposed::<3>(f),
            _ => Self::at_rest(),
        }
    }

    /// `E = D`: decompositions are for two and three dimensions alone.
    fn decomposed<const E: usize>(f: &[[Lane; D]; D]) -> Self {
        let svd = signed_svd_pack(&resized::<D, E, _>(&pack(f)));
        let single = |m: &PackMatrix<D, LANES>| m.map(|row| row.map(|x| x.0.map(|x| x as f32)));
        Self { u: single(&resized(&svd.u)), v: single(&resized(&svd.v)) }
    }

    /// `max|dU| max|dV|` of each lane on the way to `f`.
    #[inline(always)]
    fn product(&self, f: &[[Lane; D]; D]) -> Lane {
        match D {
            2 => self.product_in::<2>(f),
            3 => self.product_in::<3>(f),
            _ => [0.0; LANES],
        }
    }

    #[inline(always)]
    fn product_in<const E: usize>(&self, f: &[[Lane; D]; D]) -> Lane {
        let (u0, v0) = (resized::<D, E, _>(&doubled(&self.u)), resized::<D, E, _>(&doubled(&self.v)));
        let (u, v) = rotations_near(&resized::<D, E, _>(&pack(f)), &v0);
        (largest_change(&u, &u0) * largest_change(&v, &v0)).0
    }
}

#[inline(always)]
fn doubled<const D: usize>(m: &[[[f32; LANES]; D]; D]) -> PackMatrix<D, LANES> {
    let mut out = [[Pack::ZERO; D]; D];
    for i in 0..D {
        for k in 0..D {
            for lane in 0..LANES {
                out[i][k].0[lane] = f64::from(m[i][k][lane]);
            }
        }
    }
    out
}

#[inline(always)]
fn largest_change<const D: usize>(a: &PackMatrix<D, LANES>, b: &PackMatrix<D, LANES>) -> Pack<LANES> {
    let mut largest = Pack::ZERO;
    for i in 0..D {
        for k in 0..D {
            largest = largest.max((a[i][k] - b[i][k]).abs());
        }
    }
    largest
}

/// The same matrix where `E = D`.
#[inline(always)]
fn resized<const D: usize, const E: usize, T: Copy>(f: &[[T; D]; D]) -> [[T; E]; E] {
    let mut out = [[f[0][0]; E]; E];
    for i in 0..D.min(E) {
        for k in 0..D.min(E) {
            out[i][k] = f[i][k];
        }
    }
    out
}

/// A NaN exceeds everything.
#[inline(always)]
fn exceeds(value: f64, limit: f64) -> bool {
    value > limit || value.is_nan()
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
    std::array::from_fn(|k| D as f64 * group.weight[k] * largest[k] * largest[k])
}
