//! Any of the laws, chosen at run time.

use super::{
    Corotated, FixedCorotated, Hyperelastic, Invertible, Lame, Linear, MaterialError, NeoHookean, PlaneStress,
    RotationTangent, StVenantKirchhoff, StableNeoHookean, Tangent,
};
use crate::lanes::Lane;
use nalgebra::{Matrix2, SMatrix};
use pulp::{Arch, NullaryFnOnce};
use serde::{Deserialize, Serialize};

/// A solid whose law is data: bodies of several laws, laws named by a file. Every method asks once which law it is, for
/// groups of elements once per group.
///
/// As a type it is nonlinear, and refuses inversion as far as its type can tell: ask
/// [`requires_positive_j`](Hyperelastic::requires_positive_j). A body whose law is known at compile time, or chosen at the
/// door by `match`, saves even these questions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "model", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Solid {
    /// See [`Linear`].
    Linear(Linear),
    /// See [`StVenantKirchhoff`].
    StVenantKirchhoff(StVenantKirchhoff),
    /// See [`NeoHookean`].
    NeoHookean(NeoHookean),
    /// See [`Corotated`].
    Corotated(Corotated),
    /// See [`FixedCorotated`].
    FixedCorotated(FixedCorotated),
    /// See [`StableNeoHookean`].
    StableNeoHookean(StableNeoHookean),
    /// See [`Invertible`].
    InvertibleStVenantKirchhoff(Invertible<StVenantKirchhoff>),
    /// See [`Invertible`].
    InvertibleNeoHookean(Invertible<NeoHookean>),
}

/// Evaluates an expression with the law in a variable.
macro_rules! with_law {
    ($solid:expr, $law:ident => $body:expr) => {
        match $solid {
            Solid::Linear($law) => $body,
            Solid::StVenantKirchhoff($law) => $body,
            Solid::NeoHookean($law) => $body,
            Solid::Corotated($law) => $body,
            Solid::FixedCorotated($law) => $body,
            Solid::StableNeoHookean($law) => $body,
            Solid::InvertibleStVenantKirchhoff($law) => $body,
            Solid::InvertibleNeoHookean($law) => $body,
        }
    };
}

impl Solid {
    /// The names of the laws, as files spell them.
    pub const MODELS: [&'static str; 8] = [
        "linear",
        "st-venant-kirchhoff",
        "neo-hookean",
        "corotated",
        "fixed-corotated",
        "stable-neo-hookean",
        "invertible-st-venant-kirchhoff",
        "invertible-neo-hookean",
    ];

    /// A law by its name, one of [`MODELS`](Self::MODELS), with Young's modulus (Pa) and Poisson's ratio; everything else
    /// as the law's own constructor sets it.
    ///
    /// # Errors
    /// [`MaterialError::UnknownModel`]; [`MaterialError`] if a constant is out of the range of the law.
    pub fn from_young_poisson(model: &str, young: f64, poisson: f64) -> Result<Self, MaterialError> {
        Ok(match model {
            "linear" => Self::Linear(Linear::from_young_poisson(young, poisson)?),
            "st-venant-kirchhoff" => Self::StVenantKirchhoff(StVenantKirchhoff::from_young_poisson(young, poisson)?),
            "neo-hookean" => Self::NeoHookean(NeoHookean::from_young_poisson(young, poisson)?),
            "corotated" => Self::Corotated(Corotated::from_young_poisson(young, poisson)?),
            "fixed-corotated" => Self::FixedCorotated(FixedCorotated::from_young_poisson(young, poisson)?),
            "stable-neo-hookean" => Self::StableNeoHookean(StableNeoHookean::from_young_poisson(young, poisson)?),
            "invertible-st-venant-kirchhoff" => Self::InvertibleStVenantKirchhoff(Invertible::new(
                StVenantKirchhoff::from_young_poisson(young, poisson)?,
            )),
            "invertible-neo-hookean" => {
                Self::InvertibleNeoHookean(Invertible::new(NeoHookean::from_young_poisson(young, poisson)?))
            }
            _ => {
                let known = Self::MODELS.join(", ");
                return Err(MaterialError::UnknownModel { model: model.to_owned(), known });
            }
        })
    }

    /// The name of the law, one of [`MODELS`](Self::MODELS).
    pub fn model(&self) -> &'static str {
        match self {
            Self::Linear(_) => "linear",
            Self::StVenantKirchhoff(_) => "st-venant-kirchhoff",
            Self::NeoHookean(_) => "neo-hookean",
            Self::Corotated(_) => "corotated",
            Self::FixedCorotated(_) => "fixed-corotated",
            Self::StableNeoHookean(_) => "stable-neo-hookean",
            Self::InvertibleStVenantKirchhoff(_) => "invertible-st-venant-kirchhoff",
            Self::InvertibleNeoHookean(_) => "invertible-neo-hookean",
        }
    }

    /// Lamé's constants: what the law is at small strain.
    pub fn lame(&self) -> Lame {
        match self {
            Self::InvertibleStVenantKirchhoff(law) => law.solid().lame(),
            Self::InvertibleNeoHookean(law) => law.solid().lame(),
            Self::Linear(law) => law.lame(),
            Self::StVenantKirchhoff(law) => law.lame(),
            Self::NeoHookean(law) => law.lame(),
            Self::Corotated(law) => law.lame(),
            Self::FixedCorotated(law) => law.lame(),
            Self::StableNeoHookean(law) => law.lame(),
        }
    }

    /// The same solid with this tangent of the rotation, which only [`Corotated`] asks for.
    #[must_use]
    pub fn with_rotation(self, rotation: RotationTangent) -> Self {
        match self {
            Self::Corotated(law) => Self::Corotated(law.with_rotation(rotation)),
            other => other,
        }
    }
}

