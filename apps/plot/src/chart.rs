//! A chart: series on two axes, with grid and legend.

use std::path::Path;

use crate::axis::{Frame, LABEL_SIZE, Scale, bottom_margin, draw_note, left_margin, too_wide};
use crate::colour::PALETTE;
use crate::file::write_atomic;
use crate::legend::{self, Entry, SAMPLE};
use crate::series::Drawing;
use crate::svg::{Anchor, Stroke, Svg};
use crate::{PlotError, Series, text};

/// Font size of a title, px.
pub(crate) const TITLE_SIZE: f64 = 15.0;
/// Space around a picture, px.
pub(crate) const BORDER: f64 = 14.0;

/// A chart of one or several series.
#[derive(Debug, Clone, PartialEq)]
pub struct Chart {
    /// Above the chart; may be empty.
    pub title: String,
    /// Below the horizontal axis, with the unit.
    pub x_label: String,
    /// Beside the vertical axis, with the unit.
    pub y_label: String,
    /// Logarithmic horizontal axis.
    pub log_x: bool,
    /// Logarithmic vertical axis.
    pub log_y: bool,
    /// What is drawn, later ones above earlier ones.
    pub series: Vec<Series>,
    /// Horizontal lines across the chart, such as a limit or a published value, with their names in the legend.
    pub levels: Vec<(f64, String)>,
    /// Ends of the horizontal axis; by default those of the data.
    pub x_range: Option<(f64, f64)>,
    /// Ends of the vertical axis; by default those of the data.
    pub y_range: Option<(f64, f64)>,
    /// A line of small text below the chart.
    pub note: String,
    /// Width and height of the frame, px, without labels and legend.
    pub size: [f64; 2],
}

impl Default for Chart {
    fn default() -> Self {
        Self {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            log_x: false,
            log_y: false,
            series: Vec::new(),
            levels: Vec::new(),
            x_range: None,
            y_range: None,
            note: String::new(),
            size: [600.0, 380.0],
        }
    }
}

impl Chart {
    /// The chart as an SVG document.
    ///
    /// # Errors
    /// [`PlotError::Empty`] if no point can be shown; [`PlotError::Range`] if an axis would be wider than a double, or
    /// if a given range is empty, not finite, or not positive on a logarithmic axis.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let [x, y] = self.scales()?;
        let size = self.size.map(|length| if length.is_finite() { length.clamp(120.0, 4000.0) } else { 400.0 });
        let mut frame = Frame { corner: [0.0, 0.0], size, x, y };
        let ticks = frame.ticks();
        let entries = legend::shortened(self.entries());
        let [legend_width, legend_height] = legend::column_size(&entries);

        let top = BORDER + if self.title.is_empty() { 0.0 } else { 1.8 * TITLE_SIZE };
        frame.corner = [BORDER + left_margin(&ticks[1], &self.y_label), top];
        let [right, bottom] = [frame.corner[0] + size[0], frame.corner[1] + size[1]];
        let legend_room = if entries.is_empty() { 0.0 } else { legend_width + 18.0 };
        let width = right + legend_room.max(12.0) + BORDER;
        let below = (bottom + bottom_margin(&self.x_label)).max(top + legend_height);

