//! Tests of rods, of friction states and of needles in tissue: a program of their own, so that both compile side by side.

#[path = "../suite/support/mod.rs"]
mod support;

mod insertion;
mod prebent;
mod rod_angles;
mod rod_buckling;
mod rod_derivatives;
mod rod_dynamics;
mod rod_statics;
mod steering;
mod stick_slip;
