//! Scenes of flexible needles that are pushed, turned and withdrawn through deforming tissue.
//!
//! ```text
//! TOML --keys--> Scene --geometry--> mesh, regions, surfaces --tissue, interaction--> body, forces by place
//!                   '--needle, motion, aim--> needles ----------- run: Insertion, step by step
//!                                                                  '-> record, frames, pictures, summary
//! ```
//!
//! | module | what it does |
//! |---|---|
//! | [`keys`], [`scene`] | what a scene file may say, and what it says |
//! | [`geometry`] | the mesh: a shape of `stylet-anatomy`, a file or a box; its regions by name, surfaces as distances |
//! | [`tissue`], [`interaction`] | materials and what is held; friction and cutting forces, skins and capsules |
//! | [`needle`], [`motion`], [`aim`] | what needles are made of, how their bases move, whether they can reach the tissue |
//! | [`markers`] | tracked points, and their errors against measured positions |
//! | [`builtin`] | scenes that come with the program, and opening scenes |
//!
//! Source: Chentanez, Alterovitz, Ritchie, Cho, Hauser, Goldberg, Shewchuk & O'Brien, *Interactive simulation of surgical needle
//! insertion and steering*, ACM Trans. Graph. 28(3) (2009), section 4.
#![warn(missing_docs)]

pub mod aim;
pub mod builtin;
mod columns;
mod frames;
pub mod geometry;
mod instants;
pub mod interaction;
pub mod keys;
pub mod markers;
pub mod motion;
pub mod needle;
mod picture;
mod plausible;
mod record;
mod run;
pub mod scene;
pub mod tissue;
mod two_level;

pub use builtin::{SCENES, open};
pub use scene::Scene;