/// [`Hyperelastic`] of a type that holds one of all laws, in `$d` dimensions, each method handed on by
/// `$with!(self, law => ...)`. Not generic, so that the kernels of all laws are compiled here, once, and not again in every
/// crate that makes a body of them; a call pays the choice of its vector width.
macro_rules! compiled_here {
    ($type:ty, $d:literal, $with:ident) => {
        const _: () = {
            type Matrix = SMatrix<f64, $d, $d>;
            type Lanes = [[Lane; $d]; $d];

            struct Energy<'a>(&'a $type, &'a Lanes);

            impl NullaryFnOnce for Energy<'_> {
                type Output = Lane;
                #[inline(always)]
                fn call(self) -> Lane {
                    $with!(self.0, law => law.energy_lanes(self.1))
                }
            }

            struct Stress<'a>(&'a $type, &'a mut [Lanes]);

            impl NullaryFnOnce for Stress<'_> {
                type Output = ();
                #[inline(always)]
                fn call(self) {
                    $with!(self.0, law => law.stress_groups(self.1));
                }
            }

            struct Stiffness<'a> {
                law: &'a $type,
                f: &'a Lanes,
                gradients: &'a [[Lane; $d]; $d + 1],
                weight: &'a Lane,
                project: bool,
                upper: &'a mut [Lanes],
            }

            impl NullaryFnOnce for Stiffness<'_> {
                type Output = ();
                #[inline(always)]
                fn call(self) {
                    let Self { f, gradients, weight, project, upper, .. } = self;
                    $with!(self.law, law => law.element_stiffness_lanes(f, gradients, weight, project, upper));
                }
            }

            /// Out of line, as it is not generic.
            fn lanes(stiffness: Stiffness<'_>) {
                Arch::new().dispatch(stiffness);
            }

            fn one(
                law: &$type,
                f: &Matrix,
                gradients: &[[f64; $d]; $d + 1],
                weight: f64,
                upper: &mut [[[f64; $d]; $d]],
            ) {
        $with!(law, law => law.element_stiffness(f, gradients, weight, upper));
            }

            impl Hyperelastic<$d> for $type {
                fn requires_positive_j(&self) -> bool {
                    $with!(self, law => Hyperelastic::<$d>::requires_positive_j(law))
                }

                fn energy_density(&self, f: &Matrix) -> f64 {
                    $with!(self, law => law.energy_density(f))
                }

                fn first_piola_kirchhoff(&self, f: &Matrix) -> Matrix {
                    $with!(self, law => law.first_piola_kirchhoff(f))
                }

                fn stress_differential(&self, f: &Matrix, df: &Matrix) -> Matrix {
                    $with!(self, law => law.stress_differential(f, df))
                }

                fn tangent(&self, f: &Matrix) -> Tangent<$d> {
                    $with!(self, law => law.tangent(f))
                }

                fn projected_tangent(&self, f: &Matrix) -> Tangent<$d> {
                    $with!(self, law => law.projected_tangent(f))
                }

                /// For simplices alone, as is that of a group.
                fn element_stiffness<const N: usize>(
                    &self,
                    f: &Matrix,
                    gradients: &[[f64; $d]; N],
                    weight: f64,
                    upper: &mut [[[f64; $d]; $d]],
                ) {
                    const { assert!(N == $d + 1, "elements are simplices") };
                    let gradients = gradients.first_chunk().expect("N = D + 1, as asserted");
                    one(self, f, gradients, weight, upper);
                }

                fn energy_lanes(&self, f: &Lanes) -> Lane {
                    Arch::new().dispatch(Energy(self, f))
                }

                fn stress_lanes(&self, f: &Lanes) -> Lanes {
                    let mut stress = [*f];
                    self.stress_groups(&mut stress);
                    stress[0]
                }

                fn stress_groups(&self, groups: &mut [Lanes]) {
                    Arch::new().dispatch(Stress(self, groups));
                }

                fn element_stiffness_lanes<const N: usize>(
                    &self,
                    f: &Lanes,
                    gradients: &[[Lane; $d]; N],
                    weight: &Lane,
                    project: bool,
                    upper: &mut [Lanes],
                ) {
                    const { assert!(N == $d + 1, "elements are simplices") };
                    let gradients = gradients.first_chunk().expect("N = D + 1, as asserted");
                    lanes(Stiffness { law: self, f, gradients, weight, project, upper });
                }
            }
        };
    };
}

compiled_here!(Solid, 2, with_law);
compiled_here!(Solid, 3, with_law);

/// As `with_law`, with the plane-stress law of the law in the variable.
macro_rules! with_plane_law {
    ($plane:expr, $law:ident => $body:expr) => {
        with_law!($plane.solid, law => {
            let $law = &PlaneStress::new(law);
            $body
        })
    };
}

compiled_here!(PlaneStress<Solid>, 2, with_plane_law);

impl PlaneStress<Solid> {
    /// Thickness stretch `q` at the in-plane deformation gradient `f`; not positive, or NaN, where there is none.
    pub fn thickness_stretch(&self, f: &Matrix2<f64>) -> f64 {
        with_plane_law!(self, law => law.thickness_stretch(f))
    }
}
