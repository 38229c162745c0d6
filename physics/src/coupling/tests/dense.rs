//! Dense coupled systems, small enough to try all `3^q` states: tissue and needle matrices, tied across the needle.

use crate::coupling::SlipState::{Backward, Forward, Static};
use crate::coupling::{Answer, SlipLimits, SlipState, StickSlip};
use nalgebra::{DMatrix, DVector, Vector3};

/// Knuth's MMIX generator.
pub struct Generator(pub u64);

impl Generator {
    /// In -1..1.
    pub fn next(&mut self) -> f64 {
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
pub struct Dense {
    pub tissue: DMatrix<f64>,
    pub needle: DMatrix<f64>,
    pub load: DVector<f64>,
    pub needle_load: DVector<f64>,
    pub tangents: Vec<Vector3<f64>>,
    pub limits: Vec<SlipLimits>,
    /// 1, or -1 for friction that pushes the slip on.
    pub sign: f64,
    /// Errors of the tolerance that is asked for, if any.
    pub noise: Option<Generator>,
    /// What is done to `W` before it is handed out.
    pub tamper: fn(&mut Vec<f64>),
    /// How many solves were asked for.
    pub solves: usize,
}

impl Dense {
    /// `q` nodes, a needle that is a hundred times stiffer than the tissue, friction of up to `friction`, and a tip that may cut.
    pub fn random(generator: &mut Generator, q: usize, friction: f64, ratio: f64) -> Self {
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
            noise: None,
            tamper: |_| (),
            solves: 0,
        }
    }

    pub fn q(&self) -> usize {
        self.limits.len()
    }

    /// Forces and slips where the nodes of `stuck` stick and the others carry `force`.
    pub fn tie(&self, stuck: impl Fn(usize) -> bool, force: impl Fn(usize) -> f64) -> Answer {
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

    pub fn w_and_free_slip(&self) -> (Vec<f64>, Vec<f64>) {
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
    pub fn enumerate(&self) -> Vec<(Vec<SlipState>, Vec<f64>)> {
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

/// Adds errors of at most `size`, except to zeros.
fn disturb(v: &mut [f64], noise: &mut Option<Generator>, size: f64) {
    if let Some(generator) = noise {
        for v in v.iter_mut().filter(|v| **v != 0.0) {
            *v += size * generator.next();
        }
    }
}

impl StickSlip for Dense {
    type Error = std::convert::Infallible;

    fn limits(&self) -> &[SlipLimits] {
        &self.limits
    }

    fn solve(
        &mut self,
        states: &[SlipState],
        tolerance: f64,
        fresh: bool,
        answer: &mut Answer,
    ) -> Result<usize, Self::Error> {
        assert_eq!(fresh, self.solves == 0, "only the first solve starts from zero");
        self.solves += 1;
        *answer = self.tie(|i| states[i] == Static, |i| self.limits[i].slipping(states[i]));
        let [force, slip] = self.magnitudes();
        disturb(&mut answer.force, &mut self.noise, tolerance * force);
        disturb(&mut answer.slip, &mut self.noise, tolerance * slip);
        for (i, force) in answer.force.iter_mut().enumerate().filter(|(i, _)| states[*i] != Static) {
            *force = self.limits[i].slipping(states[i]);
        }
        Ok(10)
    }

    fn condense(&mut self, tolerance: f64, w: &mut Vec<f64>, free_slip: &mut Vec<f64>) -> Result<usize, Self::Error> {
        (*w, *free_slip) = self.w_and_free_slip();
        let largest = w.iter().fold(0.0, |max: f64, w| max.max(w.abs()));
        disturb(w, &mut self.noise, tolerance * largest);
        let slip = self.magnitudes()[1];
        disturb(free_slip, &mut self.noise, tolerance * slip);
        (self.tamper)(w);
        Ok(3 * self.q())
    }

    /// The largest load, and the most that it moves a node of the tissue.
    fn magnitudes(&self) -> [f64; 2] {
        let load = self.load.amax().max(self.needle_load.amax());
        [load, load / 0.5]
    }
}
