//! The search against all `3^q` sets of states.

use super::dense::{Dense, Generator};
use crate::coupling::SlipState::{Backward, Forward, Static};
use crate::coupling::{
    Answer, SearchMethod, SearchReport, SearchSettings, SearchWorkspace, SlipLimits, SlipState, search,
};
use nalgebra::Vector3;
use stylet_solver::complementarity::BoxError;

/// For direct solves, which hardly err.
fn exact(method: SearchMethod, condense_after: Option<usize>, max_trials: usize) -> SearchSettings {
    let tolerance = 1e-12;
    SearchSettings {
        method,
        check_tolerance: tolerance,
        solve_tolerance: tolerance,
        max_trials,
        condense_after,
        slack: 1.0,
        ..SearchSettings::default()
    }
}

fn run(system: &mut Dense, settings: &SearchSettings, guess: &[SlipState]) -> (SearchReport, Vec<SlipState>, Answer) {
    system.solves = 0;
    let (mut states, mut answer) = (guess.to_vec(), Answer::default());
    let report = search(system, &mut states, settings, &mut SearchWorkspace::new(), &mut answer).unwrap();
    (report, states, answer)
}

fn random_states(generator: &mut Generator, q: usize) -> Vec<SlipState> {
    (0..q).map(|_| [Static, Forward, Backward][(1.5 * (generator.next() + 1.0)) as usize]).collect()
}

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * (1.0 + b.abs()))
}

#[test]
fn with_equal_limits_the_search_finds_the_one_consistent_set() {
    let mut generator = Generator(7);
    for case in 0..1000 {
        let q = 1 + case % 6;
        let friction = 10f64.powf(generator.next());
        let mut system = Dense::random(&mut generator, q, friction, 1.0);
        let accepted = system.enumerate();
        assert_eq!(accepted.len(), 1, "case {case}: {accepted:?}");
        let (states, force) = &accepted[0];
        let guess = random_states(&mut generator, q);
        for settings in [
            exact(SearchMethod::Condensed, None, 10),
            exact(SearchMethod::Trials, Some(2), 10),
            exact(SearchMethod::Trials, None, 729),
        ] {
            let (report, found, answer) = run(&mut system, &settings, &guess);
            assert!(report.consistent && report.refused.is_none(), "case {case}: {report:?}");
            assert_eq!(&found, states, "case {case}");
            assert!(near(&answer.force, force, 1e-8), "case {case}: {:?} {force:?}", answer.force);
            assert_eq!(report.trials, system.solves, "case {case}");
            let most = if settings.method == SearchMethod::Condensed {
                1
            } else {
                settings.condense_after.map_or(729, |n| n + 1)
            };
            assert!(report.trials <= most, "case {case}: {report:?}");
        }
    }
}

#[test]
fn with_a_ratio_above_one_the_search_finds_a_consistent_set() {
    let mut generator = Generator(11);
    let mut several = 0;
    for case in 0..1000 {
        let q = 1 + case % 6;
        let (friction, ratio) = (10f64.powf(generator.next()), 1.5 + 0.5 * generator.next());
        let mut system = Dense::random(&mut generator, q, friction, ratio);
        let accepted = system.enumerate();
        assert!(!accepted.is_empty(), "case {case}");
        several += usize::from(accepted.len() > 1);
        let guess = random_states(&mut generator, q);
        for settings in [
            exact(SearchMethod::Condensed, None, 10),
            exact(SearchMethod::Trials, Some(2), 10),
            exact(SearchMethod::Trials, None, 729),
        ] {
            let (report, found, answer) = run(&mut system, &settings, &guess);
            assert!(report.consistent && report.refused.is_none(), "case {case}: {report:?}");
            let Some((_, force)) = accepted.iter().find(|(states, _)| *states == found) else {
                panic!("case {case}: {found:?} is none of {accepted:?}");
            };
            assert!(near(&answer.force, force, 1e-8), "case {case}: {:?} {force:?}", answer.force);
        }
    }
    assert!(several > 50, "{several} problems have several consistent sets");
}

/// The number of consistent sets tells a wrong sign: friction that pushes the slip on leaves none or several.
#[test]
fn friction_of_the_wrong_sign_is_noticed() {
    let mut generator = Generator(3);
    let mut counts = [0; 3];
    for case in 0..300 {
        let mut system = Dense::random(&mut generator, 1 + case % 5, 1.0, 1.0);
        system.sign = -1.0;
        counts[system.enumerate().len().min(2)] += 1;
    }
    assert!(counts[0] + counts[2] > 150, "none, one, several: {counts:?}");
}

#[test]
fn without_friction_nodes_slip_and_with_endless_friction_they_stick() {
    let mut generator = Generator(5);
    for (friction, ratio) in [(0.0, 1.0), (1e9, 1.0), (0.0, 2.0), (1e9, 2.0)] {
        for case in 0..50 {
            let mut system = Dense::random(&mut generator, 5, friction, ratio);
            let guess = random_states(&mut generator, 5);
            for settings in [exact(SearchMethod::Condensed, None, 10), exact(SearchMethod::Trials, Some(2), 10)] {
                let (report, states, answer) = run(&mut system, &settings, &guess);
                assert!(report.consistent, "case {case}: {report:?}");
                for i in 0..5 {
                    assert_eq!(states[i] == Static, friction > 0.0, "case {case}: {states:?}");
                    assert!(friction > 0.0 || (answer.force[i] == 0.0 && answer.slip[i] != 0.0));
                }
            }
        }
    }
}

