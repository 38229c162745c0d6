//! The stiffness matrix: row `i` is the sum over the star of vertex `i`, in ascending order of cells.

use super::element::{Element, ElementTable};
use super::kernel::deformation_gradients;
use super::star::{Corner, Stars};
use super::{Body, BodyError, CROSSOVER_ELEMENTS, Linearization};
use crate::lanes::{LANES, lane_matrix};
use crate::material::Hyperelastic;
use nalgebra::SMatrix;
use stylet_solver::Block;

/// Buffers of one row.
#[derive(Clone, Debug, Default)]
pub(super) struct RowScratch<const D: usize> {
    columns: Vec<u32>,
    blocks: Vec<Block<D>>,
    /// A product `K u`, for the energy of a linear body.
    pub(super) product: Vec<f64>,
}

/// Pairs of vertices of a tetrahedron.
const MAX_PAIRS: usize = 10;

/// Place of block `(a, b)`, `a <= b`, in the upper triangle stored by rows.
#[inline(always)]
const fn upper_index(n: usize, a: usize, b: usize) -> usize {
    a * n - a * (a + 1) / 2 + b
}

/// Adds `K_ab` to a block: the stored one for `a <= b`, otherwise its mirror image transposed.
#[inline(always)]
fn add_block<const D: usize, const N: usize>(upper: &[Block<D>], a: usize, b: usize, into: &mut Block<D>) {
    if a <= b {
        let k = &upper[upper_index(N, a, b)];
        for i in 0..D {
            for j in 0..D {
                into[i][j] += k[i][j];
            }
        }
    } else {
        let k = &upper[upper_index(N, b, a)];
        for i in 0..D {
            for j in 0..D {
                into[i][j] += k[j][i];
            }
        }
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    const PAIRS: usize = N * (N + 1) / 2;

    /// Element stiffness at rest, upper triangle in the first entries.
    pub(super) fn rest_stiffness(&self, element: &Element<D, N>) -> [Block<D>; MAX_PAIRS] {
        let mut upper = [[[0.0; D]; D]; MAX_PAIRS];
        let rest = SMatrix::identity();
        self.material.element_stiffness(&rest, &element.gradients, element.weight, &mut upper[..Self::PAIRS]);
        upper
    }

    /// Builds the pattern and the matrix, a nonlinear one at rest.
    pub(super) fn assemble_all(&mut self) -> Result<(), BodyError> {
        self.assembled = true;
        self.stars.enable_columns();
        let vertices: Vec<u32> = (0..self.n_vertices() as u32).collect();
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        self.patch_rows(&vertices, &slots)
    }

    /// Rewrites the rows of `vertices` after the elements in `slots` were new.
    pub(super) fn patch_rows(&mut self, vertices: &[u32], slots: &[usize]) -> Result<(), BodyError> {
        if !M::IS_LINEAR {
            let n = self.elements.n_slots();
            self.blocks.resize(n * Self::PAIRS, [[0.0; D]; D]);
            self.references.resize(n, SMatrix::identity());
            for &slot in slots {
                // Positive semidefinite at rest: no need to project.
                let upper = self.rest_stiffness(&self.elements.element(slot));
                self.blocks[slot * Self::PAIRS..][..Self::PAIRS].copy_from_slice(&upper[..Self::PAIRS]);
                self.references[slot] = SMatrix::identity();
            }
        }
        vertices.iter().try_for_each(|&vertex| self.write_row(vertex as usize))
    }

    /// Writes pattern and values of one row.
    fn write_row(&mut self, vertex: usize) -> Result<(), BodyError> {
        // Taken out and put back: the material is asked while the row is built.
        let mut scratch = std::mem::take(&mut self.scratch);
        let RowScratch { columns, blocks, .. } = &mut scratch;
        columns.clear();
        for corner in self.stars.corners(vertex) {
            let slot = corner.slot::<D, N>();
            let group = &self.elements.groups[slot / LANES];
            columns.extend((0..N).map(|a| group.vertices[a][slot % LANES]));
        }
        columns.sort_unstable();
        columns.dedup();
        blocks.clear();
        blocks.resize(columns.len(), [[0.0; D]; D]);
        for index in 0..self.stars.corners(vertex).len() {
            let corner = self.stars.corners(vertex)[index];
            let (slot, a) = (corner.slot::<D, N>(), corner.local::<D, N>());
            let element = self.elements.element(slot);
            let rest;
            let upper: &[Block<D>] = if M::IS_LINEAR {
                rest = self.rest_stiffness(&element);
                &rest[..Self::PAIRS]
            } else {
                &self.blocks[slot * Self::PAIRS..][..Self::PAIRS]
            };
            for b in 0..N {
                // Present by construction: the columns were gathered from the same elements.
                let at = columns.partition_point(|&column| column < element.vertices[b]);
                self.stars.columns_mut(vertex)[index][b] = at as u32;
                add_block::<D, N>(upper, a, b, &mut blocks[at]);
            }
        }
        let written = self.stiffness.set_row(vertex, columns, blocks);
        self.scratch = scratch;
        Ok(written?)
    }

    /// Evaluates the element stiffnesses at `u` and sums them into the rows, which keep their pattern.
    pub(super) fn relinearize(&mut self, u: &[f64]) {
        // The rest stiffness was checked when the elements were made, so this fails only where the matrix exceeds what
        // 32-bit indices can name; its rows are then missing, and a solve reports that it is not positive definite.
        if !self.assembled && self.assemble_all().is_err() {
            return;
        }
        let threads = if self.elements.n_slots() < CROSSOVER_ELEMENTS { 1 } else { self.threads };
        let pass = Pass {
            material: &self.material,
            elements: &self.elements,
            u,
            threshold: self.lazy_threshold,
            project: self.project,
        };
        let evaluated = pass.run(0, &mut self.blocks, &mut self.references, threads);
        self.elements_linearized += evaluated as u64;
        if evaluated > 0 {
            self.sum_rows();
        }
    }

    /// Sums the element stiffnesses into rows whose pattern stands.
    fn sum_rows(&mut self) {
        for vertex in 0..self.stars.n_vertices() {
            let (_, row) = self.stiffness.row_mut(vertex);
            sum_row::<D, N>(&self.stars, vertex, &self.blocks, row);
        }
    }

    /// Evaluates the element stiffnesses where they were evaluated last, under settings that have changed.
    pub(super) fn reevaluate(&mut self) {
        for (_, slot) in self.elements.live() {
            let element = self.elements.element(slot);
            let upper = &mut self.blocks[slot * Self::PAIRS..][..Self::PAIRS];
            let f = &self.references[slot];
            evaluate(&self.material, self.project, f, &element.gradients, element.weight, upper);
        }
        self.sum_rows();
    }

    /// Where the body was last linearised.
    pub fn linearization(&self) -> Linearization {
        let mut deformation_gradients = Vec::new();
        if self.assembled && !M::IS_LINEAR {
            for (_, slot) in self.elements.live() {
                deformation_gradients.extend_from_slice(self.references[slot].as_slice());
            }
        }
        Linearization { deformation_gradients }
    }

    /// Brings the stiffness to a stored state, bit for bit, on a body of the same mesh and settings.
    ///
    /// # Errors
    /// [`BodyError::LinearizationSize`] if the state has another number of elements, the body being unchanged;
    /// [`BodyError::Matrix`].
    pub fn restore_linearization(&mut self, state: &Linearization) -> Result<(), BodyError> {
        let numbers = &state.deformation_gradients;
        if numbers.is_empty() {
            return Ok(());
        }
        let expected = if M::IS_LINEAR { 0 } else { self.n_elements() * D * D };
        if numbers.len() != expected {
            return Err(BodyError::LinearizationSize { expected, found: numbers.len() });
        }
        if !self.assembled {
            self.assemble_all()?;
        }
        for ((_, slot), f) in self.elements.live().zip(numbers.chunks_exact(D * D)) {
            self.references[slot] = SMatrix::from_column_slice(f);
        }
        self.reevaluate();
        Ok(())
    }
}

/// Overwrites the blocks of a row by the sum over its star.
#[inline]
fn sum_row<const D: usize, const N: usize>(stars: &Stars<N>, vertex: usize, blocks: &[Block<D>], row: &mut [Block<D>]) {
    let pairs = N * (N + 1) / 2;
    row.fill([[0.0; D]; D]);
    for (corner, columns) in stars.with_columns(vertex) {
        let (slot, a) = (Corner::slot::<D, N>(corner), Corner::local::<D, N>(corner));
        let upper = &blocks[slot * pairs..][..pairs];
        for b in 0..N {
            add_block::<D, N>(upper, a, b, &mut row[columns[b] as usize]);
        }
    }
}

/// Element stiffness at `f`, with a projected tangent if asked for.
#[inline(always)]
fn evaluate<const D: usize, const N: usize, M: Hyperelastic<D>>(
    material: &M,
    project: bool,
    f: &SMatrix<f64, D, D>,
    gradients: &[[f64; D]; N],
    weight: f64,
    upper: &mut [Block<D>],
) {
    if project {
        material.tangent(f).projected().element_stiffness(gradients, weight, upper);
    } else {
        material.element_stiffness(f, gradients, weight, upper);
    }
}

/// One sweep over the elements that re-evaluates those whose strain changed.
struct Pass<'a, const D: usize, const N: usize, M> {
    material: &'a M,
    elements: &'a ElementTable<D, N>,
    u: &'a [f64],
    threshold: f64,
    project: bool,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Pass<'_, D, N, M> {
    /// Elements from group `first` on, spread over `threads`; returns how many were evaluated.
    fn run(
        &self,
        first: usize,
        blocks: &mut [Block<D>],
        references: &mut [SMatrix<f64, D, D>],
        threads: usize,
    ) -> usize {
        #[cfg(feature = "rayon")]
        if threads > 1 && references.len() > LANES {
            let left_groups = references.len().div_ceil(LANES) * (threads / 2) / threads;
            let cut = left_groups * LANES;
            let (left_blocks, right_blocks) = blocks.split_at_mut(cut * (N * (N + 1) / 2));
            let (left_references, right_references) = references.split_at_mut(cut);
            let (left, right) = rayon::join(
                || self.run(first, left_blocks, left_references, threads / 2),
                || self.run(first + left_groups, right_blocks, right_references, threads - threads / 2),
            );
            return left + right;
        }
        let _ = threads;
        self.run_serial(first, blocks, references)
    }

    fn run_serial(&self, first: usize, blocks: &mut [Block<D>], references: &mut [SMatrix<f64, D, D>]) -> usize {
        let pairs = N * (N + 1) / 2;
        let mut evaluated = 0;
        for (at, chunk) in references.chunks_mut(LANES).enumerate() {
            let group = &self.elements.groups[first + at];
            let f = deformation_gradients(group, self.u);
            for (lane, reference) in chunk.iter_mut().enumerate() {
                let f = lane_matrix(&f, lane);
                // A free slot has no weight.
                if group.weight[lane] == 0.0 || self.is_close(&f, reference) {
                    continue;
                }
                let element = self.elements.element((first + at) * LANES + lane);
                let upper = &mut blocks[(at * LANES + lane) * pairs..][..pairs];
                evaluate(self.material, self.project, &f, &element.gradients, element.weight, upper);
                *reference = f;
                evaluated += 1;
            }
        }
        evaluated
    }

    #[inline(always)]
    fn is_close(&self, f: &SMatrix<f64, D, D>, reference: &SMatrix<f64, D, D>) -> bool {
        self.threshold > 0.0
            && (f - reference).norm_squared() <= self.threshold * self.threshold * reference.norm_squared()
    }
}
