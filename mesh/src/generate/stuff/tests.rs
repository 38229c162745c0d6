use super::*;
use crate::generate::implicit::Implicit;
use crate::geometry::signed_measure;
use crate::quality;

struct Ellipsoid {
    centre: [f64; 3],
    radii: [f64; 3],
}

impl Implicit for Ellipsoid {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let norm = |power: i32| -> f64 {
            (0..3).map(|k| ((p[k] - self.centre[k]) / self.radii[k].powi(power)).powi(2)).sum::<f64>().sqrt()
        };
        let (scaled, slope) = (norm(1), norm(2));
        if slope == 0.0 {
            return -self.radii.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        }
        scaled * (scaled - 1.0) / slope
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        let corner = |s: f64| std::array::from_fn(|k| self.centre[k] + s * self.radii[k]);
        Some([corner(-1.0), corner(1.0)])
    }
}

#[test]
fn ellipsoid() {
    let strata = Strata::new(vec![Box::new(Ellipsoid { centre: [0.05; 3], radii: [0.025, 0.020, 0.0175] })]);
    for size in [0.002, 0.003, 0.004, 0.005, 0.006] {
        let start = std::time::Instant::now();
        let tets = stuff(&strata, [[0.0; 3], [0.1; 3]], &Settings::new(size)).unwrap();
        let t = start.elapsed();
        let n = tets.cells.len();
        let mut volumes = [0.0; 2];
        let mut angles = [(180.0_f64, 0.0_f64); 2];
        for (cell, region) in tets.cells.iter().zip(&tets.regions) {
            let corners = cell.map(|v| tets.points[v as usize]);
            volumes[*region as usize] += signed_measure(&corners);
            let (min, max) = quality::angles_deg(&corners);
            let a = &mut angles[*region as usize];
            *a = (a.0.min(min), a.1.max(max));
        }
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 0.025 * 0.020 * 0.0175;
        println!("{size} {n} {:?} {:.3e}/s {angles:?} {}", t, n as f64 / t.as_secs_f64(), volumes[0] / exact - 1.0);
        assert!((volumes[0] + volumes[1] - 1e-3).abs() < 1e-15);
        tets.into_mesh().unwrap().check_invariants().unwrap();
    }
}
