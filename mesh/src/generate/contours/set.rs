//! The door: drawings come in, checked organs come out.

use super::{
    fault::{ContourError, Fault, Repair},
    inspect::inspect,
    organ::{Organ, Slice},
    solid::ContourSolid,
};
use crate::generate::implicit::{Implicit, Strata};
use std::collections::BTreeSet;

/// Slices closer than this (m) would make slopes that overflow.
const FLATTEST: f64 = 1e-9;

/// A contour as it was drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanarContour {
    /// Its points in order, m, all in one plane `z = const`. The first may be repeated as the last.
    pub points: Vec<[f64; 3]>,
    /// Whether its source says that it is not closed.
    pub open: bool,
}

impl PlanarContour {
    /// A closed contour.
    pub fn closed(points: Vec<[f64; 3]>) -> Self {
        Self { points, open: false }
    }
}

/// The contours of one organ as they were drawn, in any order of slices.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    /// The organ's name.
    pub name: String,
    /// Its contours.
    pub contours: Vec<PlanarContour>,
}

/// What is taken for a slip of the hand. Lengths are metres.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourSettings {
    /// Points this close to the one before are the same click.
    pub duplicate: f64,
    /// Points closer than this to their neighbour are culled; 0 keeps all. Goksel (2004) takes the slice distance, 5 mm.
    pub cull: f64,
    /// Contours this close along z are on one slice, and contours that vary by less are plane.
    pub plane: f64,
    /// How far apart the slices of an organ with only one would be; `None` refuses it.
    pub thickness: Option<f64>,
}

impl Default for ContourSettings {
    /// Hundredths of a millimetre are slips; nothing is culled; one slice is refused.
    fn default() -> Self {
        Self { duplicate: 1e-5, cull: 0.0, plane: 1e-5, thickness: None }
    }
}

impl ContourSettings {
    fn check(&self) -> Result<(), Fault> {
        let least = [("duplicate", self.duplicate, 0.0), ("cull", self.cull, 0.0), ("plane", self.plane, FLATTEST)];
        for (name, value, least) in least {
            if !value.is_finite() || value < least {
                return Err(Fault::Setting { name, value, expected: "a length, 0 or more (for plane 1e-9 m or more)" });
            }
        }
        match self.thickness {
            Some(value) if !value.is_finite() || value < FLATTEST => {
                Err(Fault::Setting { name: "thickness", value, expected: "a length, 1e-9 m or more" })
            }
            _ => Ok(()),
        }
    }
}

/// Organs by their contours, in order of precedence: where two overlap, the place belongs to the first.
#[derive(Clone, Debug, PartialEq)]
pub struct ContourSet {
    organs: Vec<Organ>,
}

impl ContourSet {
    /// Checks drawings, first in precedence first, and tells what was repaired.
    ///
    /// # Errors
    /// [`ContourError`] with every fault of every organ.
    pub fn new(drawings: &[Drawing], settings: &ContourSettings) -> Result<(Self, Vec<Repair>), ContourError> {
        settings.check()?;
        if drawings.is_empty() {
            return Err(Fault::NoOrgans.into());
        }
        let (mut organs, mut repairs, mut faults) = (Vec::new(), Vec::new(), Vec::new());
        let mut names = BTreeSet::new();
        for drawing in drawings {
            if !names.insert(&drawing.name) {
                faults.push(Fault::RepeatedOrgan { organ: drawing.name.clone() });
                continue;
            }
            match inspect(drawing, settings, &mut repairs) {
                Ok(organ) => organs.push(organ),
                Err(found) => faults.extend(found),
            }
        }
        if faults.is_empty() { Ok((Self { organs }, repairs)) } else { Err(ContourError { faults }) }
    }

    /// The organs, first in precedence first.
    pub fn organs(&self) -> &[Organ] {
        &self.organs
    }

    /// The organ of this name.
    pub fn organ(&self, name: &str) -> Option<&Organ> {
        self.organs.iter().find(|organ| organ.name() == name)
    }

    /// The volume of each organ without what belongs to those before it, by [`Organ::volume`]'s rule, m3. How much of a slice
    /// others hold is counted on a grid: good to some tenths of a percent of the organ.
    pub fn region_volumes(&self) -> Vec<f64> {
        let solids = self.solids();
        let left = |(i, organ): (usize, &Organ)| {
            let slices = organ.slices().iter().zip(organ.thicknesses());
            slices.map(|(slice, t)| t * slice.area() * (1.0 - covered(slice, &solids[i], &solids[..i]))).sum()
        };
        self.organs.iter().enumerate().map(left).collect()
    }

    /// The organs as solids, in the same order.
    pub fn solids(&self) -> Vec<ContourSolid> {
        self.organs.iter().map(ContourSolid::new).collect()
    }

    /// The solids as one body of regions: region `i` is organ `i` without those before it.
    pub fn strata(&self) -> Strata {
        Strata::new(self.solids().into_iter().map(|solid| Box::new(solid) as _).collect())
    }
}

/// The part of a slice of `own` that is inside any of the others.
fn covered(slice: &Slice, own: &ContourSolid, others: &[ContourSolid]) -> f64 {
    const SAMPLES: usize = 128;
    let [low, high] = slice.outline();
    let step: [f64; 2] = std::array::from_fn(|k| (high[k] - low[k]) / SAMPLES as f64);
    let (mut inside, mut taken) = (0_u32, 0_u32);
    for i in 0..SAMPLES * SAMPLES {
        let at = [i % SAMPLES, i / SAMPLES].map(|n| n as f64 + 0.5);
        let p = [low[0] + at[0] * step[0], low[1] + at[1] * step[1], slice.z];
        if own.distance(&p) < 0.0 {
            inside += 1;
            taken += u32::from(others.iter().any(|other| other.distance(&p) < 0.0));
        }
    }
    if inside == 0 { 0.0 } else { f64::from(taken) / f64::from(inside) }
}
