//! Damping from the rates of stretching, as a matrix.

use super::assembly::at_rest;
use super::kernel::deformation_gradients;
use super::rows::{Evaluated, GroupStiffness, write_rows};
use super::{Body, BodyError};
use crate::lanes::{LANES, Lane};
use crate::material::{Hyperelastic, Viscosity};
use crate::parallel::chunks;
use stylet_solver::sparse::BlockCsr;

/// What a damped body keeps besides.
#[derive(Clone, Debug)]
pub(super) struct Damper<const D: usize> {
    /// By material.
    viscosities: Vec<Viscous>,
    references: Vec<[[Lane; D]; D]>,
    matrix: BlockCsr<D>,
    number: u64,
}

/// The viscosity of a material that may have none.
#[derive(Clone, Copy, Debug)]
struct Viscous(Option<Viscosity>);

impl<const D: usize> GroupStiffness<D> for Viscous {
    #[inline(always)]
    fn group_stiffness<const N: usize>(
        &self,
        f: &[[Lane; D]; D],
        gradients: &[[Lane; D]; N],
        weight: &Lane,
        _: bool,
        upper: &mut [[[Lane; D]; D]],
    ) {
        match &self.0 {
            Some(viscosity) => viscosity.element_damping_lanes(f, gradients, weight, upper),
            None => upper.fill([[[0.0; LANES]; D]; D]),
        }
    }
}

impl<const D: usize> Damper<D> {
    /// Bytes that it takes, spare room included.
    pub fn memory_bytes(&self) -> usize {
        size_of::<[[Lane; D]; D]>() * self.references.capacity() + self.matrix.memory_bytes()
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// Gives the material of a region a viscosity; in a body made by [`new`](Self::new) any region stands for the one material.
    ///
    /// Bodies of constant stiffness are damped where they rest, in proportion to small strains.
    ///
    /// # Errors
    /// [`BodyError::UnknownRegion`].
    pub fn set_viscosity(&mut self, region: u32, viscosity: Viscosity) -> Result<(), BodyError> {
        let unknown = || BodyError::UnknownRegion { region, known: self.regions.names() };
        let material = self.regions.index(region).ok_or_else(unknown)? as usize;
        let n_materials = self.materials.len();
        let damper = self.damper.get_or_insert_with(|| {
            let (references, matrix) = (Vec::new(), BlockCsr::new(0));
            Box::new(Damper { viscosities: vec![Viscous(None); n_materials], references, matrix, number: 0 })
        });
        damper.viscosities[material] = Viscous(Some(viscosity));
        Ok(())
    }

    /// Whether a material has a viscosity.
    pub fn is_viscous(&self) -> bool {
        self.damper.is_some()
    }

    /// Makes the damping matrix at the displacement `u` (m): force by velocity, N s/m, positive semidefinite; rotations of
    /// the elements are held. Nothing to do for a body without viscosity.
    ///
    /// # Errors
    /// [`BodyError::Matrix`].
    ///
    /// # Panics
    /// If `u` does not have `D` entries per vertex.
    pub fn evaluate_damping(&mut self, u: &[f64]) -> Result<(), BodyError> {
        self.check_len(u);
        let Some(mut damper) = self.damper.take() else { return Ok(()) };
        let made = self.write_damping(&mut damper, u);
        self.damper = Some(damper);
        made
    }

    /// The damping matrix that [`evaluate_damping`](Self::evaluate_damping) made, N s/m, and how often it has been made.
    pub fn damping(&self) -> Option<(&BlockCsr<D>, u64)> {
        self.damper.as_ref().map(|damper| (&damper.matrix, damper.number))
    }

    fn write_damping(&mut self, damper: &mut Damper<D>, u: &[f64]) -> Result<(), BodyError> {
        if !self.assembled {
            self.assemble_all()?;
        }
        let team = self.team_worth();
        let groups = &self.elements.groups[..];
        damper.references.resize(groups.len(), at_rest());
        if M::IS_LINEAR {
            damper.references.fill(at_rest());
        } else {
            chunks(&team, &mut damper.references, &|first, references| {
                for (group, f) in groups[first..].iter().zip(references) {
                    *f = deformation_gradients(group, u);
                }
            });
        }
        follow_pattern(&mut damper.matrix, &self.stiffness)?;
        self.parts.follow(team.size(), &self.elements, &self.stars);
        let pass = Evaluated {
            materials: &damper.viscosities,
            elements: &self.elements,
            places: &self.places,
            references: &damper.references,
            project: false,
        };
        write_rows(&mut self.parts, &team, &mut damper.matrix, &pass);
        damper.number += 1;
        Ok(())
    }
}

/// Gives a matrix the pattern of another, whose numbers it keeps nothing of.
fn follow_pattern<const D: usize>(matrix: &mut BlockCsr<D>, pattern: &BlockCsr<D>) -> Result<(), BodyError> {
    if matrix.n_rows() == 0 {
        *matrix = pattern.clone();
        return Ok(());
    }
    matrix.resize(pattern.n_rows())?;
    for row in 0..pattern.n_rows() {
        let (columns, blocks) = pattern.row(row);
        if matrix.row(row).0 != columns {
            matrix.set_row(row, columns, blocks)?;
        }
    }
    Ok(())
}
