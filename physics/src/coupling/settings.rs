//! How coupled steps are made, and what is told of them.

use super::{CouplingMethod, SearchReport, SearchSettings};
use crate::dynamics::{DynamicsSettings, Scheme, Spent};
use crate::rod::Tangent;

/// How coupled steps are made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledSettings {
    /// Of the tissue; steps are linearised once, and neither halved nor adapted here. Its tolerance is not used.
    pub dynamics: DynamicsSettings,
    /// How friction states are found, and how far linear systems are solved.
    pub search: SearchSettings,
    /// How the coupled system is solved.
    pub coupling: CouplingMethod,
    /// The matrix of the rods.
    pub tangent: Tangent,
    /// Whether the twist of naturally curved needles is taken at the end of the step with the other forces, rather than at its
    /// start as published. Where that leaves no definite matrix, the step is made as published.
    pub implicit_twist: bool,
    /// How rods move: their places are prescribed by what cannot be stretched, which the trapezoid rule answers by
    /// velocities that change sign with every step. Published as that of the tissue.
    pub needle_scheme: Scheme,
    /// How far a needle may slide past the tissue in one step, m, a part of the edges of the mesh; more is
    /// [`CouplingError::Overrun`](super::CouplingError::Overrun).
    pub reach: f64,
    /// Whether nodes are relieved of what forces along a needle do aside by the shapes of cells alone. Published as not.
    pub relieve_aside: bool,
    /// Acceleration of gravity that acts on the needles, m/s^2.
    pub gravity: [f64; 3],
}

impl CoupledSettings {
    /// Steps of length `dt` (s) in which a needle may slide by `reach` (m): the trapezoid rule without damping for the tissue,
    /// backward Euler for needles, the null-space form, Gauss-Newton's matrix, explicit twist, unsymmetric cells
    /// relieved, no gravity.
    #[must_use]
    pub fn new(dt: f64, reach: f64) -> Self {
        Self {
            dynamics: DynamicsSettings::new(dt),
            search: SearchSettings::default(),
            coupling: CouplingMethod::default(),
            tangent: Tangent::GaussNewton,
            implicit_twist: false,
            needle_scheme: Scheme::BackwardEuler,
            reach,
            relieve_aside: true,
            gravity: [0.0; 3],
        }
    }
}

/// Where the time of coupled steps goes, beside that of the tissue's own stages.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoupledTimes {
    /// Forces and matrices of the rods.
    pub needle: Spent,
    /// Setting the coupled system up: the exact block and the right sides.
    pub couple: Spent,
    /// Friction states and solutions.
    pub search: Spent,
}

/// What a coupled step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CoupledReport {
    /// The search for states.
    pub search: SearchReport,
    /// Residual of the last solve, N, and what it was compared with.
    pub residual: f64,
    /// What it was compared with.
    pub threshold: f64,
    /// Element stiffnesses that were evaluated.
    pub elements_updated: u64,
}
