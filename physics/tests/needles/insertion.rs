//! Needles pushed into a block, held, turned and withdrawn.

use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{CellId, VertexId};
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::coupling::{CoupledSettings, CouplingMethod, SearchSettings, SlipState};
use stylet_physics::dynamics::DynamicsSettings;
use stylet_physics::insertion::{
    BaseMotion, Insertion, InsertionError, InsertionReport, NeedleSettings, UniformInteraction,
};
use stylet_physics::material::FixedCorotated;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

pub type Block = Insertion<FixedCorotated>;

pub const SIDE: f64 = 0.06;

/// A block of gel of 6 cm, held everywhere but where the needle comes in.
#[derive(Clone, Copy)]
pub struct SetUp {
    pub cells: usize,
    pub young: f64,
    pub dt: f64,
    pub tolerance: f64,
    pub method: CouplingMethod,
    pub interaction: UniformInteraction,
    pub threads: usize,
    pub implicit_twist: bool,
}

impl SetUp {
    pub fn new() -> Self {
        Self {
            cells: 5,
            young: 15e3,
            dt: 0.02,
            tolerance: 1e-5,
            method: CouplingMethod::NullSpace,
            interaction: UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 },
            threads: 1,
            implicit_twist: false,
        }
    }

    pub fn build(&self) -> Block {
        let n = self.cells;
        let mesh = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [n, n, n]).unwrap();
        let mut body = Body::new(&mesh, FixedCorotated::from_young_poisson(self.young, 0.45).unwrap(), 1.0).unwrap();
        body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
        let mut w = Subspace::new(mesh.n_vertex_slots());
        for (node, x) in mesh.points().iter().enumerate() {
            let held = x[0] > SIDE - 1e-9 || (1..3).any(|k| x[k] < 1e-9 || x[k] > SIDE - 1e-9);
            if held {
                w.set(node, Constraint::Fixed).unwrap();
            }
        }
        let mut dynamics = DynamicsSettings::new(self.dt);
        dynamics.damping.stiffness = 0.01;
        let settings = CoupledSettings {
            dynamics,
            search: SearchSettings {
                solve_tolerance: self.tolerance,
                check_tolerance: self.tolerance.max(1e-3),
                ..SearchSettings::default()
            },
            coupling: self.method,
            implicit_twist: self.implicit_twist,
            ..CoupledSettings::new(self.dt, 0.2 * SIDE / n as f64)
        };
        let team = if self.threads == 1 { Team::serial() } else { Team::new(self.threads) };
        body.set_team(&team);
        Insertion::new(mesh, body, w, settings, self.interaction, [0.0; 3], &team).unwrap()
    }
}

/// A wire 2 mm before the skin.
pub fn wire(y: f64, z: f64) -> NeedleSettings {
    NeedleSettings::nitinol([-0.102, y, z], [1.0, 0.0, 0.0]).unwrap()
}

pub fn push(block: &mut Block, speed: f64, dt: f64, steps: usize) -> InsertionReport {
    turn(block, BaseMotion { insert: speed, ..BaseMotion::default() }, dt, steps)
}

pub fn turn(block: &mut Block, motion: BaseMotion, dt: f64, steps: usize) -> InsertionReport {
    let mut last = InsertionReport::default();
    for _ in 0..steps {
        last = block.step(&[motion], dt).unwrap();
        assert_eq!(last.consistent, last.substeps, "friction states of step {}", block.state().step);
    }
    last
}

fn states(block: &Block) -> Vec<SlipState> {
    block.needles()[0].nodes().iter().map(|node| node.state).collect()
}

