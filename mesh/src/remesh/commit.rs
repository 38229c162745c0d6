//! Carrying out the operation that was chosen, and the release of a needle.

use super::{
    NeedleId, RemeshError, Remesher,
    needle::Split,
    walk::{Place, locate_from},
};
use crate::{
    CellId, MeshChange, Origin, SimplexMesh, VertexId,
    geometry::{distance2, longest_edge2, signed_measure},
    node::NONE,
    remesh::StepReport,
};

impl<const D: usize, const N: usize> Remesher<D, N> {
    /// Carries out the best candidate of the search: places a node at `p`, which is at `place` in the mesh as it is.
    pub(super) fn commit(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        p: [f64; D],
        place: &Place<N>,
        change: &mut MeshChange,
        report: &mut StepReport,
    ) -> Result<(), RemeshError> {
        let best = std::mem::take(&mut self.search.best);
        let outcome = self.carry_out(mesh, k, &best, p, place, change, report);
        self.search.best = best;
        outcome
    }

    #[expect(clippy::too_many_arguments, reason = "what commit takes, and the candidate it took out")]
    fn carry_out(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        best: &super::candidate::Candidate<D, N>,
        p: [f64; D],
        place: &Place<N>,
        change: &mut MeshChange,
        report: &mut StepReport,
    ) -> Result<(), RemeshError> {
        let new = if best.len > 1 { best.n_cells * best.len } else { 0 };
        if let Some(needed) = mesh.lacks_slots(new) {
            return Err(RemeshError::SlotLimit { needed, limit: mesh.slot_limit });
        }
        // Origins are of the mesh as it was.
        let origin = origin_at(mesh, place);
        self.record.clear();
        for &(v, to) in &best.moves {
            let from = locate_from(mesh, mesh.vertex_leaf[v as usize], &to);
            let from = from.unwrap_or_else(|| corner(mesh, v));
            self.record.birth(v, origin_at(mesh, &from));
        }

        for _ in 0..best.undone {
            self.undo_top(mesh, k);
            report.operations.undone += 1;
        }
        self.needles[k].nodes.truncate(best.keep);
        if let [w] = *best.face() {
            self.move_vertex(mesh, k, w, p);
            self.record.birth(w, origin);
            if self.needles[k].nodes.last() != Some(&w) {
                self.needles[k].nodes.push(w);
            }
        } else {
            self.search.walk_stars(mesh, best.cell, best.face());
            let has_face = |&slot: &u32| best.face().iter().all(|a| mesh.nodes[slot as usize].v.contains(a));
            let mut covered: Vec<u32> = self.search.found().iter().copied().filter(has_face).collect();
            covered.sort_unstable();
            self.record.note(mesh, &covered);
            let z = mesh.push_vertex(p);
            let needle = &mut self.needles[k];
            needle.slots.extend_from_slice(&covered);
            let first = needle.slots.len();
            mesh.split_face(best.face(), z, &covered, &mut needle.slots);
            self.record.note_new(&needle.slots[first..]);
            let (len, n_covered) = (best.len as u8, covered.len() as u32);
            needle.splits.push(Split { vertex: z, face: best.face, len, n_covered });
            needle.nodes.push(z);
            self.record.birth(z, origin);
        }
        for &(v, to) in &best.moves {
            self.move_vertex(mesh, k, v, to);
        }
        report.operations.on_faces[best.len - 1] += 1;
        self.record.end_group();
        if self.settings.smoothed_vertices > 0 {
            self.smooth(mesh, k);
        }
        self.finish(mesh, change, report);
        Ok(())
    }

    /// Ends a substep: the cells around moved vertices have changed.
    fn finish(&mut self, mesh: &SimplexMesh<D, N>, change: &mut MeshChange, report: &mut StepReport) {
        self.cells_around_changes(mesh);
        self.record.finish(mesh, &self.around, change);
        (report.min_angle_deg, report.max_angle_deg) = self.record.angles_deg(mesh);
    }

    /// Gathers the live cells around the vertices that the substep made or moved.
    pub(super) fn cells_around_changes(&mut self, mesh: &SimplexMesh<D, N>) {
        self.around.clear();
        for &v in self.record.moved() {
            self.search.walk_stars(mesh, mesh.vertex_leaf[v as usize], &[v]);
            self.around.extend_from_slice(self.search.found());
        }
        self.around.sort_unstable();
        self.around.dedup();
    }

