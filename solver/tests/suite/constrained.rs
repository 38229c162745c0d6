//! Constraints `C x = d`: four methods against the dense solution of the coupled system, and against each other.

use crate::common::kkt::{Constrained, constrained, dense_kkt};
use crate::common::{distance, from_dense, grid, krylov, residual};
use proptest::prelude::*;
use stylet_solver::linear::{
    CgSettings, ConstrainedError, ConstrainedWorkspace, ConstraintError, ConstraintPreconditioner, Constraints,
    Elimination, EliminationError, EliminationWorkspace, KktError, KktOperator, KktWorkspace, KrylovSettings,
    SchurDiagonal, VectorError, constrained_cg, elimination_cg, kkt_cg, kkt_minres,
};
use stylet_solver::precondition::Identity;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

fn cg(settings: &KrylovSettings) -> CgSettings {
    CgSettings { stop: settings.stop, max_iterations: settings.max_iterations }
}

/// All four methods on one problem; `false` if its constraints are too near to dependence to compare digits.
fn check<const B: usize>(s: &Constrained<B>) -> bool {
    let (a, w, b, x0) = (&s.system.a, &s.system.w, &s.system.b, &s.system.x0);
    let Ok(m) = ConstraintPreconditioner::new(a, w, &s.c) else {
        return false;
    };
    let (exact, multipliers, pivot) = dense_kkt(a, w, &s.c, b, x0);
    if pivot < 1e-2 {
        return false;
    }
    let settings = krylov(1e-11, Criterion::Reaction);
    let rows = s.c.n_rows();
    let close = |x: &[f64], what: &str| {
        assert!(distance(x, &exact) <= 1e-6 * norm2(&exact).max(1.0), "{what}: {x:?} is not {exact:?}");
    };

    // Constraint preconditioning.
    let (mut x, mut lambda) = (x0.clone(), vec![0.0; rows]);
    let mut ws = ConstrainedWorkspace::new();
    let report = constrained_cg(a, &m, b, &mut x, &mut lambda, &settings, &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    close(&x, "constrained_cg");
    assert!(distance(&lambda, &multipliers) <= 1e-5 * norm2(&multipliers).max(1.0));
    assert!(report.constraint_norm <= 1e-12 * (1.0 + norm2(&exact)));
    let mut r = residual(a, b, &x);
    s.c.add_transposed(-1.0, &lambda, &mut r);
    w.project(&mut r);
    assert!((norm2(&r) - report.residual_norm).abs() <= 1e-11 * (1.0 + norm2(b) + norm2(&lambda)));
    let looser = krylov(1e-8, Criterion::Reaction);
    let again = constrained_cg(a, &m, b, &mut x, &mut lambda, &looser, &mut ws).unwrap();
    assert_eq!((again.stop, again.iterations), (Stop::Converged, 0));

    // MINRES, without and with a preconditioner.
    let k = KktOperator::new(a, w, &s.c).unwrap();
    let mut ws = KktWorkspace::new();
    for preconditioned in [false, true] {
        let (mut x, mut lambda) = (x0.clone(), vec![0.0; rows]);
        let report = if preconditioned {
            kkt_minres(&k, &SchurDiagonal(&m), b, &mut x, &mut lambda, &settings, &mut ws).unwrap()
        } else {
            kkt_minres(&k, &Identity, b, &mut x, &mut lambda, &settings, &mut ws).unwrap()
        };
        assert_eq!(report.stop, Stop::Converged, "{report:?}");
        close(&x, "kkt_minres");
        assert!(distance(&lambda, &multipliers) <= 1e-5 * norm2(&multipliers).max(1.0));
        let again = kkt_minres(&k, &Identity, b, &mut x, &mut lambda, &looser, &mut ws).unwrap();
        assert_eq!((again.stop, again.iterations), (Stop::Converged, 0));
    }

    // Conjugate gradients on the indefinite matrix: where they converge, and they say whether they do.
    let (mut x, mut lambda) = (x0.clone(), vec![0.0; rows]);
    let report = kkt_cg(&k, &SchurDiagonal(&m), b, &mut x, &mut lambda, &settings, &mut ws).unwrap();
    if report.stop == Stop::Converged {
        close(&x, "kkt_cg");
        let again = kkt_cg(&k, &SchurDiagonal(&m), b, &mut x, &mut lambda, &looser, &mut ws).unwrap();
        assert_eq!((again.stop, again.iterations), (Stop::Converged, 0));
    }

    // Elimination.
    let e = Elimination::new(a, w, &s.c).unwrap();
    assert_eq!(e.dependent(), &[] as &[usize]);
    let mut x = x0.clone();
    let mut ws = EliminationWorkspace::new();
    let report = elimination_cg(a, &e, b, &mut x, &cg(&settings), &mut ws).unwrap();
    assert_ne!(report.stop, Stop::IterationLimit);
    close(&x, "elimination_cg");
    let mut gap = vec![0.0; rows];
    s.c.gap(&x, &mut gap);
    assert!(norm2(&gap) <= 1e-10 * (1.0 + norm2(&exact)));
    let again = elimination_cg(a, &e, b, &mut x, &cg(&looser), &mut ws).unwrap();
    assert_eq!((again.stop, again.iterations), (Stop::Converged, 0));
    true
}

proptest! {
    #[test]
    fn four_methods_agree_with_a_dense_factorisation_2d(s in constrained::<2>()) { prop_assume!(check(&s)); }

    #[test]
    fn four_methods_agree_with_a_dense_factorisation_3d(s in constrained::<3>()) { prop_assume!(check(&s)); }

    /// More steps, less energy, and every iterate satisfies the constraints.
    #[test]
    fn constrained_steps_lower_the_energy(s in constrained::<2>()) {
        let (a, w, b, x0) = (&s.system.a, &s.system.w, &s.system.b, &s.system.x0);
        let m = ConstraintPreconditioner::new(a, w, &s.c);
        prop_assume!(m.is_ok());
        let m = m.unwrap();
        // As above: not too near to dependence to compare digits.
        prop_assume!(dense_kkt(a, w, &s.c, b, x0).2 >= 1e-2);
        let mut before = f64::INFINITY;
        for max_iterations in 0..8 {
            let (mut x, mut lambda) = (x0.clone(), vec![0.0; s.c.n_rows()]);
            let settings = KrylovSettings { max_iterations, ..krylov(1e-10, Criterion::External) };
            let report = constrained_cg(a, &m, b, &mut x, &mut lambda, &settings, &mut ConstrainedWorkspace::new()).unwrap();
            prop_assert!(report.constraint_norm <= 1e-9 * (1.0 + norm2(&x)));
            let r = residual(a, b, &x);
            let energy: f64 = x.iter().zip(b).zip(&r).map(|((x, b), r)| -0.5 * x * (b + r)).sum();
            prop_assert!(energy <= before + 1e-8 * (1.0 + energy.abs()), "{energy} after {before}");
            before = energy;
        }
    }
}

/// The grid, neighbours tied in pairs: `count` rows.
fn tied_grid(n: usize, count: usize) -> Constrained<2> {
    let system = grid(n);
    let mut c = Constraints::new(system.b.len());
    let free: Vec<usize> = (0..n * n).filter(|v| v % n != 0 && v % n != n / 2 && v % 4 == 1).collect();
    for k in 0..count {
        let (v, axis) = (free[k / 2], k % 2);
        c.push(&[2 * v + axis, 2 * v + 2 + axis], &[1.0, -1.0], 0.01 * (k % 3) as f64).unwrap();
    }
    Constrained { system, c }
}

#[cfg(feature = "direct")]
#[test]
fn many_constraints_are_factored_sparsely() {
    let s = tied_grid(70, 1000); // above the dense limit
    let (a, w, b) = (&s.system.a, &s.system.w, &s.system.b);
    let m = ConstraintPreconditioner::new(a, w, &s.c).unwrap();
    let settings = krylov(1e-10, Criterion::Reaction);
    let (mut x, mut lambda) = (s.system.x0.clone(), vec![0.0; 1000]);
    let report = constrained_cg(a, &m, b, &mut x, &mut lambda, &settings, &mut ConstrainedWorkspace::new()).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    let e = Elimination::new(a, w, &s.c).unwrap();
    let mut y = s.system.x0.clone();
    elimination_cg(a, &e, b, &mut y, &cg(&settings), &mut EliminationWorkspace::new()).unwrap();
    assert!(distance(&x, &y) <= 1e-7 * norm2(&y));
    // A row that repeats another is named there too.
    let mut c = s.c.clone();
    c.push(&[c.row(40).0[0], c.row(40).0[1]], &[-2.0, 2.0], 0.0).unwrap();
    let error = ConstraintPreconditioner::new(a, w, &c).unwrap_err();
    assert_eq!(error, ConstraintError::Dependent { row: 1000 }.into());
}

#[cfg(not(feature = "direct"))]
#[test]
fn many_constraints_need_a_sparse_factor() {
    let s = tied_grid(70, 1000);
    let error = ConstraintPreconditioner::new(&s.system.a, &s.system.w, &s.c).unwrap_err();
    assert_eq!(error, ConstraintError::TooMany { rows: 1000, limit: 800 }.into());
}

#[test]
fn dependent_constraints_are_named_and_contradictory_ones_refused() {
    let s = grid(6);
    let mut c = Constraints::new(s.b.len());
    c.push(&[20, 30], &[1.0, 1.0], 1.0).unwrap();
    c.push(&[30, 40], &[1.0, -2.0], 0.5).unwrap();
    c.push(&[20, 40], &[3.0, 6.0], 1.5).unwrap(); // three times the difference
    let error = ConstraintPreconditioner::new(&s.a, &s.w, &c).unwrap_err();
    assert_eq!(error, ConstraintError::Dependent { row: 2 }.into());
    let mut e = Elimination::new(&s.a, &s.w, &c).unwrap();
    assert_eq!(e.dependent(), [2]);
    let settings = krylov(1e-10, Criterion::External);
    let (mut x, mut ws) = (s.x0.clone(), EliminationWorkspace::new());
    let report = elimination_cg(&s.a, &e, &s.b, &mut x, &cg(&settings), &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    // MINRES does not mind, and finds the same.
    let (mut y, mut lambda, mut kkt) = (s.x0.clone(), vec![0.0; 3], KktWorkspace::new());
    let k = KktOperator::new(&s.a, &s.w, &c).unwrap();
    let report = kkt_minres(&k, &Identity, &s.b, &mut y, &mut lambda, &settings, &mut kkt).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    assert!(distance(&x, &y) <= 1e-6 * norm2(&x));
    // Off by a little.
    e.set_right_side(&[1.0, 0.5, 1.5 + 1e-3]).unwrap();
    let error = elimination_cg(&s.a, &e, &s.b, &mut x, &cg(&settings), &mut ws).unwrap_err();
    assert!(
        matches!(error, EliminationError::Constraint(ConstraintError::Contradictory { row: 2, gap }) if (gap - 1e-3).abs() < 1e-9),
        "{error}"
    );
    c.right_side_mut()[2] += 1.0;
    let k = KktOperator::new(&s.a, &s.w, &c).unwrap();
    let report = kkt_minres(&k, &Identity, &s.b, &mut s.x0.clone(), &mut [0.0; 3], &settings, &mut kkt).unwrap();
    assert_eq!(report.stop, Stop::Stalled, "{report:?}");
    // A row on a fixed node says nothing, or contradicts it.
    let mut c = Constraints::new(s.b.len());
    c.push(&[0, 1], &[1.0, 1.0], 0.0).unwrap();
    assert_eq!(
        ConstraintPreconditioner::new(&s.a, &s.w, &c).unwrap_err(),
        ConstraintError::Dependent { row: 0 }.into()
    );
    let mut e = Elimination::new(&s.a, &s.w, &c).unwrap();
    assert!(elimination_cg(&s.a, &e, &s.b, &mut s.x0.clone(), &cg(&settings), &mut ws).is_ok());
    e.set_right_side(&[0.1]).unwrap();
    let error = elimination_cg(&s.a, &e, &s.b, &mut s.x0.clone(), &cg(&settings), &mut ws).unwrap_err();
    assert_eq!(error, ConstraintError::Contradictory { row: 0, gap: 0.1 }.into());
}

#[test]
fn negative_curvature_on_the_kernel_names_its_iteration() {
    let a = from_dense::<2>(3, |i, j| if i == j { [1.0, 2.0, -1.0, 3.0, 1.0, 1.0][i] } else { 0.0 });
    let spd = from_dense::<2>(3, |i, j| f64::from(i == j));
    let (w, b) = (Subspace::new(3), [1.0; 6]);
    let settings = krylov(1e-10, Criterion::External);
    let run = |c: &Constraints| {
        let m = ConstraintPreconditioner::new(&spd, &w, c).unwrap();
        let mut x = vec![0.0; 6];
        constrained_cg(&a, &m, &b, &mut x, &mut [0.0], &settings, &mut ConstrainedWorkspace::new()).map(|_| x)
    };
    let mut c = Constraints::new(6);
    c.push(&[0, 1], &[1.0, 1.0], 0.0).unwrap();
    let error = run(&c).unwrap_err();
    assert!(matches!(error, ConstrainedError::NegativeCurvature { iteration: 1.., curvature } if curvature <= 0.0));
    // A constraint that takes the negative direction away.
    c.clear();
    c.push(&[2], &[2.0], 1.0).unwrap();
    assert!(distance(&run(&c).unwrap(), &[1.0, 0.5, 0.5, 1.0 / 3.0, 1.0, 1.0]) < 1e-8);
}

#[test]
fn conjugate_gradients_on_the_indefinite_matrix_can_break_down() {
    let s = tied_grid(6, 2);
    let k = KktOperator::new(&s.system.a, &s.system.w, &s.c).unwrap();
    let mut c = s.c.clone();
    c.right_side_mut().fill(1.0);
    let broken = KktOperator::new(&s.system.a, &s.system.w, &c).unwrap();
    let (mut x, mut lambda) = (s.system.x0.clone(), [0.0; 2]);
    let (settings, mut ws) = (krylov(1e-9, Criterion::External), KktWorkspace::new());
    let zero = vec![0.0; x.len()];
    let report = kkt_cg(&broken, &Identity, &zero, &mut x, &mut lambda, &settings, &mut ws).unwrap();
    assert_eq!((report.stop, report.iterations), (Stop::Stalled, 1));
    assert_eq!((&x, lambda), (&s.system.x0, [0.0; 2])); // the best iterate is the start
    let report = kkt_cg(&k, &Identity, &s.system.b, &mut x, &mut lambda, &settings, &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    assert!(report.negative_steps > 0, "{report:?}");
    // The budget keeps the best.
    let short = KrylovSettings { max_iterations: 3, ..settings };
    let (mut x, mut lambda) = (s.system.x0.clone(), [0.0; 2]);
    let start = kkt_cg(
        &k,
        &Identity,
        &s.system.b,
        &mut x,
        &mut lambda,
        &KrylovSettings { max_iterations: 0, ..settings },
        &mut ws,
    );
    let report = kkt_cg(&k, &Identity, &s.system.b, &mut x, &mut lambda, &short, &mut ws).unwrap();
    assert_eq!((report.stop, report.iterations), (Stop::IterationLimit, 3));
    assert!(report.residual_norm <= start.unwrap().residual_norm);
}

#[test]
fn bad_input_is_refused_with_its_place() {
    let s = tied_grid(6, 2);
    let (a, w, b, x0): (&BlockCsr<2>, _, _, _) = (&s.system.a, &s.system.w, &s.system.b, &s.system.x0);
    let shape = ConstraintError::Shape { what: "the subspace", dim: 72, len: 70 };
    assert_eq!(ConstraintPreconditioner::new(a, &Subspace::new(35), &s.c).unwrap_err(), shape.into());
    assert_eq!(Elimination::new(a, &Subspace::new(35), &s.c).unwrap_err(), shape.into());
    let other = Constraints::new(70);
    assert!(matches!(KktOperator::new(a, w, &other), Err(ConstraintError::Shape { .. })));
    let mut m = ConstraintPreconditioner::new(a, w, &s.c).unwrap();
    assert!(matches!(m.set_right_side(&[1.0]), Err(ConstrainedError::Vector(VectorError::Length { .. }))));
    let nan = m.set_right_side(&[1.0, f64::NAN]);
    assert!(matches!(nan, Err(ConstrainedError::Constraint(ConstraintError::RightSide { row: 1, .. }))));
    let (e, k) = (Elimination::new(a, w, &s.c).unwrap(), KktOperator::new(a, w, &s.c).unwrap());
    let settings = krylov(1e-9, Criterion::External);
    let all = |b: &[f64], x: &[f64]| {
        let (mut x, mut lambda) = (x.to_vec(), [0.0; 2]);
        let one =
            constrained_cg(a, &m, b, &mut x, &mut lambda, &settings, &mut ConstrainedWorkspace::new()).unwrap_err();
        let two = elimination_cg(a, &e, b, &mut x, &cg(&settings), &mut EliminationWorkspace::new()).unwrap_err();
        let three = kkt_cg(&k, &Identity, b, &mut x, &mut lambda, &settings, &mut KktWorkspace::new()).unwrap_err();
        let four = kkt_minres(&k, &Identity, b, &mut x, &mut lambda, &settings, &mut KktWorkspace::new()).unwrap_err();
        let ConstrainedError::Vector(error) = one else { panic!("{one}") };
        assert_eq!((two, three, four), (error.into(), error.into(), KktError::Vector(error)));
        error
    };
    assert_eq!(all(&b[1..], x0), VectorError::Length { what: "b", expected: 72, len: 71 });
    assert_eq!(all(b, &x0[1..]), VectorError::Length { what: "x", expected: 72, len: 71 });
    let mut bad = b.clone();
    bad[5] = f64::INFINITY;
    assert_eq!(all(&bad, x0), VectorError::NotFinite { what: "b", index: 5, iteration: 0 });
    assert_eq!(all(b, &bad), VectorError::NotFinite { what: "x", index: 5, iteration: 0 });
}

#[test]
fn nothing_to_solve_is_solved() {
    // No constraints, and no forces.
    let mut s = tied_grid(5, 0);
    s.system.b.fill(0.0);
    let (a, w, b) = (&s.system.a, &s.system.w, &s.system.b);
    let settings = krylov(1e-9, Criterion::External);
    let m = ConstraintPreconditioner::new(a, w, &s.c).unwrap();
    let report =
        constrained_cg(a, &m, b, &mut s.system.x0.clone(), &mut [], &settings, &mut ConstrainedWorkspace::new());
    assert_eq!(report.unwrap().iterations, 0);
    // A subspace that holds everything.
    let mut w = Subspace::new(25);
    (0..25).for_each(|node| w.set(node, Constraint::Fixed).unwrap());
    let e = Elimination::new(a, &w, &s.c).unwrap();
    let mut x = vec![2.0; 50];
    let report = elimination_cg(a, &e, b, &mut x, &cg(&settings), &mut EliminationWorkspace::new()).unwrap();
    assert_eq!((report.stop, report.iterations), (Stop::Converged, 0));
    assert_eq!(x, [2.0; 50]);
    let k = KktOperator::new(a, &w, &s.c).unwrap();
    let report = kkt_minres(&k, &Identity, b, &mut x, &mut [], &settings, &mut KktWorkspace::new()).unwrap();
    assert_eq!((report.stop, report.iterations), (Stop::Converged, 0));
    // Nothing at all.
    let (empty, w, c) = (BlockCsr::<2>::new(0), Subspace::new(0), Constraints::new(0));
    let m = ConstraintPreconditioner::new(&empty, &w, &c).unwrap();
    let report =
        constrained_cg(&empty, &m, &[], &mut [], &mut [], &settings, &mut ConstrainedWorkspace::new()).unwrap();
    assert_eq!(report.stop, Stop::Converged);
}

#[test]
fn a_residual_that_underflows_is_no_error() {
    // Nothing pulls and nothing is held: the threshold is zero, and the residual falls for as long as it can.
    let a = from_dense::<2>(4, |i, j| if i == j { 1.0 + i as f64 } else { 0.1 });
    let (w, b, start) = (Subspace::new(4), [0.0; 8], [1.0; 8]);
    let mut c = Constraints::new(8);
    c.push(&[0, 5], &[1.0, 2.0], 0.0).unwrap();
    let settings = krylov(1e-6, Criterion::External);
    let m = ConstraintPreconditioner::new(&a, &w, &c).unwrap();
    let k = KktOperator::new(&a, &w, &c).unwrap();
    let (mut x, mut lambda) = (start, [0.0]);
    let report = constrained_cg(&a, &m, &b, &mut x, &mut lambda, &settings, &mut ConstrainedWorkspace::new()).unwrap();
    assert!(report.stop != Stop::IterationLimit && norm2(&x) < 1e-12, "{report:?}");
    let (mut x, mut lambda) = (start, [0.0]);
    let report = kkt_cg(&k, &SchurDiagonal(&m), &b, &mut x, &mut lambda, &settings, &mut KktWorkspace::new()).unwrap();
    assert!(report.stop != Stop::IterationLimit && norm2(&x) < 1e-12, "{report:?}");
    let (mut x, mut lambda) = (start, [0.0]);
    let report =
        kkt_minres(&k, &SchurDiagonal(&m), &b, &mut x, &mut lambda, &settings, &mut KktWorkspace::new()).unwrap();
    assert!(report.stop != Stop::IterationLimit && norm2(&x) < 1e-12, "{report:?}");
}

#[test]
fn threads_do_not_change_a_bit() {
    let s = tied_grid(130, 40);
    let (a, w, b) = (&s.system.a, &s.system.w, &s.system.b);
    let m = ConstraintPreconditioner::new(a, w, &s.c).unwrap();
    let k = KktOperator::new(a, w, &s.c).unwrap();
    let settings = krylov(1e-6, Criterion::Reaction);
    let mut bits = Vec::new();
    for threads in [1, 2, 8] {
        let team = Team::new(threads);
        let (mut x, mut lambda) = (s.system.x0.clone(), vec![0.0; 40]);
        let mut ws = ConstrainedWorkspace::on(team.clone());
        constrained_cg(a, &m, b, &mut x, &mut lambda, &settings, &mut ws).unwrap();
        let (mut y, mut mu) = (s.system.x0.clone(), vec![0.0; 40]);
        kkt_minres(&k, &SchurDiagonal(&m), b, &mut y, &mut mu, &settings, &mut KktWorkspace::on(team.clone())).unwrap();
        let (mut z, mut nu) = (s.system.x0.clone(), vec![0.0; 40]);
        kkt_cg(&k, &SchurDiagonal(&m), b, &mut z, &mut nu, &settings, &mut KktWorkspace::on(team)).unwrap();
        let all = x.iter().chain(&lambda).chain(&y).chain(&mu).chain(&z).chain(&nu);
        bits.push(all.map(|v| v.to_bits()).collect::<Vec<_>>());
    }
    assert!(bits[0] == bits[1] && bits[0] == bits[2]);
}
