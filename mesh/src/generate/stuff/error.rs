//! Why stuffing failed.

/// Why no mesh was made. Solids are named by their place in [`Strata`](crate::generate::implicit::Strata), from zero.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// A box without extent, or with a bound that is not finite.
    #[error("axis {axis} of the box runs from {lower:e} to {upper:e}: it needs finite lower < upper")]
    Box {
        /// Axis, from zero.
        axis: usize,
        /// Lower bound, m.
        lower: f64,
        /// Upper bound, m.
        upper: f64,
    },
    /// A size that no lattice can have.
    #[error("{what} is {value:e}: it must be a positive finite length")]
    Size {
        /// Which size.
        what: String,
        /// The size given, m.
        value: f64,
    },
    /// Settings of solids that do not match the solids.
    #[error("settings of {found} solids were given for {expected}: give one each, or none")]
    SolidSettings {
        /// Number of solids.
        expected: usize,
        /// Number of settings.
        found: usize,
    },
    /// More conforming borders than a vertex can name.
    #[error("{count} solids have conforming borders: the limit is {limit}")]
    TooManyBorders {
        /// Solids with a conforming border.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// A signed distance that is not a number.
    #[error("the distance of solid {solid} is not a number at {point:?}")]
    NotANumber {
        /// The solid.
        solid: usize,
        /// Where, m.
        point: [f64; 3],
    },
    /// A mesh larger than the limit; nothing of its size was allocated.
    #[error("about {estimate:.3e} tetrahedra would be made: the limit is {limit}")]
    TooManyTets {
        /// Estimated number of tetrahedra.
        estimate: f64,
        /// The limit of the settings.
        limit: usize,
    },
    /// A solid without a single cell.
    #[error(
        "solid {solid} has no cell at size {size:e}: it is empty, outside the box, hidden by the solids before it, or \
         thinner than the lattice"
    )]
    NoCells {
        /// The solid.
        solid: usize,
        /// The size of cells at borders, m.
        size: f64,
    },
    /// No region is to be kept.
    #[error("there is neither a solid nor a background to mesh")]
    Nothing,
    /// The caller's hook asked to stop.
    #[error("cancelled")]
    Cancelled,
}
