//! Uniform refinement of a cube to about a million cells: cells per second and bytes per cell.
//!
//! ```text
//! cargo run --release -p stylet-mesh --example uniform -- 3           # dimension
//! valgrind --tool=callgrind target/release/examples/uniform 3 100000  # dimension, cells
//! ```

use std::time::Instant;
use stylet_mesh::{MeshChange, generate::kuhn_box};

/// The longest edge of a unit cube's simplices after the fewest bisections that leave at least `cells` of them.
fn size<const D: usize>(cells: usize) -> f64 {
    let start: usize = (1..=D).product();
    let bisections = (0..).find(|&n| start << n >= cells).unwrap_or(0);
    // Each bisection of a cycle takes one edge of the cube from the diagonal; a cycle halves it.
    ((D - bisections % D) as f64).sqrt() * 0.5_f64.powi((bisections / D) as i32)
}

fn run<const D: usize, const N: usize>(cells: usize) -> Result<(), Box<dyn std::error::Error>> {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D])?;
    let start = Instant::now();
    mesh.refine_everywhere(size::<D>(cells), &mut MeshChange::default())?;
    let seconds = start.elapsed().as_secs_f64();
    let n = mesh.n_cells();
    println!("{D}D: {n} cells, {} vertices, {:.1} bytes/cell", mesh.n_vertices(), mesh.bytes() as f64 / n as f64);
    println!("{seconds:.4} s, {:.3e} cells/s", n as f64 / seconds);
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<usize> = std::env::args().skip(1).map(|a| a.parse()).collect::<Result<_, _>>()?;
    let cells = arguments.get(1).copied().unwrap_or(1_000_000);
    match arguments.first() {
        Some(2) => run::<2, 3>(cells),
        None | Some(3) => run::<3, 4>(cells),
        Some(4) => run::<4, 5>(cells),
        Some(dimension) => Err(format!("dimension {dimension}: 2, 3 or 4").into()),
    }
}
