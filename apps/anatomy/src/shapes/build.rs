//! Shapes from the rows of `[[shape]]`.

use super::scene::name_of;
use std::path::Path;
use std::sync::Arc;
use stylet_mesh::generate::implicit::{
    Capsule, ClosedSurface, Cuboid, Cylinder, Difference, Ellipsoid, HalfSpace, Implicit, Intersection, Placed,
    ShapeError, Shell, SmoothUnion, Sphere, TorusArc, Union,
};
use stylet_mesh::io;
use stylet_scene::{Row, Value, nearest};

/// A distance that asks for more distances of simple bodies than this would take for ever.
const MOST_PARTS: usize = 10_000;
/// Shapes in shapes in shapes at most: each one is a call within a call.
const DEEPEST: usize = 100;

/// A shape that others can share.
pub(super) type Shared = Arc<dyn Implicit>;

/// A row's shape.
#[derive(Clone)]
struct Entry {
    name: String,
    solid: Shared,
    /// Simple bodies whose distances it asks for.
    parts: usize,
    depth: usize,
}

/// The shapes of a scene, by name.
pub(super) struct Shapes(Vec<Entry>);

impl Shapes {
    /// Makes the shapes; files are relative to `folder`. An error names the row.
    pub fn new(rows: &[Row], folder: &Path) -> Result<Self, String> {
        let mut shapes = Self(Vec::with_capacity(rows.len()));
        for (index, row) in rows.iter().enumerate() {
            let entry = shapes.entry(row, folder);
            shapes.0.push(entry.map_err(|reason| format!("row {} ({}): {reason}", index + 1, name_of(row)))?);
        }
        Ok(shapes)
    }

    /// The shape of a name.
    pub fn find(&self, name: &str) -> Result<Shared, String> {
        self.entry_of(name).map(|entry| entry.solid.clone())
    }

    fn entry_of(&self, name: &str) -> Result<&Entry, String> {
        self.0.iter().find(|entry| entry.name == name).ok_or_else(|| {
            if self.0.is_empty() {
                return format!("found {name}, expected the name of a [[shape]], of which there are none before");
            }
            let near = nearest(name, self.0.iter().map(|entry| entry.name.as_str()));
            format!("found {name}, expected the name of a [[shape]] stated before; nearest is {near}")
        })
    }

    fn entry(&self, row: &Row, folder: &Path) -> Result<Entry, String> {
        let name = name_of(row);
        if name.is_empty() || name.contains(',') || name.trim() != name {
            return Err(format!("name: found {name:?}, expected a word or more without commas"));
        }
        if self.0.iter().any(|entry| entry.name == name) {
            return Err(format!("name: found {name} once more, expected one shape of each name"));
        }
        let made_of = self.made_of(row)?;
        let parts = made_of.iter().fold(0_usize, |sum, entry| sum.saturating_add(entry.parts)).max(1);
        if parts > MOST_PARTS {
            return Err(format!("of: found {parts} simple shapes in it, expected at most {MOST_PARTS}"));
        }
        let depth = 1 + made_of.iter().map(|entry| entry.depth).max().unwrap_or(0);
        if depth > DEEPEST {
            return Err(format!("of: found shapes within shapes {depth} deep, expected at most {DEEPEST}"));
        }
        let solid = solid(row, made_of, folder)?;
        Ok(Entry { name: name.into(), solid: placed(row, solid)?, parts, depth })
    }

    fn made_of(&self, row: &Row) -> Result<Vec<&Entry>, String> {
        let Some(of) = row.value("of") else { return Ok(vec![]) };
        let found: Result<_, String> = of.text()?.split(',').map(|name| self.entry_of(name.trim())).collect();
        found.map_err(|reason| format!("of: {reason}"))
    }
}

/// The columns of a row; that they are there, and of their kind, has been checked.
struct Columns<'a>(&'a Row);

impl Columns<'_> {
    fn point(&self, name: &str) -> Result<[f64; 3], String> {
        self.value(name)?.point()
    }

    fn number(&self, name: &str) -> Result<f64, String> {
        self.value(name)?.float()
    }

    fn value(&self, name: &str) -> Result<&Value, String> {
        self.0.value(name).ok_or_else(|| format!("{name}: missing"))
    }
}

