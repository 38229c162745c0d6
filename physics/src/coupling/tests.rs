//! The search against all `3^q` states of dense systems: tissue and needle matrices, tied across the needle.

use super::*;
use SlipState::{Backward, Forward, Static};
use nalgebra::{DMatrix, DVector, Vector3};

/// Knuth's MMIX generator.
struct Generator(u64);

impl Generator {
    /// In -1..1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }

    /// Symmetric, eigenvalues from `least` to about `n` times `size`.
    fn matrix(&mut self, n: usize, size: f64, least: f64) -> DMatrix<f64> {
        let g = DMatrix::from_fn(n, n, |_, _| self.next());
        &g * g.transpose() * size + DMatrix::identity(n, n) * least
    }

    fn vector(&mut self, n: usize, size: f64) -> DVector<f64> {
        DVector::from_fn(n, |_, _| size * self.next())
    }
}

/// Displacements `x` of the tissue and `y` of the needle, `A x = b + R c` and `B y = b' − R c`, with forces `c` in local frames.
struct Dense {
    tissue: DMatrix<f64>,
    needle: DMatrix<f64>,
    load: DVector<f64>,
    needle_load: DVector<f64>,
    tangents: Vec<Vector3<f64>>,
    limits: Vec<SlipLimits>,
    /// 1, or -1 for friction that pushes the slip on.
    sign: f64,
    /// How many solves were asked for.
    solves: usize,
}

impl Dense {
    /// `q` nodes, a needle that is a hundred times stiffer than the tissue, friction of up to `friction`, and a tip that may cut.
    fn random(generator: &mut Generator, q: usize, friction: f64, ratio: f64) -> Self {
        let limits = (0..q).map(|i| {
            let cutting = if i + 1 == q { 0.5 * friction } else { 0.0 };
            SlipLimits::new(0.5 * friction * (1.0 + generator.next()), cutting, ratio).unwrap()
        });
        Self {
            limits: limits.collect(),
            tissue: generator.matrix(3 * q, 1.0, 0.5),
            needle: generator.matrix(3 * q, 100.0, 5.0),
            load: generator.vector(3 * q, 3.0),
            needle_load: generator.vector(3 * q, 3.0),
            tangents: (0..q).map(|_| Vector3::from_fn(|_, _| generator.next() + 0.1).normalize()).collect(),
            sign: 1.0,
            solves: 0,
        }
    }

    fn q(&self) -> usize {
        self.limits.len()
    }

    /// Forces and slips where the nodes of `stuck` stick and the others carry `force`.
    fn tie(&self, stuck: impl Fn(usize) -> bool, force: impl Fn(usize) -> f64) -> Answer {
        let (q, n) = (self.q(), 3 * self.q());
        let mut matrix = DMatrix::zeros(3 * n, 3 * n);
        let mut rhs = DVector::zeros(3 * n);
        matrix.view_mut((0, 0), (n, n)).copy_from(&self.tissue);
        matrix.view_mut((n, n), (n, n)).copy_from(&self.needle);
        rhs.rows_mut(0, n).copy_from(&self.load);
        rhs.rows_mut(n, n).copy_from(&self.needle_load);
        for i in 0..q {
            let t = self.tangents[i];
            let across = t.cross(&Vector3::ith(t.iamin(), 1.0)).normalize();
            for (axis, r) in [t, across, t.cross(&across)].into_iter().enumerate() {
                let row = 2 * n + 3 * i + axis;
                for k in 0..3 {
                    matrix[(3 * i + k, row)] = -r[k];
                    matrix[(n + 3 * i + k, row)] = r[k];
                }
                if axis == 0 && !stuck(i) {
                    matrix[(row, row)] = 1.0;
                    rhs[row] = force(i);
                } else {
                    for k in 0..3 {
                        matrix[(row, 3 * i + k)] = -r[k];
                        matrix[(row, n + 3 * i + k)] = r[k];
                    }
                }
            }
        }
        let solution = matrix.lu().solve(&rhs).unwrap();
        let slip =
            |i: usize| (0..3).map(|k| self.tangents[i][k] * (solution[n + 3 * i + k] - solution[3 * i + k])).sum();
        Answer {
            force: (0..q).map(|i| solution[2 * n + 3 * i]).collect(),
            slip: (0..q).map(|i| if stuck(i) { 0.0 } else { slip(i) }).collect(),
        }
    }

