//! Where a mesh comes from: Kuhn's triangulation of a unit cube, or a file.

use super::files;
use crate::exit::Failure;
use crate::facts::count;
use stylet_mesh::generate::kuhn_box_with_rule;
use stylet_mesh::import::Imported;
use stylet_mesh::io::{CellBlock, MeshData, RegionName};
use stylet_mesh::{MeshError, Rule, SimplexMesh};

/// What names a mesh that is not a file.
const EXPECTED: &str = "kuhn2, kuhn3, kuhn4, these with parts as in kuhn3:7x7x7, or a mesh file";

/// A mesh of one kind of cells in one dimension.
pub struct Loaded<const D: usize, const N: usize> {
    /// How it was named.
    pub name: String,
    content: Content<D, N>,
}

enum Content<const D: usize, const N: usize> {
    Made(Box<SimplexMesh<D, N>>),
    Read(Read),
}

/// What a file holds.
struct Read {
    data: MeshData,
    rule: Rule,
    /// What the reader left out.
    left_out: Vec<String>,
}

/// A mesh to be worked on, and what belongs to it.
pub struct Start<const D: usize, const N: usize> {
    /// The mesh.
    pub mesh: SimplexMesh<D, N>,
    /// The names of its regions and boundary tags.
    pub names: Vec<RegionName>,
    /// What of a file is not in it.
    pub left_out: Vec<String>,
}

/// Points, cells and regions as arrays.
pub struct Soup<const D: usize, const N: usize> {
    pub points: Vec<[f64; D]>,
    pub cells: Vec<[u32; N]>,
    pub regions: Vec<i32>,
}

/// A mesh of any kind that the commands work on.
pub enum AnyMesh {
    Plane(Loaded<2, 3>),
    Solid(Loaded<3, 4>),
    Surface(Loaded<3, 3>),
    Hyper(Loaded<4, 5>),
}

/// Something that is done to a mesh, whatever its kind.
pub trait Job {
    /// Does it.
    ///
    /// # Errors
    /// Its own.
    fn run<const D: usize, const N: usize>(self, mesh: Loaded<D, N>) -> Result<crate::exit::Exit, Failure>;
}

impl AnyMesh {
    /// The mesh of this name, to be bisected by this rule; `argument` is where it was given.
    ///
    /// # Errors
    /// Neither a Kuhn box nor a file that holds a mesh.
    pub fn open(argument: &str, name: &str, rule: Rule) -> Result<Self, Failure> {
        let (kind, text) = name.split_once(':').map_or((name, None), |(kind, text)| (kind, Some(text)));
        let refuse = |error: MeshError| Failure::bad_input(format!("{argument}: found {name}: {error}"));
        match kind {
            "kuhn2" => {
                let mesh = kuhn_box_with_rule([0.0; 2], [1.0; 2], parts(argument, name, text)?, rule);
                Ok(Self::Plane(Loaded::made(name, mesh.map_err(refuse)?)))
            }
            "kuhn3" => {
                let mesh = kuhn_box_with_rule([0.0; 3], [1.0; 3], parts(argument, name, text)?, rule);
                Ok(Self::Solid(Loaded::made(name, mesh.map_err(refuse)?)))
            }
            "kuhn4" => {
                let mesh = kuhn_box_with_rule([0.0; 4], [1.0; 4], parts(argument, name, text)?, rule);
                Ok(Self::Hyper(Loaded::made(name, mesh.map_err(refuse)?)))
            }
            _ => Self::read(argument, name, rule),
        }
    }

