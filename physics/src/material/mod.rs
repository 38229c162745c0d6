//! Hyperelastic materials: strain energy, stress and its differential as functions of the deformation gradient.
//!
//! | law | energy density | domain | stiffness |
//! |---|---|---|---|
//! | [`Linear`] | `mu \|e\|^2 + lambda/2 tr(e)^2`, `e = sym(F - I)` | every `F` | constant |
//! | [`StVenantKirchhoff`] | `mu \|G\|^2 + lambda/2 tr(G)^2`, `G = (F^T F - I)/2` | `J > 0` | varies |
//! | [`NeoHookean`] | `mu/2 (tr F^T F - D) - mu ln J + lambda/2 (J - 1)^2` | `J > 0` | varies |
//! | [`Corotated`] | `mu \|F - R\|^2 + lambda/2 tr(R^T F - I)^2`, `R` the polar rotation | every `F` | varies |
//! | [`FixedCorotated`] | `mu \|F - R\|^2 + lambda/2 (J - 1)^2` | every `F` | varies |
//! | [`StableNeoHookean`] | of Smith, de Goes & Kim (2018) | every `F` | varies |
//! | [`Invertible`] | St. Venant-Kirchhoff or neo-Hookean, continued below a stretch | every `F` | varies |
//!
//! [`Solid`] is any of them, chosen at run time, [`Plane`] in two dimensions either plane strain or plane stress. [`Viscosity`] adds a damping stress.
//!
//! In two dimensions each is plane strain (`F33 = 1`, per unit of thickness); [`PlaneStress`] of it solves `S33 = 0` instead.

mod contracted;
mod corotated;
mod fixed_corotated;
mod invertible;
mod lame;
mod linear;
mod neo_hookean;
mod plane;
mod plane_stress;
mod principal;
mod solid;
mod st_venant_kirchhoff;
mod stable_neo_hookean;
mod tangent;
mod thickness;
mod viscosity;

pub use corotated::{Corotated, RotationTangent};
pub use fixed_corotated::FixedCorotated;
pub use invertible::{Continued, Invertible};
pub use lame::{Lame, MaterialError};
pub use linear::Linear;
pub use neo_hookean::NeoHookean;
pub use plane::Plane;
pub use plane_stress::PlaneStress;
pub use solid::Solid;
pub use st_venant_kirchhoff::StVenantKirchhoff;
pub use stable_neo_hookean::StableNeoHookean;
pub use tangent::Tangent;
pub use viscosity::Viscosity;

use crate::lanes::{LANES, Lane, lane_matrix};
use nalgebra::SMatrix;

/// A hyperelastic solid in `D` dimensions. `f` is the deformation gradient `dx/dX`, dimensionless.
///
/// `D = 2` is plane strain; [`PlaneStress`] wraps a solid to solve `S33 = 0`. Thickness belongs to the body.
/// Outside the domain of a law (see [`REQUIRES_POSITIVE_J`](Self::REQUIRES_POSITIVE_J)) the energy is infinite and
/// the stress NaN, so that no method takes a point there for an equilibrium; the tangent is unspecified.
pub trait Hyperelastic<const D: usize>: Clone + Send + Sync {
    /// Whether the stiffness is constant, so that a body may evaluate its gradient as a matrix product.
    const IS_LINEAR: bool = false;

    /// Whether the energy is infinite where `J = det F <= 0`, so that a step must not invert an element.
    const REQUIRES_POSITIVE_J: bool = true;

    /// Strain energy density `W(F)`, J/m^3; `f64::INFINITY` outside its domain, so that a line search backs away.
    fn energy_density(&self, f: &SMatrix<f64, D, D>) -> f64;

    /// First Piola-Kirchhoff stress `P = dW/dF`, Pa; NaN outside the domain.
    fn first_piola_kirchhoff(&self, f: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D>;

    /// Stress differential `dP/dF : dF`, Pa.
    fn stress_differential(&self, f: &SMatrix<f64, D, D>, df: &SMatrix<f64, D, D>) -> SMatrix<f64, D, D>;

    /// The whole tangent `dP/dF`, Pa, by default column by column from the differential.
    fn tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        Tangent::from_columns(|df| self.stress_differential(f, df))
    }

    /// Stiffness of a P1 element: blocks `K_ab[i][k] = weight * grad_a[j] dP_ij/dF_kl grad_b[l]` for `a <= b`, row by
    /// row (`00 01 .. 11 12 ..`), where `weight` is the volume of the element (times its thickness).
    ///
    /// By default from [`tangent`](Self::tangent); the laws of this crate contract it in closed form.
    ///
    /// # Panics
    /// If `upper` does not hold `N (N + 1) / 2` blocks.
    fn element_stiffness<const N: usize>(
        &self,
        f: &SMatrix<f64, D, D>,
        gradients: &[[f64; D]; N],
        weight: f64,
        upper: &mut [[[f64; D]; D]],
    ) {
        self.tangent(f).element_stiffness(gradients, weight, upper);
    }

