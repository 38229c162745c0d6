//! The corner that two edges make at an inner node: bending and twist as functions of the two edges.
//!
//! With unit tangents `t0`, `t1` of the edges `e0`, `e1` of lengths `a`, `b`, `c = t0.t1` and `kb = 2 t0 x t1 / (1 + c)`
//! the curvature binormal (Bergou et al. 2008, eq. (1), with the lengths that the edges have):
//!
//! ```text
//! |kb|^2 = 4 (1 - c) / (1 + c)
//! D0 = d kb / d e0 = -(2/(1 + c) [t1]x + kb t~') / a,  D1 = d kb / d e1 = (2/(1 + c) [t0]x - kb t~') / b,  t~ = (t0 + t1)/(1 + c)
//! ```
//!
//! Directors that do not spin turn with their edge by parallel transport, `dm = -t (m . dt)`. As `kb` is perpendicular to both
//! edges, `kb . dm = 0`: the components of `kb` in the directors change by `D` alone.

use nalgebra::{Matrix3, Vector3};

/// An edge as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Edge {
    pub tangent: Vector3<f64>,
    pub length: f64,
}

impl Edge {
    #[inline]
    pub fn between(from: &[f64; 3], to: &[f64; 3]) -> Self {
        let edge = Vector3::new(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
        let length = edge.norm();
        Self { tangent: edge / length, length }
    }
}

/// Derivatives by the two edges, `[e0, e1]`.
pub(super) type Pair = [Vector3<f64>; 2];

/// Second derivatives by the two edges: the blocks `00`, `01`, `11`.
pub(super) type Blocks = [Matrix3<f64>; 3];

pub(super) struct Corner {
    t0: Vector3<f64>,
    t1: Vector3<f64>,
    a: f64,
    b: f64,
    c: f64,
    /// `1 + c` and `1 - c`, free of cancellation.
    plus: f64,
    minus: f64,
}

impl Corner {
    #[inline]
    pub fn new(before: &Edge, after: &Edge) -> Self {
        let (t0, t1) = (before.tangent, after.tangent);
        let (plus, minus) = (0.5 * (t0 + t1).norm_squared(), 0.5 * (t1 - t0).norm_squared());
        Self { t0, t1, a: before.length, b: after.length, c: 0.5 * (plus - minus), plus, minus }
    }

    /// `kb`.
    #[inline]
    pub fn binormal(&self) -> Vector3<f64> {
        self.t0.cross(&self.t1) * (2.0 / self.plus)
    }

    /// `|kb|^2 / 2`.
    #[inline]
    pub fn half_square(&self) -> f64 {
        2.0 * self.minus / self.plus
    }

    /// Gradient of `c`.
    #[inline]
    fn cosine_gradient(&self) -> Pair {
        let d = self.t1 - self.t0;
        [(d + self.t0 * self.minus) / self.a, (self.t1 * self.minus - d) / self.b]
    }

    /// Gradient of `|kb|^2 / 2`.
    #[inline]
    pub fn half_square_gradient(&self) -> Pair {
        let slope = -4.0 / (self.plus * self.plus);
        self.cosine_gradient().map(|p| p * slope)
    }

    /// Hessian of `|kb|^2 / 2`.
    pub fn half_square_hessian(&self) -> Blocks {
        let (t0, t1, a, b, c) = (&self.t0, &self.t1, self.a, self.b, self.c);
        let slope = -4.0 / (self.plus * self.plus);
        let curvature = -2.0 * slope / self.plus;
        let [p0, p1] = self.cosine_gradient();
        let across = |t: &Vector3<f64>| Matrix3::identity() - t * t.transpose();
        let own = |t: &Vector3<f64>, p: &Vector3<f64>, l: f64| {
            let tp = t * p.transpose();
            -(tp + tp.transpose()) / l - across(t) * (c / (l * l))
        };
        let mixed = (across(t1) / b - t0 * p1.transpose()) / a;
        [
            p0 * p0.transpose() * curvature + own(t0, &p0, a) * slope,
            p0 * p1.transpose() * curvature + mixed * slope,
            p1 * p1.transpose() * curvature + own(t1, &p1, b) * slope,
        ]
    }

