//! The needle in space: determinism, balance of forces, the limits of friction, withdrawal, and an exact displacement.

use stylet_mesh::{VertexId, generate};
use stylet_needle::builtin;
use stylet_needle::history::depth_and_force;
use stylet_needle::insertion::Insertion;
use stylet_needle::needle::{Needle, OnNeedle, direction};
use stylet_needle::scene::Scene;
use stylet_needle::shaft::{Shaft, ShaftFriction};
use stylet_needle::simulation::resume_cube;
use stylet_needle::slab::Slab;
use stylet_needle::stages::Stages;
use stylet_needle::state::State;
use stylet_needle::surface::Surface;
use stylet_physics::friction::{FrictionState, Law, LineDensity};
use stylet_physics::material::{Hyperelastic, Linear, NeoHookean};
use stylet_solver::subspace::Constraint;
use stylet_tests::{bits, finish, start_cube};

const NEO_HOOKEAN: &str = "material.model=neo-hookean";

fn scene(keys: &[&str]) -> Scene {
    let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    builtin::open("cube3d-insertion", &keys).unwrap()
}

fn insertion<M: Hyperelastic<3>>(scene: &Scene, material: M) -> Insertion<3, 4, M> {
    let (stage, friction) = (scene.needle.clone().unwrap(), scene.friction.clone().unwrap());
    let slab = Slab::new(scene, material, 1, &mut Stages::default()).unwrap();
    Insertion::new(scene, &stage, &friction, slab).unwrap()
}

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    for model in ["linear", "neo-hookean"] {
        let model = format!("material.model={model}");
        let run_on = |threads| {
            // More elements than one thread is given.
            let mut run =
                start_cube(&["mesh.fold=21", "needle.depth=0.014", "needle.speed=1", &model], threads).unwrap();
            finish(&mut *run).unwrap();
            (run.steps(), run.mesh().n_cells(), bits(&*run))
        };
        let one = run_on(1);
        assert!(one.1 > 4096, "{} elements", one.1);
        assert!(one == run_on(2) && one == run_on(8), "{model}");
    }
}

#[test]
fn a_resumed_run_ends_on_the_same_bits() {
    for keys in [
        ["mesh.fold=16", "needle.depth=0.02", "material.model=linear"],
        ["mesh.fold=14", "needle.depth=0.03", NEO_HOOKEAN],
    ] {
        let mut whole = start_cube(&keys, 1).unwrap();
        let mut states = Vec::new();
        while !whole.finished() {
            whole.step().unwrap();
            if [1, 9, 20].contains(&whole.steps()) {
                states.push((whole.steps(), whole.save().unwrap()));
            }
        }
        assert_eq!(states.len(), 3, "{keys:?}: {} steps", whole.steps());
        for (at, state) in states {
            let mut resumed = resume_cube(State::from_saved(&state).unwrap(), 1).unwrap();
            assert_eq!(resumed.steps(), at);
            finish(&mut *resumed).unwrap();
            assert_eq!(resumed.steps(), whole.steps(), "{keys:?} from {at}");
            assert!(bits(&*resumed) == bits(&*whole), "{keys:?} from {at}");
            assert_eq!(resumed.summary(&[]).needle, whole.summary(&[]).needle, "{keys:?} from {at}");
        }
    }
}

/// In to 40 mm, and out.
#[test]
fn a_needle_that_has_come_out_leaves_a_cube_at_rest() {
    const MOTION: &str = "needle.motion=[{depth=0.04, insert=0.04}, {depth=0.09, insert=-0.01}]";
    for model in ["linear", "neo-hookean"] {
        for rearrange in ["once", "settle"] {
            let [model, rearrange] = [format!("material.model={model}"), format!("needle.rearrange={rearrange}")];
            let keys = [MOTION, "mesh.fold=18", "solver.tolerance=1e-8", "needle.speed=0.5", &model, &rearrange];
            let mut run = start_cube(&keys, 1).unwrap();
            let (mut peak, mut most, mut least) = (0.0f64, f64::NEG_INFINITY, f64::INFINITY);
            while !run.finished() {
                let row = run.step().unwrap();
                let (_, force) = depth_and_force::<3>(&row);
                peak = peak.max(run.strain_energy());
                (most, least) = (most.max(force[0]), least.min(force[0]));
            }
            let summary = run.summary(&[]);
            let case = format!("{keys:?}: peak {peak} J, force {least} to {most} N, {summary:?}");
            assert!(summary.converged && summary.needle.unwrap().nodes == 0, "{case}");
            assert!(run.strain_energy() < 1e-9 * peak, "{} J left, {case}", run.strain_energy());
            assert!(most > 1.0 && least < -1.0, "{case}");
            run.mesh().check_invariants().unwrap();
        }
    }
}

