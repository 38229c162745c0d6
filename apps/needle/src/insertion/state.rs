//! Saving an insertion and going on from what was saved, with the same bits.

use super::{Clock, Insertion, Scratch};
use crate::needle::Needle;
use crate::scene::{FrictionStage, NeedleStage, Scene};
use crate::shaft::{Hold, Shaft};
use crate::slab::{Slab, SlabState};
use crate::tip::Tip;
use serde::{Deserialize, Serialize};
use stylet_mesh::VertexId;
use stylet_physics::material::Hyperelastic;

/// An insertion as a state file holds it: everything that the scene does not say.
#[derive(Clone, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct InsertionState<const D: usize, const N: usize> {
    slab: SlabState<D, N>,
    needle: Needle<D>,
    shaft: Shaft<D>,
    tip: Tip<D, N>,
    clock: Clock,
    held_by: Hold<D>,
    turned: Vec<VertexId>,
}

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Insertion<D, N, M> {
    /// All that a later run needs to go on with the same bits.
    pub fn save(&self) -> InsertionState<D, N> {
        InsertionState {
            slab: self.slab.save(),
            needle: self.needle,
            shaft: self.shaft.clone(),
            tip: self.tip,
            clock: self.clock,
            held_by: self.held_by,
            turned: self.scratch.turned.clone(),
        }
    }

    /// The insertion of a saved state.
    ///
    /// # Errors
    /// What does not fit together in the state.
    pub fn restore(
        scene: &Scene,
        stage: &NeedleStage,
        friction: &FrictionStage,
        material: M,
        threads: usize,
        state: InsertionState<D, N>,
    ) -> Result<Self, String> {
        let slab = Slab::restore(scene, material, threads, state.slab)?;
        let n = slab.mesh.n_vertex_slots();
        let on_mesh = |vertex: &VertexId| vertex.index() < n;
        let nodes = state.shaft.nodes.iter().map(|node| &node.vertex);
        if !nodes.chain(&state.shaft.ahead).chain(&state.shaft.let_go).chain(&state.turned).all(on_mesh) {
            return Err(format!("found needle nodes beyond its {n} nodes"));
        }
        if matches!(state.tip, Tip::Inside(inside) if inside.cell.index() >= slab.mesh.n_slots()) {
            return Err("found the tip in a cell that does not exist".to_owned());
        }
        let fresh = Self::new(scene, stage, friction, slab).map_err(|e| e.to_string())?;
        let scratch = Scratch { turned: state.turned, ..Scratch::default() };
        let InsertionState { needle, shaft, tip, clock, held_by, .. } = state;
        Ok(Self { needle, shaft, tip, clock, held_by, scratch, ..fresh })
    }
}