/// The base bears the friction along the shaft and the force at the tip; the published sum of friction, cutting and viscosity.
#[test]
fn a_slow_needle_is_in_axial_equilibrium() {
    let set_up = SetUp::new();
    let mut block = set_up.build();
    block.add_needle(wire(0.031, 0.0287)).unwrap();
    push(&mut block, 0.01, 0.02, 200);
    let needle = &block.needles()[0];
    let friction: f64 = needle.forces.iter().sum();
    // The limits of that step are those of the length that the needle had before it.
    let drag: f64 = needle.nodes().iter().zip(&needle.slips).map(|(node, slip)| node.drag * slip / 0.02).sum();
    assert!(needle.nodes().len() >= 3 && states(&block).iter().all(|&state| state == SlipState::Forward));
    let base = needle.base_force[0];
    println!("base {base} N, friction {friction} N, drag {drag} N, depth {} m", needle.depth());
    assert!((base - friction - drag).abs() < 5e-3 * base, "{base} against {friction} + {drag}");
    let depth = needle.depth();
    let expected = 0.2 + 12.0 * depth + 200.0 * 0.01 * depth;
    assert!((base - expected).abs() < 0.02 * expected, "{base} against {expected}");
    // Withdrawn it has no tip force.
    push(&mut block, -0.01, 0.02, 60);
    let needle = &block.needles()[0];
    let (base, depth) = (needle.base_force[0], needle.depth());
    let expected = -(12.0 * depth + 200.0 * 0.01 * depth);
    assert!(states(&block).iter().all(|&state| state == SlipState::Backward));
    assert!((base - expected).abs() < 0.03 * expected.abs(), "{base} against {expected}");
}

/// How far the needle has slid past each of its nodes: where the node is along the needle, from the tip.
fn places(block: &Block) -> Vec<(u32, f64)> {
    let needle = &block.needles()[0];
    let (entry, lengths) = (needle.shaft.entry(), needle.shaft.rod.rest_lengths());
    let along = |k: usize| lengths[entry + k..].iter().sum();
    needle.nodes().iter().enumerate().map(|(k, node)| (node.vertex, along(k))).collect()
}

/// Needle and tissue do not creep, held still and pulled below the limit.
#[test]
fn sticking_is_exact() {
    let mut block = SetUp { cells: 3, ..SetUp::new() }.build();
    block.add_needle(wire(0.031, 0.0287)).unwrap();
    push(&mut block, 0.02, 0.02, 60);
    for pull in [0.0, -2e-4] {
        turn(&mut block, BaseMotion { insert: pull, ..BaseMotion::default() }, 0.02, 1);
        push(&mut block, 0.0, 0.02, 1000);
        assert!(states(&block).iter().all(|&state| state == SlipState::Static), "{:?}", states(&block));
        let before = places(&block);
        let mut slid = 0.0_f64;
        for _ in 0..10_000 {
            block.step(&[BaseMotion::default()], 0.02).unwrap();
            slid += block.needles()[0].slips.iter().map(|slip| slip.abs()).fold(0.0, f64::max);
        }
        let after = places(&block);
        assert_eq!(slid, 0.0);
        for ((vertex, from), (other, to)) in before.into_iter().zip(after) {
            assert_eq!(vertex, other);
            assert!((from - to).abs() < 1e-9, "{from} {to}");
        }
    }
}

type Topology = (Vec<(CellId, [VertexId; 4])>, Vec<[f64; 3]>);

fn topology(block: &Block) -> Topology {
    let mesh = block.mesh();
    let cells = mesh.cells().map(|cell| (cell, mesh.cell(cell))).collect();
    (cells, mesh.vertices().map(|v| mesh.point(v)).collect())
}

