//! Remeshing along needles: the mesh gets a node at the tip and edges along the shaft, and back its old topology when
//! the needle is withdrawn.
//!
//! ```text
//!   penetrating                    o new node at the tip: a vertex of the mesh that is snapped there, or one that splits
//!   skin                          /       an edge, a face or a cell
//!   ----o entry                  o u1, the old tip: moved to the best place on the segment from the new node to u2,
//!        \                      /         or removed from needle and mesh by undoing the split that made it
//!         o--- ... ----o------ o u2
//! ```
//!
//! Every step chooses, among all [candidate operations](Operations), the one that leaves the best cells: the sorted
//! qualities of what it changes are the greatest in lexicographic order. Splits go onto a stack, from which they are
//! undone last in first out, so that the old topology is there again once the needle is out. Vertices that were moved
//! are remembered with their first position, and return there when the last node of their needle is released. All
//! positions are material (rest) coordinates.
//!
//! What was added to the paper, with what it was found to do in boxes of 13,182 tetrahedra (angles after step 20, steps
//! of 0.2 mean edges):
//! - After each operation, vertices near the tip are improved ([`Settings`]): free ones anywhere, those of the boundary
//!   within flat patches and along straight creases, nodes between the entry and the tip along the needle. With the
//!   paper's operations alone, flat cells stay behind beside the shaft: 5.4 to 166.3 degrees on 200 straight and curved
//!   paths, 3.9 to 171.8 on 100 random ones; with it, 14.8 to 149.7 on 400 and 9.7 to 158.5 on 200. What is improved is a
//!   smooth sum over all cells around a vertex; with the least quality in its place, which two cells that are equally
//!   bad hold fast, it was 10.2 to 157.6 and 8.7 to 157.6. A node that a retracting needle leaves is put there too.
//! - What moves a vertex must leave the cells around it that splits have covered fit to come back. Without that, a
//!   needle may get stuck on its way out, because no split can be undone.
//! - Where the best candidate has a cell of quality below 0.15, candidates are tried that take two nodes from the needle,
//!   or, penetrating, one that was snapped.
//! - When the node beside the tip is optimised on its segment, staying where it is remains a choice.
//!
//! **Borders of regions** are no boundaries: each cell keeps its region, and where an operation or an improvement moves a
//! vertex between regions, their border bends with it until the needle is withdrawn. The outer boundary keeps its shape.
//!
//! **With bisection.** It works on any mesh, bisected or not. A cell that a needle holds (it was split, made by a split,
//! or has a moved vertex) is not bisected: [`BisectError::Remeshed`](crate::BisectError::Remeshed). All others are, and
//! coarsened, while the needle is in.
//!
//! Source: Chentanez, Alterovitz, Ritchie, Cho, Hauser, Goldberg, Shewchuk & O'Brien, *Interactive simulation of surgical
//! needle insertion and steering*, ACM Trans. Graph. 28 (2009), section 3.4 and Algorithm 2. There snaps are not undone.

mod advance;
mod candidate;
pub(crate) mod cavity;
mod commit;
mod cycle;
mod descent;
mod error;
mod evaluate;
mod freedom;
mod measure;
mod needle;
pub mod paths;
mod record;
mod search;
mod smooth;
mod state;
mod walk;

pub use cycle::{CycleReport, CycleSettings, CycleStep, drive};
pub use error::RemeshError;

use crate::{CellId, MAX_PARENTS, SimplexMesh, VertexId};
use needle::Needle;
use record::Record;
use search::Search;
use serde::{Deserialize, Serialize};

/// A needle of a [`Remesher`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
pub struct NeedleId(pub u32);

/// Which way the tip moves: DYNAMIC+ and DYNAMIC- in the paper.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Motion {
    /// Forwards: the needle gets longer.
    Penetrating,
    /// Backwards: it gets shorter.
    Retracting,
}

/// Counts of what was done.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub struct Operations {
    /// Number of operations on faces of `k + 1` vertices: vertices snapped, edges, triangles, tetrahedra split.
    pub on_faces: [u32; MAX_PARENTS],
    /// Splits that were undone.
    pub undone: u32,
}

impl Operations {
    /// Adds other counts to these.
    pub fn add(&mut self, other: &Self) {
        (0..MAX_PARENTS).for_each(|k| self.on_faces[k] += other.on_faces[k]);
        self.undone += other.undone;
    }
}

/// Where a step left a needle.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum Outcome {
    /// Outside the mesh, without nodes.
    Outside,
    /// In the mesh, with its last node at the tip.
    Inside,
    /// The tip is outside, beyond the last node, where the needle left the mesh.
    Beyond,
}

/// What a step did.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct StepReport {
    /// Where the needle is.
    pub outcome: Outcome,
    /// Parts that the step was divided into.
    pub substeps: u32,
    /// The operations.
    pub operations: Operations,
    /// Smallest angle, degrees, of the cells that the last substep made or changed; 180 if there is none.
    pub min_angle_deg: f64,
    /// Largest angle; 0 if there is none.
    pub max_angle_deg: f64,
}

