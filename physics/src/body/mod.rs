//! An elastic body of P1 simplices: its energy, forces and stiffness, kept in step with a changing mesh.
//!
//! ```text
//! mesh --new--> elements (one per live cell)  --stars--> forces per vertex
//!      --apply_change-->   touched ones only             stiffness rows per vertex
//! ```
//!
//! A linear body ([`Hyperelastic::IS_LINEAR`]) assembles its stiffness once and evaluates energy and gradient as matrix
//! products: a solve visits no element. A nonlinear body evaluates its gradient element by element, and has no matrix
//! until it is first linearised: a method without a Hessian never pays for one.

mod assembly;
mod damping;
mod element;
mod energy;
mod forces;
mod injectivity;
mod kernel;
mod lazy;
mod load;
mod loaded;
mod mass;
mod momentum;
mod partition;
mod regions;
mod rows;
mod star;
mod stored;
mod turn;

pub use lazy::LazyRule;
pub use load::{LoadError, boundary_traction, facet_area, segment_load};
pub use loaded::Loaded;
pub use mass::{Density, MassKind};

use crate::lanes::{LANES, Lane};
use crate::material::Hyperelastic;
use crate::small::determinant;
use element::{Element, ElementTable};
use lazy::Moduli;
use mass::Mass;
use nalgebra::SMatrix;
use partition::Parts;
use regions::Regions;
use serde::{Deserialize, Serialize};
use star::{Corner, Stars};
use stored::Stored;
use stylet_mesh::{CellId, MeshChange, SimplexMesh};
use stylet_solver::sparse::{BlockCsr, SparseError};
use stylet_solver::team::Team;
use turn::Turn;

/// Elements below which waking a second thread costs more than it saves.
const CROSSOVER_ELEMENTS: usize = 4096;

/// Why a body could not be built or changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The thickness must be positive and finite.
    #[error("thickness is {thickness} m, it must be positive and finite")]
    Thickness {
        /// The value found, m.
        thickness: f64,
    },
    /// A cell is flat, or so small or large that its shape gradients overflow.
    #[error("cell {} has volume {volume:e}: too flat, small or large for an element", cell.0)]
    DegenerateCell {
        /// The cell.
        cell: CellId,
        /// Its signed volume (area in 2D).
        volume: f64,
    },
    /// The stiffness of an element overflows: the material is too stiff for the size of the cell.
    #[error("the stiffness of cell {} of volume {volume:e} overflows", cell.0)]
    StiffnessOverflow {
        /// The cell.
        cell: CellId,
        /// Its volume (area in 2D).
        volume: f64,
    },
    /// A change does not fit the elements of the body: a cell that died has none, or a cell that was born has one.
    #[error("the change does not follow on the state of this body: cell {} {}", cell.0, if *died { "died but has no element" } else { "was born but has an element" })]
    ChangeMismatch {
        /// The cell.
        cell: CellId,
        /// Whether it is listed as dead.
        died: bool,
    },
    /// A stored linearisation does not fit the elements of the body.
    #[error("the linearisation holds {found} numbers, this body needs {expected}")]
    LinearizationSize {
        /// `D^2` per live cell.
        expected: usize,
        /// Numbers found.
        found: usize,
    },
    /// A cell lies in a region without a material.
    #[error("cell {} lies in region {region}, which has no material; regions with one: {known}", cell.0)]
    RegionWithoutMaterial {
        /// The cell.
        cell: CellId,
        /// Its region.
        region: u32,
        /// The regions that have one.
        known: String,
    },
    /// A viscosity for a region that has no material.
    #[error("region {region} has no material to be viscous; regions with one: {known}")]
    UnknownRegion {
        /// The region.
        region: u32,
        /// The regions that have one.
        known: String,
    },
    /// Two materials, or densities, are given for one region, or none at all.
    #[error("region {region} is listed {times} times among the {what}, it must be listed once")]
    RegionListed {
        /// The region.
        region: u32,
        /// How often it is listed.
        times: usize,
        /// What is listed by region.
        what: &'static str,
    },
    /// No material is given.
    #[error("a body needs a material for at least one region")]
    NoMaterial,
    /// A density must be positive and finite.
    #[error("density{} is {density} kg/m^3, it must be positive and finite", region.map_or(String::new(), |r| format!(" of region {r}")))]
    Density {
        /// The region, where densities are given by region.
        region: Option<u32>,
        /// The value found, kg/m^3.
        density: f64,
    },
    /// Parts for the assembly do not fit the body.
    #[error(
        "a partition of {expected} vertices into at most 65,536 parts is needed, found {found} vertices, largest part {largest}"
    )]
    Partition {
        /// Vertices of the body.
        expected: usize,
        /// Entries found.
        found: usize,
        /// The largest part named.
        largest: u32,
    },
    /// A number of elements or blocks beyond 32-bit indices, or a stiffness that is not finite.
    #[error("stiffness matrix: {0}")]
    Matrix(#[from] SparseError),
}

