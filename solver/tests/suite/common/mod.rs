//! Problems with known answers, shared by the integration tests.
#![allow(dead_code)] // each test file uses its part

pub mod elasticity;
pub mod energies;
pub mod graphs;
pub mod kkt;
pub mod needle;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use proptest::prelude::*;
use stylet_solver::Block;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// A linear problem on a subspace: `A` symmetric positive definite.
#[derive(Clone, Debug)]
pub struct System<const B: usize> {
    pub a: BlockCsr<B>,
    pub w: Subspace<B>,
    pub b: Vec<f64>,
    pub x0: Vec<f64>,
}

pub fn rule(tolerance: f64, criterion: Criterion) -> StopRule {
    StopRule { tolerance, criterion, round_floor: 0.0 }
}

/// `A = L Lᵀ + shift I` on a random graph, `L` unit bidiagonal plus random couplings, and random constraints.
pub fn system<const B: usize>() -> impl Strategy<Value = System<B>> {
    (2usize..12).prop_flat_map(|n| {
        let numbers = |len| proptest::collection::vec(-1.0..1.0f64, len);
        let m = n * B;
        (Just(n), numbers(m * m), numbers(n * B), proptest::collection::vec(0u8..6, n), numbers(m), numbers(m))
            .prop_map(|(n, g, directions, kinds, b, x0)| {
                let a = from_dense(n, |i, j| {
                    let m = n * B;
                    let gram: f64 = (0..m).map(|k| g[i * m + k] * g[j * m + k]).sum();
                    gram + if i == j { 0.5 } else { 0.0 }
                });
                System { a, w: subspace(&kinds, &directions), b, x0 }
            })
    })
}

pub fn from_dense<const B: usize>(n: usize, entry: impl Fn(usize, usize) -> f64) -> BlockCsr<B> {
    let mut a = BlockCsr::new(n);
    let cols: Vec<u32> = (0..n as u32).collect();
    for i in 0..n {
        let block =
            |j: usize| -> Block<B> { std::array::from_fn(|k| std::array::from_fn(|l| entry(i * B + k, j * B + l))) };
        let blocks: Vec<Block<B>> = (0..n).map(block).collect();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    a
}

fn subspace<const B: usize>(kinds: &[u8], directions: &[f64]) -> Subspace<B> {
    let mut w = Subspace::new(kinds.len());
    for (node, kind) in kinds.iter().enumerate() {
        let mut d: [f64; B] = std::array::from_fn(|k| directions[node * B + k] + f64::from(k == 0) * 1.5);
        let length = d.iter().map(|x| x * x).sum::<f64>().sqrt();
        d = d.map(|x| x / length);
        let constraint = match kind {
            0 => Constraint::Fixed,
            1 => Constraint::Line(d),
            2 => Constraint::Plane(d),
            _ => Constraint::Free,
        };
        w.set(node, constraint).unwrap();
    }
    w
}

/// The solution by a dense Cholesky factorisation: `x₀ + v`, where `(P A P + I − P) v = P (b − A x₀)`.
pub fn dense_solution<const B: usize>(s: &System<B>) -> Vec<f64> {
    let n = s.b.len();
    let mut projector = vec![0.0; n * n];
    for (k, column) in projector.chunks_mut(n).enumerate() {
        column[k] = 1.0;
        s.w.project(column);
    }
    let p = Mat::from_fn(n, n, |i, j| projector[j * n + i]);
    let dense = s.a.to_dense();
    let a = Mat::from_fn(n, n, |i, j| dense[i * n + j]);
    let (b, x0) = (Mat::from_fn(n, 1, |i, _| s.b[i]), Mat::from_fn(n, 1, |i, _| s.x0[i]));
    let identity = Mat::<f64>::identity(n, n);
    let projected = &p * &a * &p + identity - &p;
    let v = projected.llt(Side::Lower).unwrap().solve(&p * (b - &a * &x0));
    (0..n).map(|i| s.x0[i] + v[(i, 0)]).collect()
}

pub fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Grid Laplacian with `2x2` blocks, fixed on one side: a larger system for budgets and restarts.
pub fn grid(n: usize) -> System<2> {
    let mut a = BlockCsr::new(n * n);
    for v in 0..n * n {
        let (i, j) = (v / n, v % n);
        let mut row: Vec<(u32, Block<2>)> = vec![(v as u32, [[4.2, 0.1], [0.1, 4.2]])];
        for (k, l) in [(i.wrapping_sub(1), j), (i + 1, j), (i, j.wrapping_sub(1)), (i, j + 1)] {
            if k < n && l < n {
                row.push(((k * n + l) as u32, [[-1.0, 0.0], [0.0, -1.0]]));
            }
        }
        row.sort_by_key(|(j, _)| *j);
        let (cols, blocks): (Vec<u32>, Vec<Block<2>>) = row.into_iter().unzip();
        a.set_row(v, &cols, &blocks).unwrap();
    }
    let mut w = Subspace::new(n * n);
    for i in 0..n {
        w.set(i * n, Constraint::Fixed).unwrap();
        w.set(i * n + n / 2, Constraint::Line([0.6, 0.8])).unwrap();
    }
    let b = (0..2 * n * n).map(|k| ((k * k) as f64 * 0.37).sin()).collect();
    System { a, w, b, x0: vec![0.0; 2 * n * n] }
}

/// `P_W` as a dense matrix.
pub fn projector<const B: usize>(w: &Subspace<B>) -> Mat<f64> {
    let n = w.dim();
    let mut columns = vec![0.0; n * n];
    for (k, column) in columns.chunks_mut(n.max(1)).enumerate() {
        column[k] = 1.0;
        w.project(column);
    }
    Mat::from_fn(n, n, |i, j| columns[j * n + i])
}

/// `b − A x`.
pub fn residual<const B: usize>(a: &BlockCsr<B>, b: &[f64], x: &[f64]) -> Vec<f64> {
    let mut ax = vec![0.0; x.len()];
    stylet_solver::LinearOperator::apply(a, x, &mut ax);
    b.iter().zip(&ax).map(|(b, ax)| b - ax).collect()
}

pub fn krylov(tolerance: f64, criterion: Criterion) -> stylet_solver::linear::KrylovSettings {
    stylet_solver::linear::KrylovSettings { stop: rule(tolerance, criterion), max_iterations: 5_000 }
}
