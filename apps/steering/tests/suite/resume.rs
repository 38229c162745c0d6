//! A run cut in two has the bits of one in a piece.

use crate::support::{GEL, bits, go_on, open, start};
use stylet_tissue::Scenario;
use stylet_tissue::state::Saved;

/// Cut before the entry, on the way in, while held, on the way out and after it.
#[test]
fn a_run_goes_on_where_it_was_left() {
    for text in [GEL.to_owned(), format!("{GEL}[time]\nlazy = 0.02\n")] {
        let mut whole = start(&text, 1);
        let mut saved: Vec<(usize, Saved)> = Vec::new();
        let mut rows = Vec::new();
        for step in 0..80 {
            if [0, 9, 33, 42, 57, 66, 78].contains(&step) {
                saved.push((step, whole.save().unwrap()));
            }
            rows.extend(go_on(whole.as_mut(), 1));
        }
        let summary = whole.summary(&[]).steering.unwrap();
        for (step, saved) in &saved {
            let mut rest = open(&text).resume(saved, 1).unwrap();
            assert_eq!(rest.steps(), *step);
            for (found, expected) in go_on(rest.as_mut(), usize::MAX).iter().zip(&rows[*step..]) {
                assert_eq!(bits(found), bits(expected), "cut at step {step}");
            }
            assert!(rest.displacement().iter().zip(whole.displacement()).all(|(x, y)| x.to_bits() == y.to_bits()));
            let again = rest.summary(&[]).steering.unwrap();
            assert_eq!(
                (again.markers, again.seeds, again.needles),
                (summary.markers.clone(), summary.seeds.clone(), summary.needles.clone())
            );
        }
    }
}

#[test]
fn a_state_of_another_scene_is_refused() {
    let saved = start(GEL, 1).save().unwrap();
    let other = open(&GEL.replace("cutting = 0.2", "cutting = 0.3"));
    let reason = other.resume(&saved, 1).err().unwrap().to_string();
    assert!(reason.contains("found the state of a scene with friction.cutting = 0.2, expected 0.3"), "{reason}");
}
