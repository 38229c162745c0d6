//! A steel needle in soft tissue: iterations of the coupled system, and dense solutions of small ones.

use crate::common::elasticity::{Cube, cube};
use crate::common::kkt::dense_kkt;
use crate::common::needle::{Mesh, Needle, both, rows};
use crate::common::{distance, from_dense, krylov, rule, system};
use proptest::prelude::*;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{
    CgSettings, CgWorkspace, KktOperator, KktWorkspace, NullSpace, NullSpaceError, NullSpaceWorkspace, VectorError,
    kkt_cg, null_space_cg, null_space_start, projected_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::vector::{dot, norm2};

const TOLERANCE: f64 = 1e-5;

fn settings(tolerance: f64) -> CgSettings {
    CgSettings { stop: rule(tolerance, Criterion::External), max_iterations: 5_000 }
}

/// Iterations of the cube alone, and of the cube with a needle in each of the patterns of states.
fn counts(cube: &Cube, dt: Option<f64>, mesh: Mesh, patterns: &[Vec<u8>]) -> (usize, Vec<usize>) {
    let a = dt.map_or_else(|| cube.a.clone(), |dt| cube.dynamic(dt));
    let w = Subspace::new(a.n_rows());
    let m = BlockJacobi::new(&a, &w).unwrap();
    let mut x = vec![0.0; cube.load.len()];
    let alone = projected_cg(&a, &m, &w, &cube.load, &mut x, &settings(TOLERANCE), &mut CgWorkspace::new()).unwrap();
    assert_eq!(alone.stop, Stop::Converged);
    let needle = Needle::new(cube, 20, dt, mesh);
    let mut form =
        NullSpace::new(&a, &w, needle.matrix.clone(), needle.attachments.clone(), &needle.free(&[1; 20])).unwrap();
    let mut ws = NullSpaceWorkspace::new();
    let zero = vec![0.0; 3 * needle.len()];
    let run = |pattern: &Vec<u8>| {
        let free = needle.free(pattern);
        free.iter().enumerate().for_each(|(node, free)| form.set_free(node, *free).unwrap());
        let (mut u, mut v) = (vec![0.0; cube.load.len()], zero.clone());
        let b = (&cube.load[..], &zero[..], &zero[..]);
        let report = null_space_cg(&form, &a, &m, b, (&mut u, &mut v), &settings(TOLERANCE), &mut ws).unwrap();
        assert_eq!(report.stop, Stop::Converged);
        report.iterations
    };
    (alone.iterations, patterns.iter().map(run).collect())
}

/// All stuck, all sliding, all free but the base, and random mixtures.
fn patterns(random: usize) -> Vec<Vec<u8>> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as u8 % 5
    };
    let mut all = vec![vec![0; 20], vec![1; 20]];
    // Two in five stick, two slide, one is free.
    all.extend((0..random).map(|_| (0..20).map(|_| next() / 2).collect()));
    all
}

fn check(poisson: f64, dt: Option<f64>, random: usize) {
    let cube = cube(13, poisson);
    for mesh in [Mesh::AtNodes, Mesh::Inside] {
        let (alone, coupled) = counts(&cube, dt, mesh, &patterns(random));
        println!("nu {poisson} dt {dt:?} {mesh:?}: alone {alone}, coupled {coupled:?}");
        assert!(coupled.iter().all(|&count| 10 * count <= 11 * alone), "{alone} alone, {coupled:?}");
    }
}

#[test]
fn a_needle_costs_no_iterations_at_1_ms() {
    [0.34, 0.45, 0.49].iter().for_each(|&poisson| check(poisson, Some(1e-3), 6));
}

#[test]
fn a_needle_costs_no_iterations_at_20_ms() {
    [0.34, 0.45].iter().for_each(|&poisson| check(poisson, Some(20e-3), 2));
}

#[test]
fn a_needle_costs_no_iterations_at_20_ms_nearly_incompressible() {
    check(0.49, Some(20e-3), 1);
}

#[test]
fn a_needle_costs_no_iterations_in_equilibrium() {
    check(0.34, None, 1);
}

#[test]
fn a_needle_costs_no_iterations_in_equilibrium_nearly_incompressible() {
    [0.45, 0.49].iter().for_each(|&poisson| check(poisson, None, 1));
}