    /// `mean over the two edges of W' W`, `W` the derivative of the components of `kb` in the directors of an edge: positive
    /// semidefinite, and the whole Hessian of bending where the rod is as curved as by nature.
    ///
    /// It is `D' (1 - (t0 t0' + t1 t1') / 2) D`, for `D0' t0 = -kb / a`, `D1' t1 = -kb / b`, `D0' t1 = D1' t0 = 0`.
    #[inline]
    pub fn gauss_newton(&self) -> Blocks {
        let (t0, t1, a, b) = (&self.t0, &self.t1, self.a, self.b);
        let (kb, beta) = (self.binormal(), 2.0 / self.plus);
        let square = 2.0 * self.half_square();
        let tilde = (t0 + t1) / self.plus;
        let (w0, w1) = (kb.cross(t0) * beta, kb.cross(t1) * beta);
        let beta2 = beta * beta;
        let outer = tilde * tilde.transpose() * square - kb * kb.transpose() * 0.5;
        let (s0, s1) = (w0 * tilde.transpose(), w1 * tilde.transpose());
        let across = |t: &Vector3<f64>| (Matrix3::identity() - t * t.transpose()) * beta2;
        let b00 = across(t1) + s1 + s1.transpose() + outer;
        let b11 = across(t0) - s0 - s0.transpose() + outer;
        let b01 = (Matrix3::identity() * self.c - t0 * t1.transpose()) * beta2 - s1 + s0.transpose()
            - tilde * tilde.transpose() * square;
        [b00 / (a * a), b01 / (-a * b), b11 / (b * b)]
    }

    /// Gradient of `kb . q` with `q` fixed, or with `q` the mean of two vectors that turn with the edges: `D' q`.
    #[inline]
    pub fn binormal_gradient(&self, q: &Vector3<f64>) -> Pair {
        let [v0, v1] = self.moments(q);
        [v0 / -self.a, v1 / self.b]
    }

    /// `-a D0' q` and `b D1' q`.
    #[inline]
    fn moments(&self, q: &Vector3<f64>) -> Pair {
        let beta = 2.0 / self.plus;
        let along = (self.t0 + self.t1) * (self.binormal().dot(q) / self.plus);
        [q.cross(&self.t1) * beta + along, q.cross(&self.t0) * beta - along]
    }

    /// Hessian of `kb . (q0 + q1) / 2`, `q0` and `q1` perpendicular to their edges and turning with them; its symmetric part
    /// where turning along a closed path leaves a spin.
    pub fn binormal_hessian(&self, q0: &Vector3<f64>, q1: &Vector3<f64>) -> Blocks {
        let (t0, t1, a, b) = (&self.t0, &self.t1, self.a, self.b);
        let (kb, beta) = (self.binormal(), 2.0 / self.plus);
        let q = (q0 + q1) * 0.5;
        let (tilde, kq) = ((t0 + t1) / self.plus, kb.dot(&q));
        let [p0, p1] = self.cosine_gradient().map(|p| p.transpose() / self.plus);
        let [v0, v1] = self.moments(&q);
        let across = |t: &Vector3<f64>, l: f64| (Matrix3::identity() - t * t.transpose()) / l;
        let (d0, d1) = (across(t0, a) * (kq / self.plus), across(t1, b) * (kq / self.plus));
        let b00 = v0 * (t0.transpose() / a + p0) + tilde * v0.transpose() / a - d0 + kb * q0.transpose() / (2.0 * a);
        let b01 = v0 * p1 - q.cross_matrix() * across(t1, b) * beta - tilde * v1.transpose() / b - d1;
        let b11 = -v1 * (t1.transpose() / b + p1) - tilde * v1.transpose() / b - d1 + kb * q1.transpose() / (2.0 * b);
        [symmetric(&(b00 / a)), b01 / a, symmetric(&(b11 / b))]
    }

    /// Gradient of the twist at the node, the angle by which the directors of the second edge are ahead of those of the
    /// first carried over the corner, when no edge spins: `kb / 2a`, `kb / 2b`.
    ///
    /// Source: Bergou et al. (2008), eq. (8), the variation of the holonomy.
    #[inline]
    pub fn twist_gradient(&self) -> Pair {
        let half = self.binormal() * 0.5;
        [half / self.a, half / self.b]
    }

    /// Symmetric part of the derivative of [`twist_gradient`](Self::twist_gradient).
    pub fn twist_hessian(&self) -> Blocks {
        let (t0, t1, a, b) = (&self.t0, &self.t1, self.a, self.b);
        let (kb, beta) = (self.binormal(), 2.0 / self.plus);
        let along = kb * ((t0 + t1) / self.plus).transpose();
        let d0 = (t1.cross_matrix() * beta + along) / -a;
        let d1 = (t0.cross_matrix() * beta - along) / b;
        [
            symmetric(&((d0 - kb * t0.transpose() / a) / (2.0 * a))),
            d1 / (4.0 * a) + d0.transpose() / (4.0 * b),
            symmetric(&((d1 - kb * t1.transpose() / b) / (2.0 * b))),
        ]
    }
}

fn symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}
