//! Friction states along a needle over time, as areas: each node stands for the shaft half way to its neighbours.

use crate::record::Trace;
use stylet_physics::coupling::SlipState;
use stylet_plot::{Chart, Series, Style};

/// More steps than this are thinned out: a frame has no more px.
const MOST_STEPS: usize = 1200;

/// From, to (m from the entry), and the state there.
type Length = (f64, f64, SlipState);

/// States of a needle; `title` stands above.
pub(super) fn chart(traces: &[Trace], title: String) -> Chart {
    let every = traces.len().div_ceil(MOST_STEPS).max(1);
    let shown: Vec<&Trace> = traces.iter().step_by(every).collect();
    // A step is drawn from the one before to itself.
    let starts = std::iter::once(0.0).chain(shown.iter().map(|trace| trace.t));
    let columns: Vec<(f64, f64, Vec<Length>)> =
        shown.iter().zip(starts).map(|(trace, start)| (start, trace.t, lengths(&trace.states))).collect();
    let of = |wanted: SlipState, name: &str, colour| Series {
        name: name.to_owned(),
        points: columns
            .iter()
            .flat_map(|(start, end, lengths)| lengths.iter().map(move |length| (start, end, length)))
            .filter(|(.., length)| length.2 == wanted)
            .flat_map(|(start, end, (from, to, _))| [(*start, 1e3 * from), (*end, 1e3 * to)])
            .collect(),
        style: Style::Boxes,
        colour: Some(colour),
        ..Series::default()
    };
    Chart {
        title,
        x_label: "time (s)".to_owned(),
        y_label: "depth along the needle, from the entry (mm)".to_owned(),
        series: vec![
            of(SlipState::Static, "sticks", 6),
            of(SlipState::Forward, "slides forward", 4),
            of(SlipState::Backward, "slides back", 0),
        ],
        ..Chart::default()
    }
}

/// Lengths of the shaft in one state, from the entry to the tip, m: neighbours in the same state are one length.
fn lengths(nodes: &[(f32, SlipState)]) -> Vec<Length> {
    let mut lengths: Vec<Length> = Vec::new();
    for (i, &(at, state)) in nodes.iter().enumerate() {
        let half_way = |j: usize| 0.5 * (f64::from(at) + f64::from(nodes[j].0));
        let from = if i == 0 { f64::from(at) } else { half_way(i - 1) };
        let to = if i + 1 == nodes.len() { f64::from(at) } else { half_way(i + 1) };
        match lengths.last_mut() {
            Some(last) if last.2 == state => last.1 = to,
            _ => lengths.push((from, to, state)),
        }
    }
    lengths.retain(|(from, to, _)| to > from);
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;
    use SlipState::{Backward, Forward, Static};

    #[test]
    fn neighbours_in_one_state_are_one_length() {
        let nodes = [(0.0, Forward), (1.0, Forward), (2.0, Static), (4.0, Static), (5.0, Backward)];
        assert_eq!(lengths(&nodes), [(0.0, 1.5, Forward), (1.5, 4.5, Static), (4.5, 5.0, Backward)]);
        assert!(lengths(&[]).is_empty() && lengths(&[(0.0, Static)]).is_empty());
    }

    #[test]
    fn a_step_is_drawn_from_the_one_before() {
        let trace = |t: f64, state| Trace {
            t,
            tip: [0.0; 3],
            reference: None,
            depth: 0.0,
            force: [0.0; 3],
            states: vec![(0.0, state), (0.5, state)],
        };
        let chart = chart(&[trace(0.5, Forward), trace(1.0, Backward)], String::new());
        assert!(chart.series[0].points.is_empty());
        assert_eq!(chart.series[1].points, [(0.0, 0.0), (0.5, 500.0)]);
        assert_eq!(chart.series[2].points, [(0.5, 0.0), (1.0, 500.0)]);
    }
}
