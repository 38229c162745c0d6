//! The slab, or the cube: mesh, body, displacement, load and supports, kept in step with each other through mesh changes.

use crate::equilibrium::{Equilibrium, SolveOutcome, Totals};
use crate::error::NeedleError;
use crate::scene::{Scene, Side};
use crate::stages::{Stage, Stages};
use crate::tip::deformed_corners;
use serde::{Deserialize, Serialize};
use std::time::Instant;
use stylet_mesh::geometry::signed_measure;
use stylet_mesh::{CellId, MeshChange, SimplexMesh, VertexId, generate};
use stylet_physics::body::{Body, BodyError, Linearization};
use stylet_physics::material::Hyperelastic;
use stylet_solver::energy::Energy;
use stylet_solver::subspace::{Constraint, Subspace};

/// A relocated node must leave each cell around it at least this share of its area (Chapter 3 of Nienhuys, 2003, and
/// nodes that all lie on the needle, would otherwise flatten cells).
const LEAST_AREA_KEPT: f64 = 0.2;

/// A square slab in plane stress, or a cube.
#[derive(Clone)]
pub struct Slab<const D: usize, const N: usize, M: Hyperelastic<D>> {
    /// Triangles or tetrahedra.
    pub mesh: SimplexMesh<D, N>,
    /// Elements and stiffness.
    pub body: Body<D, N, M>,
    /// Displacement, m.
    pub u: Vec<f64>,
    /// External nodal forces, N.
    pub load: Vec<f64>,
    /// What each node may do.
    pub subspace: Subspace<D>,
    side: f64,
    clamped: Side,
    solver: Equilibrium<D>,
    change: MeshChange,
    touched: Vec<usize>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Slab<D, N, M> {
    /// The slab of a scene at its starting level, at rest.
    ///
    /// # Errors
    /// [`NeedleError::Mesh`] or [`NeedleError::Solve`] if a layer below refuses what the scene asks for.
    pub fn new(scene: &Scene, material: M, threads: usize, stages: &mut Stages) -> Result<Self, NeedleError> {
        let since = Instant::now();
        let side = scene.mesh.side;
        let mut mesh = generate::kuhn_box([0.0; D], [side; D], [1; D]).map_err(|e| mesh_error(0, e))?;
        if let Some(longest_edge) = scene.mesh.longest_edge_at_start() {
            let mut change = MeshChange::default();
            mesh.refine_everywhere(longest_edge, &mut change).map_err(|e| mesh_error(0, e))?;
        }
        stages.lap(Stage::Mesh, since);
        Self::from_mesh(scene, mesh, material, threads, stages)
    }

    /// A slab with any conforming mesh, at rest. Nodes on the clamped side of the scene's square or cube are fixed.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_mesh(
        scene: &Scene,
        mesh: SimplexMesh<D, N>,
        material: M,
        threads: usize,
        stages: &mut Stages,
    ) -> Result<Self, NeedleError> {
        let since = Instant::now();
        let mut body =
            Body::new(&mesh, material, scene.mesh.thickness()).map_err(|e| solve_error(0, format!("body: {e}")))?;
        body.set_threads(threads);
        let n = mesh.n_vertex_slots();
        let mut slab = Self {
            body,
            u: vec![0.0; D * n],
            load: vec![0.0; D * n],
            subspace: Subspace::new(n),
            side: scene.mesh.side,
            clamped: scene.support.clamped,
            solver: Equilibrium::new(scene, threads),
            change: MeshChange::default(),
            touched: Vec::new(),
            mesh,
        };
        for vertex in 0..n {
            slab.clamp(VertexId::new(vertex));
        }
        stages.lap(Stage::Assemble, since);
        Ok(slab)
    }

    /// Whether a node is held by the support.
    pub fn is_clamped(&self, vertex: VertexId) -> bool {
        let point = self.mesh.point(vertex);
        let (axis, far) = self.clamped.plane(D);
        let distance = if far { self.side - point[axis] } else { point[axis] };
        distance <= 1e-12 * self.side
    }

    fn clamp(&mut self, vertex: VertexId) {
        if self.is_clamped(vertex) {
            self.constrain(vertex, Constraint::Fixed);
        }
    }

    /// Changes what a node may do.
    pub fn constrain(&mut self, vertex: VertexId, constraint: Constraint<D>) {
        // The node exists and a needle's tangent is a unit vector, so there is nothing to refuse.
        let set = self.subspace.set(vertex.index(), constraint);
        debug_assert!(set.is_ok(), "{set:?}");
        self.solver.touch(vertex.index());
    }

    /// Bisects cells, and carries all fields over. Returns whether anything changed.
    ///
    /// # Errors
    /// [`NeedleError::Mesh`].
    pub fn bisect(&mut self, marked: &[CellId], cycle: usize) -> Result<bool, NeedleError> {
        let mut change = std::mem::take(&mut self.change);
        change.clear();
        let result = self.mesh.bisect(marked, &mut change);
        let applied = self.apply_change(&change);
        self.change = change;
        result.map_err(|e| mesh_error(cycle, e))?;
        applied.map_err(|e| mesh_error(cycle, e))?;
        Ok(!self.change.is_empty())
    }

