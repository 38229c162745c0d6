//! A needle that has come out leaves nothing behind, and a needle at rest changes nothing.

use stylet_needle::builtin;
use stylet_needle::history::depth_and_force;
use stylet_needle::insertion::Insertion;
use stylet_needle::shaft::ShaftFriction;
use stylet_needle::slab::Slab;
use stylet_needle::stages::Stages;
use stylet_needle::surface::Surface;
use stylet_physics::friction::{FrictionState, Law};
use stylet_physics::material::{Linear, PlaneStress};
use stylet_tests::start;

/// In to 70 mm, a pause long enough to settle, and out.
const MOTION: &str = "needle.motion=[{depth=0.07, insert=0.07}, {depth=0.14, insert=0.07}, {depth=0.22, insert=-0.01}]";

#[test]
fn insert_pause_and_withdraw_leaves_a_slab_at_rest() {
    for rearrange in ["once", "settle"] {
        let rearrange = format!("needle.rearrange={rearrange}");
        let keys = [MOTION, "solver.tolerance=1e-8", "needle.speed=0.3", "friction.restick=0.02", &rearrange];
        let mut run = start("slab2d-insertion", &keys, 1).unwrap();
        let (mut peak, mut most, mut least) = (0.0f64, f64::NEG_INFINITY, f64::INFINITY);
        let mut paused_at: Option<Vec<f64>> = None;
        let mut idle = 0;
        while !run.finished() {
            let row = run.step().unwrap();
            peak = peak.max(run.strain_energy());
            let (depth, force) = depth_and_force::<2>(&row);
            most = most.max(force[0]);
            least = least.min(force[0]);
            if (depth - 0.07).abs() < 1e-12 {
                let here = run.displacement().to_vec();
                idle = if paused_at.as_ref() == Some(&here) { idle + 1 } else { 0 };
                paused_at = Some(here);
            }
        }
        let summary = run.summary(&[]);
        let case = format!("{rearrange}: peak {peak} J, force {least} to {most} N, {summary:?}");
        // The last cycles of the pause: bit for bit the same.
        assert!(idle >= 5, "{idle} idle cycles, {case}");
        assert!(summary.converged && summary.needle.unwrap().nodes == 0, "{case}");
        assert!(run.strain_energy() < 1e-6 * peak, "{case}");
        // The needle is pushed in and pulled out.
        assert!(most > 2.5 && least < -2.5, "{case}");
    }
}

/// With equal static and dynamic limits a settled state is one of Coulomb friction: sticking nodes bear no more than their
/// limit, slipping ones just their limit against the sliding, and all together no more than the whole density.
#[test]
fn settled_states_of_equal_limits_obey_coulomb() {
    let keys = ["needle.rearrange=settle", "friction.static_ratio=1.0", "solver.tolerance=1e-8", "needle.speed=0.5"];
    let scene = builtin::open("slab2d-insertion", &keys.map(str::to_owned)).unwrap();
    let (stage, friction) = (scene.needle.clone().unwrap(), scene.friction.clone().unwrap());
    let material = PlaneStress::new(Linear::from_young_poisson(34e3, 0.34).unwrap());
    let mut stages = Stages::default();
    let slab = Slab::<2, 3, _>::new(&scene, material, 1, &mut stages).unwrap();
    let mut insertion = Insertion::new(&scene, &stage, &friction, slab).unwrap();
    let density = stage.line_density().unwrap();
    let law = Law { restick: friction.restick, reversal: 0.0 };
    let limits = ShaftFriction {
        density: density.clone(),
        static_ratio: 1.0,
        law,
        surface: Surface { radius: 0.0, reach: 1.0 },
    };
    let mut settled = 0;
    while !insertion.finished() {
        insertion.cycle(&mut stages).unwrap();
        if !insertion.settled() {
            continue;
        }
        settled += 1;
        let shaft = &insertion.shaft;
        let total: f64 = (0..shaft.nodes.len()).map(|index| shaft.limits(index, &limits).sliding).sum();
        for (index, node) in shaft.nodes.iter().enumerate() {
            let limit = shaft.limits(index, &limits).sliding;
            let force = node.force[0];
            let case = format!(
                "position {settled}, node {index} of {}: {force} N, limit {limit} N, {node:?}",
                shaft.nodes.len()
            );
            match node.state {
                FrictionState::Stick => assert!(force.abs() <= limit * (1.0 + 1e-5) + 1e-9, "{case}"),
                FrictionState::Slip(direction) => {
                    // Settled to 1e-4 of all friction.
                    assert!((force - direction.sign() * limit).abs() <= 1.1e-4 * total + 1e-8, "{case}");
                    // Friction opposes the sliding. Near the tip, tissue that springs back can overtake the needle.
                    let sliding = node.place.behind - node.behind_before;
                    assert!(sliding * direction.sign() >= 0.0 || insertion.needle.pose().insert == 0.07, "{case}");
                }
            }
        }
        let force = insertion.held_by().force;
        assert!(force[0] <= density.total(insertion.needle.pose().insert) + 1e-3, "{force:?} at position {settled}");
    }
    let slipping = insertion.shaft.nodes.iter().filter(|node| !node.sticks()).count();
    let force = insertion.held_by().force;
    assert!(settled > 80, "{settled} settled positions");
    assert!(2 * slipping > insertion.shaft.nodes.len(), "{slipping} of {} slip", insertion.shaft.nodes.len());
    assert!((2.5..3.195).contains(&force[0]), "{force:?}");
}
