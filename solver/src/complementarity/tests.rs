use super::*;
use crate::stop::Stop;
use proptest::prelude::*;

#[derive(Clone, Debug)]
struct Random {
    matrix: Vec<f64>,
    q: Vec<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Random {
    fn problem(&self) -> BoxProblem<'_> {
        BoxProblem { matrix: &self.matrix, q: &self.q, lower: &self.lower, upper: &self.upper }
    }
}

/// Knuth's MMIX generator.
struct Generator(u64);

impl Generator {
    /// In -1..1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    /// `W = G Gᵀ + s I`; one bound in six is infinite, one component in eight cannot move.
    fn problem(&mut self, n: usize) -> Random {
        let g: Vec<f64> = (0..n * n).map(|_| self.next()).collect();
        let shift = 10f64.powf(-1.0 + self.next());
        let entry =
            |i: usize, j: usize| (0..n).map(|k| g[i * n + k] * g[j * n + k]).sum::<f64>() + shift * f64::from(i == j);
        let matrix = (0..n * n).map(|k| entry(k / n, k % n)).collect();
        let q = (0..n).map(|_| 3.0 * self.next()).collect();
        let mut bound = |sign: f64| {
            if self.next() < -0.66 { sign * f64::INFINITY } else { sign * 0.5 * (self.next() + 0.9) }
        };
        let bounds: Vec<(f64, f64)> = (0..n).map(|_| (bound(-1.0), bound(1.0))).collect();
        let bounds = bounds.into_iter().map(|(l, u)| {
            let (l, u) = if l <= u { (l, u) } else { (u, l) };
            if self.next() < -0.75 && l.is_finite() { (l, l) } else { (l, u) }
        });
        let (lower, upper) = bounds.unzip();
        Random { matrix, q, lower, upper }
    }
}

/// The least eigenvalue is the shift at least, so that a violation by rounding alone is far below this.
const ACCEPT: f64 = 1e-9;

/// All `3^n` states, each solved by elimination; those whose conditions hold. A component that cannot move is not asked
/// whether it is between.
fn enumerate(p: &Random) -> Vec<(Vec<BoxState>, Vec<f64>)> {
    let n = p.q.len();
    let mut accepted = Vec::new();
    for code in 0..3usize.pow(n as u32) {
        let states: Vec<BoxState> = (0..n)
            .map(|i| [BoxState::Lower, BoxState::Between, BoxState::Upper][code / 3usize.pow(i as u32) % 3])
            .collect();
        let possible = |i: usize| match states[i] {
            BoxState::Lower => p.lower[i].is_finite(),
            BoxState::Between => p.lower[i] < p.upper[i],
            BoxState::Upper => p.upper[i].is_finite(),
        };
        if !(0..n).all(possible) {
            continue;
        }
        let lambda = eliminate(p, &states);
        let w = |i: usize| p.q[i] + (0..n).map(|j| p.matrix[i * n + j] * lambda[j]).sum::<f64>();
        let holds = |i: usize| match states[i] {
            BoxState::Lower => w(i) >= -ACCEPT,
            BoxState::Between => p.lower[i] - ACCEPT <= lambda[i] && lambda[i] <= p.upper[i] + ACCEPT,
            BoxState::Upper => w(i) <= ACCEPT,
        };
        if (0..n).all(holds) {
            accepted.push((states, lambda));
        }
    }
    accepted
}

/// Gauss elimination of `λ = bound` and `w = 0`, on the stack: there are half a million of these for twelve components.
fn eliminate(p: &Random, states: &[BoxState]) -> Vec<f64> {
    let n = p.q.len();
    let mut a = [[0.0; 13]; 12];
    for i in 0..n {
        match states[i] {
            BoxState::Between => {
                a[i][..n].copy_from_slice(&p.matrix[i * n..(i + 1) * n]);
                a[i][n] = -p.q[i];
            }
            state => {
                a[i][i] = 1.0;
                a[i][n] = if state == BoxState::Lower { p.lower[i] } else { p.upper[i] };
            }
        }
    }
    for k in 0..n {
        let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        a.swap(k, pivot);
        let row = a[k];
        for below in &mut a[k + 1..n] {
            let factor = below[k] / row[k];
            if factor != 0.0 {
                for j in k..=n {
                    below[j] -= factor * row[j];
                }
            }
        }
    }
    for k in (0..n).rev() {
        let sum: f64 = (k + 1..n).map(|j| a[k][j] * a[j][n]).sum();
        a[k][n] = (a[k][n] - sum) / a[k][k];
    }
    (0..n).map(|k| a[k][n]).collect()
}

