//! A matrix that is the sum of element matrices, kept up to date element by element.
//!
//! Between two steps most elements hardly change. [`ElementContributions`] remembers what each element has put into the
//! matrix, and exchanges only the contributions of those that changed enough.

use super::{BlockCsr, SparseError};
use crate::Block;

/// The matrix of an element with `N` nodes: block `[a][b]` couples its nodes `a` and `b`.
pub type ElementBlocks<const B: usize, const N: usize> = [[Block<B>; N]; N];

const NONE: u32 = u32::MAX;

/// When rows are summed up afresh, to be rid of the rounding errors of contributions taken out and put in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RefreshRule {
    /// A row is refreshed at the latest by its `max_replacements`-th replacement, at least 1.
    pub max_replacements: u32,
    /// Rows with replacements that are refreshed at the end of each [`update_where`](ElementContributions::update_where), in
    /// turn, so that the work is spread over the calls.
    pub rows_per_update: usize,
}

impl Default for RefreshRule {
    fn default() -> Self {
        Self { max_replacements: 64, rows_per_update: 8 }
    }
}

/// What a call did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LazyReport {
    /// Elements whose contribution was replaced, inserted or removed.
    pub elements: usize,
    /// Rows summed up afresh.
    pub rows_refreshed: usize,
}

/// The element matrices that make up a [`BlockCsr`], and the elements around each node.
///
/// Elements have ids chosen by the caller, which may be used again; memory is that of the largest. All edits of the matrix
/// must go through here, and always with the same matrix.
///
/// # Rounding
///
/// A block that was summed up afresh is the sum over the elements that share it in ascending id, and so is its mirror image; when
/// all rows are refreshed the matrix is a fresh assembly bit for bit. A replacement takes the old contribution out of the
/// sum and puts the new one in. An entry then differs from the fresh one by at most `(R + n) ε S`, to first order in ε =
/// 2⁻⁵²: `R` is [`RefreshRule::max_replacements`], `n` the number of elements that share the entry, and `S` the largest sum of the
/// magnitudes of its contributions, with the one taken out and the one put in, since the last refresh. Symmetric
/// contributions give a symmetric matrix, bit for bit, at any time.
#[derive(Clone, Debug)]
pub struct ElementContributions<const B: usize, const N: usize> {
    rule: RefreshRule,
    /// By element; the first node of an id that is not in use is `NONE`.
    nodes: Vec<[u32; N]>,
    blocks: Vec<ElementBlocks<B, N>>,
    /// By element and corner, the next element around that node, ascending.
    next: Vec<[u32; N]>,
    /// By node, the first element around it.
    first: Vec<u32>,
    /// By row, replacements since it was refreshed.
    replacements: Vec<u32>,
    /// The row whose turn it is.
    turn: usize,
    /// Rows that the current call changed.
    changed: Vec<u32>,
    is_changed: Vec<bool>,
    row: Row<B>,
}

/// A row and the column of the same node, while they are summed up.
#[derive(Clone, Debug, Default)]
struct Row<const B: usize> {
    cols: Vec<u32>,
    blocks: Vec<Block<B>>,
    column: Vec<Block<B>>,
}

/// An element that cannot be inserted, removed or replaced. What came before it in the same call is done.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContributionError {
    /// The id is in use.
    #[error("element {element} is in use")]
    InUse {
        /// The element.
        element: usize,
    },
    /// There is no such element.
    #[error("element {element} does not exist")]
    Missing {
        /// The element.
        element: usize,
    },
    /// More elements than 32-bit indices can name.
    #[error("element {element} is more than 32-bit indices can name")]
    TooLarge {
        /// The element.
        element: usize,
    },
    /// A node that the matrix does not have, or that occurs twice.
    #[error("node {node} of element {element} is out of range or occurs twice: there are {n_rows} rows")]
    Node {
        /// The element.
        element: usize,
        /// The node.
        node: u32,
        /// Block rows of the matrix.
        n_rows: usize,
    },
    /// The matrix of an element holds NaN or an infinity.
    #[error("block ({a}, {b}) of element {element} holds a number that is not finite")]
    NotFinite {
        /// The element.
        element: usize,
        /// Row of the block in the element.
        a: usize,
        /// Column of the block in the element.
        b: usize,
    },
    /// The change of an element, or the threshold, is NaN.
    #[error("the change of element {element} is {measure}, the threshold {threshold}")]
    Measure {
        /// The element.
        element: usize,
        /// What was measured.
        measure: f64,
        /// What it is compared with.
        threshold: f64,
    },
    /// The matrix refused a row: it is not the one that the contributions belong to.
    #[error(transparent)]
    Matrix(#[from] SparseError),
}

