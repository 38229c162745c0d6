#![no_main]

// Any mesh data becomes a valid mesh, which can be refined, or an error.

use stylet_mesh::{
    InvariantError, MeshChange, SimplexMesh,
    io::{Format, MeshData, read_bytes},
};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok((data, _)) = read_bytes(Format::Msh41, bytes) {
        refine::<2, 3>(&data);
        refine::<3, 4>(&data);
        refine::<3, 3>(&data);
        refine::<3, 2>(&data);
    }
});

fn refine<const D: usize, const N: usize>(data: &MeshData) {
    let sub = data.submesh::<D, N>();
    let Ok(mut mesh) = SimplexMesh::<D, N>::new(sub.points, sub.cells) else { return };
    mesh.set_slot_limit(20_000);
    let first = mesh.cells().next().expect("a mesh has cells");
    let corners = mesh.corners(first);
    let centre = std::array::from_fn(|k| corners.iter().map(|p| p[k] / N as f64).sum());
    let size = 0.3 * mesh.longest_edge(first);
    // Running into a limit is an answer.
    let _ = mesh.refine_around(centre, size, &mut MeshChange::default());
    match mesh.check_invariants() {
        Err(InvariantError::Measure { what, expected, found }) => {
            let difference = (expected - found).abs();
            assert!(difference <= rounding(&mesh, what), "the {what} was {expected:e} and is {found:e}");
        }
        result => result.expect("a refined mesh is valid"),
    }
}

/// How much the rounding of midpoints can change a measure. The check compares sums to a part of themselves, which cells
/// a million times as long as they are high, of which fuzzing is fond, do not keep: a corner that moves by `e` changes the
/// measure of a cell by up to `e` times that of the facet opposite.
fn rounding<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, what: &str) -> f64 {
    let dimension = if what == "volume" { N as i32 - 1 } else { N as i32 - 2 };
    let largest = mesh.points().as_flattened().iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let facets: f64 = mesh.cells().map(|c| (N * N) as f64 * mesh.longest_edge(c).powi((dimension - 1).max(0))).sum();
    f64::EPSILON * largest * facets
}
