//! A mesh in space: tetrahedra cut open by a plane, or a surface, coloured by cell.
//!
//! The cells beyond the cut are taken away whole, so that the cut shows cells and not their sections. What is left is
//! drawn back to front in parallel projection, without what nothing is seen of; so the size of a file is bounded by that
//! of the picture, however many cells there are.

mod buffer;
mod draw;
mod faces;
mod order;
mod panel;
mod view;

use std::path::Path;

use crate::PlotError;
use crate::axis::{extent, too_wide};
use crate::colour::{AREAS, Colour, ColourMap};
use crate::colour_bar::ColourScale;
use crate::file::write_atomic;
use crate::svg::Page;
use buffer::DepthBuffer;
use faces::Face;
pub use panel::SolidPanel;
use view::{Vec3, View, dot};

/// More faces than this are thinned out to those that are seen at coarser samples.
const MOST_FACES: usize = 24_000;
/// Samples per px that decide what is seen.
const DENSITY: f64 = 2.0;
/// Samples that are looked at before farther faces are taken for hidden.
const MOST_SAMPLES: usize = 2_000_000_000;

/// Takes away the cells whose centre `c` has `normal . c > offset`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Points to the side that is taken away.
    pub normal: [f64; 3],
    /// Where the plane is.
    pub offset: f64,
}

impl Cut {
    /// The plane through a point.
    pub fn through(point: [f64; 3], normal: [f64; 3]) -> Self {
        Self { normal, offset: dot(point, normal) }
    }
}

/// A line in space, drawn above the mesh, such as a needle. A point that is not finite breaks it.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceLine {
    /// Positions.
    pub points: Vec<[f64; 3]>,
    /// Its colour; a white rim keeps it visible on any mesh.
    pub colour: Colour,
    /// Its width, px.
    pub width: f64,
    /// Name in the legend; may be empty.
    pub label: String,
    /// Whether the last point is marked as the tip.
    pub tip: bool,
}

impl Default for SpaceLine {
    fn default() -> Self {
        Self { points: Vec::new(), colour: Colour::INK, width: 2.5, label: String::new(), tip: false }
    }
}

/// How a point in space is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Symbol {
    /// An upright cross.
    #[default]
    Cross,
    /// A disc.
    Disc,
}

/// Points in space of one sort, drawn above mesh and lines, such as markers. Those that are not finite are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceMarks {
    /// Positions.
    pub points: Vec<[f64; 3]>,
    /// Their colour; a dark rim about the white one keeps light ones visible.
    pub colour: Colour,
    /// Their shape.
    pub symbol: Symbol,
    /// Name in the legend; may be empty.
    pub label: String,
}

/// A mesh in space, seen in parallel projection with the third axis upwards.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidPicture<'a> {
    /// Positions of the vertices.
    pub points: &'a [[f64; 3]],
    /// Tetrahedra in any orientation. Those with a position that is not finite are left out, and counted below.
    pub tetrahedra: &'a [[u32; 4]],
    /// Triangles of surfaces.
    pub triangles: &'a [[u32; 3]],
    /// One value for each tetrahedron, then one for each triangle. Cells with a value that is not finite are grey.
    pub values: &'a [f64],
    /// Above the picture.
    pub title: String,
    /// What the colours mean, with the unit.
    pub colour_label: String,
    /// Whether the values are whole numbers that name regions: each has its own colour, and the legend its number.
    pub by_region: bool,
    /// Names of the regions by their numbers, instead of these in the legend; a region beyond them keeps its number.
    pub region_names: Vec<String>,
    /// Number of colour bands, 2 to 256.
    pub levels: usize,
    /// Values of the ends of the colour scale; by default those of the cells that are drawn.
    pub range: Option<(f64, f64)>,
    /// Colours for magnitudes or for signed values.
    pub colours: ColourMap,
    /// What is taken away.
    pub cut: Option<Cut>,
    /// The direction in which the viewer is.
    pub towards: [f64; 3],
    /// Names of the axes, for positions that were turned before.
    pub axis_names: [&'static str; 3],
    /// Lines, later ones above earlier ones.
    pub lines: Vec<SpaceLine>,
    /// Points above them.
    pub marks: Vec<SpaceMarks>,
    /// Unit of the positions, for the line that says how far the axes reach; may be empty.
    pub unit: &'static str,
    /// Whether legend and reach of the axes are written below.
    pub key: bool,
    /// Whether to draw the edges of the cells; those of cells too small for it are never drawn.
    pub edges: bool,
    /// Greatest width and height of the mesh on the page, px.
    pub size: [f64; 2],
}

