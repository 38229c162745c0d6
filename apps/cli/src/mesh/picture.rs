//! Pictures of meshes.

use super::feature::Feature;
use super::source::Soup;
use crate::exit::Failure;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_mesh::quality::{Measure, MeasureReport, QualityReport, normalized_volume};
use stylet_plot::{
    Bars, Colour, Cut, HistogramPanel, MeshPanel, MeshPicture, Picture, PlotError, Polyline, SideBySide, SolidPicture,
    SpaceLine,
};

/// Colour of a feature.
const NEEDLE: Colour = Colour(0xc4, 0x1e, 0x3a);
const NEEDLE_WIDTH: f64 = 1.6;
/// Where the viewer is.
const TOWARDS: [f64; 3] = [0.42, -1.0, 0.48];

/// How a mesh is coloured and cut open.
#[derive(Default)]
pub struct Look {
    pub by_region: bool,
    /// Names of regions by their numbers.
    pub names: Vec<String>,
    /// Direction of what is taken away; the viewer's if left out.
    pub cut: Option<[f64; 3]>,
}

/// A mesh as pictures take it, whatever its dimension, coloured by cell.
pub struct Drawing {
    pub title: String,
    pub colour_label: String,
    pub by_region: bool,
    pub region_names: Vec<String>,
    /// Padded with zeros.
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    tetrahedra: Vec<[u32; 4]>,
    values: Vec<f64>,
    /// A feature, or a needle.
    line: Vec<[f64; 3]>,
    cut: Option<Cut>,
    is_plane: bool,
    range: Option<(f64, f64)>,
}

impl Drawing {
    /// The cells of a mesh; those that name vertices that do not exist are left out.
    pub fn new<const D: usize, const N: usize>(points: &[[f64; D]], cells: &[[u32; N]], values: &[f64]) -> Self {
        let mut drawing = Self {
            title: String::new(),
            colour_label: String::new(),
            by_region: false,
            region_names: Vec::new(),
            points: points.iter().map(pad).collect(),
            triangles: Vec::new(),
            tetrahedra: Vec::new(),
            values: Vec::new(),
            line: Vec::new(),
            cut: None,
            is_plane: D == 2,
            range: None,
        };
        for (v, &value) in cells.iter().zip(values) {
            if v.iter().any(|&i| i as usize >= points.len()) {
                continue;
            }
            if let Ok(v) = v[..].try_into() {
                drawing.triangles.push(v);
            } else if let Ok(v) = v[..].try_into() {
                drawing.tetrahedra.push(v);
            } else {
                continue;
            }
            drawing.values.push(value);
        }
        if N == 4 {
            drawing.cut = drawing.middle().map(|middle| Cut::through(middle, [0.0, -1.0, 0.0]));
        }
        drawing
    }

    /// The middle of the box around all finite points.
    fn middle(&self) -> Option<[f64; 3]> {
        let finite = || self.points.iter().filter(|p| p.iter().all(|x| x.is_finite()));
        finite().next()?;
        Some(std::array::from_fn(|k| {
            let range = finite().fold((f64::MAX, f64::MIN), |(l, h), p| (l.min(p[k]), h.max(p[k])));
            0.5 * range.0 + 0.5 * range.1
        }))
    }

    /// Shows a feature, and cuts at it.
    fn show<const D: usize>(&mut self, feature: &Feature<D>) {
        match feature {
            Feature::Point(p) => self.show_line(&[*p]),
            Feature::Segment(a, b) => self.show_line(&[*a, *b]),
            Feature::Everywhere => {}
        }
    }

    /// Shows a polyline, and cuts at its ends.
    fn show_line<const D: usize>(&mut self, points: &[[f64; D]]) {
        self.line = points.iter().map(pad).collect();
        if self.tetrahedra.is_empty() || points.is_empty() {
            return;
        }
        let (a, b) = (self.line[0], self.line[self.line.len() - 1]);
        let along: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let dot = |u: [f64; 3], v: [f64; 3]| (0..3).map(|k| u[k] * v[k]).sum::<f64>();
        // Of the planes that contain the feature the one that is nearest to upright and faces the viewer.
        let viewer = [0.0, -1.0, 0.0];
        let part = if dot(along, along) > 0.0 { dot(viewer, along) / dot(along, along) } else { 0.0 };
        let normal: [f64; 3] = std::array::from_fn(|k| viewer[k] - part * along[k]);
        // A feature that points at the viewer leaves no such plane.
        let normal = if dot(normal, normal) > 0.05 { normal } else { [0.0, 0.0, 1.0] };
        self.cut = Some(Cut::through(a, normal));
    }

