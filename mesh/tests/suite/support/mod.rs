//! Start meshes and brute-force answers for the tests.

use stylet_mesh::{
    CellId, MeshChange, SimplexMesh, VertexId,
    generate::{kuhn_box, random_delaunay},
    geometry,
    random::SplitMix64,
};

/// A small random generator, so that a seed is a mesh.
pub struct Random(SplitMix64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(SplitMix64::new(seed))
    }

    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in `0..1`.
    pub fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }

    pub fn point<const D: usize>(&mut self) -> [f64; D] {
        std::array::from_fn(|_| self.unit())
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}

/// Points and cells, before a mesh is made of them.
type Soup<const D: usize, const N: usize> = (Vec<[f64; D]>, Vec<[u32; N]>);

fn soup<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Soup<D, N> {
    (mesh.points().to_vec(), mesh.cells().map(|c| mesh.cell(c).map(|v| v.0)).collect())
}

fn is_inside<const D: usize>(p: &[f64; D]) -> bool {
    p.iter().all(|&x| x > 0.0 && x < 1.0)
}

/// The unit cube in `parts` parts per axis, with the inner vertices moved at random.
fn jittered<const D: usize, const N: usize>(parts: usize, random: &mut Random) -> Soup<D, N> {
    let (mut points, cells) = soup(&kuhn_box::<D, N>([0.0; D], [1.0; D], [parts; D]).unwrap());
    for point in points.iter_mut().filter(|p| is_inside(p)) {
        *point = point.map(|x| x + 0.3 / (D * parts) as f64 * (2.0 * random.unit() - 1.0));
    }
    (points, cells)
}

/// A start mesh of the unit cube of one of three kinds (0: Kuhn, 1: jittered, 2: Delaunay), the latter two with vertices,
/// cells and windings in random order, and with regions.
pub fn start_mesh<const D: usize, const N: usize>(kind: u8, seed: u64) -> SimplexMesh<D, N> {
    let mut random = Random::new(seed);
    let parts = if D < 4 { 2 } else { 1 + random.below(2) };
    let (points, mut cells) = match kind {
        0 => return kuhn_box([0.0; D], [1.0; D], [parts; D]).unwrap(),
        1 => jittered::<D, N>(2, &mut random),
        _ => soup(&random_delaunay::<D, N>(if D < 4 { 30 } else { 12 }, random.bits()).unwrap()),
    };
    let mut names: Vec<u32> = (0..points.len() as u32).collect();
    random.shuffle(&mut names);
    let mut renamed = points.clone();
    for (point, &name) in points.iter().zip(&names) {
        renamed[name as usize] = *point;
    }
    for cell in &mut cells {
        *cell = cell.map(|v| names[v as usize]);
        random.shuffle(cell);
    }
    random.shuffle(&mut cells);
    let regions = (0..cells.len() as u32).map(|c| c % 5).collect();
    SimplexMesh::with_regions(renamed, cells, regions).unwrap()
}

/// Live cells at random, some of them twice, some dead ones among them.
pub fn marks<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, n: usize, random: &mut Random) -> Vec<CellId> {
    (0..n).map(|_| CellId::new(random.below(mesh.n_slots()))).collect()
}

/// The live cells around a vertex, by a scan.
pub fn star_by_scan<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, v: VertexId) -> Vec<CellId> {
    mesh.cells().filter(|&c| mesh.cell(c).contains(&v)).collect()
}

/// The smallest barycentric coordinate of a point in a cell, from coordinates.
pub fn depth<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, c: CellId, p: &[f64; D]) -> f64 {
    let lambda = geometry::barycentric(&mesh.corners(c), p).unwrap();
    lambda.into_iter().fold(f64::INFINITY, f64::min)
}

/// Panics unless `change` leads from the live cells and vertices before to those of `mesh`.
pub fn assert_net<const D: usize, const N: usize>(
    before: &SimplexMesh<D, N>,
    mesh: &SimplexMesh<D, N>,
    change: &MeshChange,
) {
    let mut live: std::collections::BTreeSet<CellId> = before.cells().collect();
    for cell in &change.died {
        assert!(live.remove(cell), "{cell:?} died twice or was not alive");
        assert!(!mesh.is_live(*cell) || change.born.contains(cell));
    }
    for &cell in &live {
        assert_eq!(before.corners(cell), mesh.corners(cell), "{cell:?} is another cell, unreported");
    }
    for cell in &change.born {
        assert!(live.insert(*cell), "{cell:?} was born twice or was alive");
    }
    assert!(live.into_iter().eq(mesh.cells()));
    assert!(change.died.is_sorted() && change.born.is_sorted());

    let mut vertices: std::collections::BTreeSet<VertexId> = before.vertices().collect();
    vertices.extend(change.vertices.iter().map(|birth| birth.vertex));
    for v in &change.removed {
        assert!(vertices.remove(v), "{v:?} was removed but neither there before nor born");
    }
    assert!(vertices.into_iter().eq(mesh.vertices()));
    assert!(change.removed.is_sorted());

    let mut field: Vec<f64> = before.points().as_flattened().to_vec();
    change.carry_field::<D>(&mut field);
    for v in mesh.vertices() {
        assert_eq!(field[v.index() * D..][..D], mesh.point(v), "origins reproduce positions, bit for bit");
    }
}

/// The live cells as sorted coordinates of their vertices, sorted: equal for meshes that differ in ids alone.
pub fn leaf_set<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Vec<[[u64; D]; N]> {
    let mut cells: Vec<[[u64; D]; N]> = mesh
        .cells()
        .map(|c| {
            // Bits order numbers well enough to compare sets; zeros have one sign.
            let mut corners = mesh.corners(c).map(|p| p.map(|x| (x + 0.0).to_bits()));
            corners.sort_unstable();
            corners
        })
        .collect();
    cells.sort_unstable();
    cells
}