/// In and out, with a bevel, several times: the mesh is the one that it was, and the block comes to rest.
#[test]
fn withdrawal_restores_the_mesh() {
    let mut block = SetUp::new().build();
    let before = topology(&block);
    let volume = block.mesh().total_volume();
    block.add_needle(NeedleSettings { bevel: 0.1, ..wire(0.031, 0.0287) }).unwrap();
    for cycle in 0..3 {
        let (mut smallest, mut largest) = (180.0_f64, 0.0_f64);
        for step in 0..120 {
            push(&mut block, 0.02, 0.02, 1);
            let mesh = block.mesh().clone();
            let (low, high) = block.remesher().angles_deg(&mesh);
            if step >= 26 {
                (smallest, largest) = (smallest.min(low), largest.max(high));
            }
            assert!((block.mesh().total_volume() - volume).abs() < 1e-12 * volume);
        }
        println!("cycle {cycle}: {smallest:.2} to {largest:.2} degrees");
        assert!(smallest >= 10.3 && largest <= 160.0, "{smallest} to {largest} degrees");
        let u = block.state().u.clone();
        assert!(block.body().smallest_jacobian(&u).unwrap().1 > 0.0);
        push(&mut block, 0.0, 0.02, 10);
        push(&mut block, -0.02, 0.02, 125);
        assert!(!block.needles()[0].is_inside());
        assert!(topology(&block) == before, "the mesh differs after withdrawal {cycle}");
    }
    push(&mut block, 0.0, 0.02, 300);
    assert!(block.state().u.iter().all(|u| u.abs() < 1e-6));
}

/// Four methods for the same coupled system agree within what they were asked for.
#[test]
fn four_methods_agree() {
    let tip = |method| {
        let mut block = SetUp { method, tolerance: 1e-9, ..SetUp::new() }.build();
        block.add_needle(NeedleSettings { bevel: 0.1, ..wire(0.031, 0.0287) }).unwrap();
        push(&mut block, 0.02, 0.02, 30);
        let needle = &block.needles()[0];
        (needle.shaft.tip(), needle.base_force)
    };
    let (tip0, force0) = tip(CouplingMethod::NullSpace);
    for method in [CouplingMethod::KktCg, CouplingMethod::KktMinres, CouplingMethod::ConstraintPreconditioned] {
        let (tip, force) = tip(method);
        for k in 0..3 {
            assert!((tip[k] - tip0[k]).abs() < 1e-7, "{method:?}: {tip:?} against {tip0:?}");
            assert!((force[k] - force0[k]).abs() < 1e-4, "{method:?}: {force:?} against {force0:?}");
        }
    }
}

/// 1, 2 and 8 threads.
#[test]
fn bits_do_not_depend_on_threads() {
    let run = |threads| {
        let mut block = SetUp { cells: 9, threads, ..SetUp::new() }.build();
        block.add_needle(NeedleSettings { bevel: 0.1, ..wire(0.031, 0.0287) }).unwrap();
        push(&mut block, 0.02, 0.02, 40);
        push(&mut block, -0.02, 0.02, 10);
        let needle = &block.needles()[0];
        (block.state().u.clone(), needle.shaft.x.clone(), needle.forces.clone())
    };
    let one = run(1);
    assert!(one == run(2) && one == run(8));
}

/// A symmetric tip goes straight where nothing bends it; a bevel bends it, the other way when it is turned.
#[test]
fn a_bevel_steers_and_a_symmetric_tip_does_not() {
    let none = UniformInteraction::default();
    let end = |bevel: f64, angle: f64, interaction| {
        let mut block = SetUp { interaction, ..SetUp::new() }.build();
        block.add_needle(NeedleSettings { bevel, ..wire(0.03, 0.03) }).unwrap();
        turn(&mut block, BaseMotion { spin: angle, ..BaseMotion::default() }, 1.0, 1);
        push(&mut block, 0.02, 0.02, 120);
        block.needles()[0].shaft.tip()
    };
    let straight = end(0.0, 0.0, none);
    assert!((1..3).all(|k| (straight[k] - 0.03).abs() < 1e-3 * 0.046), "{straight:?}");
    let full = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 };
    let (up, down) = (end(0.1, 0.0, full), end(0.1, std::f64::consts::PI, full));
    let (right, plain) = (end(0.1, -std::f64::consts::FRAC_PI_2, full), end(0.0, 0.0, full));
    println!("up {up:?} down {down:?} right {right:?} plain {plain:?}");
    let (rise, fall) = (up[2] - plain[2], plain[2] - down[2]);
    assert!(rise > 2e-3 && (rise - fall).abs() < 0.15 * rise, "{rise} and {fall}");
    assert!((right[1] - plain[1] - rise).abs() < 0.2 * rise, "{right:?}");
}