/// What the needle exerts on its nodes is what the support bears: the base force is the sum of the friction of slipping
/// nodes, of the forces on sticking ones, and of nothing else.
#[test]
fn base_force_and_support_are_in_balance() {
    fn check<M: Hyperelastic<3>>(material: M, model: &str) {
        let scene = scene(&[
            "mesh.fold=18",
            "needle.depth=0.04",
            "needle.speed=1",
            "solver.tolerance=1e-10",
            "solver.round_off=0",
            model,
        ]);
        let mut insertion = insertion(&scene, material);
        let (mut slipped, mut stuck) = (0, 0);
        while !insertion.finished() {
            insertion.cycle(&mut Stages::default()).unwrap();
            let held_by = insertion.held_by();
            let slab = &insertion.slab;
            let support: [f64; 3] = std::array::from_fn(|k| {
                slab.mesh.vertices().filter(|&v| slab.is_clamped(v)).map(|v| slab.elastic_force(v)[k]).sum()
            });
            let size = held_by.force.iter().chain(&support).fold(0.0f64, |most, f| most.max(f.abs()));
            for k in 0..3 {
                let sum = held_by.force[k] + support[k];
                assert!(sum.abs() <= 1e-7 * size + 1e-12, "{model}: base {:?} N, support {support:?} N", held_by.force);
            }
            let slipping = insertion.shaft.nodes.iter().filter(|node| !node.sticks());
            for node in slipping {
                let FrictionState::Slip(way) = node.state else { unreachable!("a node that does not stick slips") };
                assert!(node.traction * way.sign() >= 0.0, "{node:?}");
                slipped += 1;
            }
            stuck += insertion.shaft.nodes.iter().filter(|node| node.sticks()).count();
        }
        assert!(slipped > 50 && stuck > 50, "{slipped} and {stuck}");
    }
    check(Linear::from_young_poisson(34e3, 0.34).unwrap(), "material.model=linear");
    check(NeoHookean::from_young_poisson(34e3, 0.34).unwrap(), NEO_HOOKEAN);
}

#[test]
fn without_friction_the_needle_slides_freely() {
    for model in ["material.model=linear", NEO_HOOKEAN] {
        for fold in ["mesh.fold=12", "mesh.fold=18"] {
            let friction = "needle.density=[{distance=0, force=0}]";
            let keys =
                [friction, "solver.tolerance=1e-10", "needle.rearrange=settle", "needle.depth=0.04", model, fold];
            let mut run = start_cube(&keys, 1).unwrap();
            let mut last: Option<(f64, [f64; 3])> = None;
            while !run.finished() {
                let (depth, force) = depth_and_force::<3>(&run.step().unwrap());
                // A node that was just taken sticks until it is judged: what counts is the last cycle of a position. Across
                // the needle its nodes are held where they were taken, which no friction decides.
                if let Some((before, force)) = last.filter(|(before, _)| *before != depth) {
                    let free = force[0].abs() < 1e-9 && force.iter().all(|f| f.abs() < 1e-6);
                    assert!(free, "{keys:?}: {force:?} N at {before} m");
                }
                last = Some((depth, force));
            }
            assert!(last.unwrap().1[0].abs() < 1e-9, "{keys:?}: {last:?}");
            let summary = run.summary(&[]);
            let needle = summary.needle.as_ref().unwrap();
            assert!(summary.converged && needle.nodes > 4, "{keys:?}: {summary:?}");
            assert!((needle.tip_reference[0] - 0.04).abs() < 1e-9, "{keys:?}: {needle:?}");
        }
    }
}

#[test]
fn with_endless_friction_the_needle_drags_the_tissue_along() {
    for model in ["material.model=linear", NEO_HOOKEAN] {
        let keys = ["needle.density=[{distance=0, force=1e9}]", "needle.depth=0.02", "mesh.fold=18", model];
        let mut run = start_cube(&keys, 1).unwrap();
        finish(&mut *run).unwrap();
        let summary = run.summary(&[]);
        let needle = summary.needle.unwrap();
        assert!(summary.converged && needle.nodes > 5, "{model}: {needle:?}");
        assert_eq!(needle.sticking, needle.nodes, "{model}: {needle:?}");
        // What was at the skin goes with the needle from the first cycle on.
        let moved = run.needle_nodes().into_iter().map(|(vertex, _)| run.displacement()[3 * vertex.index()]);
        let way = moved.fold(0.0, f64::max);
        assert!(way > 0.019 && needle.base_force[0] > 2.0, "{model}: skin moved by {way} m, {needle:?}");
    }
}

