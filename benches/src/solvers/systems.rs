//! The model systems: cubes of soft tissue that is clamped on one face and loaded by its weight and along its axis.

use faer::sparse::SparseColMat;
use faer::sparse::linalg::solvers::SymbolicLlt;
use std::sync::OnceLock;
use stylet_mesh::generate::{kuhn_box, random_delaunay};
use stylet_mesh::random::SplitMix64;
use stylet_mesh::{CellId, MeshChange, SimplexMesh};
use stylet_physics::body::Body;
use stylet_physics::material::Linear;
use stylet_solver::sparse::{BlockCsr, ElementBlocks, ElementContributions, RefreshRule};
use stylet_solver::subspace::Subspace;

/// Side of the cubes, m.
pub(super) const SIDE: f64 = 0.1;
/// Young's modulus, Pa.
const YOUNG: f64 = 34e3;
/// kg/m³.
const DENSITY: f64 = 1000.0;
/// m/s².
const GRAVITY: f64 = 9.81;
/// Force along +x, N, shared by the nodes this close (m) to the axis, and below this x (m).
const PULL: (f64, f64, f64) = (2.0, 5e-3, 0.07);
/// Inner nodes are moved by up to this part of a cell, along each axis.
const JITTER: f64 = 0.15;
/// How much stiffer the lower layer is than the upper one.
const CONTRAST: f64 = 100.0;

/// A body of which the clamped nodes are eliminated.
pub(super) struct System {
    /// Such as `13k, ν 0.34`.
    pub name: String,
    /// Of the free nodes, N/m.
    pub stiffness: BlockCsr<3>,
    /// Of the free nodes, m.
    pub places: Vec<[f64; 3]>,
    /// N.
    pub load: Vec<f64>,
    /// Lumped, one per node, kg.
    masses: Vec<f64>,
}

/// A linear system to be solved.
pub(super) struct Case {
    /// Such as `13k, ν 0.34, static`.
    pub name: String,
    /// Symmetric, positive definite.
    pub matrix: BlockCsr<3>,
    /// Of the nodes, m.
    pub places: Vec<[f64; 3]>,
    /// The right side.
    pub load: Vec<f64>,
    /// All moves.
    pub free: Subspace<3>,
    /// faer's matrix and its analysis, once asked for.
    pub analysis: OnceLock<Analysis>,
}

/// A matrix of faer and its symbolic factor, or why there is none.
type Analysis = Result<(SparseColMat<usize, f64>, SymbolicLlt<usize>), String>;

/// `cells` a side, six tetrahedra each: 13 make the system "13k", 36 the system "280k".
pub(super) fn cube(cells: usize, poisson: f64) -> System {
    let mesh = jittered_cube(cells);
    let body = Body::new(&mesh, tissue(poisson, 1.0), 1.0).expect("cells with volume");
    let size = format!("{}k", (6 * cells.pow(3) + 500) / 1000);
    system(format!("{size}, ν {poisson}"), &mesh, body.stiffness())
}

/// An unstructured mesh of about 13,000 tetrahedra, the lower half a hundred times stiffer.
pub(super) fn layered(poisson: f64) -> System {
    let mesh = unstructured(13_000);
    let stiff = |cell: CellId| mesh.corners(cell).iter().map(|x| x[2]).sum::<f64>() < 2.0 * SIDE;
    let (matrix, _) = assembled(&mesh, |cell| tissue(poisson, if stiff(cell) { CONTRAST } else { 1.0 }));
    system(format!("layered, ν {poisson}"), &mesh, &matrix)
}

/// The mesh of [`cube`].
pub(crate) fn jittered_cube(cells: usize) -> SimplexMesh<3, 4> {
    let straight = kuhn_box::<3, 4>([0.0; 3], [SIDE; 3], [cells; 3]).expect("a box");
    let mut random = SplitMix64::new(4);
    let step = JITTER * SIDE / cells as f64;
    let moved = |x: &[f64; 3]| {
        let inner = x.iter().all(|&c| c > 0.0 && c < SIDE);
        if inner { x.map(|c| c + step * (2.0 * random.unit() - 1.0)) } else { *x }
    };
    let points = straight.points().iter().map(moved).collect();
    let tetrahedra = straight.cells().map(|cell| straight.cell(cell).map(|v| v.0)).collect();
    SimplexMesh::new(points, tetrahedra).expect("the jitter turns no cell round")
}

