//! Inverse of one diagonal block on the allowed moves of its node.

use super::PreconditionerError;
use crate::Block;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};

/// `T (Tᵀ D T)⁻¹ Tᵀ`, where the columns of `T` span the moves that `constraint` allows; `Err` holds a pivot that is not
/// positive. Only `(D + Dᵀ)/2` enters.
pub(super) fn restricted_inverse<const B: usize>(d: &Block<B>, constraint: &Constraint<B>) -> Result<Block<B>, f64> {
    let symmetric: Block<B> = block(|i, j| 0.5 * (d[i][j] + d[j][i]));
    match constraint {
        Constraint::Free => inverse(&symmetric),
        Constraint::Fixed => Ok([[0.0; B]; B]),
        Constraint::Line(t) => {
            let stiffness = quadratic_form(&symmetric, t);
            positive(stiffness)?;
            Ok(block(|i, j| t[i] * t[j] / stiffness))
        }
        Constraint::Plane(n) => on_plane(&symmetric, n),
    }
}

/// With `s > 0`, `P D P + s n nᵀ` has the inverse `T (Tᵀ D T)⁻¹ Tᵀ + n nᵀ / s`: no basis `T` of the plane is needed.
fn on_plane<const B: usize>(d: &Block<B>, n: &[f64; B]) -> Result<Block<B>, f64> {
    let p: Block<B> = block(|i, j| f64::from(i == j) - n[i] * n[j]);
    let restricted = product(&p, &product(d, &p));
    let scale = (0..B).map(|i| restricted[i][i]).sum::<f64>();
    if B == 1 {
        return Ok([[0.0; B]; B]);
    }
    positive(scale)?;
    let filled = block(|i, j| 0.5 * (restricted[i][j] + restricted[j][i]) + scale * n[i] * n[j]);
    let inverse = product(&p, &product(&inverse(&filled)?, &p));
    Ok(block(|i, j| 0.5 * (inverse[i][j] + inverse[j][i])))
}

/// Inverse of a symmetric positive definite block, by its Cholesky factor `L Lᵀ`.
fn inverse<const B: usize>(a: &Block<B>) -> Result<Block<B>, f64> {
    let mut l = *a;
    for j in 0..B {
        let pivot = l[j][j] - (0..j).map(|k| l[j][k] * l[j][k]).sum::<f64>();
        positive(pivot)?;
        l[j][j] = pivot.sqrt();
        for i in j + 1..B {
            l[i][j] = (l[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>()) / l[j][j];
        }
    }
    let mut m = [[0.0; B]; B]; // L⁻¹, lower triangular
    for j in 0..B {
        for i in j..B {
            let unit = f64::from(i == j);
            m[i][j] = (unit - (j..i).map(|k| l[i][k] * m[k][j]).sum::<f64>()) / l[i][i];
        }
    }
    Ok(block(|i, j| (i.max(j)..B).map(|k| m[k][i] * m[k][j]).sum()))
}

fn positive(pivot: f64) -> Result<(), f64> {
    let usable = pivot > 0.0 && pivot.is_finite();
    if usable { Ok(()) } else { Err(pivot) }
}

fn quadratic_form<const B: usize>(a: &Block<B>, t: &[f64; B]) -> f64 {
    (0..B).map(|i| t[i] * (0..B).map(|j| a[i][j] * t[j]).sum::<f64>()).sum()
}

pub(super) fn product<const B: usize>(a: &Block<B>, b: &Block<B>) -> Block<B> {
    block(|i, j| (0..B).map(|k| a[i][k] * b[k][j]).sum())
}

fn block<const B: usize>(entry: impl Fn(usize, usize) -> f64) -> Block<B> {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

pub(super) fn check_shape<const B: usize>(a: &BlockCsr<B>, w: &Subspace<B>) -> Result<(), PreconditionerError> {
    let (rows, nodes) = (a.n_rows(), w.n_nodes());
    if rows == nodes { Ok(()) } else { Err(PreconditionerError::Shape { rows, nodes }) }
}

pub(super) fn check_node<const B: usize>(w: &Subspace<B>, node: usize) -> Result<(), PreconditionerError> {
    let n_nodes = w.n_nodes();
    if node < n_nodes { Ok(()) } else { Err(PreconditionerError::NodeOutOfRange { node, n_nodes }) }
}
