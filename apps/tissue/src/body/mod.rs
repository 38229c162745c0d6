//! Scenes of bodies: a mesh, materials by region, constraints and loads, at rest or in motion.
//!
//! ```text
//! TOML --keys--> Scene --geometry--> mesh, regions, groups --select--> nodes and facets of constraints and loads
//!                                                          `--setup--> Body, Subspace, load --> statics | dynamics
//! ```

pub mod builtin;
mod columns;
mod constraint;
mod frames;
mod geometry;
mod instants;
pub mod keys;
mod law;
mod load;
mod material;
mod picture;
mod run;
pub mod scene;
mod select;
mod setup;
mod shape;
mod words;

pub use builtin::{SCENES, open};
pub use scene::Scene;
