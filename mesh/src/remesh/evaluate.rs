//! One candidate: whether it is allowed, which cells it kills, which it makes.

use super::{
    candidate::{Candidate, Near, Round, Rule, near},
    freedom::Freedom,
    measure::{Moving, Star, shape},
    needle::Needle,
    search::Search,
};
use crate::{
    SimplexMesh,
    geometry::{self, subtract},
    node::NONE,
};

/// The least shape that a cell may have: normalised volume 1e-9.
const LEAST_SHAPE: f64 = 1e-18;
/// A point is in the plane of a facet if it is no farther away than this part of the height of a cell.
const IN_PLANE: f64 = 1e-12;
/// Covered cells must stay such that a split can be undone. What moves their vertices counts them as so many times
/// better than they are (shapes are squares), so that only bad ones matter, ...
pub(super) const COVERED_WEIGHT: f64 = 16.0;
/// ... or must not make them worse than this.
const COVERED_SHAPE: f64 = 1e-3;
/// How close to its ends the optimum is sought on a segment.
const MARGIN: f64 = 0.02;

impl<const D: usize, const N: usize> Search<D, N> {
    /// Fills in the shapes of the trial operation, on the face of the vertices of `t` in `subset`; false if it is not
    /// allowed, or certainly worse than the best.
    pub(super) fn evaluate(
        &mut self,
        mesh: &SimplexMesh<D, N>,
        needles: &[Needle<D, N>],
        round: &Round<D>,
        subset: u8,
    ) -> bool {
        let trial = &mut self.trial;
        (trial.undone, trial.keep) = (round.undone, round.keep);
        trial.moves.clear();
        trial.made.clear();
        trial.killed.clear();
        self.hit.clear();
        self.hit.extend(self.patch.iter().filter(|cell| cell.mask & subset == subset));
        trial.n_cells = self.hit.len();
        if !self.is_allowed(mesh, needles, round) {
            return false;
        }
        self.kill(round);
        let least_killed = self.trial.killed.iter().fold(f64::INFINITY, |least, &x| least.min(x));
        // Whoever makes a worse cell than the best candidate does, and kills none as bad, has lost.
        let floor = if self.best.exists() { self.best.worst().min(least_killed) } else { LEAST_SHAPE };
        let floor = floor.max(LEAST_SHAPE);
        self.make(mesh, round, floor) && self.make_with_follower(mesh, round, floor)
    }

    /// Whether the nodes of the needle are joined, the boundary keeps its shape, and splits can still be undone.
    fn is_allowed(&self, mesh: &SimplexMesh<D, N>, needles: &[Needle<D, N>], round: &Round<D>) -> bool {
        let (p, face) = (round.p, self.trial.face());
        let anchor = needles[round.needle].nodes[..round.keep].last();
        let joins = |anchor: &u32| face == [*anchor] || self.hit.iter().any(|cell| cell.v.contains(anchor));
        if !anchor.is_none_or(joins) {
            return false;
        }
        if self.hit.iter().any(|cell| cell.boundary != 0 && bends_boundary(mesh, cell, face, &p)) {
            return false;
        }
        let [w] = *face else { return true };
        let is_kept = |slot| {
            let cell = near(mesh, slot, &[]);
            let corners: [[f64; D]; N] =
                std::array::from_fn(|i| if cell.v[i] == w { p } else { mesh.points[cell.v[i] as usize] });
            shape(&corners, cell.sign) >= COVERED_SHAPE.min(cell.shape)
        };
        covered_around(mesh, needles, round, w).all(is_kept)
    }

    /// Lists the shapes of the cells that the operation, or the move of the follower, does away with.
    fn kill(&mut self, round: &Round<D>) {
        let Self { trial, hit, around, revived, lost, .. } = self;
        let Candidate { killed, face, len, .. } = trial;
        let face = &face[..*len];
        let has_face = |cell: &Near<N>| face.iter().all(|a| cell.v.contains(a));
        let is_revived = |cell: &Near<N>| revived.iter().any(|r| r.slot == cell.slot);
        let beside = around.iter().filter(|cell| round.follower.is_some() && !has_face(cell));
        killed.extend(hit.iter().chain(beside).filter(|cell| !is_revived(cell)).map(|cell| cell.shape));
        killed.extend_from_slice(lost);
    }

    /// Lists the shapes of the cells that are made, and collects those that the follower will change; false as soon as
    /// one is below the floor.
    fn make(&mut self, mesh: &SimplexMesh<D, N>, round: &Round<D>, floor: f64) -> bool {
        let Self { trial, hit, revived, star, .. } = self;
        let Candidate { made, face, len, .. } = trial;
        let face = &face[..*len];
        let o = round.follower.map_or(NONE, |(o, _)| o);
        star.cells.clear();
        for cell in revived {
            let is_killed = face.iter().all(|a| cell.v.contains(a)) || cell.v.contains(&o);
            if !is_killed {
                made.push(cell.shape);
            }
        }
        if made.iter().any(|&shape| shape < floor) {
            return false;
        }
        for cell in hit {
            let corners = mesh.corners_of(&cell.v);
            for &a in face {
                let mut moved = corners;
                (0..N).filter(|&i| cell.v[i] == a).for_each(|i| moved[i] = round.p);
                if let Some(at) = cell.v.iter().position(|&v| v == o && v != a) {
                    star.cells.push(Moving::of(&moved, cell.sign, at));
                    continue;
                }
                let shape = shape(&moved, cell.sign);
                if shape < floor || shape.is_nan() {
                    return false;
                }
                made.push(shape);
            }
        }
        true
    }

