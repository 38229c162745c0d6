//! Mass of a body: lumped at the vertices, or consistent with P1 displacements. A body has none until it is asked for.

use super::regions::check_once;
use super::{Body, BodyError};
use crate::material::Hyperelastic;
use serde::{Deserialize, Serialize};
use stylet_solver::sparse::BlockCsr;

/// How the mass of an element is given to its vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MassKind {
    /// In equal shares: `M_aa = m / N`.
    #[default]
    Lumped,
    /// `M_ab` is the integral of `rho N_a N_b`: `m (1 + delta_ab) / (N (N + 1))`.
    Consistent,
}

/// Densities of a body, kg/m^3.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Density {
    /// The same everywhere.
    Uniform(f64),
    /// By region, for every region that has a material.
    ByRegion(Vec<(u32, f64)>),
}

/// Masses of the vertices, kg, and the consistent matrix if that was asked for.
#[derive(Clone, Debug)]
pub(super) struct Mass {
    kind: MassKind,
    /// By material, kg/m^3.
    densities: Vec<f64>,
    lumped: Vec<f64>,
    /// Factors of the identity block; pattern of the stiffness. Empty if the mass is lumped.
    consistent: BlockCsr<1>,
}

impl Mass {
    pub fn memory_bytes(&self) -> usize {
        let matrix = self.consistent.capacity() * (size_of::<f64>() + size_of::<u32>());
        matrix + size_of::<f64>() * (self.lumped.capacity() + self.densities.capacity())
    }
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    /// Gives the body mass; it then follows changes of the mesh.
    ///
    /// # Errors
    /// [`BodyError::Density`]; [`BodyError::RegionListed`] if a region with a material has no density or several;
    /// [`BodyError::Matrix`].
    pub fn set_mass(&mut self, kind: MassKind, density: &Density) -> Result<(), BodyError> {
        let densities = self.densities(density)?;
        self.mass = Some(Mass { kind, densities, lumped: Vec::new(), consistent: BlockCsr::new(0) });
        let vertices: Vec<u32> = (0..self.n_vertices() as u32).collect();
        self.patch_mass(&vertices)
    }

    /// Density of each material.
    fn densities(&self, density: &Density) -> Result<Vec<f64>, BodyError> {
        let check = |region: Option<u32>, density: f64| match density > 0.0 && density.is_finite() {
            true => Ok(density),
            false => Err(BodyError::Density { region, density }),
        };
        match density {
            Density::Uniform(rho) => Ok(vec![check(None, *rho)?; self.materials.len()]),
            Density::ByRegion(listed) => {
                let mut ids: Vec<u32> = listed.iter().map(|entry| entry.0).collect();
                ids.sort_unstable();
                check_once(&ids, "densities")?;
                listed.iter().try_for_each(|&(region, rho)| check(Some(region), rho).map(drop))?;
                let of = |index: usize| {
                    let region = self.regions.id(index).unwrap_or(0);
                    let found = listed.iter().find(|entry| entry.0 == region).map(|entry| entry.1);
                    found.ok_or(BodyError::RegionListed { region, times: 0, what: "densities" })
                };
                (0..self.materials.len()).map(of).collect()
            }
        }
    }

    /// Rewrites the masses of vertices whose elements have changed; nothing for a body without mass.
    pub(super) fn patch_mass(&mut self, vertices: &[u32]) -> Result<(), BodyError> {
        let Some(mut mass) = self.mass.take() else { return Ok(()) };
        mass.lumped.resize(self.n_vertices(), 0.0);
        for &vertex in vertices {
            let weight = |corner: &super::star::Corner| self.element_mass(&mass.densities, corner.slot::<N>());
            let corners = self.stars.corners(vertex as usize);
            mass.lumped[vertex as usize] = corners.iter().map(|corner| weight(corner) / N as f64).sum();
        }
        let result = match mass.kind {
            MassKind::Lumped => Ok(()),
            MassKind::Consistent => self.patch_consistent(&mut mass, vertices),
        };
        self.mass = Some(mass);
        result
    }

    /// Mass of an element, kg.
    fn element_mass(&self, densities: &[f64], slot: usize) -> f64 {
        let element = self.elements.element(slot);
        densities[element.material as usize] * element.weight
    }

    fn patch_consistent(&self, mass: &mut Mass, vertices: &[u32]) -> Result<(), BodyError> {
        mass.consistent.resize(self.n_vertices())?;
        let (mut columns, mut row) = (Vec::new(), Vec::new());
        for &vertex in vertices {
            let corners = self.stars.corners(vertex as usize);
            columns.clear();
            columns.extend(corners.iter().flat_map(|corner| self.elements.vertices(corner.slot::<N>())));
            columns.sort_unstable();
            columns.dedup();
            row.clear();
            row.resize(columns.len(), [[0.0]]);
            for corner in corners {
                let slot = corner.slot::<N>();
                let share = self.element_mass(&mass.densities, slot) / (N * (N + 1)) as f64;
                for b in self.elements.vertices(slot) {
                    let at = columns.partition_point(|&column| column < b);
                    row[at][0][0] += if b == vertex { 2.0 * share } else { share };
                }
            }
            mass.consistent.set_row(vertex as usize, &columns, &row)?;
        }
        Ok(())
    }

    /// How the mass is given to the vertices; `None` for a body without mass.
    pub fn mass_kind(&self) -> Option<MassKind> {
        self.mass.as_ref().map(|mass| mass.kind)
    }

    /// Masses of the vertices, kg: row sums of the consistent matrix, too. Empty for a body without mass.
    pub fn lumped_mass(&self) -> &[f64] {
        self.mass.as_ref().map_or(&[], |mass| &mass.lumped)
    }

    /// The consistent mass matrix: factors of the identity block, kg; `None` unless the mass is consistent.
    pub fn consistent_mass(&self) -> Option<&BlockCsr<1>> {
        self.mass.as_ref().filter(|mass| mass.kind == MassKind::Consistent).map(|mass| &mass.consistent)
    }

    /// Overwrites `y` with `M x`; with zero for a body without mass.
    ///
    /// # Panics
    /// If a length is not `D` entries per vertex.
    pub fn apply_mass(&self, x: &[f64], y: &mut [f64]) {
        self.check_len(x);
        self.check_len(y);
        let (x, y) = (x.as_chunks::<D>().0, y.as_chunks_mut::<D>().0);
        let Some(mass) = &self.mass else { return y.fill([0.0; D]) };
        if mass.kind == MassKind::Lumped {
            for ((m, x), y) in mass.lumped.iter().zip(x).zip(y) {
                *y = x.map(|x| m * x);
            }
            return;
        }
        for (vertex, y) in y.iter_mut().enumerate() {
            let (columns, row) = mass.consistent.row(vertex);
            let mut sum = [0.0; D];
            for (&column, m) in columns.iter().zip(row) {
                for i in 0..D {
                    sum[i] += m[0][0] * x[column as usize][i];
                }
            }
            *y = sum;
        }
    }

    /// Total mass, kg; zero for a body without mass.
    pub fn total_mass(&self) -> f64 {
        self.lumped_mass().iter().sum()
    }

    /// Adds the weight of the body under the acceleration `gravity` (m/s^2) to `load` (N, flat): exact for either kind of
    /// mass.
    ///
    /// # Panics
    /// If `load` does not have `D` entries per vertex.
    pub fn add_gravity(&self, gravity: &[f64; D], load: &mut [f64]) {
        self.check_len(load);
        for (m, load) in self.lumped_mass().iter().zip(load.as_chunks_mut::<D>().0) {
            for k in 0..D {
                load[k] += m * gravity[k];
            }
        }
    }
}
