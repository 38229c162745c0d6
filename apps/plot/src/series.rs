//! One series of a chart: its line, steps or points.

use crate::axis::Frame;
use crate::colour::{Colour, PALETTE};
use crate::legend::{Entry, SAMPLE};
use crate::path::PathData;
use crate::svg::{Stroke, Svg, num};

/// How a series is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Style {
    /// Straight lines from point to point.
    #[default]
    Line,
    /// A marker at each point.
    Points,
    /// Both.
    LinePoints,
    /// Each value holds until the next point.
    Steps,
    /// Every two points are opposite corners of a filled rectangle.
    Boxes,
}

/// Points with a name. A point that is not finite, or that a logarithmic axis cannot show, is left out, and breaks the
/// line.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Name in the legend; a series without one is not in it.
    pub name: String,
    /// Abscissa and ordinate.
    pub points: Vec<(f64, f64)>,
    /// Line, points or both.
    pub style: Style,
    /// Whether lines are dashed: for a reference, or a published result.
    pub dashed: bool,
    /// Index into [`PALETTE`], wrapped around; by default the position of the series in its chart. Two series of one
    /// colour, one of them dashed, read as a pair. It also selects the shape of the marker.
    pub colour: Option<usize>,
}

/// Units of path data per px.
const UNITS: f64 = 20.0;
/// Beyond this many markers plain dots are drawn, which take a fifth of the bytes.
const MOST_SHAPES: usize = 1000;

/// A series with its place in the palette.
pub(crate) struct Drawing<'a> {
    pub series: &'a Series,
    pub index: usize,
}

impl Drawing<'_> {
    fn colour(&self) -> Colour {
        PALETTE[self.index % PALETTE.len()]
    }

    fn stroke(&self) -> Stroke {
        Stroke { colour: self.colour(), width: 1.8, dashed: self.series.dashed }
    }

    fn has_line(&self) -> bool {
        !matches!(self.series.style, Style::Points | Style::Boxes)
    }

    fn has_markers(&self) -> bool {
        matches!(self.series.style, Style::Points | Style::LinePoints)
    }

    /// Draws into the clip of `frame` and returns how many points were left out.
    pub fn draw(&self, svg: &mut Svg, frame: &Frame) -> usize {
        if self.series.style == Style::Boxes {
            return self.draw_boxes(svg, frame);
        }
        let runs = runs(&self.series.points, frame);
        if self.has_line() {
            self.draw_lines(svg, &runs, frame.size[0]);
        }
        if self.has_markers() {
            let all: Vec<[f64; 2]> = runs.iter().flatten().copied().collect();
            self.draw_markers(svg, &all);
        } else {
            // A point without neighbours would not show as a line.
            let lone: Vec<[f64; 2]> = runs.iter().filter(|run| run.len() == 1).map(|run| run[0]).collect();
            self.draw_markers(svg, &lone);
        }
        self.series.points.len() - runs.iter().map(Vec::len).sum::<usize>()
    }

    fn draw_lines(&self, svg: &mut Svg, runs: &[Vec<[f64; 2]>], width: f64) {
        let mut path = PathData::new(UNITS);
        for run in runs {
            let thin = thinned(run, width);
            if self.series.style == Style::Steps {
                path.polyline(stairs(&thin));
            } else {
                path.polyline(thin);
            }
        }
        if !path.is_empty() {
            let Stroke { colour, width, dashed } = self.stroke();
            let scaled = Stroke { colour, width: width * UNITS, dashed };
            let (group, stroke) = (PathData::group_attribute(UNITS), scaled.attributes());
            svg.raw(&format!("<path {group} fill=\"none\" stroke-linejoin=\"round\" {stroke} d=\"{}\"/>", path.data()));
        }
    }

    /// Without smoothed edges, so that rectangles side by side leave no seam.
    fn draw_boxes(&self, svg: &mut Svg, frame: &Frame) -> usize {
        let mut path = PathData::new(UNITS);
        let mut drawn = 0;
        for pair in self.series.points.chunks_exact(2) {
            let [Some([x0, y0]), Some([x1, y1])] = [pair[0], pair[1]].map(|(x, y)| frame.place([x, y])) else {
                continue;
            };
            path.ring([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]);
            drawn += 2;
        }
        if !path.is_empty() {
            let (group, colour) = (PathData::group_attribute(UNITS), self.colour());
            svg.raw(&format!("<path {group} shape-rendering=\"crispEdges\" fill=\"{colour}\" d=\"{}\"/>", path.data()));
        }
        self.series.points.len() - drawn
    }

    fn draw_markers(&self, svg: &mut Svg, points: &[[f64; 2]]) {
        if points.is_empty() {
            return;
        }
        let colour = self.colour();
        if points.len() > MOST_SHAPES {
            let dots: String = points.iter().map(|[x, y]| format!("M{} {}h0", num(*x), num(*y))).collect();
            svg.raw(&format!("<path stroke=\"{colour}\" stroke-width=\"4\" stroke-linecap=\"round\" d=\"{dots}\"/>"));
        } else {
            let shapes: String = points.iter().map(|&point| self.marker(point)).collect();
            svg.raw(&format!("<path fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"0.7\" d=\"{shapes}\"/>"));
        }
    }

    /// Path data of one marker: circle, square, triangle, diamond or triangle downwards.
    fn marker(&self, [x, y]: [f64; 2]) -> String {
        let at = format!("M{} {}", num(x), num(y));
        match self.index % 5 {
            0 => format!("{at}m-3.8 0a3.8 3.8 0 1 0 7.6 0a3.8 3.8 0 1 0-7.6 0z"),
            1 => format!("{at}m-3.5-3.5h7v7h-7z"),
            2 => format!("{at}m0-4.6l4.3 7.6h-8.6z"),
            3 => format!("{at}m0-4.8l4.8 4.8-4.8 4.8-4.8-4.8z"),
            _ => format!("{at}m0 4.6l4.3-7.6h-8.6z"),
        }
    }

    /// The entry of the legend.
    pub fn entry(&self) -> Entry {
        let mut sample = Svg::new();
        if self.series.style == Style::Boxes {
            sample.rect([6.0, -5.0], [SAMPLE - 12.0, 10.0], self.colour());
        }
        if self.has_line() {
            sample.line([0.0, 0.0], [SAMPLE, 0.0], self.stroke());
        }
        if self.has_markers() {
            let marker = self.marker([0.5 * SAMPLE, 0.0]);
            sample.raw(&format!("<path fill=\"{}\" d=\"{marker}\"/>", self.colour()));
        }
        Entry { sample: sample.into_fragment(), name: self.series.name.clone() }
    }
}