/// A shaft that was pushed in is pulled out: the hard case of the paper, "many iterations might be required".
#[test]
fn all_states_turn_round_within_ten_trials() {
    let mut generator = Generator(17);
    let mut most = [0; 3];
    for _ in 0..30 {
        let mut system = Dense::random(&mut generator, 20, 1.0, 1.0);
        system.tangents.fill(Vector3::x());
        system.load.fill(0.0);
        // All of the needle moves back by as much as friction would have it moved forward, or thrice as much.
        let pull = nalgebra::DVector::from_fn(60, |i, _| if i % 3 == 0 { -2.0 - generator.next() } else { 0.0 });
        system.needle_load = &system.needle * pull;
        for (method, most) in [
            exact(SearchMethod::Condensed, None, 10),
            exact(SearchMethod::Trials, Some(2), 10),
            exact(SearchMethod::Trials, None, 10),
        ]
        .iter()
        .zip(&mut most)
        {
            let (report, states, _) = run(&mut system, method, &[Forward; 20]);
            *most = report.trials.max(*most);
            assert!(report.consistent, "{report:?}");
            assert!(states.iter().filter(|&&s| s == Backward).count() > 10, "{states:?}");
        }
    }
    // The last one is measured: no theory bounds the trials of the published rules.
    assert_eq!(most, [1, 3, 5]);
}

/// A system with errors as large as the tolerance, and its guess. One node is just about to slip, if one sticks at all.
fn about_to_slip(generator: &mut Generator, case: usize, ratio: f64) -> (Dense, Vec<SlipState>, Vec<f64>) {
    let q = 1 + case % 6;
    let mut system = Dense::random(generator, q, 1.0, ratio);
    let (states, force) = system.enumerate().swap_remove(0);
    if let Some(i) = states.iter().position(|&s| s == Static) {
        system.limits[i] = SlipLimits::new(force[i].abs() / ratio, 0.0, ratio).unwrap();
    }
    system.noise = Some(Generator(case as u64));
    let guess = random_states(generator, q);
    (system, guess, force)
}

#[test]
fn errors_of_the_solves_do_not_make_states_flicker() {
    let mut generator = Generator(23);
    for case in 0..1000 {
        let ratio = [1.0, 1.5][case / 500];
        let (mut system, guess, force) = about_to_slip(&mut generator, case, ratio);
        for method in [SearchMethod::Condensed, SearchMethod::Trials] {
            let settings = SearchSettings { method, ..SearchSettings::default() };
            let (report, _, answer) = run(&mut system, &settings, &guess);
            assert!(report.consistent && report.trials <= 6, "case {case}: {report:?}");
            assert!(ratio > 1.0 || near(&answer.force, &force, 1e-3), "case {case}: {:?} {force:?}", answer.force);
        }
    }
}

/// That the test before sees what the slack is for.
#[test]
fn without_slack_states_flicker() {
    let mut generator = Generator(23);
    let settings = SearchSettings { slack: 0.0, ..SearchSettings::default() };
    let fails = (0..200).filter(|&case| {
        let (mut system, guess, _) = about_to_slip(&mut generator, case, 1.0);
        !run(&mut system, &settings, &guess).0.consistent
    });
    assert!(fails.count() > 10);
}

#[test]
fn a_condensed_system_of_no_use_is_reported_and_the_trials_go_on() {
    let mut generator = Generator(29);
    for case in 0..50 {
        let mut system = Dense::random(&mut generator, 4, 1.0, 1.0);
        let (expected, _) = system.enumerate().remove(0);
        for (tamper, index) in [
            ((|w| w.iter_mut().for_each(|w| *w = -*w)) as fn(&mut Vec<f64>), 0),
            (|w| w[5] = f64::NAN, 1),
            (|w| w.truncate(3), 2),
        ] {
            system.tamper = tamper;
            let (report, states, _) = run(&mut system, &exact(SearchMethod::Condensed, None, 81), &[Static; 4]);
            let named = match report.refused {
                Some(BoxError::NotPositiveDefinite { .. }) => 0,
                Some(BoxError::NotFinite { .. }) => 1,
                Some(BoxError::Shape { .. }) => 2,
                _ => usize::MAX,
            };
            assert_eq!(named, index, "case {case}: {report:?}");
            assert!(report.consistent && states == expected, "case {case}: {report:?}");
        }
    }
}

/// `W` off by up to a tenth in each node's displacement, as that of the last step may be.
#[test]
fn an_old_condensed_matrix_costs_trials_but_no_consistency() {
    let mut generator = Generator(31);
    let (mut sum, mut most) = (0, 0);
    for case in 0..300 {
        let mut system = Dense::random(&mut generator, 6, 1.0, 1.0);
        let (expected, force) = system.enumerate().remove(0);
        system.tamper = |w| {
            let stretch = |i: usize| 1.0 + 0.1 * (3.0 * i as f64).sin();
            w.iter_mut().enumerate().for_each(|(k, w)| *w *= stretch(k / 6) * stretch(k % 6));
        };
        let guess = random_states(&mut generator, 6);
        let (report, states, answer) = run(&mut system, &exact(SearchMethod::Condensed, None, 10), &guess);
        assert!(report.consistent && states == expected, "case {case}: {report:?}");
        assert!(near(&answer.force, &force, 1e-8), "case {case}");
        (sum, most) = (sum + report.trials, most.max(report.trials));
    }
    assert!(most <= 3 && sum < 360, "at most {most}, {sum} in all");
}
