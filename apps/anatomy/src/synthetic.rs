//! A study that no patient gave: smooth shapes of the size of the organs around a prostate, clicked by a program.
//!
//! Axes are the patient's: x to the left, y to the back, z to the head; the prostate's middle is the origin. Slices are 5 mm
//! apart; clicks are rounded to pixels of 0.181 mm (Goksel 2004, chapter 3 and 4: the slices and pixels of transrectal
//! ultrasound), stand about 3 mm apart, stray by up to 0.2 mm, and now and then come twice.

use std::f64::consts::TAU;
use stylet_mesh::generate::contours::{Drawing, PlanarContour};
use stylet_mesh::random::SplitMix64;

/// Distance of the slices, mm.
const SLICE: f64 = 5.0;
/// Pixel, mm.
const PIXEL: f64 = 0.181;
/// Clicks are about this far apart (mm), but on a contour there are at least [`FEWEST`].
const SPACING: f64 = 3.0;
const FEWEST: f64 = 12.0;
/// Of so many clicks one comes twice.
const TWICE: f64 = 60.0;

/// Urethra, prostate, rectum and pubic bone, in this order of precedence; another seed makes another patient.
pub fn study(seed: u64) -> Vec<Drawing> {
    let mut hand = Hand(SplitMix64::new(seed));
    let organs: [(&str, Outlines, [i32; 2]); 4] = [
        ("urethra", urethra(&mut hand), [-7, 6]),
        ("prostate", prostate(&mut hand), [-4, 4]),
        ("rectum", rectum(&mut hand), [-7, 7]),
        ("pubic bone", pubic_bone(&mut hand), [-5, 3]),
    ];
    let draw = |(name, outlines, slices): (&str, Outlines, [i32; 2])| {
        let heights = (slices[0]..=slices[1]).map(|i| f64::from(i) * SLICE);
        let mut contours = Vec::new();
        for z in heights {
            contours.extend(outlines(z).iter().map(|outline| clicked(&mut hand, outline, z)));
        }
        Drawing { name: name.into(), contours }
    };
    organs.into_iter().map(draw).collect()
}

/// The closed curves (mm, over an angle) that bound an organ at a height z (mm).
type Outlines = Box<dyn Fn(f64) -> Vec<Curve>>;
type Curve = Box<dyn Fn(f64) -> [f64; 2]>;

/// An ellipsoid of about 50 x 34 x 46 mm, narrower to the apex, flat with a groove at the back.
fn prostate(hand: &mut Hand) -> Outlines {
    let [width, depth, half] = [25.0 * hand.about_one(0.06), 17.0 * hand.about_one(0.06), 23.0 * hand.about_one(0.015)];
    let bumps = Bumps::new(hand, 0.02);
    Box::new(move |z| {
        let s = z / half;
        let size = (1.0 - s * s).sqrt();
        let (width, depth) = (width * size * (1.0 + 0.12 * s), depth * size);
        vec![Box::new(move |a: f64| {
            let r = bumps.at(a, z);
            // The back half is flatter, and hollow in the middle.
            let back = a.sin().max(0.0);
            let flat = 1.0 - 0.12 * back - 0.06 * back.powi(8);
            [width * r * a.cos(), 1.5 * s + depth * r * flat * a.sin()]
        })]
    })
}

/// A tube of 6 to 7 mm through the prostate, bent forwards by about 30 degrees in its middle.
fn urethra(hand: &mut Hand) -> Outlines {
    let radius = 3.3 * hand.about_one(0.08);
    let bend = 0.58 * hand.about_one(0.1);
    let bumps = Bumps::new(hand, 0.03);
    Box::new(move |z| {
        // Straight below, straight above, and a bend of some 5 mm between.
        let above = 5.0 * (1.0 + ((z + 2.0) / 5.0).exp()).ln();
        let centre = 4.0 + 0.08 * z - bend * above;
        vec![Box::new(move |a: f64| {
            let r = radius * bumps.at(a, z);
            [1.1 * r * a.cos(), centre + r * a.sin()]
        })]
    })
}

/// A wide tube right behind, pressed flat in front by the probe, that bends back to the sacrum.
fn rectum(hand: &mut Hand) -> Outlines {
    let [width, depth] = [17.0 * hand.about_one(0.08), 13.0 * hand.about_one(0.06)];
    let bumps = Bumps::new(hand, 0.03);
    Box::new(move |z| {
        let centre = 33.5 + 0.004 * z * z;
        let swell = 1.0 + 0.06 * (z / 14.0).sin();
        vec![Box::new(move |a: f64| {
            let r = swell * bumps.at(a, z);
            let front = (-a.sin()).max(0.0);
            [width * r * a.cos(), centre + depth * r * (1.0 - 0.1 * front * front) * a.sin()]
        })]
    })
}

