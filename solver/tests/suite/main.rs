//! The solver's tests that need more than one module, in one program: linking each file by itself took longer than running it.

mod common;

mod newton;
mod nonlinear_cg;
mod nonlinear_methods;
mod nonlinear_outcomes;
mod projected_cg;
