//! Whether a team is worth its while.

/// Solves of either way that are remembered; the middle one of three is not moved by one that another program has held up.
const LATELY: usize = 3;
/// One solve of so many goes the other way, to see whether that has become the faster one.
const PROBE: u32 = 48;

/// Compares what solves take that are shared by a team with what they take on the calling thread alone, and says how to go on.
///
/// How much sharing gains depends on how far apart the cores are, which a virtual machine may change at any time: a pass of 15 µs
/// over vectors that are in the cache of the other core is won on two cores with a common cache, and lost on two without. The
/// bits of a solve are the same either way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pace {
    /// Seconds by product of the last solves: alone, shared.
    took: [[f64; LATELY]; 2],
    noted: [usize; 2],
    solves: u32,
}

impl Pace {
    /// Whether the next solve is to be shared.
    pub fn is_shared(&mut self) -> bool {
        let [alone, shared] = self.noted.map(|noted| noted.min(LATELY));
        if alone.min(shared) < LATELY {
            return shared <= alone;
        }
        self.solves = (self.solves + 1) % PROBE;
        (self.middle(1) <= self.middle(0)) != (self.solves == 0)
    }

    /// Takes down what a solve took, by product with the matrix, s.
    pub fn note(&mut self, is_shared: bool, seconds: f64) {
        let way = usize::from(is_shared);
        self.took[way][self.noted[way] % LATELY] = seconds;
        self.noted[way] += 1;
    }

    fn middle(&self, way: usize) -> f64 {
        let mut took = self.took[way];
        took.sort_unstable_by(f64::total_cmp);
        took[LATELY / 2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares of `n` solves that were shared where the two ways take these times.
    fn shared(pace: &mut Pace, n: usize, took: [f64; 2]) -> f64 {
        let mut count = 0;
        for _ in 0..n {
            let is_shared = pace.is_shared();
            count += u32::from(is_shared);
            pace.note(is_shared, took[usize::from(is_shared)]);
        }
        f64::from(count) / n as f64
    }

    #[test]
    fn the_faster_way_is_found_and_followed() {
        let mut pace = Pace::default();
        assert!(pace.is_shared(), "a team is asked first");
        assert!(shared(&mut pace, 300, [2.0, 1.0]) > 0.95);
        // The cores have moved apart: as soon as the middle one of three says so.
        assert!(shared(&mut pace, 300, [2.0, 3.0]) < 0.05);
        // And together again: two probes tell.
        assert!(shared(&mut pace, 300, [2.0, 1.0]) > 0.5);
        assert!(shared(&mut pace, 300, [2.0, 1.0]) > 0.95);
    }

    #[test]
    fn one_that_was_held_up_does_not_count() {
        let mut pace = Pace::default();
        shared(&mut pace, 10, [2.0, 1.0]);
        pace.note(true, 1e3);
        assert!(pace.is_shared());
    }
}
