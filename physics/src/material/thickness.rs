//! Plane stress of laws whose thickness stretch has no closed form: `dW/dq = 0` is solved for each element.
//!
//! In principal stretches the plane-stress law is a law of two stretches: `W*(s1, s2) = min over q >= 0 of W(s1, s2, q)`. Its
//! gradient is that of the solid at `q`, its second derivatives are the Schur complement `W_ik - W_i3 W_k3 / W_33`, and the
//! terms between pairs of axes, quotients of gradients, stay what they are.

use super::plane_stress::PLANE;
use super::principal::{self, Curvature, Principal, differentials_by_principal_stretches, methods_by_packs};
use super::{
    FixedCorotated, Hyperelastic, Invertible, NeoHookean, PlaneStress, StVenantKirchhoff, StableNeoHookean, Tangent,
};
use crate::lanes::{Lane, Pack, array_of, lane_of, matrix_of, pack, single, unpack};
use crate::svd::signed_svd;
use nalgebra::{Matrix2, SMatrix};

/// Newton steps after which a thickness is taken as it is; a dozen do where stretches are between 1/100 and 100, and each
/// at least halves what is left between the bounds after the first few.
const MOST_STEPS: usize = 100;

/// A step below this share of the thickness is the last: the next one, of its square, would not be seen.
const LAST_STEP: f64 = 1e-12;

/// The thickness stretch at two signed stretches in the plane. Lanes do not see each other.
#[inline(always)]
fn thickness<const L: usize>(solid: &impl Principal, a: Pack<L>, b: Pack<L>) -> Pack<L> {
    let mut searches = [Search::START; L];
    let (mut q, mut open) = (Pack::ONE, [true; L]);
    let flat = [a, b, Pack::ZERO];
    let (pull, rate) = (solid.gradient(&flat)[2], solid.curvature(&flat).scaling[2][2]);
    for l in 0..L {
        // Energies that are even in the thickness have no slope there, and may still fall.
        if pull.0[l] > 0.0 || (pull.0[l] == 0.0 && rate.0[l] >= 0.0) {
            (q.0[l], open[l]) = (0.0, false);
        }
    }
    for _ in 0..MOST_STEPS {
        if !open.contains(&true) {
            break;
        }
        let s = [a, b, q];
        let (stress, slope) = (solid.gradient(&s)[2], solid.curvature(&s).scaling[2][2]);
        for l in 0..L {
            if open[l] {
                open[l] = searches[l].go_on(stress.0[l], slope.0[l]);
                q.0[l] = searches[l].q;
            }
        }
    }
    q
}

/// The stretches in the plane, with that of the thickness.
#[inline(always)]
fn stretches<const D: usize, const L: usize>(solid: &impl Principal, s: &[Pack<L>; D]) -> [Pack<L>; 3] {
    const { assert!(D == 2, "plane stress has two dimensions") };
    [s[0], s[1], thickness(solid, s[0], s[1])]
}

/// The search for the root of an increasing function in one lane: Newton's method between bounds that close in.
#[derive(Clone, Copy)]
struct Search {
    q: f64,
    low: f64,
    high: f64,
}

impl Search {
    /// From the undeformed thickness.
    const START: Self = Self { q: 1.0, low: 0.0, high: f64::INFINITY };

    /// Moves `q` by what is known of it, and says whether it may have to move again.
    #[inline(always)]
    fn go_on(&mut self, stress: f64, slope: f64) -> bool {
        if stress > 0.0 {
            self.high = self.q;
        } else if stress < 0.0 {
            self.low = self.q;
        } else {
            // The root, or NaN, which no step mends.
            return false;
        }
        let before = self.q;
        let newton = before - stress / slope;
        // The bounds too: beside the root a step is lost in rounding, and ends where it began.
        let inside = slope > 0.0 && self.low <= newton && newton <= self.high;
        self.q = match (inside, self.high.is_finite()) {
            (true, _) => newton,
            (false, true) => 0.5 * (self.low + self.high),
            (false, false) => 2.0 * before,
        };
        (self.q - before).abs() > LAST_STEP * self.q
    }
}

impl<M: Principal> Principal for PlaneStress<M> {
    #[inline(always)]
    fn density<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Pack<L> {
        self.solid.density(&stretches(&self.solid, s))
    }

    #[inline(always)]
    fn gradient<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> [Pack<L>; D] {
        let gradient = self.solid.gradient(&stretches(&self.solid, s));
        array_of(|i| gradient[i])
    }

