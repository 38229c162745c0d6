//! Why a mesh could not be improved.

/// What is wrong with a mesh or a setting. The mesh has then not been touched.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImproveError {
    /// A setting out of its range.
    #[error("{name} is {value}: expected {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// As found.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
    /// A box without extent, or not finite.
    #[error("axis {axis} of the box runs from {low:e} to {high:e}: it needs finite low < high")]
    Box {
        /// Axis, from zero.
        axis: usize,
        /// Lower end, m.
        low: f64,
        /// Upper end, m.
        high: f64,
    },
    /// Not one flag for each solid.
    #[error("{found} flags of conforming borders for {expected} solids: give one each, or none")]
    Conforming {
        /// Number of solids.
        expected: usize,
        /// Number of flags.
        found: usize,
    },
    /// Not one region for each cell.
    #[error("{found} regions for {expected} cells")]
    Regions {
        /// Number of cells.
        expected: usize,
        /// Number of regions.
        found: usize,
    },
    /// A region that is neither a solid nor the background.
    #[error("cell {cell} has region {found}: expected at most {most}")]
    Region {
        /// The cell.
        cell: usize,
        /// Its region.
        found: u32,
        /// The number of the background.
        most: usize,
    },
    /// More cells than can be numbered.
    #[error("{found} cells are too many: the limit is {limit}")]
    TooManyCells {
        /// Number of cells.
        found: usize,
        /// The limit.
        limit: usize,
    },
    /// A cell that names a point that does not exist.
    #[error("cell {cell} names point {point}, but there are {n_points}")]
    Index {
        /// The cell.
        cell: usize,
        /// The point that it names.
        point: u32,
        /// Number of points.
        n_points: usize,
    },
    /// A cell that is flat, inverted, or has a corner that is not finite.
    #[error("cell {cell} has volume {volume:e}: expected a positive one")]
    Volume {
        /// The cell.
        cell: usize,
        /// Its signed volume, m³.
        volume: f64,
    },
    /// Three cells or more that share a facet, or two on one side of it.
    #[error("cells {first} and {second} meet a facet from the same side, or a third one does")]
    Facet {
        /// A cell.
        first: usize,
        /// Another.
        second: usize,
    },
}
