//! The principal block of the unknowns that the small body reaches, and its factor.

use super::Attachment;
use crate::Block;
use crate::dense::{Cholesky, NotPositiveDefinite};
use crate::sparse::BlockCsr;
use crate::subspace::Subspace;

/// Independent moves of one node, as rows, and their places among the rows of the block.
#[derive(Clone, Copy, Debug)]
struct Moves<const B: usize> {
    basis: [[f64; B]; B],
    count: usize,
    start: usize,
}

/// How a small node follows the moves of one node of the block: `count` columns of `B` entries from row `start` on.
#[derive(Clone, Copy, Debug)]
struct Image<const B: usize> {
    columns: [[f64; B]; B],
    count: usize,
    start: usize,
}

/// `diag(A, 0) + Tᵀ N T` on the small nodes and the big ones they are attached to, in a basis of their allowed moves.
///
/// Memory is that of the largest state so far: changes of state allocate nothing.
#[derive(Clone, Debug)]
pub(super) struct CoupledBlock<const B: usize> {
    /// Nodes of both bodies: attached big ones ascending, then the small ones.
    nodes: Vec<usize>,
    n_attached: usize,
    /// Blocks of `A` between attached nodes, row by row.
    big: Vec<Block<B>>,
    moves: Vec<Moves<B>>,
    /// Images of each small node, one after the other: itself, then its attachments.
    images: Vec<Image<B>>,
    matrix: Vec<f64>,
    n: usize,
    factor: Cholesky,
}

impl<const B: usize> CoupledBlock<B> {
    pub fn new(attachments: &[Attachment], n_big: usize) -> Self {
        let mut nodes: Vec<usize> = attachments.iter().flatten().map(|(big, _)| *big).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let n_attached = nodes.len();
        nodes.extend(n_big..n_big + attachments.len());
        // Room for the state with the most moves: all small nodes free.
        let most = B * nodes.len();
        let mut factor = Cholesky::new();
        let identity = factor.factor(most, |i, j| f64::from(i == j));
        debug_assert!(identity.is_ok());
        Self {
            n_attached,
            big: vec![[[0.0; B]; B]; n_attached * n_attached],
            moves: Vec::with_capacity(nodes.len()),
            images: Vec::with_capacity(attachments.iter().map(|a| a.len() + 1).sum()),
            matrix: Vec::with_capacity(most * most),
            nodes,
            n: 0,
            factor,
        }
    }

    /// Number of unknowns.
    pub fn dofs(&self) -> usize {
        self.n
    }

    /// The node, of both bodies, that a row of the block belongs to.
    pub fn node_of(&self, row: usize) -> usize {
        let at = self.moves.partition_point(|moves| moves.start <= row);
        self.nodes[at.saturating_sub(1)]
    }

    /// Copies the big body's blocks between attached nodes.
    pub fn read(&mut self, big: &BlockCsr<B>) {
        let attached = &self.nodes[..self.n_attached];
        for (i, blocks) in attached.iter().zip(self.big.chunks_mut(self.n_attached.max(1))) {
            for (j, block) in attached.iter().zip(blocks) {
                *block = big.get(*i, *j).copied().unwrap_or([[0.0; B]; B]);
            }
        }
    }

    pub fn factor(
        &mut self,
        small: &BlockCsr<B>,
        attachments: &[Attachment],
        w: &Subspace<B>,
    ) -> Result<(), NotPositiveDefinite> {
        self.number(w);
        self.matrix.clear();
        self.matrix.resize(self.n * self.n, 0.0);
        self.add_big();
        self.add_small(small, attachments, w);
        let (n, matrix) = (self.n, &self.matrix);
        self.factor.factor(n, |i, j| matrix[i * n + j])
    }

    /// Sets the entries of attached nodes to zero.
    pub fn clear(&self, big: &mut [f64]) {
        for node in &self.nodes[..self.n_attached] {
            big[node * B..][..B].fill(0.0);
        }
    }