/// Without friction a straight needle slides without force; what cannot be cut is dragged along.
#[test]
fn extreme_friction() {
    let mut block = SetUp { interaction: UniformInteraction::default(), ..SetUp::new() }.build();
    block.add_needle(wire(0.03, 0.03)).unwrap();
    push(&mut block, 0.02, 0.02, 100);
    let needle = &block.needles()[0];
    assert!(needle.depth() > 0.037, "{}", needle.depth());
    assert!(needle.base_force[0].abs() < 1e-6, "{:?}", needle.base_force);
    let hard = UniformInteraction { friction: 1e9, viscosity: 0.0, cutting: 1e9 };
    let mut block = SetUp { interaction: hard, ..SetUp::new() }.build();
    block.add_needle(wire(0.03, 0.03)).unwrap();
    let report = push(&mut block, 0.005, 0.02, 60);
    assert!(report.trials <= 10);
    let needle = &block.needles()[0];
    assert!(needle.depth() == 0.0 && needle.is_inside());
    assert!(needle.shaft.tip()[0] > 3.5e-3, "{:?}", needle.shaft.tip());
}

/// A skin that takes a newton to cut is dented, cut and recoils: at any step the needle goes on from there, as far.
#[test]
fn short_steps_go_where_long_ones_do() {
    let mut places = Vec::new();
    for (dt, steps) in [(0.02, 75), (0.005, 300), (0.002, 750), (0.001, 1500)] {
        let interaction = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 1.0 };
        let mut block = SetUp { interaction, dt, ..SetUp::new() }.build();
        // So short that it does not buckle before the skin.
        let needle = NeedleSettings { base: [-0.032, 0.0303, 0.0298], length: 0.03, ..wire(0.0303, 0.0298) };
        block.add_needle(needle).unwrap();
        push(&mut block, 0.02, dt, steps);
        assert!(block.needles()[0].depth() > 0.015, "{dt}: {}", block.needles()[0].depth());
        let (least, largest) = block.remeshed_angles_deg();
        assert!(least > 8.0 && largest < 165.0, "{dt}: {least} to {largest}");
        places.push((dt, block.needles()[0].depth(), block.needles()[0].shaft.tip()));
    }
    let (_, depth, tip) = places[3];
    for (dt, other, place) in &places {
        assert!((other - depth).abs() < 1.5e-3, "{dt}: {other} {depth}");
        assert!((0..3).all(|k| (place[k] - tip[k]).abs() < 1e-3), "{dt}: {place:?} {tip:?}");
    }
}

/// Steps so short that little changes in each are solved to a part of the forces, not of what changes: that is enough.
#[test]
fn short_steps_are_solved_to_the_forces() {
    let run = |tolerance: f64| {
        let mut block = SetUp { dt: 1e-3, tolerance, ..SetUp::new() }.build();
        block.add_needle(wire(0.0303, 0.0298)).unwrap();
        let mut iterations = 0;
        let mut forces = Vec::new();
        for _ in 0..1500 {
            let step = block.step(&[BaseMotion { insert: 0.02, ..BaseMotion::default() }], 1e-3).unwrap();
            assert_eq!(step.consistent, step.substeps);
            iterations += step.iterations;
            forces.push(block.needles()[0].base_force[0]);
        }
        (block.needles()[0].shaft.tip(), forces, iterations)
    };
    let ((tip, forces, iterations), (exact_tip, exact, all)) = (run(1e-5), run(1e-10));
    let largest = exact.iter().fold(0.0_f64, |max, f| max.max(f.abs()));
    let apart = forces.iter().zip(&exact).map(|(f, g)| (f - g).abs()).fold(0.0, f64::max);
    println!("forces {apart:e} of {largest} N apart, tips {tip:?} {exact_tip:?}, iterations {iterations} of {all}");
    assert!(apart < 2e-5 * largest, "{apart} {largest}");
    assert!((0..3).all(|k| (tip[k] - exact_tip[k]).abs() < 1e-8), "{tip:?} {exact_tip:?}");
    // A handful of iterations a step: the guess and the forces leave no more.
    assert!(iterations < 1500 * 6 && iterations < all / 3, "{iterations} {all}");
}

