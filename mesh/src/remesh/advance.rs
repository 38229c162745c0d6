//! A step of the tip: through the skin, substep by substep, and out again.

use super::{
    Motion, NeedleId, Outcome, RemeshError, Remesher, StepReport,
    candidate::{Round, Rule},
    check_tip,
    commit::distance,
    walk::{Place, crossing, locate_from, put_on_skin},
};
use crate::{MeshChange, SimplexMesh, geometry::longest_edge2, node::NONE};

/// The longest substep, in parts of the mean longest edge of the cells around the tip.
const STRIDE: f64 = 0.4;
/// A substep that no operation can do is halved at most so many times.
const HALVINGS: i32 = 8;
/// Two points closer than this part of an edge are one; a tip closer to the skin is on it.
const TOUCH: f64 = 1e-6;

impl<const D: usize, const N: usize> Remesher<D, N> {
    /// Moves the tip of a needle in a straight line to `tip`, and composes `change` with what that does to the mesh.
    ///
    /// A tip that comes from outside enters where its path first crosses the boundary inwards: there the needle gets its
    /// first node, which stays until the needle is withdrawn. A path that only touches the boundary, or runs along it,
    /// stays outside. A penetrating tip that leaves the mesh gets a node where it leaves, and is then
    /// [`Beyond`](Outcome::Beyond); it may be retracted through that node, but not penetrate again. A retracting tip that
    /// leaves the mesh has come out where it went in, and the needle is [withdrawn](Self::withdraw).
    ///
    /// Long steps are divided. Within a millionth of an edge, the tip and the skin, and the tip and its last position,
    /// are one.
    ///
    /// # Errors
    /// [`RemeshError`]. The mesh stays valid, the needle where its last whole substep brought it, and `change` true.
    pub fn advance(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        needle: NeedleId,
        tip: [f64; D],
        motion: Motion,
        change: &mut MeshChange,
    ) -> Result<StepReport, RemeshError> {
        check_tip(&tip)?;
        let k = self.check_needle(mesh, needle)?;
        let mut report = StepReport::new();
        if self.needles[k].nodes.is_empty() && !self.enter(mesh, k, &tip, motion, change, &mut report)? {
            self.needles[k].tip = tip;
            return Ok(report);
        }
        while self.substep(mesh, k, &tip, motion, change, &mut report)? {}
        let needle = &self.needles[k];
        report.outcome = match (needle.nodes.is_empty(), needle.beyond) {
            (true, _) => Outcome::Outside,
            (false, true) => Outcome::Beyond,
            (false, false) => Outcome::Inside,
        };
        Ok(report)
    }

    /// Places the entry node of a needle, if the way to `tip` leads into the mesh.
    fn enter(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        tip: &[f64; D],
        motion: Motion,
        change: &mut MeshChange,
        report: &mut StepReport,
    ) -> Result<bool, RemeshError> {
        let from = self.needles[k].tip;
        let Some(entry) = crossing(mesh, &from, tip, true) else { return Ok(false) };
        if motion == Motion::Retracting {
            return Err(RemeshError::NotInserted { needle: k as u32 });
        }
        let round = Round { needle: k, p: entry.point, keep: 0, follower: None, undone: 0 };
        let apex = mesh.nodes[entry.place.0 as usize].v[entry.facet];
        self.search.clear();
        self.search.round(mesh, &self.needles, &round, &entry.place, |face| !face.contains(&apex));
        if !self.search.best.exists() {
            return Err(RemeshError::NoCandidate { needle: k as u32, distance: distance(&entry.point, tip) });
        }
        self.commit(mesh, k, entry.point, &entry.place, change, report)?;
        self.needles[k].tip = entry.point;
        report.substeps += 1;
        Ok(true)
    }