impl<const B: usize, const N: usize> ElementContributions<B, N> {
    /// No elements.
    #[must_use]
    pub fn new(rule: RefreshRule) -> Self {
        Self {
            rule,
            nodes: Vec::new(),
            blocks: Vec::new(),
            next: Vec::new(),
            first: Vec::new(),
            replacements: Vec::new(),
            turn: 0,
            changed: Vec::new(),
            is_changed: Vec::new(),
            row: Row::default(),
        }
    }

    /// The nodes of an element, if it exists.
    #[must_use]
    pub fn nodes(&self, element: usize) -> Option<&[u32; N]> {
        self.nodes.get(element).filter(|nodes| nodes[0] != NONE)
    }

    /// What an element has put into the matrix.
    #[must_use]
    pub fn contribution(&self, element: usize) -> Option<&ElementBlocks<B, N>> {
        self.nodes(element).map(|_| &self.blocks[element])
    }

    /// The elements, ascending.
    pub fn elements(&self) -> impl Iterator<Item = usize> + '_ {
        self.nodes.iter().enumerate().filter(|(_, nodes)| nodes[0] != NONE).map(|(element, _)| element)
    }

    /// Rows in which the last call changed a number or the pattern, in no particular order.
    #[must_use]
    pub fn changed_rows(&self) -> &[u32] {
        &self.changed
    }

    /// Removes elements, then inserts others, whose ids may be those removed. The pattern follows: blocks that no element
    /// shares any more are dropped. Blocks between nodes of these elements are summed up afresh, once each; the others are as they
    /// were. The report counts the rows of these nodes.
    ///
    /// # Errors
    /// [`ContributionError`]; the elements before the one named are removed or inserted, and the matrix is theirs.
    pub fn change(
        &mut self,
        matrix: &mut BlockCsr<B>,
        removed: impl IntoIterator<Item = usize>,
        inserted: impl IntoIterator<Item = (usize, [u32; N], ElementBlocks<B, N>)>,
    ) -> Result<LazyReport, ContributionError> {
        self.begin(matrix);
        let mut elements = 0;
        let mut outcome = Ok(());
        for element in removed {
            outcome = self.unlink(element);
            if outcome.is_err() {
                break;
            }
            elements += 1;
        }
        if outcome.is_ok() {
            for (element, nodes, blocks) in inserted {
                outcome = self.link(matrix.n_rows(), element, nodes, blocks);
                if outcome.is_err() {
                    break;
                }
                elements += 1;
            }
        }
        let rows_refreshed = self.changed.len();
        for at in 0..rows_refreshed {
            self.refresh_among_changed(matrix, self.changed[at] as usize)?;
        }
        outcome.map(|()| LazyReport { elements, rows_refreshed })
    }

    /// Replaces the contribution of every element whose `measure` of change exceeds `threshold` by its new `blocks`, and
    /// refreshes rows as the [`RefreshRule`] says. The pattern stays.
    ///
    /// # Errors
    /// [`ContributionError::Measure`] and [`ContributionError::NotFinite`] name the element; those before it are replaced.
    pub fn update_where(
        &mut self,
        matrix: &mut BlockCsr<B>,
        mut measure: impl FnMut(usize) -> f64,
        threshold: f64,
        mut blocks: impl FnMut(usize) -> ElementBlocks<B, N>,
    ) -> Result<LazyReport, ContributionError> {
        self.begin(matrix);
        let mut report = LazyReport::default();
        for element in 0..self.nodes.len() {
            if self.nodes(element).is_none() {
                continue;
            }
            let measure = measure(element);
            if measure.is_nan() || threshold.is_nan() {
                return Err(ContributionError::Measure { element, measure, threshold });
            }
            if measure > threshold {
                let new = blocks(element);
                check_finite(element, &new)?;
                report.rows_refreshed += self.replace(matrix, element, new)?;
                report.elements += 1;
            }
        }
        report.rows_refreshed += self.refresh_in_turn(matrix)?;
        Ok(report)
    }

    /// Sums up every row afresh: the matrix then has the bits of a fresh assembly.
    ///
    /// # Errors
    /// [`ContributionError::Matrix`] if the matrix is not that of these elements.
    pub fn refresh(&mut self, matrix: &mut BlockCsr<B>) -> Result<LazyReport, ContributionError> {
        self.begin(matrix);
        for row in 0..matrix.n_rows() {
            self.refresh_row(matrix, row)?;
        }
        Ok(LazyReport { elements: 0, rows_refreshed: matrix.n_rows() })
    }

    fn begin(&mut self, matrix: &BlockCsr<B>) {
        for row in self.changed.drain(..) {
            self.is_changed[row as usize] = false;
        }
        let n_rows = matrix.n_rows().max(self.first.len());
        self.first.resize(n_rows, NONE);
        self.replacements.resize(n_rows, 0);
        self.is_changed.resize(n_rows, false);
    }

    fn note(&mut self, row: u32) {
        if !std::mem::replace(&mut self.is_changed[row as usize], true) {
            self.changed.push(row);
        }
    }

    fn link(
        &mut self,
        n_rows: usize,
        element: usize,
        nodes: [u32; N],
        blocks: ElementBlocks<B, N>,
    ) -> Result<(), ContributionError> {
        if self.nodes(element).is_some() {
            return Err(ContributionError::InUse { element });
        }
        let id = u32::try_from(element).ok().filter(|&id| id != NONE).ok_or(ContributionError::TooLarge { element })?;
        for (k, &node) in nodes.iter().enumerate() {
            if node as usize >= n_rows || nodes[..k].contains(&node) {
                return Err(ContributionError::Node { element, node, n_rows });
            }
        }
        check_finite(element, &blocks)?;
        if element >= self.nodes.len() {
            self.nodes.resize(element + 1, [NONE; N]);
            self.next.resize(element + 1, [NONE; N]);
            self.blocks.resize(element + 1, [[[[0.0; B]; B]; N]; N]);
        }
        for (corner, &node) in nodes.iter().enumerate() {
            self.next[element][corner] = self.replace_link(node, |other| other > id, id);
            self.note(node);
        }
        (self.nodes[element], self.blocks[element]) = (nodes, blocks);
        Ok(())
    }

    fn unlink(&mut self, element: usize) -> Result<(), ContributionError> {
        let nodes = *self.nodes(element).ok_or(ContributionError::Missing { element })?;
        for (corner, &node) in nodes.iter().enumerate() {
            let after = self.next[element][corner];
            self.replace_link(node, |other| other as usize == element, after);
            self.note(node);
        }
        self.nodes[element] = [NONE; N];
        Ok(())
    }

    /// In the list around `node`, replaces the first link to an element `at`, or the end, by `new`; returns what was there.
    fn replace_link(&mut self, node: u32, at: impl Fn(u32) -> bool, new: u32) -> u32 {
        let mut link = &mut self.first[node as usize];
        while *link != NONE && !at(*link) {
            let element = *link as usize;
            let corner = corner_of(&self.nodes[element], node);
            link = &mut self.next[element][corner];
        }
        std::mem::replace(link, new)
    }

    /// Old contribution out, new one in; rows that have seen enough of this are refreshed. Returns how many were.
    fn replace(
        &mut self,
        matrix: &mut BlockCsr<B>,
        element: usize,
        new: ElementBlocks<B, N>,
    ) -> Result<usize, ContributionError> {
        let nodes = self.nodes[element];
        let old = std::mem::replace(&mut self.blocks[element], new);
        let mut refreshed = 0;
        for (a, &row) in nodes.iter().enumerate() {
            self.note(row);
            let (cols, blocks) = matrix.row_mut(row as usize);
            for (b, col) in nodes.iter().enumerate() {
                let Ok(at) = cols.binary_search(col) else {
                    return Err(SparseError::NotStored { row: row as usize, col: *col as usize }.into());
                };
                let (old, new) = (old[a][b].as_flattened(), new[a][b].as_flattened());
                for (sum, (old, new)) in blocks[at].as_flattened_mut().iter_mut().zip(old.iter().zip(new)) {
                    *sum = (*sum - old) + new;
                }
            }
            self.replacements[row as usize] += 1;
        }
        for row in nodes {
            if self.replacements[row as usize] >= self.rule.max_replacements {
                self.refresh_row(matrix, row as usize)?;
                refreshed += 1;
            }
        }
        Ok(refreshed)
    }

    /// The next rows in turn that have seen a replacement.
    fn refresh_in_turn(&mut self, matrix: &mut BlockCsr<B>) -> Result<usize, ContributionError> {
        let n_rows = matrix.n_rows();
        let mut refreshed = 0;
        for _ in 0..n_rows {
            if refreshed == self.rule.rows_per_update {
                break;
            }
            let row = self.turn % n_rows;
            self.turn = row + 1;
            if self.replacements[row] > 0 {
                self.refresh_row(matrix, row)?;
                refreshed += 1;
            }
        }
        Ok(refreshed)
    }

    /// Writes a row, and its column where other rows have it: a block and its mirror image always have the same history.
    fn refresh_row(&mut self, matrix: &mut BlockCsr<B>, row: usize) -> Result<(), ContributionError> {
        self.sum_row(row as u32);
        matrix.set_row(row, &self.row.cols, &self.row.blocks)?;
        self.replacements[row] = 0;
        self.note(row as u32);
        for at in 0..self.row.cols.len() {
            let other = self.row.cols[at];
            if other as usize != row
                && let Some(block) = matrix.get_mut(other as usize, row)
            {
                *block = self.row.column[at];
                self.note(other);
            }
        }
        Ok(())
    }

    /// Writes the pattern of a row, and its blocks in the columns of changed rows. Other blocks are those of elements that are
    /// what they were; left alone, they go on to have the history of their mirror images.
    fn refresh_among_changed(&mut self, matrix: &mut BlockCsr<B>, row: usize) -> Result<(), ContributionError> {
        self.row.find_columns(&self.nodes, around(&self.first, &self.next, &self.nodes, row as u32));
        let Self { nodes, blocks, next, first, is_changed, row: Row { cols, blocks: sums, .. }, .. } = self;
        sums.clear();
        sums.resize(cols.len(), [[0.0; B]; B]);
        let (old_cols, old) = matrix.row(row);
        let mut at = 0;
        for (col, sum) in cols.iter().zip(&mut *sums).filter(|(col, _)| !is_changed[**col as usize]) {
            at += old_cols[at..].partition_point(|old| old < col);
            if old_cols.get(at) != Some(col) {
                return Err(SparseError::NotStored { row, col: *col as usize }.into());
            }
            *sum = old[at];
        }
        for element in around(first, next, nodes, row as u32) {
            let a = corner_of(&nodes[element], row as u32);
            for (b, col) in nodes[element].iter().enumerate() {
                if is_changed[*col as usize]
                    && let Ok(at) = cols.binary_search(col)
                {
                    add(&mut sums[at], &blocks[element][a][b]);
                }
            }
        }
        Ok(matrix.set_row(row, cols, sums)?)
    }

    /// The sum over the elements around a node, ascending.
    fn sum_row(&mut self, node: u32) {
        self.row.find_columns(&self.nodes, around(&self.first, &self.next, &self.nodes, node));
        let Self { nodes, blocks, next, first, row: Row { cols, blocks: row, column }, .. } = self;
        for sums in [&mut *row, &mut *column] {
            sums.clear();
            sums.resize(cols.len(), [[0.0; B]; B]);
        }
        for element in around(first, next, nodes, node) {
            let a = corner_of(&nodes[element], node);
            for (b, col) in nodes[element].iter().enumerate() {
                let Ok(at) = cols.binary_search(col) else { continue };
                add(&mut row[at], &blocks[element][a][b]);
                add(&mut column[at], &blocks[element][b][a]);
            }
        }
    }
}

