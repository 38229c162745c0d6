//! One mesh, coloured by a field, with lines and markers above it.

use std::path::Path;

use crate::PlotError;
use crate::axis::Frame;
use crate::colour::{Colour, ColourMap};
use crate::colour_bar::ColourScale;
use crate::contour::regions;
use crate::edges::edge_trails;
use crate::legend::{Entry, SAMPLE};
use crate::panel::MeshPanel;
use crate::path::PathData;
use crate::svg::{Stroke, Svg, num};

/// Above this many triangles the edges of the mesh are not drawn: they would cover the colours.
const MOST_EDGED: usize = 20_000;
/// Up to this many triangles, outlines are written to a hundredth of a px; beyond, to a twentieth.
const FEW: usize = 5_000;

/// A line over a mesh, such as a needle. A point that is not finite breaks it.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyline {
    /// Positions, m.
    pub points: Vec<[f64; 2]>,
    /// Its colour; a white rim keeps it visible on any field.
    pub colour: Colour,
    /// Its width, px.
    pub width: f64,
    /// Name in the legend; may be empty.
    pub label: String,
    /// Whether the last point is marked as the tip.
    pub tip: bool,
    /// Whether it is dashed.
    pub dashed: bool,
}

impl Default for Polyline {
    fn default() -> Self {
        Self { points: Vec::new(), colour: Colour::INK, width: 2.5, label: String::new(), tip: false, dashed: false }
    }
}

/// A dot over a mesh, such as a probe.
#[derive(Debug, Clone, PartialEq)]
pub struct Marker {
    /// Position, m.
    pub at: [f64; 2],
    /// Its colour.
    pub colour: Colour,
    /// Name in the legend; may be empty.
    pub label: String,
}

/// A triangle mesh in the plane, coloured by a field that is linear on each triangle, true to scale.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshPicture<'a> {
    /// Positions of the vertices as drawn (deformed), m.
    pub points: &'a [[f64; 2]],
    /// Three points a triangle, in any orientation.
    pub triangles: &'a [[u32; 3]],
    /// The field, one value a point. Triangles with a value that is not finite are grey.
    pub values: &'a [f64],
    /// Instead of that, a value for each triangle, which then has one colour.
    pub cell_values: Option<&'a [f64]>,
    /// Above the picture.
    pub title: String,
    /// What the colours mean, with the unit.
    pub colour_label: String,
    /// Lines, later ones above earlier ones.
    pub lines: Vec<Polyline>,
    /// Dots, above the lines.
    pub markers: Vec<Marker>,
    /// Rings drawn dashed, m: the undeformed outline, as from [`outline_of`](crate::outline_of).
    pub outline: Vec<Vec<[f64; 2]>>,
    /// Whether to draw the edges of the mesh; never for more than 20 000 triangles.
    pub edges: bool,
    /// Their colour.
    pub edge_colour: Colour,
    /// Number of colour bands, 2 to 256.
    pub levels: usize,
    /// Values of the ends of the colour scale; by default those of the field.
    pub range: Option<(f64, f64)>,
    /// Colours for magnitudes or for signed values.
    pub colours: ColourMap,
    /// Lower left and upper right corner of what is shown, m; by default everything.
    pub view: Option<[[f64; 2]; 2]>,
}

impl Default for MeshPicture<'_> {
    fn default() -> Self {
        Self {
            points: &[],
            triangles: &[],
            values: &[],
            cell_values: None,
            title: String::new(),
            colour_label: String::new(),
            lines: Vec::new(),
            markers: Vec::new(),
            outline: Vec::new(),
            edges: true,
            edge_colour: Colour(0x80, 0x80, 0x80),
            levels: 32,
            range: None,
            colours: ColourMap::default(),
            view: None,
        }
    }
}

