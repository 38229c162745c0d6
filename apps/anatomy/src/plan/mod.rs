//! From organs to a mesh: what is to be meshed and how, the work, and what came of it.
//!
//! ```
//! use stylet_anatomy::plan::{Effort, Plan, built_in};
//!
//! let plan = Plan::of_shapes(&built_in("two-cylinders").unwrap()?);
//! let made = plan.mesh(&Effort::default(), &mut |_| std::ops::ControlFlow::Continue(()))?;
//! assert_eq!(made.regions[0].name, "upper cylinder");
//! let mesh = made.tets.into_mesh()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod built_in;
mod made;
mod run_scene;
#[cfg(test)]
mod tests;
mod volume;

pub use built_in::{BUILT_IN, built_in};
pub use made::{Effort, Made, MadeRegion, PlanError, Stage};

use crate::shapes::{Marker, Material, ShapeScene};
use std::sync::Arc;
use stylet_mesh::generate::contours::{ContourSet, Organ as Contoured};
use stylet_mesh::generate::implicit::{Implicit, Strata};
use stylet_mesh::generate::stuff::{Border, Refinement, Settings, SolidSettings};
use stylet_mesh::geometry::distance2;

/// Cubes of this part of a tube's radius keep its volume within three parts in a hundred: a mesh in a tube is smaller by about
/// 0.11 of the square of their ratio.
const ACROSS: f64 = 0.5;

/// What is to be meshed, and how.
pub struct Plan {
    /// The solids in order of precedence.
    pub strata: Strata,
    /// Lowest and highest corner of the box, m.
    pub domain: [[f64; 3]; 2],
    /// Sizes.
    pub settings: Settings,
    /// What is known of each solid, in the same order.
    pub organs: Vec<Organ>,
    /// What is in no solid, if that is meshed.
    pub background: Option<Material>,
    /// Named points of the body.
    pub markers: Vec<Marker>,
}

/// What is known of a solid besides its shape.
#[derive(Clone, Debug, PartialEq)]
pub struct Organ {
    /// Its name.
    pub name: String,
    /// Whether its nodes are held.
    pub fixed: bool,
    /// What it is made of.
    pub material: Material,
    /// The volume that belongs to it, m³, where its source says it.
    pub volume: Option<f64>,
}

/// How contours are meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContourPlan {
    /// Edge of the lattice's cubes at borders, m.
    pub size: f64,
    /// Edge of the largest cubes, m.
    pub coarsest: f64,
    /// Distance of the box from the organs, m.
    pub margin: f64,
    /// Whether what is in no organ is meshed, up to the faces of the box.
    pub background: bool,
}

impl Plan {
    /// The plan of a scene of shapes.
    pub fn of_shapes(scene: &ShapeScene) -> Self {
        let border = |conforming: bool| if conforming { Border::Conforming } else { Border::ByElement };
        let solid =
            |region: &crate::shapes::Region| SolidSettings { border: border(region.conforming), size: region.size };
        let refinement = |place: &crate::shapes::Refinement| {
            let shape: Box<dyn Implicit> = Box::new(Arc::clone(&place.solid));
            Refinement { shape, size: place.size }
        };
        let organs = scene.regions.iter().map(|region| Organ {
            name: region.name.clone(),
            fixed: region.fixed,
            material: region.material.clone(),
            volume: None,
        });
        let standard = Settings::new(scene.size);
        Self {
            strata: scene.strata(),
            domain: scene.domain,
            settings: Settings {
                coarsest: scene.coarsest.unwrap_or(standard.coarsest),
                background: scene.meshes_background,
                solids: scene.regions.iter().map(solid).collect(),
                refinements: scene.refinements.iter().map(refinement).collect(),
                ..standard
            },
            organs: organs.collect(),
            background: scene.meshes_background.then(|| scene.background.clone()),
            markers: scene.markers.clone(),
        }
    }

    /// The plan of organs drawn on slices, all of whose borders conform.
    ///
    /// # Errors
    /// [`PlanError::NoOrgan`].
    pub fn of_contours(set: &ContourSet, how: &ContourPlan) -> Result<Self, PlanError> {
        let strata = set.strata();
        let [low, high] = bounds(&strata).ok_or(PlanError::NoOrgan)?;
        let domain = [low.map(|x| x - how.margin), high.map(|x| x + how.margin)];
        let organs = set.organs().iter().zip(set.region_volumes()).map(|(organ, volume)| Organ {
            name: organ.name().to_owned(),
            fixed: false,
            material: Material::default(),
            volume: Some(volume),
        });
        Ok(Self {
            domain,
            settings: Settings {
                coarsest: how.coarsest,
                background: how.background,
                solids: set.organs().iter().map(|organ| thin(organ, how.size)).collect(),
                ..Settings::new(how.size)
            },
            organs: organs.collect(),
            background: how.background.then(Material::default),
            markers: Vec::new(),
            strata,
        })
    }

    /// The same with another size at borders, m; all other sizes grow or shrink with it.
    #[must_use]
    pub fn with_size(mut self, size: f64) -> Self {
        let factor = size / self.settings.size;
        self.settings.size = size;
        self.settings.coarsest *= factor;
        self.settings.solids.iter_mut().filter_map(|solid| solid.size.as_mut()).for_each(|size| *size *= factor);
        self.settings.refinements.iter_mut().for_each(|place| place.size *= factor);
        self
    }

    /// Holds the organs of these names.
    ///
    /// # Errors
    /// [`PlanError::UnknownOrgan`].
    pub fn fix(&mut self, names: &[&str]) -> Result<(), PlanError> {
        for &name in names {
            let known = || self.organs.iter().map(|organ| organ.name.clone()).collect::<Vec<_>>().join(", ");
            let Some(at) = self.organs.iter().position(|organ| organ.name == name) else {
                return Err(PlanError::UnknownOrgan { name: name.into(), known: known() });
            };
            self.organs[at].fixed = true;
        }
        Ok(())
    }

    /// The name of a region of the mesh.
    pub fn name(&self, region: usize) -> &str {
        self.organs.get(region).map_or("background", |organ| &organ.name)
    }
}

/// How an organ is met: where it is too thin for the lattice by smaller cubes.
fn thin(organ: &Contoured, size: f64) -> SolidSettings {
    let largest = ACROSS * hydraulic_radius(organ);
    SolidSettings { border: Border::Conforming, size: (largest < size).then_some(largest) }
}

/// Twice the area of an organ's contours over their length, m: the radius, if they are circles.
fn hydraulic_radius(organ: &Contoured) -> f64 {
    let (mut area, mut length) = (0.0, 0.0);
    for part in organ.slices().iter().flat_map(|slice| &slice.parts) {
        area += part.area();
        for contour in part.contours() {
            let next = contour.iter().cycle().skip(1);
            length += contour.iter().zip(next).map(|(p, q)| distance2(p, q).sqrt()).sum::<f64>();
        }
    }
    2.0 * area / length
}

/// The box around all solids, its lowest and highest corner in m; `None` where no solid has an end.
pub fn bounds(strata: &Strata) -> Option<[[f64; 3]; 2]> {
    let boxes = strata.solids().iter().filter_map(|solid| solid.bounds());
    boxes.reduce(|a, b| [std::array::from_fn(|k| a[0][k].min(b[0][k])), std::array::from_fn(|k| a[1][k].max(b[1][k]))])
}
