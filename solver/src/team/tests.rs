use super::*;
use crate::vector;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn every_part_is_worked_on_once() {
    for size in [0, 1, 2, 3, 8, 40] {
        let team = Team::new(size);
        assert_eq!(team.size(), size.clamp(1, Team::MAX_MEMBERS));
        for n in [0, 1, 2, 7, 40] {
            let mut parts = vec![0usize; n];
            team.each(&mut parts, |i, part| *part += i + 1);
            assert_eq!(parts, (1..=n).collect::<Vec<_>>());
        }
    }
}

#[test]
fn thousands_of_passes_in_a_row_and_after_sleep() {
    let team = Team::new(3);
    let mut parts = [0u64; 3];
    for round in 0..20 {
        (0..500).for_each(|_| team.each(&mut parts, |_, part| *part += 1));
        if round % 5 == 0 {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }
    assert_eq!(parts, [10_000; 3]);
}

#[test]
fn a_pass_within_a_pass_and_from_other_threads_is_done_alone() {
    let team = Team::new(2);
    let sum = AtomicUsize::new(0);
    team.each(&mut [(), ()], |_, ()| {
        team.each(&mut [1usize, 2], |_, part| _ = sum.fetch_add(*part, Ordering::Relaxed))
    });
    assert_eq!(sum.load(Ordering::Relaxed), 6);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                for _ in 0..200 {
                    let mut parts = [0usize; 5];
                    team.each(&mut parts, |i, part| *part = i);
                    assert_eq!(parts, [0, 1, 2, 3, 4]);
                }
            });
        }
    });
}

#[test]
fn a_panic_comes_back_and_leaves_the_team_in_order() {
    let team = Team::new(2);
    for culprit in [0, 1] {
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            team.each(&mut [0, 1], |i, _| assert!(i != culprit, "part {i}"));
        }));
        let message = result.unwrap_err();
        assert_eq!(message.downcast_ref::<String>().unwrap(), &format!("part {culprit}"));
    }
    let mut parts = [0; 4];
    team.each(&mut parts, |i, part| *part = i);
    assert_eq!(parts, [0, 1, 2, 3]);
}

#[test]
fn vectors_have_the_bits_of_one_thread() {
    for n in [0, 5, 20_000, 200_001] {
        let x: Vec<f64> = (0..n).map(|k| (k as f64 * 0.37).sin()).collect();
        let y: Vec<f64> = (0..n).map(|k| (k as f64 * 0.11).cos()).collect();
        let dot = vector::dot(&x, &y);
        let mut sum = y.clone();
        vector::axpy(0.3, &x, &mut sum);
        vector::xpby(&x, -0.7, &mut sum);
        for team in [1, 2, 8].map(Team::new) {
            assert_eq!(team.dot(&x, &y).to_bits(), dot.to_bits());
            let mut z = y.clone();
            team.axpy(0.3, &x, &mut z);
            team.xpby(&x, -0.7, &mut z);
            assert!(z == sum);
        }
    }
}
