//! A chart: series on two axes, with grid and legend.

use std::path::Path;

use crate::axis::{Frame, LABEL_SIZE, Scale, TICK_SIZE, bottom_margin, draw_note, left_margin, too_wide};
use crate::colour::{Colour, PALETTE};
use crate::file::write_atomic;
use crate::legend::{self, Entry, SAMPLE};
use crate::series::Drawing;
use crate::svg::{Anchor, Stroke, Svg, escape, num};
use crate::{PlotError, Series, text};

/// Font size of a title, px.
pub(crate) const TITLE_SIZE: f64 = 15.0;
/// Space around a picture, px.
pub(crate) const BORDER: f64 = 14.0;

/// How steeply the names of marks rise, degrees.
const SLANT: f64 = 40.0;
/// No side of a frame is shorter than this, px.
const SHORTEST: f64 = 120.0;

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
    /// Vertical lines across the chart, such as events in time, with their names above the frame.
    pub marks: Vec<(f64, String)>,
    /// Whether a unit is as long on both axes, as in a drawing of places; the frame is then no larger than `size`.
    pub equal: bool,
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
            marks: Vec::new(),
            equal: false,
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
        let size = self.size.map(|length| if length.is_finite() { length.clamp(SHORTEST, 4000.0) } else { 400.0 });
        let mut frame = Frame { corner: [0.0, 0.0], size, x, y };
        if self.equal {
            frame = true_to_scale(frame);
        }
        let size = frame.size;
        let ticks = frame.ticks();
        let entries = legend::shortened(self.entries());
        let [legend_width, legend_height] = legend::column_size(&entries);

        let names = self.marks.iter().map(|mark| text::width(&mark.1, TICK_SIZE) * SLANT.to_radians().sin() + 12.0);
        let title_room = if self.title.is_empty() { 0.0 } else { 1.8 * TITLE_SIZE };
        let top = BORDER + title_room + names.fold(0.0, f64::max);
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
        self.draw_mark_names(&mut svg, &frame);
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
        for [at, _] in self.marked(frame) {
            let stroke = Stroke { colour: Colour(0x99, 0x99, 0x99), width: 1.0, dashed: true };
            svg.line([at, 0.0], [at, frame.size[1]], stroke);
        }
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

    /// By mark in view, ascending: its place, and that of its name, moved to the right where it would touch the one before; px.
    fn marked(&self, frame: &Frame) -> Vec<[f64; 2]> {
        let places = self.sorted_marks().into_iter().filter_map(|mark| frame.x.fraction(mark.0));
        let mut free_from = f64::NEG_INFINITY;
        let mut placed = Vec::new();
        for at in places.filter(|t| (0.0..=1.0).contains(t)).map(|t| t * frame.size[0]) {
            placed.push([at, at.max(free_from)]);
            // A line of text apart, across the slant.
            free_from = at.max(free_from) + 1.25 * TICK_SIZE / SLANT.to_radians().sin();
        }
        placed
    }

    fn sorted_marks(&self) -> Vec<&(f64, String)> {
        let mut marks: Vec<&(f64, String)> = self.marks.iter().filter(|mark| mark.0.is_finite()).collect();
        marks.sort_by(|a, b| a.0.total_cmp(&b.0));
        marks
    }

    fn draw_mark_names(&self, svg: &mut Svg, frame: &Frame) {
        let [left, top] = frame.corner;
        let in_view = |mark: &&(f64, String)| frame.x.fraction(mark.0).is_some_and(|t| (0.0..=1.0).contains(&t));
        let names = self.sorted_marks().into_iter().filter(in_view).map(|mark| &mark.1);
        for (name, [at, above]) in names.zip(self.marked(frame)) {
            let [x, y] = [left + above + 3.0, top - 8.0];
            svg.line([left + at, top], [left + above, y + 2.0], Stroke::solid(Colour(0x99, 0x99, 0x99), 1.0));
            let turn = format!(" transform=\"rotate(-{SLANT} {} {})\"", num(x), num(y));
            svg.label([x, y], TICK_SIZE, Anchor::Start, &escape(name), &turn);
        }
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

/// The frame with as many px to a unit along both axes: the shorter side shrinks, to no less than [`SHORTEST`].
fn true_to_scale(frame: Frame) -> Frame {
    let px = (frame.size[0] / frame.x.length()).min(frame.size[1] / frame.y.length());
    let [width, height] = [frame.x.length() * px, frame.y.length() * px].map(|side| side.max(SHORTEST));
    if !(px > 0.0 && px.is_finite() && width.is_finite() && height.is_finite()) {
        return frame;
    }
    Frame { size: [width, height], x: frame.x.widened(width / px), y: frame.y.widened(height / px), ..frame }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(x: f64, y: f64) -> Frame {
        let scale = |length: f64| Scale::exact(1.0, 1.0 + length, false).unwrap();
        Frame { corner: [0.0; 2], size: [600.0, 400.0], x: scale(x), y: scale(y) }
    }

    #[test]
    fn units_are_as_long_on_both_axes() {
        for (x, y, size) in [(100.0, 30.0, [600.0, 180.0]), (10.0, 100.0, [120.0, 400.0]), (100.0, 1.0, [600.0, 120.0])]
        {
            let frame = true_to_scale(frame(x, y));
            assert!((0..2).all(|k| (frame.size[k] - size[k]).abs() < 1e-9), "{:?}", frame.size);
            let [right, up] = [frame.size[0] / frame.x.length(), frame.size[1] / frame.y.length()];
            assert!((right / up - 1.0).abs() < 1e-12, "{right} {up}");
            // The middle stays.
            assert!((frame.y.fraction(1.0 + 0.5 * y).unwrap() - 0.5).abs() < 1e-12);
        }
    }

    /// The picture is as wide as the longest name asks for; what is too long for that is cut.
    #[test]
    fn names_in_the_legend_are_whole_and_within_the_picture() {
        let width = |names: &[&str]| {
            let one = |name: &&str| Series {
                name: (*name).to_owned(),
                points: vec![(1.0, 1.0), (2.0, 2.0)],
                ..Series::default()
            };
            let svg = Chart { series: names.iter().map(one).collect(), ..Chart::default() }.to_svg().unwrap();
            let at = |text: &str, from: &str| -> f64 {
                let rest = &text[text.find(from).unwrap() + from.len()..];
                rest[..rest.find('"').unwrap()].parse().unwrap()
            };
            for name in names {
                let kept =
                    svg.lines().find(|line| line.starts_with("<text") && line.contains(&name[..40.min(name.len())]));
                let line = kept.unwrap_or_else(|| panic!("no {name}"));
                assert_eq!(line.contains(name), name.len() < 60, "{line}");
                let shown = &line[line.find('>').unwrap() + 1..line.rfind("</text>").unwrap()];
                let end = at(line, "x=\"") + text::width(shown, LABEL_SIZE);
                assert!(end < at(&svg, "width=\""), "{name} ends at {end}");
            }
            at(&svg, "width=\"")
        };
        let long = "constraint-preconditioned, steps of 40 to 5 ms";
        assert!(width(&["short"]) + 200.0 < width(&["short", long]));
        assert!(width(&["short", &"a name without an end ".repeat(20)]) < 1200.0);
    }

    #[test]
    fn names_of_marks_do_not_touch() {
        let marks = [50.0, 1.0, 1.5, 500.0, f64::NAN].map(|at| (at, format!("at {at}"))).to_vec();
        let chart = Chart { marks, ..Chart::default() };
        let placed = chart.marked(&frame(100.0, 1.0));
        assert_eq!(placed.len(), 3);
        assert!(
            placed.windows(2).all(|pair| pair[0][0] <= pair[1][0]
                && (pair[1][1] - pair[0][1]) * SLANT.to_radians().sin() > 1.2 * TICK_SIZE),
            "{placed:?}"
        );
        assert_eq!(placed[2][0], placed[2][1]);
    }
}