    #[inline(always)]
    fn curvature<const D: usize, const L: usize>(&self, s: &[Pack<L>; D]) -> Curvature<D, L> {
        let stretches = stretches(&self.solid, s);
        let of_solid = self.solid.curvature(&stretches);
        let scaling = of_solid.scaling;
        // A thickness that is used up stays at zero.
        let follows = Pack::ZERO.where_less(stretches[2], Pack::ONE / scaling[2][2], Pack::ZERO);
        Curvature {
            scaling: matrix_of(|i, k| scaling[i][k] - scaling[i][2] * scaling[2][k] * follows),
            flip: matrix_of(|i, k| of_solid.flip[i][k]),
            twist: matrix_of(|i, k| of_solid.twist[i][k]),
        }
    }
}

macro_rules! plane_stress {
    ($solid:ty) => {
        impl PlaneStress<$solid> {
            /// Thickness stretch `q` at the in-plane deformation gradient `f`; zero where nothing of it is left.
            pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
                let [a, b] = signed_svd(f).sigma;
                thickness(&self.solid, Pack([a]), Pack([b])).0[0]
            }
        }

        impl Hyperelastic<PLANE> for PlaneStress<$solid> {
            const REQUIRES_POSITIVE_J: bool = false;
            methods_by_packs!(PLANE);
            differentials_by_principal_stretches!(PLANE);
        }
    };
}
plane_stress!(FixedCorotated);
plane_stress!(StableNeoHookean);
plane_stress!(Invertible<StVenantKirchhoff>);
plane_stress!(Invertible<NeoHookean>);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Stretches in the plane from a crushed to a drawn sheet.
    fn stretch() -> impl Strategy<Value = f64> {
        (-3.0..2.0f64).prop_map(f64::exp)
    }

    proptest! {
        /// The general solution is the closed form of the neo-Hookean law, and of St. Venant-Kirchhoff where it has a root.
        #[test]
        fn the_general_form_is_the_closed_one(a in stretch(), b in stretch(), nu in 0.0..0.4999) {
            let f = Matrix2::new(a, 0.0, 0.0, b);
            let neo = PlaneStress::new(NeoHookean::from_young_poisson(1.0, nu).unwrap());
            let (closed, general) = (neo.thickness_stretch(&f), thickness(&neo.solid, Pack([a]), Pack([b])).0[0]);
            prop_assert!((closed - general).abs() <= 1e-12 * closed, "NH: {closed} against {general}");
            let stvk = PlaneStress::new(StVenantKirchhoff::from_young_poisson(1.0, nu).unwrap());
            let (closed, general) = (stvk.thickness_stretch(&f), thickness(&stvk.solid, Pack([a]), Pack([b])).0[0]);
            if closed.is_nan() {
                prop_assert_eq!(general, 0.0);
            } else {
                // Near the end of its domain q^2 is the difference of large numbers.
                let lost = 1e-14 * (1.0 + a * a + b * b) / (1.0 - 2.0 * nu);
                prop_assert!((closed * closed - general * general).abs() <= lost.max(1e-12 * closed * closed),
                             "StVK: {closed} against {general}");
            }
        }

        /// So are energy, stress and tangent, whose closed forms condense nothing.
        #[test]
        fn the_condensed_law_is_the_closed_one(a in 0.6..1.2f64, b in 0.6..1.2f64, nu in 0.0..0.45) {
            let f = Matrix2::new(a, 0.0, 0.0, b);
            let stretches = [Pack([a]), Pack([b])];
            macro_rules! agree {
                ($law:expr) => {
                    let law = PlaneStress::new($law);
                    let density = law.density(&stretches).0[0];
                    prop_assert!((density - law.energy_density(&f)).abs() < 1e-13, "energy");
                    let gradient = law.gradient(&stretches);
                    let p = law.first_piola_kirchhoff(&f);
                    prop_assert!((0..2).all(|i| (gradient[i].0[0] - p[(i, i)]).abs() < 1e-12), "stress");
                    let (tangent, curvature) = (law.tangent(&f), law.curvature(&stretches));
                    for i in 0..2 {
                        for k in 0..2 {
                            let entry = tangent.blocks[i][k][(i, k)];
                            prop_assert!((curvature.scaling[i][k].0[0] - entry).abs() < 1e-11 * (1.0 + entry.abs()));
                        }
                    }
                };
            }
            agree!(NeoHookean::from_young_poisson(1.0, nu).unwrap());
            agree!(StVenantKirchhoff::from_young_poisson(1.0, nu).unwrap());
        }
    }
}
