//! Stuffs an ellipsoid of 50 x 40 x 35 mm in a box of 100 mm at several sizes, and prints counts, angles, volumes and speed.
//!
//! `cargo run --release -p stylet-mesh --example ellipsoid [SIZE_MM ...]`

use std::ops::ControlFlow;
use std::time::Instant;
use stylet_mesh::generate::implicit::{Implicit, Strata};
use stylet_mesh::generate::stuff::{Settings, stuff};
use stylet_mesh::quality;

const RADII: [f64; 3] = [0.025, 0.020, 0.0175];

struct Ellipsoid;

impl Implicit for Ellipsoid {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        // To first order: the value of the quadric over its slope.
        let norm = |power: i32| (0..3).map(|k| ((p[k] - 0.05) / RADII[k].powi(power)).powi(2)).sum::<f64>().sqrt();
        let (scaled, slope) = (norm(1), norm(2));
        if slope == 0.0 { -RADII[2] } else { scaled * (scaled - 1.0) / slope }
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some([RADII.map(|r| 0.05 - r), RADII.map(|r| 0.05 + r)])
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut sizes: Vec<f64> = std::env::args().skip(1).map(|s| s.parse()).collect::<Result<_, _>>()?;
    if sizes.is_empty() {
        sizes = vec![6.0, 5.0, 4.0, 2.0, 1.0];
    }
    let strata = Strata::new(vec![Box::new(Ellipsoid)]);
    let exact = 4.0 / 3.0 * std::f64::consts::PI * RADII.iter().product::<f64>();
    println!("size, mm   tets   vertices   tets/s   angles, degrees   volume   border, mm");
    for size in sizes {
        let start = Instant::now();
        let mut hook = |_| ControlFlow::Continue(());
        let settings = Settings { coarsest: 8e-3 * size, ..Settings::new(1e-3 * size) };
        let stuffed = stuff(&strata, [[0.0; 3], [0.1; 3]], &settings, &mut hook)?;
        let seconds = start.elapsed().as_secs_f64();
        let (tets, report) = (stuffed.tets, stuffed.report);
        let each = tets.cells.iter().map(|c| quality::angles_deg(&c.map(|v| tets.points[v as usize])));
        let (min, max) = each.fold((180.0_f64, 0.0_f64), |(min, max), (a, b)| (min.min(a), max.max(b)));
        println!(
            "{size}   {}   {}   {:.2e}   {min:.2} to {max:.2}   {:+.2} %   {:.1e}",
            tets.cells.len(),
            tets.points.len(),
            tets.cells.len() as f64 / seconds,
            100.0 * (report.volumes[0] / exact - 1.0),
            1e3 * report.border_error
        );
    }
    Ok(())
}
