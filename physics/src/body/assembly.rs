//! The stiffness matrix: row `i` is the sum over the star of vertex `i`, in ascending order of cells.

use super::element::{Element, ElementTable, Group};
use super::kernel::deformation_gradients;
use super::lazy::{LazyRule, Moduli};
use super::partition::{Part, Parts};
use super::star::Stars;
use super::stored::{self, Stored, pack};
use super::{Body, BodyError, Linearization};
use crate::lanes::{LANES, Lane, lane_matrix};
use crate::material::Hyperelastic;
use crate::parallel;
use nalgebra::SMatrix;
use pulp::Arch;
use stylet_solver::Block;
use stylet_solver::sparse::SparseError;

/// Buffers of one row.
#[derive(Clone, Debug, Default)]
pub(super) struct RowScratch<const D: usize> {
    columns: Vec<u32>,
    blocks: Vec<Block<D>>,
    /// Lanes that a lazy linearisation has evaluated, by group, and the rows that they belong to.
    updated: Vec<[bool; LANES]>,
    touched: Vec<bool>,
    /// A product `K u`, for the energy of a linear body.
    pub(super) product: Vec<f64>,
}

/// Pairs of vertices of a tetrahedron.
pub(super) const MAX_PAIRS: usize = 10;

/// Place of block `(a, b)`, `a <= b`, in the upper triangle stored by rows.
#[inline(always)]
pub(super) const fn upper_index(n: usize, a: usize, b: usize) -> usize {
    a * n - a * (a + 1) / 2 + b
}

/// Adds `K_ab` to a block: the stored one for `a <= b`, otherwise its mirror image transposed.
#[inline(always)]
fn add_block<const D: usize, const N: usize>(upper: &[Block<D>], a: usize, b: usize, into: &mut Block<D>) {
    if a <= b {
        add(&upper[upper_index(N, a, b)], into);
    } else {
        let k = &upper[upper_index(N, b, a)];
        for i in 0..D {
            for j in 0..D {
                into[i][j] += k[j][i];
            }
        }
    }
}

#[inline(always)]
fn add<const D: usize>(k: &Block<D>, into: &mut Block<D>) {
    for i in 0..D {
        for j in 0..D {
            into[i][j] += k[i][j];
        }
    }
}

