//! The record of a running operation, from which its net change is made.
//!
//! Slots that the operation appends need no record: what is alive in them at the end was born. A slot that existed before
//! carries three bits while the operation runs (`DIED`, `BORN`, `REUSED` in its node), which tell at the end whether the
//! cell in it is still the one from before, however often it was bisected, revived, freed and taken over in between.

use crate::{
    BisectError, CellId, MeshChange, SimplexMesh, VertexBirth, VertexId,
    node::{BORN, DIED, NONE, Node, REUSED},
};

/// Lists with more than one in so many of all slots are not sorted.
const SCAN: usize = 16;

/// What bisection did since a mesh was made or read.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Work {
    /// Live cells that were asked to be bisected: marked by the caller, or found to be too long for a size.
    pub marks: u64,
    /// Cells bisected: these, and those that conformity demanded.
    pub bisections: u64,
}

/// What is known of a running operation, and its scratch space.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recorder {
    /// The first slot that the operation appended.
    first_slot: u32,
    pub births: Vec<VertexBirth>,
    died: Vec<CellId>,
    born: Vec<CellId>,
    removed: Vec<VertexId>,
    /// Bisections of cells so far, and the most that there may be.
    pub bisections: usize,
    pub limit: usize,
    /// Over all operations.
    pub total: Work,
    /// The cells around the edge that is being bisected or the vertex that is being removed.
    pub patch: Vec<u32>,
    /// The stack of the closure.
    pub stack: Vec<u32>,
}

impl Recorder {
    /// Notes that the live cell in `slot` is no longer alive. To be called for a cell that is, before or after the node
    /// is changed.
    #[inline]
    pub fn kill<const N: usize>(&mut self, slot: u32, node: &mut Node<N>) {
        if slot < self.first_slot {
            if node.info & BORN != 0 {
                node.info &= !BORN;
            } else {
                node.info |= DIED;
                self.died.push(CellId(slot));
            }
        }
    }

    /// Notes that the free slot `slot` was taken over by a new live cell. The bits that its node had before are `old`.
    #[inline]
    pub fn make<const N: usize>(&mut self, slot: u32, old: u32, node: &mut Node<N>) {
        if slot < self.first_slot {
            node.info |= old & DIED | BORN | REUSED;
            self.born.push(CellId(slot));
        }
    }

    /// Notes that the inner node in `slot` is a live cell again.
    pub fn revive<const N: usize>(&mut self, slot: u32, node: &mut Node<N>) {
        if slot < self.first_slot {
            if node.info & (DIED | REUSED) == DIED {
                node.info &= !DIED;
            } else {
                node.info |= BORN;
                self.born.push(CellId(slot));
            }
        }
    }

    /// Notes that a vertex was removed.
    pub fn remove(&mut self, vertex: u32) {
        self.removed.push(VertexId(vertex));
    }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// What bisection did since the mesh was made or read.
    pub fn work(&self) -> Work {
        self.recorder.total
    }

    /// Runs an operation and composes `change` with the net difference that it makes, whether it succeeds or not.
    pub(crate) fn record<R>(
        &mut self,
        change: &mut MeshChange,
        operation: impl FnOnce(&mut Self, &mut Recorder) -> Result<R, BisectError>,
    ) -> Result<R, BisectError> {
        let mut recorder = std::mem::take(&mut self.recorder);
        recorder.first_slot = self.nodes.len() as u32;
        recorder.births = std::mem::take(&mut change.vertices);
        recorder.bisections = 0;
        recorder.limit = self.bisection_limit;
        let outcome = operation(self, &mut recorder);
        recorder.total.bisections += recorder.bisections as u64;
        change.vertices = std::mem::take(&mut recorder.births);
        self.close_record(&mut recorder, change);
        self.recorder = recorder;
        outcome
    }

    fn close_record(&mut self, recorder: &mut Recorder, change: &mut MeshChange) {
        let Recorder { died, born, removed, first_slot, .. } = recorder;
        // Every slot that carries a bit is in one of the lists; if they are long, a scan of all slots is faster.
        let listed = died.len() + born.len();
        let scan = listed > *first_slot as usize / SCAN;
        let bits = |cell: CellId| self.nodes[cell.index()].info;
        let net = |list: &[CellId], bit: u32| -> Vec<CellId> {
            let has_bit = |cell: &CellId| bits(*cell) & bit != 0;
            if scan && !list.is_empty() {
                return (0..*first_slot).map(CellId).filter(has_bit).collect();
            }
            let mut list: Vec<CellId> = list.iter().copied().filter(has_bit).collect();
            sort(&mut list);
            list
        };
        let net_died = net(died, DIED);
        let mut net_born = net(born, BORN);
        let appended = &self.nodes[*first_slot as usize..];
        net_born.reserve(appended.len() / 2 + 1);
        for (slot, node) in (*first_slot..).zip(appended) {
            if node.is_leaf() {
                net_born.push(CellId(slot));
            }
        }
        change.compose(&net_died, net_born, |cell| bits(cell) & REUSED != 0);
        for cell in died.iter().chain(born.iter()) {
            self.nodes[cell.index()].info &= !(DIED | BORN | REUSED);
        }
        if !(removed.is_empty() && change.removed.is_empty()) {
            change.removed.append(removed);
            sort(&mut change.removed);
            change.removed.retain(|v| self.vertex_leaf[v.index()] == NONE);
        }
        died.clear();
        born.clear();
    }
}

/// Sorts a list, usually sorted already, and drops what is there twice.
fn sort<T: Ord>(list: &mut Vec<T>) {
    if !list.is_sorted_by(|a, b| a < b) {
        list.sort_unstable();
        list.dedup();
    }
}
