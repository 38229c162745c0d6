//! From entry to full withdrawal.

use crate::support::{GEL, bits, go_on, open, start};
use stylet_tissue::Scenario;
use stylet_tissue::source::find;

#[test]
fn a_needle_goes_in_and_out_and_leaves_the_mesh_as_it_was() {
    let mut run = start(GEL, 1);
    let (points, cells) = (run.points().to_vec(), run.cells());
    let rows = go_on(run.as_mut(), usize::MAX);
    assert_eq!(rows.len(), 80);
    let depth = |k: usize| rows[k].quantities[0];
    // 40 mm out of the sleeve, of which one lies before the skin; the skin is dented, and the needle bends.
    assert!((0.034..0.0395).contains(&depth(40)), "{}", depth(40));
    assert!(rows[..45].windows(2).all(|pair| pair[1].quantities[0] >= pair[0].quantities[0] - 1e-4));
    assert_eq!(depth(79), 0.0);
    assert_eq!((run.points(), run.cells()), (&points[..], cells));
    // Pushed in, then pulled out.
    assert!(rows[35].quantities[4] > 0.3 && rows[60].quantities[4] < -0.1, "{rows:?}");

    let summary = run.summary(&[vec![0.03, 0.03, 0.03]]);
    let steering = summary.steering.unwrap();
    assert!(summary.converged && summary.failure.is_none() && summary.quality.inverted_elements == 0);
    assert_eq!(steering.consistent_share, 1.0);
    assert!(steering.needles[0].max_depth_m >= depth(40) && steering.needles[0].nodes == 0);
    assert!(steering.markers.len() == 2 && steering.markers[1].closest_tip_m.is_some());
    // What was deformed has come back, but for viscosity.
    assert!(summary.probes[0].displacement.iter().all(|u| u.abs() < 1e-3), "{:?}", summary.probes);
}

#[test]
fn seeds_stay_where_the_tip_left_them() {
    let mut run = start(GEL, 1);
    go_on(run.as_mut(), usize::MAX);
    let seeds = run.summary(&[]).steering.unwrap().seeds;
    let depths: Vec<f64> = seeds.iter().map(|seed| seed.depth_m).collect();
    assert_eq!(depths, [0.03, 0.02]);
    for seed in &seeds {
        // The needle is bent, and its length in the tissue that of the deformed channel.
        assert!((seed.at[0] - seed.depth_m).abs() < 3e-3, "{seed:?}");
        assert!(seed.at.iter().zip(&seed.place).all(|(x, y)| (x - y).abs() < 1e-3), "{seed:?}");
    }
}

#[test]
fn threads_do_not_change_the_bits() {
    let run = |threads| {
        let mut run = start(GEL, threads);
        let rows: Vec<_> = go_on(run.as_mut(), 20).iter().map(bits).collect();
        (rows, run.displacement().iter().map(|u| u.to_bits()).collect::<Vec<_>>())
    };
    let one = run(1);
    assert!(one.0.last().unwrap().4[3] > 0, "the needle is in the tissue");
    for threads in [2, 8] {
        assert!(run(threads) == one, "{threads} threads");
    }
}

/// With enough elements for a second thread to be woken, and vertices that are born along the needle.
#[test]
fn parts_do_not_change_the_bits() {
    let run = |threads, partition: &str, lazy: f64| {
        let scene = GEL.replace("cells = [6, 5, 5]", "cells = [12, 9, 9]");
        let mut run = start(&format!("{scene}[time]\npartition = \"{partition}\"\nlazy = {lazy}\n"), threads);
        let rows: Vec<_> = go_on(run.as_mut(), 30).iter().map(bits).collect();
        (rows, run.displacement().iter().map(|u| u.to_bits()).collect::<Vec<_>>())
    };
    for lazy in [0.0, 0.05] {
        let one = run(1, "numbers", lazy);
        assert!(one.0.last().unwrap().4[3] > 0, "the needle is in the tissue");
        for threads in [1, 2, 8] {
            assert!(run(threads, "metis", lazy) == one, "{threads} threads, lazy = {lazy}");
        }
    }
}

