//! Nodes in frames of their own.

use crate::Block;

/// How far `RᵀR` may be from the identity.
const ORTHONORMAL: f64 = 1e-9;

/// Frames that cannot be used; the matrix is then unchanged.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RotationError {
    /// The matrix is not square, or does not consist of whole nodes.
    #[error("matrix of {nodes} nodes with {block} dofs has {len} entries")]
    Shape {
        /// Number of nodes.
        nodes: usize,
        /// Dofs per node.
        block: usize,
        /// Number of entries.
        len: usize,
    },
    /// There is no such node.
    #[error("node {node} is out of range: there are {nodes}")]
    NodeOutOfRange {
        /// The node asked for.
        node: usize,
        /// Number of nodes.
        nodes: usize,
    },
    /// The columns of a frame are not orthonormal.
    #[error("frame of node {node}: RᵀR differs from the identity by {difference:e}")]
    NotOrthonormal {
        /// The node.
        node: usize,
        /// Largest difference, or NaN.
        difference: f64,
    },
}

/// `K ← Rᵀ K R`, where `R` consists of one `B x B` block per node: the matrix for vectors whose entries at node `i` are along the
/// columns of `rotations[i]`. Eigenvalues stay the same. Reflections are allowed.
///
/// # Errors
/// [`RotationError`] for a matrix that does not fit, or names the node whose frame is not orthonormal within 1e-9.
pub fn rotate_nodes<const B: usize>(k: &mut [f64], rotations: &[Block<B>]) -> Result<(), RotationError> {
    let nodes = rotations.len();
    check_shape::<B>(k, nodes)?;
    for (node, r) in rotations.iter().enumerate() {
        check_frame(node, r)?;
    }
    for (node, r) in rotations.iter().enumerate() {
        rotate(k, nodes, node, r);
    }
    Ok(())
}

/// [`rotate_nodes`] with a frame at one of `nodes` nodes alone: O(nodes).
///
/// # Errors
/// As [`rotate_nodes`], and [`RotationError::NodeOutOfRange`].
pub fn rotate_node<const B: usize>(
    k: &mut [f64],
    nodes: usize,
    node: usize,
    rotation: &Block<B>,
) -> Result<(), RotationError> {
    check_shape::<B>(k, nodes)?;
    if node >= nodes {
        return Err(RotationError::NodeOutOfRange { node, nodes });
    }
    check_frame(node, rotation)?;
    rotate(k, nodes, node, rotation);
    Ok(())
}

fn rotate<const B: usize>(k: &mut [f64], nodes: usize, node: usize, r: &Block<B>) {
    let m = nodes * B;
    for line in k.chunks_exact_mut(m) {
        let old: [f64; B] = std::array::from_fn(|i| line[node * B + i]);
        for j in 0..B {
            line[node * B + j] = (0..B).map(|i| old[i] * r[i][j]).sum();
        }
    }
    for col in 0..m {
        let old: [f64; B] = std::array::from_fn(|i| k[(node * B + i) * m + col]);
        for j in 0..B {
            k[(node * B + j) * m + col] = (0..B).map(|i| r[i][j] * old[i]).sum();
        }
    }
}

fn check_shape<const B: usize>(k: &[f64], nodes: usize) -> Result<(), RotationError> {
    let square = nodes.checked_mul(B).and_then(|m| m.checked_mul(m));
    if square == Some(k.len()) { Ok(()) } else { Err(RotationError::Shape { nodes, block: B, len: k.len() }) }
}

fn check_frame<const B: usize>(node: usize, r: &Block<B>) -> Result<(), RotationError> {
    for (i, j) in (0..B).flat_map(|i| (0..B).map(move |j| (i, j))) {
        let product: f64 = (0..B).map(|k| r[k][i] * r[k][j]).sum();
        let difference = (product - f64::from(i == j)).abs();
        if difference > ORTHONORMAL || difference.is_nan() {
            return Err(RotationError::NotOrthonormal { node, difference });
        }
    }
    Ok(())
}