    /// The picture of a mesh in space.
    fn solid(&self) -> SolidPicture<'_> {
        let lines = match self.line[..] {
            [] => Vec::new(),
            _ => vec![SpaceLine {
                points: self.line.clone(),
                colour: NEEDLE,
                width: 3.0,
                label: String::new(),
                tip: true,
            }],
        };
        SolidPicture {
            points: &self.points,
            tetrahedra: &self.tetrahedra,
            triangles: &self.triangles,
            values: &self.values,
            title: self.title.clone(),
            colour_label: self.colour_label.clone(),
            by_region: self.by_region,
            region_names: self.region_names.clone(),
            range: self.range,
            cut: self.cut,
            towards: TOWARDS,
            lines,
            ..SolidPicture::default()
        }
    }

    /// The picture of a plane mesh, whose points are given.
    fn panel<'a>(&'a self, points: &'a [[f64; 2]]) -> MeshPanel<'a> {
        let line = Polyline {
            points: self.line.iter().map(|&[x, y, _]| [x, y]).collect(),
            colour: NEEDLE,
            width: NEEDLE_WIDTH,
            tip: true,
            ..Polyline::default()
        };
        let picture = MeshPicture {
            points,
            triangles: &self.triangles,
            cell_values: Some(&self.values),
            title: self.title.clone(),
            lines: if self.line.is_empty() { Vec::new() } else { vec![line] },
            edge_colour: Colour::INK,
            ..MeshPicture::default()
        };
        MeshPanel {
            pictures: vec![picture],
            colour_label: self.colour_label.clone(),
            range: self.range,
            ..MeshPanel::default()
        }
    }

    fn plane_points(&self) -> Vec<[f64; 2]> {
        self.points.iter().map(|&[x, y, _]| [x, y]).collect()
    }

    /// Writes the picture alone.
    pub fn write(&self, path: &Path) -> Result<(), Failure> {
        let written =
            if self.is_plane { self.panel(&self.plane_points()).write(path) } else { self.solid().write(path) };
        written.map_err(refuse)
    }

    /// Writes the picture beside histograms.
    pub fn write_beside(&self, histograms: HistogramPanel, path: &Path) -> Result<(), Failure> {
        let points = self.plane_points();
        let picture = if self.is_plane { Picture::Mesh(self.panel(&points)) } else { Picture::Solid(self.solid()) };
        let pictures = vec![Picture::Histograms(histograms), picture];
        SideBySide { pictures, ..SideBySide::default() }.write(path).map_err(refuse)
    }
}

fn refuse(error: PlotError) -> Failure {
    Failure::bad_input(format!("--plot: {error}"))
}

fn pad<const D: usize>(p: &[f64; D]) -> [f64; 3] {
    std::array::from_fn(|k| p.get(k).copied().unwrap_or(0.0))
}

/// Draws a refined mesh, coloured by the number of bisections, with the feature.
///
/// # Errors
/// A file that cannot be written.
pub fn draw_refined<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    feature: &Feature<D>,
    title: &str,
    path: &Path,
) -> Result<(), Failure> {
    let cells: Vec<[u32; N]> = mesh.cells().map(|c| mesh.cell(c).map(|v| v.0)).collect();
    let levels: Vec<f64> = mesh.cells().map(|c| f64::from(mesh.level(c))).collect();
    let mut drawing = Drawing::new(mesh.points(), &cells, &levels);
    let cells = if N == 3 { "triangles" } else { "tetrahedra" };
    drawing.title = format!("{title}: {} {cells}", mesh.n_cells());
    drawing.colour_label = "bisections of a start cell".to_owned();
    // From the start cells on; their own colour is never the only one.
    let deepest = levels.iter().copied().fold(1.0, f64::max);
    drawing.range = Some((0.0, deepest));
    drawing.show(feature);
    drawing.write(path)
}

/// Draws a mesh with a needle in it, coloured by quality.
///
/// # Errors
/// A file that cannot be written.
pub fn draw_needle<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    needle: &[[f64; D]],
    title: &str,
    path: &Path,
) -> Result<(), Failure> {
    let cells: Vec<[u32; N]> = mesh.cells().map(|c| mesh.cell(c).map(|v| v.0)).collect();
    let quality: Vec<f64> = mesh.cells().map(|c| normalized_volume(&mesh.oriented(c).map(|v| mesh.point(v)))).collect();
    let mut drawing = Drawing::new(mesh.points(), &cells, &quality);
    drawing.title = title.to_owned();
    drawing.colour_label = "quality q".to_owned();
    drawing.range = Some((0.0, 1.0));
    drawing.show_line(needle);
    drawing.write(path)
}

/// Draws histograms of the quality of a mesh, and beside them the mesh.
///
/// # Errors
/// A file that cannot be written, a mesh of which nothing can be drawn.
pub fn draw_quality<const D: usize, const N: usize>(
    soup: &Soup<D, N>,
    quality: &[f64],
    Look { by_region, names, cut }: Look,
    report: &QualityReport,
    title: &str,
    path: &Path,
) -> Result<(), Failure> {
    let regions: Vec<f64> = soup.regions.iter().map(|&region| f64::from(region)).collect();
    let mut drawing = Drawing::new(&soup.points, &soup.cells, if by_region { &regions } else { quality });
    drawing.by_region = by_region && D == 3;
    drawing.region_names = names;
    if let (Some(normal), Some(middle), 4) = (cut, drawing.middle(), N) {
        drawing.cut = Some(Cut::through(middle, normal));
    }
    drawing.colour_label = if by_region { "region" } else { "quality q" }.to_owned();
    drawing.range = (!by_region).then_some((0.0, 1.0));
    let shown = [Measure::Angle, Measure::Quality, Measure::Aspect, Measure::RadiusEdge];
    let histograms = shown.iter().filter_map(|&measure| report.measure(measure)).map(bars::<N>).collect();
    drawing.write_beside(HistogramPanel { title: title.to_owned(), histograms, columns: 1 }, path)
}

fn bars<const N: usize>(report: &MeasureReport) -> Bars {
    let histogram = &report.histogram;
    Bars {
        label: report.measure.name(N).to_owned(),
        low: histogram.low,
        high: histogram.high,
        counts: histogram.counts.clone(),
        below: histogram.below,
        above: histogram.above,
        marks: report.measure.limits().iter().map(|&(_, limit)| limit).collect(),
        note: format!(
            "{} to {}, mean {}",
            super::quality::short(report.min),
            super::quality::short(report.max),
            super::quality::short(report.mean)
        ),
    }
}