/// A Delaunay mesh of random points, refined until it has `n_cells` cells.
fn unstructured(n_cells: usize) -> SimplexMesh<3, 4> {
    let coarse = random_delaunay::<3, 4>(120, 4).expect("a mesh");
    let points = coarse.points().iter().map(|x| x.map(|c| SIDE * c)).collect();
    let cells = coarse.cells().map(|cell| coarse.cell(cell).map(|v| v.0)).collect();
    let mut mesh = SimplexMesh::new(points, cells).expect("the same mesh, smaller");
    let mut size = SIDE;
    while mesh.n_cells() < n_cells {
        size *= 0.97;
        mesh.refine_everywhere(size, &mut MeshChange::default()).expect("room for some thousand cells");
    }
    mesh
}

fn tissue(poisson: f64, factor: f64) -> Linear {
    Linear::from_young_poisson(factor * YOUNG, poisson).expect("a material")
}

/// The stiffness of a mesh, one material per cell, and the contributions of the cells, by id.
pub(super) fn assembled(
    mesh: &SimplexMesh<3, 4>,
    material: impl Fn(CellId) -> Linear,
) -> (BlockCsr<3>, ElementContributions<3, 4>) {
    let mut matrix = BlockCsr::new(mesh.n_vertex_slots());
    let mut contributions = ElementContributions::new(RefreshRule::default());
    let elements = mesh.cells().map(|cell| {
        let nodes = mesh.cell(cell).map(|v| v.0);
        (cell.index(), nodes, element_blocks(mesh.corners(cell), material(cell)))
    });
    contributions.change(&mut matrix, [], elements).expect("cells of a mesh");
    (matrix, contributions)
}

/// The stiffness of one tetrahedron: that of a body of one cell.
fn element_blocks(corners: [[f64; 3]; 4], material: Linear) -> ElementBlocks<3, 4> {
    let mesh = SimplexMesh::<3, 4>::new(corners.to_vec(), vec![[0, 1, 2, 3]]).expect("a cell with volume");
    let body = Body::new(&mesh, material, 1.0).expect("a cell with volume");
    let block = |a, b| *body.stiffness().get(a, b).expect("a full matrix");
    std::array::from_fn(|a| std::array::from_fn(|b| block(a, b)))
}

/// The tissue of the model systems with ν = 0.34.
pub(super) fn soft() -> Linear {
    tissue(0.34, 1.0)
}

fn system(name: String, mesh: &SimplexMesh<3, 4>, stiffness: &BlockCsr<3>) -> System {
    let free: Vec<u32> = mesh.vertices().map(|v| v.0).filter(|&v| mesh.points()[v as usize][0] < SIDE).collect();
    let places: Vec<[f64; 3]> = free.iter().map(|&v| mesh.points()[v as usize]).collect();
    let mut mass_of = vec![0.0; mesh.n_vertex_slots()];
    for cell in mesh.cells() {
        mesh.cell(cell).iter().for_each(|v| mass_of[v.index()] += 0.25 * DENSITY * mesh.volume(cell));
    }
    let masses: Vec<f64> = free.iter().map(|&v| mass_of[v as usize]).collect();
    let mut load: Vec<f64> = masses.iter().flat_map(|mass| [0.0, -GRAVITY * mass, 0.0]).collect();
    let (force, radius, end) = PULL;
    let near = |x: &[f64; 3]| (x[1] - 0.5 * SIDE).hypot(x[2] - 0.5 * SIDE) <= radius && x[0] < end;
    let pulled: Vec<usize> = (0..places.len()).filter(|&i| near(&places[i])).collect();
    assert!(!pulled.is_empty(), "{name}: no node near the axis");
    pulled.iter().for_each(|i| load[3 * i] += force / pulled.len() as f64);
    System { name, stiffness: principal(stiffness, &free), places, load, masses }
}

