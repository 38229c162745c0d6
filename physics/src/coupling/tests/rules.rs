//! The rules of the search on systems that follow a script, the first guess, and limits.

use crate::coupling::SlipState::{Backward, Forward, Static};
use crate::coupling::{
    Answer, LimitsError, SearchSettings, SearchWorkspace, SlipLimits, SlipState, StickSlip, guess, search,
};
use proptest::prelude::*;

/// Says that no state is right, unless a tolerance is coarser than `honest`: then all are.
struct Stubborn {
    limits: Vec<SlipLimits>,
    honest: f64,
    calls: Vec<(Vec<SlipState>, f64, bool)>,
}

impl Stubborn {
    fn new(q: usize, honest: f64) -> Self {
        Self { limits: vec![SlipLimits::new(1.0, 0.0, 1.0).unwrap(); q], honest, calls: Vec::new() }
    }

    fn run(&mut self, settings: &SearchSettings) -> (crate::coupling::SearchReport, Vec<SlipState>) {
        let mut states = Vec::new();
        let report = search(self, &mut states, settings, &mut SearchWorkspace::new(), &mut Answer::default());
        (report.unwrap(), states)
    }
}

impl StickSlip for Stubborn {
    type Error = std::convert::Infallible;

    fn limits(&self) -> &[SlipLimits] {
        &self.limits
    }

    fn solve(
        &mut self,
        states: &[SlipState],
        tol: f64,
        fresh: bool,
        answer: &mut Answer,
    ) -> Result<usize, Self::Error> {
        self.calls.push((states.to_vec(), tol, fresh));
        let wrong = if tol > self.honest { -1.0 } else { 1.0 };
        answer.force = states.iter().map(|state| if *state == Static && wrong > 0.0 { 2.0 } else { 0.5 }).collect();
        let slip = |state: &SlipState| match state {
            Static => 0.0,
            Forward => -wrong,
            Backward => wrong,
        };
        answer.slip = states.iter().map(slip).collect();
        Ok(if fresh { 7 } else { 3 })
    }

    fn condense(&mut self, _: f64, _: &mut Vec<f64>, _: &mut Vec<f64>) -> Result<usize, Self::Error> {
        panic!("the published search does not condense");
    }
}

fn published(max_trials: usize) -> SearchSettings {
    SearchSettings { max_trials, ..SearchSettings::published() }
}

#[test]
fn violated_states_change_as_published_and_none_is_tried_twice() {
    let mut system = Stubborn::new(3, 1.0);
    let (report, _) = system.run(&published(8));
    let (s, f, b) = (Static, Forward, Backward);
    // Each line: what the rules would change the line above to, and where that is known, how far it was counted on.
    let expected = [
        [s, s, s],
        [f, f, f],
        [f, s, s], // sss is known
        [s, f, f],
        [b, s, s], // fss
        [b, f, f], // sff, fff
        [s, f, s], // sss, fss, bss
        [f, s, f],
        [f, f, s], // sfs; solved for without a look
    ];
    assert_eq!(report.trials, 9);
    assert!(!report.consistent);
    let tried: Vec<_> = system.calls.iter().map(|(states, ..)| states.as_slice()).collect();
    assert_eq!(tried, expected);
    // Only the first solve starts from zero; none but the last goes beyond the look.
    let n = system.calls.len();
    for (i, (_, tolerance, fresh)) in system.calls.iter().enumerate() {
        assert_eq!((*tolerance, *fresh), (if i + 1 == n { 1e-5 } else { 1e-3 }, i == 0));
    }
    assert_eq!((report.iterations, report.fewest_iterations, report.most_iterations), (7 + 8 * 3, 3, 7));
}

#[test]
fn the_search_ends_when_all_states_have_been_tried() {
    for q in 0..4 {
        let mut system = Stubborn::new(q, 1.0);
        let (report, states) = system.run(&published(1000));
        let mut tried: Vec<_> = system.calls.iter().map(|(states, ..)| format!("{states:?}")).collect();
        assert_eq!(states.len(), q);
        if q == 0 {
            // Nothing can be wrong.
            assert!(report.consistent && report.trials == 1);
            continue;
        }
        assert!(!report.consistent);
        assert_eq!(report.trials, 3usize.pow(q as u32) + 1);
        tried.sort();
        tried.dedup();
        assert_eq!(tried.len(), 3usize.pow(q as u32));
    }
}

#[test]
fn states_that_fail_at_the_end_only_are_changed_too() {
    let mut system = Stubborn::new(1, 1e-4);
    let (report, _) = system.run(&published(2));
    let calls: Vec<_> = system.calls.iter().map(|(states, tolerance, _)| (states[0], *tolerance)).collect();
    let expected = [(Static, 1e-3), (Static, 1e-5), (Forward, 1e-3), (Forward, 1e-5), (Backward, 1e-5)];
    assert_eq!(calls, expected);
    assert!(!report.consistent && report.trials == 3);
    let mut system = Stubborn::new(2, 0.0);
    let (report, states) = system.run(&published(10));
    assert_eq!((report.consistent, report.trials, report.iterations, states), (true, 1, 10, vec![Static; 2]));
}

