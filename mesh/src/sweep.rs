//! Refinement that follows a moving feature: finer where it arrives, coarser where it left.

use crate::{
    BisectError, MeshChange, SimplexMesh, VertexId,
    bounds::Bounds,
    coarsen::Candidates,
    geometry::{distance2, dot, subtract},
    node::NONE,
    refine::{check_point, check_size, slack},
    search::{Touched, clip},
};

/// A feature counts as moved along itself if it strays from its old line by less than this part of its coordinates.
const STRAY: f64 = 1e-15;
/// Boxes of cells are grown by this part of their extent before they are said not to touch a feature.
const MARGIN: f64 = 1e-3;

/// A segment.
type Segment<const D: usize> = [[f64; D]; 2];

/// A refined point or segment that moves through a mesh, such as a needle: at each [`follow`](Self::follow) the mesh is
/// refined where the feature is, and coarsened where it was and is not any more.
///
/// Without hysteresis the leaves are, at each step, those of the start mesh refined along the feature where it is then.
/// With it, cells coarsen only once they are farther than a distance from the feature, so that none flips to and fro
/// with every small step. The cost of a step is that of the cells that it changes, if the feature moves along itself, as
/// a needle does; of all cells along the feature otherwise.
///
/// Only one sweep at a time may coarsen a region: it does not know what others, or the user, refined. What must stay
/// everywhere is the background size.
#[derive(Clone, Debug)]
pub struct Sweep<const D: usize> {
    size: f64,
    background: f64,
    hysteresis: f64,
    feature: Option<Segment<D>>,
    /// Where the feature was and coarsening is still due.
    left: Vec<Segment<D>>,
    /// Vertices that stay only because the feature is not far enough yet.
    pending: Vec<VertexId>,
}

impl<const D: usize> Sweep<D> {
    /// A sweep that refines until no cell that touches the feature has an edge longer than `size`, in the unit of the
    /// coordinates, and coarsens behind it to the start mesh, at once.
    pub fn new(size: f64) -> Self {
        Self { size, background: f64::INFINITY, hysteresis: 0.0, feature: None, left: Vec::new(), pending: Vec::new() }
    }

    /// Never coarsens to cells with edges longer than `size`: what
    /// [`refine_everywhere`](SimplexMesh::refine_everywhere) refined to that size stays.
    #[must_use]
    pub fn with_background(mut self, size: f64) -> Self {
        self.background = size;
        self
    }

    /// Coarsens only what is farther than `distance` from the feature (measured to the bounding box of a cell, along the
    /// axes): two to four times the size keeps cells from flipping.
    #[must_use]
    pub fn with_hysteresis(mut self, distance: f64) -> Self {
        self.hysteresis = distance;
        self
    }

    /// Where the feature is; `None` before it came and after it was withdrawn.
    pub fn feature(&self) -> Option<Segment<D>> {
        self.feature
    }

    /// Moves the feature to the segment from `a` to `b`, a point if they are equal; composes `change` with what this
    /// refines and coarsens.
    ///
    /// # Errors
    /// As [`SimplexMesh::refine_along`], and [`BisectError::Size`] for a hysteresis or a background that is negative or
    /// NaN. The mesh is conforming and `change` true; the next call makes up for what this one left undone.
    pub fn follow<const N: usize>(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        a: [f64; D],
        b: [f64; D],
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        self.check()?;
        check_point(&a)?;
        check_point(&b)?;
        let new = [a, b];
        let arrived = match self.feature.take() {
            Some(old) => {
                self.left.extend(parts_outside(&old, &new).into_iter().flatten());
                parts_outside(&new, &old)
            }
            None => [Some(new), None],
        };
        for [p, q] in arrived.into_iter().flatten() {
            if let Err(error) = mesh.refine_along(p, q, self.size, change) {
                self.left.push(new);
                return Err(error);
            }
        }
        self.feature = Some(new);
        self.coarsen(mesh, change)
    }

    /// Takes the feature away, and coarsens all that was refined for it down to the background.
    ///
    /// # Errors
    /// [`BisectError::Size`] as [`follow`](Self::follow).
    pub fn withdraw<const N: usize>(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        self.check()?;
        self.left.extend(self.feature.take());
        self.coarsen(mesh, change)
    }

    fn check(&self) -> Result<(), BisectError> {
        check_size(self.size)?;
        for size in [self.background, self.hysteresis] {
            if size.is_nan() || size < 0.0 {
                return Err(BisectError::Size { size });
            }
        }
        Ok(())
    }

    /// Removes what is not needed any more around the places that the feature left.
    fn coarsen<const N: usize>(
        &mut self,
        mesh: &mut SimplexMesh<D, N>,
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        let mut found: Vec<u32> =
            self.pending.drain(..).map(|v| v.0).filter(|&v| mesh.is_vertex(VertexId(v))).collect();
        for segment in self.left.drain(..) {
            mesh.newest_along(&segment, &mut found);
        }
        found.sort_unstable();
        found.dedup();
        let candidates: Candidates = found.iter().map(|&v| (mesh.generations[v as usize], v)).collect();
        let (size2, background2) = (slack(self.size), slack(self.background));
        let mut near = NearFeature { feature: self.feature, hysteresis: self.hysteresis, root: None, path: Vec::new() };
        let pending = &mut self.pending;
        mesh.record(change, |mesh, recorder| {
            let keep = |mesh: &SimplexMesh<D, N>, vertex: u32, parent: u32| {
                let node = &mesh.nodes[parent as usize];
                if !mesh.is_longer(node, size2) {
                    return false;
                }
                if mesh.is_longer(node, background2) {
                    return true;
                }
                match near.reach(mesh, parent) {
                    Reach::Touches => true,
                    Reach::Near => {
                        pending.push(VertexId(vertex));
                        true
                    }
                    Reach::Far => false,
                }
            };
            mesh.coarsen_from(candidates, keep, recorder);
            Ok(())
        })
    }
}

