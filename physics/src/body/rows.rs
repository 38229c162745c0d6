//! Rows of the stiffness matrix, summed by parts.

use super::assembly::{MAX_PAIRS, add, add_block, at_rest, lane_blocks};
use super::element::{ElementTable, Group, whole_group};
use super::partition::{Part, Parts};
use super::star::Stars;
use super::stored::{self, Stored};
use crate::lanes::{LANES, Lane};
use crate::material::Hyperelastic;
use pulp::{Arch, NullaryFnOnce};
use stylet_solver::Block;
use stylet_solver::sparse::{BlockCsr, RowsMut};
use stylet_solver::team::Team;

/// What the rows hold.
pub(super) trait RowSum<const D: usize>: Sync {
    /// Whether a row is summed anew.
    fn wants(&self, vertex: usize) -> bool;

    /// Overwrites the wanted rows of a part.
    fn sum(&self, part: &Part<D>, rows: &mut impl PartRows<D>);
}

/// Where a part writes.
pub(super) trait PartRows<const D: usize> {
    /// Whether the row of a vertex belongs to the part.
    fn owns(&self, vertex: usize) -> bool;

    /// The blocks of a row of the part.
    fn row_mut(&mut self, vertex: usize) -> &mut [Block<D>];
}

impl<const D: usize> PartRows<D> for RowsMut<'_, D> {
    #[inline(always)]
    fn owns(&self, vertex: usize) -> bool {
        self.rows().contains(&vertex)
    }

    #[inline(always)]
    fn row_mut(&mut self, vertex: usize) -> &mut [Block<D>] {
        RowsMut::row_mut(self, vertex).1
    }
}

/// All rows.
impl<const D: usize> PartRows<D> for BlockCsr<D> {
    #[inline(always)]
    fn owns(&self, _: usize) -> bool {
        true
    }

    #[inline(always)]
    fn row_mut(&mut self, vertex: usize) -> &mut [Block<D>] {
        BlockCsr::row_mut(self, vertex).1
    }
}

/// The rows of a part that lie anywhere, in its buffer.
struct Buffered<'a, const D: usize> {
    number: u16,
    owner: &'a [u16],
    place: &'a [u32],
    starts: &'a [u32],
    matrix: &'a BlockCsr<D>,
    values: &'a mut [Block<D>],
}

impl<const D: usize> PartRows<D> for Buffered<'_, D> {
    #[inline(always)]
    fn owns(&self, vertex: usize) -> bool {
        self.owner[vertex] == self.number
    }

    #[inline(always)]
    fn row_mut(&mut self, vertex: usize) -> &mut [Block<D>] {
        &mut self.values[self.starts[self.place[vertex] as usize] as usize..][..self.matrix.row(vertex).0.len()]
    }
}

/// Sums the wanted rows of a matrix whose pattern stands, the parts shared by a team.
pub(super) fn write_rows<const D: usize>(
    parts: &mut Parts<D>,
    team: &Team,
    matrix: &mut BlockCsr<D>,
    sum: &impl RowSum<D>,
) {
    let Some(bounds) = parts.bounds() else { return write_buffered(parts, team, matrix, sum) };
    if let [whole] = &parts.parts[..] {
        return sum.sum(whole, matrix);
    }
    let (n_parts, n_rows) = (parts.parts.len(), matrix.n_rows());
    let write = |k: usize, rows: &mut RowsMut<'_, D>| sum.sum(&parts.parts[k], rows);
    if let Some(mut lent) = matrix.parts(bounds, n_rows) {
        return team.each(&mut lent[..n_parts], write);
    }
    // Rows that have outgrown their places stand elsewhere: once after a change of the mesh.
    *matrix = in_row_order(matrix);
    if let Some(mut lent) = matrix.parts(bounds, n_rows) {
        team.each(&mut lent[..n_parts], write);
    }
}

/// The same matrix, its rows one behind the other.
fn in_row_order<const D: usize>(matrix: &BlockCsr<D>) -> BlockCsr<D> {
    let (mut starts, mut columns) = (vec![0], Vec::with_capacity(matrix.n_blocks()));
    for row in 0..matrix.n_rows() {
        columns.extend_from_slice(matrix.row(row).0);
        starts.push(columns.len());
    }
    let mut ordered = BlockCsr::from_pattern(&starts, &columns).expect("the rows of a matrix make one");
    for row in 0..matrix.n_rows() {
        ordered.row_mut(row).1.copy_from_slice(matrix.row(row).1);
    }
    ordered
}

