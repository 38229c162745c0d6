//! The tissue's mesh, the names of its regions, and surfaces as fields in space.

use crate::columns::SIDES;
use crate::scene::{MeshStage, Scene};
use std::path::Path;
use std::sync::Arc;
use stylet_anatomy::plan::{self, Effort, Plan};
use stylet_anatomy::shapes::{Material, ShapeScene};
use stylet_mesh::generate::implicit::{ClosedSurface, Cuboid, Implicit, Intersection, Union};
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::import::Imported;
use stylet_mesh::io::{MeshData, read};
use stylet_mesh::{CellId, SimplexMesh};
use stylet_scene::{Row, nearest};
use stylet_tissue::RunError;

/// More cells than this are a typing error.
const MOST_CELLS: f64 = 2e7;

/// A signed distance, negative inside, m.
pub type Surface = Arc<dyn Implicit>;

/// What is known of a region before materials are looked at.
#[derive(Clone)]
pub struct Region {
    /// Its name.
    pub name: String,
    /// Whether its nodes are held.
    pub fixed: bool,
    /// What its source says that it is made of.
    pub material: Material,
    /// Its surface, where the source is a shape.
    solid: Option<Surface>,
}

/// A mesh with what scenes say by name.
#[derive(Clone)]
pub struct Geometry {
    /// The mesh; regions are numbered as [`regions`](Self::regions) are.
    pub mesh: SimplexMesh<3, 4>,
    /// The regions.
    pub regions: Vec<Region>,
    /// Named points, m.
    pub markers: Vec<(String, [f64; 3])>,
    /// Lower and upper corner of the box around it, m.
    pub bounds: [[f64; 3]; 2],
    body: Option<Surface>,
}

impl Geometry {
    /// Makes or reads the mesh of a scene.
    ///
    /// # Errors
    /// [`RunError`] names the scene or the mesh file, the key, what was found and what was expected.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let refuse = |reason: String| RunError::Inconsistent { source_name: scene.label.clone(), reason };
        let mut geometry = match (&scene.mesh.shape, &scene.mesh.file) {
            (Some(_), Some(_)) => Err(refuse("mesh.shape: found beside mesh.file, expected one of the two".into())),
            (Some(shape), None) => shaped(scene, shape).map_err(refuse),
            (None, Some(file)) => {
                let path = scene.folder.join(file);
                from_file(scene, &path)
                    .map_err(|reason| RunError::Inconsistent { source_name: path.display().to_string(), reason })
            }
            (None, None) => boxed(&scene.mesh).map_err(refuse),
        }?;
        geometry.mesh = scene.mesh.order.of(geometry.mesh).map_err(refuse)?;
        Ok(geometry)
    }

    fn new(
        mesh: SimplexMesh<3, 4>,
        regions: Vec<Region>,
        markers: Vec<(String, [f64; 3])>,
        body: Option<Surface>,
    ) -> Self {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for x in mesh.vertices().map(|v| mesh.point(v)) {
            for k in 0..3 {
                bounds[0][k] = bounds[0][k].min(x[k]);
                bounds[1][k] = bounds[1][k].max(x[k]);
            }
        }
        Self { mesh, regions, markers, bounds, body }
    }

    /// The number of a region that has cells.
    ///
    /// # Errors
    /// What was found and what was expected.
    pub fn region(&self, name: &str) -> Result<usize, String> {
        let mut filled = vec![false; self.regions.len()];
        self.mesh.cells().for_each(|cell| filled[self.mesh.region(cell) as usize] = true);
        let mut known = self.regions.iter().zip(&filled).map(|(region, filled)| (region.name.as_str(), *filled));
        known.clone().position(|(known, filled)| known == name && filled).ok_or_else(|| {
            let names: Vec<&str> = known.by_ref().filter_map(|(name, filled)| filled.then_some(name)).collect();
            let near = nearest(name, names.iter().copied());
            format!("found region {name}, expected one of {}; nearest is {near}", names.join(", "))
        })
    }

    /// The surface of the body (`body`) or of a region, as a signed distance: that of the shape, or that of the facets of a
    /// mesh file.
    ///
    /// # Errors
    /// A region that there is not, or whose facets do not close.
    pub fn surface(&self, name: &str) -> Result<Surface, String> {
        if name == "body" {
            return self.body.clone().map_or_else(|| self.facets_of(None), Ok);
        }
        let region = self.region(name)?;
        let solid = self.regions[region].solid.clone();
        solid.map_or_else(|| self.facets_of(Some(region as u32)), Ok)
    }

    /// The surface of the cells of a region, or of all.
    fn facets_of(&self, region: Option<u32>) -> Result<Surface, String> {
        let mesh = &self.mesh;
        let within = |cell: CellId| region.is_none_or(|region| mesh.region(cell) == region);
        let mut triangles = Vec::new();
        for cell in mesh.cells().filter(|&cell| within(cell)) {
            // Facets are opposite the vertices in the order of the cell; outward ones in that of its orientation.
            let (corners, oriented) = (mesh.cell(cell), mesh.oriented(cell));
            for (facet, corner) in corners.iter().enumerate() {
                if mesh.neighbor(cell, facet).is_some_and(within) {
                    continue;
                }
                let opposite = oriented.iter().position(|v| v == corner).unwrap_or(facet);
                let outward = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]][opposite];
                triangles.push(outward.map(|k| oriented[k].0));
            }
        }
        let surface = ClosedSurface::new(mesh.points(), &triangles).map_err(|error| error.to_string())?;
        Ok(Arc::new(surface))
    }

    /// Whether a vertex lies on one of the sides (numbers in the order of left, right, front, back, bottom, top).
    #[must_use]
    pub fn on_side(&self, x: &[f64; 3], side: usize) -> bool {
        let (axis, end) = (side / 2, side % 2);
        let size = (0..3).map(|k| self.bounds[1][k] - self.bounds[0][k]).fold(0.0, f64::max);
        (x[axis] - self.bounds[end][axis]).abs() <= 1e-9 * size
    }

    /// `from (0, 0, 0) to (0.1, 0.1, 0.1) m`
    #[must_use]
    pub fn extent(&self) -> String {
        let corner = |x: &[f64; 3]| x.map(|x| x.to_string()).join(", ");
        format!("from ({}) to ({}) m", corner(&self.bounds[0]), corner(&self.bounds[1]))
    }

    /// The edge of a regular tetrahedron of the mean volume of the cells, m.
    #[must_use]
    pub fn mean_edge(&self) -> f64 {
        (6.0 * std::f64::consts::SQRT_2 * self.mesh.total_volume() / self.mesh.n_cells() as f64).cbrt()
    }
}