#[test]
fn conjugate_gradients_on_the_coupled_matrix_take_a_hundred_times_more() {
    let cube = cube(13, 0.34);
    let big = cube.dynamic(1e-3);
    let needle = Needle::new(&cube, 20, Some(1e-3), Mesh::Inside);
    let (a, free) = (both(&big, &needle.matrix), needle.free(&[0; 20]));
    let zero = vec![0.0; 3 * needle.len()];
    let c = rows(big.n_rows(), &needle.attachments, &free, &zero);
    let b: Vec<f64> = cube.load.iter().chain(&zero).copied().collect();
    let w = Subspace::<3>::new(a.n_rows());
    let k = KktOperator::new(&a, &w, &c).unwrap();
    let (mut x, mut lambda) = (vec![0.0; b.len()], vec![0.0; c.n_rows()]);
    let settings = krylov(TOLERANCE, Criterion::External);
    let report = kkt_cg(&k, &Identity, &b, &mut x, &mut lambda, &settings, &mut KktWorkspace::new()).unwrap();
    println!("{report:?}");
    let (alone, coupled) = counts(&cube, Some(1e-3), Mesh::Inside, &[vec![0; 20]]);
    println!("alone {alone}, null space {coupled:?}");
    assert!(report.iterations > 100 * coupled[0], "{report:?} against {coupled:?}");
}

/// A big body, a small one that may be singular, attachments, states, forces and offsets.
#[derive(Clone, Debug)]
struct Pair<const B: usize> {
    big: crate::common::System<B>,
    small: crate::common::System<B>,
    attachments: Vec<Vec<(usize, f64)>>,
    free: Vec<Constraint<B>>,
    g: Vec<f64>,
    /// Against the relative moves.
    resistance: Vec<f64>,
}

fn pair<const B: usize>() -> impl Strategy<Value = Pair<B>> {
    let attachment = proptest::collection::vec((any::<proptest::sample::Index>(), 0.1..1.0f64), 0..4);
    let attachments = proptest::collection::vec(attachment, 12);
    let resistance = proptest::collection::vec((0u8..2, 0.0..3.0f64), 12);
    (system::<B>(), system::<B>(), attachments, proptest::collection::vec(-1.0..1.0f64, 12 * B), resistance).prop_map(
        |(big, small, attachments, g, resistance)| {
            let (n_big, n) = (big.a.n_rows(), small.a.n_rows());
            let attachments: Vec<Vec<(usize, f64)>> = attachments[..n]
                .iter()
                .map(|list| {
                    let mut list: Vec<(usize, f64)> =
                        list.iter().map(|(at, weight)| (at.index(n_big), *weight)).collect();
                    list.sort_by_key(|entry| entry.0);
                    list.dedup_by_key(|entry| entry.0);
                    list
                })
                .collect();
            let free = (0..n)
                .map(|node| if attachments[node].is_empty() { Constraint::Free } else { small.w.get(node) })
                .collect();
            let resistance = resistance[..n].iter().map(|&(on, c)| f64::from(on) * c).collect();
            Pair { g: g[..n * B].to_vec(), big, small, attachments, free, resistance }
        },
    )
}

/// The matrix of both bodies and of the resistances, which are those of springs along the relative moves.
fn resisted<const B: usize>(s: &Pair<B>) -> BlockCsr<B> {
    let a = both(&s.big.a, &s.small.a);
    let (n_big, n) = (s.big.a.n_rows(), a.n_rows());
    let mut dense = a.to_dense();
    for (node, &c) in s.resistance.iter().enumerate() {
        let mut weights: Vec<(usize, f64)> = s.attachments[node].iter().map(|&(big, weight)| (big, -weight)).collect();
        weights.push((n_big + node, 1.0));
        for k in 0..B {
            let column = s.free[node].project(std::array::from_fn(|l| f64::from(k == l)));
            for &(i, wi) in &weights {
                for (&(j, wj), l) in weights.iter().flat_map(|entry| (0..B).map(move |l| (entry, l))) {
                    dense[(i * B + l) * n * B + j * B + k] += c * wi * wj * column[l];
                }
            }
        }
    }
    from_dense(n, |i, j| dense[i * n * B + j])
}

