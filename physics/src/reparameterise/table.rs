//! Values at increasing abscissae: what both interpolations check and look up.

use super::error::ReparameteriseError;
use std::ops::Range;

/// Several components at each of at least one abscissa.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Table {
    pub x: Vec<f64>,
    /// Point `i` owns the entries `i * components..(i + 1) * components`.
    pub y: Vec<f64>,
    pub components: usize,
}

/// Where an abscissa lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// At a point of the table, or beyond the end of which this is the last point.
    Point(usize),
    /// Between this point and the next one.
    After(usize),
}

impl Table {
    pub fn new(x: &[f64], y: &[f64]) -> Result<Self, ReparameteriseError> {
        check_increasing("abscissae", x)?;
        let components = y.len() / x.len();
        check_len("ordinates", y, components * x.len())?;
        check_finite("ordinates", y)?;
        Ok(Self { x: x.to_vec(), y: y.to_vec(), components })
    }

    pub fn point(&self, i: usize) -> Range<usize> {
        i * self.components..(i + 1) * self.components
    }

    pub fn place(&self, x: f64) -> Place {
        place(&self.x, x)
    }
}

/// Where `x` lies among increasing numbers.
pub(super) fn place(table: &[f64], x: f64) -> Place {
    let above = table.partition_point(|&t| t < x);
    match table.get(above) {
        None => Place::Point(table.len() - 1),
        Some(&t) if above == 0 || t == x => Place::Point(above),
        Some(_) => Place::After(above - 1),
    }
}

/// At least one number, each finite and above the one before.
pub(super) fn check_increasing(what: &'static str, x: &[f64]) -> Result<(), ReparameteriseError> {
    if x.is_empty() {
        return Err(ReparameteriseError::TooFew { what, count: 0, least: 1 });
    }
    check_finite(what, x)?;
    match x.windows(2).position(|pair| pair[0] >= pair[1]) {
        Some(i) => Err(ReparameteriseError::Order { what, index: i + 1, previous: x[i], value: x[i + 1] }),
        None => Ok(()),
    }
}

pub(super) fn check_finite(what: &'static str, v: &[f64]) -> Result<(), ReparameteriseError> {
    match v.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(ReparameteriseError::NotFinite { what, index }),
        None => Ok(()),
    }
}

pub(super) fn check_len(what: &'static str, v: &[f64], expected: usize) -> Result<(), ReparameteriseError> {
    if v.len() == expected { Ok(()) } else { Err(ReparameteriseError::Shape { what, len: v.len(), expected }) }
}