    /// One substep towards `tip`; false once the tip has arrived.
    fn substep(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        tip: &[f64; D],
        motion: Motion,
        change: &mut MeshChange,
        report: &mut StepReport,
    ) -> Result<bool, RemeshError> {
        let Some(&last) = self.needles[k].nodes.last() else { return Ok(false) };
        let from = mesh.points[last as usize];
        let edge = self.edge_around(mesh, last);
        let left = distance(&from, tip);
        if left <= TOUCH * edge {
            if motion == Motion::Retracting && self.needles[k].nodes.len() == 1 {
                self.release(mesh, k, change, report)?;
            }
            self.needles[k].tip = *tip;
            return Ok(false);
        }
        let mut part = (STRIDE * edge / left).min(1.0);
        let mut blocked = None;
        for _ in 0..HALVINGS {
            let p = std::array::from_fn(|i| if part == 1.0 { tip[i] } else { from[i] + part * (tip[i] - from[i]) });
            match locate_from(mesh, mesh.vertex_leaf[last as usize], &p) {
                Some(mut place) => {
                    if self.needles[k].beyond && motion == Motion::Penetrating {
                        return Err(RemeshError::SecondEntry { needle: k as u32 });
                    }
                    let mut p = p;
                    put_on_skin(mesh, &mut place, &mut p, TOUCH);
                    if motion == Motion::Retracting && self.is_at_entry(mesh, k, &p, edge) {
                        self.release(mesh, k, change, report)?;
                        self.needles[k].tip = *tip;
                        return Ok(false);
                    }
                    if self.attempt(mesh, k, p, &place, motion, &mut blocked) {
                        self.commit(mesh, k, p, &place, change, report)?;
                        self.needles[k].tip = p;
                        self.needles[k].beyond = false;
                        report.substeps += 1;
                        return Ok(part < 1.0);
                    }
                }
                None if self.needles[k].beyond => {
                    self.needles[k].tip = *tip;
                    return Ok(false);
                }
                None if motion == Motion::Retracting => {
                    self.release(mesh, k, change, report)?;
                    self.needles[k].tip = *tip;
                    return Ok(false);
                }
                None => {
                    let Some(exit) = crossing(mesh, &from, &p, false) else {
                        // It starts on the boundary and leads outwards.
                        self.needles[k].beyond = true;
                        self.needles[k].tip = *tip;
                        return Ok(false);
                    };
                    let here = distance(&exit.point, &from) <= TOUCH * edge;
                    if here || self.attempt(mesh, k, exit.point, &exit.place, motion, &mut blocked) {
                        if !here {
                            self.commit(mesh, k, exit.point, &exit.place, change, report)?;
                            report.substeps += 1;
                        }
                        self.needles[k].beyond = true;
                        self.needles[k].tip = *tip;
                        return Ok(false);
                    }
                }
            }
            part *= 0.5;
        }
        let needle = k as u32;
        Err(match blocked {
            Some((other, cell)) => RemeshError::SharedElement { needle, other, cell },
            None => RemeshError::NoCandidate { needle, distance: left },
        })
    }

    fn is_at_entry(&self, mesh: &SimplexMesh<D, N>, k: usize, p: &[f64; D], edge: f64) -> bool {
        let entry = self.needles[k].nodes[0];
        distance(&mesh.points[entry as usize], p) <= TOUCH * edge
    }

    /// The mean longest edge of the cells around a vertex.
    fn edge_around(&mut self, mesh: &SimplexMesh<D, N>, v: u32) -> f64 {
        self.search.walk_stars(mesh, mesh.vertex_leaf[v as usize], &[v]);
        let cells = self.search.found();
        let edge = |&slot: &u32| longest_edge2(&mesh.corners_of(&mesh.nodes[slot as usize].v)).sqrt();
        cells.iter().map(edge).sum::<f64>() / cells.len() as f64
    }