impl Default for SolidPicture<'_> {
    fn default() -> Self {
        Self {
            points: &[],
            tetrahedra: &[],
            triangles: &[],
            values: &[],
            title: String::new(),
            colour_label: String::new(),
            by_region: false,
            region_names: Vec::new(),
            levels: 32,
            range: None,
            colours: ColourMap::default(),
            cut: None,
            towards: [0.45, -1.0, 0.5],
            axis_names: draw::AXIS_NAMES,
            lines: Vec::new(),
            marks: Vec::new(),
            unit: "",
            key: true,
            edges: true,
            size: [620.0, 560.0],
        }
    }
}

impl SolidPicture<'_> {
    /// The picture as an SVG document.
    ///
    /// # Errors
    /// [`PlotError::Shape`] or [`PlotError::Index`] for a malformed mesh; [`PlotError::Empty`] if no face is left;
    /// [`PlotError::Range`] if positions or values span more than a double holds, or a given range is empty.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        self.page().map(Page::document)
    }

    /// Writes the picture to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }

    pub(crate) fn page(&self) -> Result<Page, PlotError> {
        self.check()?;
        let scene = self.scene(&self.bounds()?)?;
        let colours = self.colouring(&scene)?;
        Ok(draw::page(self, &scene, &colours))
    }

    fn check(&self) -> Result<(), PlotError> {
        let (cells, values) = (self.tetrahedra.len() + self.triangles.len(), self.values.len());
        if cells != values {
            return Err(PlotError::Shape { picture: self.title.clone(), points: cells, values });
        }
        let points = self.points.len();
        let wrong =
            |triangle: usize, point: u32| PlotError::Index { picture: self.title.clone(), triangle, point, points };
        let first_wrong = |v: &[u32]| v.iter().copied().find(|&i| i as usize >= points);
        let tetrahedra = self.tetrahedra.iter().map(|v| first_wrong(v));
        let all = tetrahedra.chain(self.triangles.iter().map(|v| first_wrong(v))).enumerate();
        all.into_iter().find_map(|(cell, point)| Some(wrong(cell, point?))).map_or(Ok(()), Err)
    }

    /// Of each cell, whether all its positions are finite.
    fn whole(&self) -> Vec<bool> {
        let finite = |v: &[u32]| v.iter().all(|&i| self.points[i as usize].iter().all(|x| x.is_finite()));
        self.tetrahedra.iter().map(|v| finite(v)).chain(self.triangles.iter().map(|v| finite(v))).collect()
    }

    /// Lower and upper corner of all cells that can be drawn.
    fn bounds(&self) -> Result<[Vec3; 2], PlotError> {
        let cells = self.tetrahedra.iter().map(|v| &v[..]).chain(self.triangles.iter().map(|v| &v[..]));
        let used = cells.zip(self.whole()).filter(|(_, whole)| *whole).flat_map(|(v, _)| v);
        let bounds = bounds(used.map(|&i| self.points[i as usize])).ok_or_else(|| self.empty())?;
        // Sums of three coordinates and their differences must be finite, from whichever side they are seen.
        if bounds.iter().flatten().any(|x| !(8.0 * x).is_finite()) {
            return Err(too_wide(&self.title, bounds.into_iter().flatten()));
        }
        Ok(bounds)
    }

    /// What is seen, and from where, in a picture of a box.
    fn scene(&self, bounds: &[Vec3; 2]) -> Result<Scene, PlotError> {
        let view = View::from(self.towards);
        let whole = self.whole();
        let (kept_solid, kept_surface) = self.kept(&whole);
        let skin = faces::skin(self.points, self.tetrahedra, &kept_solid, view.towards);
        let mut all = skin.faces;
        let n_solid = self.tetrahedra.len() as u32;
        all.extend(
            faces::surface(self.points, self.triangles, &kept_surface, view.towards)
                .into_iter()
                .map(|face| Face { cell: face.cell + n_solid, ..face }),
        );
        if all.is_empty() {
            return Err(self.empty());
        }
        let frame = draw::Placement::around(bounds, &view, self.limit());
        let (seen, grain) = seen(&all, self.points, &frame);
        let order = order::back_to_front(&self.depths(&view), &skin.pairs);
        let mut turn = vec![0_u32; order.len()];
        order.iter().enumerate().for_each(|(k, &cell)| turn[cell as usize] = k as u32);
        let mut faces: Vec<Face> = all.into_iter().zip(seen).filter(|(_, seen)| *seen).map(|(face, _)| face).collect();
        faces.sort_by_key(|face| turn[face.cell as usize]);
        let left_out = whole.iter().filter(|whole| !**whole).count();
        Ok(Scene { view, frame, bounds: *bounds, faces, grain, left_out })
    }

    fn empty(&self) -> PlotError {
        PlotError::Empty { picture: self.title.clone(), points: self.tetrahedra.len() + self.triangles.len() }
    }

    fn limit(&self) -> [f64; 2] {
        self.size.map(|px| if px.is_finite() { px.clamp(100.0, 2000.0) } else { 600.0 })
    }

    /// Which tetrahedra and which triangles are left after the cut.
    fn kept(&self, whole: &[bool]) -> (Vec<bool>, Vec<bool>) {
        let stays = |v: &[u32]| {
            self.cut.is_none_or(|cut| {
                let beyond: f64 = v.iter().map(|&i| dot(self.points[i as usize], cut.normal) - cut.offset).sum();
                // What cannot be compared stays.
                !matches!(beyond.partial_cmp(&0.0), Some(std::cmp::Ordering::Greater))
            })
        };
        let (solid, surface) = whole.split_at(self.tetrahedra.len());
        let solid = self.tetrahedra.iter().zip(solid).map(|(v, whole)| *whole && stays(v)).collect();
        (solid, self.triangles.iter().zip(surface).map(|(v, whole)| *whole && stays(v)).collect())
    }

    /// How near the centre of each cell is to the viewer.
    fn depths(&self, view: &View) -> Vec<f64> {
        let mean = |v: &[u32]| {
            let sum: f64 = v.iter().map(|&i| dot(self.points[i as usize], view.towards) / v.len() as f64).sum();
            sum
        };
        self.tetrahedra.iter().map(|v| mean(v)).chain(self.triangles.iter().map(|v| mean(v))).collect()
    }

    fn shown_values<'s>(&'s self, scene: &'s Scene) -> impl Iterator<Item = f64> + 's {
        scene.faces.iter().map(|face| self.values[face.cell as usize]).filter(|x| x.is_finite())
    }

    fn colouring(&self, scene: &Scene) -> Result<Colouring, PlotError> {
        let values = || self.shown_values(scene);
        if self.by_region {
            let mut regions: Vec<f64> = values().map(f64::round).collect();
            regions.sort_by(f64::total_cmp);
            regions.dedup();
            let named = self.region_names.len();
            return Ok(Colouring::Regions { regions, named });
        }
        let (min, max) = extent(values()).unwrap_or((0.0, 0.0));
        ColourScale::around(min, max, self.range, self.colours, self.levels)
            .map(Colouring::Scale)
            .map_err(|[low, high]| too_wide(&self.title, [low, high]))
    }
}

