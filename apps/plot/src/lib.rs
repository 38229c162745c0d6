//! Pictures as SVG: charts, and deformed triangle meshes coloured by a field.
//!
//! - [`Chart`]: lines, points and steps on linear or logarithmic axes, legend beside the data.
//! - [`MeshPicture`]: a plane triangle mesh filled with colour bands of a field, true to scale with axes in mm, needle
//!   and other lines above it. [`MeshPanel`] sets several side by side with one colour scale.
//! - [`SolidPicture`]: a tetrahedral mesh cut open, or a surface in space, coloured by cell. [`SolidPanel`] sets several side
//!   by side in one box with one colour scale.
//! - [`HistogramPanel`]: several histograms; [`SideBySide`]: pictures of any sort in one file.
//!
//! The SVG is written directly, in fractions of a px and without a font or an image library; the viewer brings the
//! font. The same data give the same bytes. NaN, infinities and what a logarithmic axis cannot show are left out, and a
//! note below the picture counts them; a picture with nothing left is a [`PlotError`]. Files appear whole or not at all.
//!
//! ```
//! use stylet_plot::{Chart, Series, Style};
//!
//! let chart = Chart {
//!     title: "Work and precision".into(),
//!     x_label: "time (s)".into(),
//!     y_label: "relative error".into(),
//!     log_x: true,
//!     log_y: true,
//!     series: vec![Series {
//!         name: "projected CG".into(),
//!         points: vec![(0.01, 1e-2), (0.02, 1e-4), (0.04, 1e-8)],
//!         style: Style::LinePoints,
//!         ..Series::default()
//!     }],
//!     ..Chart::default()
//! };
//! assert!(chart.to_svg()?.starts_with("<svg"));
//! # Ok::<(), stylet_plot::PlotError>(())
//! ```
#![warn(missing_docs)]

mod axis;
mod chart;
mod colour;
mod colour_bar;
mod contour;
mod edges;
mod error;
mod file;
mod histogram;
mod legend;
mod mesh_picture;
mod panel;
mod path;
mod series;
mod side_by_side;
mod solid;
mod svg;
mod text;
mod ticks;

pub use chart::Chart;
pub use colour::{Colour, ColourMap, PALETTE};
pub use edges::outline_of;
pub use error::PlotError;
pub use histogram::{Bars, HistogramPanel};
pub use mesh_picture::{Marker, MeshPicture, Polyline};
pub use panel::MeshPanel;
pub use series::{Series, Style};
pub use side_by_side::{Picture, SideBySide};
pub use solid::{Cut, SolidPanel, SolidPicture, SpaceLine, SpaceMarks, Symbol};

#[cfg(test)]
mod properties;
