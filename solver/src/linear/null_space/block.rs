//! The principal block of the unknowns that the small body reaches, and its factor.

use super::Attachment;
use crate::Block;
use crate::dense::NotPositiveDefinite;
use crate::skyline::Skyline;
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

/// `diag(A, 0) + Tᵀ N T + resistances` on the small nodes and the big ones they are attached to, in a basis of their allowed
/// moves, in the envelope of its rows: along a needle that is a band.
///
/// Memory is that of the largest state so far: changes of state allocate nothing.
#[derive(Clone, Debug)]
pub(super) struct CoupledBlock<const B: usize> {
    /// Nodes of both bodies, each small one after those it is attached to.
    nodes: Vec<usize>,
    /// By small node, its place in `nodes`.
    small: Vec<usize>,
    /// Attached big nodes, ascending, and their places in `nodes`.
    attached: Vec<(usize, usize)>,
    /// Blocks of `A` between attached nodes, by the places of row and column, the row not above the column.
    big: Vec<(usize, usize, Block<B>)>,
    /// All blocks in the rows of attached nodes: row, column, block.
    rows: Vec<(usize, usize, Block<B>)>,
    moves: Vec<Moves<B>>,
    /// The first place that each place is coupled to.
    lowest: Vec<usize>,
    /// By row of the block, its first column.
    first: Vec<usize>,
    /// Images of each small node, one after the other: itself, then its attachments.
    images: Vec<Image<B>>,
    n: usize,
    factor: Skyline,
}

impl<const B: usize> CoupledBlock<B> {
    pub fn new(attachments: &[Attachment], n_big: usize) -> Self {
        let (mut nodes, mut small, mut attached) = (Vec::new(), Vec::new(), Vec::new());
        for (node, attachment) in attachments.iter().enumerate() {
            for &(big, _) in attachment {
                if !attached.iter().any(|&(other, _)| other == big) {
                    attached.push((big, nodes.len()));
                    nodes.push(big);
                }
            }
            small.push(nodes.len());
            nodes.push(n_big + node);
        }
        attached.sort_unstable();
        let most = B * nodes.len();
        Self {
            small,
            attached,
            big: Vec::new(),
            rows: Vec::new(),
            moves: Vec::with_capacity(nodes.len()),
            lowest: Vec::with_capacity(nodes.len()),
            first: Vec::with_capacity(most),
            images: Vec::with_capacity(attachments.iter().map(|a| a.len() + 1).sum()),
            nodes,
            n: 0,
            factor: Skyline::new(),
        }
    }

    /// Number of unknowns.
    pub fn dofs(&self) -> usize {
        self.n
    }

    /// The most unknowns of any state.
    pub fn most_dofs(&self) -> usize {
        B * self.nodes.len()
    }

    /// The node, of both bodies, that a row of the block belongs to.
    pub fn node_of(&self, row: usize) -> usize {
        let at = self.moves.partition_point(|moves| moves.start <= row);
        self.nodes[at.saturating_sub(1)]
    }

    /// Copies the big body's rows of attached nodes.
    pub fn read(&mut self, big: &BlockCsr<B>) {
        self.big.clear();
        self.rows.clear();
        for &(node, at) in &self.attached {
            let (columns, blocks) = big.row(node);
            for (&column, block) in columns.iter().zip(blocks) {
                self.rows.push((node, column as usize, *block));
                if let Some(other) = self.place(column as usize)
                    && other <= at
                {
                    self.big.push((at, other, *block));
                }
            }
        }
    }

    pub fn factor(
        &mut self,
        small: &BlockCsr<B>,
        attachments: &[Attachment],
        resistance: &[f64],
        w: &Subspace<B>,
    ) -> Result<(), NotPositiveDefinite> {
        self.number(w);
        self.shape(small, attachments);
        self.add_big();
        self.add_small(small, attachments, resistance, w);
        self.factor.factor()
    }

    /// Sets the entries of attached nodes to zero.
    pub fn clear(&self, big: &mut [f64]) {
        for (node, _) in &self.attached {
            big[node * B..][..B].fill(0.0);
        }
    }

    /// `rᵀz` of the nodes of the block.
    pub fn product(&self, r: &[f64], z: &[f64]) -> f64 {
        let (r, z) = (r.as_chunks::<B>().0, z.as_chunks::<B>().0);
        self.nodes.iter().map(|&node| (0..B).map(|k| r[node][k] * z[node][k]).sum::<f64>()).sum()
    }

