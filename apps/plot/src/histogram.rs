//! Histograms, several in one picture.

use std::path::Path;

use crate::axis::{Frame, LABEL_SIZE, Scale, TICK_SIZE, bottom_margin, draw_note, left_margin};
use crate::chart::{BORDER, TITLE_SIZE};
use crate::colour::PALETTE;
use crate::file::write_atomic;
use crate::svg::{Anchor, Page, Stroke, Svg};
use crate::{PlotError, text};

/// A bin that holds anything at all is seen: its bar is at least so high, px.
const LOWEST_BAR: f64 = 1.5;
/// Width and height of a frame, px.
const FRAME: [f64; 2] = [290.0, 140.0];

/// Counts in bins of equal width.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Bars {
    /// What is counted, with the unit.
    pub label: String,
    /// Lower end of the first bin.
    pub low: f64,
    /// Upper end of the last bin.
    pub high: f64,
    /// The counts.
    pub counts: Vec<usize>,
    /// How many lie below `low`.
    pub below: usize,
    /// How many lie above `high`.
    pub above: usize,
    /// Values that are marked by a dashed line, such as limits.
    pub marks: Vec<f64>,
    /// A line of small text above the frame, such as the mean.
    pub note: String,
}

/// Histograms one beside or below the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistogramPanel {
    /// Above all; may be empty.
    pub title: String,
    /// From left to right, then from top to bottom.
    pub histograms: Vec<Bars>,
    /// Histograms in a row; 0 stands for two.
    pub columns: usize,
}

impl HistogramPanel {
    /// The histograms as an SVG document.
    ///
    /// # Errors
    /// [`PlotError::Empty`] without histograms; [`PlotError::Bins`] for one without bins, or whose ends are not finite and
    /// in order.
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
        if self.histograms.is_empty() {
            return Err(PlotError::Empty { picture: self.title.clone(), points: 0 });
        }
        let frames: Vec<Frame> = self.histograms.iter().map(Bars::frame).collect::<Result<_, _>>()?;
        let columns = if self.columns == 0 { 2 } else { self.columns }.min(frames.len());
        let left = frames.iter().map(|frame| left_margin(&frame.ticks()[1], "")).fold(0.0, f64::max);
        let above = 2.6 * LABEL_SIZE;
        let cell = [left + FRAME[0] + 20.0, above + FRAME[1] + bottom_margin("x") + 4.0];
        let top = BORDER + if self.title.is_empty() { 0.0 } else { 1.9 * TITLE_SIZE };
        let width = 2.0 * BORDER + columns as f64 * cell[0];
        let height = top + frames.len().div_ceil(columns) as f64 * cell[1] + 0.5 * BORDER;

        let mut svg = Svg::new();
        if !self.title.is_empty() {
            let title = text::fit_bold(&self.title, TITLE_SIZE, width - 2.0 * BORDER);
            svg.bold([0.5 * width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        for (i, (bars, frame)) in self.histograms.iter().zip(&frames).enumerate() {
            let (column, row) = ((i % columns) as f64, (i / columns) as f64);
            let corner = [BORDER + column * cell[0] + left, top + row * cell[1] + above];
            bars.draw(&mut svg, &Frame { corner, ..*frame });
        }
        Ok(Page { svg, width, height, title: self.title.clone() })
    }
}

impl Bars {
    fn frame(&self) -> Result<Frame, PlotError> {
        let Self { label, low, high, counts, .. } = self;
        let wrong = || PlotError::Bins { label: label.clone(), bins: counts.len(), low: *low, high: *high };
        let finite = low.is_finite() && high.is_finite() && !counts.is_empty();
        let tallest = counts.iter().max().copied().unwrap_or(0).max(1) as f64;
        let x = Scale::exact(*low, *high, false).filter(|_| finite).ok_or_else(wrong)?;
        let y = Scale::exact(0.0, 1.06 * tallest, false).ok_or_else(wrong)?;
        Ok(Frame { corner: [0.0, 0.0], size: FRAME, x, y })
    }

    fn draw(&self, svg: &mut Svg, frame: &Frame) {
        let ticks = frame.ticks();
        frame.draw_grid(svg, &ticks);
        frame.open_clip(svg);
        let width = FRAME[0] / self.counts.len() as f64;
        let gap = (0.12 * width).min(1.0);
        for (k, &count) in self.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let height = frame.y.fraction(count as f64).unwrap_or(0.0) * FRAME[1];
            let height = height.max(LOWEST_BAR);
            svg.rect([k as f64 * width + gap, FRAME[1] - height], [width - 2.0 * gap, height], PALETTE[0]);
        }
        for &mark in &self.marks {
            if let Some(t) = frame.x.fraction(mark).filter(|t| (0.0..=1.0).contains(t)) {
                let stroke = Stroke { colour: PALETTE[1], width: 1.2, dashed: true };
                svg.line([t * FRAME[0], 0.0], [t * FRAME[0], FRAME[1]], stroke);
            }
        }
        Frame::close_clip(svg);
        frame.draw_axes(svg, &ticks, ["", ""]);
        let [x, y] = frame.corner;
        svg.text([x, y - 1.5 * LABEL_SIZE], LABEL_SIZE, Anchor::Start, &text::fit(&self.label, LABEL_SIZE, FRAME[0]));
        draw_note(svg, [x, y - 5.0], &self.note, FRAME[0]);
        let beyond = [(self.below, Anchor::Start, x + 4.0, "← "), (self.above, Anchor::End, x + FRAME[0] - 4.0, "→ ")];
        for (count, anchor, at, arrow) in beyond.into_iter().filter(|beyond| beyond.0 > 0) {
            svg.text([at, y + 1.3 * TICK_SIZE], TICK_SIZE, anchor, &format!("{arrow}{count} beyond"));
        }
    }
}