/// Positions on the page, split where a point cannot be shown.
fn runs(points: &[(f64, f64)], frame: &Frame) -> Vec<Vec<[f64; 2]>> {
    let mut runs = vec![Vec::new()];
    for &(x, y) in points {
        match frame.place([x, y]) {
            Some(place) => runs.last_mut().expect("never empty").push(place),
            None => runs.push(Vec::new()),
        }
    }
    runs.retain(|run| !run.is_empty());
    runs
}

/// First, lowest, highest and last point of each half px, where a long series runs from left to right: what is dropped
/// cannot be told apart on the page.
fn thinned(run: &[[f64; 2]], width: f64) -> Vec<[f64; 2]> {
    let forward = run.windows(2).all(|pair| pair[0][0] <= pair[1][0]);
    if !forward || (run.len() as f64) < 8.0 * width {
        return run.to_vec();
    }
    let mut kept = Vec::new();
    for column in run.chunk_by(|a, b| (2.0 * a[0]).floor() == (2.0 * b[0]).floor()) {
        let by_height = |i: &usize, j: &usize| column[*i][1].total_cmp(&column[*j][1]);
        let low = (0..column.len()).min_by(by_height).expect("chunks are not empty");
        let high = (0..column.len()).max_by(by_height).expect("chunks are not empty");
        let mut order = [0, low, high, column.len() - 1];
        order.sort_unstable();
        kept.extend(order.map(|i| column[i]));
    }
    kept
}

/// The corners of a line that keeps each value until the next point.
fn stairs(run: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut corners = Vec::with_capacity(2 * run.len());
    for pair in run.windows(2) {
        corners.extend([pair[0], [pair[1][0], pair[0][1]]]);
    }
    corners.extend(run.last());
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_extremes_of_every_column() {
        let run: Vec<[f64; 2]> = (0..100_000).map(|i| [f64::from(i) / 1000.0, f64::from(i * 7919 % 1013)]).collect();
        let thin = thinned(&run, 100.0);
        assert!(thin.len() <= 4 * 201, "{}", thin.len());
        let top = |points: &[[f64; 2]]| points.iter().map(|p| p[1]).fold(0.0, f64::max);
        assert_eq!(top(&thin), top(&run));
        assert_eq!((thin.first(), thin.last()), (run.first(), run.last()));
    }

    #[test]
    fn steps_hold_their_value() {
        assert_eq!(stairs(&[[0.0, 1.0], [2.0, 3.0]]), [[0.0, 1.0], [2.0, 1.0], [2.0, 3.0]]);
    }
}