/// What is drawn.
struct Scene {
    view: View,
    frame: draw::Placement,
    /// Lower and upper corner of the whole mesh.
    bounds: [Vec3; 2],
    /// Back to front.
    faces: Vec<Face>,
    /// Distance of the samples that decided what is seen, px.
    grain: f64,
    /// Cells that cannot be drawn.
    left_out: usize,
}

/// How values become colours.
enum Colouring {
    Scale(ColourScale),
    /// The regions that are seen, ascending. Those below `named` have colours by their numbers, in every picture the same; others
    /// have colours by their places.
    Regions {
        regions: Vec<f64>,
        named: usize,
    },
}

impl Colouring {
    fn of(&self, value: f64) -> Colour {
        match self {
            _ if !value.is_finite() => Colour::NO_DATA,
            Self::Scale(scale) => scale.of(value),
            Self::Regions { regions, named } => {
                let number = value.round();
                let at = if (0.0..*named as f64).contains(&number) {
                    number as usize
                } else {
                    regions.binary_search_by(|region| region.total_cmp(&number)).unwrap_or_else(|at| at)
                };
                let colour = AREAS[at % AREAS.len()];
                // The second time around, and later, paler.
                (0..at / AREAS.len()).fold(colour, |colour, _| colour.paler())
            }
        }
    }
}

