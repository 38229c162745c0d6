//! A neo-Hookean slab takes a needle at any speed: where a whole stride of the base would turn a triangle inside out, the
//! base goes part of it, and friction states change before it goes on.

use stylet_tests::{finish, start};

#[test]
fn settled_neo_hookean_insertions_end_alike_at_any_speed() {
    let mut tips = Vec::new();
    for (speed, h_ref) in [(0.3, 6), (1.0, 6), (3.0, 6), (1.0, 7), (3.0, 7)] {
        let keys = [
            "material.model=neo-hookean".to_owned(),
            "needle.rearrange=settle".to_owned(),
            "solver.preconditioner=block-jacobi".to_owned(),
            "solver.tolerance=1e-4".to_owned(),
            "needle.depth=0.03".to_owned(),
            format!("needle.speed={speed}"),
            format!("mesh.h_ref={h_ref}"),
        ];
        let mut run = start("slab2d-insertion", &keys.each_ref().map(String::as_str), 1).unwrap();
        finish(&mut *run).unwrap_or_else(|error| panic!("speed {speed}, h{h_ref}: {error}"));
        let summary = run.summary(&[]);
        let needle = summary.needle.clone().unwrap();
        assert!(summary.converged && summary.quality.inverted_elements == 0, "{summary:?}");
        assert_eq!(needle.tip, [0.03, 0.05]);
        // Between the dynamic and the static limit of the shaft in the tissue.
        assert!((1.2..2.8).contains(&needle.base_force[0]), "speed {speed}, h{h_ref}: {needle:?}");
        tips.push(needle.tip_reference[0]);
    }
    let (least, most) = tips.iter().fold((f64::MAX, f64::MIN), |(a, b), &t| (a.min(t), b.max(t)));
    assert!(most - least < 1.5e-3, "tips in the body: {tips:?}");
}
