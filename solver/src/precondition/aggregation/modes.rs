//! Near-null space: the moves that cost next to no energy, which a coarse level must know.

use super::super::PreconditionerError;
use crate::Block;

/// `M` modes, as a `B x M` block for every node: column `m` of block `i` is the move of node `i` in mode `m`.
///
/// Rigid moves for elasticity: `Modes<2, 3>`, `Modes<3, 6>`. One constant per coordinate where no places are known or
/// where coordinates are not coupled: `Modes<B, B>`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Modes<const B: usize, const M: usize> {
    nodal: Vec<[[f64; M]; B]>,
}

impl<const B: usize> Modes<B, B> {
    /// Translations of `n_nodes` nodes.
    #[must_use]
    pub fn constants(n_nodes: usize) -> Self {
        let unit: Block<B> = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)));
        Self { nodal: vec![unit; n_nodes] }
    }
}

impl<const B: usize, const M: usize> Modes<B, M> {
    /// Translations and infinitesimal rotations of nodes at `coordinates`, in any unit of length; `M = B (B + 1) / 2`.
    ///
    /// # Errors
    /// [`PreconditionerError::Coordinates`] names a node whose coordinates are not finite.
    pub fn rigid(coordinates: &[[f64; B]]) -> Result<Self, PreconditionerError> {
        const { assert!(M == B * (B + 1) / 2, "rigid moves: 1 in 1D, 3 in 2D, 6 in 3D") };
        if let Some(node) = coordinates.iter().position(|x| x.iter().any(|v| !v.is_finite())) {
            return Err(PreconditionerError::Coordinates { node });
        }
        let (centre, extent) = frame(coordinates);
        let nodal = coordinates.iter().map(|x| {
            let mut block = [[0.0; M]; B];
            (0..B).for_each(|k| block[k][k] = 1.0);
            let mut mode = B;
            for a in 0..B {
                for b in a + 1..B {
                    block[a][mode] = -(x[b] - centre[b]) / extent;
                    block[b][mode] = (x[a] - centre[a]) / extent;
                    mode += 1;
                }
            }
            block
        });
        Ok(Self { nodal: nodal.collect() })
    }

    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.nodal.len()
    }

    /// The block of every node.
    #[must_use]
    pub fn nodal(&self) -> &[[[f64; M]; B]] {
        &self.nodal
    }

    pub(super) fn nodal_mut(&mut self) -> &mut Vec<[[f64; M]; B]> {
        &mut self.nodal
    }
}

/// Middle and half the largest side of the bounding box; 1 if it has none. Halved before they are added, since coordinates
/// may be as large as numbers get.
fn frame<const B: usize>(coordinates: &[[f64; B]]) -> ([f64; B], f64) {
    let (mut low, mut high) = ([f64::INFINITY; B], [f64::NEG_INFINITY; B]);
    for x in coordinates {
        low = std::array::from_fn(|k| low[k].min(x[k]));
        high = std::array::from_fn(|k| high[k].max(x[k]));
    }
    let extent = (0..B).map(|k| 0.5 * high[k] - 0.5 * low[k]).fold(0.0, f64::max);
    let centre = std::array::from_fn(|k| 0.5 * low[k] + 0.5 * high[k]);
    (centre, if extent > 0.0 { extent } else { 1.0 })
}