/// Where a nonlinear body was last linearised: what a resumed run needs besides displacements and mesh.
///
/// Empty if the body was never linearised.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Linearization {
    /// Deformation gradients at which the stiffness of each element was evaluated: `D^2` numbers (columns first) per
    /// live cell, cells ascending.
    pub deformation_gradients: Vec<f64>,
}

/// A body of P1 simplices in `D` dimensions, `N = D + 1`.
///
/// Displacements, forces and loads are flat: vertex `v` owns entries `v D .. (v + 1) D`, m and N. In two dimensions all
/// forces are those of a slab of the given thickness (plane strain: of that length of a prism).
#[derive(Clone, Debug)]
pub struct Body<const D: usize, const N: usize, M> {
    regions: Regions,
    materials: Vec<M>,
    moduli: Vec<Moduli>,
    thickness: f64,
    elements: ElementTable<D, N>,
    stars: Stars,
    stiffness: BlockCsr<D>,
    /// By row, the number of its last write.
    row_revisions: Vec<u64>,
    revision: u64,
    /// By slot, where in the row of vertex `a` the column of vertex `b` is; once there is a matrix.
    places: Vec<[[u16; N]; N]>,
    /// Where the element stiffnesses were evaluated; nonlinear bodies once linearised.
    references: Vec<[[Lane; D]; D]>,
    /// Element stiffnesses by slot; lazy bodies once linearised.
    stored: Vec<Stored<D>>,
    /// Rotations of the elements where they were evaluated; lazy bodies that compare them.
    turns: Vec<Turn<D>>,
    parts: Parts<D>,
    mass: Option<Mass>,
    damper: Option<Box<damping::Damper<D>>>,
    assembled: bool,
    lazy: LazyRule,
    project: bool,
    team: Team,
    elements_linearized: u64,
    elements_updated: usize,
    scratch: assembly::RowScratch<D>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    const VALID: () = assert!(1 <= D && D <= 3 && N == D + 1, "a body fills space: N = D + 1, in 1 to 3 dimensions");

    /// The body of the live cells of `mesh`, all of one material. `thickness` (m) multiplies every volume; it is 1 in 3D.
    ///
    /// # Errors
    /// [`BodyError::Thickness`], [`BodyError::DegenerateCell`], [`BodyError::StiffnessOverflow`], [`BodyError::Matrix`].
    pub fn new(mesh: &SimplexMesh<D, N>, material: M, thickness: f64) -> Result<Self, BodyError> {
        Self::build(mesh, Regions::all(), vec![material], thickness)
    }

    /// The body of the live cells of `mesh`, whose [regions](SimplexMesh::region) name their materials.
    ///
    /// # Errors
    /// [`BodyError::RegionWithoutMaterial`], [`BodyError::RegionListed`], [`BodyError::NoMaterial`], and as
    /// [`new`](Self::new).
    pub fn with_materials(mesh: &SimplexMesh<D, N>, materials: &[(u32, M)], thickness: f64) -> Result<Self, BodyError> {
        let (regions, materials) = Regions::sorted(materials)?;
        Self::build(mesh, regions, materials, thickness)
    }

    fn build(mesh: &SimplexMesh<D, N>, regions: Regions, materials: Vec<M>, thickness: f64) -> Result<Self, BodyError> {
        let () = Self::VALID;
        if !(thickness > 0.0 && thickness.is_finite()) {
            return Err(BodyError::Thickness { thickness });
        }
        let mut body = Self {
            moduli: materials.iter().map(Moduli::at_rest).collect(),
            regions,
            materials,
            thickness,
            elements: ElementTable::default(),
            stars: Stars::default(),
            stiffness: BlockCsr::new(0),
            row_revisions: Vec::new(),
            revision: 0,
            places: Vec::new(),
            references: Vec::new(),
            stored: Vec::new(),
            parts: Parts::default(),
            mass: None,
            damper: None,
            assembled: false,
            lazy: LazyRule::Always,
            project: false,
            team: Team::serial(),
            turns: Vec::new(),
            elements_linearized: 0,
            elements_updated: 0,
            scratch: assembly::RowScratch::default(),
        };
        let mut by_vertex: Vec<Vec<Corner>> = vec![Vec::new(); mesh.n_vertex_slots()];
        for cell in mesh.cells() {
            let element = body.element_of(mesh, cell)?;
            let slot = body.elements.insert(cell, &element);
            for a in 0..N {
                by_vertex[element.vertices[a] as usize].push(Corner::new::<N>(slot, a));
            }
        }
        body.check_indices()?;
        body.stars.resize(mesh.n_vertex_slots());
        for (vertex, corners) in by_vertex.iter().enumerate() {
            body.stars.set(vertex, corners);
        }
        body.stiffness.resize(mesh.n_vertex_slots())?;
        body.row_revisions.resize(mesh.n_vertex_slots(), 0);
        if M::IS_LINEAR {
            body.assemble_all()?;
        }
        Ok(body)
    }

