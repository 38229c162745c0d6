//! Conjugate gradients on the model system "13k": counts, threads, number formats, looks on the way.

use crate::common::elasticity::{Cube, cube};
use crate::common::{distance, rule};
use stylet_solver::linear::{
    CgError, CgReport, CgSettings, CgWorkspace, Check, MixedWorkspace, mixed_cg, projected_cg, projected_cg_with_check,
};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::stop::{Criterion, Stop};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;
use stylet_solver::vector::norm2;
use stylet_solver::{LinearOperator, vector};

fn settings(tolerance: f64) -> CgSettings {
    CgSettings { stop: rule(tolerance, Criterion::External), max_iterations: 3000 }
}

fn relative_residual(a: &impl LinearOperator, b: &[f64], x: &[f64]) -> f64 {
    let mut r = vec![0.0; b.len()];
    a.apply(x, &mut r);
    vector::xpby(b, -1.0, &mut r);
    norm2(&r) / norm2(b)
}

/// Nodes on lines and planes and some fixed, and a matrix that fits.
fn constrained(s: &Cube) -> Subspace<3> {
    let mut w = Subspace::new(s.a.n_rows());
    for i in (0..s.a.n_rows()).step_by(37) {
        let constraint = match i % 3 {
            0 => Constraint::Fixed,
            1 => Constraint::Line([0.6, 0.0, 0.8]),
            _ => Constraint::Plane([0.0, 1.0, 0.0]),
        };
        w.set(i, constraint).unwrap();
    }
    w
}

fn solve(
    a: &impl LinearOperator,
    m: &impl Preconditioner,
    w: &Subspace<3>,
    b: &[f64],
    tolerance: f64,
    team: &Team,
) -> (Vec<f64>, CgReport) {
    let mut x = vec![0.0; b.len()];
    let report = projected_cg(a, m, w, b, &mut x, &settings(tolerance), &mut CgWorkspace::on(team)).unwrap();
    (x, report)
}

#[test]
fn block_jacobi_takes_the_published_iterations() {
    // Reference measurements to a true relative residual of 1e-5, of meshes jittered by other random numbers.
    for (poisson, published) in [(0.34, [9, 137, 248]), (0.49, [28, 494, 767])] {
        let s = cube(13, poisson);
        let w = Subspace::new(s.a.n_rows());
        for (a, published) in [s.dynamic(1e-3), s.dynamic(2e-2), s.a.clone()].into_iter().zip(published) {
            let m = BlockJacobi::new(&a, &w).unwrap();
            let (x, report) = solve(&Frozen::<3>::new(&a), &m, &w, &s.load, 1e-5, &Team::serial());
            assert_eq!(report.stop, Stop::Converged);
            assert!(relative_residual(&a, &s.load, &x) <= 1.01e-5);
            let ratio = report.iterations as f64 / f64::from(published);
            assert!((0.85..1.15).contains(&ratio), "{} iterations, {published} published", report.iterations);
        }
    }
}

/// A solve by a team, of the dynamic matrix or the frozen one.
type Solve<'a> = dyn Fn(&Team, bool) -> (Vec<f64>, CgReport) + 'a;

#[test]
fn threads_and_layout_do_not_change_a_bit() {
    let s = cube(13, 0.45);
    let w = constrained(&s);
    let frozen = Frozen::<3>::new(&s.a);
    let teams: Vec<Team> = [1, 2, 3, 8].map(Team::new).into();
    let check = |solve: &Solve| {
        let (x, report) = solve(&teams[0], false);
        for team in &teams {
            for dynamic in [false, true] {
                let (y, other) = solve(team, dynamic);
                assert_eq!(report, other);
                assert!(x.iter().zip(&y).all(|(x, y)| x.to_bits() == y.to_bits()), "{team:?}");
            }
        }
    };
    let block = BlockJacobi::new(&s.a, &w).unwrap();
    check(&|team, dynamic| match dynamic {
        true => solve(&s.a, &block, &w, &s.load, 1e-3, team),
        false => solve(&frozen, &block, &w, &s.load, 1e-3, team),
    });
    let point = Jacobi::new(&s.a, &w).unwrap();
    check(&|team, _| solve(&frozen, &point, &w, &s.load, 1e-2, team));
    check(&|team, _| solve(&frozen, &Identity, &w, &s.load, 1e-2, team));
}

fn mixed(
    a: &BlockCsr<3>,
    w: &Subspace<3>,
    b: &[f64],
    tolerance: f64,
    team: &Team,
) -> Result<(Vec<f64>, CgReport), CgError> {
    let mut x = vec![0.0; b.len()];
    let m = BlockJacobi::in_single_precision(a, w).unwrap();
    let (frozen, frozen32) = (Frozen::<3>::new(a), Frozen::<3, f32>::new(a));
    let report = mixed_cg(&frozen, &frozen32, &m, w, b, &mut x, &settings(tolerance), &mut MixedWorkspace::on(team))?;
    Ok((x, report))
}