impl MeshPicture<'_> {
    /// The picture as an SVG document.
    ///
    /// # Errors
    /// [`PlotError::Shape`] or [`PlotError::Index`] for a malformed mesh; [`PlotError::Empty`] if no triangle is finite;
    /// [`PlotError::Range`] if positions or values span more than a double holds, or a given range is empty.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        MeshPanel {
            pictures: vec![self.clone()],
            colour_label: self.colour_label.clone(),
            levels: self.levels,
            range: self.range,
            colours: self.colours,
            ..MeshPanel::default()
        }
        .to_svg()
    }

    /// Writes the picture to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        crate::file::write_atomic(path.as_ref(), &self.to_svg()?)
    }

    /// Checks the mesh and sorts out what can be drawn.
    pub(crate) fn prepare(&self) -> Result<Prepared<'_>, PlotError> {
        let points = self.points.len();
        let (entries, values) = match self.cell_values {
            None => (points, self.values.len()),
            Some(values) => (self.triangles.len(), values.len()),
        };
        if entries != values {
            return Err(PlotError::Shape { picture: self.title.clone(), points: entries, values });
        }
        let mut prepared = Prepared { picture: self, valued: Vec::new(), cell_values: Vec::new(), bare: Vec::new() };
        for (triangle, corners) in self.triangles.iter().enumerate() {
            if let Some(&point) = corners.iter().find(|&&i| i as usize >= points) {
                return Err(PlotError::Index { picture: self.title.clone(), triangle, point, points });
            }
            let p = corners.map(|i| self.points[i as usize]);
            if p.iter().flatten().any(|x| !x.is_finite()) {
                continue;
            }
            let oriented = if signed_area(p) < 0.0 { [corners[0], corners[2], corners[1]] } else { *corners };
            match self.cell_values.map(|values| values[triangle]) {
                Some(value) if value.is_finite() => {
                    prepared.valued.push(oriented);
                    prepared.cell_values.push(value);
                }
                None if corners.iter().all(|&i| self.values[i as usize].is_finite()) => prepared.valued.push(oriented),
                _ => prepared.bare.push(oriented),
            }
        }
        if prepared.valued.is_empty() && prepared.bare.is_empty() {
            return Err(PlotError::Empty { picture: self.title.clone(), points: self.triangles.len() });
        }
        Ok(prepared)
    }
}

fn signed_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
}

/// A checked picture: triangles with finite corners, counter-clockwise.
pub(crate) struct Prepared<'a> {
    pub picture: &'a MeshPicture<'a>,
    /// Triangles with finite values.
    pub valued: Vec<[u32; 3]>,
    /// Their values, if each has its own.
    pub cell_values: Vec<f64>,
    /// Triangles without.
    pub bare: Vec<[u32; 3]>,
}

impl Prepared<'_> {
    /// The values that are shown.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let by_point = self.valued.iter().flatten().filter(|_| self.picture.cell_values.is_none());
        by_point.map(|&i| self.picture.values[i as usize]).chain(self.cell_values.iter().copied())
    }

    /// Every finite position that should be in view, m.
    pub fn positions(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let mesh = self.valued.iter().chain(&self.bare).flatten().map(|&i| self.picture.points[i as usize]);
        let lines = self.picture.lines.iter().flat_map(|line| line.points.iter().copied());
        let markers = self.picture.markers.iter().map(|marker| marker.at);
        let outline = self.picture.outline.iter().flatten().copied();
        mesh.chain(lines).chain(markers).chain(outline).filter(|p| p.iter().all(|x| x.is_finite()))
    }

    /// How many triangles cannot be drawn.
    pub fn left_out(&self) -> usize {
        self.picture.triangles.len() - self.valued.len() - self.bare.len()
    }

    /// Draws everything inside the frame, whose scales are in mm.
    pub fn draw(&self, svg: &mut Svg, frame: &Frame, colours: &ColourScale) {
        let units = if self.picture.triangles.len() <= FEW { 100.0 } else { 20.0 };
        frame.open_clip(svg);
        svg.open_group(&PathData::group_attribute(units));
        self.draw_field(svg, frame, colours, units);
        if self.picture.edges && self.picture.triangles.len() <= MOST_EDGED {
            self.draw_edges(svg, frame, units);
        }
        svg.close_group();
        for ring in &self.picture.outline {
            let closed = ring.iter().chain(ring.first()).copied();
            let rim = Stroke::solid(Colour(0xff, 0xff, 0xff), outline_stroke().width + 0.8);
            draw_line(svg, frame, closed.clone(), rim);
            draw_line(svg, frame, closed, outline_stroke());
        }
        for line in &self.picture.lines {
            line.draw(svg, frame);
        }
        for marker in &self.picture.markers {
            if let Some(at) = place(frame, marker.at) {
                svg.raw(&dot(at, 3.5, marker.colour));
            }
        }
        Frame::close_clip(svg);
    }

    /// Colour bands, each painted over the one below it; or, of triangles with one colour, each band by itself.
    fn draw_field(&self, svg: &mut Svg, frame: &Frame, colours: &ColourScale, units: f64) {
        // The outline of all triangles is that of the region where 0 >= -1.
        let whole = |triangles: &[[u32; 3]]| {
            let zeros = vec![0.0; self.picture.points.len()];
            regions(self.picture.points, triangles, &zeros, &[-1.0]).pop().unwrap_or_default()
        };
        let mut layers = vec![(Colour::NO_DATA, whole(&self.bare))];
        if self.picture.cell_values.is_some() {
            let mut bands = vec![Vec::new(); colours.bands];
            let values = self.valued.iter().zip(&self.cell_values);
            values.for_each(|(triangle, &value)| bands[colours.band_of(value)].push(*triangle));
            layers.extend(bands.iter().enumerate().map(|(k, triangles)| (colours.band(k), whole(triangles))));
        } else {
            let bands = regions(self.picture.points, &self.valued, self.picture.values, &colours.levels());
            layers.push((colours.band(0), whole(&self.valued)));
            layers.extend(bands.into_iter().enumerate().map(|(k, rings)| (colours.band(k + 1), rings)));
        }
        for (colour, rings) in layers {
            let mut path = PathData::new(units);
            for ring in rings {
                path.ring(ring.into_iter().filter_map(|p| place(frame, p)));
            }
            if !path.is_empty() {
                svg.raw(&format!("<path fill=\"{colour}\" d=\"{}\"/>", path.data()));
            }
        }
    }

    fn draw_edges(&self, svg: &mut Svg, frame: &Frame, units: f64) {
        let triangles: Vec<[u32; 3]> = self.valued.iter().chain(&self.bare).copied().collect();
        let mut path = PathData::new(units);
        for trail in edge_trails(&triangles) {
            path.polyline(trail.into_iter().filter_map(|i| place(frame, self.picture.points[i as usize])));
        }
        // Thinner and fainter where there are more of them.
        let width = if triangles.len() > 3000 { 0.3 } else { 0.5 };
        let stroke = Stroke::solid(self.picture.edge_colour, width * units).attributes();
        svg.raw(&format!("<path fill=\"none\" stroke-opacity=\"0.6\" {stroke} d=\"{}\"/>", path.data()));
    }

    /// Entries of the legend.
    pub fn entries(&self) -> Vec<Entry> {
        let sample = |draw: &dyn Fn(&mut Svg)| {
            let mut svg = Svg::new();
            draw(&mut svg);
            svg.into_fragment()
        };
        let line = |stroke: Stroke| move |svg: &mut Svg| svg.line([0.0, 0.0], [SAMPLE, 0.0], stroke);
        let mut entries = Vec::new();
        for polyline in &self.picture.lines {
            let mut elements = sample(&line(polyline.stroke()));
            if polyline.tip {
                elements.push_str(&dot([SAMPLE, 0.0], polyline.tip_radius(), polyline.colour));
            }
            entries.push(Entry { sample: elements, name: polyline.label.clone() });
        }
        for marker in &self.picture.markers {
            entries.push(Entry { sample: dot([0.5 * SAMPLE, 0.0], 3.5, marker.colour), name: marker.label.clone() });
        }
        if !self.picture.outline.is_empty() {
            entries.push(Entry { sample: sample(&line(outline_stroke())), name: "undeformed".into() });
        }
        if !self.bare.is_empty() {
            let patch = |svg: &mut Svg| svg.rect([6.0, -5.0], [SAMPLE - 12.0, 10.0], Colour::NO_DATA);
            entries.push(Entry { sample: sample(&patch), name: "no value".into() });
        }
        entries
    }
}

