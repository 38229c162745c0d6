//! Drives a built-in scene from a program of your own, with a few keys changed on the way:
//!
//! ```text
//! cargo run --release -p stylet-needle --example insertion -- slab2d-insertion needle.speed=0.03 mesh.h_ref=7
//! cargo run --release -p stylet-needle --example insertion -- cube3d-insertion mesh.fold=20 material.model=neo-hookean
//! ```

use stylet_needle::{NeedleError, builtin};
use stylet_tissue::Scenario;

fn main() -> Result<(), NeedleError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, assignments) = match arguments.split_first() {
        Some((name, assignments)) => (name.as_str(), assignments),
        None => ("slab2d-insertion", &[][..]),
    };
    let scene = builtin::open(name, assignments)?;
    let mut run = scene.start(2)?;
    while !run.finished() {
        run.step()?;
    }
    let summary = run.summary(&[]);
    println!("cycles                 {}", summary.steps);
    println!("iterations, mean/max   {:.2} / {}", summary.solver.iterations_mean, summary.solver.iterations_max);
    println!("nodes, cells           {}, {}", summary.nodes, summary.elements);
    println!("time                   {:.3} s, {:.0} cycles/s", summary.wall_s, summary.update_hz);
    if let Some(needle) = summary.needle {
        let millimetres: Vec<f64> = needle.tip_reference.iter().map(|x| 1e3 * x).collect();
        println!("tip in the body        {millimetres:.2?} mm");
        println!("force at the base      {:.3?} N", needle.base_force);
        println!("needle nodes, sticking {}, {}", needle.nodes, needle.sticking);
    }
    for (stage, seconds, calls) in summary.stages.iter() {
        println!("  {stage:<12} {seconds:8.4} s {calls:8} calls");
    }
    Ok(())
}
