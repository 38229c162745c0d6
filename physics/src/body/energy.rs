//! A body as an energy to be minimised.

use super::Body;
use super::element::Group;
use super::kernel::deformation_gradients;
use crate::lanes::LANES;
use crate::material::Hyperelastic;
use pulp::{Arch, NullaryFnOnce};
use stylet_solver::LinearOperator;
use stylet_solver::energy::{BlockHessian, Energy};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::vector;

/// Elements whose energies are summed before the sums are: keeps the rounding error of a large body small, and its
/// shape depends on the mesh alone.
const CHUNK: usize = 256;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// Strain energy at the displacement `u` (m), J; infinite outside the domain of the material.
    ///
    /// # Panics
    /// If `u` does not have `D` entries per vertex.
    pub fn strain_energy(&self, u: &[f64]) -> f64 {
        self.check_len(u);
        Arch::new().dispatch(TotalEnergy { body: self, u })
    }

    #[inline(always)]
    fn sum_energies(&self, u: &[f64]) -> f64 {
        let (mut total, mut partial) = (0.0, 0.0);
        let (mut group, mut filled, mut count) = (Group::empty(0), 0, 0);
        // Cells in ascending order, as many at a time as there are lanes and one material.
        for (_, slot) in self.elements.live() {
            let from = &self.elements.groups[slot / LANES];
            if filled == LANES || (filled > 0 && group.material != from.material) {
                self.add_energies(&group, filled, u, (&mut total, &mut partial), &mut count);
                filled = 0;
            }
            group.material = from.material;
            group.copy_lane(filled, from, slot % LANES);
            filled += 1;
        }
        self.add_energies(&group, filled, u, (&mut total, &mut partial), &mut count);
        total + partial
    }

    /// Adds the energies of the first lanes of a group to a sum of chunks.
    #[inline(always)]
    fn add_energies(
        &self,
        group: &Group<D, N>,
        filled: usize,
        u: &[f64],
        (total, partial): (&mut f64, &mut f64),
        count: &mut usize,
    ) {
        let material = &self.materials[group.material as usize];
        let density = material.energy_lanes(&deformation_gradients(group, u));
        for lane in 0..filled {
            *partial += group.weight[lane] * density[lane];
            *count += 1;
            if count.is_multiple_of(CHUNK) {
                *total += std::mem::take(partial);
            }
        }
    }

    #[track_caller]
    pub(super) fn check_len(&self, x: &[f64]) {
        assert_eq!(x.len(), D * self.n_vertices(), "a field has {D} entries per vertex");
    }
}

/// [`Body::sum_energies`] for wide vectors.
struct TotalEnergy<'a, const D: usize, const N: usize, M> {
    body: &'a Body<D, N, M>,
    u: &'a [f64],
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> NullaryFnOnce for TotalEnergy<'_, D, N, M> {
    type Output = f64;
    #[inline(always)]
    fn call(self) -> f64 {
        self.body.sum_energies(self.u)
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Energy for Body<D, N, M> {
    fn dim(&self) -> usize {
        D * self.n_vertices()
    }

    /// Strain energy, J. A linear body computes `u.K u / 2`.
    fn value(&mut self, x: &[f64]) -> f64 {
        if !M::IS_LINEAR {
            return self.strain_energy(x);
        }
        self.check_len(x);
        let mut product = std::mem::take(&mut self.scratch.product);
        product.resize(x.len(), 0.0);
        let energy = 0.5 * self.stiffness.apply_dot(x, &mut product);
        self.scratch.product = product;
        if energy.is_nan() { f64::INFINITY } else { energy }
    }

    fn gradient(&mut self, x: &[f64], g: &mut [f64]) {
        self.internal_force(x, g);
    }

    /// Does nothing for a linear body. Where the tangent is not finite (an element flattened to nothing) the matrix
    /// keeps what it held: methods stay within [`max_step`](Energy::max_step), and come here from finite energies only.
    fn linearize(&mut self, x: &[f64]) {
        self.check_len(x);
        if M::IS_LINEAR || vector::first_not_finite(x).is_some() {
            return;
        }
        self.relinearize(x);
    }

    fn hessian_apply(&self, p: &[f64], hp: &mut [f64]) {
        self.stiffness.apply(p, hp);
    }

    /// Where the first element would lose its volume, at most `limit`; that for laws that are defined for every `F`.
    fn max_step(&mut self, x: &[f64], p: &[f64], limit: f64) -> f64 {
        if self.requires_positive_j() { self.step_to_inversion(x, p, limit) } else { limit }
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> BlockHessian<D> for Body<D, N, M> {
    fn matrix(&self) -> &BlockCsr<D> {
        &self.stiffness
    }
}