    /// Follows a change of the mesh that this body was made from: replaces the elements of the cells that died by those
    /// of the cells that were born, and rewrites the matrix rows of their vertices, no others. The result has the bits
    /// of a body made from the changed mesh.
    ///
    /// New elements of a nonlinear body are linearised at rest until the next
    /// [`linearize`](stylet_solver::energy::Energy::linearize).
    ///
    /// # Errors
    /// [`BodyError::ChangeMismatch`], [`BodyError::RegionWithoutMaterial`], [`BodyError::DegenerateCell`] or
    /// [`BodyError::StiffnessOverflow`], the body being unchanged; [`BodyError::Matrix`].
    pub fn apply_change(&mut self, mesh: &SimplexMesh<D, N>, change: &MeshChange) -> Result<(), BodyError> {
        let born = self.check_change(mesh, change)?;
        for birth in &change.vertices {
            let vertex = birth.vertex.index();
            let known = vertex < self.stars.n_vertices() && !self.stars.corners(vertex).is_empty();
            if let (false, Some((parent, _))) = (known, birth.origin.parents().next()) {
                self.parts.adopt(vertex, parent.index());
            }
        }
        let mut touched: Vec<u32> = born.iter().flat_map(|element| element.vertices).collect();
        for &cell in &change.died {
            if let Some(slot) = self.elements.slot(cell) {
                touched.extend(self.elements.element(slot).vertices);
            }
        }
        touched.sort_unstable();
        touched.dedup();

        // Corners that stay, by vertex and cell; then the table; then those that come.
        let mut corners: Vec<(u32, u32, Corner)> = Vec::new();
        for &cell in &change.died {
            self.elements.remove(cell);
        }
        self.stars.resize(mesh.n_vertex_slots().max(self.stars.n_vertices()));
        for &vertex in &touched {
            for &corner in self.stars.corners(vertex as usize) {
                let cell = self.elements.cell(corner.slot::<N>());
                if cell != u32::MAX {
                    corners.push((vertex, cell, corner));
                }
            }
        }
        let mut slots = Vec::with_capacity(born.len());
        for (&cell, element) in change.born.iter().zip(&born) {
            let slot = self.elements.insert(cell, element);
            slots.push(slot);
            for a in 0..N {
                corners.push((element.vertices[a], cell.0, Corner::new::<N>(slot, a)));
            }
        }
        self.check_indices()?;
        corners.sort_unstable_by_key(|&(vertex, cell, _)| (vertex, cell));
        let mut star = Vec::new();
        let mut rest = corners.as_slice();
        for &vertex in &touched {
            let len = rest.iter().take_while(|entry| entry.0 == vertex).count();
            star.clear();
            star.extend(rest[..len].iter().map(|entry| entry.2));
            rest = &rest[len..];
            self.stars.set(vertex as usize, &star);
        }
        self.stiffness.resize(self.stars.n_vertices())?;
        self.row_revisions.resize(self.stars.n_vertices(), 0);
        if self.assembled {
            self.patch_rows(&touched, &slots)?;
        }
        self.patch_mass(&touched)
    }

    fn check_change(&self, mesh: &SimplexMesh<D, N>, change: &MeshChange) -> Result<Vec<Element<D, N>>, BodyError> {
        let mut died = change.died.clone();
        died.sort_unstable();
        let repeated = died.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        if let Some(cell) = repeated.or(died.iter().copied().find(|&cell| self.elements.slot(cell).is_none())) {
            return Err(BodyError::ChangeMismatch { cell, died: true });
        }
        let mut born = change.born.clone();
        born.sort_unstable();
        let repeated = born.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
        let known = |cell: CellId| self.elements.slot(cell).is_some() && died.binary_search(&cell).is_err();
        let unfit = |cell: CellId| cell.index() >= mesh.n_slots() || known(cell);
        if let Some(cell) = repeated.or(born.iter().copied().find(|&cell| unfit(cell))) {
            return Err(BodyError::ChangeMismatch { cell, died: false });
        }
        change.born.iter().map(|&cell| self.element_of(mesh, cell)).collect()
    }

