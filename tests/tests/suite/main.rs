//! Validation across crates, in one program: what the layers have in common is compiled once.

mod cube_insertion;
mod degenerate_needle;
mod determinism;
mod fast_nonlinear_insertion;
mod irregular_mesh;
mod multilevel;
mod pays_for_what_it_uses;
mod published_tables;
mod tilted_needle;
mod withdrawal;
