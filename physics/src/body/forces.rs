//! Elastic forces on the vertices, summed by parts like the rows of the stiffness matrix.

use super::Body;
use super::assembly::at_rest;
use super::element::{ElementTable, Group, whole_group};
use super::kernel::{corner_forces, deformation_gradients};
use super::partition::Part;
use crate::lanes::LANES;
use crate::material::Hyperelastic;
use pulp::{Arch, NullaryFnOnce};
use stylet_solver::LinearOperator;
use stylet_solver::team::Team;

/// Groups whose stresses are asked for at once.
const RUN: usize = 8;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// Overwrites `force` with the elastic force `dW/du` at the displacement `u` (m), N: what external loads balance.
    ///
    /// # Panics
    /// If a length is not `D` entries per vertex.
    pub fn internal_force(&mut self, u: &[f64], force: &mut [f64]) {
        self.check_len(u);
        self.check_len(force);
        if M::IS_LINEAR {
            return self.stiffness.apply(u, force);
        }
        let team = self.team_worth();
        self.parts.follow(team.size(), &self.elements, &self.stars);
        let pass = Forces { materials: &self.materials, elements: &self.elements, u };
        let force = force.as_chunks_mut::<D>().0;
        let (bounds, parts) = (self.parts.bounds(), &mut self.parts);
        let Some(bounds) = bounds else {
            let (owner, place) = (&parts.owner[..], &parts.place[..]);
            team.each(&mut parts.parts, |k, part| {
                let mut sums = std::mem::take(&mut part.forces);
                sums.fill([0.0; D]);
                pass.sum(part, Buffered { number: k as u16, owner, place, sums: &mut sums });
                part.forces = sums;
            });
            for part in &parts.parts {
                part.rows.iter().zip(&part.forces).for_each(|(&vertex, sum)| force[vertex as usize] = *sum);
            }
            return;
        };
        let mut rest = force;
        let mut stretches: [_; Team::MAX_MEMBERS] = std::array::from_fn(|k| {
            let end = bounds.get(k + 1).map_or(bounds[k] + rest.len(), |&end| end);
            let (sums, after) = std::mem::take(&mut rest).split_at_mut(end - bounds[k]);
            rest = after;
            (bounds[k], sums)
        });
        let parts = &parts.parts[..];
        team.each(&mut stretches[..parts.len()], |k, (first, sums)| {
            sums.fill([0.0; D]);
            pass.sum(&parts[k], Stretch { first: *first, sums });
        });
    }
}

/// Where a part sums.
trait Sums<const D: usize> {
    /// The sum of a vertex of the part.
    fn of(&mut self, vertex: usize) -> Option<&mut [f64; D]>;
}

/// Vertices one behind the other.
struct Stretch<'a, const D: usize> {
    first: usize,
    sums: &'a mut [[f64; D]],
}

impl<const D: usize> Sums<D> for Stretch<'_, D> {
    #[inline(always)]
    fn of(&mut self, vertex: usize) -> Option<&mut [f64; D]> {
        self.sums.get_mut(vertex.wrapping_sub(self.first))
    }
}

/// Vertices that lie anywhere, in the buffer of their part.
struct Buffered<'a, const D: usize> {
    number: u16,
    owner: &'a [u16],
    place: &'a [u32],
    sums: &'a mut [[f64; D]],
}

impl<const D: usize> Sums<D> for Buffered<'_, D> {
    #[inline(always)]
    fn of(&mut self, vertex: usize) -> Option<&mut [f64; D]> {
        (self.owner[vertex] == self.number).then(|| &mut self.sums[self.place[vertex] as usize])
    }
}

/// One sweep over the elements of a part.
struct Forces<'a, const D: usize, const N: usize, M> {
    materials: &'a [M],
    elements: &'a ElementTable<D, N>,
    u: &'a [f64],
}

/// [`Forces::visit`] for wide vectors.
struct Visit<'a, 'b, const D: usize, const N: usize, M, S> {
    pass: &'a Forces<'b, D, N, M>,
    part: &'a Part<D>,
    sums: S,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>, S: Sums<D>> NullaryFnOnce for Visit<'_, '_, D, N, M, S> {
    type Output = ();
    #[inline(always)]
    fn call(mut self) {
        self.pass.visit(self.part, &mut self.sums);
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Forces<'_, D, N, M> {
    fn sum(&self, part: &Part<D>, sums: impl Sums<D>) {
        Arch::new().dispatch(Visit { pass: self, part, sums });
    }

    /// Adds to sums that are zero. Every vertex gets its elements in ascending order of their cells, whatever the parts are.
    #[inline(always)]
    fn visit(&self, part: &Part<D>, sums: &mut impl Sums<D>) {
        let mut gathered = [Group::empty(0); RUN];
        let mut stress = [at_rest(); RUN];
        let mut batches: [&[u32]; RUN] = [&[]; RUN];
        let mut rest = part.elements.as_slice();
        while !rest.is_empty() {
            let material = self.elements.groups[rest[0] as usize / LANES].material;
            let mut n = 0;
            while n < RUN && !rest.is_empty() {
                let slots = self.elements.batch(rest);
                if self.elements.groups[slots[0] as usize / LANES].material != material {
                    break;
                }
                if whole_group(slots).is_none() {
                    self.elements.gather(slots, &mut gathered[n]);
                }
                stress[n] = deformation_gradients(self.group(slots, &gathered[n]), self.u);
                (batches[n], rest, n) = (slots, &rest[slots.len()..], n + 1);
            }
            self.materials[material as usize].stress_groups(&mut stress[..n]);
            for k in 0..n {
                let group = self.group(batches[k], &gathered[k]);
                let forces = corner_forces(group, &stress[k]);
                for lane in 0..batches[k].len() {
                    for a in 0..N {
                        let Some(sum) = sums.of(group.vertices[a][lane] as usize) else { continue };
                        for i in 0..D {
                            sum[i] += forces[a][i][lane];
                        }
                    }
                }
            }
        }
    }

    /// The elements of a batch side by side.
    #[inline(always)]
    fn group<'g>(&'g self, slots: &[u32], gathered: &'g Group<D, N>) -> &'g Group<D, N> {
        match whole_group(slots) {
            Some(whole) => &self.elements.groups[whole],
            None => gathered,
        }
    }
}
