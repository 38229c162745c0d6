//! Checked contours of one organ.

use super::{
    polygon::{bounding_box, first_moment, signed_area},
    set::{Drawing, PlanarContour},
};

/// A connected piece of a slice: an outer contour, counterclockwise, and the holes in it, clockwise. The first point is not
/// repeated.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The contour around it, m.
    pub outer: Vec<[f64; 2]>,
    /// The contours of its holes, m.
    pub holes: Vec<Vec<[f64; 2]>>,
}

impl Part {
    /// All its contours, the outer one first.
    pub fn contours(&self) -> impl Iterator<Item = &[[f64; 2]]> {
        std::iter::once(self.outer.as_slice()).chain(self.holes.iter().map(Vec::as_slice))
    }

    /// Its area without the holes, m2.
    pub fn area(&self) -> f64 {
        self.contours().map(signed_area).sum()
    }
}

/// The contours of one organ in one plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    /// The plane, m.
    pub z: f64,
    /// Its pieces side by side (or islands in each other's holes), in the order of the drawing; never empty.
    pub parts: Vec<Part>,
}

impl Slice {
    /// The area inside, m2.
    pub fn area(&self) -> f64 {
        self.parts.iter().map(Part::area).sum()
    }

    /// Lowest and highest corner of its contours, m.
    pub(super) fn outline(&self) -> [[f64; 2]; 2] {
        bounding_box(self.parts.iter().flat_map(|part| &part.outer))
    }

    /// The centroid of the area inside, m.
    pub(super) fn centroid(&self) -> [f64; 2] {
        let area = self.area();
        let mut centroid = [0.0; 2];
        for moment in self.parts.iter().flat_map(Part::contours).map(first_moment) {
            centroid.iter_mut().zip(moment).for_each(|(c, m)| *c += m / area);
        }
        // Rounding may throw the centroid of a sliver anywhere.
        let [low, high] = self.outline();
        std::array::from_fn(|k| if centroid[k].is_finite() { centroid[k].clamp(low[k], high[k]) } else { low[k] })
    }
}

/// An organ by its contours, checked: on every slice they are simple and do not cross.
#[derive(Clone, Debug, PartialEq)]
pub struct Organ {
    pub(super) name: String,
    pub(super) slices: Vec<Slice>,
    /// How thick an organ of one slice is, m; unused where there are more.
    pub(super) thickness: f64,
}

impl Organ {
    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its slices by increasing z; at least one.
    pub fn slices(&self) -> &[Slice] {
        &self.slices
    }

    /// The contours as a drawing, slice by slice: what makes this organ again.
    pub fn drawing(&self) -> Drawing {
        let lifted = |z: f64, c: &[[f64; 2]]| PlanarContour::closed(c.iter().map(|p| [p[0], p[1], z]).collect());
        let contours = |slice: &Slice| -> Vec<PlanarContour> {
            slice.parts.iter().flat_map(Part::contours).map(|c| lifted(slice.z, c)).collect()
        };
        Drawing { name: self.name.clone(), contours: self.slices.iter().flat_map(contours).collect() }
    }

    /// The distance from the last slice at either end to where the next would have been: that to its neighbour, m.
    pub(super) fn end_distances(&self) -> [f64; 2] {
        let z: Vec<f64> = self.slices.iter().map(|slice| slice.z).collect();
        match z.as_slice() {
            [first, second, ..] => [second - first, z[z.len() - 1] - z[z.len() - 2]],
            _ => [self.thickness; 2],
        }
    }

    /// The volume by the rule of planning systems (Cavalieri's), m3: each slice's area times the distance between the planes
    /// half way to its neighbours; the outermost slices reach as far outwards as inwards.
    ///
    /// For slices a distance apart it is free of bias: for a sphere cut at random, the mean is its volume.
    pub fn volume(&self) -> f64 {
        self.slices.iter().zip(self.thicknesses()).map(|(slice, thickness)| slice.area() * thickness).sum()
    }

    /// How far each slice reaches: from half way to its lower neighbour to half way to its upper one, m.
    pub(super) fn thicknesses(&self) -> Vec<f64> {
        let [below, above] = self.end_distances();
        let mut distances = vec![below];
        distances.extend(self.slices.windows(2).map(|pair| pair[1].z - pair[0].z));
        distances.push(above);
        distances.windows(2).map(|pair| f64::midpoint(pair[0], pair[1])).collect()
    }
}
