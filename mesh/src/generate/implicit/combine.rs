//! Union, intersection and difference of shapes.
//!
//! The least or greatest of several distances: of the right sign everywhere, never steeper than the steepest of them, and
//! true on the side where the shapes do not hide each other. Elsewhere it is less than the true distance, in magnitude.

use super::{Implicit, ShapeError};

/// What is in any of some shapes.
pub struct Union {
    shapes: Vec<Box<dyn Implicit>>,
}

impl Union {
    /// The union of at least one shape.
    ///
    /// # Errors
    /// No shapes.
    pub fn new(shapes: Vec<Box<dyn Implicit>>) -> Result<Self, ShapeError> {
        if shapes.is_empty() { Err(ShapeError::Empty { name: "the union" }) } else { Ok(Self { shapes }) }
    }
}

impl Implicit for Union {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        self.shapes.iter().fold(f64::INFINITY, |d, shape| d.min(shape.distance(p)))
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds_within(0.0)
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        let mut all = self.shapes.iter().map(|shape| shape.bounds_within(level));
        let first = all.next()??;
        all.try_fold(first, |hull, bounds| bounds.map(|bounds| hull_of(hull, bounds)))
    }
}

/// What is in all of some shapes.
pub struct Intersection {
    shapes: Vec<Box<dyn Implicit>>,
}

impl Intersection {
    /// The intersection of at least one shape.
    ///
    /// # Errors
    /// No shapes.
    pub fn new(shapes: Vec<Box<dyn Implicit>>) -> Result<Self, ShapeError> {
        if shapes.is_empty() { Err(ShapeError::Empty { name: "the intersection" }) } else { Ok(Self { shapes }) }
    }
}

impl Implicit for Intersection {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        self.shapes.iter().fold(f64::NEG_INFINITY, |d, shape| d.max(shape.distance(p)))
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.bounds_within(0.0)
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.shapes.iter().filter_map(|shape| shape.bounds_within(level)).reduce(|[l, h], [low, high]| {
            let (low, high) = (pairwise(l, low, f64::max), pairwise(h, high, f64::min));
            // Boxes apart have nothing in common, and any box will do.
            [low, pairwise(low, high, f64::max)]
        })
    }
}

/// What is in one shape and not in another.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference<A, B> {
    from: A,
    without: B,
}

impl<A: Implicit, B: Implicit> Difference<A, B> {
    /// `from` without what `without` holds.
    pub fn new(from: A, without: B) -> Self {
        Self { from, without }
    }
}

impl<A: Implicit, B: Implicit> Implicit for Difference<A, B> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        self.from.distance(p).max(-self.without.distance(p))
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.from.bounds()
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.from.bounds_within(level)
    }
}

/// The smallest box around two.
pub(super) fn hull_of(a: [[f64; 3]; 2], b: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
    [pairwise(a[0], b[0], f64::min), pairwise(a[1], b[1], f64::max)]
}

fn pairwise(a: [f64; 3], b: [f64; 3], pick: fn(f64, f64) -> f64) -> [f64; 3] {
    std::array::from_fn(|i| pick(a[i], b[i]))
}
