//! Organs from files, as solids to be meshed: contours on slices, and scenes of shapes.
//!
//! ```no_run
//! use stylet_mesh::generate::contours::ContourSettings;
//!
//! let study = stylet_anatomy::read("data/synthetic.dcm".as_ref())?;
//! let study = study.select(&["urethra", "prostate", "rectum"])?;
//! let (set, repairs) = study.check(&ContourSettings::default())?;
//! repairs.iter().for_each(|repair| eprintln!("{repair}"));
//! println!("{} mL", set.organs()[1].volume() * 1e6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! | module | what it does |
//! |---|---|
//! | `study`, `error` | [`Study`]: drawings in order of precedence; reading by what the file is; what can be wrong |
//! | [`json`] | a plain form for programs and hands: its schema |
//! | [`plan`] | what is to be meshed and how, the work, what came of it; scenes of shapes that come with the program |
//! | [`rt`] | DICOM RT structure sets |
//! | [`shapes`] | scenes of shapes: solids in order of precedence, and what they are made of |
//! | [`synthetic`] | a study made by a seed: prostate, urethra, rectum, pubic bone |
//!
//! In files lengths are millimetres, in memory metres. Both writers keep nanometres: what was written and read once more is
//! the same to the bit.

mod error;
pub mod json;
mod length;
pub mod plan;
pub mod rt;
pub mod shapes;
mod study;
pub mod synthetic;

pub use error::{Problem, ReadError, StudyError, WriteError};
pub use study::{Study, read};
