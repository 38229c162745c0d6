//! Refinement that follows a feature: the leaves are those of a mesh refined afresh.

use crate::support::{Random, assert_net, leaf_set, start_mesh};
use proptest::prelude::*;
use stylet_mesh::{BisectError, MeshChange, SimplexMesh, Sweep, generate::kuhn_box};

fn between<const D: usize>(a: &[f64; D], b: &[f64; D], t: f64) -> [f64; D] {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// The mesh refined along a segment and nowhere else.
fn afresh<const D: usize, const N: usize>(
    start: &SimplexMesh<D, N>,
    a: [f64; D],
    b: [f64; D],
    size: f64,
) -> SimplexMesh<D, N> {
    let mut mesh = start.clone();
    mesh.refine_along(a, b, size, &mut MeshChange::default()).unwrap();
    mesh
}

/// A segment of the published needle, at each of 64 steps of its size, tip and tail advancing.
#[test]
fn a_needle_in_64_steps() {
    let (a, b) = ([-0.01, 0.431, 0.527], [0.713, 0.489, 0.561]);
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
    let size = 2_f64.powi(-7);
    let length = 0.7261; // of the whole path
    let (mut mesh, mut sweep) = (start.clone(), Sweep::new(size));
    for step in 0..64 {
        let at = |h: f64| between(&a, &b, ((f64::from(step) + h) * size / length).min(1.0));
        let (before, mut change) = (mesh.clone(), MeshChange::default());
        sweep.follow(&mut mesh, at(0.0), at(20.0), &mut change).unwrap();
        assert_net(&before, &mesh, &change);
        assert_eq!(leaf_set(&mesh), leaf_set(&afresh(&start, at(0.0), at(20.0), size)), "step {step}");
    }
    mesh.check_invariants().unwrap();
    sweep.withdraw(&mut mesh, &mut MeshChange::default()).unwrap();
    assert_eq!((mesh.n_cells(), mesh.n_vertices()), (6, 8));
}

/// Segments and points at random, of which some move along themselves, some through vertices and edges.
fn random_paths<const D: usize, const N: usize>(kind: u8, seed: u64) {
    let start = start_mesh::<D, N>(kind, seed);
    let mut random = Random::new(!seed);
    let (size, background) = ([0.08, 0.2, 0.5][D - 2], [0.5, 0.9, 2.0][D - 2]);
    let mut base = start.clone();
    base.refine_everywhere(background, &mut MeshChange::default()).unwrap();
    let (mut mesh, mut sweep) = (base.clone(), Sweep::new(size).with_background(background));
    let mut total = MeshChange::default();
    let (mut a, mut b) = (random.point::<D>(), random.point::<D>());
    for _ in 0..10 {
        match random.below(5) {
            0 => (a, b) = (random.point(), random.point()),
            1 => b = a,
            2 => a = start.points()[random.below(start.n_vertices())],
            _ => (a, b) = (between(&a, &b, random.unit()), between(&a, &b, 1.0 + 0.3 * random.unit())),
        }
        sweep.follow(&mut mesh, a, b, &mut total).unwrap();
        assert_net(&base, &mesh, &total);
        assert_eq!(leaf_set(&mesh), leaf_set(&afresh(&base, a, b, size)));
    }
    mesh.check_invariants().unwrap();
    sweep.withdraw(&mut mesh, &mut total).unwrap();
    assert_eq!(leaf_set(&mesh), leaf_set(&base));
    assert!(total.died.is_empty() && total.born.is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn random_paths_in_2d(kind in 0..3_u8, seed: u64) { random_paths::<2, 3>(kind, seed); }
}
proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]
    #[test]
    fn random_paths_in_3d(kind in 0..3_u8, seed: u64) { random_paths::<3, 4>(kind, seed); }
}
proptest! {
    #![proptest_config(ProptestConfig::with_cases(5))]
    #[test]
    fn random_paths_in_4d(kind in 0..3_u8, seed: u64) { random_paths::<4, 5>(kind, seed); }
}

/// With hysteresis a tip that trembles changes nothing, what is behind is coarse, and nothing is left in the end.
#[test]
fn hysteresis_keeps_cells_from_flipping() {
    let mut mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [4; 2]).unwrap();
    let size = 1.0 / 64.0;
    let mut sweep = Sweep::new(size).with_hysteresis(4.0 * size);
    let mut change = MeshChange::default();
    let at = |x: f64| [x, 0.4371];
    for step in 0..200 {
        let x = 0.1 + 0.004 * f64::from(step);
        sweep.follow(&mut mesh, at(x), at(x), &mut change).unwrap();
        if step > 10 && step % 20 == 0 {
            sweep.follow(&mut mesh, at(x + 0.5 * size), at(x + 0.5 * size), &mut change).unwrap();
            for tremble in [0.0, 0.5, 0.25, 0.5, 0.0] {
                let mut trembling = MeshChange::default();
                sweep.follow(&mut mesh, at(x + tremble * size), at(x + tremble * size), &mut trembling).unwrap();
                assert!(trembling.is_empty(), "step {step}, {tremble}");
            }
        }
        if let Some(behind) = mesh.locate(at(x - 20.0 * size)) {
            assert!(mesh.longest_edge(behind.cell) > 2.0 * size);
        }
    }
    mesh.check_invariants().unwrap();
    sweep.withdraw(&mut mesh, &mut change).unwrap();
    assert_eq!(mesh.n_cells(), 32);
}

#[test]
fn a_sweep_that_was_stopped_is_made_up_for() {
    let start = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [1; 3]).unwrap();
    let (mut mesh, mut sweep) = (start.clone(), Sweep::new(0.03));
    let (a, b) = ([0.1, 0.431, 0.527], [0.5, 0.489, 0.561]);
    let mut change = MeshChange::default();
    sweep.follow(&mut mesh, a, b, &mut change).unwrap();
    mesh.set_bisection_limit(100);
    let (c, d) = ([0.2, 0.8, 0.527], [0.9, 0.489, 0.2]);
    let outcome = sweep.follow(&mut mesh, c, d, &mut change);
    assert!(matches!(outcome, Err(BisectError::BisectionLimit { limit: 100, .. })), "{outcome:?}");
    assert_net(&start, &mesh, &change);
    mesh.check_invariants().unwrap();
    mesh.set_bisection_limit(usize::MAX);
    sweep.follow(&mut mesh, c, d, &mut change).unwrap();
    assert_eq!(leaf_set(&mesh), leaf_set(&afresh(&start, c, d, 0.03)));
    for bad in [f64::NAN, f64::INFINITY, 1e200] {
        assert!(matches!(sweep.follow(&mut mesh, [bad; 3], d, &mut change), Err(BisectError::Point { .. })));
        assert!(Sweep::new(-bad).follow(&mut mesh, c, d, &mut change).is_err());
    }
    assert!(Sweep::new(0.1).with_hysteresis(-1.0).follow(&mut mesh, c, d, &mut change).is_err());
}
