//! What is remembered of one needle: its nodes, the stack of splits, and where moved nodes belong.

/// A split on the stack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Split<const N: usize> {
    /// The vertex it made.
    pub vertex: u32,
    /// The vertices of the face that was split, the first `len` entries.
    pub face: [u32; N],
    pub len: u8,
    /// Number of cells around the face.
    pub n_covered: u32,
}

impl<const N: usize> Split<N> {
    pub fn face(&self) -> &[u32] {
        &self.face[..self.len as usize]
    }

    /// Number of entries in the list of slots: the covered cells, then the new ones.
    pub fn n_slots(&self) -> usize {
        self.n_covered as usize * (1 + self.len as usize)
    }
}

/// One needle.
#[derive(Clone, Debug)]
pub(super) struct Needle<const D: usize, const N: usize> {
    pub tip: [f64; D],
    /// Whether the tip is outside, past the last node, through which the needle left the mesh.
    pub beyond: bool,
    /// From the entry to the tip; empty while the needle is outside.
    pub nodes: Vec<u32>,
    pub splits: Vec<Split<N>>,
    /// Covered and new cells of the splits, one split after the other.
    pub slots: Vec<u32>,
    /// Vertices that this needle moved and no split of it made, and where they were before.
    pub journal: Vec<(u32, [f64; D])>,
}

impl<const D: usize, const N: usize> Needle<D, N> {
    pub fn new(tip: [f64; D]) -> Self {
        Self { tip, beyond: false, nodes: Vec::new(), splits: Vec::new(), slots: Vec::new(), journal: Vec::new() }
    }

    /// The split on top of the stack, its covered and its new cells.
    pub fn top(&self) -> Option<(Split<N>, &[u32], &[u32])> {
        let split = *self.splits.last()?;
        let slots = &self.slots[self.slots.len() - split.n_slots()..];
        let (covered, born) = slots.split_at(split.n_covered as usize);
        Some((split, covered, born))
    }

    /// The split on top of the stack if it made the node at the tip.
    pub fn top_that_made_the_tip(&self) -> Option<(Split<N>, &[u32], &[u32])> {
        self.top().filter(|(split, _, _)| self.nodes.last() == Some(&split.vertex))
    }

    /// Takes the top off the stack.
    pub fn pop(&mut self) {
        if let Some(split) = self.splits.pop() {
            self.slots.truncate(self.slots.len() - split.n_slots());
        }
    }

    pub fn made(&self, vertex: u32) -> bool {
        self.splits.iter().any(|split| split.vertex == vertex)
    }

    pub fn moved(&self, vertex: u32) -> bool {
        self.journal.iter().any(|entry| entry.0 == vertex)
    }

    /// The cells that its splits cover, but for the topmost `uncovered` ones.
    pub fn covered(&self, uncovered: usize) -> impl Iterator<Item = u32> + '_ {
        let mut slots = &self.slots[..];
        self.splits[..self.splits.len() - uncovered].iter().flat_map(move |split| {
            let (these, rest) = slots.split_at(split.n_slots());
            slots = rest;
            these[..split.n_covered as usize].iter().copied()
        })
    }

    /// Whether the first `n` nodes contain the edge between `a` and `b`.
    pub fn has_edge(&self, n: usize, a: u32, b: u32) -> bool {
        self.nodes[..n].windows(2).any(|e| e == [a, b] || e == [b, a])
    }
}
