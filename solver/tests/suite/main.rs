//! The solver's tests that need more than one module, in one program: linking each file by itself took longer than running it.

mod common;

#[cfg(feature = "direct")]
mod direct;
mod newton;
mod nonlinear_cg;
mod ordering;
mod partition;
mod projected_cg;
#[cfg(feature = "direct")]
mod stale_factor;