fn bounds(points: impl IntoIterator<Item = Vec3>) -> Option<[Vec3; 2]> {
    points.into_iter().fold(None, |bounds, p| {
        let [low, high] = bounds.unwrap_or([p, p]);
        Some([std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k]))])
    })
}

/// Which faces are seen, at samples as dense as leave no more than [`MOST_FACES`], and the distance of these, px.
fn seen(faces: &[Face], points: &[Vec3], frame: &draw::Placement) -> (Vec<bool>, f64) {
    let corners: Vec<[Vec3; 3]> =
        faces.iter().map(|face| face.corners.map(|i| frame.place(points[i as usize]))).collect();
    // Nearest first: should there be no end to them, those left are most likely hidden.
    let nearest = |i: &u32| corners[*i as usize].iter().map(|p| p[2]).fold(f64::MIN, f64::max);
    let mut order: Vec<u32> = (0..faces.len() as u32).collect();
    order.sort_by(|i, j| nearest(j).total_cmp(&nearest(i)).then(i.cmp(j)));
    let mut density = DENSITY;
    loop {
        let mut buffer = DepthBuffer::new(frame.size, density);
        let mut samples = 0_usize;
        for &face in &order {
            samples = samples.saturating_add(buffer.add(face, &corners[face as usize]));
            if samples > MOST_SAMPLES {
                break;
            }
        }
        let seen = buffer.seen(faces.len());
        let count = seen.iter().filter(|&&seen| seen).count();
        if count <= MOST_FACES || density < 0.2 {
            return (seen, 1.0 / density);
        }
        // The number of faces that are seen falls more slowly than that of the samples.
        density *= (MOST_FACES as f64 / count as f64).sqrt().clamp(0.5, 0.9);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A cube in parts that grow from one side to the other, so that large cells lie beside small ones.
    fn graded(n: u32) -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let at = |i: u32| (f64::from(i) / f64::from(n)).powi(3);
        let m = n + 1;
        let points = (0..m * m * m).map(|v| [at(v % m), at(v / m % m), at(v / (m * m))]).collect();
        let paths =
            [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]].map(|axes| axes.map(|k| m.pow(k)));
        let parts = (0..n * n * n).map(|p| p % n + m * (p / n % n) + m * m * (p / (n * n)));
        let cells = parts.flat_map(|v| paths.map(|[a, b, c]| [v, v + a, v + a + b, v + a + b + c])).collect();
        (points, cells)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn painting_in_order_shows_what_is_nearest(
            towards in [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64],
            normal in [-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64],
            point in [0.0..0.6_f64, 0.0..0.6_f64, 0.0..0.6_f64],
        ) {
            let (points, tetrahedra) = graded(6);
            let values = vec![0.0; tetrahedra.len()];
            let picture = SolidPicture {
                points: &points, tetrahedra: &tetrahedra, values: &values, towards,
                cut: Some(Cut::through(point, normal)), ..SolidPicture::default()
            };
            let Ok(scene) = picture.bounds().and_then(|bounds| picture.scene(&bounds)) else { return Ok(()) };
            let (mut depths, mut painted) = (DepthBuffer::new(scene.frame.size, 0.7), DepthBuffer::new(scene.frame.size, 0.7));
            for (k, face) in scene.faces.iter().enumerate() {
                let corners = face.corners.map(|i| scene.frame.place(points[i as usize]));
                depths.add(k as u32, &corners);
                painted.add(k as u32, &corners.map(|[x, y, _]| [x, y, k as f64]));
            }
            let (n, differ) = depths.compare(&painted);
            // Along common edges depths are equal but for rounding.
            prop_assert!(differ * 500 <= n, "{differ} of {n} samples");
        }
    }
}