    /// Refines all cells that touch the segment from `a` to `b` of the undeformed slab to a longest edge of `size`.
    ///
    /// # Errors
    /// [`NeedleError::Mesh`].
    pub fn refine_along(&mut self, a: [f64; D], b: [f64; D], size: f64) -> Result<(), NeedleError> {
        let mut change = MeshChange::default();
        let result = self.mesh.refine_along(a, b, size, &mut change);
        let applied = self.apply_change(&change);
        result.map_err(|e| mesh_error(0, e))?;
        applied.map_err(|e| mesh_error(0, e))
    }

    /// The last mesh change.
    pub fn last_change(&self) -> &MeshChange {
        &self.change
    }

    /// Follows a mesh change: fields grow by origins, the body patches its rows, new nodes on the support are fixed.
    fn apply_change(&mut self, change: &MeshChange) -> Result<(), BodyError> {
        if change.is_empty() {
            return Ok(());
        }
        change.carry_field::<D>(&mut self.u);
        self.load.resize(self.u.len(), 0.0);
        self.subspace.resize(self.mesh.n_vertex_slots());
        self.body.apply_change(&self.mesh, change)?;
        for birth in &change.vertices {
            self.clamp(birth.vertex);
        }
        self.touched.clear();
        for &cell in &change.born {
            self.touched.extend(self.mesh.cell(cell).map(VertexId::index));
        }
        self.touched.sort_unstable();
        self.touched.dedup();
        for &node in &self.touched {
            self.solver.touch(node);
        }
        Ok(())
    }

    /// Moves a vertex of the undeformed mesh, with a new displacement, and renews the elements around it. Returns whether
    /// it did: a move that would flatten a cell is not made; nor is one that would flatten a cell of the deformed slab, for a
    /// material that does not bear that.
    ///
    /// # Errors
    /// [`NeedleError::Mesh`].
    pub fn move_vertex(
        &mut self,
        vertex: VertexId,
        rest: [f64; D],
        displacement: [f64; D],
    ) -> Result<bool, NeedleError> {
        let mut star = Vec::new();
        self.mesh.star(vertex, &mut star);
        let place = std::array::from_fn(|k| rest[k] + displacement[k]);
        if M::REQUIRES_POSITIVE_J && !star.iter().all(|&cell| self.keeps_area_in_space(cell, vertex, place)) {
            return Ok(false);
        }
        if self.mesh.move_vertex(vertex, rest, LEAST_AREA_KEPT).is_err() {
            return Ok(false);
        }
        self.u[D * vertex.index()..][..D].copy_from_slice(&displacement);
        let change = MeshChange::moved(star);
        self.apply_change(&change).map_err(|e| mesh_error(0, e))?;
        Ok(true)
    }

    /// Whether a cell of the deformed slab keeps its share of area when its corner `vertex` goes to `place`. Where the
    /// tissue is deformed, a cell with area left in the undeformed slab may be flat or turned over in space.
    fn keeps_area_in_space(&self, cell: CellId, vertex: VertexId, place: [f64; D]) -> bool {
        let before = deformed_corners(&self.mesh, &self.u, cell);
        let mut after = before;
        for (corner, v) in after.iter_mut().zip(self.mesh.cell(cell)) {
            if v == vertex {
                *corner = place;
            }
        }
        // False for a NaN.
        signed_measure(&after) / signed_measure(&before) >= LEAST_AREA_KEPT
    }

    /// Finds the equilibrium for the present constraints and load, from the present displacement.
    ///
    /// # Errors
    /// [`NeedleError::Inverting`] or [`NeedleError::Solve`] name the cycle and, where one blocks, the element.
    pub fn solve(&mut self, cycle: usize, stages: &mut Stages) -> Result<SolveOutcome, NeedleError> {
        let Self { body, u, load, subspace, solver, .. } = self;
        let result = solver.solve(cycle, body, subspace, load, u, stages);
        result.map_err(|reason| self.blame(cycle, reason))
    }

    /// As [`solve`](Self::solve), to a hundredth of the tolerance: near inversion the reactions, against which (6.9) measures
    /// the residual, are so large that a loose tolerance would accept any state.
    ///
    /// # Errors
    /// As [`solve`](Self::solve).
    pub fn solve_tightly(&mut self, cycle: usize, stages: &mut Stages) -> Result<SolveOutcome, NeedleError> {
        let tolerance = self.solver.tighten(0.01);
        let result = self.solve(cycle, stages);
        self.solver.set_tolerance(tolerance);
        result
    }

