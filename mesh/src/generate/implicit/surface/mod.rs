//! A solid within a closed surface of triangles, such as one read from an STL file.
//!
//! The nearest point of the surface is found in a hierarchy of boxes (`tree`), and the side by the angle-weighted normal of
//! the face, edge or vertex that it lies on, which has the right sign wherever the surface is closed and touches itself
//! nowhere. Whether it is and does not is looked into first (`sound`).
//!
//! Source: Baerentzen & Aanaes, *Signed distance computation using the angle weighted pseudonormal* (2005), IEEE Trans. Vis.
//! Comput. Graph. 11(3).

mod error;
mod nearest;
mod sound;
#[cfg(test)]
mod tests;
mod tree;
mod triangle;

pub use error::SurfaceError;

use super::Implicit;
use crate::geometry::{cross, dot, norm, subtract};
use nearest::Nearest;
use tree::Tree;

/// The solid within a closed surface of triangles, by its true distance.
#[derive(Clone, Debug)]
pub struct ClosedSurface {
    points: Vec<[f64; 3]>,
    /// Counter-clockwise seen from outside, in the order of the tree.
    triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from each corner to the next.
    neighbours: Vec<[u32; 3]>,
    /// Unit normals of the triangles.
    normals: Vec<[f64; 3]>,
    /// Angle-weighted normals of the points, of any length.
    at_points: Vec<[f64; 3]>,
    tree: Tree,
    turned: usize,
}

impl ClosedSurface {
    /// The solid within triangles, given by indices of points, m.
    ///
    /// The surface may consist of several parts, some within others as the walls of hollows. Triangles that wind against
    /// their neighbours are turned, and all of them if the volume comes out negative: see [`turned`](Self::turned).
    ///
    /// # Errors
    /// What [`check`](crate::check::check) finds of it, such as flat or repeated triangles or edges with three of them;
    /// open edges; triangles that cross or touch without a common vertex, or are folded onto each other. The numbers of
    /// faults are given, and the first of them.
    pub fn new(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Self, SurfaceError> {
        let (mut triangles, mut turned) = sound::checked(points, triangles)?;
        let volume: f64 = triangles.iter().map(|t| six_volumes(points, t)).sum();
        if volume < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            turned = triangles.len() - turned;
        }
        let corners = |t: &[u32; 3]| t.map(|v| points[v as usize]);
        let (tree, order) = Tree::new(&triangles.iter().map(corners).collect::<Vec<_>>());
        let triangles: Vec<[u32; 3]> = order.iter().map(|&t| triangles[t as usize]).collect();
        let neighbours = sound::neighbours(&triangles)?;
        let normals: Vec<_> = triangles.iter().map(|t| triangle::unit_normal(&corners(t))).collect();
        let mut at_points = vec![[0.0; 3]; points.len()];
        for (t, normal) in triangles.iter().zip(&normals) {
            for (v, angle) in t.iter().zip(triangle::angles(&corners(t))) {
                let sum = &mut at_points[*v as usize];
                *sum = std::array::from_fn(|k| sum[k] + angle * normal[k]);
            }
        }
        let surface = Self { points: points.to_vec(), triangles, neighbours, normals, at_points, tree, turned };
        sound::check_touching(&surface, &order)?;
        Ok(surface)
    }

    /// How many triangles were turned over, for them to wind counter-clockwise seen from outside.
    pub fn turned(&self) -> usize {
        self.turned
    }

    fn corners(&self, t: u32) -> [[f64; 3]; 3] {
        self.triangles[t as usize].map(|v| self.points[v as usize])
    }

    /// The normal that tells the sides apart at the nearest point.
    fn pseudonormal(&self, nearest: &Nearest) -> [f64; 3] {
        let t = nearest.triangle as usize;
        match nearest.feature {
            triangle::Feature::Face => self.normals[t],
            triangle::Feature::Edge(i) => {
                let across = self.normals[self.neighbours[t][i] as usize];
                std::array::from_fn(|k| self.normals[t][k] + across[k])
            }
            triangle::Feature::Corner(i) => self.at_points[self.triangles[t][i] as usize],
        }
    }
}

/// Six times the volume of the cone from the origin.
fn six_volumes(points: &[[f64; 3]], triangle: &[u32; 3]) -> f64 {
    // From a point of the surface, so that surfaces far from the origin lose nothing.
    let [a, b, c] = triangle.map(|v| subtract(&points[v as usize], &points[0]));
    dot(&a, &cross(&b, &c))
}

impl Implicit for ClosedSurface {
    fn distance(&self, p: &[f64; 3]) -> f64 {
        let Some(nearest) = self.nearest(p) else { return f64::NAN };
        let away = subtract(p, &nearest.point);
        let side = dot(&away, &self.pseudonormal(&nearest));
        norm(&away).copysign(if side < 0.0 { -1.0 } else { 1.0 })
    }

    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        Some(self.tree.bounds())
    }
}
