//! Coordinates of nodes: one node a line, 2 or 3 numbers.

use super::files::open;
use crate::exit::Failure;
use std::io::BufRead as _;
use std::path::Path;

/// Places of nodes, with as many coordinates as the lines have.
pub struct Coordinates {
    /// Numbers a line: 2 or 3.
    pub dimension: usize,
    points: Vec<f64>,
}

impl Coordinates {
    /// Reads a file; blank lines and those that begin with `#` or `%` are left out, commas count as space.
    ///
    /// # Errors
    /// Names the file and the line.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let mut this = Self { dimension: 0, points: Vec::new() };
        for (number, line) in (1..).zip(open(path)?.lines()) {
            let fail = |what: String| Failure::bad_input(format!("{}, line {number}: {what}", path.display()));
            let line = line.map_err(|error| fail(error.to_string()))?;
            let line = line.trim();
            if !line.is_empty() && !line.starts_with(['#', '%']) {
                this.push(line).map_err(fail)?;
            }
        }
        if this.points.is_empty() {
            return Err(Failure::bad_input(format!("{}: no coordinates, expected some", path.display())));
        }
        Ok(this)
    }

    fn push(&mut self, line: &str) -> Result<(), String> {
        let before = self.points.len();
        for word in line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()) {
            let number: Option<f64> = word.parse().ok().filter(|x: &f64| x.is_finite());
            self.points.push(number.ok_or_else(|| format!("found {word:.40}, expected a finite number"))?);
        }
        let found = self.points.len() - before;
        if self.dimension == 0 && (2..=3).contains(&found) {
            self.dimension = found;
        }
        let expected = if self.dimension == 0 { "2 or 3".to_owned() } else { self.dimension.to_string() };
        if found == self.dimension { Ok(()) } else { Err(format!("{found} numbers, expected {expected}")) }
    }

    /// Number of nodes.
    pub fn n_nodes(&self) -> usize {
        self.points.len() / self.dimension
    }

    /// The places, if they have `B` coordinates.
    pub fn points<const B: usize>(&self) -> Option<&[[f64; B]]> {
        (self.dimension == B).then(|| self.points.as_chunks().0)
    }
}
