//! Parallel projection: from where one looks, and where points come to lie.

/// A point or a direction.
pub(crate) type Vec3 = [f64; 3];

pub(crate) fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn minus(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// `a` with length 1; `None` for zero and for what is not finite.
pub(crate) fn unit(a: Vec3) -> Option<Vec3> {
    // Scaled first, so that squares neither vanish nor overflow.
    let largest = a.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if !(largest > 0.0 && largest.is_finite()) || a.iter().any(|x| x.is_nan()) {
        return None;
    }
    let scaled = a.map(|x| x / largest);
    let length = dot(scaled, scaled).sqrt();
    Some(scaled.map(|x| x / length))
}

/// The axes of the picture: to the right, upwards, and towards the viewer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct View {
    pub right: Vec3,
    pub up: Vec3,
    pub towards: Vec3,
}

impl View {
    /// The view from the direction `towards`, with the third axis upwards; from straight above the second axis is.
    pub fn from(towards: Vec3) -> Self {
        let towards = unit(towards).unwrap_or([0.0, -1.0, 0.0]);
        let right = unit(cross([0.0, 0.0, 1.0], towards)).unwrap_or([1.0, 0.0, 0.0]);
        Self { right, up: cross(towards, right), towards }
    }

    /// To the right, upwards, and towards the viewer.
    pub fn project(&self, p: Vec3) -> Vec3 {
        [dot(p, self.right), dot(p, self.up), dot(p, self.towards)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed_from_everywhere() {
        for towards in [[0.3, -1.0, 0.5], [0.0, 0.0, 1.0], [0.0, 0.0, -2.0], [1e-200, 0.0, 0.0], [0.0; 3]] {
            let View { right, up, towards } = View::from(towards);
            let of = cross(right, up);
            assert!((0..3).all(|k| (of[k] - towards[k]).abs() < 1e-15));
            assert!((dot(right, right) - 1.0).abs() < 1e-15 && right[2] == 0.0);
        }
    }
}