    /// Names the element that stands in the way of a solve, if one does: one that has left the domain of its material, or
    /// else the one nearest to inversion.
    pub fn blame(&self, cycle: usize, reason: String) -> NeedleError {
        let gradients =
            || self.mesh.cells().filter_map(|cell| Some((cell, self.body.deformation_gradient(cell, &self.u)?)));
        let centre = |cell| {
            let corners = self.mesh.corners(cell);
            (0..D).map(|k| corners.iter().map(|c| c[k]).sum::<f64>() / N as f64).collect()
        };
        let outside = gradients().find(|(_, f)| !self.body.material().energy_density(f).is_finite());
        let worst = self.body.smallest_jacobian(&self.u);
        match (worst, outside) {
            (Some((cell, det_f)), _) if M::REQUIRES_POSITIVE_J && det_f < 0.05 => {
                NeedleError::Inverting { cycle, cell, centre: centre(cell), det_f, reason }
            }
            (_, Some((cell, _))) => NeedleError::OutsideDomain { cycle, cell, centre: centre(cell), reason },
            _ => solve_error(cycle, reason),
        }
    }

    /// The gradient of the strain energy at a node after a solve, N: what holds the node where it is.
    pub fn elastic_force(&self, vertex: VertexId) -> [f64; D] {
        self.solver.elastic_force(&self.load, vertex.index())
    }

    /// Extends a motion of the constrained nodes to the others: those follow elastically, to first order, as if from an
    /// equilibrium.
    ///
    /// # Errors
    /// What the solver says.
    pub fn carry_along(&mut self, way: &mut [f64]) -> Result<(), String> {
        self.body.linearize(&self.u);
        self.solver.carry_along(self.body.stiffness(), &self.subspace, way)
    }

    /// The largest `t` up to `limit` such that no cell is inverted on the way from the present displacement to `t` times
    /// `way`.
    pub fn max_step(&mut self, way: &[f64], limit: f64) -> f64 {
        self.body.max_step(&self.u, way, limit)
    }

    /// The solver.
    pub fn solver(&self) -> &Equilibrium<D> {
        &self.solver
    }

    /// Cells that the deformation has turned over.
    pub fn inverted_elements(&self) -> usize {
        let rest = |cell| signed_measure(&self.mesh.corners(cell));
        let deformed = |cell| signed_measure(&deformed_corners(&self.mesh, &self.u, cell));
        self.mesh.cells().filter(|&cell| deformed(cell) / rest(cell) <= 0.0).count()
    }

    /// Strain energy, J.
    pub fn strain_energy(&self) -> f64 {
        self.body.strain_energy(&self.u)
    }

    /// All that a later run needs to go on with the same bits.
    pub fn save(&self) -> SlabState<D, N> {
        SlabState {
            mesh: self.mesh.clone(),
            u: self.u.clone(),
            load: self.load.clone(),
            subspace: self.subspace.clone(),
            linearization: self.body.linearization(),
            holds_linearization: self.solver.holds_linearization(),
            totals: *self.solver.totals(),
        }
    }

    /// The slab of a saved state.
    ///
    /// # Errors
    /// What does not fit together in the state.
    pub fn restore(scene: &Scene, material: M, threads: usize, state: SlabState<D, N>) -> Result<Self, String> {
        let n = state.mesh.n_vertex_slots();
        if state.u.len() != D * n || state.load.len() != D * n || state.subspace.n_nodes() != n {
            return Err(format!("found fields that do not fit its {n} nodes"));
        }
        state.mesh.check_invariants().map_err(|e| format!("found a broken mesh: {e}"))?;
        let mut body = Body::new(&state.mesh, material, scene.mesh.thickness()).map_err(|e| e.to_string())?;
        body.set_threads(threads);
        body.restore_linearization(&state.linearization).map_err(|e| e.to_string())?;
        let mut solver = Equilibrium::new(scene, threads);
        solver.set_totals(state.totals);
        if state.holds_linearization {
            solver.hold_linearization();
        }
        (0..n).for_each(|node| solver.touch(node));
        Ok(Self {
            mesh: state.mesh,
            body,
            u: state.u,
            load: state.load,
            subspace: state.subspace,
            side: scene.mesh.side,
            clamped: scene.support.clamped,
            solver,
            change: MeshChange::default(),
            touched: Vec::new(),
        })
    }
}

/// A slab as a state file holds it: everything that cannot be derived.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct SlabState<const D: usize, const N: usize> {
    mesh: SimplexMesh<D, N>,
    u: Vec<f64>,
    load: Vec<f64>,
    subspace: Subspace<D>,
    linearization: Linearization,
    holds_linearization: bool,
    totals: Totals,
}

pub(crate) fn mesh_error(cycle: usize, error: impl std::fmt::Display) -> NeedleError {
    NeedleError::Mesh { cycle, reason: error.to_string() }
}

pub(crate) fn solve_error(cycle: usize, reason: String) -> NeedleError {
    NeedleError::Solve { cycle, reason }
}