/// Other numbers for the same vertices: the same run but for rounding, and for ties.
#[test]
fn a_renumbered_mesh_is_left_as_it_was_and_takes_the_needle_the_same_way() {
    let [made, rcm] = ["made", "rcm"].map(|order| {
        let mut run = start(&GEL.replace("[mesh]", &format!("[mesh]\norder = \"{order}\"")), 1);
        let (points, cells) = (run.points().to_vec(), run.cells());
        let rows = go_on(run.as_mut(), usize::MAX);
        assert_eq!((run.points(), run.cells()), (&points[..], cells.clone()));
        (points, cells, rows)
    });
    let sorted = |points: &[f64]| {
        let mut points = points.as_chunks::<3>().0.to_vec();
        points.sort_by(|x, y| x.partial_cmp(y).unwrap());
        points
    };
    assert!(made.0 != rcm.0 && made.1 != rcm.1 && sorted(&made.0) == sorted(&rcm.0));
    for (one, other) in made.2.iter().zip(&rcm.2) {
        let tips = one.quantities[1..4].iter().zip(&other.quantities[1..4]);
        assert!(tips.clone().all(|(x, y)| (x - y).abs() < 1e-4), "{one:?} and {other:?}");
    }
}

#[test]
fn two_levels_find_the_same_solution() {
    let tip = |preconditioner: &str| {
        let mut run = start(&format!("{GEL}[solver]\ntolerance = 1e-8\npreconditioner = \"{preconditioner}\"\n"), 1);
        go_on(run.as_mut(), 25).pop().unwrap().quantities[1..4].to_vec()
    };
    let (one, two) = (tip("block-jacobi"), tip("two-level"));
    assert!(one.iter().zip(&two).all(|(x, y)| (x - y).abs() < 1e-6), "{one:?} and {two:?}");
}

#[test]
fn a_needle_that_comes_out_at_the_back_ends_the_run_and_says_where() {
    let through = GEL.replace("{ t = 0.8, insert = 0.05, spin = 4.0 }", "{ t = 2.0, insert = 0.06 }");
    let through = &through[..through.find("{ t = 0.8, insert = 0.0, spin").unwrap()];
    let mut run = start(&format!("{through}]\n"), 1);
    let error = loop {
        match run.step() {
            Ok(_) => assert!(!run.finished(), "the needle never came out"),
            Err(error) => break error,
        }
    };
    let text = error.to_string();
    assert!(!error.is_bad_input() && text.contains("needle 1") && text.contains("tip, node"), "{text}");
    // What was reached can be looked at.
    assert!(run.steps() > 40 && run.summary(&[]).steering.unwrap().needles[0].depth_m > 0.06);
}

#[test]
fn the_pictures_and_tables_of_a_run_are_written() {
    let folder = std::env::temp_dir().join(format!("stylet-steering-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut run = start(GEL, 1);
    let rows = go_on(run.as_mut(), usize::MAX);
    run.draw(&folder, &rows).unwrap();
    for name in ["mesh.svg", "path.svg", "force.svg", "states.svg", "stages.svg"] {
        assert!(std::fs::read_to_string(folder.join(name)).unwrap().starts_with("<svg"), "{name}");
    }
    assert_eq!(std::fs::read_to_string(folder.join("seeds.csv")).unwrap().lines().count(), 3);
    // What was tracked, taken for a measurement, has no error.
    let own = std::fs::read_to_string(folder.join("markers.csv")).unwrap();
    assert_eq!(own.lines().next(), Some("time_s,a_x,a_y,a_z,b_x,b_y,b_z"));
    let path = folder.join("markers.csv").display().to_string();
    let measured = format!("[markers]\nfile = '{path}'\n{GEL}");
    let mut again = open(&measured).start(1).unwrap();
    go_on(again.as_mut(), usize::MAX);
    let error = again.summary(&[]).steering.unwrap().marker_error.unwrap();
    assert_eq!((error.count, error.rms_m, error.below_1_mm), (162, 0.0, 1.0));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn an_end_between_steps_is_noted() {
    for (end, notes) in [("time.end=0.05", 1), ("time.end=0.06", 0)] {
        let source = find("gel-single-bend", stylet_steering::SCENES).unwrap();
        let mut run = stylet_steering::open(&source, &[end.to_owned()]).unwrap().start(1).unwrap();
        go_on(run.as_mut(), usize::MAX);
        let found = run.summary(&[]).steering.unwrap().notes;
        let said = found.iter().filter(|note| note.contains("no whole number of steps")).count();
        assert_eq!(said, notes, "{found:?}");
    }
}
