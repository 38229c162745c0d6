//! A body on a renumbered mesh is the same body, with its neighbours closer together.

use crate::support::{YOUNG, distorted_box, random_vector};
use proptest::prelude::*;
use stylet_mesh::{MeshChange, SimplexMesh, VertexId};
use stylet_physics::body::Body;
use stylet_physics::material::NeoHookean;
use stylet_physics::numbering::{in_reverse_cuthill_mckee_order, mean_bandwidth};
use stylet_solver::energy::Energy;
use stylet_solver::ordering::Permutation;

/// Numbers in an order that has nothing to do with the mesh.
fn shuffled<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, seed: u64) -> SimplexMesh<D, N> {
    let key = random_vector(mesh.n_vertices(), 1.0, seed);
    let mut order: Vec<u32> = (0..mesh.n_vertices() as u32).collect();
    order.sort_by(|&a, &b| key[a as usize].total_cmp(&key[b as usize]));
    mesh.renumbered(&order).unwrap()
}

/// Narrower by half at least, and no force is another one.
fn narrows<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, seed: u64) {
    let mesh = shuffled(mesh, seed);
    let (ordered, order) = in_reverse_cuthill_mckee_order(&mesh).unwrap();
    let (before, after) = (mean_bandwidth(&mesh), mean_bandwidth(&ordered));
    assert!(after < 0.5 * before, "a mean bandwidth of {before} becomes {after}");
    assert!(order.old_to_new().iter().zip(mesh.points()).all(|(&new, x)| ordered.point(VertexId(new)) == *x));

    let neo = NeoHookean::from_young_poisson(YOUNG, 0.34).unwrap();
    let (mut one, mut other) = (Body::new(&mesh, neo, 0.01).unwrap(), Body::new(&ordered, neo, 0.01).unwrap());
    let u = random_vector(one.dim(), 1e-5, seed);
    let [mut moved, mut f, mut g, mut back] = std::array::from_fn(|_| vec![0.0; u.len()]);
    order.permute::<D, f64>(&u, &mut moved);
    one.gradient(&u, &mut f);
    other.gradient(&moved, &mut g);
    order.restore::<D, f64>(&g, &mut back);
    let size = f.iter().map(|f| f.abs()).fold(0.0, f64::max);
    // The same terms in another order.
    assert!(size > 0.0 && f.iter().zip(&back).all(|(f, g)| (f - g).abs() <= 1e-12 * size));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn reverse_cuthill_mckee_narrows_the_band(seed: u64) {
        narrows(&distorted_box::<2, 3>(12, 0.1, seed), seed);
        narrows(&distorted_box::<3, 4>(6, 0.1, seed), seed);
    }
}

#[test]
fn the_mean_bandwidth_is_the_mean_distance_to_the_lowest_neighbour() {
    // Two triangles on 0, 1, 2 and 1, 2, 3: distances 0, 1, 2 and 2.
    let points = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let mesh = SimplexMesh::<2, 3>::new(points, vec![[0, 1, 2], [1, 3, 2]]).unwrap();
    assert_eq!(mean_bandwidth(&mesh), 5.0 / 4.0);
    // Of a path, reverse Cuthill-McKee numbers one behind the other.
    let path = SimplexMesh::<1, 2>::new(vec![[3.0], [0.0], [2.0], [1.0]], vec![[1, 3], [3, 2], [2, 0]]).unwrap();
    let (path, order) = in_reverse_cuthill_mckee_order(&path).unwrap();
    assert_eq!(mean_bandwidth(&path), 3.0 / 4.0);
    assert_eq!(Permutation::from_new_to_old(order.new_to_old().to_vec()).unwrap(), order);
}

#[test]
fn a_mesh_that_has_changed_keeps_its_numbers() {
    let mut mesh = distorted_box::<2, 3>(3, 0.1, 1);
    let first = mesh.cells().next().unwrap();
    mesh.bisect(&[first], &mut MeshChange::default()).unwrap();
    let error = in_reverse_cuthill_mckee_order(&mesh).unwrap_err();
    assert!(error.to_string().contains("has changed since"), "{error}");
}
