//! One solid as stuffing sees it: values at points, cut points of edges, the way to a surface.

use super::GenerateError;
use crate::generate::implicit::Implicit;
use crate::geometry::{distance2, dot, subtract};

/// Values are cut off here, so that their sums and products stay finite.
const LARGEST: f64 = 1e30;
/// Steps of root finding; each third one halves the interval at least.
const MAX_STEPS: usize = 150;
/// Width of the interval at which a cut point is found, as part of its edge.
const WIDTH: f64 = 1e-12;
/// Steps of Newton's method towards several surfaces.
const MAX_NEWTON: usize = 16;

/// A solid, its place in the order, and its bounds.
pub(super) struct Surface<'a> {
    pub solid: usize,
    implicit: &'a dyn Implicit,
    bounds: Option<[[f64; 3]; 2]>,
}

impl<'a> Surface<'a> {
    pub fn new(solid: usize, implicit: &'a dyn Implicit) -> Self {
        Self { solid, implicit, bounds: implicit.bounds() }
    }

    /// Signed distance, m.
    pub fn value(&self, p: &[f64; 3]) -> Result<f64, GenerateError> {
        let value = self.implicit.distance(p);
        if value.is_nan() {
            return Err(GenerateError::NotANumber { solid: self.solid, point: *p });
        }
        Ok(value.clamp(-LARGEST, LARGEST))
    }

    /// A number with the sign of the distance, found sooner: further than `margin` outside the bounds of the solid it is the
    /// distance to these along an axis.
    pub fn side(&self, p: &[f64; 3], margin: f64) -> Result<f64, GenerateError> {
        let Some([lower, upper]) = &self.bounds else { return self.value(p) };
        let outside = (0..3).map(|k| (lower[k] - p[k]).max(p[k] - upper[k])).fold(f64::NEG_INFINITY, f64::max);
        if outside > margin { Ok(outside) } else { self.value(p) }
    }

    /// The gradient by central differences, along the axes that are `free`.
    pub fn slope(&self, p: &[f64; 3], free: [bool; 3], step: f64) -> Result<[f64; 3], GenerateError> {
        let mut slope = [0.0; 3];
        for k in (0..3).filter(|k| free[*k]) {
            let (mut low, mut high) = (*p, *p);
            low[k] -= step;
            high[k] += step;
            slope[k] = (self.value(&high)? - self.value(&low)?) / (high[k] - low[k]);
        }
        Ok(slope)
    }

    /// Whether a box meets the bounds of the solid.
    pub fn may_hold(&self, lower: &[f64; 3], upper: &[f64; 3]) -> bool {
        self.bounds.is_none_or(|[low, high]| (0..3).all(|k| low[k] <= upper[k] && lower[k] <= high[k]))
    }

    /// Where the surface cuts the segment from `a` to `b`, as a part of its length, given values of opposite sign at the
    /// ends: the rule of false position with the modification of Illinois, and a halving where that is slow.
    pub fn root(&self, [a, b]: [&[f64; 3]; 2], [fa, fb]: [f64; 2]) -> Result<f64, GenerateError> {
        let (mut s, mut fs, mut t, mut ft) = (0.0, fa, 1.0, fb);
        let mut before = 1.0_f64;
        for step in 1..=MAX_STEPS {
            let false_position = s + (t - s) * (fs / (fs - ft));
            let slow = step % 3 == 0 && (t - s).abs() > 0.5 * before;
            let x = if slow || !(false_position > s.min(t) && false_position < s.max(t)) {
                0.5 * (s + t)
            } else {
                false_position
            };
            if step % 3 == 0 {
                before = (t - s).abs();
            }
            let fx = self.value(&between(a, b, x))?;
            if fx == 0.0 {
                return Ok(x);
            }
            // `t` is the latest point, `s` the one on the other side of the surface.
            if (fx < 0.0) == (ft < 0.0) {
                fs *= 0.5;
            } else {
                (s, fs) = (t, ft);
            }
            (t, ft) = (x, fx);
            if (t - s).abs() <= WIDTH || fx.abs() <= WIDTH * fa.abs().min(fb.abs()) {
                return Ok(x);
            }
        }
        Ok(t)
    }
}

/// The point at a part `t` of the way from `a` to `b`.
pub(super) fn between(a: &[f64; 3], b: &[f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + t * (b[k] - a[k]))
}

/// The first solid that holds a point, by its place in `surfaces`.
pub(super) fn holder(surfaces: &[Surface], p: &[f64; 3]) -> Result<Option<usize>, GenerateError> {
    for (i, surface) in surfaces.iter().enumerate() {
        if surface.side(p, 0.0)? < 0.0 {
            return Ok(Some(i));
        }
    }
    Ok(None)
}

/// The way from `start` to a point on up to three surfaces at once, by Newton's method with the shortest steps, along the
/// axes that are `free`; `None` if it is not found within `reach`.
///
/// `scale` is a length over which the surfaces are nearly planar.
pub(super) fn project(
    surfaces: &[&Surface],
    start: &[f64; 3],
    free: [bool; 3],
    reach: f64,
    scale: f64,
) -> Result<Option<[f64; 3]>, GenerateError> {
    let n = surfaces.len();
    if n > free.iter().filter(|f| **f).count() {
        return Ok(None);
    }
    let mut p = *start;
    for _ in 0..MAX_NEWTON {
        let (mut values, mut normals) = ([0.0; 3], [[0.0; 3]; 3]);
        for i in 0..n {
            values[i] = surfaces[i].value(&p)?;
            normals[i] = surfaces[i].slope(&p, free, 1e-5 * scale)?;
        }
        if values.iter().all(|v| v.abs() <= 1e-10 * scale) {
            return Ok(Some(p));
        }
        let Some(step) = shortest_step(&normals[..n], &values[..n]) else { return Ok(None) };
        p = std::array::from_fn(|k| p[k] - step[k]);
        let moved2 = distance2(&p, start);
        if moved2.is_nan() || moved2 > reach * reach {
            return Ok(None);
        }
    }
    Ok(None)
}

/// The shortest `d` with `normals[i] . d = values[i]`: a combination of the normals made orthogonal one after another.
/// `None` where they are nearly parallel.
fn shortest_step(normals: &[[f64; 3]], values: &[f64]) -> Option<[f64; 3]> {
    let (mut step, mut basis) = ([0.0; 3], [[0.0; 3]; 3]);
    for i in 0..normals.len() {
        let mut direction = normals[i];
        for b in &basis[..i] {
            let along = dot(&direction, b);
            direction = subtract(&direction, &b.map(|x| along * x));
        }
        let length = dot(&direction, &direction).sqrt();
        if length.is_nan() || length <= 0.1 * dot(&normals[i], &normals[i]).sqrt() {
            return None;
        }
        basis[i] = direction.map(|x| x / length);
        let missing = (values[i] - dot(&normals[i], &step)) / length;
        step = std::array::from_fn(|k| step[k] + missing * basis[i][k]);
    }
    Some(step)
}