/// Numbers of the sides that a list names.
///
/// # Errors
/// A word that is no side.
pub fn sides(list: &str) -> Result<Vec<usize>, String> {
    let words = list.split(',').map(str::trim).filter(|word| !word.is_empty());
    let number = |word: &str| {
        let expected = SIDES.join(", ");
        SIDES
            .iter()
            .position(|side| *side == word)
            .ok_or_else(|| format!("support.sides: found {word}, expected some of {expected}"))
    };
    words.map(number).collect()
}

fn shaped(scene: &Scene, shape: &str) -> Result<Geometry, String> {
    let known = match plan::built_in(shape) {
        Some(known) => known,
        None if Path::new(shape).extension().is_some() => ShapeScene::read(scene.folder.join(shape)),
        None => {
            let names: Vec<&str> = plan::BUILT_IN.iter().map(|(name, ..)| *name).collect();
            let near = nearest(shape, names.iter().copied());
            return Err(format!(
                "mesh.shape: found {shape}, expected a TOML file or one of {}; nearest is {near}",
                names.join(", ")
            ));
        }
    };
    let shapes = known.map_err(|error| format!("mesh.shape: {error}"))?;
    let mut plan = Plan::of_shapes(&shapes);
    if let Some(size) = scene.mesh.resolution {
        plan = plan.with_size(size);
    }
    let made = plan
        .mesh(&Effort::default(), &mut |_| std::ops::ControlFlow::Continue(()))
        .map_err(|error| format!("mesh.shape: {shape}: {error}"))?;
    let mut regions: Vec<Region> = plan
        .organs
        .iter()
        .zip(&shapes.regions)
        .map(|(organ, region)| Region {
            name: organ.name.clone(),
            fixed: organ.fixed,
            material: organ.material.clone().or(&shapes.background),
            solid: Some(region.solid.clone()),
        })
        .collect();
    if let Some(material) = &plan.background {
        let (name, material) = ("background".to_owned(), material.clone());
        regions.push(Region { name, fixed: false, material, solid: None });
    }
    let fault = |error: stylet_mesh::generate::implicit::ShapeError| format!("mesh.shape: {error}");
    let domain: Box<dyn Implicit> = Box::new(Cuboid::new(plan.domain[0], plan.domain[1]).map_err(fault)?);
    let body: Surface = if plan.background.is_some() {
        Arc::from(domain)
    } else {
        let solids = shapes.regions.iter().map(|region| Box::new(region.solid.clone()) as Box<dyn Implicit>).collect();
        let solids: Box<dyn Implicit> = Box::new(Union::new(solids).map_err(fault)?);
        Arc::new(Intersection::new(vec![domain, solids]).map_err(fault)?)
    };
    let markers = plan.markers.iter().map(|marker| (marker.name.clone(), marker.at)).collect();
    let mesh = made.tets.into_mesh().map_err(|error| format!("mesh.shape: {error}"))?;
    Ok(Geometry::new(mesh, regions, markers, Some(body)))
}

