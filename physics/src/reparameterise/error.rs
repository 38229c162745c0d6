//! What cannot be interpolated.

/// Why a needle cannot be reparameterised, or a table not be interpolated.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReparameteriseError {
    /// A list has the wrong length.
    #[error("{what}: {len} numbers, expected {expected}")]
    Shape {
        /// Which list.
        what: &'static str,
        /// Its length.
        len: usize,
        /// The length it should have.
        expected: usize,
    },
    /// There are too few nodes or points.
    #[error("{what}: {count}, expected at least {least}")]
    TooFew {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there must be.
        least: usize,
    },
    /// NaN or infinity.
    #[error("{what}: number {index} is not finite")]
    NotFinite {
        /// Which list.
        what: &'static str,
        /// Its first bad number, counted from 0.
        index: usize,
    },
    /// Distances do not increase: two nodes or points coincide, or are in the wrong order.
    #[error("{what}: {value} follows {previous} at place {index}, expected an increase")]
    Order {
        /// Which distances.
        what: &'static str,
        /// The place of the later one, counted from 0.
        index: usize,
        /// The earlier one.
        previous: f64,
        /// The later one.
        value: f64,
    },
    /// A length is not positive.
    #[error("{what} {index} is {value} m, expected a positive length")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its place, counted from 0.
        index: usize,
        /// Its value, m.
        value: f64,
    },
    /// More nodes are in the tissue than may be.
    #[error("{coupled} of {nodes} nodes are in the tissue, expected at most {most}")]
    Coupled {
        /// Nodes in the tissue.
        coupled: usize,
        /// Nodes of the needle.
        nodes: usize,
        /// How many may be in the tissue.
        most: usize,
    },
    /// The lengths between which edges are kept are not two positive numbers in order.
    #[error("edge lengths between {shortest} and {longest} m, expected two positive numbers, the smaller one first")]
    Limits {
        /// The smaller one, m.
        shortest: f64,
        /// The larger one, m.
        longest: f64,
    },
    /// Splitting would make more nodes than any needle has.
    #[error("an edge of {length} m would be split into about {parts} parts, expected at most {most}")]
    TooLong {
        /// Length of the edge, m.
        length: f64,
        /// The number of parts.
        parts: f64,
        /// How many there may be.
        most: f64,
    },
}
