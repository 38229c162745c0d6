//! The motion of the needle's base as a table, linear between rows.

use crate::scene::{MotionRow, NeedleStage};
use serde::{Deserialize, Serialize};

/// Where the base is, relative to its start.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Pose {
    /// How far the tip is inserted along the axis, m.
    pub insert: f64,
    /// Offset of the needle to its left, m.
    pub sleeve: f64,
}

/// A motion table: pose as a function of the base's travel.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Motion {
    rows: Vec<MotionRow>,
}

impl Motion {
    /// The table of a scene; without rows the needle goes straight in to `depth`. A first row beyond zero is preceded by
    /// rest at zero. Rows were checked when the scene was read.
    pub fn of(needle: &NeedleStage) -> Self {
        let start = MotionRow { depth: 0.0, insert: 0.0, sleeve: 0.0 };
        let mut rows = needle.motion.clone();
        if rows.is_empty() {
            rows.push(MotionRow { depth: needle.depth, insert: needle.depth, sleeve: 0.0 });
        }
        if rows[0].depth > 0.0 {
            rows.insert(0, start);
        }
        Self { rows }
    }

    /// The whole travel of the base, m.
    pub fn travel(&self) -> f64 {
        self.rows[self.rows.len() - 1].depth
    }

    /// The pose after `travel` (m); the last row holds beyond the table.
    pub fn at(&self, travel: f64) -> Pose {
        let after = self.rows.partition_point(|row| row.depth <= travel);
        let Some(next) = self.rows.get(after) else {
            let last = self.rows[self.rows.len() - 1];
            return Pose { insert: last.insert, sleeve: last.sleeve };
        };
        if after == 0 {
            return Pose { insert: next.insert, sleeve: next.sleeve };
        }
        let last = self.rows[after - 1];
        let w = (travel - last.depth) / (next.depth - last.depth);
        let between = |a: f64, b: f64| a + (b - a) * w;
        Pose { insert: between(last.insert, next.insert), sleeve: between(last.sleeve, next.sleeve) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_linear_between_its_rows_and_holds_beyond_them() {
        let row = |depth, insert, sleeve| MotionRow { depth, insert, sleeve };
        let rows = vec![row(0.07, 0.07, 0.0), row(0.08, 0.07, 0.002), row(0.15, 0.0, 0.002)];
        let motion = Motion::of(&NeedleStage { motion: rows, ..NeedleStage::default() });
        assert_eq!(motion.travel(), 0.15);
        assert!((motion.at(0.035).insert - 0.035).abs() < 1e-15);
        assert!((motion.at(0.075).sleeve - 0.001).abs() < 1e-15);
        assert_eq!(motion.at(0.2), Pose { insert: 0.0, sleeve: 0.002 });
        assert_eq!(Motion::of(&NeedleStage::default()).at(0.01).insert, 0.01);
    }
}
