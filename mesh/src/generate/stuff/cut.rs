//! Divides the open cells along the surface of one solid.
//!
//! Edges of open cells with ends of different sign are cut where the surface crosses them. An end that a cut comes too near
//! to is moved onto the surface instead ([`warp`](super::warp)); the edges that are left are divided at their cut points,
//! one after another ([`split`](super::split)), together with all cells around them. So the mesh conforms whatever the cells
//! are: those of the lattice, and those that an earlier solid has cut.

use super::complex::{Complex, OPEN, Vertex};
use super::surface::{Surface, between, project};
use super::warp::{Guard, warp};
use super::{GenerateError, split};
use crate::geometry::distance2;

/// Values smaller than this part of a cube's edge are zero.
const ZERO: f64 = 1e-9;

/// Where the surface crosses an edge.
#[derive(Clone, Copy)]
pub(super) struct Cut {
    /// The ends, the lower id first.
    pub ends: [u32; 2],
    /// How far along the edge.
    pub t: f64,
}

/// What is known while one surface is cut.
pub(super) struct Stage<'a> {
    pub surfaces: &'a [Surface<'a>],
    /// The place of the surface among these.
    pub number: usize,
    /// Edge of a cube at borders, m.
    pub scale: f64,
    /// By vertex: -1 inside, 1 outside, 0 on the surface or of no interest.
    pub signs: Vec<i8>,
    /// By vertex: a number with the sign of the distance, and near the surface the distance itself, m.
    pub values: Vec<f64>,
    /// Sorted by their ends.
    pub cuts: Vec<Cut>,
}

/// The six edges of a tetrahedron.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Gives the part of the open cells inside a surface its label.
pub(super) fn cut(
    complex: &mut Complex,
    surfaces: &[Surface],
    number: usize,
    scale: f64,
) -> Result<(), GenerateError> {
    let mut stage = Stage::new(complex, surfaces, number, scale)?;
    stage.find_cuts(complex)?;
    warp(complex, &mut stage)?;
    split::divide(complex, &mut stage)?;
    stage.label(complex)
}

impl<'a> Stage<'a> {
    /// Signs at the vertices of open cells.
    fn new(complex: &mut Complex, surfaces: &'a [Surface], number: usize, scale: f64) -> Result<Self, GenerateError> {
        let n = complex.points.len();
        let mut stage =
            Self { surfaces, number, scale, signs: vec![0; n], values: vec![f64::NAN; n], cuts: Vec::new() };
        for (cell, _) in complex.cells.iter().zip(&complex.labels).filter(|(_, label)| **label == OPEN) {
            for &v in cell {
                let v = v as usize;
                if stage.values[v].is_nan() {
                    let value = surfaces[number].side(&complex.points[v], scale)?;
                    stage.values[v] = value;
                    stage.signs[v] = i8::from(value > ZERO * scale) - i8::from(value < -ZERO * scale);
                    if stage.signs[v] == 0 {
                        complex.vertices[v].on |= stage.bit();
                    }
                }
            }
        }
        Ok(stage)
    }

    pub fn surface(&self) -> &'a Surface<'a> {
        &self.surfaces[self.number]
    }

    /// The bit of the surface in [`Vertex::on`].
    pub fn bit(&self) -> u64 {
        1 << self.number
    }

    /// Whether the ends of an edge lie on different sides.
    pub fn crosses(&self, [a, b]: [u32; 2]) -> bool {
        self.signs[a as usize] * self.signs[b as usize] < 0
    }

