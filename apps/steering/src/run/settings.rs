//! What a scene asks of the coupled step.

use crate::builtin::Setup;
use crate::scene::{Coupling, SchemeKind, SearchKind, TwistKind};
use crate::tissue::common_damping;
use stylet_physics::coupling::{CoupledSettings, CouplingMethod, SearchMethod, SearchSettings};
use stylet_physics::dynamics::{Damping, DynamicsSettings, Scheme};

/// Tolerances, schemes and methods of a step.
pub(super) fn settings(opened: &Setup) -> CoupledSettings {
    let (time, solver) = (&opened.scene.time, &opened.scene.solver);
    let scheme = match time.scheme {
        SchemeKind::Newmark => Scheme::Newmark { beta: time.beta, gamma: time.gamma },
        SchemeKind::Trapezoid => Scheme::TRAPEZOID,
        SchemeKind::BackwardEuler => Scheme::BackwardEuler,
    };
    let whole = |n: i64| usize::try_from(n).unwrap_or(usize::MAX);
    let search = match solver.search {
        SearchKind::Trials => SearchSettings::default(),
        SearchKind::Published => SearchSettings::published(),
        SearchKind::Condensed => SearchSettings { method: SearchMethod::Condensed, ..SearchSettings::default() },
    };
    CoupledSettings {
        dynamics: DynamicsSettings {
            scheme,
            max_inner_iterations: whole(solver.max_iterations),
            damping: Damping { mass: 0.0, stiffness: common_damping(&opened.tissues, &opened.scene).unwrap_or(0.0) },
            ..DynamicsSettings::new(time.dt)
        },
        search: SearchSettings {
            check_tolerance: solver.check_tolerance.max(solver.tolerance),
            solve_tolerance: solver.tolerance,
            max_trials: whole(solver.max_trials),
            ..search
        },
        coupling: match solver.coupling {
            Coupling::NullSpace => CouplingMethod::NullSpace,
            Coupling::KktCg => CouplingMethod::KktCg,
            Coupling::KktMinres => CouplingMethod::KktMinres,
            Coupling::Constraint => CouplingMethod::ConstraintPreconditioned,
        },
        implicit_twist: time.twist == TwistKind::Implicit,
        ..CoupledSettings::new(time.dt, time.reach.unwrap_or_else(|| 0.2 * opened.geometry.mean_edge()))
    }
}
