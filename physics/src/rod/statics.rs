//! Equilibria of rods.

use super::{BandedFactor, HeldEnds, Rod, RodError, RodLoad, RodPotential};
use stylet_solver::nonlinear::{NewtonSettings, NewtonWorkspace, NonlinearError, NonlinearReport, newton_cg_with};
use stylet_solver::stop::{Criterion, Stop, StopRule};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector::norm2;

/// How an equilibrium is sought.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RodStaticSettings {
    /// Residual as a share of loads and reactions; [`Rod::force_round_off`] at the start is always allowed besides.
    pub tolerance: f64,
    /// Steps of Newton's method.
    pub max_iterations: usize,
}

impl Default for RodStaticSettings {
    /// 1e-8, 1000 steps.
    fn default() -> Self {
        Self { tolerance: 1e-8, max_iterations: 1000 }
    }
}

/// Why a rod has not come to rest; positions and angles are then the last ones.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RodStaticError {
    /// Rod or load are refused, or the angles do not settle.
    #[error(transparent)]
    Rod(#[from] RodError),
    /// The minimisation is refused.
    #[error(transparent)]
    Nonlinear(#[from] NonlinearError),
    /// Newton's method ended above the tolerance.
    #[error("no equilibrium after {iterations} steps ({stop:?}): residual {residual:e} N, threshold {threshold:e} N")]
    NotConverged {
        /// Why it ended.
        stop: Stop,
        /// Steps made.
        iterations: usize,
        /// Residual, N.
        residual: f64,
        /// What it should have come down to, N.
        threshold: f64,
    },
}

/// Brings a rod under load to rest: `x` and the angles go to a minimum of the energy, the nodes moving as `subspace` allows.
///
/// Newton's method with the exact tangent, twist in it, factored as a band; see [`RodPotential`] for what is minimised. A stiff
/// rod far from its equilibrium is best brought there in several steps of load.
///
/// # Errors
/// [`RodStaticError`].
pub fn solve_rod(
    rod: &mut Rod,
    base_director: [f64; 3],
    load: &RodLoad,
    ends: &HeldEnds,
    subspace: &Subspace<3>,
    x: &mut [f64],
    settings: &RodStaticSettings,
) -> Result<NonlinearReport, RodStaticError> {
    super::error::shape("positions", x.len(), 3 * rod.n_nodes())?;
    let couple = norm2(&load.couple) / rod.rest_lengths()[rod.n_edges() - 1];
    let external = norm2(&load.forces).hypot(couple);
    let round_floor = rod.force_round_off(x);
    let stop = StopRule { tolerance: settings.tolerance, criterion: Criterion::Reaction, round_floor };
    let newton = NewtonSettings { max_iterations: settings.max_iterations, ..NewtonSettings::new(stop) };
    let newton = NewtonSettings { max_inner_iterations: 100 * settings.max_iterations, ..newton };
    let mut potential = RodPotential::new(rod, base_director, load, ends)?;
    let mut workspace = NewtonWorkspace::new();
    let report =
        newton_cg_with(&mut potential, &mut BandedFactor::new(), subspace, external, x, &newton, &mut workspace)?;
    rod.settle_held(x, &base_director, ends)?;
    if report.stop == Stop::Converged {
        return Ok(report);
    }
    Err(RodStaticError::NotConverged {
        stop: report.stop,
        iterations: report.iterations,
        residual: report.residual_norm,
        threshold: report.threshold,
    })
}
