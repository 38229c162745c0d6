//! The motion of a base as a table, linear between rows.

use stylet_physics::insertion::BaseMotion;
use stylet_scene::Row;

/// A quantity over time: ascending times, two of one time where it jumps.
#[derive(Clone, PartialEq, Debug, Default)]
struct Track<const K: usize>(Vec<(f64, [f64; K])>);

impl<const K: usize> Track<K> {
    /// The integral from zero to `t`; before the first row and beyond the last one it holds.
    fn integral(&self, t: f64) -> [f64; K] {
        let mut sum = [0.0; K];
        let Some(&(first, value)) = self.0.first() else { return sum };
        let mut add = |h: f64, value: &[f64; K]| (0..K).for_each(|k| sum[k] += h * value[k]);
        add(t.min(first), &value);
        for pair in self.0.windows(2) {
            let [(from, start), (to, end)] = [pair[0], pair[1]];
            let until = t.clamp(from, to);
            if until > from {
                let part = 0.5 * (until - from) / (to - from);
                add(until - from, &std::array::from_fn(|k| start[k] + part * (end[k] - start[k])));
            }
        }
        if let Some(&(last, value)) = self.0.last() {
            add((t - last).max(0.0), &value);
        }
        sum
    }

    /// The mean from `t` to `t + h`.
    fn mean(&self, t: f64, h: f64) -> [f64; K] {
        let (before, after) = (self.integral(t), self.integral(t + h));
        std::array::from_fn(|k| (after[k] - before[k]) / h)
    }
}

/// What the base of a needle does over time. A column that a row leaves out is linear between the rows that have it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Motion {
    insert: Track<1>,
    sleeve: Track<3>,
    spin: Track<1>,
    end: f64,
}

impl Motion {
    /// The motion of a row of `[[needle]]`.
    ///
    /// # Errors
    /// Rows out of time order: what was found and what was expected.
    pub fn of(needle: &Row) -> Result<Self, String> {
        let rows = needle.value("motion").map_or(Ok(&[][..]), |value| value.rows())?;
        if rows.is_empty() {
            return Err("motion: found no row, expected at least one [[needle.motion]]".into());
        }
        let mut motion = Self::default();
        let mut before = 0.0;
        for (index, row) in rows.iter().enumerate() {
            let t = row.get("t").unwrap_or(0.0);
            if t < before {
                return Err(format!(
                    "motion (row {}): t: found {t} s after {before} s, expected times in ascending order",
                    index + 1
                ));
            }
            before = t;
            if let Some(insert) = row.get("insert") {
                motion.insert.0.push((t, [insert]));
            }
            if let Some(sleeve) = row.value("sleeve") {
                motion.sleeve.0.push((t, sleeve.point()?));
            }
            if let Some(spin) = row.get("spin") {
                motion.spin.0.push((t, [spin]));
            }
        }
        motion.end = before;
        Ok(motion)
    }

    /// The same way made so many times as fast: times are divided by `pace`, velocities multiplied.
    #[must_use]
    pub fn at_pace(mut self, pace: f64) -> Self {
        fn hasten<const K: usize>(track: &mut Track<K>, pace: f64) {
            track.0.iter_mut().for_each(|(t, value)| (*t, *value) = (*t / pace, value.map(|x| x * pace)));
        }
        hasten(&mut self.insert, pace);
        hasten(&mut self.sleeve, pace);
        hasten(&mut self.spin, pace);
        self.end /= pace;
        self
    }

    /// Time of the last row, s.
    #[must_use]
    pub fn end(&self) -> f64 {
        self.end
    }

    /// The mean motion of a step from `t` of length `h` (s): after all steps the base is where the table takes it, whatever the
    /// step.
    #[must_use]
    pub fn mean(&self, t: f64, h: f64) -> BaseMotion {
        BaseMotion { insert: self.insert.mean(t, h)[0], sleeve: self.sleeve.mean(t, h), spin: self.spin.mean(t, h)[0] }
    }

    /// How far the needle has been pushed out of its sleeve at `t`, m.
    #[must_use]
    pub fn inserted(&self, t: f64) -> f64 {
        self.insert.integral(t)[0]
    }

    /// The time (s) and the length pushed out of the sleeve since the start (m) where that is least and where it is greatest
    /// from 0 to `end` (s).
    #[must_use]
    pub fn extremes(&self, end: f64) -> [(f64, f64); 2] {
        let rows = &self.insert.0;
        let turns = rows.windows(2).filter(|pair| pair[0].1[0] * pair[1].1[0] < 0.0).map(|pair| {
            let [(from, [start]), (to, [end])] = [pair[0], pair[1]];
            from + (to - from) * start / (start - end)
        });
        let times = rows.iter().map(|row| row.0).chain(turns).filter(|t| (0.0..end).contains(t)).chain([0.0, end]);
        let mut extremes = [(0.0, 0.0); 2];
        for t in times {
            let inserted = self.inserted(t);
            if inserted < extremes[0].1 {
                extremes[0] = (t, inserted);
            }
            if inserted > extremes[1].1 {
                extremes[1] = (t, inserted);
            }
        }
        extremes
    }