impl Polyline {
    fn stroke(&self) -> Stroke {
        let width = if self.width.is_finite() { self.width.clamp(0.2, 50.0) } else { 2.5 };
        Stroke { colour: self.colour, width, dashed: self.dashed }
    }

    fn tip_radius(&self) -> f64 {
        self.stroke().width + 1.5
    }

    fn draw(&self, svg: &mut Svg, frame: &Frame) {
        let stroke = self.stroke();
        let rim = Stroke::solid(Colour(0xff, 0xff, 0xff), stroke.width + 1.6);
        draw_line(svg, frame, self.points.iter().copied(), rim);
        draw_line(svg, frame, self.points.iter().copied(), stroke);
        let tip = self.points.iter().rev().find_map(|&p| place(frame, p));
        if let (true, Some(at)) = (self.tip, tip) {
            svg.raw(&dot(at, self.tip_radius(), self.colour));
        }
    }
}

/// Position in the frame of a point in m.
fn place(frame: &Frame, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
    frame.place([1e3 * x, 1e3 * y])
}

fn draw_line(svg: &mut Svg, frame: &Frame, points: impl Iterator<Item = [f64; 2]>, stroke: Stroke) {
    let places: Vec<Option<[f64; 2]>> = points.map(|p| place(frame, p)).collect();
    let mut path = PathData::new(100.0);
    for run in places.split(Option::is_none) {
        path.polyline(run.iter().flatten().copied());
    }
    if !path.is_empty() {
        let scaled = Stroke { width: 100.0 * stroke.width, ..stroke }.attributes();
        let group = PathData::group_attribute(100.0);
        let joins = "stroke-linejoin=\"round\" stroke-linecap=\"round\"";
        svg.raw(&format!("<path {group} fill=\"none\" {joins} {scaled} d=\"{}\"/>", path.data()));
    }
}

fn outline_stroke() -> Stroke {
    Stroke { colour: Colour::GREY, width: 1.1, dashed: true }
}

fn dot([x, y]: [f64; 2], radius: f64, colour: Colour) -> String {
    let [x, y, radius] = [x, y, radius].map(num);
    format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"1\"/>")
}
