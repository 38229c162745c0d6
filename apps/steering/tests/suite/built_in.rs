//! The scenes that come with the program, from entry to full withdrawal.

use crate::support::go_on;
use stylet_steering::{SCENES, open};
use stylet_tissue::Scenario;
use stylet_tissue::source::find;
use stylet_tissue::summary::SteeringSummary;

/// Runs a scene and checks what holds of all of them.
fn run_through(name: &str) -> SteeringSummary {
    run_set(name, &[])
}

/// The same with keys of the scene set.
fn run_set(name: &str, set: &[String]) -> SteeringSummary {
    let opened = open(&find(name, SCENES).unwrap(), set).unwrap_or_else(|error| panic!("{error}"));
    let mut run = opened.start(1).unwrap();
    run.forgo_pictures();
    let (points, cells) = (run.points().to_vec(), run.cells());
    go_on(run.as_mut(), 60);
    let mut resumed = opened.resume(&run.save().unwrap(), 1).unwrap_or_else(|error| panic!("{name}: {error}"));
    for rest in [&mut run, &mut resumed] {
        go_on(rest.as_mut(), 3);
    }
    let bits = |v: &[f64]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(run.displacement()), bits(resumed.displacement()), "{name}: resumed");
    drop(resumed);
    go_on(run.as_mut(), usize::MAX);
    assert!(run.finished() && (run.points(), run.cells()) == (&points[..], cells), "{name}: another mesh");
    let summary = run.summary(&[]);
    assert_eq!(summary.quality.inverted_elements, 0, "{name}");
    let steering = summary.steering.unwrap();
    assert_eq!((steering.consistent_share, steering.notes.len()), (1.0, 0), "{name}: {:?}", steering.notes);
    for needle in &steering.needles {
        assert!(needle.max_depth_m > 0.06 && needle.depth_m == 0.0 && needle.nodes == 0, "{name}: {needle:?}");
    }
    let [least, most] = steering.angles_deg;
    assert!(least > 10.3 && most < 160.0, "{name}: {least} to {most} degrees");
    steering
}

#[test]
fn prostate_flexible() {
    assert_eq!(run_through("prostate-flexible").seeds.len(), 3);
    run_through("prostate-flexible-vigorous");
}

#[test]
fn prostate_flexible_slow() {
    assert_eq!(run_through("prostate-flexible-slow").seeds.len(), 3);
}

#[test]
fn prostate_stiff() {
    for name in ["prostate-stiff", "prostate-stiff-vigorous"] {
        assert_eq!(run_through(name).seeds.len(), 3, "{name}");
    }
}

#[test]
fn prostate_stiff_slow() {
    assert_eq!(run_through("prostate-stiff-slow").seeds.len(), 3);
}

/// Figure 8 of Chentanez et al. (2009): past both cylinders to the target, whatever the pace.
#[test]
fn two_cylinders() {
    for name in ["two-cylinders", "two-cylinders-slow", "two-cylinders-vigorous"] {
        let steering = run_through(name);
        let target = steering.markers.iter().find(|marker| marker.name == "target").unwrap();
        let closest = target.closest_tip_m.unwrap();
        assert!(closest < 2e-3, "{name}: the tip came within {closest} m of the target");
        let clearance = steering.clearance_m.unwrap();
        assert!(clearance > 0.0, "{name}: the shaft came to {clearance} m from a cylinder");
    }
}

#[test]
fn gel() {
    for name in ["gel-single-bend", "gel-double-bend", "gel-double-bend-vigorous", "gel-vigorous"] {
        run_through(name);
    }
}

/// Fields of pressure that alternate over the mesh must not push the needle about.
#[test]
fn gel_that_is_all_but_incompressible() {
    run_set("gel-single-bend", &["material.poisson=0.499999".to_owned()]);
}

#[test]
fn gel_slow() {
    run_through("gel-single-bend-slow");
    run_through("gel-double-bend-slow");
}

#[test]
fn two_needles() {
    for name in ["two-needles", "two-needles-slow", "two-needles-vigorous"] {
        assert_eq!(run_through(name).needles.len(), 2);
    }
}