/// Parts that lie anywhere: each sums to its buffer, and the buffers are copied.
fn write_buffered<const D: usize>(parts: &mut Parts<D>, team: &Team, matrix: &mut BlockCsr<D>, sum: &impl RowSum<D>) {
    parts.place_rows(matrix);
    let Parts { parts, owner, place, .. } = parts;
    let (owner, place, pattern) = (&owner[..], &place[..], &*matrix);
    team.each(parts, |k, part| {
        let mut values = std::mem::take(&mut part.values);
        // Blocks that are not summed anew keep their numbers.
        for (&vertex, &start) in part.rows.iter().zip(&part.starts).filter(|&(&vertex, _)| sum.wants(vertex as usize)) {
            let row = pattern.row(vertex as usize).1;
            values[start as usize..][..row.len()].copy_from_slice(row);
        }
        let (number, starts) = (k as u16, &part.starts[..]);
        sum.sum(part, &mut Buffered { number, owner, place, starts, matrix: pattern, values: &mut values });
        part.values = values;
    });
    for part in parts {
        for (&vertex, &start) in part.rows.iter().zip(&part.starts).filter(|&(&vertex, _)| sum.wants(vertex as usize)) {
            let (columns, row) = matrix.row_mut(vertex as usize);
            row.copy_from_slice(&part.values[start as usize..][..columns.len()]);
        }
    }
}

/// Rows summed from elements that are evaluated on the way, at their references.
pub(super) struct Evaluated<'a, const D: usize, const N: usize, M> {
    pub materials: &'a [M],
    pub elements: &'a ElementTable<D, N>,
    pub places: &'a [[[u16; N]; N]],
    pub references: &'a [[[Lane; D]; D]],
    pub project: bool,
}

/// What makes the matrices of a group of elements.
pub(super) trait GroupStiffness<const D: usize>: Sync {
    /// As [`Hyperelastic::element_stiffness_lanes`].
    fn group_stiffness<const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        project: bool,
        upper: &mut [[[Lane; D]; D]],
    );
}

impl<const D: usize, M: Hyperelastic<D>> GroupStiffness<D> for M {
    #[inline(always)]
    fn group_stiffness<const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        project: bool,
        upper: &mut [[[Lane; D]; D]],
    ) {
        self.element_stiffness_lanes(f, gradients, weight, project, upper);
    }
}

impl<const D: usize, const N: usize, M: GroupStiffness<D>> RowSum<D> for Evaluated<'_, D, N, M> {
    fn wants(&self, _: usize) -> bool {
        true
    }

    fn sum(&self, part: &Part<D>, rows: &mut impl PartRows<D>) {
        Arch::new().dispatch(Evaluate { pass: self, part, rows });
    }
}

/// [`Evaluated::visit`] for wide vectors.
struct Evaluate<'a, 'b, const D: usize, const N: usize, M, R> {
    pass: &'a Evaluated<'b, D, N, M>,
    part: &'a Part<D>,
    rows: &'a mut R,
}

impl<const D: usize, const N: usize, M: GroupStiffness<D>, R: PartRows<D>> NullaryFnOnce
    for Evaluate<'_, '_, D, N, M, R>
{
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.pass.visit(self.part, self.rows);
    }
}

impl<const D: usize, const N: usize, M: GroupStiffness<D>> Evaluated<'_, D, N, M> {
    #[inline(always)]
    fn visit(&self, part: &Part<D>, rows: &mut impl PartRows<D>) {
        for &vertex in &part.rows {
            rows.row_mut(vertex as usize).fill([[0.0; D]; D]);
        }
        let (mut gathered, mut gathered_f) = (Group::empty(0), at_rest());
        let mut upper = [[[[0.0; LANES]; D]; D]; MAX_PAIRS];
        let pairs = N * (N + 1) / 2;
        let mut rest = part.elements.as_slice();
        while !rest.is_empty() {
            let slots = self.elements.batch(rest);
            rest = &rest[slots.len()..];
            let (group, f) = match whole_group(slots) {
                Some(whole) => (&self.elements.groups[whole], &self.references[whole]),
                None => {
                    self.gather(slots, &mut gathered, &mut gathered_f);
                    (&gathered, &gathered_f)
                }
            };
            let material = &self.materials[group.material as usize];
            material.group_stiffness(f, &group.all_gradients(), &group.weight, self.project, &mut upper[..pairs]);
            for (lane, &slot) in slots.iter().enumerate() {
                let blocks = lane_blocks(&upper, lane);
                let places = &self.places[slot as usize];
                for a in 0..N {
                    let vertex = group.vertices[a][lane] as usize;
                    if !rows.owns(vertex) {
                        continue;
                    }
                    let row = rows.row_mut(vertex);
                    for b in 0..N {
                        add_block::<D, N>(&blocks, a, b, &mut row[places[a][b] as usize]);
                    }
                }
            }
        }
    }

    /// Elements from anywhere side by side; lanes beyond hold elements of an earlier batch, or none.
    #[inline(always)]
    fn gather(&self, slots: &[u32], group: &mut Group<D, N>, f: &mut [[Lane; D]; D]) {
        self.elements.gather(slots, group);
        for (lane, &slot) in slots.iter().enumerate() {
            let (from, from_lane) = (slot as usize / LANES, slot as usize % LANES);
            for i in 0..D {
                for k in 0..D {
                    f[i][k][lane] = self.references[from][i][k][from_lane];
                }
            }
        }
    }
}

