//! Paths of a needle tip through a box, for tests and benches: straight, curved and random ones, each made from a seed.

use crate::geometry::{dot, subtract};
use crate::random::SplitMix64;
use serde::{Deserialize, Serialize};

/// The kinds of paths.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub enum PathKind {
    /// One segment, up to 30 degrees off the normal of the skin.
    Straight,
    /// A circular arc that turns by up to 60 degrees, as bevel-tip needles make.
    Curved,
    /// A smooth walk: after each stride the direction turns by a random angle of up to 20 degrees, about a random axis;
    /// near the boundary it is bent back inside.
    Random,
}

/// Part of the box that paths keep away from the sides and the back.
const CLEARANCE: f64 = 0.15;
/// Part of the box in front of the skin where paths begin.
const RUN_UP: f64 = 0.02;
/// Vertices of a curved path.
const CHORDS: usize = 100;

/// A polyline that begins outside the box, enters it through its upper face along the last axis, and ends inside.
///
/// `stride` is the distance after which a random path turns, a positive length; about a mean edge is apt.
pub fn path<const D: usize>(kind: PathKind, lower: [f64; D], upper: [f64; D], stride: f64, seed: u64) -> Vec<[f64; D]> {
    let mut random = SplitMix64::new(seed);
    let size: [f64; D] = subtract(&upper, &lower);
    let extent = size.iter().fold(f64::INFINITY, |m: f64, &x| m.min(x));
    let mut at: [f64; D] = std::array::from_fn(|k| lower[k] + size[k] * (0.3 + 0.4 * random.unit()));
    at[D - 1] = upper[D - 1] + RUN_UP * extent;
    // Within a cone of 30 degrees around the inward normal.
    let mut direction = random_direction::<D>(&mut random);
    direction[D - 1] = 0.0;
    direction = unit(direction).map(|x| x * (30_f64.to_radians() * random.unit()).tan());
    direction[D - 1] = -1.0;
    let mut direction = unit(direction);
    let sideways = perpendicular(&direction, random_direction(&mut random));
    let turn = 60_f64.to_radians() * random.unit();
    let length = extent * (0.5 + 0.3 * random.unit());
    let is_inside = |p: &[f64; D]| {
        (0..D).all(|k| {
            let top = if k == D - 1 { 2.0 } else { 1.0 - CLEARANCE };
            (CLEARANCE..=top).contains(&((p[k] - lower[k]) / size[k]))
        })
    };
    let mut points = vec![at];
    match kind {
        PathKind::Straight => {
            for _ in 0..CHORDS {
                let next = along(&at, &direction, length / CHORDS as f64);
                if !is_inside(&next) {
                    break;
                }
                at = next;
            }
            points.push(at);
        }
        PathKind::Curved => {
            for i in 0..CHORDS {
                let angle = turn * (i as f64 + 0.5) / CHORDS as f64;
                let heading: [f64; D] = std::array::from_fn(|k| angle.cos() * direction[k] + angle.sin() * sideways[k]);
                let next = along(&at, &heading, length / CHORDS as f64);
                if !is_inside(&next) {
                    break;
                }
                at = next;
                points.push(at);
            }
        }
        PathKind::Random => {
            let strides = (1.5 * length / stride).ceil().clamp(1.0, 10_000.0) as usize;
            for _ in 0..strides {
                let mut next = along(&at, &direction, stride);
                let mut tries = 0;
                while !is_inside(&next) && tries < 50 {
                    // Towards the middle, a little more each time.
                    let inwards: [f64; D] = std::array::from_fn(|k| lower[k] + 0.5 * size[k] - at[k]);
                    let inwards = unit(inwards);
                    direction = unit(std::array::from_fn(|k| direction[k] + 0.2 * inwards[k]));
                    next = along(&at, &direction, stride);
                    tries += 1;
                }
                if !is_inside(&next) {
                    break;
                }
                at = next;
                points.push(at);
                let angle = 20_f64.to_radians() * random.unit();
                let side = perpendicular(&direction, random_direction(&mut random));
                direction = unit(std::array::from_fn(|k| angle.cos() * direction[k] + angle.sin() * side[k]));
            }
        }
    }
    points
}

fn along<const D: usize>(p: &[f64; D], direction: &[f64; D], length: f64) -> [f64; D] {
    std::array::from_fn(|k| p[k] + length * direction[k])
}

fn unit<const D: usize>(v: [f64; D]) -> [f64; D] {
    let norm = dot(&v, &v).sqrt();
    if norm > 0.0 { v.map(|x| x / norm) } else { std::array::from_fn(|k| f64::from(u8::from(k == 0))) }
}

/// The direction of `v` without its part along the unit vector `u`.
fn perpendicular<const D: usize>(u: &[f64; D], v: [f64; D]) -> [f64; D] {
    let part = dot(u, &v);
    unit(std::array::from_fn(|k| v[k] - part * u[k]))
}

/// Uniform on the unit sphere, by rejection.
fn random_direction<const D: usize>(random: &mut SplitMix64) -> [f64; D] {
    loop {
        let v: [f64; D] = std::array::from_fn(|_| 2.0 * random.unit() - 1.0);
        let norm2 = dot(&v, &v);
        if norm2 > 1e-4 && norm2 <= 1.0 {
            return unit(v);
        }
    }
}
