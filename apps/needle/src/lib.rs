//! Quasi-static needle insertion into an adaptive elastic slab or cube, after chapter 6 of Nienhuys, *Cutting in deformable
//! objects* (PhD thesis, Utrecht, 2003).
//!
//! A scene ([`scene::Scene`]) comes from TOML ([`builtin::open`]); [`simulation::start`] brings it to life;
//! [`Simulation::step`](stylet_tissue::Simulation::step) goes on by one cycle of the interaction loop ([`insertion`]).

mod array;
pub mod builtin;
pub mod check;
pub mod equilibrium;
pub mod facet;
mod frames;
pub mod history;
pub mod insertion;
pub mod keys;
pub mod motion;
pub mod needle;
pub mod picture;
pub mod relocate;
pub mod scene;
pub mod shaft;
pub mod simulation;
pub mod slab;
mod solid_picture;
pub mod state;
pub mod static_load;
pub mod surface;
pub mod tip;

pub use error::NeedleError;
pub use stylet_tissue::stages;

mod error {
    pub use stylet_tissue::RunError as NeedleError;
}
