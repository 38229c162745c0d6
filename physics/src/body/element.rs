//! The table of P1 elements: compact groups of [`LANES`] elements, filled and freed slot by slot.

use super::BodyError;
use crate::lanes::{LANES, Lane};
use crate::small::{cofactor, determinant};
use nalgebra::SMatrix;
use stylet_mesh::{CellId, SimplexMesh};

/// No element.
const NONE: u32 = u32::MAX;

/// `LANES` elements of one material, lane by lane. An unused lane has weight and gradients zero and refers to vertex 0: it computes
/// `F = I` and contributes nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Group<const D: usize, const N: usize> {
    pub vertices: [[u32; LANES]; N],
    /// Gradients of the barycentric coordinates of local vertices `1..=D`, 1/m; that of vertex 0 makes the sum zero.
    pub gradients: [[Lane; D]; D],
    /// Volume times thickness.
    pub weight: Lane,
    /// Index of the material.
    pub material: u32,
}

impl<const D: usize, const N: usize> Group<D, N> {
    /// No elements, for those of a material.
    pub fn empty(material: u32) -> Self {
        let gradients = [[[0.0; LANES]; D]; D];
        Self { vertices: [[0; LANES]; N], gradients, weight: [0.0; LANES], material }
    }

    /// Gradients of all barycentric coordinates in one lane.
    #[inline(always)]
    pub fn lane_gradients(&self, lane: usize) -> [[f64; D]; N] {
        let mut gradients = [[0.0; D]; N];
        for a in 0..D {
            for k in 0..D {
                gradients[a + 1][k] = self.gradients[a][k][lane];
                gradients[0][k] -= gradients[a + 1][k];
            }
        }
        gradients
    }

    /// Gradients of all barycentric coordinates, with the bits of [`lane_gradients`](Self::lane_gradients).
    #[inline(always)]
    pub fn all_gradients(&self) -> [[Lane; D]; N] {
        let mut gradients = [[[0.0; LANES]; D]; N];
        for a in 0..D {
            for k in 0..D {
                gradients[a + 1][k] = self.gradients[a][k];
                for lane in 0..LANES {
                    gradients[0][k][lane] -= self.gradients[a][k][lane];
                }
            }
        }
        gradients
    }

    /// Copies a lane of another group of the same material.
    #[inline(always)]
    pub fn copy_lane(&mut self, lane: usize, from: &Self, from_lane: usize) {
        self.weight[lane] = from.weight[from_lane];
        for a in 0..N {
            self.vertices[a][lane] = from.vertices[a][from_lane];
        }
        for a in 0..D {
            for k in 0..D {
                self.gradients[a][k][lane] = from.gradients[a][k][from_lane];
            }
        }
    }
}

/// The number of the group whose slots these are, all of them in their order. (Slots that were freed and taken again need
/// not ascend with their cells.)
#[inline(always)]
pub(super) fn whole_group(slots: &[u32]) -> Option<usize> {
    let first = slots[0] as usize;
    let in_place = slots.iter().enumerate().all(|(lane, &slot)| slot as usize == first + lane);
    (slots.len() == LANES && first.is_multiple_of(LANES) && in_place).then_some(first / LANES)
}

/// What an element knows of its cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Element<const D: usize, const N: usize> {
    pub vertices: [u32; N],
    pub gradients: [[f64; D]; N],
    pub weight: f64,
    /// Index of the material.
    pub material: u32,
}

impl<const D: usize, const N: usize> Element<D, N> {
    /// The element of a cell, made of the material with this index.
    pub fn of_cell(mesh: &SimplexMesh<D, N>, cell: CellId, thickness: f64, material: u32) -> Result<Self, BodyError> {
        let corners = mesh.corners(cell);
        // Rows are the edges from corner 0; the gradients are the dual basis, E^-T by rows.
        let edges = SMatrix::<f64, D, D>::from_fn(|i, k| corners[i + 1][k] - corners[0][k]);
        let (det, dual) = (determinant(&edges), cofactor(&edges));
        let factorial: f64 = (2..=D).map(|k| k as f64).product();
        let weight = det.abs() / factorial * thickness;
        let mut gradients = [[0.0; D]; N];
        for i in 0..D {
            for k in 0..D {
                gradients[i + 1][k] = dual[(i, k)] / det;
                gradients[0][k] -= gradients[i + 1][k];
            }
        }
        let finite = gradients.iter().flatten().all(|g| g.is_finite());
        if !(weight > 0.0 && weight.is_finite() && finite) {
            return Err(BodyError::DegenerateCell { cell, volume: det / factorial });
        }
        Ok(Self { vertices: mesh.cell(cell).map(|v| v.0), gradients, weight, material })
    }

    /// `F = I + sum_a (u_a - u_0) g_a^T`, summed in the order of the group kernel.
    pub fn deformation_gradient(&self, u: &[f64]) -> SMatrix<f64, D, D> {
        let mut f = SMatrix::identity();
        for a in 1..N {
            for i in 0..D {
                let relative = u[self.vertices[a] as usize * D + i] - u[self.vertices[0] as usize * D + i];
                for k in 0..D {
                    f[(i, k)] += relative * self.gradients[a][k];
                }
            }
        }
        f
    }
}

