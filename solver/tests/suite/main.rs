//! The solver's tests that need more than one module, in one program: linking each file by itself took longer than running it.

mod common;

mod constrained;
mod many_cg;
mod minres;
mod model_systems;
mod newton;
mod nonlinear_cg;
mod null_space;
mod preconditioners;
mod projected_cg;
