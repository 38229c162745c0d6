//! The tentative prolongator: the modes of each aggregate, made orthonormal.

use super::aggregates::Aggregates;
use super::modes::Modes;
use crate::subspace::Constraint;

/// A mode that keeps less than this part of its length when those before it are taken out adds nothing but rounding.
const DEPENDENT: f64 = 1e-9;

/// Replaces the modes of every aggregate by an orthonormal basis `Q` of the moves that they and the constraints allow, and
/// writes the modes' coordinates in it to `coarse`: `modes = Q coarse`. Where modes depend on each other on an aggregate (few
/// nodes, or nodes on a line), the later ones have a zero column in `Q` and a zero row in `coarse`. Nodes outside of all
/// aggregates get zero.
///
/// Source: Vaněk, Mandel & Brezina, *Algebraic multigrid by smoothed aggregation*, Computing 56 (1996), section 4; the
/// orthogonalisation is Gram–Schmidt, done twice.
pub(super) fn orthonormalise<const B: usize, const M: usize>(
    modes: &[[[f64; M]; B]],
    constraints: &[Constraint<B>],
    aggregates: &Aggregates,
    q: &mut Vec<[[f64; M]; B]>,
    coarse: &mut Modes<M, M>,
) {
    q.clear();
    q.resize(modes.len(), [[0.0; M]; B]);
    let coarse = coarse.nodal_mut();
    coarse.clear();
    coarse.resize(aggregates.count(), [[0.0; M]; M]);
    for (aggregate, coarse) in coarse.iter_mut().enumerate() {
        let nodes = aggregates.nodes(aggregate);
        for &node in nodes {
            q[node as usize] = project(&modes[node as usize], &constraints[node as usize]);
        }
        for m in 0..M {
            add_column(q, nodes, m, coarse);
        }
    }
}

/// Orthonormalises column `m` against those before it.
fn add_column<const B: usize, const M: usize>(
    q: &mut [[[f64; M]; B]],
    nodes: &[u32],
    m: usize,
    coarse: &mut [[f64; M]; M],
) {
    let length = inner(q, nodes, m, m).sqrt();
    for _ in 0..2 {
        for k in 0..m {
            let part = inner(q, nodes, k, m);
            coarse[k][m] += part;
            for &node in nodes {
                q[node as usize].iter_mut().for_each(|row| row[m] -= part * row[k]);
            }
        }
    }
    let left = inner(q, nodes, m, m).sqrt();
    let independent = left > DEPENDENT * length;
    let scale = if independent { 1.0 / left } else { 0.0 };
    coarse[m][m] = if independent { left } else { 0.0 };
    for &node in nodes {
        q[node as usize].iter_mut().for_each(|row| row[m] *= scale);
    }
}

fn inner<const B: usize, const M: usize>(q: &[[[f64; M]; B]], nodes: &[u32], k: usize, m: usize) -> f64 {
    nodes.iter().flat_map(|&node| &q[node as usize]).map(|row| row[k] * row[m]).sum()
}

/// The allowed part of every mode.
fn project<const B: usize, const M: usize>(block: &[[f64; M]; B], constraint: &Constraint<B>) -> [[f64; M]; B] {
    let mut result = [[0.0; M]; B];
    for m in 0..M {
        let column = constraint.project(std::array::from_fn(|i| block[i][m]));
        (0..B).for_each(|i| result[i][m] = column[i]);
    }
    result
}
