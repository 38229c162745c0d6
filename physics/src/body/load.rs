//! Nodal loads that do the work of line densities and tractions exactly: `f_a = integral of q N_a`.

use crate::small::{cofactor, determinant, dot};
use nalgebra::SMatrix;
use stylet_mesh::{CellId, SimplexMesh};

/// How much of a loaded segment may lie outside the mesh before that is an error, as a share of its length.
const OUTSIDE_TOLERANCE: f64 = 1e-9;

/// How far below zero a barycentric coordinate may be on a segment that runs along a face of its cell.
const FACE_TOLERANCE: f64 = 1e-10;

/// Why a load could not be distributed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The load vector does not have `D` entries per vertex.
    #[error("the load has {found} entries, this mesh needs {expected}")]
    Shape {
        /// `D` per vertex.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// The segment has no length, or a number is not finite.
    #[error("a loaded segment needs finite ends, a positive length and finite densities; its length is {length} m")]
    Segment {
        /// The length found, m.
        length: f64,
    },
    /// Places of the density do not ascend.
    #[error("density place {index} is {place} m, which is not above the place before it")]
    Places {
        /// Index of the place.
        index: usize,
        /// The place, m.
        place: f64,
    },
    /// Part of the loaded segment lies outside the mesh.
    #[error("the segment leaves the mesh between {from} m and {to} m from its start")]
    Outside {
        /// Where the part begins, m from the start of the segment.
        from: f64,
        /// Where it ends.
        to: f64,
    },
}

/// Adds to `load` (N, flat) the nodal forces of a line density along the segment from `start` to `end`.
///
/// The force per length at the distance `s` (m) from `start` is `q(s) direction`, where `q` (N/m) is given by points
/// `(s, q)`, linear between them and zero outside; a jump is two points with one `s`. The integrals against the hat
/// functions are exact: the segment is split at every face it crosses, and both factors are linear on each piece. A
/// segment may run along faces and edges.
///
/// The cost is one pass over the cells of the mesh. Total force and moment are those of the density.
///
/// # Errors
/// [`LoadError`]; `load` is then unchanged.
pub fn segment_load<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    start: &[f64; D],
    end: &[f64; D],
    density: &[(f64, f64)],
    direction: &[f64; D],
    load: &mut [f64],
) -> Result<(), LoadError> {
    let expected = D * mesh.n_vertex_slots();
    if load.len() != expected {
        return Err(LoadError::Shape { expected, found: load.len() });
    }
    let edge: [f64; D] = std::array::from_fn(|k| end[k] - start[k]);
    let length = dot(&edge, &edge).sqrt();
    let finite = direction.iter().all(|x| x.is_finite()) && density.iter().all(|(s, q)| s.is_finite() && q.is_finite());
    if !(length > 0.0 && length.is_finite() && finite) {
        return Err(LoadError::Segment { length });
    }
    if let Some(at) = density.windows(2).position(|pair| pair[1].0 < pair[0].0) {
        return Err(LoadError::Places { index: at + 1, place: density[at + 1].0 });
    }
    let along = edge.map(|x| x / length);
    let crossings = crossings(mesh, start, &along, length);
    let mut added = vec![0.0; load.len()];
    for pair in density.windows(2) {
        let piece = Piece { start: *start, along, direction: *direction, from: pair[0], to: pair[1], length };
        piece.add(mesh, &crossings, &mut added)?;
    }
    for (total, part) in load.iter_mut().zip(&added) {
        *total += part;
    }
    Ok(())
}

/// The part of a segment within one cell: distances from its start.
struct Crossing {
    cell: CellId,
    enter: f64,
    leave: f64,
}

/// The cells that share more than a point with the segment, by entry and then by cell.
fn crossings<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    start: &[f64; D],
    along: &[f64; D],
    length: f64,
) -> Vec<Crossing> {
    let mut found = Vec::new();
    for cell in mesh.cells() {
        let (value, slope) = barycentric_line(&mesh.corners(cell), start, along);
        let (mut enter, mut leave) = (0.0f64, length);
        for a in 0..N {
            // lambda_a(s) = value + slope s >= -tolerance.
            let reach = -(value[a] + FACE_TOLERANCE) / slope[a];
            if slope[a].abs() * length <= FACE_TOLERANCE {
                if value[a] < -FACE_TOLERANCE {
                    leave = -1.0;
                }
            } else if slope[a] > 0.0 {
                enter = enter.max(reach);
            } else {
                leave = leave.min(reach);
            }
        }
        if leave > enter {
            found.push(Crossing { cell, enter, leave });
        }
    }
    found.sort_by(|a, b| a.enter.total_cmp(&b.enter).then(a.cell.cmp(&b.cell)));
    found
}

/// Barycentric coordinates along a line, `value + slope s`.
fn barycentric_line<const D: usize, const N: usize>(
    corners: &[[f64; D]; N],
    start: &[f64; D],
    along: &[f64; D],
) -> ([f64; N], [f64; N]) {
    let edges = SMatrix::<f64, D, D>::from_fn(|i, k| corners[i + 1][k] - corners[0][k]);
    let (det, dual) = (determinant(&edges), cofactor(&edges));
    let offset: [f64; D] = std::array::from_fn(|k| start[k] - corners[0][k]);
    let (mut value, mut slope) = ([0.0; N], [0.0; N]);
    value[0] = 1.0;
    for a in 0..D {
        let gradient: [f64; D] = std::array::from_fn(|k| dual[(a, k)] / det);
        value[a + 1] = dot(&gradient, &offset);
        slope[a + 1] = dot(&gradient, along);
        value[0] -= value[a + 1];
        slope[0] -= slope[a + 1];
    }
    (value, slope)
}

