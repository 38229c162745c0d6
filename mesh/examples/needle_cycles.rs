//! Drives needles into a box of tetrahedra and out again, and prints angles, operations and times.
//!
//! ```text
//! cargo run --release -p stylet-mesh --example needle_cycles -- [parts per axis] [cycles of each kind] [first seed]
//! ```
//!
//! Environment: `SMOOTH` and `GOOD` are the settings of the remesher, `STEPS` prints every step, `NOANGLES` leaves angles
//! unmeasured, for profilers.

use stylet_mesh::{
    generate::kuhn_box,
    quality,
    remesh::{
        CycleSettings, Motion, Operations, Remesher, drive,
        paths::{PathKind, path},
    },
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1).map(|arg| arg.parse::<usize>());
    let parts = args.next().transpose()?.unwrap_or(13);
    let cycles = args.next().transpose()?.unwrap_or(30);
    let first = args.next().transpose()?.unwrap_or(0);
    let mut mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [parts; 3])?;
    let edge = (3.0 + 3.0 * 2_f64.sqrt() + 3_f64.sqrt()) / 7.0 / parts as f64;
    let var = |name: &str, default: f64| std::env::var(name).ok().and_then(|x| x.parse().ok()).unwrap_or(default);
    let settings_of_remesher =
        stylet_mesh::remesh::Settings { smoothed_vertices: var("SMOOTH", 8.0) as u32, good_quality: var("GOOD", 0.5) };
    println!("{} tetrahedra, mean edge {edge:.4}", mesh.n_cells());
    for kind in [PathKind::Straight, PathKind::Curved, PathKind::Random] {
        let (mut steps, mut seconds, mut operations) = (0, 0.0, Operations::default());
        let (mut narrow, mut deep, mut worst) = (0, 0, (180.0_f64, 0.0_f64));
        let (mut restored, mut error, mut failed) = (0, 0.0_f64, 0);
        let mut minima = Vec::new();
        for seed in first..first + cycles {
            let path = path(kind, [0.0; 3], [1.0; 3], edge, seed as u64);
            let settings = CycleSettings {
                step: 0.2 * edge,
                measure_angles: std::env::var_os("NOANGLES").is_none(),
                shallow_steps: 21,
            };
            let mut remesher = Remesher::with_settings(settings_of_remesher);
            let outcome = drive(&mut mesh, &mut remesher, &path, &settings, |step, _, _, _, _| {
                if step.depth > 20 {
                    deep += 1;
                    narrow += usize::from(step.min_angle_deg < 8.0 || step.max_angle_deg > 165.0);
                }
                if std::env::var_os("STEPS").is_some() {
                    let way = if step.motion == Motion::Penetrating { "in" } else { "out" };
                    println!(
                        "{seed} {way} {} {:.2} {:.2} {:?}",
                        step.depth, step.min_angle_deg, step.max_angle_deg, step.report.operations
                    );
                }
            });
            match outcome {
                Ok(report) => {
                    steps += report.steps;
                    seconds += report.seconds;
                    operations.add(&report.operations);
                    worst = (worst.0.min(report.min_angle_deg), worst.1.max(report.max_angle_deg));
                    minima.push((report.min_angle_deg, report.max_angle_deg));
                    restored += usize::from(report.topology_restored);
                    error = error.max(report.max_position_error);
                }
                Err(error) => {
                    println!("{kind:?} {seed}: {error}");
                    failed += 1;
                    mesh = kuhn_box([0.0; 3], [1.0; 3], [parts; 3])?;
                }
            }
        }
        println!(
            "{kind:?}: {steps} steps, {:.1} us/step, angles {:.2}..{:.2} deg after step 20, {:.3} % of {deep} steps outside 8..165, \
             restored {restored} of {cycles}, position error {error:e}, failed {failed}, {operations:?}",
            1e6 * seconds / steps as f64,
            worst.0,
            worst.1,
            100.0 * narrow as f64 / deep as f64,
        );
        minima.sort_by(|a, b| a.0.total_cmp(&b.0));
        println!("   smallest per cycle: {:.2?}", minima.iter().take(8).collect::<Vec<_>>());
    }
    println!(
        "the mesh has {} slots for {} cells, {} vertices; {:?}",
        mesh.n_slots(),
        mesh.n_cells(),
        mesh.n_vertices(),
        quality::summary(&mesh)
    );
    mesh.check_invariants()?;
    Ok(())
}
