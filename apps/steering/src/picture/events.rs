//! What happens to a needle, and when: so that a force over time can be read.

use crate::motion::Motion;
use crate::record::Trace;
use stylet_mesh::generate::implicit::Implicit;

/// Depths below this are rounding, m.
const NOTHING: f64 = 1e-6;
/// A base that moves by less in a step stands still, m.
const STILL: f64 = 1e-9;

/// A layer of a surface that is harder to cut, as a scene names it.
pub(super) struct Layer<'a> {
    pub name: &'a str,
    pub surface: &'a dyn Implicit,
    pub thickness: f64,
}

/// The first step of a needle at which its tip is behind the skin.
pub(super) fn puncture(traces: &[Trace]) -> Option<&Trace> {
    traces.iter().find(|trace| trace.depth > NOTHING)
}

/// Times (s) of what happens, and names, in this order: the skin is touched and pierced, layers are pierced, the base stops, goes
/// back or in again, the tip is out.
pub(super) fn of(traces: &[Trace], layers: &[Layer], motion: &Motion) -> Vec<(f64, String)> {
    let mut events = Vec::new();
    let mut add = |trace: Option<&Trace>, name: String| events.extend(trace.map(|trace| (trace.t, name)));
    add(traces.iter().find(|trace| trace.reference.is_some()), "skin touched".to_owned());
    add(puncture(traces), "skin pierced".to_owned());
    for layer in layers {
        let is_behind = |trace: &&Trace| trace.reference.is_some_and(|x| layer.surface.distance(&x) < -layer.thickness);
        add(traces.iter().find(is_behind), format!("{} pierced", layer.name));
    }
    let deep = traces.iter().rposition(|trace| trace.depth > NOTHING);
    let out = deep.and_then(|deep| traces.get(deep + 1));
    let touched = traces.iter().position(|trace| trace.reference.is_some()).unwrap_or(traces.len());
    let within = &traces[touched..deep.map_or(traces.len(), |deep| deep + 1).max(touched)];
    turns(within, motion).for_each(|(trace, name)| add(Some(trace), name.to_owned()));
    add(out, "out".to_owned());
    events
}

/// Where a base that goes in stops, goes back, or goes in again.
fn turns<'a>(traces: &'a [Trace], motion: &Motion) -> impl Iterator<Item = (&'a Trace, &'static str)> {
    let way = |pair: &[Trace]| {
        let by = motion.inserted(pair[1].t) - motion.inserted(pair[0].t);
        if by.abs() < STILL {
            0
        } else if by > 0.0 {
            1
        } else {
            -1
        }
    };
    traces.windows(3).filter_map(move |three| {
        let [before, after] = [way(&three[..2]), way(&three[1..])];
        let name = match after {
            0 => "held",
            1 => "pushed on",
            _ => "drawn back",
        };
        (before != after).then_some((&three[1], name))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_scene::{Row, Value};

    /// A half space below x = 0.03.
    struct Beyond;

    impl Implicit for Beyond {
        fn distance(&self, x: &[f64; 3]) -> f64 {
            0.03 - x[0]
        }

        fn bounds(&self) -> Option<[[f64; 3]; 2]> {
            None
        }
    }

    fn motion(rows: &[(f64, f64)]) -> Motion {
        let mut needle = Row::default();
        let row = |&(t, insert): &(f64, f64)| [("t", t), ("insert", insert)].into_iter().collect();
        needle.set("motion", Value::Rows(rows.iter().map(row).collect()));
        Motion::of(&needle).unwrap()
    }

    /// A skin at 10 mm that is dented by 5 mm.
    fn traces(motion: &Motion, steps: usize) -> Vec<Trace> {
        let trace = |step: usize| {
            let t = 0.1 * step as f64;
            let way = motion.inserted(t);
            let depth = if way > 0.015 || (t > 5.0 && way > 0.01) { way - 0.01 } else { 0.0 };
            let reference = (way > 0.01).then_some([depth, 0.0, 0.0]);
            Trace { t, tip: [way, 0.0, 0.0], reference, depth, force: [0.0; 3], states: Vec::new() }
        };
        (1..=steps).map(trace).collect()
    }

    #[test]
    fn a_cycle_is_told_in_order() {
        let motion = motion(&[(0.0, 0.01), (5.0, 0.01), (5.0, 0.0), (6.0, 0.0), (6.0, -0.01)]);
        let layers = [Layer { name: "capsule", surface: &Beyond, thickness: 0.002 }];
        let events = of(&traces(&motion, 120), &layers, &motion);
        let names: Vec<&str> = events.iter().map(|event| event.1.as_str()).collect();
        assert_eq!(names, ["skin touched", "skin pierced", "capsule pierced", "held", "drawn back", "out"]);
        let expected = [1.1, 1.6, 4.3, 5.0, 6.0, 10.0];
        // A step either way, by rounding of sums.
        assert!(events.iter().zip(expected).all(|(event, t)| (event.0 - t).abs() < 0.11), "{events:?}");
    }

    #[test]
    fn every_turn_is_named() {
        let motion =
            motion(&[(0.0, 0.01), (3.0, 0.01), (3.0, -0.01), (4.0, -0.01), (4.0, 0.01), (5.0, 0.01), (5.0, -0.01)]);
        let events = of(&traces(&motion, 120), &[], &motion);
        let turns: Vec<&str> = events[2..].iter().map(|event| event.1.as_str()).collect();
        assert_eq!(turns, ["drawn back", "pushed on", "drawn back", "out"], "{events:?}");
    }

    #[test]
    fn what_does_not_happen_is_not_named() {
        let motion = motion(&[(0.0, 0.01)]);
        let names =
            |steps| of(&traces(&motion, steps), &[], &motion).into_iter().map(|event| event.1).collect::<Vec<_>>();
        // Still going in: neither held nor drawn back.
        assert!(names(5).is_empty());
        assert_eq!(names(13), ["skin touched"]);
    }
}
