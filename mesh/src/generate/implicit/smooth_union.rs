//! A union with its dent filled.

use super::{Implicit, ShapeError, combine::hull_of, error};

/// What is in one of two shapes, with the dent between them rounded off.
///
/// The distance is `min(a, b) - (max(r - |a - b|, 0))² / (4 r)`: continuous in its slope, which is between those of the
/// two, so never steeper. Where the distances of the two differ by more than `r`, it is their union.
///
/// Source: Quilez, *Smooth minimum* (2013), the quadratic polynomial.
#[derive(Clone, Debug, PartialEq)]
pub struct SmoothUnion<A, B> {
    a: A,
    b: B,
    reach: f64,
}

impl<A: Implicit, B: Implicit> SmoothUnion<A, B> {
    /// The union of `a` and `b`, changed where their distances differ by less than `reach`, m: there at most `reach / 4`
    /// is added.
    ///
    /// # Errors
    /// A reach that is not positive and within 1e12 m.
    pub fn new(a: A, b: B, reach: f64) -> Result<Self, ShapeError> {
        Ok(Self { a, b, reach: error::length("the reach", reach)? })
    }
}

impl<A: Implicit, B: Implicit> Implicit for SmoothUnion<A, B> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let (a, b) = (self.a.distance(p), self.b.distance(p));
        let overlap = (self.reach - (a - b).abs()).max(0.0);
        a.min(b) - overlap * overlap / (4.0 * self.reach)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds_within(0.0)
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        let level = level + 0.25 * self.reach;
        Some(hull_of(self.a.bounds_within(level)?, self.b.bounds_within(level)?))
    }
}