fn agrees(p: &Random, ws: &mut BoxWorkspace) {
    let accepted = enumerate(p);
    assert_eq!(accepted.len(), 1, "{p:?}: {accepted:?}");
    let (states, expected) = &accepted[0];
    let mut lambda = vec![0.0; p.q.len()];
    let report = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), ws).unwrap();
    assert_eq!(report.stop, Stop::Converged, "{p:?}");
    assert_eq!(ws.states(), states, "{p:?}");
    assert!(lambda.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-8), "{lambda:?} {expected:?}");
    // From the solution, nothing is left to do.
    let warm = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), ws).unwrap();
    assert_eq!(warm.iterations, 0);

    lambda.fill(0.0);
    let report = projected_gauss_seidel(&p.problem(), &mut lambda, &GaussSeidelSettings::default(), ws).unwrap();
    assert_eq!(report.stop, Stop::Converged, "{p:?}");
    assert_eq!(ws.states(), states, "{p:?}");
    assert!(lambda.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{lambda:?} {expected:?}");
}

#[test]
fn a_thousand_small_problems_have_the_states_of_full_enumeration() {
    let (mut random, mut ws) = (Generator(1), BoxWorkspace::new());
    for k in 0..1000 {
        agrees(&random.problem(1 + k % 8), &mut ws);
    }
}

#[test]
fn twenty_larger_problems_have_the_states_of_full_enumeration() {
    let (mut random, mut ws) = (Generator(2), BoxWorkspace::new());
    for k in 0..20 {
        agrees(&random.problem(9 + k % 4), &mut ws);
    }
}

#[test]
fn sixty_contacts_take_few_pivots_and_fewer_from_a_neighbouring_state() {
    let (mut random, mut ws) = (Generator(3), BoxWorkspace::new());
    let (mut cold, mut warm) = (0, 0);
    for _ in 0..50 {
        let mut p = random.problem(60);
        let mut lambda = vec![0.0; 60];
        ws.set_states(&[]);
        cold += block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), &mut ws).unwrap().iterations;
        for q in &mut p.q {
            *q *= 1.01;
        }
        let report = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), &mut ws).unwrap();
        assert!(report.stop == Stop::Converged && report.residual < 1e-9, "{report:?}");
        warm += report.iterations;
    }
    assert!(cold <= 50 * 10 && 2 * warm <= cold, "{cold} pivots cold, {warm} warm");
}

proptest! {
    /// One component at a time from the start: the safeguard alone solves the problem, too.
    #[test]
    fn least_index_pivoting_ends(seed in 0u64..1_000_000, n in 1usize..30) {
        let p = Generator(seed).problem(n);
        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
        let mut ws = BoxWorkspace::new();
        let single = PivotingSettings { patience: 0, max_pivots: 100_000 };
        prop_assert_eq!(block_pivoting(&p.problem(), &mut a, &single, &mut ws).unwrap().stop, Stop::Converged);
        ws.set_states(&[]);
        let report = block_pivoting(&p.problem(), &mut b, &PivotingSettings::default(), &mut ws).unwrap();
        prop_assert_eq!(report.stop, Stop::Converged);
        prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-7));
    }

    #[test]
    fn overrelaxed_sweeps_find_the_same(seed in 0u64..1_000_000, n in 1usize..20, relaxation in 0.8..1.5) {
        let p = Generator(seed).problem(n);
        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
        let mut ws = BoxWorkspace::new();
        block_pivoting(&p.problem(), &mut a, &PivotingSettings::default(), &mut ws).unwrap();
        let settings = GaussSeidelSettings { relaxation, newton: false, max_sweeps: 200_000, ..Default::default() };
        let report = projected_gauss_seidel(&p.problem(), &mut b, &settings, &mut ws).unwrap();
        prop_assert!(report.stop != Stop::IterationLimit && report.residual < 1e-3, "{:?}", report);
        if report.stop == Stop::Converged {
            prop_assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-5), "{:?} {:?}", a, b);
        }
        prop_assert!((0..n).all(|i| p.lower[i] <= b[i] && b[i] <= p.upper[i]));
    }
}

/// Two equal contacts: W is singular, the sum of the forces is all that matters.
#[test]
fn a_singular_matrix_is_an_error_or_a_solution() {
    let p = Random { matrix: vec![1.0, 1.0, 1.0, 1.0], q: vec![-1.0, -1.0], lower: vec![0.0; 2], upper: vec![2.0; 2] };
    let (mut lambda, mut ws) = (vec![0.0; 2], BoxWorkspace::new());
    let error = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), &mut ws).unwrap_err();
    assert_eq!(error, BoxError::NotPositiveDefinite { index: 1, pivot: 0.0 });
    // Sweeps find one of the solutions.
    let settings = GaussSeidelSettings { newton: false, ..Default::default() };
    let mut lambda = [0.0; 2];
    let report = projected_gauss_seidel(&p.problem(), &mut lambda, &settings, &mut ws).unwrap();
    assert_eq!((report.stop, lambda[0] + lambda[1]), (Stop::Converged, 1.0));
}

