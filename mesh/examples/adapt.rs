//! The cost of small adaptive operations in a unit cube of two triangles or six tetrahedra, medians over repeats; and of a
//! large start mesh.
//!
//! ```text
//! cargo run --release -p stylet-mesh --example adapt
//! ```

use std::time::Instant;
use stylet_mesh::{BisectError, MeshChange, SimplexMesh, Sweep, generate::kuhn_box};

const SIZE: f64 = 1.0 / 128.0;
const ENTRY: [f64; 3] = [-0.01, 0.431, 0.527];
const TIP: [f64; 3] = [0.713, 0.489, 0.561];
const REPEATS: usize = 41;

/// The median of the times, in milliseconds, that `work` takes on what `prepare` makes.
fn median<T>(mut prepare: impl FnMut() -> T, mut work: impl FnMut(&mut T) -> Result<(), BisectError>) -> f64 {
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let mut input = prepare();
            let start = Instant::now();
            work(&mut input).expect("room");
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    times[REPEATS / 2]
}

fn cube<const D: usize, const N: usize>() -> SimplexMesh<D, N> {
    kuhn_box([0.0; D], [1.0; D], [1; D]).expect("a box")
}

fn needle(mesh: &mut SimplexMesh<3, 4>) -> Result<(), BisectError> {
    mesh.refine_along(ENTRY, TIP, SIZE, &mut MeshChange::default())
}

/// The part of the needle's path from `from` to `to` sizes behind its entry.
fn part(from: f64, to: f64) -> ([f64; 3], [f64; 3]) {
    let length = (0..3).map(|k| (TIP[k] - ENTRY[k]).powi(2)).sum::<f64>().sqrt();
    let at = |sizes: f64| std::array::from_fn(|k| ENTRY[k] + sizes * SIZE / length * (TIP[k] - ENTRY[k]));
    (at(from), at(to))
}

fn main() -> Result<(), BisectError> {
    let point = |mesh: &mut SimplexMesh<2, 3>| {
        mesh.refine_around([0.3141, 0.2718], 2_f64.powi(-20), &mut MeshChange::default())
    };
    println!("2D point to 2^-20      {:9.4} ms", median(cube, point));
    let point =
        |mesh: &mut SimplexMesh<3, 4>| mesh.refine_around([0.3141, 0.2718, 0.5772], SIZE, &mut MeshChange::default());
    println!("3D point to 2^-7       {:9.4} ms", median(cube, point));
    println!("3D needle to 2^-7      {:9.4} ms", median(cube, needle));
    let mut fine = cube();
    needle(&mut fine)?;
    let coarsen = |mesh: &mut SimplexMesh<3, 4>| {
        mesh.coarsen_everywhere(&mut MeshChange::default());
        Ok(())
    };
    println!("coarsened to {} cells   {:9.4} ms", 6, median(|| fine.clone(), coarsen));

    let (mut mesh, mut sweep) = (cube::<3, 4>(), Sweep::new(SIZE));
    let mut change = MeshChange::default();
    let mut times = Vec::new();
    for step in 0..64 {
        let (a, b) = part(f64::from(step), f64::from(step) + 28.0);
        change.clear();
        let start = Instant::now();
        sweep.follow(&mut mesh, a, b, &mut change)?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.remove(0);
    times.sort_unstable_by(f64::total_cmp);
    println!("needle step of 2^-7    {:9.4} ms in {} cells", times[31], mesh.n_cells());

    let start = Instant::now();
    let grid = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [32; 3]).expect("a box");
    println!("box of {} cells   {:9.1} ms", grid.n_cells(), start.elapsed().as_secs_f64() * 1e3);
    let (points, cells) = (grid.points().to_vec(), grid.cells().map(|c| grid.cell(c).map(|v| v.0)).collect());
    let start = Instant::now();
    let checked = SimplexMesh::<3, 4>::new(points, cells).expect("a mesh");
    println!("the same, checked      {:9.1} ms, {} cells", start.elapsed().as_secs_f64() * 1e3, checked.n_cells());
    Ok(())
}
