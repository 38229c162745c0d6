//! Why a picture could not be drawn or written.

use std::path::PathBuf;

/// Why a picture could not be drawn or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PlotError {
    /// Nothing is left to draw: no data, or only NaN, infinities, and numbers that a log axis cannot show.
    #[error("nothing to draw in {picture:?}: {points} data points, none of them finite and within the axes")]
    Empty {
        /// Title of the picture.
        picture: String,
        /// Number of points (of triangles, for a mesh) that were given.
        points: usize,
    },
    /// Numbers too large to scale: their difference overflows.
    #[error("data of {picture:?} from {min:e} to {max:e}: too wide for an axis")]
    Range {
        /// Title of the picture.
        picture: String,
        /// Smallest number.
        min: f64,
        /// Largest number.
        max: f64,
    },
    /// One value a vertex, or a cell, was expected.
    #[error("mesh picture {picture:?} has {points} points and {values} values")]
    Shape {
        /// Title of the picture.
        picture: String,
        /// Number of points, or of cells if these have the values.
        points: usize,
        /// Number of values.
        values: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("mesh picture {picture:?}: triangle {triangle} names point {point} of {points}")]
    Index {
        /// Title of the picture.
        picture: String,
        /// Position of the triangle.
        triangle: usize,
        /// The point it names.
        point: u32,
        /// Number of points.
        points: usize,
    },
    /// A bar chart without bars, or whose ends are not in order.
    #[error("histogram {label:?} has {bins} bins from {low:e} to {high:e}")]
    Bins {
        /// What is counted.
        label: String,
        /// Number of bins.
        bins: usize,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// The file could not be written; no partial file is left.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// The file that was asked for.
        path: PathBuf,
        /// What the system said.
        #[source]
        error: std::io::Error,
    },
}
