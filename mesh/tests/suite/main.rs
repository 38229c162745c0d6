//! The tests of the crate from outside, in one program: what is generic is compiled once, not once per file.

mod files_support;
mod support;

mod checks;
mod coarsening;
mod exact_counts;
mod files;
mod files_mutations;
mod files_refused;
mod files_round_trip;
mod files_samples;
mod locate;
mod properties;
mod remesh;
mod rules;
mod start_meshes;
mod sweep;
