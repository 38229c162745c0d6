//! One triangle: the point nearest to another, angles, and whether two of them touch.

use crate::geometry::{cross, distance2, dot, norm, subtract};

/// Where in a triangle a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Feature {
    Face,
    /// The edge from a corner to the next.
    Edge(usize),
    Corner(usize),
}

/// The point of a triangle nearest to `p`.
///
/// Source: Ericson, *Real-Time Collision Detection* (2005), section 5.1.5.
pub(super) fn nearest(p: &[f64; 3], [a, b, c]: &[[f64; 3]; 3]) -> ([f64; 3], Feature) {
    let (ab, ac) = (subtract(b, a), subtract(c, a));
    let to = |from: &[f64; 3]| {
        let d = subtract(p, from);
        (dot(&ab, &d), dot(&ac, &d))
    };
    let (a1, a2) = to(a);
    if a1 <= 0.0 && a2 <= 0.0 {
        return (*a, Feature::Corner(0));
    }
    let (b1, b2) = to(b);
    if b1 >= 0.0 && b2 <= b1 {
        return (*b, Feature::Corner(1));
    }
    let (c1, c2) = to(c);
    if c2 >= 0.0 && c1 <= c2 {
        return (*c, Feature::Corner(2));
    }
    let along = |from: &[f64; 3], edge: &[f64; 3], t: f64| std::array::from_fn(|k| from[k] + t * edge[k]);
    let vc = a1 * b2 - b1 * a2;
    if vc <= 0.0 && a1 >= 0.0 && b1 <= 0.0 {
        return (along(a, &ab, a1 / (a1 - b1)), Feature::Edge(0));
    }
    let vb = c1 * a2 - a1 * c2;
    if vb <= 0.0 && a2 >= 0.0 && c2 <= 0.0 {
        return (along(a, &ac, a2 / (a2 - c2)), Feature::Edge(2));
    }
    let va = b1 * c2 - c1 * b2;
    if va <= 0.0 && b2 - b1 >= 0.0 && c1 - c2 >= 0.0 {
        let t = (b2 - b1) / ((b2 - b1) + (c1 - c2));
        return (along(b, &subtract(c, b), t), Feature::Edge(1));
    }
    let scale = 1.0 / (va + vb + vc);
    let (v, w) = (vb * scale, vc * scale);
    (std::array::from_fn(|k| a[k] + v * ab[k] + w * ac[k]), Feature::Face)
}

/// The unit normal by the right-hand rule.
pub(super) fn unit_normal([a, b, c]: &[[f64; 3]; 3]) -> [f64; 3] {
    let n = cross(&subtract(b, a), &subtract(c, a));
    let length = norm(&n);
    n.map(|x| x / length)
}

/// The angles at the corners, rad.
pub(super) fn angles(corners: &[[f64; 3]; 3]) -> [f64; 3] {
    std::array::from_fn(|i| {
        let [u, v] = [1, 2].map(|k| subtract(&corners[(i + k) % 3], &corners[i]));
        norm(&cross(&u, &v)).atan2(dot(&u, &v))
    })
}

/// Whether two triangles without a common corner come nearer than `near`.
pub(super) fn touch(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3], near: f64) -> bool {
    if apart(a, b, near) || apart(b, a, near) {
        return false;
    }
    let corner_near = |p: &[f64; 3], t: &[[f64; 3]; 3]| distance2(p, &nearest(p, t).0) <= near * near;
    let edges = |t: &[[f64; 3]; 3]| [0, 1, 2].map(|i| [t[i], t[(i + 1) % 3]]);
    a.iter().any(|p| corner_near(p, b))
        || b.iter().any(|p| corner_near(p, a))
        || edges(a).iter().any(|e| edges(b).iter().any(|f| segments2(e, f) <= near * near))
        || edges(a).iter().any(|e| pierces(e, b))
        || edges(b).iter().any(|e| pierces(e, a))
}

/// Whether the plane of `a` has all of `b` on one side of it.
fn apart(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3], near: f64) -> bool {
    let normal = unit_normal(a);
    let heights = b.map(|p| dot(&subtract(&p, &a[0]), &normal));
    heights.iter().all(|h| *h > near) || heights.iter().all(|h| *h < -near)
}

/// Whether a segment goes through the inside of a triangle.
pub(super) fn pierces([p, q]: &[[f64; 3]; 2], [a, b, c]: &[[f64; 3]; 3]) -> bool {
    let side = |s: &[f64; 3], t: &[f64; 3], u: &[f64; 3], v: &[f64; 3]| {
        dot(&subtract(t, s), &cross(&subtract(u, s), &subtract(v, s)))
    };
    if side(p, a, b, c) * side(q, a, b, c) >= 0.0 {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    around.iter().all(|s| *s > 0.0) || around.iter().all(|s| *s < 0.0)
}

/// The squared distance of two segments.
///
/// Source: Ericson, *Real-Time Collision Detection* (2005), section 5.1.9.
fn segments2([p, p_end]: &[[f64; 3]; 2], [q, q_end]: &[[f64; 3]; 2]) -> f64 {
    let (u, v, w) = (subtract(p_end, p), subtract(q_end, q), subtract(p, q));
    let (uu, uv, vv, uw, vw) = (dot(&u, &u), dot(&u, &v), dot(&v, &v), dot(&u, &w), dot(&v, &w));
    let denominator = uu * vv - uv * uv;
    let mut s = if denominator > 0.0 { ((uv * vw - uw * vv) / denominator).clamp(0.0, 1.0) } else { 0.0 };
    let mut t = (uv * s + vw) / vv;
    if !(0.0..=1.0).contains(&t) {
        t = t.clamp(0.0, 1.0);
        s = ((uv * t - uw) / uu).clamp(0.0, 1.0);
    }
    let gap: [f64; 3] = std::array::from_fn(|k| w[k] + s * u[k] - t * v[k]);
    dot(&gap, &gap)
}
