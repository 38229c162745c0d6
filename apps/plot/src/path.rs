//! Path data in few bytes: whole numbers in a scaled group, relative moves, no point where nothing bends.

use std::fmt::Write as _;

/// Builds the `d` attribute of a path from px coordinates, rounded to `1 / units_per_px`.
pub(crate) struct PathData {
    units_per_px: f64,
    data: String,
}

impl PathData {
    pub fn new(units_per_px: f64) -> Self {
        Self { units_per_px, data: String::new() }
    }

    /// The attribute of the group that these paths have to stand in.
    pub fn group_attribute(units_per_px: f64) -> String {
        format!("transform=\"scale({})\"", 1.0 / units_per_px)
    }

    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    pub fn data(&self) -> &str {
        &self.data
    }

    /// Adds an open polyline; fewer than two distinct points add nothing.
    pub fn polyline(&mut self, points: impl IntoIterator<Item = [f64; 2]>) {
        let corners = self.corners(points);
        if corners.len() >= 2 {
            self.push(&corners);
        }
    }

    /// Adds a closed ring; one that has collapsed to a line adds nothing.
    pub fn ring(&mut self, points: impl IntoIterator<Item = [f64; 2]>) {
        let mut corners = self.corners(points);
        while corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        if corners.len() >= 3 {
            self.push(&corners);
            self.data.push('z');
        }
    }

    /// Rounded points, without those on the straight line between their neighbours.
    fn corners(&self, points: impl IntoIterator<Item = [f64; 2]>) -> Vec<[i64; 2]> {
        let mut corners: Vec<[i64; 2]> = Vec::new();
        for point in points {
            // The cast saturates, and pictures are far smaller than its limits.
            let p = point.map(|x| (x * self.units_per_px).round() as i64);
            if corners.last() == Some(&p) {
                continue;
            }
            if let [.., a, b] = corners[..]
                && continues_straight(a, b, p)
            {
                corners.pop();
            }
            corners.push(p);
        }
        corners
    }

    fn push(&mut self, corners: &[[i64; 2]]) {
        let [x, y] = corners[0];
        write!(self.data, "M{x} {y}l").expect("a String takes everything");
        for (i, pair) in corners.windows(2).enumerate() {
            let [dx, dy] = [pair[1][0].wrapping_sub(pair[0][0]), pair[1][1].wrapping_sub(pair[0][1])];
            let gap = |negative: bool| if negative { "" } else { " " };
            let before = if i == 0 { "" } else { gap(dx < 0) };
            write!(self.data, "{before}{dx}{}{dy}", gap(dy < 0)).expect("a String takes everything");
        }
    }
}

/// Whether `b` lies on the way from `a` to `p`.
fn continues_straight(a: [i64; 2], b: [i64; 2], p: [i64; 2]) -> bool {
    let difference = |p: [i64; 2], q: [i64; 2]| [p[0] as i128 - q[0] as i128, p[1] as i128 - q[1] as i128];
    let ([ux, uy], [vx, vy]) = (difference(b, a), difference(p, b));
    ux * vy == uy * vx && ux * vx + uy * vy > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn straight_runs_collapse_and_turns_stay() {
        let mut path = PathData::new(10.0);
        path.polyline([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, -1.0], [2.0, -1.001], [2.0, 0.5]]);
        assert_eq!(path.data(), "M0 0l20 0 0-10 0 15");
    }

    #[test]
    fn rings_close_and_collapsed_ones_vanish() {
        let mut path = PathData::new(1.0);
        path.ring([[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 0.0]]);
        path.ring([[0.0, 0.0], [0.1, 0.0], [0.1, 0.1]]);
        path.ring([[5.0, 0.0], [9.0, 0.0]]);
        assert_eq!(path.data(), "M0 0l3 0 0 3z");
        assert!(PathData::new(1.0).is_empty());
    }
}
