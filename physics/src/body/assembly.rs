//! The stiffness matrix: row `i` is the sum over the star of vertex `i`, in ascending order of cells.

use super::element::{Element, ElementTable, Group};
use super::kernel::deformation_gradients;
use super::lazy::{LazyRule, Moduli};
use super::rows::{Evaluated, Kept, write_rows};
use super::stored::{self, Stored, pack};
use super::turn::{GROUPS, Turn};
use super::{Body, BodyError, Linearization};
use crate::lanes::{LANES, Lane, lane_matrix};
use crate::material::Hyperelastic;
use crate::parallel::{chunks, split};
use nalgebra::SMatrix;
use pulp::{Arch, NullaryFnOnce};
use stylet_solver::Block;
use stylet_solver::sparse::SparseError;
use stylet_solver::team::Team;

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
pub(super) fn add_block<const D: usize, const N: usize>(upper: &[Block<D>], a: usize, b: usize, into: &mut Block<D>) {
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
pub(super) fn add<const D: usize>(k: &Block<D>, into: &mut Block<D>) {
    for i in 0..D {
        for j in 0..D {
            into[i][j] += k[i][j];
        }
    }
}

/// `F = I` in every lane.
pub(super) fn at_rest<const D: usize>() -> [[Lane; D]; D] {
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
    /// In a lazy body nothing on the diagonal.
    fn contribution(&self, slot: usize, a: usize) -> [Block<D>; N] {
        if self.keeps_elements() {
            let mut row = [[[0.0; D]; D]; N];
            for b in (0..N).filter(|&b| b != a) {
                row[b] = stored::off_diagonal::<D, N>(&self.stored[slot], a, b);
            }
            return row;
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

    /// Whether rows are summed from kept elements.
    fn keeps_elements(&self) -> bool {
        self.is_lazy() && !M::IS_LINEAR
    }

    /// Builds the pattern and the matrix, a nonlinear one at rest.
    pub(super) fn assemble_all(&mut self) -> Result<(), BodyError> {
        self.assembled = true;
        let vertices: Vec<u32> = (0..self.n_vertices() as u32).collect();
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        let built = self.patch_rows(&vertices, &slots);
        self.stiffness.shrink_to_fit();
        built
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
                self.turn_back(slots);
            }
        }
        vertices.iter().try_for_each(|&vertex| self.write_row(vertex as usize))
    }

    /// Rotations of new elements, which are at rest.
    fn turn_back(&mut self, slots: &[usize]) {
        if self.lazy.compares_rotations() {
            self.turns.resize(self.references.len(), Turn::at_rest());
            for &slot in slots {
                let [turn, ..] = Turn::of(&[self.references[slot / LANES]; GROUPS]);
                self.turns[slot / LANES] = turn;
            }
        }
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
            columns.extend(self.elements.vertices(corner.slot::<N>()));
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
            let (slot, a) = (corner.slot::<N>(), corner.local::<N>());
            let (vertices, row) = (self.elements.vertices(slot), self.contribution(slot, a));
            for b in 0..N {
                // Present by construction: the columns were gathered from the same elements.
                let at = columns.partition_point(|&column| column < vertices[b]);
                self.places[slot][a][b] = at as u16;
                add(&row[b], &mut blocks[at]);
            }
        }
        if let (true, Ok(diagonal)) = (self.keeps_elements(), columns.binary_search(&(vertex as u32))) {
            stored::balance(blocks, diagonal);
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
            let groups = &self.elements.groups[..];
            chunks(&self.team_worth(), &mut self.references, &|first, out| {
                Arch::new().dispatch(Gradients { groups: &groups[first..], u, out });
            });
            self.elements_linearized += self.elements.n_live() as u64;
            self.elements_updated = self.elements.n_live();
            self.sum_all();
        }
    }

    /// Sums all rows, whose pattern stands, from elements evaluated on the way.
    fn sum_all(&mut self) {
        let team = self.team_worth();
        self.parts.follow(team.size(), &self.elements, &self.stars);
        let pass = Evaluated {
            materials: &self.materials,
            elements: &self.elements,
            places: &self.places,
            references: &self.references,
            project: self.project,
        };
        write_rows(&mut self.parts, &team, &mut self.stiffness, &pass);
        (0..self.n_vertices()).for_each(|vertex| self.note_row(vertex));
    }

    /// A lazy linearisation: evaluates what has changed, and sums the rows of what was evaluated.
    fn update_changed(&mut self, u: &[f64]) {
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
        let team = self.team_worth();
        let n = team.size();
        let mut references = split(n, &mut self.references);
        let mut stored = split(n, self.stored.as_chunks_mut().0);
        let mut turns = split(n, &mut self.turns);
        let mut updated = split(n, &mut scratch.updated);
        let mut stretches: [Stretch<'_, D>; Team::MAX_MEMBERS] = std::array::from_fn(|k| Stretch {
            first: references[k].0,
            references: std::mem::take(&mut references[k].1),
            stored: std::mem::take(&mut stored[k].1),
            turns: std::mem::take(&mut turns[k].1),
            updated: std::mem::take(&mut updated[k].1),
        });
        team.each(&mut stretches[..n], |_, stretch| Arch::new().dispatch(UpdateStretch { update: &update, stretch }));
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
            self.sum_stored(touched, Some(&scratch.updated));
        }
        self.scratch = scratch;
    }

    /// Sums the wanted rows from stored elements, in them what the updated lanes contribute to.
    fn sum_stored(&mut self, wanted: &[bool], updated: Option<&[[bool; LANES]]>) {
        let team = self.team_worth();
        self.parts.follow(team.size(), &self.elements, &self.stars);
        let kept = Kept { stars: &self.stars, stored: &self.stored, places: &self.places, wanted, updated };
        write_rows(&mut self.parts, &team, &mut self.stiffness, &kept);
        (0..wanted.len()).filter(|&vertex| wanted[vertex]).for_each(|vertex| self.note_row(vertex));
    }

    /// Keeps the rotations of all elements where they were evaluated, if the rule compares them.
    fn keep_turns(&mut self) {
        if self.lazy.compares_rotations() {
            self.turns.clear();
            self.turns.extend(self.references.iter().map(|f| Turn::of(&[*f; GROUPS])[0]));
        } else {
            self.turns = Vec::new();
        }
    }

    /// Evaluates the element stiffnesses where they were evaluated last, under settings that have changed.
    pub(super) fn reevaluate(&mut self) {
        if !self.is_lazy() {
            return self.sum_all();
        }
        self.stored.resize(self.elements.n_slots(), [[[0.0; D]; D]; 6]);
        let slots: Vec<usize> = self.elements.live().map(|(_, slot)| slot).collect();
        self.store(slots.into_iter());
        self.keep_turns();
        self.sum_stored(&vec![true; self.n_vertices()], None);
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
        self.keep_turns();
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

/// [`deformation_gradients`] of groups, for wide vectors.
struct Gradients<'a, const D: usize, const N: usize> {
    groups: &'a [Group<D, N>],
    u: &'a [f64],
    out: &'a mut [[[Lane; D]; D]],
}