/// A box of Kuhn tetrahedra, all of region `tissue`.
fn boxed(mesh: &MeshStage) -> Result<Geometry, String> {
    let vector = |key: &str, x: &[f64]| <[f64; 3]>::try_from(x).map_err(|_| format!("{key}: expected 3 numbers"));
    let (size, origin) = (vector("mesh.size", &mesh.size)?, vector("mesh.origin", &mesh.origin)?);
    let cells = vector("mesh.cells", &mesh.cells)?;
    if let Some(side) = size.iter().find(|side| **side <= 0.0) {
        return Err(format!("mesh.size: found {side}, expected sides above 0 m"));
    }
    if let Some(parts) = cells.iter().find(|parts| !(**parts >= 1.0 && parts.fract() == 0.0)) {
        return Err(format!("mesh.cells: found {parts}, expected whole numbers of at least 1"));
    }
    let simplices = 6.0 * cells.iter().product::<f64>();
    if simplices > MOST_CELLS {
        return Err(format!("mesh.cells: found {simplices:e} tetrahedra, expected at most {MOST_CELLS:e}"));
    }
    let upper = std::array::from_fn(|k| origin[k] + size[k]);
    let made = kuhn_box::<3, 4>(origin, upper, cells.map(|n| n as usize)).map_err(|error| format!("mesh: {error}"))?;
    let body: Surface = Arc::new(Cuboid::new(origin, upper).map_err(|error| format!("mesh: {error}"))?);
    let tissue =
        Region { name: "tissue".into(), fixed: false, material: Material::default(), solid: Some(body.clone()) };
    Ok(Geometry::new(made, vec![tissue], Vec::new(), Some(body)))
}

fn from_file(scene: &Scene, path: &Path) -> Result<Geometry, String> {
    let mut data = read(path).map_err(|error| {
        let (text, named) = (error.to_string(), format!("{}: ", path.display()));
        text.strip_prefix(&named).unwrap_or(&text).to_owned()
    })?;
    if (data.dimension, data.largest_simplex()) != (3, 4) {
        return Err(format!("found no tetrahedra in {} dimensions, expected tetrahedra in space", data.dimension));
    }
    let names = number_regions(&scene.regions, &mut data);
    let imported = Imported::<3, 4>::new(&data).map_err(|error| error.to_string())?;
    let region = |name| Region { name, fixed: false, material: Material::default(), solid: None };
    Ok(Geometry::new(imported.mesh, names.into_iter().map(region).collect(), Vec::new(), None))
}

/// Renumbers the regions of the cells from 0, and returns their names: by a `tag` of the scene, by the file, or `region N`.
fn number_regions(rows: &[Row], data: &mut MeshData) -> Vec<String> {
    let volumes = |data: &mut MeshData| -> Vec<i32> {
        let blocks = data.blocks.iter().filter(|block| block.vertices_per_cell == 4);
        let mut numbers: Vec<i32> = blocks.flat_map(|block| block.regions.iter().copied()).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    };
    let numbers = volumes(data);
    let tagged = |number: i32| {
        let row = rows.iter().find(|row| row.value("tag").and_then(|tag| tag.int().ok()) == Some(i64::from(number)));
        row.map(|row| crate::keys::name_of(row).to_owned())
    };
    let name = |&number: &i32| {
        let by_file = || data.region_name(4, number).map(str::to_owned);
        tagged(number).or_else(by_file).unwrap_or_else(|| format!("region {number}"))
    };
    let names = numbers.iter().map(name).collect();
    for block in data.blocks.iter_mut().filter(|block| block.vertices_per_cell == 4) {
        for region in &mut block.regions {
            *region = numbers.binary_search(region).map_or(0, |at| at as i32);
        }
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_surface_of_facets_is_that_of_the_box() {
        let geometry = boxed(&MeshStage { cells: vec![3.0; 3], ..MeshStage::default() }).unwrap();
        let (exact, facets) = (geometry.surface("body").unwrap(), geometry.facets_of(Some(0)).unwrap());
        for p in [[0.05, 0.05, 0.01], [0.02, 0.09, 0.05], [-0.01, 0.05, 0.05], [0.05, 0.11, 0.02]] {
            assert!((exact.distance(&p) - facets.distance(&p)).abs() < 1e-12, "{p:?}");
        }
        assert!(geometry.surface("bone").err().unwrap().contains("expected one of tissue"));
        assert!((geometry.mean_edge() / (0.1 / 3.0 * 2.0_f64.sqrt().cbrt()) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn sides_are_named() {
        assert_eq!(sides("bottom, left"), Ok(vec![4, 0]));
        assert!(sides("bottm").unwrap_err().contains("found bottm, expected some of left"));
    }
}