/// `F = I` in every lane.
fn at_rest<const D: usize>() -> [[Lane; D]; D] {
    std::array::from_fn(|i| std::array::from_fn(|k| [f64::from(u8::from(i == k)); LANES]))
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    const PAIRS: usize = N * (N + 1) / 2;

    /// Element stiffness at rest, upper triangle in the first entries.
    pub(super) fn rest_stiffness(&self, element: &Element<D, N>) -> [Block<D>; MAX_PAIRS] {
        self.stiffness_at(element, &SMatrix::identity(), false)
    }

    /// Element stiffness at `f`, upper triangle in the first entries.
    fn stiffness_at(&self, element: &Element<D, N>, f: &SMatrix<f64, D, D>, project: bool) -> [Block<D>; MAX_PAIRS] {
        let mut upper = [[[0.0; D]; D]; MAX_PAIRS];
        let material = &self.materials[element.material as usize];
        evaluate(material, project, f, &element.gradients, element.weight, &mut upper[..Self::PAIRS]);
        upper
    }

    /// What an element contributes to the row of its local vertex `a`.
    fn contribution(&self, slot: usize, a: usize) -> [Block<D>; N] {
        if self.is_lazy() && !M::IS_LINEAR {
            return stored::row(&self.stored[slot], a);
        }
        let element = self.elements.element(slot);
        let upper = match M::IS_LINEAR {
            true => self.rest_stiffness(&element),
            false => self.stiffness_at(&element, &self.reference(slot), self.project),
        };
        let mut row = [[[0.0; D]; D]; N];
        for b in 0..N {
            add_block::<D, N>(&upper, a, b, &mut row[b]);
        }
        row
    }

    /// Deformation gradient at which an element was evaluated last.
    fn reference(&self, slot: usize) -> SMatrix<f64, D, D> {
        lane_matrix(&self.references[slot / LANES], slot % LANES)
    }

    fn set_reference(&mut self, slot: usize, f: &SMatrix<f64, D, D>) {
        let group = &mut self.references[slot / LANES];
        for i in 0..D {
            for k in 0..D {
                group[i][k][slot % LANES] = f[(i, k)];
            }
        }
    }

    pub(super) fn is_lazy(&self) -> bool {
        !self.lazy.is_eager()
    }

    /// Builds the pattern and the matrix, a nonlinear one at rest.
    pub(super) fn assemble_all(&mut self) -> Result<(), BodyError> {
        self.assembled = true;
        let vertices: Vec<u32> = (0..self.n_vertices() as u32).collect();
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        self.patch_rows(&vertices, &slots)
    }

    /// Rewrites the rows of `vertices` after the elements in `slots` were new.
    pub(super) fn patch_rows(&mut self, vertices: &[u32], slots: &[usize]) -> Result<(), BodyError> {
        self.places.resize(self.elements.n_slots(), [[0; N]; N]);
        if !M::IS_LINEAR {
            self.parts.outdate();
            self.references.resize(self.elements.groups.len(), at_rest());
            for &slot in slots {
                self.set_reference(slot, &SMatrix::identity());
            }
            if self.is_lazy() {
                self.stored.resize(self.elements.n_slots(), [[[0.0; D]; D]; 6]);
                self.store(slots.iter().copied());
            }
        }
        vertices.iter().try_for_each(|&vertex| self.write_row(vertex as usize))
    }

    /// Keeps the stiffness of elements at their references.
    fn store(&mut self, slots: impl Iterator<Item = usize>) {
        for slot in slots {
            let upper = self.stiffness_at(&self.elements.element(slot), &self.reference(slot), self.project);
            self.stored[slot] = pack::<D, N>(&upper);
        }
    }

    /// Writes pattern and values of one row.
    fn write_row(&mut self, vertex: usize) -> Result<(), BodyError> {
        // Taken out and put back: the material is asked while the row is built.
        let mut scratch = std::mem::take(&mut self.scratch);
        let RowScratch { columns, blocks, .. } = &mut scratch;
        columns.clear();
        for corner in self.stars.corners(vertex) {
            columns.extend(self.elements.vertices(corner.slot::<D, N>()));
        }
        columns.sort_unstable();
        columns.dedup();
        if columns.len() > u16::MAX as usize {
            return Err(SparseError::TooLarge(columns.len()).into());
        }
        blocks.clear();
        blocks.resize(columns.len(), [[0.0; D]; D]);
        for index in 0..self.stars.corners(vertex).len() {
            let corner = self.stars.corners(vertex)[index];
            let (slot, a) = (corner.slot::<D, N>(), corner.local::<D, N>());
            let (vertices, row) = (self.elements.vertices(slot), self.contribution(slot, a));
            for b in 0..N {
                // Present by construction: the columns were gathered from the same elements.
                let at = columns.partition_point(|&column| column < vertices[b]);
                self.places[slot][a][b] = at as u16;
                add(&row[b], &mut blocks[at]);
            }
        }
        let written = self.stiffness.set_row(vertex, columns, blocks);
        self.note_row(vertex);
        self.scratch = scratch;
        Ok(written?)
    }

    fn note_row(&mut self, vertex: usize) {
        self.revision += 1;
        self.row_revisions[vertex] = self.revision;
    }

    /// Evaluates the element stiffnesses at `u` and sums them into the rows, which keep their pattern.
    pub(super) fn relinearize(&mut self, u: &[f64]) {
        // The rest stiffness was checked when the elements were made, so this fails only where the matrix exceeds what
        // 32-bit indices can name; its rows are then missing, and a solve reports that it is not positive definite.
        if !self.assembled && self.assemble_all().is_err() {
            return;
        }
        if self.is_lazy() {
            self.update_changed(u);
        } else {
            let threads = self.threads_worth();
            gradients_of_groups(&self.elements.groups, u, &mut self.references, threads);
            self.elements_linearized += self.elements.n_live() as u64;
            self.elements_updated = self.elements.n_live();
            self.sum_all();
        }
    }

    /// Sums all rows, whose pattern stands, from elements evaluated on the way.
    fn sum_all(&mut self) {
        let threads = self.threads_worth();
        self.parts.follow(threads, &self.elements, &self.stars, &self.stiffness);
        let Parts { parts, owner, start, .. } = &mut self.parts;
        let pass = Pass {
            materials: &self.materials,
            elements: &self.elements,
            places: &self.places,
            references: &self.references,
            owner,
            start,
            project: self.project,
        };
        parallel::each(parts, threads, &|index, part| {
            Arch::new().dispatch(
                #[inline(always)]
                || pass.sum(index as u16, part),
            );
        });
        self.copy_rows(|_| true);
    }

    /// Copies rows from the parts to the matrix.
    fn copy_rows(&mut self, wanted: impl Fn(usize) -> bool) {
        for part in &self.parts.parts {
            for &vertex in &part.rows {
                let vertex = vertex as usize;
                if wanted(vertex) {
                    let (columns, row) = self.stiffness.row_mut(vertex);
                    let start = self.parts.start[vertex] as usize;
                    row.copy_from_slice(&part.values[start..start + columns.len()]);
                    self.revision += 1;
                    self.row_revisions[vertex] = self.revision;
                }
            }
        }
    }

    /// A lazy linearisation: evaluates what has changed, and sums the rows of what was evaluated.
    fn update_changed(&mut self, u: &[f64]) {
        let threads = self.threads_worth();
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.updated.clear();
        scratch.updated.resize(self.elements.groups.len(), [false; LANES]);
        let update = Update {
            materials: &self.materials,
            moduli: &self.moduli,
            elements: &self.elements,
            u,
            rule: self.lazy,
            project: self.project,
        };
        update.run(0, &mut self.references, &mut self.stored, &mut scratch.updated, threads);
        let touched = &mut scratch.touched;
        touched.clear();
        touched.resize(self.n_vertices(), false);
        let mut count = 0;
        for (group, lanes) in self.elements.groups.iter().zip(&scratch.updated) {
            for lane in (0..LANES).filter(|&lane| lanes[lane]) {
                group.vertices.iter().for_each(|vertices| touched[vertices[lane] as usize] = true);
                count += 1;
            }
        }
        self.elements_linearized += count as u64;
        self.elements_updated = count;
        if count > 0 {
            self.sum_stored(touched);
        }
        self.scratch = scratch;
    }

    /// Sums the wanted rows from stored elements.
    fn sum_stored(&mut self, wanted: &[bool]) {
        let threads = self.threads_worth();
        self.parts.follow(threads, &self.elements, &self.stars, &self.stiffness);
        let Parts { parts, start, .. } = &mut self.parts;
        let (stars, stored, places, stiffness) = (&self.stars, &self.stored, &self.places, &self.stiffness);
        parallel::each(parts, threads, &|_, part: &mut Part<D>| {
            for &vertex in part.rows.iter().filter(|&&vertex| wanted[vertex as usize]) {
                let vertex = vertex as usize;
                let len = stiffness.row(vertex).0.len();
                let row = &mut part.values[start[vertex] as usize..][..len];
                sum_row::<D, N>(stars, vertex, stored, places, row);
            }
        });
        self.copy_rows(|vertex| wanted[vertex]);
    }

    /// Evaluates the element stiffnesses where they were evaluated last, under settings that have changed.
    pub(super) fn reevaluate(&mut self) {
        if !self.is_lazy() {
            return self.sum_all();
        }
        self.stored.resize(self.elements.n_slots(), [[[0.0; D]; D]; 6]);
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        self.store(slots.into_iter());
        self.sum_stored(&vec![true; self.n_vertices()]);
    }

    /// From now on a linearisation re-evaluates only the elements that the rule names.
    ///
    /// A lazy body keeps the stiffness of its elements, 216 bytes for a tetrahedron.
    pub fn set_lazy_rule(&mut self, rule: LazyRule) {
        let was_lazy = !std::mem::replace(&mut self.lazy, rule).is_eager();
        if !self.is_lazy() {
            self.stored = Vec::new();
        }
        if was_lazy != self.is_lazy() && self.assembled && !M::IS_LINEAR {
            self.reevaluate();
        }
    }

    /// Where the body was last linearised.
    pub fn linearization(&self) -> Linearization {
        let mut deformation_gradients = Vec::new();
        if self.assembled && !M::IS_LINEAR {
            for (_, slot) in self.elements.live() {
                deformation_gradients.extend_from_slice(self.reference(slot).as_slice());
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
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        for (slot, f) in slots.into_iter().zip(numbers.chunks_exact(D * D)) {
            self.set_reference(slot, &SMatrix::from_column_slice(f));
        }
        self.reevaluate();
        Ok(())
    }
}

/// Overwrites the blocks of a row by the sum over its star.
#[inline]
fn sum_row<const D: usize, const N: usize>(
    stars: &Stars,
    vertex: usize,
    stored: &[Stored<D>],
    places: &[[[u16; N]; N]],
    row: &mut [Block<D>],
) {
    row.fill([[0.0; D]; D]);
    for corner in stars.corners(vertex) {
        let (slot, a) = (corner.slot::<D, N>(), corner.local::<D, N>());
        let blocks = stored::row::<D, N>(&stored[slot], a);
        for b in 0..N {
            add(&blocks[b], &mut row[places[slot][a][b] as usize]);
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
        material.projected_tangent(f).element_stiffness(gradients, weight, upper);
    } else {
        material.element_stiffness(f, gradients, weight, upper);
    }
}

/// `F` of all groups, spread over threads.
fn gradients_of_groups<const D: usize, const N: usize>(
    groups: &[Group<D, N>],
    u: &[f64],
    out: &mut [[[Lane; D]; D]],
    threads: usize,
) {
    parallel::chunks(out, threads, &|first, out| {
        Arch::new().dispatch(
            #[inline(always)]
            || {
                for (group, f) in groups[first..].iter().zip(out) {
                    *f = deformation_gradients(group, u);
                }
            },
        );
    });
}

/// One sweep over the elements of a part, evaluated at their references.
struct Pass<'a, const D: usize, const N: usize, M> {
    materials: &'a [M],
    elements: &'a ElementTable<D, N>,
    places: &'a [[[u16; N]; N]],
    references: &'a [[[Lane; D]; D]],
    owner: &'a [u16],
    start: &'a [u32],
    project: bool,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Pass<'_, D, N, M> {
    #[inline(always)]
    fn sum(&self, index: u16, part: &mut Part<D>) {
        part.values.fill([[0.0; D]; D]);
        let (mut group, mut f) = (Group::empty(0), at_rest());
        let mut upper = [[[[0.0; LANES]; D]; D]; MAX_PAIRS];
        let pairs = N * (N + 1) / 2;
        let mut rest = part.elements.as_slice();
        while !rest.is_empty() {
            let slots = self.batch(rest);
            rest = &rest[slots.len()..];
            for (lane, &slot) in slots.iter().enumerate() {
                let (from, from_lane) = (slot as usize / LANES, slot as usize % LANES);
                group.material = self.elements.groups[from].material;
                group.copy_lane(lane, &self.elements.groups[from], from_lane);
                for i in 0..D {
                    for k in 0..D {
                        f[i][k][lane] = self.references[from][i][k][from_lane];
                    }
                }
            }
            // Lanes beyond the batch hold elements of an earlier one, or none.
            let material = &self.materials[group.material as usize];
            let gradients = group.all_gradients();
            material.element_stiffness_lanes(&f, &gradients, &group.weight, self.project, &mut upper[..pairs]);
            for (lane, &slot) in slots.iter().enumerate() {
                let vertices: [u32; N] = std::array::from_fn(|a| group.vertices[a][lane]);
                let upper = lane_blocks(&upper, lane);
                self.scatter(index, &vertices, &self.places[slot as usize], &upper, &mut part.values);
            }
        }
    }

    /// The next elements of one material, as many as there are lanes at most.
    #[inline(always)]
    fn batch<'b>(&self, slots: &'b [u32]) -> &'b [u32] {
        let material = |slot: u32| self.elements.groups[slot as usize / LANES].material;
        let first = material(slots[0]);
        let len = slots.iter().take(LANES).take_while(|&&slot| material(slot) == first).count();
        &slots[..len]
    }

    /// Adds an element to the rows of the part.
    #[inline(always)]
    fn scatter(
        &self,
        index: u16,
        vertices: &[u32; N],
        places: &[[u16; N]; N],
        upper: &[Block<D>; MAX_PAIRS],
        values: &mut [Block<D>],
    ) {
        for a in 0..N {
            let vertex = vertices[a] as usize;
            if self.owner[vertex] != index {
                continue;
            }
            let row = &mut values[self.start[vertex] as usize..];
            for b in 0..N {
                add_block::<D, N>(upper, a, b, &mut row[places[a][b] as usize]);
            }
        }
    }
}

