//! Parameters of shapes, checked at the door.

use crate::geometry::norm;

/// Lengths that a shape may have, m: squares and quotients of them neither overflow nor vanish.
const LENGTHS: [f64; 2] = [1e-12, 1e12];

/// Why a shape was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length, such as a radius, that is no positive number of reasonable size.
    #[error("{name} is {value:e} m: expected from {least:e} to {most:e} m", least = LENGTHS[0], most = LENGTHS[1])]
    Length {
        /// What the length is.
        name: &'static str,
        /// As found, m.
        value: f64,
    },
    /// A coordinate that is not finite, or is out of reach.
    #[error("coordinate {axis} of {name} is {value:e} m: expected a number of magnitude at most {most:e} m", most = LENGTHS[1])]
    Coordinate {
        /// What the point is.
        name: &'static str,
        /// The axis, from zero.
        axis: usize,
        /// As found, m.
        value: f64,
    },
    /// A direction without a length, or not finite.
    #[error("{name} is {value:?}: expected a finite vector that is not zero")]
    Direction {
        /// What the direction is.
        name: &'static str,
        /// As found.
        value: [f64; 3],
    },
    /// An angle out of its range.
    #[error("{name} is {value:e} rad: expected {expected}")]
    Angle {
        /// What the angle is.
        name: &'static str,
        /// As found, rad.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
    /// Two lengths that do not fit together.
    #[error("{name} is {value:e} m: expected {expected} {other:e} m")]
    Relation {
        /// What the length is.
        name: &'static str,
        /// As found, m.
        value: f64,
        /// How it must stand to the other, in words.
        expected: &'static str,
        /// The other length, m.
        other: f64,
    },
    /// A combination of nothing.
    #[error("{name} of no shapes: expected at least one")]
    Empty {
        /// What the combination is.
        name: &'static str,
    },
}

/// A length that is positive and of reasonable size.
pub(super) fn length(name: &'static str, value: f64) -> Result<f64, ShapeError> {
    if (LENGTHS[0]..=LENGTHS[1]).contains(&value) { Ok(value) } else { Err(ShapeError::Length { name, value }) }
}

/// A point within reach.
pub(super) fn point(name: &'static str, value: [f64; 3]) -> Result<[f64; 3], ShapeError> {
    match value.iter().position(|x| x.is_nan() || x.abs() > LENGTHS[1]) {
        Some(axis) => Err(ShapeError::Coordinate { name, axis, value: value[axis] }),
        None => Ok(value),
    }
}

/// A direction, brought to unit length.
pub(super) fn direction(name: &'static str, value: [f64; 3]) -> Result<[f64; 3], ShapeError> {
    // Scaled first: the square of a very long or very short vector is not a number of use.
    let scale = value.iter().fold(0.0_f64, |s, x| s.max(x.abs()));
    if value.iter().any(|x| !x.is_finite()) || scale == 0.0 {
        return Err(ShapeError::Direction { name, value });
    }
    let scaled = value.map(|x| x / scale);
    let length = norm(&scaled);
    Ok(scaled.map(|x| x / length))
}
