//! Flexible needles in tissue: the tables of Chentanez et al. (2009), steering, and error against time.

pub(crate) mod lazy;
mod page;
pub(crate) mod precision;
pub(crate) mod search;
pub(crate) mod setup;
pub(crate) mod steering;
pub(crate) mod threads;