    /// The cut points of all edges of open cells that cross the surface.
    fn find_cuts(&mut self, complex: &Complex) -> Result<(), GenerateError> {
        let mut edges = Vec::new();
        for (cell, _) in complex.cells.iter().zip(&complex.labels).filter(|(_, label)| **label == OPEN) {
            let signs = cell.map(|v| self.signs[v as usize]);
            if signs.contains(&-1) && signs.contains(&1) {
                let crossing = EDGES.map(|[i, j]| [cell[i].min(cell[j]), cell[i].max(cell[j])]);
                edges.extend(crossing.into_iter().filter(|e| self.crosses(*e)));
            }
        }
        edges.sort_unstable();
        edges.dedup();
        self.cuts.reserve_exact(edges.len());
        for ends in edges {
            let values = ends.map(|v| self.values[v as usize]);
            let t = self.surface().root(ends.map(|v| &complex.points[v as usize]), values)?;
            self.cuts.push(Cut { ends, t });
        }
        Ok(())
    }

    /// The cut of an edge, if it has one that is still to be made.
    pub fn cut_of(&self, a: u32, b: u32) -> Option<usize> {
        let ends = [a.min(b), a.max(b)];
        if !self.crosses(ends) {
            return None;
        }
        self.cuts.binary_search_by_key(&ends, |cut| cut.ends).ok()
    }

    /// The surfaces of a set of bits, and this one.
    pub fn with(&self, bits: u64) -> Vec<&'a Surface<'a>> {
        let surfaces = self.surfaces;
        (0..surfaces.len()).filter(|i| *i == self.number || bits >> i & 1 == 1).map(|i| &surfaces[i]).collect()
    }

    /// The vertex of a cut on an edge that lies in the borders `on` of earlier solids, and the point to put it at should the
    /// one on all surfaces not do.
    pub fn make_vertex(
        &mut self,
        complex: &mut Complex,
        cut: Cut,
        on: u64,
    ) -> Result<(u32, Option<[f64; 3]>), GenerateError> {
        let [a, b] = cut.ends.map(|v| complex.vertices[v as usize]);
        let [p, q] = cut.ends.map(|v| complex.points[v as usize]);
        let straight = between(&p, &q, cut.t);
        let faces = a.faces & b.faces;
        let made = Vertex { site: None, is_centre: false, faces, on: on | self.bit() };
        let mut point = straight;
        if on != 0 {
            let reach = 0.5 * distance2(&p, &q).sqrt();
            let there = project(&self.with(on), &straight, made.free_axes(), reach, self.scale)?;
            point = there.unwrap_or(straight);
        }
        self.signs.push(0);
        self.values.push(0.0);
        Ok((complex.add_vertex(point, made), (point != straight).then_some(straight)))
    }

    /// Labels the open cells inside. No cell has vertices on both sides any more.
    fn label(&self, complex: &mut Complex) -> Result<(), GenerateError> {
        for i in 0..complex.cells.len() {
            if complex.labels[i] != OPEN {
                continue;
            }
            let signs = complex.cells[i].map(|v| self.signs[v as usize]);
            debug_assert!(!(signs.contains(&-1) && signs.contains(&1)));
            let side = signs.iter().sum::<i8>();
            let is_inside = match side {
                0 => self.surface().value(&complex.centroid(&complex.cells[i]))? < 0.0,
                _ => side < 0,
            };
            if is_inside {
                complex.labels[i] = self.number as u32;
            }
        }
        Ok(())
    }

    /// Puts vertices that were moved off their edges back where cells became too flat.
    pub fn put_back(&self, complex: &mut Complex, mut moved: Vec<(u32, [f64; 3])>, cells: &[u32]) {
        while !moved.is_empty() {
            let flat = |c: &&u32| !Guard::accepts(&complex.corners(&complex.cells[**c as usize]));
            let mut touched: Vec<u32> = cells.iter().filter(flat).flat_map(|c| complex.cells[*c as usize]).collect();
            touched.sort_unstable();
            let (back, kept): (Vec<_>, Vec<_>) = moved.into_iter().partition(|(v, _)| touched.binary_search(v).is_ok());
            if back.is_empty() {
                return;
            }
            for (v, straight) in back {
                complex.points[v as usize] = straight;
            }
            moved = kept;
        }
    }
}