    /// Whether this value of the type refuses `J <= 0`; the constant answers for every value, unless the type holds one
    /// of several laws.
    fn requires_positive_j(&self) -> bool {
        Self::REQUIRES_POSITIVE_J
    }

    /// The nearest positive semidefinite tangent, Pa: negative eigenvalues become zero.
    ///
    /// By default numerically ([`Tangent::projected`]); the nonlinear solids of this crate know their eigensystem.
    fn projected_tangent(&self, f: &SMatrix<f64, D, D>) -> Tangent<D> {
        self.tangent(f).projected()
    }

    /// The strain energy densities of a group of elements, J/m^3: the bits of [`energy_density`](Self::energy_density).
    #[inline(always)]
    fn energy_lanes(&self, f: &[[Lane; D]; D]) -> Lane {
        let mut energy = [0.0; LANES];
        for lane in 0..LANES {
            energy[lane] = self.energy_density(&lane_matrix(f, lane));
        }
        energy
    }

    /// The stresses of a group of elements, Pa: the bits of [`first_piola_kirchhoff`](Self::first_piola_kirchhoff).
    ///
    /// By default lane by lane.
    #[inline(always)]
    fn stress_lanes(&self, f: &[[Lane; D]; D]) -> [[Lane; D]; D] {
        let mut stress = [[[0.0; LANES]; D]; D];
        for lane in 0..LANES {
            let p = self.first_piola_kirchhoff(&lane_matrix(f, lane));
            for i in 0..D {
                for k in 0..D {
                    stress[i][k][lane] = p[(i, k)];
                }
            }
        }
        stress
    }

    /// Overwrites the deformation gradients of several groups of elements with their stresses, Pa: the bits of
    /// [`stress_lanes`](Self::stress_lanes).
    #[inline(always)]
    fn stress_groups(&self, groups: &mut [[[Lane; D]; D]]) {
        for group in groups {
            *group = self.stress_lanes(group);
        }
    }

    /// Stiffnesses of a group of elements, of the projected tangent if `project`: the bits of
    /// [`element_stiffness`](Self::element_stiffness), or, up to rounding, that of the
    /// [`projected_tangent`](Self::projected_tangent).
    ///
    /// By default lane by lane.
    ///
    /// # Panics
    /// If `upper` does not hold `N (N + 1) / 2` blocks.
    #[inline(always)]
    fn element_stiffness_lanes<const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        project: bool,
        upper: &mut [[[Lane; D]; D]],
    ) {
        assert_eq!(upper.len(), N * (N + 1) / 2, "one block for each pair a <= b");
        lane_by_lane(
            upper,
            #[inline(always)]
            |lane, blocks| {
                let f = lane_matrix(f, lane);
                let g = lane_gradients(gradients, lane);
                if project {
                    self.projected_tangent(&f).element_stiffness(&g, weight[lane], blocks);
                } else {
                    self.element_stiffness(&f, &g, weight[lane], blocks);
                }
            },
        );
    }
}

/// Pairs of vertices of a tetrahedron.
const MAX_PAIRS: usize = 10;

/// The gradients of one lane.
#[inline(always)]
fn lane_gradients<const D: usize, const N: usize>(gradients: &[[Lane; D]; N], lane: usize) -> [[f64; D]; N] {
    let mut g = [[0.0; D]; N];
    for a in 0..N {
        for i in 0..D {
            g[a][i] = gradients[a][i][lane];
        }
    }
    g
}

/// Fills the blocks of a group from a function that fills those of one lane.
#[inline(always)]
fn lane_by_lane<const D: usize>(upper: &mut [[[Lane; D]; D]], mut fill: impl FnMut(usize, &mut [[[f64; D]; D]])) {
    let mut blocks = [[[0.0; D]; D]; MAX_PAIRS];
    let blocks = &mut blocks[..upper.len()];
    for lane in 0..LANES {
        fill(lane, blocks);
        for (block, out) in blocks.iter().zip(upper.iter_mut()) {
            for i in 0..D {
                for k in 0..D {
                    out[i][k][lane] = block[i][k];
                }
            }
        }
    }
}

/// Fills the upper triangle of an element stiffness from a formula for its blocks.
#[inline(always)]
fn fill_upper<const D: usize, const N: usize>(
    upper: &mut [[[f64; D]; D]],
    mut block: impl FnMut(usize, usize) -> [[f64; D]; D],
) {
    assert_eq!(upper.len(), N * (N + 1) / 2, "one block for each pair a <= b");
    let mut at = 0;
    for a in 0..N {
        for b in a..N {
            upper[at] = block(a, b);
            at += 1;
        }
    }
}
