//! Sparse factors against dense ones, and refinement.

use crate::common::elasticity::cube;
use crate::common::graphs::Graph;
use crate::common::{System, dense_solution, distance, from_dense, grid, rule, system};
use faer::Mat;
use faer::linalg::solvers::Solve;
use proptest::prelude::*;
use std::sync::Arc;
use stylet_solver::linear::direct::{DirectError, Factor, FactorNumber, FillOrder, Method, Symbolic};
use stylet_solver::linear::{RefineError, RefineReport, RefineSettings, RefineWorkspace, refine};
use stylet_solver::ordering::{Permutation, reverse_cuthill_mckee};
use stylet_solver::precondition::Preconditioner;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn refined<const B: usize>(
    a: &BlockCsr<B>,
    m: &(impl Preconditioner + ?Sized),
    w: &Subspace<B>,
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
) -> RefineReport {
    let settings = RefineSettings { stop: rule(tolerance, Criterion::Reaction), max_iterations: 30 };
    refine(a, m, w, b, x, &settings, &mut RefineWorkspace::new()).unwrap()
}

fn check_spd<const B: usize>(s: &System<B>) -> Result<(), TestCaseError> {
    let expected = dense_solution(s);
    let backwards = Permutation::from_new_to_old((0..s.a.n_rows() as u32).rev().collect()).unwrap();
    for order in
        [FillOrder::Natural, FillOrder::MinimumDegree, FillOrder::NestedDissection, FillOrder::Custom(&backwards)]
    {
        let symbolic = Arc::new(Symbolic::new(&s.a, order).unwrap());
        let pivoted = Arc::new(Symbolic::indefinite(&s.a, order).unwrap());
        for (symbolic, method) in
            [(&symbolic, Method::Llt), (&symbolic, Method::Ldlt), (&pivoted, Method::Llt), (&pivoted, Method::Lblt)]
        {
            let factor = Factor::<B, f64>::new(symbolic.clone(), method, &s.a, &s.w).unwrap();
            let single = Factor::<B, f32>::new(symbolic.clone(), method, &s.a, &s.w).unwrap();
            for (m, budget) in [(&factor as &dyn Preconditioner, 2), (&single, 12)] {
                let mut x = s.x0.clone();
                let report = refined(&s.a, m, &s.w, &s.b, &mut x, 1e-12);
                prop_assert!(
                    report.stop == Stop::Converged && report.iterations <= budget,
                    "{:?} {:?}",
                    method,
                    report
                );
                prop_assert!(distance(&x, &expected) <= 1e-9 * (1.0 + norm(&expected)));
            }
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn solves_as_a_dense_factor_does_1x1(s in system::<1>()) {
        check_spd(&s)?;
    }

    #[test]
    fn solves_as_a_dense_factor_does_2x2(s in system::<2>()) {
        check_spd(&s)?;
    }

    #[test]
    fn solves_as_a_dense_factor_does_3x3(s in system::<3>()) {
        check_spd(&s)?;
    }
}

/// The analysis of a cube serves other values and other constraints, with the bits of a fresh factor.
#[test]
fn an_analysis_outlives_values_and_constraints() {
    let cube = cube(5, 0.34);
    let n = cube.a.n_rows();
    let order = reverse_cuthill_mckee(&cube.a);
    for order in [FillOrder::NestedDissection, FillOrder::Custom(&order)] {
        let symbolic = Arc::new(Symbolic::new(&cube.a, order).unwrap());
        let mut w = Subspace::new(n);
        let mut factor = Factor::<3, f64>::new(symbolic.clone(), Method::Llt, &cube.a, &w).unwrap();
        for (k, dt) in [1e-3, 2e-2].into_iter().enumerate() {
            let a = cube.dynamic(dt);
            w.set(7 * k, Constraint::Fixed).unwrap();
            w.set(7 * k + 1, Constraint::Line([0.6, 0.0, 0.8])).unwrap();
            w.set(7 * k + 2, Constraint::Plane([0.0, 0.6, 0.8])).unwrap();
            factor.refactor(&a, &w).unwrap();
            let fresh =
                Factor::<3, f64>::new(Arc::new(Symbolic::new(&a, order).unwrap()), Method::Llt, &a, &w).unwrap();
            let (mut x, mut y) = (cube.load.clone(), cube.load.clone());
            factor.solve(&mut x).unwrap();
            fresh.solve(&mut y).unwrap();
            assert_eq!(x, y);
            let mut x = vec![0.0; 3 * n];
            let report = refined(&a, &factor, &w, &cube.load, &mut x, 1e-13);
            assert_eq!((report.stop, report.iterations), (Stop::Converged, 1));
        }
        assert!(Arc::ptr_eq(&symbolic, factor.symbolic()));
    }
}

#[test]
fn a_single_precision_factor_is_refined_to_rounding() {
    let cube = cube(8, 0.34);
    let w = Subspace::new(cube.a.n_rows());
    let symbolic = Arc::new(Symbolic::new(&cube.a, FillOrder::NestedDissection).unwrap());
    // Time steps are well conditioned; a static body loses the digits of its condition number in the residual itself.
    for (a, tolerance) in [(cube.dynamic(1e-3), 1e-15), (cube.dynamic(2e-2), 1e-14), (cube.a.clone(), 1e-12)] {
        let factor = Factor::<3, f32>::new(symbolic.clone(), Method::Llt, &a, &w).unwrap();
        let mut x = vec![0.0; cube.load.len()];
        let report = refined(&a, &factor, &w, &cube.load, &mut x, tolerance);
        println!("{report:?}, relative {:e}", report.residual_norm / norm(&cube.load));
        assert!(report.stop == Stop::Converged && report.iterations <= 5, "{report:?}");
    }
}

fn check_columns<T: FactorNumber>(cube: &BlockCsr<3>, method: Method, tolerance: f64) {
    let symbolic = Arc::new(Symbolic::new(cube, FillOrder::MinimumDegree).unwrap());
    let factor = Factor::<3, T>::new(symbolic, method, cube, &Subspace::new(cube.n_rows())).unwrap();
    let n = factor.dim();
    let mut columns: Vec<f64> = (0..5 * n).map(|k| ((k * k) as f64 * 0.37).sin()).collect();
    let mut separate = columns.clone();
    factor.solve(&mut columns).unwrap();
    for x in separate.chunks_mut(n) {
        factor.solve(x).unwrap();
    }
    assert!(distance(&columns, &separate) <= tolerance * norm(&separate));
    // A small right side does not vanish in single precision.
    let (mut large, mut small) = (vec![1.0; n], vec![1e-200; n]);
    factor.solve(&mut large).unwrap();
    factor.solve(&mut small).unwrap();
    let scaled: Vec<f64> = small.iter().map(|x| x * 1e200).collect();
    assert!(distance(&large, &scaled) <= tolerance * norm(&large));
    factor.solve(&mut small[..0]).unwrap();
    let mut zero = vec![0.0; n];
    factor.solve(&mut zero).unwrap();
    assert_eq!(zero, vec![0.0; n]);
}

#[test]
fn several_right_sides_at_once_are_solved_as_one_by_one() {
    let a = cube(4, 0.34).a;
    for method in [Method::Llt, Method::Ldlt] {
        check_columns::<f64>(&a, method, 1e-12);
        check_columns::<f32>(&a, method, 1e-4);
    }
}

fn spd_error(a: &BlockCsr<2>, method: Method) -> DirectError {
    let symbolic = Arc::new(Symbolic::new(a, FillOrder::MinimumDegree).unwrap());
    Factor::<2, f64>::new(symbolic, method, a, &Subspace::new(a.n_rows())).unwrap_err()
}

#[test]
fn a_pivot_that_is_not_positive_is_named() {
    // Uncoupled nodes: the pivot is the diagonal entry, wherever the order puts it.
    for bad in 0..8 {
        let mut a = BlockCsr::<2>::new(4);
        for i in 0..4 {
            let entry = |k: usize| if 2 * i + k == bad { -3.0 } else { 2.0 };
            a.set_row(i, &[i as u32], &[[[entry(0), 0.0], [0.0, entry(1)]]]).unwrap();
        }
        assert_eq!(spd_error(&a, Method::Llt), DirectError::NotPositiveDefinite { row: bad, pivot: -3.0 });
    }
    // The same in the middle of a large system with supernodes; held, the node does no harm.
    let mut s = cube(6, 0.34);
    let node = 150;
    let pull = s.a.diagonal(node).map(|row| row.map(|v| -4.0 * v));
    s.a.add_to_block(node, node, &pull).unwrap();
    let mut w = Subspace::new(s.a.n_rows());
    let last: Vec<u32> = (0..s.a.n_rows() as u32).filter(|&i| i as usize != node).chain([node as u32]).collect();
    let last = Permutation::from_new_to_old(last).unwrap();
    let symbolic = Arc::new(Symbolic::new(&s.a, FillOrder::Custom(&last)).unwrap());
    let error = Factor::<3, f64>::new(symbolic.clone(), Method::Llt, &s.a, &w).unwrap_err();
    let DirectError::NotPositiveDefinite { row, pivot } = error else { panic!("{error}") };
    assert!(row / 3 == node && pivot < 0.0, "{error}");
    w.set(node, Constraint::Fixed).unwrap();
    assert!(Factor::<3, f64>::new(symbolic, Method::Llt, &s.a, &w).is_ok());
}

#[test]
fn singular_matrices_are_refused() {
    // Structurally: a node without a row.
    let mut s = grid(5);
    let neighbours: Vec<usize> = s.a.row(12).0.iter().map(|&j| j as usize).filter(|&j| j != 12).collect();
    s.a.clear_row(12).unwrap();
    for j in neighbours {
        let (cols, blocks) = s.a.row(j);
        let (cols, blocks): (Vec<u32>, Vec<_>) = cols.iter().zip(blocks).filter(|(c, _)| **c != 12).unzip();
        s.a.set_row(j, &cols, &blocks).unwrap();
    }
    for method in [Method::Llt, Method::Ldlt] {
        let error = spd_error(&s.a, method);
        assert!(
            matches!(
                error,
                DirectError::NotPositiveDefinite { row: 24 | 25, pivot: 0.0 }
                    | DirectError::Singular { row: 24 | 25, pivot: 0.0 }
            ),
            "{error}"
        );
    }
    s.w.set(12, Constraint::Fixed).unwrap();
    let symbolic = Arc::new(Symbolic::new(&s.a, FillOrder::NestedDissection).unwrap());
    assert!(Factor::<2, f64>::new(symbolic, Method::Llt, &s.a, &s.w).is_ok());
    // Numerically: Laplacians of graphs, whose rows sum to zero.
    for n in [2usize, 10, 60] {
        let edges: Vec<_> = (0..n).flat_map(|i| [(i, (i + 1) % n), (i, (i * i + 3) % n)]).collect();
        let mut a = Graph::new(n, &edges).laplacian();
        for i in 0..n {
            a.add_to_block(i, i, &[[-1.0]]).unwrap();
        }
        let symbolic = Arc::new(Symbolic::indefinite(&a, FillOrder::MinimumDegree).unwrap());
        for method in [Method::Llt, Method::Ldlt, Method::Lblt] {
            let error = Factor::<1, f64>::new(symbolic.clone(), method, &a, &Subspace::new(n)).unwrap_err();
            assert!(!matches!(error, DirectError::NoPivots), "{error}");
            assert!(Factor::<1, f32>::new(symbolic.clone(), method, &a, &Subspace::new(n)).is_err());
        }
    }
}

/// A cube of springs of unequal stiffness that nothing holds: in exact arithmetic its last pivot is zero.
#[test]
fn a_floating_body_is_refused_and_a_held_one_is_not() {
    let side = 9;
    let stiffness = |i: usize, j: usize| 1.5 + ((i.min(j) * 7 + i.max(j) * 13) as f64).sin();
    let mut a = BlockCsr::<1>::new(side * side * side);
    for i in 0..a.n_rows() {
        let place = [i / (side * side), i / side % side, i % side];
        let steps = [side * side, side, 1];
        let mut row = Vec::new();
        for (axis, step) in steps.into_iter().enumerate() {
            row.extend((place[axis] > 0).then(|| i - step));
            row.extend((place[axis] + 1 < side).then_some(i + step));
        }
        row.push(i);
        row.sort_unstable();
        let diagonal: f64 = row.iter().filter(|&&j| j != i).map(|&j| stiffness(i, j)).sum();
        let blocks: Vec<_> = row.iter().map(|&j| [[if i == j { diagonal } else { -stiffness(i, j) }]]).collect();
        let cols: Vec<u32> = row.iter().map(|&j| j as u32).collect();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    let mut w = Subspace::new(a.n_rows());
    for order in [FillOrder::Natural, FillOrder::MinimumDegree, FillOrder::NestedDissection] {
        let symbolic = Arc::new(Symbolic::new(&a, order).unwrap());
        for method in [Method::Llt, Method::Ldlt] {
            let double = Factor::<1, f64>::new(symbolic.clone(), method, &a, &w).unwrap_err();
            let single = Factor::<1, f32>::new(symbolic.clone(), method, &a, &w).unwrap_err();
            for error in [double, single] {
                let by_pivot = matches!(error, DirectError::NotPositiveDefinite { .. } | DirectError::Singular { .. });
                assert!(by_pivot || matches!(error, DirectError::IllConditioned { .. }), "{error}");
            }
        }
        // One node held is enough.
        w.set(0, Constraint::Fixed).unwrap();
        for method in [Method::Llt, Method::Ldlt] {
            assert!(Factor::<1, f64>::new(symbolic.clone(), method, &a, &w).is_ok());
            assert!(Factor::<1, f32>::new(symbolic.clone(), method, &a, &w).is_ok());
        }
        w.set(0, Constraint::Free).unwrap();
    }
}

#[test]
fn bad_matrices_and_right_sides_are_refused() {
    let s = grid(4);
    let symbolic = Arc::new(Symbolic::new(&s.a, FillOrder::Natural).unwrap());
    let mut factor = Factor::<2, f64>::new(symbolic.clone(), Method::Llt, &s.a, &s.w).unwrap();
    // Shapes.
    let shape = |what, expected, len| Err(DirectError::Shape { what, expected, len });
    assert_eq!(factor.solve(&mut [0.0; 31]), shape("the right side", 32, 31));
    assert_eq!(factor.refactor(&s.a, &Subspace::new(3)), shape("the subspace, in nodes,", 16, 3));
    assert_eq!(factor.solve(&mut [0.0; 32]), Err(DirectError::NoFactor));
    assert_eq!(factor.refactor(&grid(3).a, &grid(3).w), shape("the matrix, in block rows,", 16, 9));
    let short = Permutation::identity(3);
    assert_eq!(Symbolic::new(&s.a, FillOrder::Custom(&short)).err(), shape("the order of elimination", 16, 3).err());
    assert_eq!(Factor::<2, f64>::new(symbolic, Method::Lblt, &s.a, &s.w).err(), Some(DirectError::NoPivots));
    // Values.
    factor.refactor(&s.a, &s.w).unwrap();
    let mut b = [1.0; 32];
    b[17] = f64::INFINITY;
    assert_eq!(factor.solve(&mut b), Err(DirectError::RightSideNotFinite { index: 17 }));
    let mut a = s.a.clone();
    a.row_mut(5).1[0][1][0] = f64::NAN;
    let col = 2 * a.row(5).0[0] as usize;
    let error = factor.refactor(&a, &s.w).unwrap_err();
    assert!(
        error == DirectError::NotFinite { row: 11, col } || error == DirectError::NotFinite { row: col, col: 11 },
        "{error}"
    );
    let mut a = s.a.clone();
    a.add_to_block(6, 5, &[[0.0, 1e-6], [0.0, 0.0]]).unwrap();
    let error = factor.refactor(&a, &s.w).unwrap_err();
    assert!(
        matches!(
            error,
            DirectError::NotSymmetric { row: 11, col: 12, .. } | DirectError::NotSymmetric { row: 12, col: 11, .. }
        ),
        "{error}"
    );
    let huge = from_dense::<2>(1, |i, j| if i == j { 1e300 } else { 0.0 });
    let symbolic = Arc::new(Symbolic::new(&huge, FillOrder::Natural).unwrap());
    let w = Subspace::new(1);
    assert_eq!(
        Factor::<2, f32>::new(symbolic, Method::Llt, &huge, &w).err(),
        Some(DirectError::NotFinite { row: 0, col: 0 })
    );
    // Patterns.
    let mut a = s.a.clone();
    let (cols, blocks) = a.row(9);
    let (cols, blocks) = (cols[1..].to_vec(), blocks[1..].to_vec());
    a.set_row(9, &cols, &blocks).unwrap();
    assert_eq!(factor.refactor(&a, &s.w), Err(DirectError::PatternChanged { row: 9 }));
    let missing = Symbolic::new(&a, FillOrder::Natural).unwrap_err();
    assert!(matches!(missing, DirectError::PatternNotSymmetric { col: 9, .. }), "{missing}");
    // Nothing at all.
    let nothing = BlockCsr::<2>::new(0);
    let symbolic = Arc::new(Symbolic::new(&nothing, FillOrder::NestedDissection).unwrap());
    let factor = Factor::<2, f64>::new(symbolic, Method::Llt, &nothing, &Subspace::new(0)).unwrap();
    assert_eq!(factor.solve(&mut []), Ok(()));
    assert_eq!(factor.solve(&mut [1.0]), shape("the right side", 0, 1));
}

/// `[H Cᵀ; C 0]`: a cube of elastic material, and rows that tie entries of it together.
fn saddle_point(cells: usize, ties: usize) -> (BlockCsr<1>, Vec<f64>) {
    let h = cube(cells, 0.34);
    let n = h.load.len();
    let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::new(); n + ties];
    let (starts, cols, values) = h.a.to_scalar_csr().into_parts();
    for i in 0..n {
        rows[i] = (starts[i]..starts[i + 1]).map(|at| (cols[at] as u32, values[at])).collect();
    }
    for tie in 0..ties {
        for (k, weight) in [(tie * 5, 1.0), (tie * 5 + 1, -0.5), ((tie * 37 + 11) % n, 0.25)] {
            rows[k].push(((n + tie) as u32, weight));
            rows[n + tie].push((k as u32, weight));
        }
    }
    let mut a = BlockCsr::new(n + ties);
    for (i, row) in rows.iter_mut().enumerate() {
        row.sort_by_key(|(j, _)| *j);
        row.dedup_by_key(|(j, _)| *j);
        let (cols, blocks): (Vec<u32>, Vec<_>) = row.iter().map(|&(j, v)| (j, [[v]])).unzip();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    let b = h.load.iter().copied().chain((0..ties).map(|k| 1e-3 * k as f64)).collect();
    (a, b)
}

#[test]
fn saddle_point_systems_are_solved() {
    let (a, b) = saddle_point(4, 40);
    let n = b.len();
    let dense = a.to_dense();
    let lu = Mat::from_fn(n, n, |i, j| dense[i * n + j]).partial_piv_lu();
    let expected = lu.solve(Mat::from_fn(n, 1, |i, _| b[i]));
    let expected: Vec<f64> = (0..n).map(|i| expected[(i, 0)]).collect();
    let w = Subspace::new(n);
    for order in [FillOrder::Natural, FillOrder::MinimumDegree, FillOrder::NestedDissection] {
        let symbolic = Arc::new(Symbolic::indefinite(&a, order).unwrap());
        for method in [Method::Lblt, Method::Ldlt] {
            let factor = Factor::<1, f64>::new(symbolic.clone(), method, &a, &w).unwrap();
            let mut x = vec![0.0; n];
            let report = refined(&a, &factor, &w, &b, &mut x, 1e-12);
            assert!(report.stop == Stop::Converged && report.iterations <= 3, "{method:?}: {report:?}");
            assert!(distance(&x, &expected) <= 1e-8 * norm(&expected));
        }
        assert!(matches!(
            Factor::<1, f64>::new(symbolic, Method::Llt, &a, &w),
            Err(DirectError::NotPositiveDefinite { pivot, .. }) if pivot < 0.0
        ));
    }
}

/// Symmetric matrices of either sign, some diagonal entries zero, a part of the entries left out.
fn indefinite() -> impl Strategy<Value = (BlockCsr<1>, Vec<f64>)> {
    (1usize..12).prop_flat_map(|n| {
        let numbers = proptest::collection::vec(-1.0..1.0f64, n * n);
        let kinds = proptest::collection::vec(0u8..4, n * n);
        (numbers, kinds, proptest::collection::vec(-1.0..1.0f64, n)).prop_map(move |(v, kinds, b)| {
            let at = |i: usize, j: usize| i.max(j) * n + i.min(j);
            let stored = |i: usize, j: usize| i == j || kinds[at(i, j)] > 0;
            let entry = |i: usize, j: usize| if i == j && kinds[at(i, j)] == 0 { 0.0 } else { v[at(i, j)] };
            let mut a = BlockCsr::new(n);
            for i in 0..n {
                let cols: Vec<u32> = (0..n as u32).filter(|&j| stored(i, j as usize)).collect();
                let blocks: Vec<_> = cols.iter().map(|&j| [[entry(i, j as usize)]]).collect();
                a.set_row(i, &cols, &blocks).unwrap();
            }
            (a, b)
        })
    })
}

proptest! {
    /// A factor either is refused or solves; a well-conditioned full matrix is not refused.
    #[test]
    fn an_indefinite_matrix_is_solved_or_refused((a, b) in indefinite()) {
        let n = a.n_rows();
        let dense = a.to_dense();
        let full = dense.iter().all(|v| *v != 0.0);
        let singular_values = Mat::from_fn(n, n, |i, j| dense[i * n + j]).singular_values().unwrap();
        let condition = singular_values[0] / singular_values[n - 1];
        let symbolic = Arc::new(Symbolic::indefinite(&a, FillOrder::MinimumDegree).unwrap());
        for method in [Method::Lblt, Method::Ldlt] {
            match Factor::<1, f64>::new(symbolic.clone(), method, &a, &Subspace::new(n)) {
                Ok(factor) => {
                    let mut x = vec![0.0; n];
                    let report = refined(&a, &factor, &Subspace::new(n), &b, &mut x, 1e-10 * condition.clamp(1.0, 1e8));
                    prop_assert_eq!(report.stop, Stop::Converged, "{:?}, condition {:e}", report, condition);
                }
                Err(error) => {
                    let accepted = method == Method::Ldlt || !full || condition > 1e6;
                    prop_assert!(accepted, "{}, condition {:e}", error, condition);
                }
            }
        }
    }
}

#[test]
fn refinement_reports_what_it_cannot_mend() {
    let s = grid(4);
    let settings = RefineSettings { stop: rule(1e-12, Criterion::Reaction), max_iterations: 50 };
    let run = |m: &dyn Preconditioner, b: &[f64], x: &mut [f64]| {
        refine(&s.a, m, &s.w, b, x, &settings, &mut RefineWorkspace::new())
    };
    // The identity is no inverse: the first correction makes it worse and is taken back.
    let mut x = s.x0.clone();
    let report = run(&stylet_solver::precondition::Identity, &s.b, &mut x).unwrap();
    assert_eq!((report.stop, report.iterations, &x), (Stop::Stalled, 1, &s.x0));
    // Nothing asked beyond the start.
    let symbolic = Arc::new(Symbolic::new(&s.a, FillOrder::Natural).unwrap());
    let factor = Factor::<2, f64>::new(symbolic, Method::Llt, &s.a, &s.w).unwrap();
    let report = refine(
        &s.a,
        &factor,
        &s.w,
        &s.b,
        &mut x,
        &RefineSettings { max_iterations: 0, ..settings },
        &mut RefineWorkspace::new(),
    );
    assert_eq!(report.unwrap().stop, Stop::IterationLimit);
    assert_eq!(run(&factor, &s.b, &mut x).unwrap().iterations, 1);
    assert_eq!(run(&factor, &s.b, &mut x).unwrap().iterations, 0);
    // A tolerance that rounding forbids.
    let floor = RefineSettings { stop: rule(1e-30, Criterion::Reaction), ..settings };
    let report = refine(&s.a, &factor, &s.w, &s.b, &mut x, &floor, &mut RefineWorkspace::new()).unwrap();
    assert!(report.stop == Stop::Stalled && report.residual_norm < 1e-14 * norm(&s.b), "{report:?}");
    // Bad input.
    assert_eq!(run(&factor, &s.b[1..], &mut x), Err(RefineError::Shape { what: "b", dim: 32, len: 31 }));
    x[3] = f64::NAN;
    assert_eq!(run(&factor, &s.b, &mut x), Err(RefineError::NotFinite { what: "x", index: Some(3), iteration: 0 }));
    let mut b = s.b.clone();
    b[30] = f64::INFINITY;
    assert_eq!(
        run(&factor, &b, &mut [0.0; 32]),
        Err(RefineError::NotFinite { what: "b", index: Some(30), iteration: 0 })
    );
    let stop = RefineSettings { stop: rule(0.0, Criterion::Reaction), ..settings };
    let error = refine(&s.a, &factor, &s.w, &s.b, &mut [0.0; 32], &stop, &mut RefineWorkspace::new());
    assert!(matches!(error, Err(RefineError::StopRule(_))));
}
