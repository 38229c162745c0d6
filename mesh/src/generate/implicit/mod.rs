//! Bodies given by a signed distance, and which of several a point belongs to.
//!
//! | module | what it holds |
//! |---|---|
//! | `sphere`, `ellipsoid`, `capsule`, `cylinder`, `torus_arc`, `cuboid`, `half_space` | simple bodies, by their true distance |
//! | `shell` | what lies within a given distance of a surface |
//! | `combine`, `smooth_union` | bodies made of others |
//! | `placed` | a body moved and turned |
//! | `surface` | what lies within a closed surface of triangles |
//! | `strata` | several solids in order of precedence |
//!
//! ```
//! use stylet_mesh::generate::implicit::{Capsule, Difference, Ellipsoid, Implicit};
//!
//! // An organ with a canal.
//! let organ = Ellipsoid::new([0.0; 3], [0.025, 0.020, 0.0175])?;
//! let canal = Capsule::new([0.0, 0.0, -0.03], [0.0, 0.0, 0.03], 0.002)?;
//! let solid = Difference::new(organ, canal);
//! assert!(solid.distance(&[0.01, 0.0, 0.0]) < 0.0 && solid.distance(&[0.0; 3]) > 0.0);
//! # Ok::<(), stylet_mesh::generate::implicit::ShapeError>(())
//! ```

mod capsule;
mod combine;
mod cuboid;
mod cylinder;
mod ellipsoid;
mod error;
mod gradient;
mod half_space;
mod placed;
mod shell;
mod smooth_union;
mod sphere;
mod strata;
mod surface;
#[cfg(test)]
mod tests;
mod torus_arc;

pub use capsule::Capsule;
pub use combine::{Difference, Intersection, Union};
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use error::ShapeError;
pub use gradient::gradient;
pub use half_space::HalfSpace;
pub use placed::Placed;
pub use shell::Shell;
pub use smooth_union::SmoothUnion;
pub use sphere::Sphere;
pub use strata::Strata;
pub use surface::{ClosedSurface, SurfaceError};
pub use torus_arc::TorusArc;

/// A solid by a function of space: negative inside, positive outside, zero on its surface.
///
/// Near the surface the value is the distance to it in metres, or at least a Lipschitz function of slope about one: sizes
/// and cut points are found from it. Anywhere else its sign is what counts.
pub trait Implicit: Send + Sync {
    /// Signed distance at `p`, m.
    fn distance(&self, p: &[f64; 3]) -> f64;

    /// A box (lowest, highest corner) that holds the solid; `None` where it has no end.
    fn bounds(&self) -> Option<[[f64; 3]; 2]>;

    /// A box that holds every point of distance at most `level`, m, which is not negative.
    ///
    /// As given, [`bounds`](Self::bounds) grown by the level: right for a true distance. One that is less than the true
    /// distance outside, as combinations have it, has to say it itself.
    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        self.bounds().map(|bounds| grown(bounds, level))
    }
}

impl<T: Implicit + ?Sized> Implicit for Box<T> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        (**self).distance(p)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        (**self).bounds()
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        (**self).bounds_within(level)
    }
}

impl<T: Implicit + ?Sized> Implicit for std::sync::Arc<T> {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        (**self).distance(p)
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        (**self).bounds()
    }

    fn bounds_within(&self, level: f64) -> Option<[[f64; 3]; 2]> {
        (**self).bounds_within(level)
    }
}

/// A box with its faces moved outwards.
fn grown([low, high]: [[f64; 3]; 2], by: f64) -> [[f64; 3]; 2] {
    [low.map(|x| x - by), high.map(|x| x + by)]
}

/// The smallest box that holds some balls of one radius.
fn around(centres: &[[f64; 3]], radius: f64) -> [[f64; 3]; 2] {
    let of =
        |pick: fn(f64, f64) -> f64| std::array::from_fn(|k| centres.iter().map(|c| c[k]).reduce(pick).unwrap_or(0.0));
    grown([of(f64::min), of(f64::max)], radius)
}