/// A needle at rest in gel with a dent in it comes to stick all along, and stays where it is, whatever the step.
#[test]
fn held_needles_stick_at_any_step() {
    for (dt, insert, settle) in [(0.02, 100, 300), (0.002, 1000, 3000)] {
        let mut block = SetUp { dt, ..SetUp::new() }.build();
        block.add_needle(wire(0.0303, 0.0298)).unwrap();
        push(&mut block, 0.02, dt, insert);
        push(&mut block, 0.0, dt, settle);
        let before = places(&block);
        for _ in 0..300 {
            block.step(&[BaseMotion::default()], dt).unwrap();
            // A node whose force is just at its limit may count as one that slips, but does not.
            let slips = &block.needles()[0].slips;
            assert!(slips.iter().all(|slip| slip.abs() < 1e-12), "{dt}: {:?} {slips:?}", states(&block));
        }
        assert!(before.iter().zip(places(&block)).all(|((_, from), (_, to))| (from - to).abs() < 1e-9));
    }
}

/// A bevel that goes round many times in each step cuts every way, and the needle goes straight.
#[test]
fn fast_spins_are_not_taken_for_none() {
    let motion = BaseMotion { insert: 0.02, spin: 100.0 * std::f64::consts::PI, ..BaseMotion::default() };
    let mut block = SetUp::new().build();
    let bevelled = NeedleSettings { bevel: 0.2, bevel_direction: [0.0, 1.0, 0.0], ..wire(0.0303, 0.0298) };
    block.add_needle(bevelled.clone()).unwrap();
    turn(&mut block, motion, 0.02, 90);
    let tip = block.needles()[0].shaft.tip();
    assert!(tip[0] > 0.02 && (tip[1] - 0.0303).hypot(tip[2] - 0.0298) < 3e-4, "{tip:?}");
    let mut block = SetUp::new().build();
    block.add_needle(bevelled).unwrap();
    let error = block.step(&[BaseMotion { spin: 1e300, ..motion }], 0.02).unwrap_err();
    assert!(error.to_string().contains("the spin"), "{error}");
}

/// A bent needle that has left the tissue is straight at once, on its axis and without a moment at its base, while it is
/// drawn on.
#[test]
fn withdrawn_needles_are_straight() {
    let mut block = SetUp::new().build();
    block.add_needle(NeedleSettings { bevel: 0.2, bevel_direction: [0.0, 1.0, 0.0], ..wire(0.0303, 0.0298) }).unwrap();
    push(&mut block, 0.02, 0.02, 90);
    assert!((block.needles()[0].shaft.tip()[1] - 0.0303).abs() > 1e-3);
    push(&mut block, -0.02, 0.02, 100);
    let needle = &block.needles()[0];
    let off = (needle.shaft.tip()[1] - 0.0303).hypot(needle.shaft.tip()[2] - 0.0298);
    let moment = needle.base_moment.iter().map(|m| m * m).sum::<f64>().sqrt();
    println!("{off:e} m off its axis, {moment:e} N m, {} nodes", needle.shaft.n_nodes());
    assert!(needle.nodes().is_empty() && needle.shaft.tip()[0] < -1e-3);
    assert!(off < 1e-8 && moment < 1e-8, "{off} {moment}");
}

/// Friction that no tissue bears tears it along; where that cannot go on the run ends, and the needle is where it was.
#[test]
fn absurd_friction_throws_no_needle() {
    for friction in [1e4, 1e6] {
        let interaction = UniformInteraction { friction, viscosity: 200.0, cutting: 0.2 };
        let mut block = SetUp { interaction, ..SetUp::new() }.build();
        block.add_needle(wire(0.0303, 0.0298)).unwrap();
        for motion in [0.02, -0.02].map(|insert| BaseMotion { insert, ..BaseMotion::default() }) {
            let made = (0..110).try_for_each(|_| block.step(&[motion], 0.02).map(|_| ()));
            let shaft = &block.needles()[0].shaft;
            assert!(shaft.x.iter().all(|x| x.abs() < 0.5), "{friction}: {:?}", shaft.x);
            match made {
                Ok(()) => {}
                Err(InsertionError::Failed { .. } | InsertionError::Remesh { .. }) => break,
                Err(error) => panic!("{friction}: {error}"),
            }
        }
    }
}

