//! The same bits on any number of threads, and from a run that was saved and resumed.

use stylet_needle::simulation;
use stylet_needle::state::State;
use stylet_tests::{bits, finish, start};

const SCENES: &[(&str, &[&str])] = &[
    ("slab2d-insertion", &["needle.speed=0.3", "needle.depth=0.03"]),
    (
        "slab2d-insertion",
        &["needle.speed=0.3", "needle.depth=0.03", "solver.preconditioner=block-jacobi", "needle.rearrange=settle"],
    ),
    ("slab2d-sideways", &["needle.speed=0.3", "needle.depth=0.02"]),
    (
        "slab2d-sideways",
        &["needle.speed=0.3", "needle.depth=0.02", "solver.method=nonlinear-cg", "solver.preconditioner=jacobi"],
    ),
];

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    for (scene, keys) in SCENES {
        let run_on = |threads| {
            let mut run = start(scene, keys, threads).unwrap();
            finish(&mut *run).unwrap();
            (run.steps(), bits(&*run))
        };
        let one = run_on(1);
        assert!(one == run_on(2) && one == run_on(8), "{scene} {keys:?}");
    }
    // Large enough for the parallel product.
    let static_on = |threads| {
        let keys = ["mesh.h_start=7", "mesh.h_ref=7", "solver.tolerance=1e-2"];
        let mut run = start("slab2d-static", &keys, threads).unwrap();
        finish(&mut *run).unwrap();
        bits(&*run)
    };
    assert!(static_on(1) == static_on(2));
}

#[test]
fn a_resumed_run_ends_on_the_same_bits() {
    for (scene, keys) in SCENES {
        let mut whole = start(scene, keys, 1).unwrap();
        let mut states = Vec::new();
        while !whole.finished() {
            whole.step().unwrap();
            if [1, 7, 20, 33].contains(&whole.steps()) {
                states.push((whole.steps(), whole.save().unwrap()));
            }
        }
        assert!(states.len() >= 3, "{scene}: {} steps", whole.steps());
        for (at, state) in states {
            let mut resumed = simulation::resume(State::from_saved(&state).unwrap(), 1).unwrap();
            assert_eq!(resumed.steps(), at);
            finish(&mut *resumed).unwrap();
            assert_eq!(resumed.steps(), whole.steps(), "{scene} {keys:?} from {at}");
            assert!(bits(&*resumed) == bits(&*whole), "{scene} {keys:?} from {at}");
            let (a, b) = (resumed.summary(&[]), whole.summary(&[]));
            assert_eq!((a.solver, a.needle), (b.solver, b.needle), "{scene} {keys:?} from {at}");
        }
    }
}
