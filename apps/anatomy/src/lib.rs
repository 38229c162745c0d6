//! Solids of organs from files.
//!
//! | module | what it does |
//! |---|---|
//! | [`shapes`] | scenes of shapes: solids in order of precedence, and what they are made of |
#![warn(missing_docs)]

pub mod shapes;