impl<const D: usize, const N: usize> NullaryFnOnce for Gradients<'_, D, N> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        for (group, f) in self.groups.iter().zip(self.out) {
            *f = deformation_gradients(group, self.u);
        }
    }
}

/// One lane of element stiffnesses.
#[inline(always)]
pub(super) fn lane_blocks<const D: usize>(upper: &[[[Lane; D]; D]; MAX_PAIRS], lane: usize) -> [Block<D>; MAX_PAIRS] {
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

/// The groups from `first` on that one member of a team visits; `turns` may be empty.
struct Stretch<'a, const D: usize> {
    first: usize,
    references: &'a mut [[[Lane; D]; D]],
    stored: &'a mut [[Stored<D>; LANES]],
    turns: &'a mut [Turn<D>],
    updated: &'a mut [[bool; LANES]],
}

/// [`Update::visit`] for wide vectors.
struct UpdateStretch<'a, 'b, const D: usize, const N: usize, M> {
    update: &'a Update<'a, D, N, M>,
    stretch: &'a mut Stretch<'b, D>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> NullaryFnOnce for UpdateStretch<'_, '_, D, N, M> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.update.visit(self.stretch);
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Update<'_, D, N, M> {
    #[inline(always)]
    fn visit(&self, stretch: &mut Stretch<'_, D>) {
        match self.rule {
            LazyRule::Rotation(threshold) => self.mark_turned(stretch, threshold),
            _ => self.mark_changed(stretch),
        }
        self.evaluate_marked(stretch);
    }