    /// Moves the follower to its best place and lists the shapes of the cells around it; false if one is below the
    /// floor.
    fn make_with_follower(&mut self, mesh: &SimplexMesh<D, N>, round: &Round<D>, floor: f64) -> bool {
        let Some((o, rule)) = round.follower else { return true };
        let Self { trial, hit, around, covered, star, .. } = self;
        let face = &trial.face[..trial.len];
        let has_face = |cell: &Near<N>| face.iter().all(|a| cell.v.contains(a));
        let moving =
            |v: &[u32; N], sign| v.iter().position(|&v| v == o).map(|at| Moving::of(&mesh.corners_of(v), sign, at));
        star.cells.extend(around.iter().filter(|cell| !has_face(cell)).filter_map(|cell| moving(&cell.v, cell.sign)));
        let n_made = star.cells.len();
        if n_made == 0 {
            return true;
        }
        // Cells that are covered, or will be.
        let ready = hit.iter().filter(|_| face.len() > 1).map(|cell| (cell.v, cell.sign));
        let hidden = covered.iter().map(|cell| (cell.v, cell.sign)).chain(ready);
        let hidden = hidden.filter_map(|(v, sign)| moving(&v, sign));
        star.cells.extend(hidden.map(|cell| cell.weighted(COVERED_WEIGHT)));

        let home = mesh.points[o as usize];
        let (d, worst) = follow(star, &home, &round.p, &rule);
        if worst < floor || worst.is_nan() {
            return false;
        }
        trial.made.extend(star.cells[..n_made].iter().map(|cell| cell.at(&d)));
        if d != [0.0; D] {
            trial.moves.push((o, std::array::from_fn(|k| home[k] + d[k])));
        }
        true
    }
}

/// The covered cells around a vertex.
pub(super) fn covered_around<'a, const D: usize, const N: usize>(
    mesh: &'a SimplexMesh<D, N>,
    needles: &'a [Needle<D, N>],
    round: &Round<D>,
    v: u32,
) -> impl Iterator<Item = u32> + 'a {
    let (own, undone) = (round.needle, round.undone);
    let covered =
        needles.iter().enumerate().flat_map(move |(k, needle)| needle.covered(if k == own { undone } else { 0 }));
    covered.filter(move |&slot| mesh.nodes[slot as usize].v.contains(&v))
}

/// The best move of a follower, and the least shape after it. Staying is always among the choices on a segment.
fn follow<const D: usize>(star: &mut Star<D>, home: &[f64; D], p: &[f64; D], rule: &Rule<D>) -> ([f64; D], f64) {
    let stay = ([0.0; D], star.least(&[0.0; D]));
    match rule {
        Rule::Segment(end) => {
            let range = (MARGIN, 1.0 - MARGIN);
            star.best_on_line(&subtract(p, home), &subtract(end, p), range, stay.1).unwrap_or(stay)
        }
        Rule::Free => {
            let (d, _) = star.descend(&Freedom::full());
            (d, star.least(&d))
        }
    }
}

/// Whether an operation that places a node at `p` would bend a boundary facet of a cell around the face.
fn bends_boundary<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    cell: &Near<N>,
    face: &[u32],
    p: &[f64; D],
) -> bool {
    let changed = (0..N).filter(|&i| cell.boundary >> i & 1 == 1 && !face.contains(&cell.v[i]));
    let mut lambda = None;
    for i in changed {
        let lambda = lambda.get_or_insert_with(|| geometry::barycentric(&mesh.corners_of(&cell.v), p));
        if lambda.is_none_or(|l| l[i].abs() > IN_PLANE) {
            return true;
        }
    }
    false
}

/// Whether a face must not be split, or a vertex not be snapped, for the sake of the nodes and edges of the needles.
pub(super) fn is_forbidden<const D: usize, const N: usize>(
    needles: &[Needle<D, N>],
    round: &Round<D>,
    face: &[u32],
) -> bool {
    let own = &needles[round.needle];
    needles.iter().enumerate().any(|(k, needle)| {
        let kept = if k == round.needle { round.keep } else { needle.nodes.len() };
        match *face {
            [w] if k == round.needle => needle.nodes[..kept.saturating_sub(1)].contains(&w),
            [w] => needle.nodes.contains(&w) || needle.moved(w) && !own.moved(w),
            [a, b] => needle.has_edge(kept, a, b),
            _ => false,
        }
    })
}
