//! Counts in bins of equal width.

use serde::Serialize;

/// How many numbers fall into each of some bins of equal width, and beyond them.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Histogram {
    /// Lower end of the first bin.
    pub low: f64,
    /// Upper end of the last bin.
    pub high: f64,
    /// Numbers in each bin: from its lower end on, up to, but without, its upper end; the last bin has both.
    pub counts: Vec<usize>,
    /// Numbers below `low`.
    pub below: usize,
    /// Numbers above `high`.
    pub above: usize,
}

impl Histogram {
    /// Empty bins; at least one.
    pub fn new(low: f64, high: f64, bins: usize) -> Self {
        Self { low, high, counts: vec![0; bins.max(1)], below: 0, above: 0 }
    }

    /// Counts a number. NaN is counted nowhere.
    pub fn add(&mut self, x: f64) {
        if x < self.low {
            self.below += 1;
        } else if x > self.high {
            self.above += 1;
        } else if x >= self.low {
            let bin = (x - self.low) / (self.high - self.low) * self.counts.len() as f64;
            let bin = (bin as usize).min(self.counts.len() - 1);
            self.counts[bin] += 1;
        }
    }

    /// The ends of a bin.
    pub fn bin(&self, k: usize) -> (f64, f64) {
        let n = self.counts.len() as f64;
        // Multiplied first: round widths have round ends.
        let end = |k: usize| self.low + (self.high - self.low) * k as f64 / n;
        (end(k), end(k + 1))
    }

    /// The greatest count of a bin.
    pub fn tallest(&self) -> usize {
        self.counts.iter().copied().max().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_counted_once() {
        let mut histogram = Histogram::new(0.0, 10.0, 5);
        for x in [-1e-300, 0.0, 1.999, 2.0, 9.0, 10.0, 10.1, f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
            histogram.add(x);
        }
        assert_eq!((histogram.below, &histogram.counts[..], histogram.above), (2, &[2, 1, 0, 0, 2][..], 2));
        assert_eq!((histogram.bin(1), histogram.tallest()), ((2.0, 4.0), 2));
    }
}
