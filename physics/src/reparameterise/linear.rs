//! Piecewise linear interpolation.

use super::error::ReparameteriseError;
use super::table::{Place, Table};

/// A piecewise linear function with several components, constant beyond its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    table: Table,
}

impl Linear {
    /// Through the points `(x[i], y[i c..(i + 1) c])`, with `c` components, the ratio of the lengths.
    ///
    /// # Errors
    /// If there is no point, a number is not finite, the abscissae do not increase strictly, or the lengths do not fit.
    pub fn new(x: &[f64], y: &[f64]) -> Result<Self, ReparameteriseError> {
        Ok(Self { table: Table::new(x, y)? })
    }

    /// Overwrites `out`, one number for each component, by the value at `x`; at a point of the table that is its very ordinate.
    ///
    /// # Panics
    /// If `out` does not have one place for each component.
    pub fn evaluate(&self, x: f64, out: &mut [f64]) {
        let table = &self.table;
        match table.place(x) {
            Place::Point(i) => out.copy_from_slice(&table.y[table.point(i)]),
            Place::After(i) => {
                assert_eq!(out.len(), table.components, "one place for each component");
                let u = (x - table.x[i]) / (table.x[i + 1] - table.x[i]);
                let ends = table.y[table.point(i)].iter().zip(&table.y[table.point(i + 1)]);
                for (out, (a, b)) in out.iter_mut().zip(ends) {
                    *out = (1.0 - u) * a + u * b;
                }
            }
        }
    }
}
