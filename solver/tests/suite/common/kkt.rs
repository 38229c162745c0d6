//! Constrained systems and their dense solution.

use super::{System, projector, system};
use faer::Mat;
use faer::linalg::solvers::Solve;
use proptest::prelude::*;
use stylet_solver::linear::Constraints;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;

/// A linear problem on a subspace, with constraints `C x = d` besides.
#[derive(Clone, Debug)]
pub struct Constrained<const B: usize> {
    pub system: System<B>,
    pub c: Constraints,
}

/// Up to three constraints of up to four random coefficients each.
pub fn constrained<const B: usize>() -> impl Strategy<Value = Constrained<B>> {
    let row = proptest::collection::vec((any::<proptest::sample::Index>(), -1.0..1.0f64), 1..5);
    (system::<B>(), proptest::collection::vec((row, -1.0..1.0f64), 1..4)).prop_map(|(system, rows)| {
        let n = system.b.len();
        let mut c = Constraints::new(n);
        for (entries, d) in rows {
            let mut row = vec![0.0; n];
            entries.iter().for_each(|(at, value)| row[at.index(n)] = value + value.signum() * 0.2);
            let cols: Vec<usize> = (0..n).filter(|k| row[*k] != 0.0).collect();
            let values: Vec<f64> = cols.iter().map(|k| row[*k]).collect();
            c.push(&cols, &values, d).unwrap();
        }
        Constrained { system, c }
    })
}

/// Moves and multipliers by LU factorisation with full pivoting of the whole coupled matrix, and its smallest pivot.
pub fn dense_kkt<const B: usize>(
    a: &BlockCsr<B>,
    w: &Subspace<B>,
    c: &Constraints,
    b: &[f64],
    x0: &[f64],
) -> (Vec<f64>, Vec<f64>, f64) {
    let (n, m) = (b.len(), c.n_rows());
    let p = projector(w);
    let dense = a.to_dense();
    let a = Mat::from_fn(n, n, |i, j| dense[i * n + j]);
    let mut rows = Mat::<f64>::zeros(m, n);
    for i in 0..m {
        let (cols, values) = c.row(i);
        cols.iter().zip(values).for_each(|(&col, value)| rows[(i, col)] = *value);
    }
    let start = Mat::from_fn(n, 1, |i, _| x0[i]);
    let force = &p * (Mat::from_fn(n, 1, |i, _| b[i]) - &a * &start);
    let gap = Mat::from_fn(m, 1, |i, _| c.right_side()[i]) - &rows * &start;
    let top = &p * &a * &p + Mat::<f64>::identity(n, n) - &p;
    let side = &rows * &p;
    let k = Mat::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
        (true, true) => top[(i, j)],
        (true, false) => side[(j - n, i)],
        (false, true) => side[(i - n, j)],
        (false, false) => 0.0,
    });
    let lu = k.full_piv_lu();
    let pivot = (0..n + m).map(|i| lu.U()[(i, i)].abs()).fold(f64::INFINITY, f64::min);
    let z = lu.solve(Mat::from_fn(n + m, 1, |i, _| if i < n { force[(i, 0)] } else { gap[(i - n, 0)] }));
    let x = (0..n).map(|i| x0[i] + z[(i, 0)]).collect();
    (x, (n..n + m).map(|i| z[(i, 0)]).collect(), pivot)
}