    /// Undoes the split on top of the stack of a needle for good.
    fn undo_top(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize) {
        let needle = &mut self.needles[k];
        if let Some((split, covered, born)) = needle.top() {
            self.record.note(mesh, covered);
            self.record.note(mesh, born);
            mesh.unsplit_face(split.face(), split.vertex, covered, born);
            self.record.removal(split.vertex);
        }
        needle.pop();
    }

    /// Moves a vertex for a needle, and remembers where it was.
    pub(super) fn move_vertex(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize, v: u32, to: [f64; D]) {
        let needle = &mut self.needles[k];
        if needle.made(v) {
            mesh.shift(v, to);
        } else {
            if !needle.moved(v) {
                needle.journal.push((v, mesh.points[v as usize]));
            }
            mesh.displace(v, to);
        }
    }

    /// The needle that has covered one of some cells, and the cell.
    pub(super) fn who_covers(&self, mesh: &SimplexMesh<D, N>, cells: &[u32]) -> Option<(u32, u32)> {
        let cell = *cells.iter().find(|&&slot| !mesh.nodes[slot as usize].is_leaf())?;
        let covers = |needle: &super::Needle<D, N>| needle.covered(0).any(|slot| slot == cell);
        let other = self.needles.iter().position(covers).unwrap_or(0);
        Some((other as u32, cell))
    }

    /// Takes a needle out of the mesh: undoes all its splits and puts every vertex that it moved back where it was.
    ///
    /// The mesh then has the topology that it had without the needle, with the same identifiers, and the same positions
    /// bit for bit. The tip is then where the needle had entered.
    ///
    /// # Errors
    /// [`RemeshError::UnknownNeedle`]; [`RemeshError::SharedElement`] if another needle changed what has to be undone.
    /// Nothing is done then.
    pub fn withdraw(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        needle: NeedleId,
        change: &mut MeshChange,
    ) -> Result<StepReport, RemeshError> {
        let k = self.check_needle(mesh, needle)?;
        let mut report = StepReport::new();
        self.release(mesh, k, change, &mut report)?;
        Ok(report)
    }

    pub(super) fn release(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        change: &mut MeshChange,
        report: &mut StepReport,
    ) -> Result<(), RemeshError> {
        let Some(&entry) = self.needles[k].nodes.first() else { return Ok(()) };
        let entry = mesh.points[entry as usize];
        self.record.clear();
        let needle = &self.needles[k];
        for &(v, home) in &needle.journal {
            let place = locate_from(mesh, mesh.vertex_leaf[v as usize], &home).unwrap_or_else(|| corner(mesh, v));
            self.record.birth(v, origin_at(mesh, &place));
        }

        // Top down; if another needle is found in the way, all is done again bottom up.
        let mut end = needle.slots.len();
        for (i, split) in needle.splits.iter().enumerate().rev() {
            let (covered, born) = needle.slots[end - split.n_slots()..end].split_at(split.n_covered as usize);
            if let Some((other, cell)) = self.who_covers(mesh, born) {
                self.redo_above(mesh, k, i + 1, end);
                return Err(RemeshError::SharedElement { needle: k as u32, other, cell });
            }
            self.record.note(mesh, covered);
            self.record.note(mesh, born);
            mesh.unsplit_face(split.face(), split.vertex, covered, born);
            end -= split.n_slots();
        }
        if let Some((other, cell)) = self.put_home(mesh, k) {
            self.redo_above(mesh, k, 0, 0);
            return Err(RemeshError::SharedElement { needle: k as u32, other, cell });
        }
        let needle = &mut self.needles[k];
        needle.tip = entry;
        for split in &needle.splits {
            self.record.removal(split.vertex);
        }
        report.operations.undone += needle.splits.len() as u32;
        needle.nodes.clear();
        needle.splits.clear();
        needle.slots.clear();
        needle.journal.clear();
        needle.beyond = false;
        self.finish(mesh, change, report);
        mesh.trim();
        Ok(())
    }

