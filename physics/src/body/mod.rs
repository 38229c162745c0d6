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
mod element;
mod energy;
mod injectivity;
mod kernel;
mod load;
mod loaded;
mod star;

pub use load::{LoadError, boundary_traction, segment_load};
pub use loaded::Loaded;

use crate::lanes::{LANES, Lane};
use crate::material::Hyperelastic;
use crate::small::determinant;
use element::{Element, ElementTable};
use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};
use star::{Corner, Stars};
use stylet_mesh::{CellId, MeshChange, SimplexMesh};
use stylet_solver::Block;
use stylet_solver::sparse::{BlockCsr, SparseError};

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
    material: M,
    thickness: f64,
    elements: ElementTable<D, N>,
    stars: Stars<N>,
    stiffness: BlockCsr<D>,
    /// Element stiffnesses by slot, upper triangles, and where they were evaluated; nonlinear bodies once linearised.
    blocks: Vec<Block<D>>,
    references: Vec<SMatrix<f64, D, D>>,
    assembled: bool,
    lazy_threshold: f64,
    project: bool,
    threads: usize,
    elements_linearized: u64,
    /// Element forces on their way to the vertices.
    forces: Vec<[[Lane; D]; N]>,
    scratch: assembly::RowScratch<D>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Body<D, N, M> {
    const VALID: () = assert!(1 <= D && D <= 3 && N == D + 1, "a body fills space: N = D + 1, in 1 to 3 dimensions");

    /// The body of the live cells of `mesh`. `thickness` (m) multiplies every volume; it is 1 in 3D.
    ///
    /// # Errors
    /// [`BodyError::Thickness`], [`BodyError::DegenerateCell`], [`BodyError::Matrix`].
    pub fn new(mesh: &SimplexMesh<D, N>, material: M, thickness: f64) -> Result<Self, BodyError> {
        let () = Self::VALID;
        if !(thickness > 0.0 && thickness.is_finite()) {
            return Err(BodyError::Thickness { thickness });
        }
        let mut body = Self {
            material,
            thickness,
            elements: ElementTable::default(),
            stars: Stars::default(),
            stiffness: BlockCsr::new(0),
            blocks: Vec::new(),
            references: Vec::new(),
            assembled: false,
            lazy_threshold: 0.0,
            project: false,
            threads: 1,
            elements_linearized: 0,
            forces: Vec::new(),
            scratch: assembly::RowScratch::default(),
        };
        let mut by_vertex: Vec<Vec<Corner>> = vec![Vec::new(); mesh.n_vertex_slots()];
        for cell in mesh.cells() {
            let element = body.element_of(mesh, cell)?;
            let slot = body.elements.insert(cell, &element);
            for a in 0..N {
                by_vertex[element.vertices[a] as usize].push(Corner::new::<D, N>(slot, a));
            }
        }
        body.check_indices()?;
        body.stars.resize(mesh.n_vertex_slots());
        for (vertex, corners) in by_vertex.iter().enumerate() {
            body.stars.set(vertex, corners);
        }
        body.stiffness.resize(mesh.n_vertex_slots())?;
        body.forces.resize(body.elements.groups.len(), [[[0.0; LANES]; D]; N]);
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
    /// [`BodyError::ChangeMismatch`] or [`BodyError::DegenerateCell`], the body being unchanged; [`BodyError::Matrix`].
    pub fn apply_change(&mut self, mesh: &SimplexMesh<D, N>, change: &MeshChange) -> Result<(), BodyError> {
        let born = self.check_change(mesh, change)?;
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
                let cell = self.elements.cell(corner.slot::<D, N>());
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
                corners.push((element.vertices[a], cell.0, Corner::new::<D, N>(slot, a)));
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
        self.forces.resize(self.elements.groups.len(), [[[0.0; LANES]; D]; N]);
        if self.assembled {
            self.patch_rows(&touched, &slots)?;
        }
        Ok(())
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
        let element = Element::of_cell(mesh, cell, self.thickness)?;
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

    /// The material.
    pub fn material(&self) -> &M {
        &self.material
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

    /// Number of threads for forces and linearisations; the bits do not depend on it. Small bodies stay on one.
    pub fn set_threads(&mut self, threads: usize) {
        self.threads = threads.max(1);
    }

    /// From now on a linearisation re-evaluates only the elements with `|F - F0| > threshold |F0|` (Frobenius norms),
    /// where `F0` is the deformation gradient at which the element was last evaluated. Zero re-evaluates all.
    ///
    /// Energy and gradient stay exact, so an equilibrium is the same: only the search directions change. The relative
    /// error of an element's stiffness is about `threshold` times `|d2P/dF2| |F| / |dP/dF|`, of order one for moderate
    /// strains and growing as `1/J` where an element is crushed. The outcome depends on the sequence of linearisations;
    /// [`linearization`](Self::linearization) is the state to keep for a resumed run.
    ///
    /// A threshold that is negative or NaN counts as zero.
    pub fn set_lazy(&mut self, threshold: f64) {
        self.lazy_threshold = if threshold > 0.0 { threshold } else { 0.0 };
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
        self.deformation_gradient(cell, u).map(|f| self.material.first_piola_kirchhoff(&f))
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
