//! What a user can choose.

use super::GenerateError;
use crate::generate::implicit::Implicit;

/// How a box of solids is meshed.
pub struct Settings {
    /// Edge of the lattice's cubes at conforming borders, m. The cubes fill the box, so that their edges differ from this by
    /// up to a tenth, or more where the box is thinner than five of them.
    pub size: f64,
    /// Edge of the largest cubes, away from everything that asks for smaller ones, m. Cubes double in size: the largest
    /// power of two times `size` that is not larger, and that divides the box with cubes near to `size`.
    pub coarsest: f64,
    /// Whether the space around the solids is meshed, up to the faces of the box, which are exact.
    pub background: bool,
    /// One per solid, or none for solids that all conform.
    pub solids: Vec<SolidSettings>,
    /// Places with smaller cells than they would have otherwise.
    pub refinements: Vec<Refinement>,
    /// The largest number of tetrahedra of the lattice, cuts not counted; never more than 2^30.
    pub max_tets: usize,
}

impl Settings {
    /// Cubes of edge `size` at borders and of four times that far away, in a box with background; 20 million tetrahedra
    /// at most.
    pub fn new(size: f64) -> Self {
        Self {
            size,
            coarsest: 4.0 * size,
            background: true,
            solids: Vec::new(),
            refinements: Vec::new(),
            max_tets: 20_000_000,
        }
    }

    /// The largest number of tetrahedra, such that 32 bits count all that is made.
    pub(super) fn limit(&self) -> usize {
        self.max_tets.min(1 << 30)
    }

    /// How the border of a solid is treated.
    pub fn border(&self, solid: usize) -> Border {
        self.solids.get(solid).map_or(Border::Conforming, |s| s.border)
    }

    /// All sizes that were asked for, with names.
    fn sizes(&self) -> impl Iterator<Item = (String, f64)> {
        let solids = self.solids.iter().enumerate();
        let inside = solids.filter_map(|(i, s)| s.size.map(|size| (format!("the size in solid {i}"), size)));
        let refinements = self.refinements.iter().enumerate();
        let named = refinements.map(|(i, r)| (format!("the size of refinement {i}"), r.size));
        [("the size at borders".into(), self.size), ("the coarsest size".into(), self.coarsest)]
            .into_iter()
            .chain(inside)
            .chain(named)
    }

    /// Refuses what cannot be meshed, whatever the solids are.
    pub(super) fn check(&self, n_solids: usize) -> Result<(), GenerateError> {
        if !self.solids.is_empty() && self.solids.len() != n_solids {
            return Err(GenerateError::SolidSettings { expected: n_solids, found: self.solids.len() });
        }
        if n_solids == 0 && !self.background {
            return Err(GenerateError::Nothing);
        }
        match self.sizes().find(|(_, value)| !(*value > 0.0 && value.is_finite())) {
            Some((what, value)) => Err(GenerateError::Size { what, value }),
            None => Ok(()),
        }
    }

    /// The smallest size anywhere, m.
    pub(super) fn finest(&self) -> f64 {
        self.sizes().map(|(_, size)| size).fold(f64::INFINITY, f64::min)
    }
}

/// How one solid is meshed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SolidSettings {
    /// How its surface is met.
    pub border: Border,
    /// The largest cube that touches it, m; `None` leaves that to the border and to [`Settings::coarsest`].
    pub size: Option<f64>,
}

/// How a solid's surface is met by the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Border {
    /// Facets of the mesh, with their vertices on the surface, divide the solid from what is around it.
    #[default]
    Conforming,
    /// A cell belongs to the solid if its centroid does; the border is ragged.
    ByElement,
}

/// A place with small cells.
pub struct Refinement {
    /// The place.
    pub shape: Box<dyn Implicit>,
    /// The largest cube that touches it, m.
    pub size: f64,
}