/// The shape of a row, before it is turned and moved.
fn solid(row: &Row, made_of: Vec<&Entry>, folder: &Path) -> Result<Shared, String> {
    let columns = Columns(row);
    let (point, number) = (|name| columns.point(name), |name| columns.number(name));
    let shares = made_of.iter().map(|entry| entry.solid.clone());
    let boxed = || made_of.iter().map(|entry| Box::new(entry.solid.clone()) as Box<dyn Implicit>).collect();
    match columns.value("kind")?.text()? {
        "sphere" => shared(Sphere::new(point("centre")?, number("radius")?)),
        "ellipsoid" => shared(Ellipsoid::new(point("centre")?, point("semi_axes")?)),
        "capsule" => shared(Capsule::new(point("from")?, point("to")?, number("radius")?)),
        "cylinder" => shared(Cylinder::new(point("from")?, point("to")?, number("radius")?)),
        "torus-arc" => {
            let (angle, ring, tube) = (number("angle")?, number("ring")?, number("tube")?);
            shared(TorusArc::new(point("centre")?, point("axis")?, point("start")?, angle, ring, tube))
        }
        "box" => shared(Cuboid::new(point("low")?, point("high")?)),
        "half-space" => shared(HalfSpace::new(point("point")?, point("normal")?)),
        "surface" => surface(row, folder),
        "shell" => {
            let [inside, outside] = ["inside", "outside"].map(|name| row.get(name).unwrap_or(0.0));
            shared(Shell::new(one(made_of)?, inside, outside))
        }
        "union" => shared(Union::new(boxed())),
        "intersection" => shared(Intersection::new(boxed())),
        "difference" => several(shares, |a, b| Ok(Arc::new(Difference::new(a, b)))),
        "smooth-union" => {
            let reach = number("reach")?;
            several(shares, |a, b| shared(SmoothUnion::new(a, b, reach)))
        }
        "placed" => one(made_of),
        other => Err(format!("kind: found {other}, expected a kind of shape")),
    }
}

fn shared(shape: Result<impl Implicit + 'static, ShapeError>) -> Result<Shared, String> {
    shape.map(|shape| Arc::new(shape) as Shared).map_err(|error| error.to_string())
}

/// The one shape that a row is made of.
fn one(made_of: Vec<&Entry>) -> Result<Shared, String> {
    match made_of[..] {
        [entry] => Ok(entry.solid.clone()),
        _ => Err(format!("of: found {} names, expected one", made_of.len())),
    }
}

/// At least two shapes, joined from the first on.
fn several(
    mut shapes: impl ExactSizeIterator<Item = Shared>,
    mut join: impl FnMut(Shared, Shared) -> Result<Shared, String>,
) -> Result<Shared, String> {
    match (shapes.len(), shapes.next()) {
        (2.., Some(first)) => shapes.try_fold(first, &mut join),
        (n, _) => Err(format!("of: found {n} name, expected two or more")),
    }
}

/// Turned and moved as a row says.
fn placed(row: &Row, solid: Shared) -> Result<Shared, String> {
    let vector = |name: &str| row.value(name).map(|value| value.point::<3>()).transpose();
    let (axis, shift) = (vector("turn_axis")?, vector("shift")?);
    if axis.is_none() && shift.is_none() {
        return Ok(solid);
    }
    let angle = row.get("turn").unwrap_or(0.0);
    shared(Placed::new(solid, axis.unwrap_or([0.0, 0.0, 1.0]), angle, shift.unwrap_or_default()))
}

/// The solid within the triangles of a file.
fn surface(row: &Row, folder: &Path) -> Result<Shared, String> {
    let path = folder.join(Columns(row).value("file")?.text()?);
    let data = io::read(&path).map_err(|error| format!("file: {error}"))?;
    let refuse = |reason: String| format!("file: {}: {reason}", path.display());
    if data.largest_simplex() != 3 || data.dimension != 3 {
        let found = ["nothing", "points", "segments", "triangles", "tetrahedra"].get(data.largest_simplex());
        let found = found.unwrap_or(&"other cells");
        return Err(refuse(format!("found {found} in {} dimensions, expected triangles in space", data.dimension)));
    }
    let triangles = data.submesh::<3, 3>();
    let unit = row.get("unit").unwrap_or(1.0);
    let points: Vec<[f64; 3]> = triangles.points.iter().map(|p| p.map(|x| unit * x)).collect();
    let solid = ClosedSurface::new(&points, &triangles.cells).map_err(|error| refuse(error.to_string()))?;
    Ok(Arc::new(solid))
}