    fn w_and_free_slip(&self) -> (Vec<f64>, Vec<f64>) {
        let q = self.q();
        let free = self.tie(|_| false, |_| 0.0).slip;
        let mut w = vec![0.0; q * q];
        for j in 0..q {
            let pushed = self.tie(|_| false, |i| f64::from(i == j)).slip;
            for i in 0..q {
                w[i * q + j] = free[i] - pushed[i];
            }
        }
        (w, free)
    }

    /// All consistent sets of states with their forces, found on the tangential system.
    fn enumerate(&self) -> Vec<(Vec<SlipState>, Vec<f64>)> {
        let q = self.q();
        let (w, free) = self.w_and_free_slip();
        let mut found = Vec::new();
        for code in 0..3usize.pow(q as u32) {
            let states: Vec<SlipState> =
                (0..q).map(|i| [Static, Forward, Backward][code / 3usize.pow(i as u32) % 3]).collect();
            let matrix = DMatrix::from_fn(q, q, |i, j| match states[i] {
                Static => w[i * q + j],
                _ => f64::from(i == j),
            });
            let rhs = DVector::from_fn(q, |i, _| match states[i] {
                Static => free[i],
                state => self.sign * self.limits[i].slipping(state),
            });
            let force = matrix.lu().solve(&rhs).unwrap();
            let slip = |i: usize| free[i] - (0..q).map(|j| w[i * q + j] * force[j]).sum::<f64>();
            let holds = |i: usize| match states[i] {
                Static => self.limits[i].fixed[0] <= force[i] && force[i] <= self.limits[i].fixed[1],
                Forward => slip(i) >= 0.0,
                Backward => slip(i) <= 0.0,
            };
            if (0..q).all(holds) {
                found.push((states, force.iter().copied().collect()));
            }
        }
        found
    }
}

impl StickSlip for Dense {
    type Error = std::convert::Infallible;

    fn limits(&self) -> &[SlipLimits] {
        &self.limits
    }

    fn solve(&mut self, states: &[SlipState], _: f64, fresh: bool, answer: &mut Answer) -> Result<usize, Self::Error> {
        assert_eq!(fresh, self.solves == 0, "only the first solve starts from zero");
        self.solves += 1;
        *answer = self.tie(|i| states[i] == Static, |i| self.limits[i].slipping(states[i]));
        Ok(10)
    }

    fn condense(&mut self, _: f64, w: &mut Vec<f64>, free_slip: &mut Vec<f64>) -> Result<usize, Self::Error> {
        (*w, *free_slip) = self.w_and_free_slip();
        Ok(3 * self.q())
    }
}

/// Direct solves: hardly any error.
fn exact(method: SearchMethod, condense_after: Option<usize>, max_trials: usize) -> SearchSettings {
    let tolerance = 1e-12;
    SearchSettings {
        method,
        check_tolerance: tolerance,
        solve_tolerance: tolerance,
        max_trials,
        condense_after,
        slack: 1.0,
    }
}

fn run(system: &mut Dense, settings: &SearchSettings, guess: &[SlipState]) -> (SearchReport, Vec<SlipState>, Answer) {
    system.solves = 0;
    let (mut states, mut answer) = (guess.to_vec(), Answer::default());
    let report = search(system, &mut states, settings, &mut SearchWorkspace::new(), &mut answer).unwrap();
    (report, states, answer)
}

fn near(a: &[f64], b: &[f64], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * (1.0 + b.abs()))
}

#[test]
fn with_equal_limits_the_search_finds_the_one_consistent_set() {
    let mut generator = Generator(7);
    for case in 0..1000 {
        let q = 1 + case % 6;
        let friction = 10f64.powf(generator.next());
        let mut system = Dense::random(&mut generator, q, friction, 1.0);
        let accepted = system.enumerate();
        assert_eq!(accepted.len(), 1, "case {case}: {accepted:?}");
        let (states, force) = &accepted[0];
        let guess: Vec<SlipState> =
            (0..q).map(|_| [Static, Forward, Backward][(1.5 * (generator.next() + 1.0)) as usize]).collect();
        for settings in [
            exact(SearchMethod::Condensed, None, 10),
            exact(SearchMethod::Trials, Some(2), 10),
            exact(SearchMethod::Trials, None, 729),
        ] {
            let (report, found, answer) = run(&mut system, &settings, &guess);
            assert!(report.consistent && report.refused.is_none(), "case {case}: {report:?}");
            assert_eq!(&found, states, "case {case}");
            assert!(near(&answer.force, force, 1e-8), "case {case}: {:?} {force:?}", answer.force);
            assert_eq!(report.trials, system.solves, "case {case}");
            if settings.method == SearchMethod::Condensed {
                assert_eq!(system.solves, 1, "case {case}");
            }
        }
    }
}