/// The rows and columns of some nodes, given in ascending order.
fn principal(matrix: &BlockCsr<3>, nodes: &[u32]) -> BlockCsr<3> {
    let mut part = BlockCsr::new(nodes.len());
    for (row, &node) in nodes.iter().enumerate() {
        let (cols, blocks) = matrix.row(node as usize);
        let kept =
            cols.iter().zip(blocks).filter_map(|(col, block)| Some((nodes.binary_search(col).ok()? as u32, *block)));
        let (cols, blocks): (Vec<u32>, Vec<_>) = kept.unzip();
        part.set_row(row, &cols, &blocks).expect("the rows of a matrix");
    }
    part
}

impl System {
    /// `K`, or for a time step `M + dt²/4 K`; `dt` in s.
    pub fn case(&self, dt: Option<f64>) -> Case {
        let (name, matrix) = match dt {
            None => (format!("{}, static", self.name), self.stiffness.clone()),
            Some(dt) => (format!("{}, {} ms", self.name, 1e3 * dt), self.dynamic(dt)),
        };
        let free = Subspace::new(matrix.n_rows());
        Case { name, matrix, places: self.places.clone(), load: self.load.clone(), free, analysis: OnceLock::new() }
    }

    fn dynamic(&self, dt: f64) -> BlockCsr<3> {
        let mut matrix = self.stiffness.clone();
        for (row, mass) in self.masses.iter().enumerate() {
            let (cols, blocks) = matrix.row_mut(row);
            let diagonal = cols.binary_search(&(row as u32)).expect("a diagonal block");
            blocks.as_flattened_mut().as_flattened_mut().iter_mut().for_each(|k| *k *= 0.25 * dt * dt);
            (0..3).for_each(|k| blocks[diagonal][k][k] += mass);
        }
        matrix
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_model_system_has_its_published_size_and_weight() {
        let system = cube(13, 0.34);
        assert_eq!((system.stiffness.n_rows(), system.stiffness.n_blocks()), (2548, 33_902));
        assert!(system.stiffness.asymmetry() < 1e-10);
        let sum = |axis: usize| system.load.chunks(3).map(|f| f[axis]).sum::<f64>();
        // A kilogram, but for what the clamped nodes carry.
        assert!((sum(0) - 2.0).abs() < 1e-12 && sum(1) < -9.0 && sum(1) > -9.81, "{} {}", sum(0), sum(1));
    }

    #[test]
    fn cell_by_cell_assembly_is_that_of_the_body() {
        let mesh = jittered_cube(3);
        let body = Body::new(&mesh, soft(), 1.0).unwrap();
        let (matrix, _) = assembled(&mesh, |_| soft());
        let largest = body.stiffness().to_dense().iter().fold(0.0_f64, |m, k| m.max(k.abs()));
        for (k, l) in matrix.to_dense().iter().zip(body.stiffness().to_dense()) {
            assert!((k - l).abs() <= 1e-13 * largest, "{k} {l}");
        }
    }

    #[test]
    fn the_layered_system_has_about_as_many_cells_and_the_contrast() {
        let mesh = unstructured(13_000);
        assert!((13_000..14_000).contains(&mesh.n_cells()), "{}", mesh.n_cells());
        let system = layered(0.34);
        let stiffest = |lower: bool| {
            let nodes = (0..system.places.len())
                .filter(|&i| if lower { system.places[i][2] < 0.03 } else { system.places[i][2] > 0.07 });
            nodes.map(|i| system.stiffness.diagonal(i)[0][0]).sum::<f64>()
        };
        let contrast = stiffest(true) / stiffest(false);
        assert!((50.0..200.0).contains(&contrast), "{contrast}");
    }
}