/// Fast needles, long steps, reversals: no blow-up, and the needle keeps its length.
#[test]
fn vigorous_motion_stays_bounded() {
    for (speed, dt) in [(0.2, 0.02), (1.0, 0.01), (5.0, 0.002), (0.02, 0.2), (0.02, 2e-3)] {
        let mut block = SetUp { cells: 4, dt, ..SetUp::new() }.build();
        block.add_needle(NeedleSettings { bevel: 0.1, ..wire(0.031, 0.0287) }).unwrap();
        let steps = (0.045 / (speed * dt)).ceil() as usize;
        let mut speeds = vec![speed; steps];
        speeds.extend([-speed, speed, -speed, speed].iter().flat_map(|&v| std::iter::repeat_n(v, steps.div_ceil(6))));
        for speed in speeds {
            let report = block.step(&[BaseMotion { insert: speed, ..BaseMotion::default() }], dt).unwrap();
            assert_eq!(report.consistent, report.substeps);
            let shaft = &block.needles()[0].shaft;
            let rest: f64 = shaft.rod.rest_lengths().iter().sum();
            let long: f64 = (1..shaft.n_nodes())
                .map(|i| (0..3).map(|k| (shaft.x[3 * i + k] - shaft.x[3 * i - 3 + k]).powi(2)).sum::<f64>().sqrt())
                .sum();
            assert!((long / rest - 1.0).abs() < 0.01, "{speed} m/s, {dt} s: {long} of {rest}");
            assert!(block.state().u.iter().all(|u| u.abs() < SIDE));
        }
    }
}

/// What cannot be set up, or goes on where nothing is: errors.
#[test]
fn bad_needles_are_refused() {
    let mut block = SetUp { cells: 3, ..SetUp::new() }.build();
    let inside = block.add_needle(NeedleSettings::nitinol([0.0, 0.03, 0.03], [1.0, 0.0, 0.0]).unwrap());
    assert!(matches!(inside, Err(InsertionError::StartsInside { .. })), "{inside:?}");
    for settings in [
        NeedleSettings { length: f64::NAN, ..wire(0.03, 0.03) },
        NeedleSettings { edge: 0.0, ..wire(0.03, 0.03) },
        NeedleSettings { direction: [0.0; 3], ..wire(0.03, 0.03) },
        NeedleSettings { bevel: 2.0, ..wire(0.03, 0.03) },
        NeedleSettings { damping: -1.0, ..wire(0.03, 0.03) },
        NeedleSettings { bevel_direction: [1.0, 0.0, 0.0], ..wire(0.03, 0.03) },
    ] {
        let refused = block.add_needle(settings);
        assert!(matches!(refused, Err(InsertionError::Setting { .. })), "{refused:?}");
    }
    block.add_needle(wire(0.03, 0.03)).unwrap();
    let pulled = (0..60).find_map(|_| block.step(&[BaseMotion { insert: -0.1, ..BaseMotion::default() }], 0.02).err());
    assert!(
        matches!(pulled, Some(InsertionError::InSleeve { .. } | InsertionError::SleeveAtSkin { .. })),
        "{pulled:?}"
    );
    let mut block = SetUp { cells: 3, ..SetUp::new() }.build();
    block.add_needle(wire(0.03, 0.03)).unwrap();
    let out = (0..300).find_map(|_| block.step(&[BaseMotion { insert: 0.02, ..BaseMotion::default() }], 0.02).err());
    assert!(matches!(out, Some(InsertionError::LeftTissue { .. })), "{out:?}");
}
