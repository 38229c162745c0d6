// What both readers promise, and what then holds of writers, checks and solids. Included by each target.

use stylet_anatomy::{Problem, Study, json, rt};
use stylet_mesh::generate::{
    contours::{ContourSettings, Drawing},
    implicit::Implicit,
};

/// Solids are made of what has at most this many points: more is slow, not different.
const FEW: usize = 400;

fn check(reading: Result<Study, Problem>) {
    match reading {
        Ok(study) => {
            again(&study.drawings);
            solids(&study);
        }
        // Showing an error must not fail either.
        Err(problem) => assert!(!problem.to_string().is_empty()),
    }
}

/// What can be written is read again as the same; once read, to the bit.
fn again(drawings: &[Drawing]) {
    let Ok(bytes) = json::write(drawings) else { return };
    let once = json::read(&bytes).expect("what was written can be read").drawings;
    // Beyond this nanometres are no whole numbers, and decimal strings too short.
    if drawings.iter().any(|d| d.contours.iter().any(|c| c.points.iter().flatten().any(|x| x.abs() > 900.0))) {
        return;
    }
    let bytes = json::write(&once).expect("what was read can be written");
    assert_eq!(json::read(&bytes).expect("twice").drawings, once);
    // Contours without points have no place in DICOM, nor have organs without contours.
    let whole = |d: &Drawing| !d.contours.is_empty() && d.contours.iter().all(|c| !c.points.is_empty());
    if let Ok(bytes) = rt::write(drawings, "fuzz")
        && !drawings.is_empty()
        && drawings.iter().all(whole)
    {
        assert_eq!(rt::read(&bytes).expect("what was written can be read").drawings, once);
    }
}

/// Whatever passes the checks makes solids that are numbers everywhere.
fn solids(study: &Study) {
    let settings = ContourSettings { thickness: Some(0.005), ..ContourSettings::default() };
    let points: usize = study.drawings.iter().flat_map(|d| &d.contours).map(|c| c.points.len()).sum();
    let (set, repairs) = match study.check(&settings) {
        Ok(found) => found,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    repairs.iter().for_each(|repair| assert!(!repair.to_string().is_empty()));
    if points > FEW {
        return;
    }
    for (organ, solid) in set.organs().iter().zip(set.solids()) {
        assert!(organ.volume() >= 0.0);
        let [low, high] = solid.bounds().expect("it has an end");
        for i in 0..27 {
            let at = [i % 3, i / 3 % 3, i / 9].map(|n| f64::from(n) / 2.0);
            let p = std::array::from_fn(|k| low[k] + at[k] * (high[k] - low[k]));
            assert!(solid.distance(&p).is_finite(), "{p:?}");
        }
    }
}