impl<const B: usize> Row<B> {
    /// The nodes of some elements, ascending.
    fn find_columns<const N: usize>(&mut self, nodes: &[[u32; N]], elements: impl Iterator<Item = usize>) {
        self.cols.clear();
        self.cols.extend(elements.flat_map(|element| nodes[element]));
        self.cols.sort_unstable();
        self.cols.dedup();
    }
}

/// The elements around a node, ascending.
fn around<const N: usize>(
    first: &[u32],
    next: &[[u32; N]],
    nodes: &[[u32; N]],
    node: u32,
) -> impl Iterator<Item = usize> {
    let used = |link: u32| (link != NONE).then_some(link as usize);
    std::iter::successors(used(first[node as usize]), move |&element| {
        used(next[element][corner_of(&nodes[element], node)])
    })
}

/// Which corner of an element a node is; it is one of them.
fn corner_of<const N: usize>(nodes: &[u32; N], node: u32) -> usize {
    let corner = nodes.iter().position(|&other| other == node);
    debug_assert!(corner.is_some());
    corner.unwrap_or(0)
}

fn add<const B: usize>(sum: &mut Block<B>, term: &Block<B>) {
    for (sum, term) in sum.as_flattened_mut().iter_mut().zip(term.as_flattened()) {
        *sum += term;
    }
}

fn check_finite<const B: usize, const N: usize>(
    element: usize,
    blocks: &ElementBlocks<B, N>,
) -> Result<(), ContributionError> {
    for (a, row) in blocks.iter().enumerate() {
        for (b, block) in row.iter().enumerate() {
            if block.as_flattened().iter().any(|v| !v.is_finite()) {
                return Err(ContributionError::NotFinite { element, a, b });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