    /// Puts the moved vertices of a needle back; if that would turn a cell of another needle over, undoes it and returns
    /// that needle and the cell.
    fn put_home(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize) -> Option<(u32, u32)> {
        let mut journal = std::mem::take(&mut self.needles[k].journal);
        let mut exchange = |mesh: &mut SimplexMesh<D, N>, back: bool| {
            for (v, home) in &mut journal {
                let from = mesh.points[*v as usize];
                if back {
                    mesh.displace(*v, *home)
                } else {
                    mesh.put_back(*v, *home)
                }
                *home = from;
            }
        };
        exchange(mesh, false);
        let alone = self.needles.iter().enumerate().all(|(l, needle)| l == k || needle.nodes.is_empty());
        let mut turned = None;
        if !alone {
            let live = mesh.overlay_cells().chain(mesh.cells().map(|c| c.0));
            turned = live.into_iter().find(|&slot| {
                let node = &mesh.nodes[slot as usize];
                let volume = signed_measure(&mesh.corners_of(&node.v));
                let is_positive = if node.is_negative() { volume < 0.0 } else { volume > 0.0 };
                !is_positive
            });
        }
        if turned.is_some() {
            exchange(mesh, true);
        }
        self.needles[k].journal = journal;
        let cell = turned?;
        let other = (0..self.needles.len()).find(|&l| l != k && !self.needles[l].nodes.is_empty())?;
        Some((other as u32, cell))
    }

    /// Makes again the splits of a needle from the `first` on, whose slots begin at `start`, which were undone last.
    pub(super) fn redo_above(&mut self, mesh: &mut SimplexMesh<D, N>, k: usize, first: usize, start: usize) {
        let needle = &mut self.needles[k];
        let mut at = start;
        for split in &needle.splits[first..] {
            let end = at + split.n_slots();
            redo(mesh, split, &needle.slots[at..end]);
            at = end;
        }
    }

    pub(super) fn check_needle(&self, mesh: &SimplexMesh<D, N>, needle: NeedleId) -> Result<usize, RemeshError> {
        let (n_needles, k) = (self.needles.len(), needle.0 as usize);
        let found = self.needles.get(k).ok_or(RemeshError::UnknownNeedle { needle: needle.0, n_needles })?;
        let other = |what| Err(RemeshError::OtherMesh { needle: needle.0, what });
        let exists = |&v: &u32| (v as usize) < mesh.points.len() && mesh.vertex_leaf[v as usize] != NONE;
        if !found.nodes.iter().all(exists) || !found.journal.iter().all(|entry| exists(&entry.0)) {
            return other("a node of the needle is not a vertex");
        }
        if let Some(&last) = found.nodes.last()
            && !found.beyond
        {
            let edge2 = longest_edge2(&mesh.corners(CellId(mesh.vertex_leaf[last as usize])));
            if distance2(&mesh.points[last as usize], &found.tip) > 1e-10 * edge2 {
                return other("its last node is not at the tip");
            }
        }
        let mut slots = &found.slots[..];
        for split in &found.splits {
            let (these, rest) = slots.split_at(split.n_slots());
            let (covered, born) = these.split_at(split.n_covered as usize);
            slots = rest;
            let has = |slot: u32, v: &u32| mesh.nodes.get(slot as usize).is_some_and(|node| node.v.contains(v));
            let is_covered =
                |&slot: &u32| split.face().iter().all(|v| has(slot, v)) && mesh.nodes[slot as usize].is_covered();
            if !covered.iter().all(is_covered) || !born.iter().all(|&slot| has(slot, &split.vertex)) {
                return other("a cell that the needle split is not there");
            }
        }
        Ok(k)
    }
}

/// Makes a split again that was the last to be undone: slots and vertex are taken from where they were put.
fn redo<const D: usize, const N: usize>(mesh: &mut SimplexMesh<D, N>, split: &Split<N>, slots: &[u32]) {
    let (covered, born) = slots.split_at(split.n_covered as usize);
    let mut again = Vec::with_capacity(born.len());
    let z = mesh.push_vertex(mesh.points[split.vertex as usize]);
    mesh.split_face(split.face(), split.vertex, covered, &mut again);
    debug_assert!(z == split.vertex && again == born, "the slots freed last are taken first");
}

/// The origin of what is put at a place.
pub(super) fn origin_at<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, place: &Place<N>) -> Origin {
    Origin::combination(&mesh.nodes[place.0 as usize].v.map(VertexId), &place.1)
}

/// The place of a vertex.
pub(super) fn corner<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, v: u32) -> Place<N> {
    let cell = mesh.vertex_leaf[v as usize];
    let corners = &mesh.nodes[cell as usize].v;
    (cell, std::array::from_fn(|i| if corners[i] == v { 1.0 } else { 0.0 }))
}

/// The distance of two points.
pub(super) fn distance<const D: usize>(p: &[f64; D], q: &[f64; D]) -> f64 {
    distance2(p, q).sqrt()
}
