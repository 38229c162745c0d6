//! A run of needles in tissue that is left, and gone on with.

use super::{Insertion, InsertionError, Interaction, Needle};
use crate::body::Body;
use crate::coupling::{CoupledSettings, Past};
use crate::dynamics::State;
use crate::material::Hyperelastic;
use serde::{Deserialize, Serialize};
use stylet_mesh::SimplexMesh;
use stylet_mesh::remesh::Remesher;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;

/// All that changes while needles move: the mesh with its needles, what is held, the motion of the tissue, the needles.
/// Materials, settings and the interaction are the caller's.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct InsertionState {
    pub(super) mesh: SimplexMesh<3, 4>,
    pub(super) remesher: Remesher<3, 4>,
    pub(super) subspace: Subspace<3>,
    pub(super) state: State,
    pub(super) needles: Vec<Needle>,
    /// What the next solution starts from.
    pub(super) past: Past,
}

impl InsertionState {
    /// The mesh, which the body to go on with is made on.
    #[must_use]
    pub fn mesh(&self) -> &SimplexMesh<3, 4> {
        &self.mesh
    }
}

impl<M: Hyperelastic<3>> Insertion<M> {
    /// The extreme dihedral angles, degrees, of all cells that needles have changed; `(180, 0)` if there is none.
    pub fn remeshed_angles_deg(&mut self) -> (f64, f64) {
        self.remesher.angles_deg(&self.mesh)
    }

    /// What [`resume`](Self::resume) needs.
    #[must_use]
    pub fn save(&self) -> InsertionState {
        InsertionState {
            mesh: self.mesh.clone(),
            remesher: self.remesher.clone(),
            subspace: self.subspace.clone(),
            state: State { linearization: self.body.linearization(), ..self.state.clone() },
            needles: self.needles.clone(),
            past: self.integrator.past().clone(),
        }
    }

    /// Goes on from a saved state, with the same bits as the run that was saved: `body` is that of
    /// [`InsertionState::mesh`] with the materials, the mass and the rules of the first run, settings and interaction are
    /// those of the first run.
    ///
    /// # Errors
    /// [`InsertionError::Dynamics`] if the body has no mass, or the state is that of another body.
    pub fn resume(
        saved: InsertionState,
        body: Body<3, 4, M>,
        settings: CoupledSettings,
        interaction: impl Interaction + 'static,
        gravity: [f64; 3],
        team: &Team,
    ) -> Result<Self, InsertionError> {
        let mut this = Self::of_parts(saved, body, settings, interaction, gravity, team)?;
        // The body that was left may have kept rows of vertices that were gone.
        let n = this.body.n_vertices();
        let State { u, v, a, .. } = &mut this.state;
        for field in [u, v, a].into_iter().chain(this.integrator.past_mut()) {
            field.truncate(3 * n);
        }
        this.subspace.resize(n);
        this.integrator.tissue().resume(&mut this.body, &this.subspace, &this.state)?;
        Ok(this)
    }
}