/// Rows summed from the elements that a lazy body keeps: those of vertices that are wanted, and in them the blocks that
/// the elements that were evaluated contribute to.
pub(super) struct Kept<'a, const D: usize, const N: usize> {
    pub stars: &'a Stars,
    pub stored: &'a [Stored<D>],
    pub places: &'a [[[u16; N]; N]],
    pub wanted: &'a [bool],
    /// Lanes that were evaluated, by group; none: all.
    pub updated: Option<&'a [[bool; LANES]]>,
}

impl<const D: usize, const N: usize> RowSum<D> for Kept<'_, D, N> {
    fn wants(&self, vertex: usize) -> bool {
        self.wanted[vertex]
    }

    fn sum(&self, part: &Part<D>, rows: &mut impl PartRows<D>) {
        Arch::new().dispatch(Keep { pass: self, part, rows });
    }
}

/// [`Kept::visit`] for wide vectors.
struct Keep<'a, 'b, const D: usize, const N: usize, R> {
    pass: &'a Kept<'b, D, N>,
    part: &'a Part<D>,
    rows: &'a mut R,
}

impl<const D: usize, const N: usize, R: PartRows<D>> NullaryFnOnce for Keep<'_, '_, D, N, R> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.pass.visit(self.part, self.rows);
    }
}

impl<const D: usize, const N: usize> Kept<'_, D, N> {
    #[inline(always)]
    fn visit(&self, part: &Part<D>, rows: &mut impl PartRows<D>) {
        for vertex in part.rows.iter().map(|&vertex| vertex as usize).filter(|&vertex| self.wanted[vertex]) {
            let row = rows.row_mut(vertex);
            let marks = self.marks(vertex, row.len());
            for (place, block) in row.iter_mut().enumerate() {
                if marks.has(place) {
                    *block = [[0.0; D]; D];
                }
            }
            let mut diagonal = 0;
            for corner in self.stars.corners(vertex) {
                let (slot, a) = (corner.slot::<N>(), corner.local::<N>());
                let places = &self.places[slot][a];
                diagonal = usize::from(places[a]);
                for b in 0..N {
                    let place = usize::from(places[b]);
                    if b != a && marks.has(place) {
                        add(&stored::off_diagonal::<D, N>(&self.stored[slot], a, b), &mut row[place]);
                    }
                }
            }
            if !row.is_empty() {
                stored::balance(row, diagonal);
            }
        }
    }

    /// The places of a row that elements contribute to that were evaluated.
    #[inline(always)]
    fn marks(&self, vertex: usize, len: usize) -> Marks {
        let Some(updated) = self.updated.filter(|_| len <= Marks::PLACES) else { return Marks(u128::MAX) };
        let mut marks = 0;
        for corner in self.stars.corners(vertex) {
            let (slot, a) = (corner.slot::<N>(), corner.local::<N>());
            if updated[slot / LANES][slot % LANES] {
                for place in self.places[slot][a] {
                    marks |= 1u128 << place;
                }
            }
        }
        Marks(marks)
    }
}

/// Places of a row; those beyond the bits are always in it.
#[derive(Clone, Copy)]
struct Marks(u128);

impl Marks {
    const PLACES: usize = 128;

    #[inline(always)]
    fn has(self, place: usize) -> bool {
        place >= Self::PLACES || self.0 >> place & 1 == 1
    }
}