/// The symphysis in front, a bow that opens to the back; below it the two rami, which part downwards.
fn pubic_bone(hand: &mut Hand) -> Outlines {
    let [width, thick] = [27.0 * hand.about_one(0.06), 7.0 * hand.about_one(0.08)];
    let bumps = Bumps::new(hand, 0.02);
    Box::new(move |z| {
        let below = -7.5 - z;
        if below < 0.0 {
            let width = width * (1.0 + 0.008 * z);
            return vec![Box::new(move |a: f64| {
                let r = bumps.at(a, z);
                let x = width * r * a.cos();
                [x, -36.0 + x * x / 70.0 + thick * r * a.sin()]
            })];
        }
        let ramus = |side: f64| -> Curve {
            Box::new(move |a: f64| {
                let r = bumps.at(side * a, z);
                let (along, across) = (10.0 * r * a.cos(), 0.9 * thick * r * a.sin());
                // The far end is farther back.
                [
                    side * (14.0 + 0.6 * below + 0.9 * along - 0.4 * across),
                    -32.0 + 0.3 * below + 0.4 * along + 0.9 * across,
                ]
            })
        };
        vec![ramus(1.0), ramus(-1.0)]
    })
}

/// A slow wave around the outline and along it, so that no two slices are alike.
#[derive(Clone, Copy)]
struct Bumps {
    height: f64,
    phases: [[f64; 2]; 3],
}

impl Bumps {
    fn new(hand: &mut Hand, height: f64) -> Self {
        let mut phase = || TAU * hand.unit();
        Self { height, phases: std::array::from_fn(|_| [phase(), phase()]) }
    }

    /// A factor of the radius around one.
    fn at(&self, angle: f64, z: f64) -> f64 {
        let wave = |(k, [around, along]): (usize, &[f64; 2])| {
            let waves = (k + 2) as f64;
            (waves * angle + around + (z / 25.0 + along).sin()).sin() / waves
        };
        1.0 + self.height * self.phases.iter().enumerate().map(wave).sum::<f64>()
    }
}

/// The outline as a person clicks it.
fn clicked(hand: &mut Hand, outline: &Curve, z: f64) -> PlanarContour {
    const FINE: usize = 720;
    let fine: Vec<[f64; 2]> = (0..FINE).map(|i| outline(i as f64 / FINE as f64 * TAU)).collect();
    let mut along = vec![0.0];
    for i in 0..FINE {
        let (p, q) = (fine[i], fine[(i + 1) % FINE]);
        along.push(along[i] + f64::hypot(q[0] - p[0], q[1] - p[1]));
    }
    let perimeter = along[FINE];
    let clicks = (perimeter / SPACING).max(FEWEST).round();
    let mut points = Vec::new();
    for i in 0..clicks as usize {
        let target = perimeter * (i as f64 + 0.5 + 0.5 * (hand.unit() - 0.5)) / clicks;
        let place = along.partition_point(|&l| l <= target).min(FINE) - 1;
        let p = fine[place].map(|x| pixel(x + 0.4 * (hand.unit() - 0.5)));
        let times = if hand.unit() * TWICE < 1.0 { 2 } else { 1 };
        points.extend(std::iter::repeat_n([p[0] / 1e3, p[1] / 1e3, z / 1e3], times));
    }
    PlanarContour::closed(points)
}

/// The nearest pixel, as the decimal number that a file has for it.
fn pixel(mm: f64) -> f64 {
    // Thousandths are whole: pixels are 181 of them.
    (mm / PIXEL).round() * (PIXEL * 1e3).round() / 1e3
}

/// Who draws: no two clicks are alike.
struct Hand(SplitMix64);

impl Hand {
    /// Uniform in `0..1`.
    fn unit(&mut self) -> f64 {
        self.0.unit()
    }

    /// Uniform within `range` around one.
    fn about_one(&mut self, range: f64) -> f64 {
        1.0 + range * (2.0 * self.unit() - 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_mesh::generate::contours::{ContourSet, ContourSettings, Repair};

    /// Volumes as in the literature: prostates have 22 to 106 mL, 49 on average (Brachytherapy 13 (2014) 465).
    #[test]
    fn every_seed_makes_plausible_organs() {
        for seed in 0..40 {
            let (set, repairs) = ContourSet::new(&study(seed), &ContourSettings::default()).unwrap();
            assert!(repairs.iter().all(|r| matches!(r, Repair::DuplicatePoints { .. })), "seed {seed}: {repairs:?}");
            let ml: Vec<f64> = set.organs().iter().map(|organ| organ.volume() * 1e6).collect();
            let plausible = [(1.5, 4.0), (30.0, 50.0), (35.0, 70.0), (12.0, 40.0)];
            assert!(ml.iter().zip(plausible).all(|(v, (low, high))| low < *v && *v < high), "seed {seed}: {ml:?}");
            // The urethra passes through the prostate, the rectum stays behind it.
            let centre = set.organs()[1].slices()[4].z;
            assert_eq!(centre, 0.0);
        }
    }

    #[test]
    fn points_are_on_pixels() {
        let [x, y] = study(3)[1].contours[2].points.iter().map(|p| [p[0], p[1]]).next().unwrap();
        for mm in [x * 1e3, y * 1e3] {
            assert!((mm / PIXEL - (mm / PIXEL).round()).abs() < 1e-9);
        }
    }
}