/// One lane of element stiffnesses.
#[inline(always)]
fn lane_blocks<const D: usize>(upper: &[[[Lane; D]; D]; MAX_PAIRS], lane: usize) -> [Block<D>; MAX_PAIRS] {
    let mut blocks = [[[0.0; D]; D]; MAX_PAIRS];
    for (block, lanes) in blocks.iter_mut().zip(upper) {
        for i in 0..D {
            for k in 0..D {
                block[i][k] = lanes[i][k][lane];
            }
        }
    }
    blocks
}

/// One sweep over the elements that re-evaluates those that the rule names.
struct Update<'a, const D: usize, const N: usize, M> {
    materials: &'a [M],
    moduli: &'a [Moduli],
    elements: &'a ElementTable<D, N>,
    u: &'a [f64],
    rule: LazyRule,
    project: bool,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Update<'_, D, N, M> {
    /// Elements from group `first` on, spread over `threads`.
    fn run(
        &self,
        first: usize,
        references: &mut [[[Lane; D]; D]],
        stored: &mut [Stored<D>],
        updated: &mut [[bool; LANES]],
        threads: usize,
    ) {
        if threads > 1 && references.len() > 1 {
            let cut = references.len() * (threads / 2) / threads;
            let (left, right) = references.split_at_mut(cut);
            let (left_stored, right_stored) = stored.split_at_mut(cut * LANES);
            let (left_updated, right_updated) = updated.split_at_mut(cut);
            parallel::join(
                || self.run(first, left, left_stored, left_updated, threads / 2),
                || self.run(first + cut, right, right_stored, right_updated, threads - threads / 2),
            );
            return;
        }
        Arch::new().dispatch(
            #[inline(always)]
            || self.run_serial(first, references, stored, updated),
        );
    }

    #[inline(always)]
    fn run_serial(
        &self,
        first: usize,
        references: &mut [[[Lane; D]; D]],
        stored: &mut [Stored<D>],
        updated: &mut [[bool; LANES]],
    ) {
        let pairs = N * (N + 1) / 2;
        let mut upper = [[[[0.0; LANES]; D]; D]; MAX_PAIRS];
        for (at, (reference, updated)) in references.iter_mut().zip(updated).enumerate() {
            let group = &self.elements.groups[first + at];
            let f = deformation_gradients(group, self.u);
            let material = &self.materials[group.material as usize];
            *updated = self.rule.changed(group, self.moduli[group.material as usize], &f, reference);
            if !updated.contains(&true) {
                continue;
            }
            let gradients = group.all_gradients();
            material.element_stiffness_lanes(&f, &gradients, &group.weight, self.project, &mut upper[..pairs]);
            for lane in (0..LANES).filter(|&lane| updated[lane]) {
                for i in 0..D {
                    for k in 0..D {
                        reference[i][k][lane] = f[i][k][lane];
                    }
                }
                stored[at * LANES + lane] = pack::<D, N>(&lane_blocks(&upper, lane));
            }
        }
    }
}