    /// Whether the sleeve moves at all.
    #[must_use]
    pub fn moves_sleeve(&self) -> bool {
        self.sleeve.0.iter().any(|(_, v)| v.iter().any(|&v| v != 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_scene::Value;

    fn row(cells: &[(&'static str, f64)]) -> Row {
        cells.iter().copied().collect()
    }

    fn motion(rows: Vec<Row>) -> Result<Motion, String> {
        let mut needle = Row::default();
        needle.set("motion", Value::Rows(rows));
        Motion::of(&needle)
    }

    #[test]
    fn steps_of_any_length_come_to_the_same_place() {
        let rows = vec![
            row(&[("t", 0.0), ("insert", 0.0), ("spin", 1.0)]),
            row(&[("t", 1.0), ("insert", 0.02)]),
            row(&[("t", 2.0), ("insert", 0.02)]),
            row(&[("t", 2.0), ("insert", -0.01), ("spin", 3.0)]),
            row(&[("t", 3.0), ("insert", -0.01)]),
        ];
        let motion = motion(rows).unwrap();
        for steps in [1, 7, 30, 400] {
            let h = 3.0 / f64::from(steps);
            let sums = (0..steps)
                .map(|k| motion.mean(f64::from(k) * h, h))
                .fold((0.0, 0.0), |sum, m| (sum.0 + h * m.insert, sum.1 + h * m.spin));
            // 0.01 + 0.02 - 0.01 m; a ramp from 1 to 3 rad/s over 2 s, then 3 rad/s for 1 s.
            assert!((sums.0 - 0.02).abs() < 1e-15 && (sums.1 - 7.0).abs() < 1e-12, "{steps}: {sums:?}");
        }
        assert!((motion.inserted(0.5) - 0.0025).abs() < 1e-16);
        // A difference of integrals.
        assert!((motion.mean(1.2, 0.1).insert - 0.02).abs() < 1e-15);
        assert!((motion.extremes(3.0)[1].0 - 2.0).abs() < 1e-9);
        assert_eq!((motion.end(), motion.moves_sleeve()), (3.0, false));
    }

    #[test]
    fn the_pace_changes_times_but_not_the_way() {
        let mut jump = row(&[("t", 1.0), ("insert", 0.02), ("spin", 3.0)]);
        jump.set("sleeve", Value::Floats(vec![0.0, 0.1, 0.0]));
        let rows = vec![
            row(&[("t", 0.0), ("insert", 0.0), ("spin", 1.0)]),
            row(&[("t", 1.0), ("insert", 0.02)]),
            jump,
            row(&[("t", 3.0), ("insert", -0.01)]),
        ];
        let motion = motion(rows).unwrap();
        for pace in [0.3, 1.0, 4.0] {
            let other = motion.clone().at_pace(pace);
            assert!((other.end() * pace - 3.0).abs() < 1e-15);
            for t in [0.2, 0.9, 1.4, 2.7] {
                let (own, made) = (motion.mean(0.0, t), other.mean(0.0, t / pace));
                let ways = [(own.insert, made.insert), (own.spin, made.spin), (own.sleeve[1], made.sleeve[1])];
                for (own, made) in ways {
                    assert!((own * t - made * t / pace).abs() < 1e-14, "{pace}, {t}: {own} and {made}");
                }
                assert!((motion.inserted(t) - other.inserted(t / pace)).abs() < 1e-15);
            }
        }
    }

    #[test]
    fn extremes_are_at_turns_between_rows_too() {
        // 1 - t: out until 1 s, 0.5 m; back past the start at 2 s.
        let motion = motion(vec![row(&[("t", 0.0), ("insert", 1.0)]), row(&[("t", 4.0), ("insert", -3.0)])]).unwrap();
        assert_eq!(motion.extremes(4.0), [(4.0, -4.0), (1.0, 0.5)]);
        assert_eq!(motion.extremes(0.5), [(0.0, 0.0), (0.5, 0.375)]);
    }

    #[test]
    fn rows_out_of_order_are_named() {
        let error = motion(vec![row(&[("t", 1.0)]), row(&[("t", 0.5)])]).unwrap_err();
        assert_eq!(error, "motion (row 2): t: found 0.5 s after 1 s, expected times in ascending order");
        assert!(motion(vec![]).unwrap_err().contains("expected at least one"));
    }
}