impl StepReport {
    fn new() -> Self {
        Self {
            outcome: Outcome::Outside,
            substeps: 0,
            operations: Operations::default(),
            min_angle_deg: 180.0,
            max_angle_deg: 0.0,
        }
    }
}

/// What is done beyond the operations of the paper.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Settings {
    /// After each operation, so many vertices near the tip are tried to be improved, twice; 0 for the paper's method.
    pub smoothed_vertices: u32,
    /// A cell of this [quality](crate::quality::normalized_volume) is good enough.
    pub good_quality: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { smoothed_vertices: 8, good_quality: 0.5 }
    }
}

/// Needles in a mesh.
///
/// Belongs to one mesh, which is given to each call; between calls the mesh may be bisected and coarsened. Serialised
/// with all that it needs to go on in a mesh read back.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(try_from = "state::RemesherState", into = "state::RemesherState")]
pub struct Remesher<const D: usize, const N: usize> {
    needles: Vec<Needle<D, N>>,
    settings: Settings,
    search: Search<D, N>,
    record: Record<N>,
    /// Working memory: cells around changes, the worst of them by quality, vertices that were tried.
    around: Vec<u32>,
    worst: Vec<(f64, u32)>,
    tried: Vec<u32>,
}

impl<const D: usize, const N: usize> Remesher<D, N> {
    const VALID: () = assert!(N == D + 1 && N <= MAX_PARENTS, "a needle pierces cells that fill space");

    /// No needles.
    pub fn new() -> Self {
        Self::with_settings(Settings::default())
    }

    /// No needles, and what is to be done beyond the paper.
    pub fn with_settings(settings: Settings) -> Self {
        let () = Self::VALID;
        Self { settings, ..Self::default() }
    }

    /// Adds a needle whose tip is outside the mesh, or on its boundary.
    ///
    /// # Errors
    /// [`RemeshError::Tip`], or [`RemeshError::StartsInside`].
    pub fn add_needle(&mut self, mesh: &SimplexMesh<D, N>, tip: [f64; D]) -> Result<NeedleId, RemeshError> {
        check_tip(&tip)?;
        if let Some(cell) = walk::strictly_inside(mesh, &tip) {
            return Err(RemeshError::StartsInside { cell });
        }
        self.needles.push(Needle::new(tip));
        Ok(NeedleId(self.needles.len() as u32 - 1))
    }

    /// Puts the tip of a needle without nodes elsewhere outside the mesh, not along a path: a needle in flight is not followed.
    ///
    /// # Errors
    /// [`RemeshError::UnknownNeedle`], [`RemeshError::Tip`], [`RemeshError::StartsInside`].
    ///
    /// # Panics
    /// If the needle is in the mesh.
    pub fn place_outside(
        &mut self,
        mesh: &SimplexMesh<D, N>,
        needle: NeedleId,
        tip: [f64; D],
    ) -> Result<(), RemeshError> {
        check_tip(&tip)?;
        let k = self.check_needle(mesh, needle)?;
        assert!(self.needles[k].nodes.is_empty(), "a needle in the mesh is advanced");
        if let Some(cell) = walk::strictly_inside(mesh, &tip) {
            return Err(RemeshError::StartsInside { cell });
        }
        self.needles[k].tip = tip;
        Ok(())
    }

    /// The nodes of a needle from the entry to the tip; empty while it is outside, and for a needle that does not exist.
    pub fn nodes(&self, needle: NeedleId) -> impl ExactSizeIterator<Item = VertexId> + '_ {
        let nodes = self.needles.get(needle.0 as usize).map_or(&[][..], |needle| &needle.nodes);
        nodes.iter().map(|&v| VertexId(v))
    }

    /// Where the tip of a needle is; `None` for a needle that does not exist.
    pub fn tip(&self, needle: NeedleId) -> Option<[f64; D]> {
        self.needles.get(needle.0 as usize).map(|needle| needle.tip)
    }

    /// Number of splits on the stack of a needle, and of vertices that it moved.
    pub fn depth(&self, needle: NeedleId) -> (usize, usize) {
        self.needles.get(needle.0 as usize).map_or((0, 0), |needle| (needle.splits.len(), needle.journal.len()))
    }

    /// The extreme angles, degrees, of all cells that differ from those of the mesh without needles: `(180, 0)` if there
    /// is none.
    pub fn angles_deg(&mut self, mesh: &SimplexMesh<D, N>) -> (f64, f64) {
        let mut cells: Vec<u32> = mesh.overlay_cells().collect();
        for needle in &self.needles {
            for &(v, _) in &needle.journal {
                self.search.walk_stars(mesh, mesh.vertex_leaf[v as usize], &[v]);
                cells.extend_from_slice(self.search.found());
            }
        }
        cells.sort_unstable();
        cells.dedup();
        measure::extreme_angles_deg(cells.iter().map(|&c| mesh.corners(CellId(c))))
    }
}

fn check_tip<const D: usize>(tip: &[f64; D]) -> Result<(), RemeshError> {
    let limit = crate::start::coordinate_limit::<D>();
    match tip.iter().enumerate().find(|(_, x)| x.is_nan() || x.abs() > limit) {
        None => Ok(()),
        Some((axis, &value)) => Err(RemeshError::Tip { axis, value, limit }),
    }
}