    /// Marks what a rule names that compares deformation gradients.
    #[inline(always)]
    fn mark_changed(&self, stretch: &mut Stretch<'_, D>) {
        let groups = self.elements.groups[stretch.first..].iter();
        for ((group, reference), updated) in groups.zip(&*stretch.references).zip(&mut *stretch.updated) {
            let moduli = self.moduli[group.material as usize];
            *updated = self.rule.changed(group, moduli, &deformation_gradients(group, self.u), reference);
        }
    }

    /// Marks what has turned too far, a few groups at a time.
    #[inline(always)]
    fn mark_turned(&self, stretch: &mut Stretch<'_, D>, threshold: f64) {
        let (n, groups) = (stretch.turns.len(), &self.elements.groups[stretch.first..]);
        for at in (0..n).step_by(GROUPS) {
            let mut movable = false;
            let (mut turns, mut f) = ([stretch.turns[at]; GROUPS], [at_rest(); GROUPS]);
            for k in 0..GROUPS.min(n - at) {
                let group = &groups[at + k];
                movable |= LazyRule::may_turn(group, self.moduli[group.material as usize], threshold);
                turns[k] = stretch.turns[at + k];
                f[k] = deformation_gradients(group, self.u);
            }
            if !movable {
                continue;
            }
            let products = Turn::products(&turns, &f);
            for k in 0..GROUPS.min(n - at) {
                let (group, reference) = (&groups[at + k], &stretch.references[at + k]);
                let moduli = self.moduli[group.material as usize];
                stretch.updated[at + k] = LazyRule::turned(group, moduli, &f[k], reference, &products[k], threshold);
            }
        }
    }

    /// Evaluates the marked lanes, a few from anywhere at a time, and what a rule compares them with later.
    #[inline(always)]
    fn evaluate_marked(&self, stretch: &mut Stretch<'_, D>) {
        let mut batch = Batch { groups: [Group::empty(0); GROUPS], places: [(0, 0); GROUPS * LANES], filled: 0 };
        for at in 0..stretch.updated.len() {
            let marked = stretch.updated[at];
            let group = &self.elements.groups[stretch.first + at];
            for lane in (0..LANES).filter(|&lane| marked[lane]) {
                if batch.filled == batch.places.len() || batch.groups[0].material != group.material {
                    self.evaluate(&mut batch, stretch);
                    batch.groups.iter_mut().for_each(|gathered| gathered.material = group.material);
                }
                let to = batch.filled;
                batch.groups[to / LANES].copy_lane(to % LANES, group, lane);
                (batch.places[to], batch.filled) = ((at, lane), to + 1);
            }
        }
        self.evaluate(&mut batch, stretch);
    }

    /// Evaluates a batch, whose unused lanes hold elements of an earlier one or none, and empties it.
    #[inline(always)]
    fn evaluate(&self, batch: &mut Batch<D, N>, stretch: &mut Stretch<'_, D>) {
        let material = &self.materials[batch.groups[0].material as usize];
        let pairs = N * (N + 1) / 2;
        let mut upper = [[[[0.0; LANES]; D]; D]; MAX_PAIRS];
        let mut f = [at_rest(); GROUPS];
        for (f, group) in f.iter_mut().zip(&batch.groups) {
            *f = deformation_gradients(group, self.u);
        }
        for (k, places) in batch.places[..batch.filled].chunks(LANES).enumerate() {
            let group = &batch.groups[k];
            let gradients = group.all_gradients();
            material.element_stiffness_lanes(&f[k], &gradients, &group.weight, self.project, &mut upper[..pairs]);
            for (from, &(at, lane)) in places.iter().enumerate() {
                for i in 0..D {
                    for j in 0..D {
                        stretch.references[at][i][j][lane] = f[k][i][j][from];
                    }
                }
                stretch.stored[at][lane] = pack::<D, N>(&lane_blocks(&upper, from));
            }
        }
        if !stretch.turns.is_empty() && batch.filled > 0 {
            let turns = Turn::of(&f);
            for (from, &(at, lane)) in batch.places[..batch.filled].iter().enumerate() {
                stretch.turns[at].copy_lane(lane, &turns[from / LANES], from % LANES);
            }
        }
        batch.filled = 0;
    }
}

/// Elements gathered from anywhere in a stretch, all of one material.
struct Batch<const D: usize, const N: usize> {
    groups: [Group<D, N>; GROUPS],
    /// Group of the stretch, and lane, that each came from.
    places: [(usize, usize); GROUPS * LANES],
    filled: usize,
}
