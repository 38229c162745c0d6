//! Several right sides at once take the steps that each takes alone.

use crate::common::{System, distance, grid, krylov, system};
use proptest::prelude::*;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{
    CgSettings, CgWorkspace, KrylovReport, KrylovSettings, ManyCgError, ManyCgWorkspace, VectorError, many_cg,
    projected_cg,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Preconditioner};
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;

const NONE: KrylovReport = KrylovReport {
    stop: Stop::Stalled,
    iterations: 0,
    products: 0,
    residual_norm: 0.0,
    reaction_norm: 0.0,
    threshold: 0.0,
};

/// Right sides of different difficulty: the given one, zero, a single force, the first one scaled.
fn columns<const B: usize>(s: &System<B>) -> Vec<f64> {
    let n = s.b.len();
    let mut b = s.b.clone();
    b.extend(std::iter::repeat_n(0.0, n));
    b.extend((0..n).map(|i| f64::from(i == n / 2)));
    b.extend(s.b.iter().map(|v| 1e3 * v));
    b
}

fn check<const B: usize>(s: &System<B>, m: &impl Preconditioner, settings: &KrylovSettings) {
    let n = s.b.len();
    let b = columns(s);
    let mut x = s.x0.repeat(4);
    let mut reports = [NONE; 4];
    let mut ws = ManyCgWorkspace::new();
    many_cg(&s.a, m, &s.w, (&b, &mut x), &mut reports, settings, &mut ws).unwrap();
    for c in 0..4 {
        let range = c * n..(c + 1) * n;
        // The same bits as alone.
        let (mut one, mut report) = (s.x0.clone(), [NONE]);
        many_cg(&s.a, m, &s.w, (&b[range.clone()], &mut one), &mut report, settings, &mut ManyCgWorkspace::new())
            .unwrap();
        assert_eq!((&one[..], report[0]), (&x[range.clone()], reports[c]));
        if reports[c].threshold == 0.0 {
            // Neither forces nor reactions: the residual falls until its square underflows.
            assert!(reports[c].residual_norm < 1e-140, "{:?}", reports[c]);
            continue;
        }
        // The steps of the method for one right side.
        let mut y = s.x0.clone();
        let cg = CgSettings { stop: settings.stop, max_iterations: settings.max_iterations };
        let expected = projected_cg(&s.a, m, &s.w, &b[range.clone()], &mut y, &cg, &mut CgWorkspace::new()).unwrap();
        // The matrix adds up pᵀA p in another order. Where a solve takes as many steps as there are unknowns, or goes down to
        // rounding (its residual is then evaluated on the way), the count may differ by that.
        let verified = expected.products > expected.iterations + 1;
        let apart = reports[c].iterations.abs_diff(expected.iterations);
        let most = usize::from(expected.iterations >= n / 2);
        assert!(
            verified || (reports[c].stop == expected.stop && apart <= most),
            "{:?} is not {expected:?}",
            reports[c]
        );
        // No eigenvalue of these matrices is below 0.1: that bounds how far apart the two may be.
        let apart = (reports[c].residual_norm + expected.residual_norm) / 0.1;
        assert!(distance(&x[range], &y) <= apart + 1e-12 * (norm2(&y) + norm2(&s.x0)));
    }
    // From the solutions there is nothing to do.
    let looser = krylov(1e-4, Criterion::Reaction);
    if reports.iter().all(|report| report.stop == Stop::Converged) {
        many_cg(&s.a, m, &s.w, (&b, &mut x), &mut reports, &looser, &mut ws).unwrap();
        assert!(reports.iter().all(|report| report.iterations == 0 && report.stop == Stop::Converged));
    }
}

