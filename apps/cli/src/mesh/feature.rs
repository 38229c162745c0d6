//! Where to refine: a point, a segment, everywhere.

use crate::exit::Failure;
use crate::probe::numbers;
use serde_json::{Value, json};
use stylet_mesh::{BisectError, MeshChange, SimplexMesh};

/// What simplices have to touch.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Feature<const D: usize> {
    /// A point.
    Point([f64; D]),
    /// A closed segment.
    Segment([f64; D], [f64; D]),
    /// The whole mesh.
    Everywhere,
}

impl<const D: usize> Feature<D> {
    /// The feature that the arguments `names` (of a point, of a segment) tell.
    ///
    /// # Errors
    /// Not as many finite numbers as the mesh, called `mesh`, has dimensions.
    pub fn parse(names: [&str; 2], point: Option<&str>, segment: Option<&str>, mesh: &str) -> Result<Self, Failure> {
        if let Some(text) = point {
            return coordinates::<D>(names[0], text, 1, mesh)
                .map(|p: Vec<f64>| Self::Point(std::array::from_fn(|k| p[k])));
        }
        let Some(text) = segment else { return Ok(Self::Everywhere) };
        let ends = coordinates::<D>(names[1], text, 2, mesh)?;
        Ok(Self::Segment(std::array::from_fn(|k| ends[k]), std::array::from_fn(|k| ends[D + k])))
    }

    /// Bisects until no simplex that touches this has an edge longer than `size`.
    ///
    /// # Errors
    /// Those of the mesh.
    pub fn refine<const N: usize>(
        &self,
        mesh: &mut SimplexMesh<D, N>,
        size: f64,
        change: &mut MeshChange,
    ) -> Result<(), BisectError> {
        match *self {
            Self::Point(p) => mesh.refine_around(p, size, change),
            Self::Segment(a, b) => mesh.refine_along(a, b, size, change),
            Self::Everywhere => mesh.refine_everywhere(size, change),
        }
    }

    /// By slot, which cells touch this, now alive or bisected since; `None` if all do.
    pub fn touched<const N: usize>(&self, mesh: &SimplexMesh<D, N>) -> Option<Vec<bool>> {
        let (a, b) = match *self {
            Self::Point(p) => (p, p),
            Self::Segment(a, b) => (a, b),
            Self::Everywhere => return None,
        };
        let mut crossings = Vec::new();
        mesh.leaves_along(a, b, &mut crossings);
        let mut touched = vec![false; mesh.n_slots()];
        for crossing in crossings {
            // What touches a half touches the whole.
            let mut cell = Some(crossing.cell);
            while let Some(c) = cell.filter(|c| !touched[c.index()]) {
                touched[c.index()] = true;
                cell = mesh.parent(c);
            }
        }
        Some(touched)
    }

    /// The argument that gave it.
    pub fn argument(&self) -> &'static str {
        match self {
            Self::Point(_) => "--point",
            Self::Segment(..) => "--segment",
            Self::Everywhere => "--size",
        }
    }

    /// As JSON: a list of points, or null for everywhere.
    pub fn json(&self) -> Value {
        match self {
            Self::Point(p) => json!([p.to_vec()]),
            Self::Segment(a, b) => json!([a.to_vec(), b.to_vec()]),
            Self::Everywhere => Value::Null,
        }
    }

    /// In words.
    pub fn describe(&self) -> String {
        match self {
            Self::Point(p) => format!("around {}", tuple(p)),
            Self::Segment(a, b) => format!("along {} to {}", tuple(a), tuple(b)),
            Self::Everywhere => "everywhere".to_owned(),
        }
    }
}

fn tuple(p: &[f64]) -> String {
    format!("({})", p.iter().map(f64::to_string).collect::<Vec<_>>().join(", "))
}

/// The finite coordinates of one or two points, one after the other, in the dimension of a mesh.
fn coordinates<const D: usize>(argument: &str, text: &str, points: usize, mesh: &str) -> Result<Vec<f64>, Failure> {
    let refuse = |found: String| {
        let found = if text.is_empty() { "nothing".to_owned() } else { found };
        let what = if points == 1 { "a point" } else { "two points" };
        let n = points * D;
        Failure::bad_input(format!(
            "{argument}: found {found}, expected {n} numbers, {what}: {mesh} has {D} dimensions"
        ))
    };
    let list = numbers(text).map_err(refuse)?;
    if list.len() == points * D {
        return Ok(list);
    }
    let plural = if list.len() == 1 { "" } else { "s" };
    Err(refuse(format!("{} number{plural} in {text}", list.len())))
}
