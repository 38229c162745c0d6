//! Needles that are bent by nature: at rest, turned, and in tissue.

use crate::insertion::{Block, SIDE, SetUp, push, turn, wire};
use std::f64::consts::{FRAC_PI_2, PI};
use stylet_physics::insertion::{BaseMotion, InsertionError, NaturalBend, NeedleSettings, UniformInteraction};

const DT: f64 = 0.02;

fn bent(curvature: f64, length: f64) -> NeedleSettings {
    NeedleSettings { bend: Some(NaturalBend { curvature, length }), ..wire(0.0303, 0.0298) }
}

fn spin(block: &mut Block, angle: f64, steps: usize) {
    let motion = BaseMotion { spin: angle / (steps as f64 * DT), ..BaseMotion::default() };
    turn(block, motion, DT, steps);
}

/// Far from the tissue it is an arc of a circle, and its base carries it round.
#[test]
fn a_free_needle_is_an_arc_that_turns_with_its_base() {
    let (kappa, length) = (8.0, 0.1);
    let mut needle = bent(kappa, 1.0);
    needle.base[0] -= 0.05;
    needle.damping = 0.05;
    for implicit_twist in [false, true] {
        let mut block = SetUp { implicit_twist, ..SetUp::new() }.build();
        block.add_needle(needle.clone()).unwrap();
        let start = block.needles()[0].shaft.x.clone();
        let tip = block.needles()[0].shaft.tip();
        let arc = [(kappa * length).sin() / kappa, (1.0 - (kappa * length).cos()) / kappa];
        // Bent at nodes, half an edge early: the chord of each edge is that of the circle to second order.
        assert!((tip[0] - needle.base[0] - arc[0]).abs() < 2e-3, "{tip:?} {arc:?}");
        assert!((tip[2] - needle.base[2] - arc[1]).abs() < 2e-3, "{tip:?} {arc:?}");
        push(&mut block, 0.0, DT, 20);
        let still = &block.needles()[0].shaft.x;
        assert!(still.iter().zip(&start).all(|(x, y)| (x - y).abs() < 1e-12));
        spin(&mut block, PI, 100);
        push(&mut block, 0.0, DT, 400);
        // Half a turn about the axis of the sleeve.
        let turned = &block.needles()[0].shaft.x;
        for (x, y) in turned.as_chunks::<3>().0.iter().zip(start.as_chunks::<3>().0) {
            let expected = [y[0], 2.0 * needle.base[1] - y[1], 2.0 * needle.base[2] - y[2]];
            assert!((0..3).all(|k| (x[k] - expected[k]).abs() < 1e-5), "{x:?} {expected:?}, implicit {implicit_twist}");
        }
    }
}

/// The tissue lets it go some of the way that its bend tells it to, to either side by as much in a mesh that is fine enough.
#[test]
fn a_bend_steers() {
    let across = |curvature: f64| {
        let mut block = SetUp::new().build();
        block.add_needle(bent(curvature, 0.03)).unwrap();
        push(&mut block, 0.02, DT, 110);
        block.needles()[0].shaft.tip()[2] - 0.0298
    };
    let [up, down] = [across(10.0), across(-10.0)];
    assert!(up > 2e-3 && down < -2e-3, "{up} {down}");
    assert!((up + down).abs() < 0.15 * (up - down), "{up} {down}");
}

/// A base that is turned winds a needle whose bend the tissue holds: explicit and implicit twist come to rest at one place, and
/// the torque is the derivative of the energy.
#[test]
fn a_base_winds_a_needle_that_tissue_holds() {
    let mut found = Vec::new();
    for implicit_twist in [false, true] {
        let interaction = UniformInteraction { friction: 12.0, viscosity: 0.0, cutting: 0.2 };
        let mut block = SetUp { implicit_twist, interaction, tolerance: 1e-8, ..SetUp::new() }.build();
        let needle = NeedleSettings { damping: 0.05, ..bent(10.0, 0.05) };
        block.add_needle(needle).unwrap();
        push(&mut block, 0.02, DT, 80);
        push(&mut block, 0.0, DT, 50);
        let untwisted = twist(&block);
        spin(&mut block, FRAC_PI_2, 50);
        push(&mut block, 0.0, DT, 600);
        assert!(twist(&block) > untwisted + 1e-3, "{untwisted} to {}", twist(&block));
        let shaft = &block.needles()[0].shaft;
        let rod = &mut shaft.rod.clone();
        let base = rod.angles()[0];
        let torque = rod.base_torque(&shaft.x, &shaft.director).unwrap();
        let mut energy = |angle: f64| {
            rod.settle_angles(&shaft.x, &shaft.director, Some(angle), None, None).unwrap();
            rod.energy(&shaft.x, &shaft.director)
        };
        let difference = (energy(base + 1e-4) - energy(base - 1e-4)) / 2e-4;
        assert!((torque - difference).abs() < 1e-5 * torque.abs().max(1e-6), "{torque} {difference}");
        assert!(torque > 1e-5, "{torque}");
        let along = block.needles()[0].base_moment[0];
        assert!((along - torque).abs() < 1e-3 * torque, "{along} {torque}");
        found.push((shaft.x.clone(), torque));
    }
    let [(explicit, torque), (implicit, other)] = &found[..] else { unreachable!() };
    let apart = explicit.iter().zip(implicit).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
    // Friction remembers the way, which is another one.
    assert!(apart > 0.0 && apart < 1e-4 * SIDE && (torque - other).abs() < 1e-4 * torque, "{apart} {torque} {other}");
}

/// Largest difference between angles of neighbouring edges, rad.
fn twist(block: &Block) -> f64 {
    let angles = block.needles()[0].shaft.rod.angles();
    angles.windows(2).fold(0.0, |most: f64, pair| most.max((pair[1] - pair[0]).abs()))
}

#[test]
fn bends_that_edges_cannot_follow_are_refused() {
    for (curvature, length) in [(201.0, 0.05), (f64::NAN, 0.05), (10.0, 0.0), (10.0, f64::NAN)] {
        let refused = SetUp::new().build().add_needle(bent(curvature, length));
        assert!(matches!(refused, Err(InsertionError::Setting { name, .. }) if name.starts_with("needle.bend")));
    }
}