    /// The element of a cell, whose stiffness at rest is finite.
    fn element_of(&self, mesh: &SimplexMesh<D, N>, cell: CellId) -> Result<Element<D, N>, BodyError> {
        let region = mesh.region(cell);
        let known = || BodyError::RegionWithoutMaterial { cell, region, known: self.regions.names() };
        let material = self.regions.index(region).ok_or_else(known)?;
        let element = Element::of_cell(mesh, cell, self.thickness, material)?;
        let stiffness = self.rest_stiffness(&element);
        if stiffness.iter().flatten().flatten().all(|k| k.is_finite()) {
            Ok(element)
        } else {
            Err(BodyError::StiffnessOverflow { cell, volume: element.weight / self.thickness })
        }
    }

    /// Places in the force buffer must fit in 32 bits.
    fn check_indices(&self) -> Result<(), BodyError> {
        let places = self.elements.groups.len() * LANES * N * D;
        if u32::try_from(places).is_err() { Err(SparseError::TooLarge(places).into()) } else { Ok(()) }
    }

    /// The material; of a body with several, that of the region with the lowest number.
    pub fn material(&self) -> &M {
        &self.materials[0]
    }

    /// The material of a cell; `None` if it has no element.
    pub fn material_of(&self, cell: CellId) -> Option<&M> {
        self.elements.slot(cell).map(|slot| &self.materials[self.elements.groups[slot / LANES].material as usize])
    }

    /// The materials, by region ascending; the one of a body made by [`new`](Self::new) has no region.
    pub fn materials(&self) -> impl Iterator<Item = (Option<u32>, &M)> {
        self.materials.iter().enumerate().map(|(index, material)| (self.regions.id(index), material))
    }

    /// Whether a material of this body refuses `J <= 0`.
    pub fn requires_positive_j(&self) -> bool {
        self.materials.iter().any(M::requires_positive_j)
    }

    /// The thickness, m.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Number of elements, one per live cell.
    pub fn n_elements(&self) -> usize {
        self.elements.n_live()
    }

    /// Number of vertices; displacements have `D` times as many entries.
    pub fn n_vertices(&self) -> usize {
        self.stars.n_vertices()
    }

    /// The stiffness matrix, N/m. Rows of a nonlinear body are empty until it is first linearised.
    pub fn stiffness(&self) -> &BlockCsr<D> {
        &self.stiffness
    }

    /// How many element stiffnesses linearisations have evaluated so far (a linear body: none).
    pub fn elements_linearized(&self) -> u64 {
        self.elements_linearized
    }

    /// [`set_team`](Self::set_team) with a team of its own, of this many threads.
    pub fn set_threads(&mut self, threads: usize) {
        if self.team.size() != threads.clamp(1, Team::MAX_MEMBERS) {
            self.set_team(&Team::new(threads));
        }
    }

    /// Forces and linearisations are shared by this team from now on, best the one that solves too; the bits do not depend
    /// on it. Small bodies stay on the calling thread.
    pub fn set_team(&mut self, team: &Team) {
        self.team = team.clone();
    }

    /// How many element stiffnesses the last linearisation evaluated.
    pub fn elements_updated(&self) -> usize {
        self.elements_updated
    }

    /// The number of the last write to each row of the stiffness: rows whose number a follower knows have not changed.
    pub fn row_revisions(&self) -> &[u64] {
        &self.row_revisions
    }

    /// [`set_lazy_rule`](Self::set_lazy_rule) with [`LazyRule::Strain`]; a threshold that is negative or NaN counts as
    /// zero, and zero re-evaluates all.
    pub fn set_lazy(&mut self, threshold: f64) {
        self.set_lazy_rule(if threshold > 0.0 { LazyRule::Strain(threshold) } else { LazyRule::Always });
    }

    /// Which part sums the rows of each vertex, as METIS or another partitioner has it; without one, vertices are cut by
    /// their numbers into as many parts as there are threads. The bits do not depend on it. A vertex that is born later
    /// belongs to the part of the first one that it stems from.
    ///
    /// # Errors
    /// [`BodyError::Partition`].
    pub fn set_partition(&mut self, parts: &[u32]) -> Result<(), BodyError> {
        let largest = parts.iter().copied().max().unwrap_or(0);
        let (expected, found) = (self.n_vertices(), parts.len());
        if found != expected || largest > u16::MAX.into() {
            return Err(BodyError::Partition { expected, found, largest });
        }
        self.parts.give(Some(parts.iter().map(|&part| part as u16).collect()));
        Ok(())
    }

