//! The solver's tests that need more than one module, in one program: linking each file by itself took longer than running it.

mod common;

mod constrained;
#[cfg(all(feature = "sprs", feature = "nalgebra", feature = "direct"))]
mod conversions;
#[cfg(feature = "direct")]
mod direct;
mod many_cg;
mod matrix_market;
mod minres;
mod model_systems;
mod newton;
mod nonlinear_cg;
mod nonlinear_methods;
mod nonlinear_outcomes;
mod null_space;
mod ordering;
mod partition;
mod preconditioners;
mod projected_cg;
#[cfg(feature = "direct")]
mod stale_factor;