    /// Overwrites `z` at the nodes of the block with its inverse times `r`.
    pub fn solve(&self, r: &[f64], z: &mut [f64], scratch: &mut [f64]) {
        let scratch = &mut scratch[..self.n];
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

    /// Adds `A x` to `y`, of an `x` that is zero but at attached nodes: `A` is symmetric, so its columns are its rows.
    pub fn add_product(&self, x: &[f64], y: &mut [f64]) {
        let (x, y) = (x.as_chunks::<B>().0, y.as_chunks_mut::<B>().0);
        for (row, column, block) in &self.rows {
            let (x, y) = (&x[*row], &mut y[*column]);
            for (x, row) in x.iter().zip(block) {
                (0..B).for_each(|k| y[k] += row[k] * x);
            }
        }
    }

    /// Adds to the rows of the block a unit force along `direction` on a small node, and its opposite on what it is attached to.
    pub fn pull(&self, node: usize, attachment: &Attachment, direction: &[f64; B], rows: &mut [f64]) {
        let mut add = |place: usize, weight: f64| {
            let moves = self.moves[place];
            for (row, basis) in rows[moves.start..].iter_mut().zip(&moves.basis[..moves.count]) {
                *row += weight * (0..B).map(|k| basis[k] * direction[k]).sum::<f64>();
            }
        };
        add(self.small[node], 1.0);
        for &(big, weight) in attachment {
            if let Some(place) = self.place(big) {
                add(place, -weight);
            }
        }
    }

    /// The move of a small node relative to its attachment along `direction`.
    pub fn stretch(&self, node: usize, attachment: &Attachment, direction: &[f64; B], rows: &[f64]) -> f64 {
        let along = |place: usize| -> f64 {
            let moves = self.moves[place];
            let values = rows[moves.start..].iter().zip(&moves.basis[..moves.count]);
            values.map(|(value, basis)| value * (0..B).map(|k| basis[k] * direction[k]).sum::<f64>()).sum()
        };
        let attached: f64 =
            attachment.iter().filter_map(|&(big, weight)| self.place(big).map(|place| weight * along(place))).sum();
        along(self.small[node]) - attached
    }

    /// `x ← block⁻¹ x`.
    pub fn solve_rows(&self, x: &mut [f64]) {
        self.factor.solve(x);
    }

    /// The place of an attached big node.
    fn place(&self, node: usize) -> Option<usize> {
        self.attached.binary_search_by_key(&node, |entry| entry.0).ok().map(|at| self.attached[at].1)
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

    /// The envelope: what is coupled by a block of either body, or by a resistance.
    fn shape(&mut self, small: &BlockCsr<B>, attachments: &[Attachment]) {
        self.lowest.clear();
        self.lowest.extend(0..self.nodes.len());
        for &(row, column, _) in &self.big {
            self.lowest[row] = self.lowest[row].min(column);
        }
        // A small node and its attachments are coupled to all that its row of `N` names, and these to it.
        for (node, attachment) in attachments.iter().enumerate() {
            let reach = |node: usize| {
                let places = attachments[node].iter().filter_map(|&(big, _)| self.place(big));
                places.chain([self.small[node]]).min().unwrap_or(usize::MAX)
            };
            let least = small.row(node).0.iter().map(|&j| reach(j as usize)).chain([reach(node)]).min();
            let Some(least) = least else { continue };
            let own = self.small[node];
            self.lowest[own] = self.lowest[own].min(least);
            for &(big, _) in attachment {
                if let Some(place) = self.place(big) {
                    self.lowest[place] = self.lowest[place].min(least);
                }
            }
        }
        self.first.clear();
        for (moves, &lowest) in self.moves.iter().zip(&self.lowest) {
            let start = self.moves[lowest].start;
            self.first.extend((0..moves.count).map(|_| start));
        }
        let Self { factor, first, n, .. } = self;
        factor.reset(*n, |row| first[row]);
    }

    fn add_big(&mut self) {
        for (row, column, block) in &self.big {
            let (rows, cols) = (self.moves[*row], self.moves[*column]);
            let rows = Image { columns: rows.basis, count: rows.count, start: rows.start };
            let cols = Image { columns: cols.basis, count: cols.count, start: cols.start };
            add_form(&mut self.factor, block, &rows, &cols);
        }
    }

    fn add_small(&mut self, small: &BlockCsr<B>, attachments: &[Attachment], resistance: &[f64], w: &Subspace<B>) {
        // Images: moves of its own as they are, those of an attachment weighted, their tied part.
        self.images.clear();
        for (node, attachment) in attachments.iter().enumerate() {
            let own = self.moves[self.small[node]];
            self.images.push(Image { columns: own.basis, count: own.count, start: own.start });
            let free = w.get(self.nodes[self.small[node]]);
            for &(big, weight) in attachment {
                let moves = self.place(big).map_or(own, |place| self.moves[place]);
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
                        add_form(&mut self.factor, block, &row, &col);
                    }
                }
            }
            if resistance[i] != 0.0 {
                self.add_resistance(i, attachment, resistance[i], w);
            }
        }
    }

    /// `c |own moves − what they would be if the node followed its attachments|²`.
    fn add_resistance(&mut self, node: usize, attachment: &Attachment, c: f64, w: &Subspace<B>) {
        let mut block = [[0.0; B]; B];
        (0..B).for_each(|k| block[k][k] = c);
        let free = w.get(self.nodes[self.small[node]]);
        let image = |this: &Self, k: usize| match k.checked_sub(1) {
            None => {
                let own = this.moves[this.small[node]];
                Image { columns: own.basis, count: own.count, start: own.start }
            }
            Some(k) => {
                let (big, weight) = attachment[k];
                let moves = this.moves[this.place(big).unwrap_or(this.small[node])];
                let columns = moves.basis.map(|basis| free.project(basis.map(|v| -v * weight)));
                Image { columns, count: moves.count, start: moves.start }
            }
        };
        for row in 0..=attachment.len() {
            for col in 0..=attachment.len() {
                let (row, col) = (image(self, row), image(self, col));
                add_form(&mut self.factor, &block, &row, &col);
            }
        }
    }
}

/// Adds the lower triangle of `rowsᵀ block cols` where the two images' rows and columns are.
fn add_form<const B: usize>(matrix: &mut Skyline, block: &Block<B>, rows: &Image<B>, cols: &Image<B>) {
    for (l, col) in cols.columns[..cols.count].iter().enumerate() {
        let product = block.map(|row| (0..B).map(|k| row[k] * col[k]).sum::<f64>());
        for (k, row) in rows.columns[..rows.count].iter().enumerate() {
            if rows.start + k >= cols.start + l {
                let value = (0..B).map(|i| row[i] * product[i]).sum::<f64>();
                matrix.add(rows.start + k, cols.start + l, value);
            }
        }
    }
}
