//! Vertices that a cut comes too near to are moved onto the surface.
//!
//! Source: Labelle & Shewchuk (2007), section 4. That paper has no vertices that are bound to a face of a box or to another
//! surface: these slide within what they are bound to.

use super::GenerateError;
use super::complex::{Complex, OPEN, Vertex};
use super::cut::Stage;
use super::surface::{between, project};
use crate::geometry::{distance2, relative_measure};
use crate::quality;

/// How near to an end, as parts of the edge, a cut may come: long edges of the lattice, along an axis.
pub(super) const LONG: f64 = 0.26;
/// The same for short edges, from a corner to a centre, and for edges that are none of the lattice's.
pub(super) const SHORT: f64 = 0.38;
/// The same for the half of a long edge between a centre and the middle of a face of the box.
pub(super) const HALF: f64 = 0.38;
/// A bound vertex that cannot slide is taken to be on the surface if a cut comes nearer to it than this part of the edge.
const IN_PLACE: f64 = 1.0 / 256.0;
/// The smallest determinant of the edge vectors over the cube of the longest edge that a move may leave behind; no cell of
/// the lattice with a vertex off the surface comes below.
pub(super) const FLATTEST: f64 = 0.025;
/// Angles of cells with a vertex off the surface, if the lattice is cubic: the exhaustive search in `angles.rs` proves it.
/// Cells with all vertices on the surface could be flat: a move that leaves one outside these angles is not made.
pub(super) const ANGLES_DEG: [f64; 2] = [8.9, 160.0];

/// How near to its ends a cut of an edge may come.
pub(super) fn limit(a: &Vertex, b: &Vertex) -> f64 {
    let (Some(p), Some(q)) = (a.site, b.site) else { return SHORT };
    let axes = (0..3).filter(|&k| p[k] != q[k]).count();
    match axes {
        1 if a.is_centre != b.is_centre => HALF,
        1 => LONG,
        _ => SHORT,
    }
}

/// Moves violated vertices, the one with the nearest cut first; cuts of edges with an end on the surface are no more.
pub(super) fn warp(complex: &mut Complex, stage: &mut Stage) -> Result<(), GenerateError> {
    let mut violations = violations(complex, stage);
    violations.sort_unstable_by(|a, b| a.nearness.total_cmp(&b.nearness).then((a.vertex, a.cut).cmp(&(b.vertex, b.cut))));
    let guard = Guard::new(complex, violations.iter().map(|v| v.vertex));
    for violation in violations {
        let (v, cut) = (violation.vertex, stage.cuts[violation.cut]);
        if !stage.crosses(cut.ends) {
            continue;
        }
        let target = match target(complex, stage, &violation)? {
            Some(point) if guard.allows(complex, &stage.signs, v, &point) => point,
            _ if violation.part < IN_PLACE && complex.vertices[v as usize].is_bound() => complex.points[v as usize],
            _ => continue,
        };
        complex.points[v as usize] = target;
        complex.vertices[v as usize].on |= stage.bit();
        stage.signs[v as usize] = 0;
    }
    Ok(())
}

/// A cut that is too near to an end.
struct Violation {
    vertex: u32,
    cut: usize,
    /// Distance to the cut, as part of the edge.
    part: f64,
    /// The same over the limit.
    nearness: f64,
}

fn violations(complex: &Complex, stage: &Stage) -> Vec<Violation> {
    let mut violations = Vec::new();
    for (i, cut) in stage.cuts.iter().enumerate() {
        let [a, b] = cut.ends;
        let limit = limit(&complex.vertices[a as usize], &complex.vertices[b as usize]);
        for (vertex, part) in [(a, cut.t), (b, 1.0 - cut.t)] {
            if part < limit {
                violations.push(Violation { vertex, cut: i, part, nearness: part / limit });
            }
        }
    }
    violations
}

/// Where a violated vertex goes: to the cut, if it may leave its place in that direction, or along what it is bound to.
fn target(complex: &Complex, stage: &Stage, violation: &Violation) -> Result<Option<[f64; 3]>, GenerateError> {
    let cut = stage.cuts[violation.cut];
    let [p, q] = cut.ends.map(|v| complex.points[v as usize]);
    let [a, b] = cut.ends.map(|v| complex.vertices[v as usize]);
    let vertex = complex.vertices[violation.vertex as usize];
    if vertex.on == 0 && vertex.faces & a.faces & b.faces == vertex.faces {
        return Ok(Some(between(&p, &q, cut.t)));
    }
    let start = complex.points[violation.vertex as usize];
    let reach = 0.5 * distance2(&p, &q).sqrt();
    project(&stage.with(vertex.on), &start, vertex.free_axes(), reach, stage.scale)
}

/// The cells around some vertices, none of which a move may flatten.
pub(super) struct Guard {
    /// By vertex its place in `starts`, or `u32::MAX`.
    places: Vec<u32>,
    starts: Vec<u32>,
    cells: Vec<u32>,
}

impl Guard {
    fn new(complex: &Complex, vertices: impl Iterator<Item = u32>) -> Self {
        let mut places = vec![u32::MAX; complex.points.len()];
        let mut n = 0;
        for v in vertices {
            if places[v as usize] == u32::MAX {
                places[v as usize] = n;
                n += 1;
            }
        }
        let guarded = |cell: &[u32; 4]| cell.map(|v| places[v as usize]).into_iter().filter(|p| *p != u32::MAX);
        let mut starts = vec![0; n as usize + 1];
        complex.cells.iter().flat_map(guarded).for_each(|place| starts[place as usize + 1] += 1);
        for i in 0..n as usize {
            starts[i + 1] += starts[i];
        }
        let (mut next, mut cells) = (starts.clone(), vec![0; starts[n as usize] as usize]);
        for (i, cell) in complex.cells.iter().enumerate() {
            for place in guarded(cell) {
                cells[next[place as usize] as usize] = i as u32;
                next[place as usize] += 1;
            }
        }
        Self { places, starts, cells }
    }

    /// Whether all cells around `v` keep their shape, or become no flatter than they were, with `v` on the surface at
    /// `point`.
    fn allows(&self, complex: &Complex, signs: &[i8], v: u32, point: &[f64; 3]) -> bool {
        let place = self.places[v as usize] as usize;
        let around = &self.cells[self.starts[place] as usize..self.starts[place + 1] as usize];
        around.iter().all(|&i| {
            let cell = &complex.cells[i as usize];
            let before = complex.corners(cell);
            let after = std::array::from_fn(|k| if cell[k] == v { *point } else { before[k] });
            let is_on_surface = complex.labels[i as usize] == OPEN && cell.iter().all(|w| *w == v || signs[*w as usize] == 0);
            Self::accepts(&after) && !(is_on_surface && has_bad_angle(&after))
                || relative_measure(&after) >= relative_measure(&before)
        })
    }

    /// Whether a cell is not too flat.
    pub fn accepts(corners: &[[f64; 3]; 4]) -> bool {
        relative_measure(corners) > FLATTEST
    }
}

fn has_bad_angle(corners: &[[f64; 3]; 4]) -> bool {
    let (min, max) = quality::angles_deg(corners);
    min < ANGLES_DEG[0] || max > ANGLES_DEG[1]
}