        let mut svg = Svg::new();
        let title = text::fit_bold(&self.title, TITLE_SIZE, width - 2.0 * BORDER);
        if !title.is_empty() {
            // Centred over the frame where that fits on the page, else over the page.
            let half = 0.5 * text::bold_width(&title, TITLE_SIZE);
            let middle = (frame.corner[0] + 0.5 * size[0]).min(width - BORDER - half).max(BORDER + half);
            svg.bold([middle, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        frame.draw_grid(&mut svg, &ticks);
        let left_out = self.draw_data(&mut svg, &frame);
        frame.draw_axes(&mut svg, &ticks, [&self.x_label, &self.y_label]);
        legend::draw_column(&mut svg, &entries, [right + 18.0, top]);

        let note = self.note_with(left_out);
        let height = below + if note.is_empty() { 0.0 } else { 1.5 * LABEL_SIZE } + 0.5 * BORDER;
        if !note.is_empty() {
            draw_note(&mut svg, [BORDER, height - 0.7 * BORDER], &note, width - 2.0 * BORDER);
        }
        Ok(svg.finish(width, height, &self.title))
    }

    /// Writes the chart to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }

    /// The points that both axes can show.
    fn shown(&self) -> impl Iterator<Item = (f64, f64)> + Clone + '_ {
        let fits = |x: f64, log: bool| x.is_finite() && (!log || x > 0.0);
        let points = self.series.iter().flat_map(|series| series.points.iter().copied());
        points.filter(move |&(x, y)| fits(x, self.log_x) && fits(y, self.log_y))
    }

    fn scales(&self) -> Result<[Scale; 2], PlotError> {
        let given: usize = self.series.iter().map(|series| series.points.len()).sum();
        if self.shown().next().is_none() {
            return Err(PlotError::Empty { picture: self.title.clone(), points: given });
        }
        let levels = self.levels.iter().map(|level| level.0).filter(|&y| y.is_finite() && (!self.log_y || y > 0.0));
        let x = self.scale(self.shown().map(|point| point.0), self.log_x, self.x_range, 0.02)?;
        let y = self.scale(self.shown().map(|point| point.1).chain(levels), self.log_y, self.y_range, 0.05)?;
        Ok([x, y])
    }

    fn scale(
        &self,
        values: impl Iterator<Item = f64> + Clone,
        log: bool,
        range: Option<(f64, f64)>,
        margin: f64,
    ) -> Result<Scale, PlotError> {
        match range {
            Some((min, max)) => Scale::exact(min, max, log).ok_or_else(|| too_wide(&self.title, [min, max])),
            None => {
                let scale = Scale::around(values.clone(), log, margin).map(Scale::with_zero);
                scale.ok_or_else(|| too_wide(&self.title, values))
            }
        }
    }

    fn drawings(&self) -> impl Iterator<Item = Drawing<'_>> {
        self.series.iter().enumerate().map(|(i, series)| Drawing { series, index: series.colour.unwrap_or(i) })
    }

    /// Series and levels; returns how many points were left out.
    fn draw_data(&self, svg: &mut Svg, frame: &Frame) -> usize {
        frame.open_clip(svg);
        for (i, (y, _)) in self.levels.iter().enumerate() {
            if let Some(t) = frame.y.fraction(*y).filter(|t| (0.0..=1.0).contains(t)) {
                let height = (1.0 - t) * frame.size[1];
                svg.line([0.0, height], [frame.size[0], height], self.level_stroke(i));
            }
        }
        let left_out = self.drawings().map(|drawing| drawing.draw(svg, frame)).sum();
        Frame::close_clip(svg);
        left_out
    }

    /// Levels take the colours that follow those of the series.
    fn level_stroke(&self, i: usize) -> Stroke {
        Stroke { colour: PALETTE[(self.series.len() + i) % PALETTE.len()], width: 1.3, dashed: true }
    }

    fn entries(&self) -> Vec<Entry> {
        let levels = self.levels.iter().enumerate().map(|(i, (_, name))| {
            let mut sample = Svg::new();
            sample.line([0.0, 0.0], [SAMPLE, 0.0], self.level_stroke(i));
            Entry { sample: sample.into_fragment(), name: name.clone() }
        });
        self.drawings().map(|drawing| drawing.entry()).chain(levels).collect()
    }

    fn note_with(&self, left_out: usize) -> String {
        let plural = if left_out == 1 { "" } else { "s" };
        let why =
            if self.log_x || self.log_y { "not finite, or not positive on a logarithmic axis" } else { "not finite" };
        let count = if left_out == 0 { String::new() } else { format!("{left_out} point{plural} left out: {why}.") };
        [self.note.as_str(), &count].iter().filter(|part| !part.is_empty()).copied().collect::<Vec<_>>().join("  ")
    }
}