/// `λ = 0` exactly at a bound with `w = 0`: either state will do.
#[test]
fn a_degenerate_component_is_solved() {
    let p = Random { matrix: vec![2.0, 1.0, 1.0, 2.0], q: vec![-2.0, -1.0], lower: vec![0.0; 2], upper: vec![5.0; 2] };
    let (mut lambda, mut ws) = (vec![0.0; 2], BoxWorkspace::new());
    let report = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged);
    assert!((lambda[0] - 1.0).abs() < 1e-15 && lambda[1].abs() < 1e-15, "{lambda:?}");
}

#[test]
fn an_indefinite_matrix_ends_honestly() {
    let p = Random {
        matrix: vec![1.0, 3.0, 3.0, 1.0],
        q: vec![-1.0, -1.0],
        lower: vec![f64::NEG_INFINITY; 2],
        upper: vec![f64::INFINITY; 2],
    };
    let (mut lambda, mut ws) = (vec![0.0; 2], BoxWorkspace::new());
    let error = block_pivoting(&p.problem(), &mut lambda, &PivotingSettings::default(), &mut ws).unwrap_err();
    assert_eq!(error, BoxError::NotPositiveDefinite { index: 1, pivot: -8.0 });
    // The sweeps diverge; the start, of residual 1, is the best.
    let settings = GaussSeidelSettings { newton: false, ..Default::default() };
    let report = projected_gauss_seidel(&p.problem(), &mut lambda.clone(), &settings, &mut ws).unwrap();
    assert!(report.stop == Stop::Stalled && report.residual <= 1.0, "{report:?}");
    // Bounds on both sides: an outcome, whatever the pivots do.
    let boxed = Random { lower: vec![-1.0; 2], upper: vec![1.0; 2], ..p };
    ws.set_states(&[BoxState::Lower, BoxState::Upper]);
    if let Ok(report) = block_pivoting(&boxed.problem(), &mut lambda, &PivotingSettings::default(), &mut ws) {
        assert!(report.stop != Stop::Converged || report.residual < 1e-12);
    }
}

#[test]
fn bad_problems_are_refused() {
    let good = Generator(4).problem(3);
    let solve = |p: &Random| {
        block_pivoting(&p.problem(), &mut vec![0.0; p.q.len()], &PivotingSettings::default(), &mut BoxWorkspace::new())
            .map(|_| ())
    };
    let mut bad = good.clone();
    bad.lower.pop();
    let shape = BoxError::Shape { what: "the list of lower bounds", len: 2, expected: 3 };
    assert_eq!(solve(&bad), Err(shape));
    let mut bad = good.clone();
    bad.q[1] = f64::NAN;
    assert_eq!(solve(&bad), Err(BoxError::NotFinite { what: "q", index: 1 }));
    let mut bad = good.clone();
    (bad.lower[2], bad.upper[2]) = (1.0, 0.0);
    assert_eq!(solve(&bad), Err(BoxError::Bounds { index: 2, lower: 1.0, upper: 0.0 }));
    (bad.lower[2], bad.upper[2]) = (f64::NAN, 0.0);
    assert!(matches!(solve(&bad), Err(BoxError::Bounds { index: 2, .. })));
    (bad.lower[2], bad.upper[2]) = (f64::INFINITY, f64::INFINITY);
    assert!(matches!(solve(&bad), Err(BoxError::Bounds { index: 2, .. })));
    let mut bad = good.clone();
    bad.matrix[1] += 1.0;
    assert!(matches!(solve(&bad), Err(BoxError::NotSymmetric { row: 1, col: 0, .. })));
    let mut bad = good.clone();
    bad.matrix[8] = 0.0;
    assert_eq!(solve(&bad), Err(BoxError::NotPositiveDefinite { index: 2, pivot: 0.0 }));
    let empty = Random { matrix: vec![], q: vec![], lower: vec![], upper: vec![] };
    assert_eq!(solve(&empty), Ok(()));
    for relaxation in [0.0, 2.0, f64::NAN] {
        let settings = GaussSeidelSettings { relaxation, ..Default::default() };
        let outcome = projected_gauss_seidel(&good.problem(), &mut [0.0; 3], &settings, &mut BoxWorkspace::new());
        assert!(matches!(outcome, Err(BoxError::Settings { what: "relaxation", .. })));
    }
}
