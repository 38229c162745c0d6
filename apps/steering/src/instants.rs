//! At which steps the pictures of a run are taken, so that they tell what happens: on the way in, deepest, and at the end.

use crate::motion::Motion;

/// Most steps that are looked at.
const MOST: usize = 100_000;

/// Steps, counted from 1, after which the tissue is kept. The end needs none: a run that is drawn is still there.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Instants {
    /// Where the needles are first half as far out of their sleeves as deepest, if that is before it.
    pub half_way: Option<usize>,
    /// The last step at which the lengths out of the sleeves have their largest sum.
    pub deepest: usize,
}

impl Instants {
    /// The instants of needles with these motions up to `end` (s), in steps of `dt` (s).
    pub fn of(motions: &[Motion], end: f64, dt: f64) -> Self {
        let steps = (end / dt).round().max(1.0) as usize;
        // Of very many steps some are enough.
        let stride = steps.div_ceil(MOST);
        // A needle that is drawn back further than it was at the start is no less out than one that was not moved.
        let out = |step: usize| motions.iter().map(|motion| motion.inserted(step as f64 * dt).max(0.0)).sum::<f64>();
        let (deepest, most) = (1..=steps).step_by(stride).map(|step| (step, out(step))).fold(
            (1, f64::NEG_INFINITY),
            |best, (step, sum)| {
                // Sums of one table at one height differ by rounding.
                if sum >= best.1 - 1e-12 { (step, sum.max(best.1)) } else { best }
            },
        );
        let half_way = (1..deepest).step_by(stride).find(|&step| most > 0.0 && out(step) >= 0.5 * most - 1e-12);
        Self { half_way, deepest }
    }

    /// Whether the tissue is kept after this step.
    pub fn contains(&self, step: usize) -> bool {
        self.deepest == step || self.half_way == Some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_scene::{Row, Value};

    fn motion(rows: &[(f64, f64)]) -> Motion {
        let mut needle = Row::default();
        let row = |&(t, insert): &(f64, f64)| [("t", t), ("insert", insert)].into_iter().collect();
        needle.set("motion", Value::Rows(rows.iter().map(row).collect()));
        Motion::of(&needle).unwrap()
    }

    /// In until `to` at 10 mm/s from `from` on, held until `back`, then out at twice that.
    fn in_and_out(from: f64, to: f64, back: f64) -> Motion {
        motion(&[(from, 0.0), (from, 0.01), (to, 0.01), (to, 0.0), (back, 0.0), (back, -0.02)])
    }

    #[test]
    fn one_needle_is_taken_half_way_in_and_at_the_end_of_its_hold() {
        let instants = Instants::of(&[in_and_out(0.0, 4.0, 5.0)], 7.0, 0.1);
        assert_eq!(instants, Instants { half_way: Some(20), deepest: 50 });
        assert!(instants.contains(20) && instants.contains(50) && !instants.contains(70));
    }

    #[test]
    fn of_two_needles_the_sum_of_depths_counts() {
        // The first one is deepest until 6.5 s, but the second one is on its way out from 4.5 s on.
        let motions = [in_and_out(0.0, 3.0, 6.5), in_and_out(1.0, 4.0, 4.5)];
        assert_eq!(Instants::of(&motions, 9.0, 0.1), Instants { half_way: Some(20), deepest: 45 });
        // A needle that was drawn back past its start does not count against the others.
        let motions = [motion(&[(0.0, -0.05)]), in_and_out(0.0, 3.0, 4.0)];
        assert_eq!(Instants::of(&motions, 9.0, 0.1).deepest, 40);
    }

    #[test]
    fn of_very_many_steps_some_are_enough() {
        let instants = Instants::of(&[in_and_out(0.0, 4e4, 5e4)], 1e5, 1e-6);
        let at = |step: usize| step as f64 * 1e-6;
        assert!((at(instants.deepest) - 5e4).abs() <= 1.0 && (at(instants.half_way.unwrap()) - 2e4).abs() <= 1.0);
    }

    #[test]
    fn a_needle_that_is_not_pushed_has_no_way_in() {
        assert_eq!(Instants::of(&[motion(&[(0.0, 0.0)])], 1.0, 0.1), Instants { half_way: None, deepest: 10 });
    }
}