    fn read(argument: &str, name: &str, rule: Rule) -> Result<Self, Failure> {
        if name.is_empty() || name.starts_with("kuhn") && !std::path::Path::new(name).exists() {
            let found = if name.is_empty() { "nothing" } else { name };
            return Err(Failure::bad_input(format!("{argument}: found {found}, expected {EXPECTED}")));
        }
        let (data, left_out) = files::read(name.as_ref())?;
        let kind = (data.dimension, data.largest_simplex());
        let read = Read { data, rule, left_out };
        match kind {
            (2, 3) => Ok(Self::Plane(Loaded::read(name, read))),
            (3, 4) => Ok(Self::Solid(Loaded::read(name, read))),
            (3, 3) => Ok(Self::Surface(Loaded::read(name, read))),
            (_, n) => {
                let found = ["no cells", "points alone", "segments"].get(n).unwrap_or(&"other cells");
                Err(Failure::bad_input(format!("{name}: found {found}, expected triangles or tetrahedra")))
            }
        }
    }

    /// Does something to it.
    ///
    /// # Errors
    /// Those of the job.
    pub fn give(self, job: impl Job) -> Result<crate::exit::Exit, Failure> {
        match self {
            Self::Plane(mesh) => job.run(mesh),
            Self::Solid(mesh) => job.run(mesh),
            Self::Surface(mesh) => job.run(mesh),
            Self::Hyper(mesh) => job.run(mesh),
        }
    }
}

impl<const D: usize, const N: usize> Loaded<D, N> {
    fn made(name: &str, mesh: SimplexMesh<D, N>) -> Self {
        Self { name: name.to_owned(), content: Content::Made(Box::new(mesh)) }
    }

    fn read(name: &str, read: Read) -> Self {
        Self { name: name.to_owned(), content: Content::Read(read) }
    }

    /// The mesh, and what of a file is not in it.
    ///
    /// # Errors
    /// Cells of a file that make no mesh.
    pub fn mesh(self) -> Result<Start<D, N>, Failure> {
        match self.content {
            Content::Made(mesh) => Ok(Start { mesh: *mesh, names: Vec::new(), left_out: Vec::new() }),
            Content::Read(Read { data, rule, mut left_out }) => {
                let refuse = |error| Failure::bad_input(format!("{}: {error}; see `stylet mesh quality`", self.name));
                let imported = Imported::with_rule(&data, rule).map_err(refuse)?;
                left_out.extend(imported.left_out);
                let fields = data.point_fields.iter().chain(&data.cell_fields);
                left_out.extend(fields.map(|field| format!("field {}", field.name)));
                Ok(Start { mesh: imported.mesh, names: data.region_names, left_out })
            }
        }
    }

    /// What of a file [`soup`](Self::soup) does not hold.
    pub fn left_out(&self) -> Vec<String> {
        let Content::Read(Read { data, left_out, .. }) = &self.content else { return Vec::new() };
        let others = data.blocks.iter().filter(|block| block.vertices_per_cell != N);
        let n = others.map(CellBlock::n_cells).sum();
        let others = (n > 0).then(|| count(n, "cell of another size", "cells of other sizes"));
        left_out.iter().cloned().chain(others).collect()
    }

    /// The arrays, whether or not they make a mesh.
    pub fn soup(&self) -> Soup<D, N> {
        match &self.content {
            Content::Made(mesh) => Soup {
                points: mesh.points().to_vec(),
                cells: mesh.cells().map(|c| mesh.oriented(c).map(|v| v.0)).collect(),
                regions: mesh.cells().map(|c| mesh.region(c).cast_signed()).collect(),
            },
            Content::Read(Read { data, .. }) => {
                let (cells, regions) = data.simplices();
                Soup { points: data.coordinates(), cells, regions }
            }
        }
    }
}

/// Number of parts along each axis, as in `7x7x7`; one if nothing is said.
fn parts<const D: usize>(argument: &str, name: &str, text: Option<&str>) -> Result<[usize; D], Failure> {
    let Some(text) = text else { return Ok([1; D]) };
    let numbers: Option<Vec<usize>> = text.split('x').map(|n| n.parse().ok().filter(|n| *n > 0)).collect();
    let expected = || format!("{D} whole numbers, at least 1, as in {}:{}", &name[..5], ["7"; D].join("x"));
    let parts = numbers.and_then(|numbers| numbers.try_into().ok());
    parts.ok_or_else(|| Failure::bad_input(format!("{argument}: found {name}, expected {}", expected())))
}
