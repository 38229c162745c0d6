//! A scene of shapes, as read and as made.

use super::build::Shapes;
use super::keys::TABLE;
use std::fmt;
use std::path::Path;
use std::sync::Arc;
use stylet_mesh::generate::implicit::{Implicit, Strata};
use stylet_scene::{Row, SceneError, load};

/// Regions at most.
const MOST_REGIONS: usize = 1_000;

/// What a file says, key by key.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    pub(super) low: Vec<f64>,
    pub(super) high: Vec<f64>,
    pub(super) size: f64,
    pub(super) coarsest: Option<f64>,
    pub(super) background: bool,
    pub(super) shapes: Vec<Row>,
    pub(super) regions: Vec<Row>,
    pub(super) refinements: Vec<Row>,
    pub(super) markers: Vec<Row>,
    pub(super) material: Material,
}

impl Default for Draft {
    fn default() -> Self {
        Self {
            low: vec![0.0; 3],
            high: vec![0.1; 3],
            size: 0.01,
            coarsest: None,
            background: true,
            shapes: vec![],
            regions: vec![],
            refinements: vec![],
            markers: vec![],
            material: Material::default(),
        }
    }
}

/// What a tissue is made of, as far as the file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Material {
    /// Constitutive law, by its word.
    pub model: Option<String>,
    /// Young's modulus, Pa.
    pub young: Option<f64>,
    /// Poisson's ratio.
    pub poisson: Option<f64>,
    /// Density, kg/m³.
    pub density: Option<f64>,
}

impl Material {
    /// This one, with what it leaves out from `otherwise`.
    #[must_use]
    pub fn or(self, otherwise: &Self) -> Self {
        Self {
            model: self.model.or_else(|| otherwise.model.clone()),
            young: self.young.or(otherwise.young),
            poisson: self.poisson.or(otherwise.poisson),
            density: self.density.or(otherwise.density),
        }
    }
}

/// A solid with its place in the order.
#[derive(Clone)]
pub struct Region {
    /// Its name.
    pub name: String,
    /// Its shape.
    pub solid: Arc<dyn Implicit>,
    /// Whether facets of the mesh follow its surface.
    pub conforming: bool,
    /// The largest lattice cube that touches it, m.
    pub size: Option<f64>,
    /// Whether its nodes are held.
    pub fixed: bool,
    /// What it is made of; what is left out is as in [`ShapeScene::background`].
    pub material: Material,
}

/// A place with small cells.
#[derive(Clone)]
pub struct Refinement {
    /// The place.
    pub solid: Arc<dyn Implicit>,
    /// The largest lattice cube that touches it, m.
    pub size: f64,
}

/// A named point.
#[derive(Clone, Debug, PartialEq)]
pub struct Marker {
    /// Its name.
    pub name: String,
    /// Where it is in the undeformed body, m.
    pub at: [f64; 3],
}

/// A box with solids in it.
#[derive(Clone)]
pub struct ShapeScene {
    /// Lowest and highest corner of the box, m.
    pub domain: [[f64; 3]; 2],
    /// Edge of the lattice's cubes where borders conform, m.
    pub size: f64,
    /// Edge of the largest cubes, m, if the file says it.
    pub coarsest: Option<f64>,
    /// Whether what is in no region is meshed.
    pub meshes_background: bool,
    /// What is in no region.
    pub background: Material,
    /// The solids, first in precedence first; at least one.
    pub regions: Vec<Region>,
    /// Places with small cells.
    pub refinements: Vec<Refinement>,
    /// Points that are looked at.
    pub markers: Vec<Marker>,
}

