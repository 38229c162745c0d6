//! Energies with known minimisers.

use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::vector::dot;
use stylet_solver::{Block, LinearOperator};

/// Law of one spring under the relative elongation `e`.
#[derive(Clone, Copy, Debug)]
pub enum Law {
    /// `φ = k (cosh e − 1)`, stiffening; `φ' = k sinh e`.
    Cosh,
    /// `φ = k (e − ln(1 + e))`, a barrier at `e = −1`; `φ' = k e/(1 + e)`.
    Barrier,
    /// `φ = k e²/2`.
    Quadratic,
}

impl Law {
    fn value(self, e: f64) -> f64 {
        match self {
            Self::Cosh => e.cosh() - 1.0,
            Self::Barrier if e <= -1.0 => f64::INFINITY,
            Self::Barrier => e - e.ln_1p(),
            Self::Quadratic => 0.5 * e * e,
        }
    }

    fn slope(self, e: f64) -> f64 {
        match self {
            Self::Cosh => e.sinh(),
            Self::Barrier => e / (1.0 + e),
            Self::Quadratic => e,
        }
    }

    fn curvature(self, e: f64) -> f64 {
        match self {
            Self::Cosh => e.cosh(),
            Self::Barrier => (1.0 + e).powi(-2),
            Self::Quadratic => 1.0,
        }
    }

    /// The elongation at which the spring of stiffness one pulls with `force`.
    pub fn elongation(self, force: f64) -> f64 {
        match self {
            Self::Cosh => force.asinh(),
            Self::Barrier => force / (1.0 - force),
            Self::Quadratic => force,
        }
    }
}

/// A chain of springs along the first axis with a load on its last node; across, springs are linear with `STIFF_ACROSS`.
pub struct Chain {
    pub n: usize,
    pub law: Law,
    pub stiffness: f64,
    /// On the last node.
    pub load: [f64; 2],
    hessian: BlockCsr<2>,
}

const STIFF_ACROSS: f64 = 3.0;

impl Chain {
    pub fn new(n: usize, law: Law, stiffness: f64, load: [f64; 2]) -> Self {
        Self { n, law, stiffness, load, hessian: BlockCsr::new(n) }
    }

    /// Displacements under the load with node 0 held at zero.
    pub fn solution(&self) -> Vec<f64> {
        let e = self.law.elongation(self.load[0] / self.stiffness);
        let f = self.load[1] / (self.stiffness * STIFF_ACROSS);
        (0..self.n).flat_map(|i| [i as f64 * e, i as f64 * f]).collect()
    }

    fn elongations(&self, x: &[f64]) -> impl Iterator<Item = (usize, f64, f64)> {
        (0..self.n - 1).map(move |i| (i, x[2 * i + 2] - x[2 * i], x[2 * i + 3] - x[2 * i + 1]))
    }
}

impl Energy for Chain {
    fn dim(&self) -> usize {
        2 * self.n
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        let law = self.law;
        let springs: f64 = self.elongations(x).map(|(_, e, f)| law.value(e) + 0.5 * STIFF_ACROSS * f * f).sum();
        let last = 2 * (self.n - 1);
        self.stiffness * springs - self.load[0] * x[last] - self.load[1] * x[last + 1]
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        g.fill(0.0);
        for (i, e, f) in self.elongations(x) {
            let (along, across) = (self.stiffness * self.law.slope(e), self.stiffness * STIFF_ACROSS * f);
            g[2 * i] -= along;
            g[2 * i + 1] -= across;
            g[2 * i + 2] += along;
            g[2 * i + 3] += across;
        }
        let last = 2 * (self.n - 1);
        g[last] -= self.load[0];
        g[last + 1] -= self.load[1];
    }

    fn linearize(&mut self, x: &[f64]) {
        let mut rows = vec![[[[0.0; 2]; 2]; 3]; self.n]; // below, diagonal, above
        for (i, e, _) in self.elongations(x) {
            let k = [self.stiffness * self.law.curvature(e), self.stiffness * STIFF_ACROSS];
            for l in 0..2 {
                rows[i][1][l][l] += k[l];
                rows[i + 1][1][l][l] += k[l];
                rows[i][2][l][l] -= k[l];
                rows[i + 1][0][l][l] -= k[l];
            }
        }
        for (i, row) in rows.iter().enumerate() {
            let first = usize::from(i == 0);
            let last = if i + 1 == self.n { 2 } else { 3 };
            let cols: Vec<u32> = (first..last).map(|k| (i + k - 1) as u32).collect();
            // Values that are not finite cannot enter a row: what stays tells the solver.
            let _ = self.hessian.set_row(i, &cols, &row[first..last]);
        }
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.hessian.apply(p, hp);
    }

    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        if !matches!(self.law, Law::Barrier) {
            return limit;
        }
        let room = self.elongations(x).zip(self.elongations(p));
        room.filter(|(_, (_, dp, _))| *dp < 0.0).map(|((_, e, _), (_, dp, _))| (1.0 + e) / -dp).fold(limit, f64::min)
    }
}