/// How a cell lies to the feature.
enum Reach {
    Touches,
    Near,
    Far,
}

/// Tells how nodes of the forest lie to a feature, by the same descent as refinement does, so that both agree to the bit.
struct NearFeature<const D: usize, const N: usize> {
    feature: Option<Segment<D>>,
    hysteresis: f64,
    /// The start cell that was asked about last, and the feature in it.
    root: Option<(u32, Option<Touched<N, 2>>)>,
    path: Vec<u32>,
}

impl<const D: usize, const N: usize> NearFeature<D, N> {
    fn reach(&mut self, mesh: &SimplexMesh<D, N>, slot: u32) -> Reach {
        let Some(feature) = self.feature else { return Reach::Far };
        let corners = mesh.corners_of(&mesh.nodes[slot as usize].v);
        let [a, b] = &feature;
        // Where vertices were moved, what touches is known of the leaves alone; a box around all is safe.
        let far = self.hysteresis + mesh.farthest_move;
        if !Bounds::of(&corners, MARGIN).meets(a, b, far) {
            return Reach::Far;
        }
        if self.touches(mesh, slot, &feature) {
            return Reach::Touches;
        }
        if self.hysteresis > 0.0 && Bounds::of(&corners, 0.0).meets(a, b, self.hysteresis) {
            return Reach::Near;
        }
        Reach::Far
    }

    fn touches(&mut self, mesh: &SimplexMesh<D, N>, slot: u32, feature: &Segment<D>) -> bool {
        self.path.clear();
        let mut at = slot;
        while mesh.nodes[at as usize].parent != NONE {
            self.path.push(at);
            at = mesh.nodes[at as usize].parent;
        }
        let known = self.root.filter(|(root, _)| *root == at);
        let (_, touched) = known.unwrap_or_else(|| (at, mesh.touch_root(at, feature)));
        self.root = Some((at, touched));
        let Some(mut touched) = touched else { return false };
        for &child in self.path.iter().rev() {
            match mesh.touch_child(&touched, child) {
                Some(next) => touched = next,
                None => return false,
            }
        }
        true
    }
}

impl<const D: usize, const N: usize> SimplexMesh<D, N> {
    /// Appends the newest vertices of the leaves that a segment touches, with repetitions.
    fn newest_along(&self, segment: &Segment<D>, newest: &mut Vec<u32>) {
        let (mut queue, _) = self.macros_touching(segment);
        while let Some(Touched { slot, ends }) = queue.pop() {
            if self.nodes[slot as usize].is_inner() {
                self.push_touched(slot, &ends, &mut queue);
            } else {
                newest.extend(self.newest(slot));
            }
        }
    }

    /// The feature in a start cell, if it touches it.
    fn touch_root(&self, root: u32, feature: &Segment<D>) -> Option<Touched<N, 2>> {
        let corners = self.reference_corners(&self.nodes[root as usize].v);
        let (_, _, ends) = clip(&corners, feature, self.touch_of_start(&corners))?;
        Some(Touched { slot: root, ends })
    }
}

/// The parts of a segment outside another, as far as simply told: none, one or two if both are on one line and overlap,
/// otherwise the whole.
fn parts_outside<const D: usize>(segment: &Segment<D>, other: &Segment<D>) -> [Option<Segment<D>>; 2] {
    let [a, b] = segment;
    let whole = [Some(*segment), None];
    if segment == other {
        return [None, None];
    }
    let along = subtract(b, a);
    let length2 = dot(&along, &along);
    let magnitude = segment.iter().chain(other).flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    let parameter = |p: &[f64; D]| dot(&subtract(p, a), &along) / length2;
    let strays = |p: &[f64; D]| {
        let t = parameter(p);
        let foot: [f64; D] = std::array::from_fn(|k| a[k] + t * along[k]);
        let distance = distance2(p, &foot).sqrt();
        distance > STRAY * magnitude || distance.is_nan()
    };
    if length2 == 0.0 || other.iter().any(strays) {
        return whole;
    }
    let [c, d] = other;
    let [(from, start), (to, end)] = if parameter(c) <= parameter(d) {
        [(parameter(c), c), (parameter(d), d)]
    } else {
        [(parameter(d), d), (parameter(c), c)]
    };
    if from > 1.0 || to < 0.0 {
        return whole;
    }
    [(from > 0.0).then_some([*a, *start]), (to < 1.0).then_some([*end, *b])]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_less_another() {
        let s = |a: f64, b: f64| [[a, 0.0], [b, 0.0]];
        assert_eq!(parts_outside(&s(0.0, 1.0), &s(0.25, 1.25)), [Some(s(0.0, 0.25)), None]);
        assert_eq!(parts_outside(&s(0.25, 1.25), &s(0.0, 1.0)), [None, Some(s(1.0, 1.25))]);
        assert_eq!(parts_outside(&s(0.0, 1.0), &s(0.75, 0.25)), [Some(s(0.0, 0.25)), Some(s(0.75, 1.0))]);
        assert_eq!(parts_outside(&s(0.0, 1.0), &s(0.0, 1.0)), [None, None]);
        assert_eq!(parts_outside(&s(0.0, 1.0), &s(2.0, 3.0)), [Some(s(0.0, 1.0)), None]);
        assert_eq!(parts_outside(&s(0.0, 1.0), &[[0.0, 0.0], [1.0, 1e-6]]), [Some(s(0.0, 1.0)), None]);
        assert_eq!(parts_outside(&s(0.5, 0.5), &s(0.0, 1.0)), [Some(s(0.5, 0.5)), None]);
    }
}