    /// Forgets the parts of [`set_partition`](Self::set_partition).
    pub fn clear_partition(&mut self) {
        self.parts.give(None);
    }

    /// The threads that are worth waking for a pass over all elements.
    fn team_worth(&self) -> Team {
        if self.elements.n_slots() < CROSSOVER_ELEMENTS { Team::serial() } else { self.team.clone() }
    }

    /// Bytes that elements, matrix and mass take, spare room included.
    pub fn memory_bytes(&self) -> usize {
        let matrix = self.stiffness.capacity() * (size_of::<[[f64; D]; D]>() + size_of::<u32>());
        let rows = self.n_vertices() * (3 * size_of::<u32>() + size_of::<u64>());
        matrix
            + rows
            + self.elements.memory_bytes()
            + self.stars.memory_bytes()
            + self.parts.memory_bytes()
            + self.damper.as_ref().map_or(0, |damper| damper.memory_bytes())
            + self.mass.as_ref().map_or(0, Mass::memory_bytes)
            + size_of::<u64>() * self.row_revisions.capacity()
            + size_of::<[[u16; N]; N]>() * self.places.capacity()
            + size_of::<[[Lane; D]; D]>() * self.references.capacity()
            + size_of::<Stored<D>>() * self.stored.capacity()
            + size_of::<Turn<D>>() * self.turns.capacity()
    }

    /// Whether linearisations replace the tangent of each element by the nearest positive semidefinite one, so that
    /// Newton directions descend wherever they start.
    pub fn set_projection(&mut self, project: bool) {
        if self.project != project {
            self.project = project;
            if self.assembled && !M::IS_LINEAR {
                self.reevaluate();
            }
        }
    }

    /// Whether linearisations project the tangent.
    pub fn is_projected(&self) -> bool {
        self.project
    }

    /// `det F` of a cell at the displacement `u` (m); `None` if it has no element.
    ///
    /// # Panics
    /// If `u` does not have `D` entries per vertex.
    pub fn jacobian(&self, cell: CellId, u: &[f64]) -> Option<f64> {
        Some(determinant(&self.deformation_gradient(cell, u)?))
    }

    /// Deformation gradient of a cell at the displacement `u` (m); `None` if it has no element.
    ///
    /// # Panics
    /// If `u` is shorter than `D` entries per vertex.
    pub fn deformation_gradient(&self, cell: CellId, u: &[f64]) -> Option<SMatrix<f64, D, D>> {
        self.elements.slot(cell).map(|slot| self.elements.element(slot).deformation_gradient(u))
    }

    /// First Piola-Kirchhoff stress of a cell at the displacement `u`, Pa; `None` if it has no element.
    ///
    /// # Panics
    /// If `u` is shorter than `D` entries per vertex.
    pub fn stress(&self, cell: CellId, u: &[f64]) -> Option<SMatrix<f64, D, D>> {
        let f = self.deformation_gradient(cell, u)?;
        self.material_of(cell).map(|material| material.first_piola_kirchhoff(&f))
    }

    /// The live cell with the smallest `det F` at the displacement `u`, and that value; `None` for a body without cells.
    /// A value that is NaN counts as smallest.
    ///
    /// # Panics
    /// If `u` is shorter than `D` entries per vertex.
    pub fn smallest_jacobian(&self, u: &[f64]) -> Option<(CellId, f64)> {
        let jacobian = |slot: usize| determinant(&self.elements.element(slot).deformation_gradient(u));
        let key = |j: f64| if j.is_nan() { f64::NEG_INFINITY } else { j };
        let all = self.elements.live().map(|(cell, slot)| (cell, jacobian(slot)));
        all.min_by(|a, b| key(a.1).total_cmp(&key(b.1)))
    }

    /// The first cell that the displacement `u` turns inside out or flattens, `det F > 0` failing.
    ///
    /// # Panics
    /// If `u` is shorter than `D` entries per vertex.
    pub fn inverted(&self, u: &[f64]) -> Option<CellId> {
        let positive = |slot: usize| determinant(&self.elements.element(slot).deformation_gradient(u)) > 0.0;
        self.elements.live().find(|&(_, slot)| !positive(slot)).map(|(cell, _)| cell)
    }
}
