//! Nodes by generation, as a bisected mesh hands them out.

use super::MultilevelError;

/// A node that halves an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Birth {
    pub node: u32,
    pub parents: [u32; 2],
}

/// Where each node comes from: the start nodes of generation 0, and all others midway between two parents of lower generation.
///
/// Nodes of one generation must not share an element of the mesh that has the nodes up to that generation; then each
/// generation is a mesh of its own. (The preconditioners are correct without that, but not as good.) Nodes that the
/// hierarchy does not list are left to the smoothing of the finest level.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BisectionHierarchy {
    n_nodes: usize,
    /// Nodes of generation 0, ascending.
    start: Vec<u32>,
    /// Births by generation, ascending by node within one.
    births: Vec<Birth>,
    /// `births[ends[g - 1]..ends[g]]` are those of generation `g + 1`.
    ends: Vec<usize>,
    /// By node, whether it is listed.
    listed: Vec<bool>,
}

impl BisectionHierarchy {
    /// The hierarchy of the `nodes` listed, in any order. `parents` and `generations` have one entry per node of the matrix;
    /// those of nodes that are not listed, and the parents of start nodes, are not looked at.
    ///
    /// # Errors
    /// [`MultilevelError::Lengths`], [`MultilevelError::NodeOutOfRange`], [`MultilevelError::Listed`] for a node that occurs
    /// twice, [`MultilevelError::Parents`] for parents that are equal, not listed, or not of lower generation.
    pub fn new(
        nodes: impl IntoIterator<Item = u32>,
        parents: &[[u32; 2]],
        generations: &[u16],
    ) -> Result<Self, MultilevelError> {
        let mut this = Self::default();
        this.rebuild(nodes, parents, generations)?;
        Ok(this)
    }

    /// As [`new`](Self::new), in the memory at hand: O(n) for n nodes, since both sort by counting.
    ///
    /// # Errors
    /// As [`new`](Self::new); the hierarchy is then of no use until a rebuild succeeds.
    pub fn rebuild(
        &mut self,
        nodes: impl IntoIterator<Item = u32>,
        parents: &[[u32; 2]],
        generations: &[u16],
    ) -> Result<(), MultilevelError> {
        if parents.len() != generations.len() {
            return Err(MultilevelError::Lengths { parents: parents.len(), generations: generations.len() });
        }
        self.n_nodes = parents.len();
        self.list(nodes)?;
        self.count(generations);
        self.place(parents, generations)
    }

    fn list(&mut self, nodes: impl IntoIterator<Item = u32>) -> Result<(), MultilevelError> {
        let n_nodes = self.n_nodes;
        self.listed.clear();
        self.listed.resize(n_nodes, false);
        for node in nodes {
            let node = node as usize;
            let listed = self.listed.get_mut(node).ok_or(MultilevelError::NodeOutOfRange { node, n_nodes })?;
            if std::mem::replace(listed, true) {
                return Err(MultilevelError::Listed { node });
            }
        }
        Ok(())
    }

    /// Makes room for the births of each generation; `ends` are the places of the next birth of each.
    fn count(&mut self, generations: &[u16]) {
        self.ends.clear();
        for node in nodes_in(&self.listed) {
            let generation = usize::from(generations[node]);
            if generation > self.ends.len() {
                self.ends.resize(generation, 0);
            }
            if generation > 0 {
                self.ends[generation - 1] += 1;
            }
        }
        let mut end = 0;
        for place in &mut self.ends {
            end += std::mem::replace(place, end);
        }
        self.births.clear();
        self.births.resize(end, Birth { node: 0, parents: [0; 2] });
    }

    fn place(&mut self, parents: &[[u32; 2]], generations: &[u16]) -> Result<(), MultilevelError> {
        self.start.clear();
        for node in nodes_in(&self.listed) {
            let generation = generations[node];
            if generation == 0 {
                self.start.push(node as u32);
                continue;
            }
            let pair @ [l, r] = parents[node];
            let older = |&p: &u32| self.listed.get(p as usize) == Some(&true) && generations[p as usize] < generation;
            if l == r || !pair.iter().all(older) {
                return Err(MultilevelError::Parents { node, parents: pair, generation });
            }
            let next = &mut self.ends[usize::from(generation) - 1];
            self.births[*next] = Birth { node: node as u32, parents: pair };
            *next += 1;
        }
        Ok(())
    }

    /// Number of nodes of the matrix.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.n_nodes
    }

    /// The highest generation.
    #[must_use]
    pub fn n_generations(&self) -> usize {
        self.ends.len()
    }

    /// The nodes of generation 0, ascending.
    #[must_use]
    pub fn start(&self) -> &[u32] {
        &self.start
    }

    /// The births of a generation from 1 on.
    pub(super) fn births(&self, generation: usize) -> &[Birth] {
        let first = if generation == 1 { 0 } else { self.ends[generation - 2] };
        &self.births[first..self.ends[generation - 1]]
    }
}

fn nodes_in(listed: &[bool]) -> impl Iterator<Item = usize> + use<'_> {
    listed.iter().enumerate().filter(|(_, listed)| **listed).map(|(node, _)| node)
}
