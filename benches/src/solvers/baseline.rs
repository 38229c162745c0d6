//! What our solvers are measured against: textbook conjugate gradients on the scalar product of `sprs`, and faer.
//!
//! All of it runs on one thread.

use faer::diag::DiagRef;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::matrix_free::InitialGuessStatus;
use faer::matrix_free::conjugate_gradient::{CgError, CgParams, conjugate_gradient, conjugate_gradient_scratch};
use faer::sparse::SparseColMat;
use faer::{MatMut, MatRef, Par};

/// Iterations of a solve, and whether it converged.
pub(super) type Iterations = (usize, bool);

/// Conjugate gradients with a Jacobi preconditioner as a textbook has them, from `x = 0`, until the residual of the recurrence
/// is at most `tolerance` times the right side.
///
/// Source: Saad, *Iterative Methods for Sparse Linear Systems*, 2nd ed. (2003), Algorithm 9.1.
pub(super) fn textbook_cg(
    a: &sprs::CsMat<f64>,
    inverse_diagonal: &[f64],
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> Iterations {
    let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let precondition = |r: &[f64]| r.iter().zip(inverse_diagonal).map(|(r, d)| d * r).collect::<Vec<f64>>();
    x.fill(0.0);
    let mut r = b.to_vec();
    let mut z = precondition(&r);
    let mut p = z.clone();
    let mut q = vec![0.0; b.len()];
    let mut rz = dot(&r, &z);
    let threshold = tolerance * dot(b, b).sqrt();
    for iteration in 0..max_iterations {
        if dot(&r, &r).sqrt() <= threshold {
            return (iteration, true);
        }
        q.fill(0.0);
        sprs::prod::mul_acc_mat_vec_csr(a.view(), &p[..], &mut q[..]);
        let alpha = rz / dot(&p, &q);
        for k in 0..b.len() {
            x[k] += alpha * p[k];
            r[k] -= alpha * q[k];
        }
        for (z, (r, d)) in z.iter_mut().zip(r.iter().zip(inverse_diagonal)) {
            *z = d * r;
        }
        let next = dot(&r, &z);
        let beta = next / rz;
        rz = next;
        for (p, z) in p.iter_mut().zip(&z) {
            *p = z + beta * *p;
        }
    }
    (max_iterations, dot(&r, &r).sqrt() <= threshold)
}

/// faer's conjugate gradients with a Jacobi preconditioner, from `x = 0`.
///
/// The guess is given as one that may not be zero: told that it is, faer 0.24.4 reads a residual that it never wrote.
pub(super) fn faer_cg(
    a: &SparseColMat<usize, f64>,
    inverse_diagonal: &[f64],
    b: &[f64],
    x: &mut [f64],
    tolerance: f64,
    max_iterations: usize,
) -> Result<Iterations, String> {
    x.fill(0.0);
    let n = b.len();
    let m = DiagRef::from_slice(inverse_diagonal);
    let mut memory = MemBuffer::new(conjugate_gradient_scratch(m, a.as_ref(), 1, Par::Seq));
    let params = CgParams {
        initial_guess: InitialGuessStatus::MaybeNonZero,
        rel_tolerance: tolerance,
        max_iters: max_iterations,
        ..CgParams::default()
    };
    let x = MatMut::from_column_major_slice_mut(x, n, 1);
    let b = MatRef::from_column_major_slice(b, n, 1);
    match conjugate_gradient(x, m, a.as_ref(), b, params, |_| (), Par::Seq, MemStack::new(&mut memory)) {
        Ok(info) => Ok((info.iter_count, true)),
        Err(CgError::NoConvergence { .. }) => Ok((max_iterations, false)),
        Err(error) => Err(format!("{error:?}")),
    }
}