/// One node whose slip is positive, but not at the tolerance of a look.
struct Blurred(Stubborn);

impl StickSlip for Blurred {
    type Error = std::convert::Infallible;

    fn limits(&self) -> &[SlipLimits] {
        self.0.limits()
    }

    fn solve(
        &mut self,
        states: &[SlipState],
        tol: f64,
        fresh: bool,
        answer: &mut Answer,
    ) -> Result<usize, Self::Error> {
        self.0.calls.push((states.to_vec(), tol, fresh));
        let (force, slip) = match states[0] {
            Static => (1.2, 0.0),
            Forward => (1.0, 1e-4 - tol),
            Backward => (-1.0, 1.0),
        };
        (answer.force, answer.slip) = (vec![force], vec![slip]);
        Ok(1)
    }

    fn condense(&mut self, _: f64, _: &mut Vec<f64>, _: &mut Vec<f64>) -> Result<usize, Self::Error> {
        panic!("not asked for");
    }

    fn magnitudes(&self) -> [f64; 2] {
        [1.0, 0.1]
    }
}

#[test]
fn states_that_only_a_look_refused_get_a_second_one() {
    for (second_look, found, calls) in [(true, true, 3), (false, false, 4)] {
        let mut system = Blurred(Stubborn::new(1, 0.0));
        let settings = SearchSettings { second_look, ..published(10) };
        let (mut states, mut answer) = (vec![Forward], Answer::default());
        let report = search(&mut system, &mut states, &settings, &mut SearchWorkspace::new(), &mut answer).unwrap();
        assert_eq!((report.consistent, system.0.calls.len()), (found, calls), "{:?}", system.0.calls);
        let tried: Vec<_> = system.0.calls.iter().map(|(states, tolerance, _)| (states[0], *tolerance)).collect();
        // A look refuses forward slip; static bears too much; then forward slip at once as far as it goes, or what is left.
        let third = if second_look { (Forward, 1e-5) } else { (Backward, 1e-3) };
        assert_eq!(tried[..3], [(Forward, 1e-3), (Static, 1e-3), third]);
    }
}

#[test]
fn without_trials_the_guess_is_solved_for() {
    let mut system = Stubborn::new(2, 1.0);
    let (report, states) = system.run(&published(0));
    assert_eq!((report.trials, report.consistent, states), (1, false, vec![Static; 2]));
    assert_eq!(system.calls, [(vec![Static; 2], 1e-5, true)]);
}

#[test]
fn limits_are_those_of_the_paper() {
    let shaft = SlipLimits::new(0.2, 0.0, 1.0).unwrap();
    assert_eq!((shaft.dynamic, shaft.fixed), ([-0.2, 0.2], [-0.2, 0.2]));
    let tip = SlipLimits::new(0.25, 1.0, 2.0).unwrap();
    assert_eq!((tip.dynamic, tip.fixed), ([-0.25, 1.25], [-0.5, 2.5]));
    assert_eq!([Static, Forward, Backward].map(|state| tip.slipping(state)), [0.0, 1.25, -0.25]);
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(SlipLimits::new(bad, 0.0, 1.0), Err(LimitsError::Force { what: "friction", .. })));
        assert!(matches!(SlipLimits::new(0.0, bad, 1.0), Err(LimitsError::Force { what: "cutting", .. })));
        assert!(matches!(SlipLimits::new(0.0, 0.0, bad), Err(LimitsError::Ratio { .. })));
    }
    assert!(matches!(SlipLimits::new(0.0, 0.0, 0.99), Err(LimitsError::Ratio { .. })));
}

#[test]
fn a_guess_without_old_nodes_is_static() {
    let mut states = vec![Forward; 7];
    guess(&[], &[], &[0.1, 0.2], &mut states);
    assert_eq!(states, [Static; 2]);
}

proptest! {
    #[test]
    fn a_guess_is_the_state_of_the_nearest_node(
        mut old in proptest::collection::vec(0.0..1.0f64, 1..9),
        new in proptest::collection::vec(-0.5..1.5f64, 0..9),
    ) {
        old.sort_by(f64::total_cmp);
        let states: Vec<_> = (0..old.len()).map(|i| [Static, Forward, Backward][i * 7 % 3]).collect();
        let mut found = Vec::new();
        guess(&old, &states, &new, &mut found);
        prop_assert_eq!(found.len(), new.len());
        for (arc, state) in new.iter().zip(found) {
            let nearest = (0..old.len()).min_by(|&i, &j| (old[i] - arc).abs().total_cmp(&(old[j] - arc).abs())).unwrap();
            prop_assert_eq!(state, states[nearest]);
        }
    }
}
