//! Frames along a rod: Bishop's, which never spin, and the material's.

use nalgebra::Vector3;

/// Tangent and the two directors of an edge, an orthonormal right-handed frame.
pub type Frame = [[f64; 3]; 3];

/// `vector`, perpendicular to the unit vector `from`, carried to `to` by the smallest rotation that takes `from` there. NaN if
/// the two are opposite.
///
/// Source: Bergou et al. (2008), section 4.1, parallel transport.
#[must_use]
pub fn parallel_transport(vector: [f64; 3], from: [f64; 3], to: [f64; 3]) -> [f64; 3] {
    transport(&Vector3::from(vector), &Vector3::from(from), &Vector3::from(to)).into()
}

#[inline]
pub(super) fn transport(v: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> Vector3<f64> {
    let sum = from + to;
    v - sum * (v.dot(to) * 2.0 / sum.norm_squared())
}

/// Bishop's frame of each edge, `t`, `u` and `v = t x u`, from a first director that need only be roughly perpendicular to the
/// first edge: what it has along the edge is taken off.
pub(super) fn bishop(
    tangents: impl Iterator<Item = Vector3<f64>>,
    first: &[f64; 3],
) -> impl Iterator<Item = [Vector3<f64>; 3]> {
    let mut u = Vector3::from(*first);
    let mut before = None;
    tangents.map(move |t| {
        if let Some(before) = before {
            u = transport(&u, &before, &t);
        }
        // Rounding errors do not add up along the rod.
        u = (u - t * u.dot(&t)).normalize();
        before = Some(t);
        [t, u, t.cross(&u)]
    })
}

/// The directors of a frame turned by `angle` about its tangent.
#[inline]
pub(super) fn turned([_, u, v]: &[Vector3<f64>; 3], angle: f64) -> [Vector3<f64>; 2] {
    let (sin, cos) = angle.sin_cos();
    [u * cos + v * sin, v * cos - u * sin]
}
