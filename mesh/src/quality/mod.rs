//! How well shaped cells are.
//!
//! [`CellQuality`] measures one simplex, [`summary`] the worst of a mesh, [`report`] says how each [`Measure`] is spread
//! over it and which cells are worst, [`shapes`] counts the similarity classes.
//!
//! ```
//! use stylet_mesh::{generate::kuhn_box, quality::{self, Measure}};
//!
//! let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [4; 3])?;
//! let report = quality::report(&mesh);
//! let angles = report.measure(Measure::Angle).unwrap();
//! assert_eq!(angles.count, 6 * mesh.n_cells());
//! assert!((angles.min - 45.0).abs() < 1e-9 && (angles.max - 90.0).abs() < 1e-9);
//! // In 5 degree bins: half of the angles are right ones.
//! assert_eq!(angles.histogram.counts[18], angles.count / 2);
//! # Ok::<(), stylet_mesh::MeshError>(())
//! ```

mod cell;
mod histogram;
mod measure;
mod report;
mod shape;

pub use cell::{CellQuality, angles_deg, each_angle_deg, normalized_volume};
pub use histogram::Histogram;
pub use measure::{Measure, Side};
pub use report::{Beyond, MeasureReport, Percentiles, QualityReport, Worst, report, report_at, report_of};
pub use shape::shapes;

use crate::{SimplexMesh, VertexId};
use serde::{Deserialize, Serialize};

/// The extremes of a mesh.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct Quality {
    /// Smallest angle of all cells, degrees: dihedral in 3D, at the vertices in 2D.
    pub min_angle_deg: f64,
    /// Largest angle of all cells, degrees.
    pub max_angle_deg: f64,
    /// Smallest [`normalized_volume`]: 1 for regular simplices, 0 for a flat one, negative for an inverted one.
    pub min_quality: f64,
}

/// The extremes of the live cells at rest.
pub fn summary<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Quality {
    summary_at(mesh, |v| mesh.point(v))
}

/// The extremes of the live cells with every vertex at `position(v)`, for instance displaced.
///
/// A flat cell counts with angles 0 and 180 degrees, one with a position that is not finite with quality NaN.
pub fn summary_at<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    position: impl Fn(VertexId) -> [f64; D],
) -> Quality {
    let mut worst = Quality { min_angle_deg: 180.0, max_angle_deg: 0.0, min_quality: f64::INFINITY };
    for cell in mesh.cells() {
        let corners = mesh.oriented(cell).map(&position);
        let (min, max) = angles_deg(&corners);
        worst.min_angle_deg = worst.min_angle_deg.min(min);
        worst.max_angle_deg = worst.max_angle_deg.max(max);
        let quality = normalized_volume(&corners);
        if quality.is_nan() || quality < worst.min_quality {
            worst.min_quality = quality;
        }
    }
    worst
}