proptest! {
    #[test]
    fn columns_do_not_know_of_each_other_2d(s in system::<2>()) { check(&s, &Identity, &krylov(1e-5, Criterion::Reaction)); }

    #[test]
    fn columns_do_not_know_of_each_other_3d(s in system::<3>()) {
        check(&s, &BlockJacobi::new(&s.a, &s.w).unwrap(), &krylov(1e-5, Criterion::Reaction));
    }

    #[test]
    fn a_product_of_many_is_the_products_of_each(s in system::<2>(), k in 0usize..5) {
        let n = s.b.len();
        let x: Vec<f64> = (0..n * k).map(|i| (i as f64).sin()).collect();
        let (mut y, mut scratch) = (vec![0.0; n * k], vec![0.0; 2 * n]);
        s.a.apply_many(&Team::serial(), k, &x, &mut y, &mut scratch);
        for c in 0..k {
            let one: Vec<f64> = x.iter().skip(c).step_by(k).copied().collect();
            let mut product = vec![0.0; n];
            s.a.apply(&one, &mut product);
            prop_assert!(product.iter().zip(y.iter().skip(c).step_by(k)).all(|(a, b)| a.to_bits() == b.to_bits()));
        }
    }
}

#[test]
fn columns_stop_one_by_one() {
    let s = grid(30);
    check(&s, &BlockJacobi::new(&s.a, &s.w).unwrap(), &krylov(1e-9, Criterion::Reaction));
    check(&s, &Identity, &krylov(1e-19, Criterion::Reaction));
    check(&s, &Identity, &KrylovSettings { max_iterations: 7, ..krylov(1e-9, Criterion::External) });
}

#[test]
fn bad_input_is_refused_with_its_column() {
    let s = grid(5);
    let n = s.b.len();
    let good = krylov(1e-6, Criterion::External);
    let run = |b: &[f64], x: &[f64]| {
        let mut reports = [NONE; 2];
        many_cg(&s.a, &Identity, &s.w, (b, &mut x.to_vec()), &mut reports, &good, &mut ManyCgWorkspace::new())
    };
    let (b, x) = (s.b.repeat(2), s.x0.repeat(2));
    let length = |what| Err(ManyCgError::Length(VectorError::Length { what, expected: 2 * n, len: n }));
    assert_eq!(run(&b[n..], &x), length("b"));
    assert_eq!(run(&b, &x[n..]), length("x"));
    let not_finite = |what, index| {
        Err(ManyCgError::Vector { column: 1, error: VectorError::NotFinite { what, index, iteration: 0 } })
    };
    let mut bad = b.clone();
    bad[n + 3] = f64::NAN;
    assert_eq!(run(&bad, &x), not_finite("b", 3));
    assert_eq!(run(&b, &bad), not_finite("x", 3));
    let mut indefinite = s.a.clone();
    (0..25).for_each(|i| indefinite.add_to_block(i, i, &[[-9.0, 0.0], [0.0, -9.0]]).unwrap());
    let (mut x, mut reports) = (s.x0.repeat(2), [NONE; 2]);
    let error = many_cg(&indefinite, &Identity, &s.w, (&b, &mut x), &mut reports, &good, &mut ManyCgWorkspace::new());
    assert!(matches!(error, Err(ManyCgError::NotPositiveDefinite { column: 0, iteration: 1, .. })));
    // No columns: nothing to do.
    many_cg(&s.a, &Identity, &s.w, (&[], &mut []), &mut [], &good, &mut ManyCgWorkspace::new()).unwrap();
}

#[test]
fn threads_do_not_change_a_bit() {
    let s = grid(130);
    let m = BlockJacobi::new(&s.a, &s.w).unwrap();
    let b = columns(&s);
    let mut bits = Vec::new();
    for threads in [1, 2, 8] {
        let (mut x, mut reports) = (s.x0.repeat(4), [NONE; 4]);
        let mut ws = ManyCgWorkspace::on(Team::new(threads));
        many_cg(&s.a, &m, &s.w, (&b, &mut x), &mut reports, &krylov(1e-5, Criterion::Reaction), &mut ws).unwrap();
        assert!(reports.iter().all(|report| report.stop == Stop::Converged));
        bits.push(x.iter().map(|v| v.to_bits()).collect::<Vec<_>>());
    }
    assert!(bits[0] == bits[1] && bits[0] == bits[2]);
}