#[test]
fn mixed_precision_reaches_what_double_precision_does() {
    for (poisson, tolerance) in [(0.34, 1e-5), (0.34, 1e-10), (0.45, 1e-8)] {
        let s = cube(13, poisson);
        let w = constrained(&s);
        for a in [s.dynamic(1e-3), s.a.clone()] {
            let (x, report) = mixed(&a, &w, &s.load, tolerance, &Team::serial()).unwrap();
            assert_eq!(report.stop, Stop::Converged, "{report:?}");
            let m = BlockJacobi::new(&a, &w).unwrap();
            let (y, double) = solve(&a, &m, &w, &s.load, tolerance, &Team::serial());
            assert!(distance(&x, &y) <= 1e4 * tolerance * norm2(&y));
            // At 1e-5 the f32 recurrence costs next to nothing; beyond, each restart forgets its directions.
            let most =
                if tolerance >= 1e-5 { 1.05 * double.iterations as f64 + 2.0 } else { 2.5 * double.iterations as f64 };
            assert!((report.iterations as f64) <= most, "{} against {}", report.iterations, double.iterations);
            for team in [2, 8].map(Team::new) {
                let (z, other) = mixed(&a, &w, &s.load, tolerance, &team).unwrap();
                assert_eq!(report, other);
                assert!(x.iter().zip(&z).all(|(x, z)| x.to_bits() == z.to_bits()));
            }
        }
    }
}

#[test]
fn mixed_precision_says_where_single_precision_ends() {
    // Condition 1e10: corrections in f32 do not converge.
    let mut a = BlockCsr::<3>::new(2);
    let stiff = |e: f64| [[1.0, 1.0 - e, 0.0], [1.0 - e, 1.0, 0.0], [0.0, 0.0, 1.0]];
    a.set_row(0, &[0], &[stiff(1e-10)]).unwrap();
    a.set_row(1, &[1], &[stiff(0.5)]).unwrap();
    let w = Subspace::<3>::new(2);
    let mut x = [0.0; 6];
    let b = [1.0, -1.0, 0.0, 1.0, 2.0, 3.0];
    let result = mixed_cg(
        &a,
        &Frozen::<3, f32>::new(&a),
        &Identity,
        &w,
        &b,
        &mut x,
        &settings(1e-12),
        &mut MixedWorkspace::new(),
    );
    match result {
        Ok(report) => assert_eq!(report.stop, Stop::Stalled),
        Err(error) => assert!(matches!(error, CgError::NotPositiveDefinite { .. }), "{error}"),
    }
    assert!(x.iter().all(|x| x.is_finite()));
    // Not a number in, an error out.
    let bad = [f64::NAN; 6];
    let error = mixed_cg(
        &a,
        &Frozen::<3, f32>::new(&a),
        &Identity,
        &w,
        &bad,
        &mut x,
        &settings(1e-3),
        &mut MixedWorkspace::new(),
    );
    assert!(matches!(error, Err(CgError::NotFinite { what: "b", index: 0, .. })));
    let error = mixed_cg(
        &a,
        &Frozen::<3, f32>::default(),
        &Identity,
        &w,
        &b,
        &mut x,
        &settings(1e-3),
        &mut MixedWorkspace::new(),
    );
    assert!(matches!(error, Err(CgError::Shape { what: "the operator in f32", .. })));
}

#[test]
fn a_look_on_the_way_costs_nothing_and_can_end_the_solve() {
    let s = cube(6, 0.34);
    let w = constrained(&s);
    let m = BlockJacobi::new(&s.a, &w).unwrap();
    let (x, plain) = solve(&s.a, &m, &w, &s.load, 1e-8, &Team::serial());
    let look = |tolerance: f64, answer: bool| {
        let (mut y, mut seen) = (vec![0.0; x.len()], Vec::new());
        let mut goes_on = |point: stylet_solver::linear::Checkpoint| {
            seen.push((point.iterations, point.residual_norm));
            assert_eq!(point.reaction.len(), 3 * w.n_constrained());
            answer
        };
        let check = Check { tolerance, goes_on: &mut goes_on };
        let ws = &mut CgWorkspace::new();
        let report = projected_cg_with_check(&s.a, &m, &w, &s.load, &mut y, &settings(1e-8), Some(check), ws).unwrap();
        (y, report, seen)
    };
    let (y, report, seen) = look(1e-3, true);
    assert_eq!((&x, plain), (&y, report));
    assert_eq!(seen.len(), 1);
    assert!(seen[0].0 > 0 && seen[0].0 < plain.iterations && seen[0].1 <= 1e-3 * norm2(&s.load));
    let (_, report, seen) = look(1e-3, false);
    assert_eq!((report.stop, report.iterations), (Stop::Abandoned, seen[0].0));
    // A start that meets it is looked at before the first iteration; a rule that makes no sense is refused.
    let (_, report, seen) = look(2.0, false);
    assert_eq!((report.stop, report.iterations, seen.len()), (Stop::Abandoned, 0, 1));
    let nonsense = Check { tolerance: f64::NAN, goes_on: &mut |_| true };
    let ws = &mut CgWorkspace::new();
    let refused = projected_cg_with_check(&s.a, &m, &w, &s.load, &mut [0.0; 3], &settings(1e-8), Some(nonsense), ws);
    assert!(matches!(refused, Err(CgError::StopRule(_))));
}