/// The elements of the live cells of a mesh. An element keeps its slot as long as its cell lives.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementTable<const D: usize, const N: usize> {
    pub groups: Vec<Group<D, N>>,
    /// The slot of each cell, by cell id.
    slot_of: Vec<u32>,
    /// The cell of each slot.
    cell_of: Vec<u32>,
    /// Slots without an element, by material.
    free: Vec<Vec<u32>>,
    n_live: usize,
}

impl<const D: usize, const N: usize> ElementTable<D, N> {
    pub fn n_live(&self) -> usize {
        self.n_live
    }

    /// Slots in use or free: the groups hold at least as many lanes.
    pub fn n_slots(&self) -> usize {
        self.cell_of.len()
    }

    pub fn slot(&self, cell: CellId) -> Option<usize> {
        self.slot_of.get(cell.index()).filter(|&&slot| slot != NONE).map(|&slot| slot as usize)
    }

    /// The cell in a used slot.
    pub fn cell(&self, slot: usize) -> u32 {
        self.cell_of[slot]
    }

    /// Live cells and their slots, cells ascending.
    pub fn live(&self) -> impl Iterator<Item = (CellId, usize)> + '_ {
        let used = self.slot_of.iter().enumerate().filter(|&(_, &slot)| slot != NONE);
        used.map(|(cell, &slot)| (CellId(cell as u32), slot as usize))
    }

    pub fn insert(&mut self, cell: CellId, element: &Element<D, N>) -> usize {
        let slot = self.take_slot(element.material);
        if self.slot_of.len() <= cell.index() {
            self.slot_of.resize(cell.index() + 1, NONE);
        }
        self.slot_of[cell.index()] = slot as u32;
        self.cell_of[slot] = cell.0;
        self.n_live += 1;
        let (group, lane) = (&mut self.groups[slot / LANES], slot % LANES);
        group.weight[lane] = element.weight;
        for a in 0..N {
            group.vertices[a][lane] = element.vertices[a];
        }
        for a in 0..D {
            for k in 0..D {
                group.gradients[a][k][lane] = element.gradients[a + 1][k];
            }
        }
        slot
    }

    /// A slot without an element in a group of the material; makes a group where there is none.
    fn take_slot(&mut self, material: u32) -> usize {
        if self.free.len() <= material as usize {
            self.free.resize(material as usize + 1, Vec::new());
        }
        let free = &mut self.free[material as usize];
        if let Some(slot) = free.pop() {
            return slot as usize;
        }
        let first = self.cell_of.len();
        self.cell_of.resize(first + LANES, NONE);
        self.groups.push(Group::empty(material));
        free.extend((first + 1..first + LANES).rev().map(|slot| slot as u32));
        first
    }

    /// Frees the slot of a cell that has one.
    pub fn remove(&mut self, cell: CellId) {
        let slot = std::mem::replace(&mut self.slot_of[cell.index()], NONE) as usize;
        let (group, lane) = (&mut self.groups[slot / LANES], slot % LANES);
        group.weight[lane] = 0.0;
        for a in 0..N {
            group.vertices[a][lane] = 0;
        }
        for a in 0..D {
            for k in 0..D {
                group.gradients[a][k][lane] = 0.0;
            }
        }
        self.cell_of[slot] = NONE;
        self.free[self.groups[slot / LANES].material as usize].push(slot as u32);
        self.n_live -= 1;
    }

    /// The vertices of the element in a slot.
    #[inline]
    pub fn vertices(&self, slot: usize) -> [u32; N] {
        std::array::from_fn(|a| self.groups[slot / LANES].vertices[a][slot % LANES])
    }

    /// The element in a slot.
    #[inline]
    pub fn element(&self, slot: usize) -> Element<D, N> {
        let (group, lane) = (&self.groups[slot / LANES], slot % LANES);
        let (vertices, gradients) = (self.vertices(slot), group.lane_gradients(lane));
        Element { vertices, gradients, weight: group.weight[lane], material: group.material }
    }

    /// The next elements of one material, as many as there are lanes at most. A batch that begins within a group ends with
    /// it, so that the next one is a whole group if it can be.
    #[inline(always)]
    pub fn batch<'b>(&self, slots: &'b [u32]) -> &'b [u32] {
        let material = |slot: u32| self.groups[slot as usize / LANES].material;
        let (first, most) = (slots[0], slots.len().min(LANES));
        let mut len = 1;
        while len < most && material(slots[len]) == material(first) {
            let next = slots[len];
            if next == slots[len - 1] + 1 && (next as usize).is_multiple_of(LANES) {
                break;
            }
            len += 1;
        }
        &slots[..len]
    }

    /// Elements of one material from anywhere side by side; lanes beyond keep what they held.
    #[inline(always)]
    pub fn gather(&self, slots: &[u32], group: &mut Group<D, N>) {
        for (lane, &slot) in slots.iter().enumerate() {
            let from = &self.groups[slot as usize / LANES];
            group.material = from.material;
            group.copy_lane(lane, from, slot as usize % LANES);
        }
    }

    /// Bytes that the table takes.
    pub fn memory_bytes(&self) -> usize {
        let indices = self.slot_of.capacity() + self.cell_of.capacity();
        let free: usize = self.free.iter().map(Vec::capacity).sum();
        self.groups.capacity() * size_of::<Group<D, N>>() + (indices + free) * size_of::<u32>()
    }
}
