//! The serial form of a remesher: its needles. The mesh is written beside it, by itself.

use super::{
    Remesher, Settings,
    needle::{Needle, Split},
};
use crate::node::NONE;
use serde::{Deserialize, Serialize};

/// The form that is written; positions are flat.
#[derive(Serialize, Deserialize)]
pub(super) struct RemesherState {
    dimension: u32,
    settings: Settings,
    needles: Vec<NeedleState>,
}

#[derive(Serialize, Deserialize)]
struct NeedleState {
    tip: Vec<f64>,
    beyond: bool,
    nodes: Vec<u32>,
    /// The vertex of each split, the vertices of the face, the number of cells around it.
    splits: Vec<(u32, Vec<u32>, u32)>,
    slots: Vec<u32>,
    moved: Vec<u32>,
    homes: Vec<f64>,
}

/// Why data are not needles.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum StateError {
    #[error("the needles are in {found} dimensions, expected were {expected}")]
    Dimension { found: u32, expected: usize },
    #[error("needle {needle}: {what}")]
    Needle { needle: usize, what: &'static str },
}

impl<const D: usize, const N: usize> From<Remesher<D, N>> for RemesherState {
    fn from(remesher: Remesher<D, N>) -> Self {
        let needles = remesher.needles.into_iter().map(|needle| NeedleState {
            tip: needle.tip.to_vec(),
            beyond: needle.beyond,
            splits: needle.splits.iter().map(|split| (split.vertex, split.face().to_vec(), split.n_covered)).collect(),
            moved: needle.journal.iter().map(|entry| entry.0).collect(),
            homes: needle.journal.iter().flat_map(|entry| entry.1).collect(),
            nodes: needle.nodes,
            slots: needle.slots,
        });
        Self { dimension: D as u32, needles: needles.collect(), settings: remesher.settings }
    }
}

impl<const D: usize, const N: usize> TryFrom<RemesherState> for Remesher<D, N> {
    type Error = StateError;

    fn try_from(state: RemesherState) -> Result<Self, StateError> {
        if state.dimension as usize != D {
            return Err(StateError::Dimension { found: state.dimension, expected: D });
        }
        let mut remesher = Self::with_settings(state.settings);
        for (k, needle) in state.needles.into_iter().enumerate() {
            let needle = needle.read().map_err(|what| StateError::Needle { needle: k, what })?;
            remesher.needles.push(needle);
        }
        Ok(remesher)
    }
}

impl NeedleState {
    fn read<const D: usize, const N: usize>(self) -> Result<Needle<D, N>, &'static str> {
        let tip = self.tip.try_into().map_err(|_| "the tip has another number of coordinates")?;
        super::check_tip(&tip).map_err(|_| "the tip is not a point")?;
        let (homes, rest) = self.homes.as_chunks::<D>();
        if !rest.is_empty() || homes.len() != self.moved.len() {
            return Err("moved vertices and their positions differ in number");
        }
        if homes.iter().any(|home| super::check_tip(home).is_err()) {
            return Err("a vertex was moved from what is not a point");
        }
        let mut splits = Vec::with_capacity(self.splits.len());
        for (vertex, vertices, n_covered) in self.splits {
            let mut face = [NONE; N];
            if vertices.len() < 2 || vertices.len() > N {
                return Err("a split face has too few or too many vertices");
            }
            face[..vertices.len()].copy_from_slice(&vertices);
            splits.push(Split { vertex, face, len: vertices.len() as u8, n_covered });
        }
        if splits.iter().map(Split::n_slots).try_fold(0_usize, usize::checked_add) != Some(self.slots.len()) {
            return Err("the cells of the splits are not as many as these say");
        }
        if self.nodes.is_empty() && !(splits.is_empty() && homes.is_empty() && !self.beyond) {
            return Err("it has changed the mesh but has no nodes");
        }
        let journal = self.moved.into_iter().zip(homes.iter().copied()).collect();
        Ok(Needle { tip, beyond: self.beyond, nodes: self.nodes, splits, slots: self.slots, journal })
    }
}
