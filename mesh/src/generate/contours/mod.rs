//! Solids from contours on parallel slices, as a physician draws organs in an image.
//!
//! ```
//! use stylet_mesh::generate::{contours::{ContourSet, ContourSettings, Drawing, PlanarContour}, implicit::Implicit};
//!
//! // A square tube of 20 mm, drawn on four slices 5 mm apart.
//! let square = |z: f64| PlanarContour::closed(vec![[0.0, 0.0, z], [0.02, 0.0, z], [0.02, 0.02, z], [0.0, 0.02, z]]);
//! let contours = (0..4).map(|i| square(0.005 * f64::from(i))).collect();
//! let drawing = Drawing { name: "tube".into(), contours };
//! let (set, repairs) = ContourSet::new(&[drawing], &ContourSettings::default())?;
//! assert!(repairs.is_empty());
//! assert!((set.organs()[0].volume() - 0.02 * 0.02 * 0.02).abs() < 1e-15);
//! assert!((set.solids()[0].distance(&[0.01, 0.001, 0.008]) + 0.001).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The slices are planes `z = const`; whoever reads a file turns its axes so. Coordinates are metres.
//!
//! # What is inside
//! On one slice, the points inside an odd number of an organ's contours (even-odd): a contour within another is a hole, one
//! within the hole is an island, whichever way they wind. Contours side by side are branches. An organ's contours may touch
//! but not cross. Organs may overlap: they stand in order of precedence, as the solids of
//! [`Strata`](super::implicit::Strata) do.
//!
//! # Between the slices
//! Signed distances in the planes are interpolated along z by monotone cubics, see [`ContourSolid`], which also states how
//! a branch that disappears, and the whole organ beyond its last slices, is closed.
//!
//! # Bad drawings
//! [`ContourSet::new`] lists every fault that it refuses ([`Fault`]) and every repair that it made ([`Repair`]).

mod cull;
mod fault;
mod field;
mod inspect;
mod monotone;
mod nest;
mod organ;
mod polygon;
mod section;
mod set;
mod solid;
mod tidy;

pub use fault::{ContourError, Fault, Repair};
pub use organ::{Organ, Part, Slice};
pub use set::{ContourSet, ContourSettings, Drawing, PlanarContour};
pub use solid::ContourSolid;