#[test]
fn a_cube_runs_the_stages_it_needs() {
    let stages = |keys: &[&str]| {
        let mut run = start_cube(keys, 1).unwrap();
        finish(&mut *run).unwrap();
        run.stages().iter().map(|(name, _, _)| name).collect::<Vec<_>>()
    };
    let of_the_loop = ["mesh", "assemble", "move", "locate", "refine", "capture", "solve", "rearrange", "release"];
    assert_eq!(stages(&["needle.depth=0.02"]), of_the_loop);
    let nonlinear = stages(&["needle.depth=0.02", NEO_HOOKEAN]);
    assert!(nonlinear.contains(&"force") && nonlinear.contains(&"linearize") && nonlinear.len() == 11, "{nonlinear:?}");
}

/// Validation H2: a line of nodes along the edges of cubes of side `h`, each with the force `f h`, in a body of
/// half-width `b` whose sides move as in the exact solution `w(r) = f / (2 pi mu) ln(b / r)`. The line of nodes moves as
/// the surface of a needle of radius 0.19851 h would. Friction limits are the forces: a needle in full slip.
#[test]
fn a_slipping_line_of_nodes_moves_the_tissue_as_exactly_known() {
    let (young, poisson, f, b) = (34e3, 0.45, 10.0, 0.05);
    let mu: f64 = young / (2.0 * (1.0 + poisson));
    let w = |r: f64| f / (std::f64::consts::TAU * mu) * (b / r).ln();
    for (n, expected) in [(12, None), (25, Some(0.656461e-3))] {
        let h = b / f64::from(n);
        let cells = 2 * n as usize;
        let mesh = generate::kuhn_box([0.0, -b, -b], [2.0 * h, b, b], [2, cells, cells]).unwrap();
        let scene = scene(&["solver.tolerance=1e-9", "support.clamped=top"]);
        let material = Linear::from_young_poisson(young, poisson).unwrap();
        let mut slab = Slab::<3, 4, _>::from_mesh(&scene, mesh, material, 1, &mut Stages::default()).unwrap();
        let needle = Needle::new([0.0; 3], direction(0.0, 0.0));
        let mut shaft = Shaft::<3>::default();
        let slack = 1e-9;
        for v in 0..slab.mesh.n_vertex_slots() {
            let vertex = VertexId::new(v);
            let [x, y, z] = slab.mesh.point(vertex);
            let r = y.hypot(z);
            if y.abs() > b - slack || z.abs() > b - slack {
                slab.constrain(vertex, Constraint::Fixed);
                slab.u[3 * v] = w(r);
            } else if r < slack {
                shaft.capture(vertex, OnNeedle { behind: 2.0 * h - x, perpendicular: 0.0, above: 0.0 });
                slab.constrain(vertex, Constraint::Line(needle.tangent()));
            } else if x < slack || x > 2.0 * h - slack {
                slab.constrain(vertex, Constraint::Line(needle.tangent()));
            }
        }
        assert_eq!(shaft.nodes.len(), 3);
        for surface in [Surface { radius: 0.0, reach: h }, Surface { radius: 0.2 * h, reach: 1.5 * h }] {
            let density = LineDensity::new(vec![(0.0, f)]).unwrap();
            let law = Law { restick: 0.0, reversal: 0.0 };
            let friction = ShaftFriction { density, static_ratio: 1.0, law, surface };
            shaft.measure(&friction);
            slab.load.fill(0.0);
            for index in 0..3 {
                let at = 3 * shaft.nodes[index].vertex.index();
                slab.load[at] = shaft.limits(index, &friction).sliding;
            }
            slab.solve(1, &mut Stages::default()).unwrap();
            let middle = slab.u[3 * shaft.nodes[1].vertex.index()];
            let exact = w(0.19851 * h);
            let expected = expected.unwrap_or(exact);
            assert!((exact / expected - 1.0).abs() < 1e-5);
            // A radius moves some friction from the middle to the ends or back.
            let accuracy = if surface.radius == 0.0 { 0.004 } else { 0.02 };
            assert!((middle / expected - 1.0).abs() < accuracy, "h = {h}: {middle} m, expected {expected} m");
        }
    }
}
