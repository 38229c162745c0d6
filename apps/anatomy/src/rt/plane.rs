//! Which plane a contour lies in, in words.

/// A contour this flat (mm) along an axis lies in a plane across it: files round to hundredths of a millimetre.
const FLAT: f64 = 0.02;

/// The plane of points (mm) that vary along z by more than rounding; `None` where they do not.
pub(super) fn other_than_axial(points: &[[f64; 3]]) -> Option<String> {
    let range = |k: usize| {
        let along = points.iter().map(|p| p[k]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        (low, high)
    };
    let flat = |k: usize| range(k).1 - range(k).0 <= FLAT;
    if points.is_empty() || flat(2) {
        return None;
    }
    let at = |k: usize| f64::midpoint(range(k).0, range(k).1);
    Some(if flat(0) {
        format!("sagittal plane x = {} mm", at(0))
    } else if flat(1) {
        format!("coronal plane y = {} mm", at(1))
    } else {
        let [x, y, z] = normal(points);
        format!("oblique plane of normal ({x:.3}, {y:.3}, {z:.3}), z from {} to {} mm", range(2).0, range(2).1)
    })
}

/// The unit normal of a polygon, by Newell's sums; zero if it encloses nothing.
fn normal(points: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (i, p) in points.iter().enumerate() {
        let q = &points[(i + 1) % points.len()];
        for k in 0..3 {
            let (l, m) = ((k + 1) % 3, (k + 2) % 3);
            sum[k] += (p[l] - q[l]) * (p[m] + q[m]);
        }
    }
    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    sum.map(|x| if length > 0.0 { x / length } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_have_their_names() {
        let square = |f: &dyn Fn(f64, f64) -> [f64; 3]| other_than_axial(&[f(0., 0.), f(1., 0.), f(1., 1.), f(0., 1.)]);
        assert_eq!(square(&|a, b| [a, b, 3.0]), None);
        assert_eq!(square(&|a, b| [7.0, a, b]).unwrap(), "sagittal plane x = 7 mm");
        assert_eq!(square(&|a, b| [a, -2.0, b]).unwrap(), "coronal plane y = -2 mm");
        let tilted = square(&|a, b| [a, b, b]).unwrap();
        assert!(tilted.starts_with("oblique plane of normal (0.000, -0.707, 0.707)"), "{tilted}");
    }
}
