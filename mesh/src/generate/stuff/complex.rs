//! The growing mesh: vertices that know what they lie on, cells that know their solid.

use super::grid::Site;
use crate::geometry::signed_measure;

/// The label of a cell that no conforming solid holds so far.
pub(super) const OPEN: u32 = u32::MAX;

/// What a vertex lies on and must not leave.
#[derive(Clone, Copy)]
pub(super) struct Vertex {
    /// Its place in the lattice, unless it was made by a cut.
    pub site: Option<Site>,
    /// Whether that place is the centre of a cube.
    pub is_centre: bool,
    /// Faces of the box, one bit each: lower and upper, axis by axis.
    pub faces: u8,
    /// Surfaces, one bit each.
    pub on: u64,
}

impl Vertex {
    /// Whether it lies on anything.
    pub fn is_bound(&self) -> bool {
        self.on != 0 || self.faces != 0
    }

    /// The axes along which it may move within the faces of the box.
    pub fn free_axes(&self) -> [bool; 3] {
        std::array::from_fn(|k| self.faces >> (2 * k) & 3 == 0)
    }
}

/// Vertices and tetrahedra as arrays.
pub(super) struct Complex {
    pub points: Vec<[f64; 3]>,
    pub vertices: Vec<Vertex>,
    pub cells: Vec<[u32; 4]>,
    /// For each cell the place of its solid among those that conform, or [`OPEN`].
    pub labels: Vec<u32>,
}

impl Complex {
    pub fn with_capacity(vertices: usize, cells: usize) -> Self {
        Self {
            points: Vec::with_capacity(vertices),
            vertices: Vec::with_capacity(vertices),
            cells: Vec::with_capacity(cells),
            labels: Vec::with_capacity(cells),
        }
    }

    pub fn add_vertex(&mut self, point: [f64; 3], vertex: Vertex) -> u32 {
        self.points.push(point);
        self.vertices.push(vertex);
        self.points.len() as u32 - 1
    }

    /// Adds an open cell, in the order of positive volume.
    pub fn add_oriented_cell(&mut self, mut cell: [u32; 4]) {
        if signed_measure(&self.corners(&cell)) < 0.0 {
            cell.swap(2, 3);
        }
        self.cells.push(cell);
        self.labels.push(OPEN);
    }

    pub fn corners(&self, cell: &[u32; 4]) -> [[f64; 3]; 4] {
        cell.map(|v| self.points[v as usize])
    }

    pub fn centroid(&self, cell: &[u32; 4]) -> [f64; 3] {
        let corners = self.corners(cell);
        std::array::from_fn(|k| 0.25 * corners.iter().map(|p| p[k]).sum::<f64>())
    }
}
