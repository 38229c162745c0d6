//! Which faces are seen at all: a depth buffer of samples.

/// Samples in a rectangle of the picture; each keeps the nearest face.
pub(super) struct DepthBuffer {
    width: usize,
    height: usize,
    /// Samples per px.
    density: f64,
    nearest: Vec<(f32, u32)>,
}

const NOBODY: u32 = u32::MAX;

impl DepthBuffer {
    /// A buffer for a picture of so many px.
    pub fn new(size: [f64; 2], density: f64) -> Self {
        let [width, height] = size.map(|px| ((px * density).ceil() as usize).max(1));
        Self { width, height, density, nearest: vec![(f32::NEG_INFINITY, NOBODY); width * height] }
    }

    /// Enters a triangle, given in px with depths that grow towards the viewer; returns how many samples were looked at.
    pub fn add(&mut self, face: u32, corners: &[[f64; 3]; 3]) -> usize {
        let [a, b, c] = corners.map(|[x, y, depth]| [x * self.density, y * self.density, depth]);
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]);
        if area == 0.0 || !area.is_finite() {
            return 0;
        }
        let range = |axis: usize, end: usize| {
            let (low, high) = [a, b, c].iter().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[axis]), h.max(p[axis])));
            // Samples lie in the middle of their squares. Casts saturate.
            (low - 0.5).ceil().max(0.0) as usize..((high - 0.5).floor() + 1.0).clamp(0.0, end as f64) as usize
        };
        let columns = range(0, self.width);
        let rows = range(1, self.height);
        for row in rows.clone() {
            for column in columns.clone() {
                let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
                let edge = |p: [f64; 3], q: [f64; 3]| ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / area;
                let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
                if u >= 0.0 && v >= 0.0 && w >= 0.0 {
                    let depth = (u * a[2] + v * b[2] + w * c[2]) as f32;
                    let sample = &mut self.nearest[row * self.width + column];
                    if depth > sample.0 {
                        *sample = (depth, face);
                    }
                }
            }
        }
        rows.len() * columns.len()
    }

    /// How many samples have a face, and at how many of these another buffer has another one.
    #[cfg(test)]
    pub fn compare(&self, other: &Self) -> (usize, usize) {
        let pairs = || self.nearest.iter().zip(&other.nearest).filter(|(a, _)| a.1 != NOBODY);
        (pairs().count(), pairs().filter(|(a, b)| a.1 != b.1).count())
    }

    /// Which of `n` faces are nearest at some sample.
    pub fn seen(&self, n: usize) -> Vec<bool> {
        let mut seen = vec![false; n];
        for &(_, face) in self.nearest.iter().filter(|sample| sample.1 != NOBODY) {
            seen[face as usize] = true;
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearer_face_is_seen() {
        let mut buffer = DepthBuffer::new([10.0, 10.0], 2.0);
        let at = |depth: f64, size: f64| [[0.0, 0.0, depth], [size, 0.0, depth], [0.0, size, depth]];
        buffer.add(0, &at(1.0, 9.0));
        buffer.add(1, &at(2.0, 10.0));
        buffer.add(2, &at(3.0, 4.0));
        buffer.add(3, &at(4.0, 0.1));
        buffer.add(4, &[[1e300, 0.0, 0.0], [0.0, f64::NAN, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(buffer.seen(5), [false, true, true, false, false]);
    }
}