    /// Looks for the best operation that places the tip at `p`, which is at `place`. The mesh is the same afterwards.
    ///
    /// If the split to be undone is in the way of another needle, that one and the cell are put into `blocked`.
    fn attempt(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        p: [f64; D],
        place: &Place<N>,
        motion: Motion,
        blocked: &mut Option<(u32, u32)>,
    ) -> bool {
        self.search.clear();
        let n = self.needles[k].nodes.len();
        let tip = self.needles[k].nodes[n - 1];
        let retracts = motion == Motion::Retracting && n > 1;

        // The tip stays a node: it is snapped, or, penetrating, joined with a new one.
        let round = Round { needle: k, p, keep: n, follower: None, undone: 0 };
        self.search.round(mesh, &self.needles, &round, place, |face| face == [tip]);
        if !retracts {
            let round = Round { follower: self.follower(mesh, k, n), ..round };
            self.search.round(mesh, &self.needles, &round, place, |face| face != [tip]);
        }
        let made_by_top = self.needles[k].top_that_made_the_tip().is_some();
        if n > 1 && (retracts || made_by_top) {
            self.attempt_without(mesh, k, 1, p, motion, blocked);
        }
        // Beyond the paper, where all that is poor: the needle loses a snapped tip also when it penetrates, or two nodes.
        if n > 1 && self.search.best.is_poor() {
            if !retracts && !made_by_top {
                self.attempt_without(mesh, k, 1, p, motion, blocked);
            }
            if n > 2 {
                self.attempt_without(mesh, k, 2, p, motion, blocked);
            }
        }
        self.search.best.exists()
    }

    /// Tries the operations after the last `m` nodes have been taken from the needle, and from the mesh where the top of
    /// the stack made them. What is undone is made again.
    fn attempt_without(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        k: usize,
        m: usize,
        p: [f64; D],
        motion: Motion,
        blocked: &mut Option<(u32, u32)>,
    ) {
        let needle = &self.needles[k];
        let (nodes, keep) = (&needle.nodes, needle.nodes.len() - m);
        let mut end = needle.slots.len();
        let (mut undone, mut survivor) = (0, None);
        self.search.begin_undo();
        for &node in nodes[keep..].iter().rev() {
            let top = needle.splits.iter().rev().nth(undone).filter(|split| split.vertex == node);
            let Some(split) = top else {
                survivor = survivor.or(Some(node));
                continue;
            };
            let slots = &needle.slots[end - split.n_slots()..end];
            let (covered, born) = slots.split_at(split.n_covered as usize);
            if let Some(other) = self.who_covers(mesh, born) {
                *blocked = Some(other);
                break;
            }
            self.search.lose(mesh, covered, born);
            mesh.unsplit_face(split.face(), split.vertex, covered, born);
            self.search.revive(mesh, covered);
            end -= split.n_slots();
            undone += 1;
        }
        let before = nodes[keep - 1];
        let place = locate_from(mesh, mesh.vertex_leaf[before as usize], &p);
        if let Some(place) = place.filter(|_| blocked.is_none()) {
            let retracts = motion == Motion::Retracting;
            let follower = |n| match survivor {
                Some(survivor) if retracts => Some((survivor, Rule::Free)),
                _ if retracts => None,
                _ => self.follower(mesh, k, n),
            };
            let round = Round { needle: k, p, keep, follower: follower(keep), undone };
            let snapped = Round { follower: follower(keep - 1), ..round };
            let is_follower = |face: &[u32]| retracts && survivor.is_some_and(|v| face == [v]);
            self.search.round(mesh, &self.needles, &round, &place, |face| face != [before] && !is_follower(face));
            self.search.round(mesh, &self.needles, &snapped, &place, |face| face == [before]);
        }
        self.search.end_undo();
        self.redo_above(mesh, k, self.needles[k].splits.len() - undone, end);
    }

    /// The last of the first `n` nodes of a needle and the segment that it may move on, if it is neither the entry node
    /// nor the next to no other.
    fn follower(&self, mesh: &SimplexMesh<D, N>, k: usize, n: usize) -> Option<(u32, Rule<D>)> {
        let nodes = &self.needles[k].nodes;
        if n < 2 {
            return None;
        }
        let (o, before) = (nodes[n - 1], nodes[n - 2]);
        (o != NONE).then(|| (o, Rule::Segment(mesh.points[before as usize])))
    }
}
