//! A rod in a file.

use super::{Rod, RodError, RodStiffness};
use serde::{Deserialize, Serialize};

/// What a rod is made of, not yet checked.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stored {
    stiffness: RodStiffness,
    linear_density: f64,
    rest_lengths: Vec<f64>,
    angles: Vec<f64>,
    rest_curvatures: Vec<[f64; 2]>,
}

impl From<Rod> for Stored {
    fn from(rod: Rod) -> Self {
        let Rod { stiffness, linear_density, rest_lengths, angles, rest_curvatures, .. } = rod;
        Self { stiffness, linear_density, rest_lengths, angles, rest_curvatures }
    }
}

impl TryFrom<Stored> for Rod {
    type Error = RodError;

    fn try_from(stored: Stored) -> Result<Self, RodError> {
        let mut rod = Self::new(stored.rest_lengths, stored.stiffness, stored.linear_density)?;
        rod.set_angles(&stored.angles)?;
        rod.set_rest_curvatures(&stored.rest_curvatures)?;
        Ok(rod)
    }
}