/// A stretch of the segment on which the density is linear.
struct Piece<const D: usize> {
    start: [f64; D],
    along: [f64; D],
    direction: [f64; D],
    from: (f64, f64),
    to: (f64, f64),
    length: f64,
}

impl<const D: usize> Piece<D> {
    fn density(&self, s: f64) -> f64 {
        let t = (s - self.from.0) / (self.to.0 - self.from.0);
        self.from.1 + t * (self.to.1 - self.from.1)
    }

    /// Walks along the piece from cell to cell, always in the one that reaches furthest.
    fn add<const N: usize>(
        &self,
        mesh: &SimplexMesh<D, N>,
        crossings: &[Crossing],
        load: &mut [f64],
    ) -> Result<(), LoadError> {
        let slack = OUTSIDE_TOLERANCE * self.length;
        if (self.from.1 == 0.0 && self.to.1 == 0.0) || self.to.0 <= self.from.0 {
            return Ok(());
        }
        // What lies beyond the ends of the segment lies outside what was asked for.
        if self.from.0 < -slack || self.to.0 > self.length + slack {
            let (from, to) = (self.from.0, self.to.0);
            return Err(LoadError::Outside { from, to });
        }
        let (mut s, end) = (self.from.0.max(0.0), self.to.0.min(self.length));
        while s < end {
            let reaching = crossings.iter().take_while(|c| c.enter <= s + slack).filter(|c| c.leave > s);
            // The first of those that reach furthest: the same whatever the order of equal ones.
            let best = reaching.fold(None, |best: Option<&Crossing>, c| match best {
                Some(b) if b.leave >= c.leave => Some(b),
                _ => Some(c),
            });
            let Some(crossing) = best else {
                let next = crossings.iter().map(|c| c.enter).find(|&enter| enter > s).unwrap_or(end).min(end);
                if next - s <= slack {
                    s = next.max(s + f64::EPSILON * self.length);
                    continue;
                }
                return Err(LoadError::Outside { from: s, to: next });
            };
            let stop = crossing.leave.min(end);
            self.add_cell(mesh, crossing.cell, s, stop, load);
            s = stop;
        }
        Ok(())
    }

    /// Adds the integral over `[s0, s1]` within one cell, by Simpson's rule: exact for the product of two linear factors.
    fn add_cell<const N: usize>(&self, mesh: &SimplexMesh<D, N>, cell: CellId, s0: f64, s1: f64, load: &mut [f64]) {
        let (value, slope) = barycentric_line(&mesh.corners(cell), &self.start, &self.along);
        let middle = 0.5 * (s0 + s1);
        for (a, vertex) in mesh.cell(cell).iter().enumerate() {
            let product = |s: f64| self.density(s) * (value[a] + slope[a] * s);
            let force = (s1 - s0) / 6.0 * (product(s0) + 4.0 * product(middle) + product(s1));
            for k in 0..D {
                load[vertex.index() * D + k] += force * self.direction[k];
            }
        }
    }
}

/// Area (m^2; length in two dimensions) of the facet of a cell opposite the corner of this index.
pub fn facet_area<const D: usize, const N: usize>(corners: &[[f64; D]; N], opposite: usize) -> f64 {
    // |facet| = D volume |gradient of the opposite coordinate|.
    let edges = SMatrix::<f64, D, D>::from_fn(|i, k| corners[i + 1][k] - corners[0][k]);
    let dual = cofactor(&edges);
    let normal: [f64; D] = std::array::from_fn(|k| match opposite {
        0 => -(0..D).map(|i| dual[(i, k)]).sum::<f64>(),
        _ => dual[(opposite - 1, k)],
    });
    let factorial: f64 = (2..D).map(|k| k as f64).product();
    dot(&normal, &normal).sqrt() / factorial
}

/// Adds to `load` (N, flat) the nodal forces of a uniform `traction` (Pa) on the boundary facets whose corners all
/// satisfy `on_surface`, and returns their area (m^2). In two dimensions the area is length times `thickness` (m), in
/// three `thickness` is 1.
///
/// # Errors
/// [`LoadError::Shape`]; `load` is then unchanged.
pub fn boundary_traction<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    thickness: f64,
    on_surface: impl Fn(&[f64; D]) -> bool,
    traction: &[f64; D],
    load: &mut [f64],
) -> Result<f64, LoadError> {
    let expected = D * mesh.n_vertex_slots();
    if load.len() != expected {
        return Err(LoadError::Shape { expected, found: load.len() });
    }
    let mut total = 0.0;
    for (cell, opposite) in mesh.boundary_facets() {
        let (corners, vertices) = (mesh.corners(cell), mesh.cell(cell));
        let facet = (0..N).filter(|&a| a != opposite);
        if !facet.clone().all(|a| on_surface(&corners[a])) {
            continue;
        }
        let area = facet_area(&corners, opposite) * thickness;
        total += area;
        for a in facet {
            for k in 0..D {
                load[vertices[a].index() * D + k] += area / D as f64 * traction[k];
            }
        }
    }
    Ok(total)
}
