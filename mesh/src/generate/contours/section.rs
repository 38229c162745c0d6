//! The signed distance in one slice's plane, with the parts that end before it.
//!
//! A part that has no counterpart on the next slice should shrink and close about half way there. Interpolating with the
//! distance to the next slice's contours would cut it off right above its own: they are far. So the part stays in the next
//! slice as a *ghost*, its own signed distance raised by more than its greatest depth: nowhere negative, the surface nowhere
//! changed, but the section between the slices is the part inset evenly. Holes end likewise. The planes beyond the last
//! slices hold ghosts only.

use super::{
    field::Field,
    organ::Slice,
    polygon::{bounding_box, perimeter, signed_area},
};

/// A ghost is raised by this many greatest depths. With 1.25 the caps beyond the last slices hold about as much as
/// Cavalieri's rule counts there: a cylinder's is 0.43 slice distances times the area (half a slice counted).
const LIFT: f64 = 1.25;

/// Signed distance in one plane.
pub(super) struct Section {
    areas: Vec<Lifted>,
    holes: Vec<Lifted>,
}

/// A part or a hole as a field (negative within), and by how much it is raised: not at all, or as a ghost.
struct Lifted {
    shape: usize,
    lift: f64,
}

/// The parts and the holes of one slice as fields of their own.
pub(super) struct Shapes {
    parts: Range,
    holes: Range,
}

type Range = std::ops::Range<usize>;

/// A field with its greatest depth.
pub(super) struct Shape {
    field: Field,
    depth: f64,
    /// The points of its contours, then the deepest one.
    probes: Vec<[f64; 2]>,
}

impl Section {
    /// The signed distance at `p`, m.
    #[inline]
    pub(super) fn distance(&self, shapes: &[Shape], p: &[f64; 2]) -> f64 {
        let nearest = |d: f64, one: &Lifted| d.min(shapes[one.shape].field.distance(p) + one.lift);
        let solid = self.areas.iter().fold(f64::INFINITY, nearest);
        let hollow = |d: f64, one: &Lifted| d.max(-shapes[one.shape].field.distance(p) - one.lift);
        self.holes.iter().fold(solid, hollow)
    }
}

/// Adds the fields of a slice to `shapes`; `offset` is taken off its points, `cover` is where lookups should be quick.
pub(super) fn add_shapes(shapes: &mut Vec<Shape>, slice: &Slice, offset: [f64; 2], cover: [[f64; 2]; 2]) -> Shapes {
    let moved = |c: &[[f64; 2]]| -> Vec<[f64; 2]> { c.iter().map(|p| [p[0] - offset[0], p[1] - offset[1]]).collect() };
    let first = shapes.len();
    for part in &slice.parts {
        shapes.push(Shape::new(part.contours().map(moved).collect(), cover));
    }
    let between = shapes.len();
    for hole in slice.parts.iter().flat_map(|part| &part.holes) {
        let mut hole = moved(hole);
        hole.reverse();
        shapes.push(Shape::new(vec![hole], cover));
    }
    Shapes { parts: first..between, holes: between..shapes.len() }
}

impl Shape {
    fn new(contours: Vec<Vec<[f64; 2]>>, cover: [[f64; 2]; 2]) -> Self {
        let field = Field::new(contours.iter().map(Vec::as_slice), cover);
        let (depth, deepest) = field.deepest();
        // No shape is shallower than its area over its perimeter; should nothing deep have been found, a ghost needs that.
        let area: f64 = contours.iter().map(|c| signed_area(c)).sum();
        let depth = depth.max(area / contours.iter().map(|c| perimeter(c)).sum::<f64>());
        let mut probes: Vec<[f64; 2]> = contours.into_iter().flatten().collect();
        probes.push(deepest);
        Self { field, depth, probes }
    }

    /// The points of its contours, without the deepest one.
    fn corners(&self) -> &[[f64; 2]] {
        &self.probes[..self.probes.len() - 1]
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        bounding_box(&self.probes)
    }

    fn holds_any(&self, probes: &[[f64; 2]]) -> bool {
        let [low, high] = self.bounds();
        let near = |p: &&[f64; 2]| (0..2).all(|k| low[k] <= p[k] && p[k] <= high[k]);
        probes.iter().filter(near).any(|p| self.field.distance(p) < 0.0)
    }

    fn ghost(&self, shape: usize) -> Lifted {
        Lifted { shape, lift: LIFT * self.depth }
    }
}

/// The section of slice `own` between its neighbours, or of a plane beyond the last slice, which has no own.
pub(super) fn section(shapes: &[Shape], own: Option<&Shapes>, neighbours: &[&Shapes]) -> Section {
    let real = |range: &Range| range.clone().map(|shape| Lifted { shape, lift: 0.0 });
    let mut areas: Vec<Lifted> = own.iter().flat_map(|own| real(&own.parts)).collect();
    let mut holes = Vec::new();
    for neighbour in neighbours {
        let ends = |&i: &usize| own.is_none_or(|own| !own.parts.clone().any(|j| overlap(&shapes[i], &shapes[j])));
        areas.extend(neighbour.parts.clone().filter(ends).map(|i| shapes[i].ghost(i)));
        // Without a part of its own the plane is empty, and so are holes in it.
        let Some(own) = own else { continue };
        let closes = |&i: &usize| hole_ends(shapes, i, own);
        holes.extend(neighbour.holes.clone().filter(closes).map(|i| shapes[i].ghost(i)));
    }
    Section { areas, holes }
}

/// Whether two parts have a common point, as far as their own points tell.
fn overlap(one: &Shape, other: &Shape) -> bool {
    other.holds_any(&one.probes) || one.holds_any(&other.probes)
}

/// Whether hole `i` lies within the area of another slice altogether.
fn hole_ends(shapes: &[Shape], i: usize, own: &Shapes) -> bool {
    let hole = &shapes[i];
    let inside = |p: &[f64; 2]| own.parts.clone().any(|j| shapes[j].field.distance(p) < 0.0);
    hole.probes.iter().all(inside) && own.parts.clone().all(|j| !hole.holds_any(shapes[j].corners()))
}