    /// Overwrites `z` at the nodes of the block with its inverse times `r`.
    pub fn solve(&self, r: &[f64], z: &mut [f64], scratch: &mut [f64]) {
        let (r, z) = (r.as_chunks::<B>().0, z.as_chunks_mut::<B>().0);
        for (node, moves) in self.nodes.iter().zip(&self.moves) {
            for (out, basis) in scratch[moves.start..].iter_mut().zip(&moves.basis[..moves.count]) {
                *out = (0..B).map(|k| basis[k] * r[*node][k]).sum();
            }
        }
        self.factor.solve(scratch);
        for (node, moves) in self.nodes.iter().zip(&self.moves) {
            let values = &scratch[moves.start..][..moves.count];
            z[*node] = std::array::from_fn(|k| moves.basis.iter().zip(values).map(|(basis, v)| basis[k] * v).sum());
        }
    }

    fn number(&mut self, w: &Subspace<B>) {
        self.moves.clear();
        self.n = 0;
        for &node in &self.nodes {
            let (basis, count) = w.get(node).basis();
            self.moves.push(Moves { basis, count, start: self.n });
            self.n += count;
        }
    }

    fn add_big(&mut self) {
        for i in 0..self.n_attached {
            for j in 0..self.n_attached {
                let (rows, cols) = (self.moves[i], self.moves[j]);
                let rows = Image { columns: rows.basis, count: rows.count, start: rows.start };
                let cols = Image { columns: cols.basis, count: cols.count, start: cols.start };
                add_form(&mut self.matrix, self.n, &self.big[i * self.n_attached + j], &rows, &cols);
            }
        }
    }

    fn add_small(&mut self, small: &BlockCsr<B>, attachments: &[Attachment], w: &Subspace<B>) {
        // Images: moves of its own as they are, those of an attachment weighted, their tied part.
        self.images.clear();
        for (node, attachment) in attachments.iter().enumerate() {
            let at = self.n_attached + node;
            let own = self.moves[at];
            self.images.push(Image { columns: own.basis, count: own.count, start: own.start });
            let free = w.get(self.nodes[at]);
            for &(big, weight) in attachment {
                let place = self.nodes[..self.n_attached].partition_point(|node| *node < big);
                let moves = self.moves[place];
                let columns = moves.basis.map(|basis| super::tied(&free, basis.map(|v| v * weight)));
                self.images.push(Image { columns, count: moves.count, start: moves.start });
            }
        }
        let mut row_start = 0;
        for (i, attachment) in attachments.iter().enumerate() {
            let rows = row_start..row_start + attachment.len() + 1;
            row_start = rows.end;
            let (cols, blocks) = small.row(i);
            let mut skipped = (0, 0); // images of the nodes before `skipped.0`
            for (&j, block) in cols.iter().zip(blocks) {
                let j = j as usize;
                while skipped.0 < j {
                    skipped = (skipped.0 + 1, skipped.1 + attachments[skipped.0].len() + 1);
                }
                for row in rows.clone() {
                    for col in skipped.1..skipped.1 + attachments[j].len() + 1 {
                        let (row, col) = (self.images[row], self.images[col]);
                        add_form(&mut self.matrix, self.n, block, &row, &col);
                    }
                }
            }
        }
    }
}

/// Adds `rowsᵀ block cols` where the two images' rows and columns are.
fn add_form<const B: usize>(matrix: &mut [f64], n: usize, block: &Block<B>, rows: &Image<B>, cols: &Image<B>) {
    for (l, col) in cols.columns[..cols.count].iter().enumerate() {
        let product = block.map(|row| (0..B).map(|k| row[k] * col[k]).sum::<f64>());
        for (k, row) in rows.columns[..rows.count].iter().enumerate() {
            matrix[(rows.start + k) * n + cols.start + l] += (0..B).map(|i| row[i] * product[i]).sum::<f64>();
        }
    }
}