impl BlockHessian<2> for Chain {
    fn matrix(&self) -> &BlockCsr<2> {
        &self.hessian
    }
}

/// `Σ 100 (y − x²)² + (1 − x)²` over the nodes, plus springs of stiffness `coupling` between neighbours: not convex, with
/// the minimiser `(1, 1)` at every node.
pub struct Rosenbrock {
    pub n: usize,
    pub coupling: f64,
    hessian: BlockCsr<2>,
}

impl Rosenbrock {
    pub fn new(n: usize, coupling: f64) -> Self {
        Self { n, coupling, hessian: BlockCsr::new(n) }
    }
}

impl Energy for Rosenbrock {
    fn dim(&self) -> usize {
        2 * self.n
    }

    fn value(&mut self, v: &[f64]) -> f64 {
        let valley = |v: &[f64]| 100.0 * (v[1] - v[0] * v[0]).powi(2) + (1.0 - v[0]).powi(2);
        let springs: f64 = v.iter().zip(&v[2..]).map(|(a, b)| (b - a).powi(2)).sum();
        v.chunks(2).map(valley).sum::<f64>() + 0.5 * self.coupling * springs
    }

    fn gradient(&mut self, v: &[f64], g: &mut [f64]) {
        for (g, v) in g.chunks_mut(2).zip(v.chunks(2)) {
            let off = v[1] - v[0] * v[0];
            g[0] = -400.0 * v[0] * off - 2.0 * (1.0 - v[0]);
            g[1] = 200.0 * off;
        }
        for k in 0..v.len() - 2 {
            let force = self.coupling * (v[k + 2] - v[k]);
            g[k] -= force;
            g[k + 2] += force;
        }
    }

    fn linearize(&mut self, v: &[f64]) {
        for i in 0..self.n {
            let (x, y) = (v[2 * i], v[2 * i + 1]);
            let springs = self.coupling * if i == 0 || i + 1 == self.n { 1.0 } else { 2.0 };
            let diagonal = [[1200.0 * x * x - 400.0 * y + 2.0 + springs, -400.0 * x], [-400.0 * x, 200.0 + springs]];
            let off: Block<2> = [[-self.coupling, 0.0], [0.0, -self.coupling]];
            let all = [(i.wrapping_sub(1), off), (i, diagonal), (i + 1, off)];
            let row: Vec<_> = all.into_iter().filter(|(j, _)| *j < self.n).collect();
            let cols: Vec<u32> = row.iter().map(|(j, _)| *j as u32).collect();
            let blocks: Vec<Block<2>> = row.iter().map(|(_, b)| *b).collect();
            self.hessian.set_row(i, &cols, &blocks).unwrap();
        }
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.hessian.apply(p, hp);
    }
}

impl BlockHessian<2> for Rosenbrock {
    fn matrix(&self) -> &BlockCsr<2> {
        &self.hessian
    }
}

/// `½ xᵀA x − bᵀx`.
pub struct Quadratic {
    pub a: BlockCsr<2>,
    pub b: Vec<f64>,
}

impl Energy for Quadratic {
    fn dim(&self) -> usize {
        self.b.len()
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        0.5 * self.a.apply_dot(x, &mut vec![0.0; x.len()]) - dot(&self.b, x)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.a.apply(x, g);
        g.iter_mut().zip(&self.b).for_each(|(g, b)| *g -= b);
    }

    fn linearize(&mut self, _: &[f64]) {}

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.a.apply(p, hp);
    }
}

/// DIXMAANA: `1 + Σ xᵢ² + ⅛ Σ_{i ≤ 2m} xᵢ² x_{i+m}⁴ + ⅛ Σ_{i ≤ m} xᵢ x_{i+2m}` of `3m` variables, with the minimum 1 at 0; no
/// Hessian.
///
/// Source: Dixon & Maany, Hatfield Polytechnic (1988), as in the CUTE collection.
pub struct Dixmaana(pub usize);

impl Energy for Dixmaana {
    fn dim(&self) -> usize {
        3 * self.0
    }

    fn value(&mut self, x: &[f64]) -> f64 {
        let m = self.0;
        let mixed: f64 = (0..2 * m).map(|i| x[i].powi(2) * x[i + m].powi(4)).sum();
        let bilinear: f64 = (0..m).map(|i| x[i] * x[i + 2 * m]).sum();
        1.0 + dot(x, x) + 0.125 * (mixed + bilinear)
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        let m = self.0;
        g.iter_mut().zip(x).for_each(|(g, x)| *g = 2.0 * x);
        for i in 0..2 * m {
            g[i] += 0.25 * x[i] * x[i + m].powi(4);
            g[i + m] += 0.5 * x[i].powi(2) * x[i + m].powi(3);
        }
        for i in 0..m {
            g[i] += 0.125 * x[i + 2 * m];
            g[i + 2 * m] += 0.125 * x[i];
        }
    }

    fn linearize(&mut self, _: &[f64]) {}

    fn hessian_apply(&self, _: &[f64], _: &mut [f64]) {
        panic!("no method without curvature asks for it");
    }
}