impl ShapeScene {
    /// Reads a scene file; surfaces that it names are relative to its folder.
    ///
    /// # Errors
    /// One line that names the file and the key, what was found and what was expected.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let folder = path.parent().unwrap_or(Path::new(""));
        Self::parse(&path.display().to_string(), &load(path)?, folder)
    }

    /// Reads the text of a scene that messages call `name`; surfaces are relative to `folder`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(name: &str, text: &str, folder: &Path) -> Result<Self, SceneError> {
        let mut draft = Draft::default();
        TABLE.read(name, text, &mut draft)?;
        Self::new(name, &draft, folder)
    }

    /// Makes the shapes of a draft, which may have been changed since it was read, by
    /// [`Table::set`](stylet_scene::Table::set) of [`TABLE`](super::TABLE).
    ///
    /// # Errors
    /// As [`read`](Self::read), without lines.
    pub fn new(name: &str, draft: &Draft, folder: &Path) -> Result<Self, SceneError> {
        let refuse = |key: &str, reason: String| SceneError::rejected(name, key, &reason);
        let domain = domain(draft).map_err(|reason| refuse("domain", reason))?;
        let shapes = Shapes::new(&draft.shapes, folder).map_err(|reason| refuse("shape", reason))?;
        let regions = regions(draft, &shapes).map_err(|reason| refuse("region", reason))?;
        let refinements = draft.refinements.iter().enumerate().map(|(index, row)| {
            let (solid, size) = (shape_of(row, &shapes), row.get("size").unwrap_or(draft.size));
            solid.map(|solid| Refinement { solid, size }).map_err(|reason| format!("row {}: {reason}", index + 1))
        });
        let refinements: Result<_, String> = refinements.collect();
        let markers = draft.markers.iter().enumerate().map(|(index, row)| {
            marker(row, &domain).map_err(|reason| format!("row {} ({}): {reason}", index + 1, name_of(row)))
        });
        let markers: Result<_, String> = markers.collect();
        Ok(Self {
            domain,
            size: draft.size,
            coarsest: draft.coarsest,
            meshes_background: draft.background,
            background: draft.material.clone(),
            regions,
            refinements: refinements.map_err(|reason| refuse("refine", reason))?,
            markers: markers.map_err(|reason| refuse("marker", reason))?,
        })
    }

    /// The solids in order of precedence; regions of a mesh are numbered as [`regions`](Self::regions) are.
    pub fn strata(&self) -> Strata {
        Strata::new(self.regions.iter().map(|region| Box::new(region.solid.clone()) as Box<dyn Implicit>).collect())
    }
}

/// Lists what can be shown.
impl fmt::Debug for ShapeScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.regions.iter().map(|region| region.name.as_str()).collect();
        f.debug_struct("ShapeScene")
            .field("domain", &self.domain)
            .field("size", &self.size)
            .field("regions", &names)
            .finish_non_exhaustive()
    }
}

/// The name that a row gives itself, or the shape that it is about.
pub(super) fn name_of(row: &Row) -> &str {
    let text = |column| row.value(column).and_then(|value| value.text().ok());
    text("name").or_else(|| text("shape")).unwrap_or("")
}

fn domain(draft: &Draft) -> Result<[[f64; 3]; 2], String> {
    let corner = |numbers: &[f64]| <[f64; 3]>::try_from(numbers).map_err(|_| "expected 3 coordinates".to_owned());
    let (low, high) = (corner(&draft.low)?, corner(&draft.high)?);
    match (0..3).find(|&k| low[k] >= high[k] || !(high[k] - low[k]).is_finite()) {
        Some(k) => {
            let (axis, low, high) = (["x", "y", "z"][k], low[k], high[k]);
            Err(format!("found low {low} and high {high} along {axis}, expected low below high"))
        }
        None => Ok([low, high]),
    }
}

fn marker(row: &Row, [low, high]: &[[f64; 3]; 2]) -> Result<Marker, String> {
    let at = row.value("at").and_then(|at| at.floats().ok()).unwrap_or_default();
    let at: Option<[f64; 3]> = <[f64; 3]>::try_from(at).ok();
    match at {
        Some(at) if (0..3).all(|k| low[k] <= at[k] && at[k] <= high[k]) => Ok(Marker { name: name_of(row).into(), at }),
        found => Err(format!("at: found {found:?}, expected a point of the box")),
    }
}

fn regions(draft: &Draft, shapes: &Shapes) -> Result<Vec<Region>, String> {
    if draft.regions.is_empty() || draft.regions.len() > MOST_REGIONS {
        return Err(format!("found {} rows, expected from 1 to {MOST_REGIONS}", draft.regions.len()));
    }
    let mut regions: Vec<Region> = Vec::with_capacity(draft.regions.len());
    for (index, row) in draft.regions.iter().enumerate() {
        let name = name_of(row);
        let at = |reason: String| format!("row {} ({name}): {reason}", index + 1);
        if name.trim().is_empty() {
            return Err(at("name: found no character, expected a word".into()));
        }
        if regions.iter().any(|region| region.name == name) {
            return Err(at(format!("name: found {name} once more, expected one region of each name")));
        }
        regions.push(Region {
            name: name.into(),
            solid: shape_of(row, shapes).map_err(at)?,
            conforming: flag(row, "conform", true),
            size: row.get("size"),
            fixed: flag(row, "fixed", false),
            material: Material {
                model: row.value("model").and_then(|value| value.text().ok()).map(str::to_owned),
                young: row.get("young"),
                poisson: row.get("poisson"),
                density: row.get("density"),
            },
        });
    }
    Ok(regions)
}

fn flag(row: &Row, column: &str, otherwise: bool) -> bool {
    row.value(column).and_then(|value| value.bool().ok()).unwrap_or(otherwise)
}

fn shape_of(row: &Row, shapes: &Shapes) -> Result<Arc<dyn Implicit>, String> {
    let name = row.value("shape").map_or(Ok(""), |value| value.text())?;
    shapes.find(name).map_err(|reason| format!("shape: {reason}"))
}