fn check_pair<const B: usize>(s: &Pair<B>) {
    let a = resisted(s);
    let n = s.big.b.len();
    let mut w = s.big.w.clone();
    w.resize(a.n_rows());
    let stack = |u: &[f64], v: &[f64]| u.iter().chain(v).copied().collect::<Vec<f64>>();
    let c = rows(s.big.a.n_rows(), &s.attachments, &s.free, &s.g);
    let (exact, lambda, _) = dense_kkt(&a, &w, &c, &stack(&s.big.b, &s.small.b), &stack(&s.big.x0, &s.small.x0));
    let m = BlockJacobi::new(&s.big.a, &s.big.w).unwrap();
    // Every state is reached from another one.
    let first = vec![Constraint::Free; s.free.len()];
    let mut form = NullSpace::new(&s.big.a, &s.big.w, s.small.a.clone(), s.attachments.clone(), &first).unwrap();
    form.set_motions(&s.free, &s.resistance).unwrap();
    let (mut u, mut v) = (s.big.x0.clone(), s.small.x0.clone());
    let mut ws = NullSpaceWorkspace::new();
    let b = (&s.big.b[..], &s.small.b[..], &s.g[..]);
    let report = null_space_cg(&form, &s.big.a, &m, b, (&mut u, &mut v), &settings(1e-11), &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    let x = stack(&u, &v);
    assert!(distance(&x, &exact) <= 1e-7 * norm2(&exact).max(1.0), "{report:?}");
    // Forces on the small body: those of the multipliers.
    let mut forces = vec![0.0; v.len()];
    form.constraint_forces(&s.small.b, &v, &mut forces).unwrap();
    let mut expected = vec![0.0; x.len()];
    c.add_transposed(-1.0, &lambda, &mut expected);
    assert!(distance(&forces, &expected[n..]) <= 1e-6 * norm2(&lambda).max(1.0));
    // Again from the solution: nothing to do, and nothing changes but rounding.
    let again = null_space_cg(&form, &s.big.a, &m, b, (&mut u, &mut v), &settings(1e-9), &mut ws).unwrap();
    assert_eq!((again.stop, again.iterations), (Stop::Converged, 0));
}

/// Guesses never leave more energy than the start, and one that leads to the solution is found among useless ones.
fn check_guesses<const B: usize>(s: &Pair<B>) {
    let a = resisted(s);
    let mut w = s.big.w.clone();
    w.resize(a.n_rows());
    let stack = |u: &[f64], v: &[f64]| u.iter().chain(v).copied().collect::<Vec<f64>>();
    let c = rows(s.big.a.n_rows(), &s.attachments, &s.free, &s.g);
    let (exact, ..) = dense_kkt(&a, &w, &c, &stack(&s.big.b, &s.small.b), &stack(&s.big.x0, &s.small.x0));
    let error = |u: &[f64], v: &[f64]| {
        let e: Vec<f64> = stack(u, v).iter().zip(&exact).map(|(x, exact)| x - exact).collect();
        let mut image = vec![0.0; e.len()];
        a.apply(&e, &mut image);
        dot(&e, &image).max(0.0).sqrt()
    };
    let m = BlockJacobi::new(&s.big.a, &s.big.w).unwrap();
    let mut form = NullSpace::new(&s.big.a, &s.big.w, s.small.a.clone(), s.attachments.clone(), &s.free).unwrap();
    form.set_motions(&s.free, &s.resistance).unwrap();
    let (mut u, mut v) = (s.big.x0.clone(), s.small.x0.clone());
    let mut ws = NullSpaceWorkspace::new();
    let b = (&s.big.b[..], &s.small.b[..], &s.g[..]);
    null_space_start(&form, &s.big.a, b, (&mut u, &mut v), &[], &mut ws).unwrap();
    let scale = norm2(&exact).max(1.0);
    let before = error(&u, &v);
    null_space_start(&form, &s.big.a, b, (&mut u, &mut v), &[&s.big.b], &mut ws).unwrap();
    let after = error(&u, &v);
    assert!(after <= before * (1.0 + 1e-9) + 1e-9 * scale, "{before} to {after}");
    let way: Vec<f64> = u.iter().zip(&exact).map(|(u, exact)| exact - u).collect();
    let zero = vec![0.0; u.len()];
    let guesses = [&s.big.b[..], &zero, &way, &s.big.b];
    null_space_start(&form, &s.big.a, b, (&mut u, &mut v), &guesses, &mut ws).unwrap();
    assert!(error(&u, &v) <= 1e-6 * scale, "{} of {before}", error(&u, &v));
    let solved = null_space_cg(&form, &s.big.a, &m, b, (&mut u, &mut v), &settings(1e-11), &mut ws).unwrap();
    assert_eq!(solved.stop, Stop::Converged);
    assert!(distance(&stack(&u, &v), &exact) <= 1e-7 * scale);
    let short = null_space_start(&form, &s.big.a, b, (&mut u, &mut v), &[&zero[1..]], &mut ws);
    assert!(matches!(short, Err(NullSpaceError::Vector(VectorError::Length { .. }))), "{short:?}");
}

proptest! {
    #[test]
    fn guesses_lower_the_energy_2d(s in pair::<2>()) { check_guesses(&s); }

    #[test]
    fn guesses_lower_the_energy_3d(s in pair::<3>()) { check_guesses(&s); }

    #[test]
    fn agrees_with_a_dense_factorisation_2d(s in pair::<2>()) { check_pair(&s); }

    #[test]
    fn agrees_with_a_dense_factorisation_3d(s in pair::<3>()) { check_pair(&s); }
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let big = from_dense::<2>(3, |i, j| if i == j { 2.0 } else { 0.0 });
    let small = from_dense::<2>(2, |i, j| if i == j { 1.0 } else { 0.0 });
    let w = Subspace::new(3);
    let new = |attachments: Vec<Vec<(usize, f64)>>, free: &[Constraint<2>]| {
        NullSpace::new(&big, &w, small.clone(), attachments, free).map(drop)
    };
    let good = vec![vec![(0, 1.0)], vec![]];
    let states = [Constraint::Fixed, Constraint::Free];
    assert_eq!(new(good.clone(), &states), Ok(()));
    assert_eq!(
        new(good.clone(), &states[1..]),
        Err(VectorError::Length { what: "the list of relative motions", expected: 2, len: 1 }.into())
    );
    assert_eq!(
        new(vec![vec![(3, 1.0)], vec![]], &states),
        Err(NullSpaceError::Attachment { node: 0, big: 3, n_big: 3 })
    );
    assert_eq!(new(vec![vec![(1, f64::NAN)], vec![]], &states), Err(NullSpaceError::Weight { node: 0, big: 1 }));
    assert_eq!(new(good.clone(), &[Constraint::Free, Constraint::Fixed]), Err(NullSpaceError::Unattached { node: 1 }));
    let mut form = NullSpace::new(&big, &w, small.clone(), good.clone(), &states).unwrap();
    assert!(matches!(form.set_free(0, Constraint::Line([2.0, 0.0])), Err(NullSpaceError::Subspace(_))));
    assert!(matches!(form.set_free(2, Constraint::Fixed), Err(NullSpaceError::Subspace(_))));
    assert_eq!(form.free(0), Constraint::Fixed);
    // Node 1 of the small body, which is node 4 of both, has no stiffness.
    let loose = from_dense::<2>(2, |i, j| if i == j && i < 2 { 1.0 } else { 0.0 });
    assert_eq!(form.set_small(loose), Err(NullSpaceError::NotPositiveDefinite { node: 4, pivot: 0.0 }));
    form.set_small(small.clone()).unwrap();
    assert!(matches!(form.refresh(&BlockCsr::new(2)), Err(NullSpaceError::Vector(VectorError::Length { .. }))));
    let m = BlockJacobi::new(&big, &w).unwrap();
    let run = |b: &[f64], b_small: &[f64], g: &[f64]| {
        let mut ws = NullSpaceWorkspace::new();
        null_space_cg(&form, &big, &m, (b, b_small, g), (&mut [0.0; 6], &mut [0.0; 4]), &settings(1e-6), &mut ws)
    };
    assert!(matches!(run(&[0.0; 5], &[0.0; 4], &[0.0; 4]), Err(NullSpaceError::Vector(VectorError::Length { .. }))));
    let bad = [0.0, 0.0, f64::NAN, 0.0];
    let not_finite = |what| Err(VectorError::NotFinite { what, index: 2, iteration: 0 }.into());
    assert_eq!(run(&[0.0; 6], &bad, &[0.0; 4]), not_finite("b of the small body"));
    assert_eq!(run(&[0.0; 6], &[0.0; 4], &bad), not_finite("the offsets"));
    assert_eq!(run(&[0.0; 6], &[0.0; 4], &[0.0; 4]).unwrap().iterations, 0);
}
