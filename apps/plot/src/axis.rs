//! From numbers to px, and the frame of ticks, grid and labels around a plot.

use crate::colour::Colour;
use crate::svg::{Anchor, Stroke, Svg, escape};
use crate::ticks::{self, Tick};
use crate::{PlotError, text};

/// Font size of tick labels, px.
pub(crate) const TICK_SIZE: f64 = 11.0;
/// Font size of axis labels and legends, px.
pub(crate) const LABEL_SIZE: f64 = 12.5;
/// Length of a tick outside the frame, px.
const TICK_LENGTH: f64 = 4.0;
/// No coordinate is written beyond this many px: what is off the picture need not be exact.
const FAR: f64 = 1e6;

/// An interval of numbers, linear or logarithmic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    log: bool,
    /// Ends of the interval, as their logarithm on a logarithmic scale.
    low: f64,
    high: f64,
}

impl Scale {
    /// The interval of some finite numbers, positive ones if `log`, with `margin` times its length added at both ends.
    /// `None` without numbers, or if the length overflows.
    pub fn around(values: impl IntoIterator<Item = f64>, log: bool, margin: f64) -> Option<Self> {
        let transform = |x: f64| if log { x.log10() } else { x };
        let (min, max) = extent(values)?;
        let (low, high) = (transform(min), transform(max));
        let pad = if high > low {
            margin * (high - low)
        } else if log {
            0.3
        } else {
            // A constant is drawn in the middle of an interval of its own size.
            (0.1 * low.abs()).max(if low == 0.0 { 1.0 } else { f64::MIN_POSITIVE })
        };
        let scale = Self { log, low: low - pad, high: high + pad };
        let length = scale.high - scale.low;
        (length > 0.0 && length.is_finite()).then_some(scale)
    }

    /// Exactly the interval from `min` to `max`.
    pub fn exact(min: f64, max: f64, log: bool) -> Option<Self> {
        Self::around([min, max], log, 0.0).filter(|_| min < max)
    }

    /// Moves the lower end of a linear scale to zero if the numbers are positive and zero is near.
    pub fn with_zero(self) -> Self {
        let near = !self.log && self.low > 0.0 && self.low < 0.35 * self.high;
        if near { Self { low: 0.0, ..self } } else { self }
    }

    /// The length of the interval; of its logarithm on a logarithmic scale.
    pub fn length(&self) -> f64 {
        self.high - self.low
    }

    /// The scale with so much length, if it has less, about the same middle.
    pub fn widened(self, length: f64) -> Self {
        let pad = (0.5 * (length - self.length())).max(0.0);
        Self { low: self.low - pad, high: self.high + pad, ..self }
    }

    /// 0 at the lower end, 1 at the upper; `None` for a number that this scale cannot show.
    pub fn fraction(&self, x: f64) -> Option<f64> {
        let y = if self.log { x.log10() } else { x };
        let t = (y - self.low) / (self.high - self.low);
        t.is_finite().then_some(t)
    }

    /// Marks for about `target` labels.
    pub fn ticks(&self, target: usize) -> Vec<Tick> {
        if self.log {
            let (min, max) = (10f64.powf(self.low), 10f64.powf(self.high));
            ticks::logarithmic(min.max(f64::MIN_POSITIVE), max.min(f64::MAX), target)
        } else {
            // One number does not make a scale.
            let mut tries = (target..=3 * target).map(|n| ticks::linear(self.low, self.high, n));
            tries.find(|ticks| ticks.len() >= 2).unwrap_or_default()
        }
    }
}

/// Smallest and largest of some finite numbers.
pub(crate) fn extent(values: impl IntoIterator<Item = f64>) -> Option<(f64, f64)> {
    values.into_iter().fold(None, |extent, x| match extent {
        None => Some((x, x)),
        Some((min, max)) => Some((min.min(x), max.max(x))),
    })
}

/// The error of an interval whose length overflows.
pub(crate) fn too_wide(picture: &str, values: impl IntoIterator<Item = f64>) -> PlotError {
    let (min, max) = extent(values).unwrap_or((f64::NAN, f64::NAN));
    PlotError::Range { picture: picture.into(), min, max }
}

/// The rectangle of a plot on the page and the scales along its sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    /// Upper left corner, px.
    pub corner: [f64; 2],
    /// Width and height, px.
    pub size: [f64; 2],
    pub x: Scale,
    pub y: Scale,
}

impl Frame {
    /// Position relative to the corner, px; `None` for what a scale cannot show.
    pub fn place(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let (s, t) = (self.x.fraction(x)?, self.y.fraction(y)?);
        Some([(s * self.size[0]).clamp(-FAR, FAR), ((1.0 - t) * self.size[1]).clamp(-FAR, FAR)])
    }

    /// Ticks of both axes, as many as there is room for.
    pub fn ticks(&self) -> [Vec<Tick>; 2] {
        let room = |length: f64, each: f64| ((length / each) as usize).clamp(2, 12);
        [self.x.ticks(room(self.size[0], 70.0)), self.y.ticks(room(self.size[1], 48.0))]
    }

    /// Grid lines, to be drawn beneath the data.
    pub fn draw_grid(&self, svg: &mut Svg, [x_ticks, y_ticks]: &[Vec<Tick>; 2]) {
        let ([x0, y0], [width, height]) = (self.corner, self.size);
        for (tick, at) in self.along(x_ticks, &self.x, width) {
            svg.line([x0 + at, y0], [x0 + at, y0 + height], grid_stroke(tick));
        }
        for (tick, at) in self.along(y_ticks, &self.y, height) {
            svg.line([x0, y0 + height - at], [x0 + width, y0 + height - at], grid_stroke(tick));
        }
    }

    /// The frame with ticks and labels, to be drawn above the data.
    pub fn draw_axes(&self, svg: &mut Svg, [x_ticks, y_ticks]: &[Vec<Tick>; 2], [x_label, y_label]: [&str; 2]) {
        let ([x0, y0], [width, height]) = (self.corner, self.size);
        let stroke = Stroke::solid(Colour::INK, 1.0);
        svg.frame(self.corner, self.size, stroke);
        let bottom = y0 + height;
        let mut free_from = f64::NEG_INFINITY;
        for (tick, at) in self.along(x_ticks, &self.x, width) {
            let length = tick_length(tick);
            svg.line([x0 + at, bottom], [x0 + at, bottom + length], stroke);
            let Some(label) = &tick.label else { continue };
            let half = 0.5 * text::width(&ticks::plain(label), TICK_SIZE);
            // A label that would touch its neighbour is left out; its tick stays.
            if at - half >= free_from {
                svg.label([x0 + at, bottom + 17.0], TICK_SIZE, Anchor::Middle, label, "");
                free_from = at + half + 4.0;
            }
        }
        for (tick, at) in self.along(y_ticks, &self.y, height) {
            let y = bottom - at;
            svg.line([x0 - tick_length(tick), y], [x0, y], stroke);
            if let Some(label) = &tick.label {
                svg.label([x0 - 7.0, y + 0.36 * TICK_SIZE], TICK_SIZE, Anchor::End, label, "");
            }
        }
        let x_label = text::fit(x_label, LABEL_SIZE, width + 40.0);
        svg.text([x0 + 0.5 * width, bottom + 36.0], LABEL_SIZE, Anchor::Middle, &x_label);
        let y_label = text::fit(y_label, LABEL_SIZE, height + 40.0);
        let x = x0 - 7.0 - labels_width(y_ticks) - 12.0;
        svg.text_upwards([x, y0 + 0.5 * height], LABEL_SIZE, &y_label);
    }

    /// Opens a nested drawing that clips at the frame; its coordinates start at the corner.
    pub fn open_clip(&self, svg: &mut Svg) {
        let [x, y, width, height] = [self.corner[0], self.corner[1], self.size[0], self.size[1]].map(crate::svg::num);
        svg.raw(&format!("<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" overflow=\"hidden\">"));
    }

    /// Closes what [`open_clip`](Self::open_clip) opened.
    pub fn close_clip(svg: &mut Svg) {
        svg.raw("</svg>");
    }

    fn along<'a>(&self, ticks: &'a [Tick], scale: &Scale, length: f64) -> Vec<(&'a Tick, f64)> {
        let on_axis = |t: &f64| (-1e-6..=1.0 + 1e-6).contains(t);
        ticks.iter().filter_map(|tick| Some((tick, scale.fraction(tick.at).filter(on_axis)? * length))).collect()
    }
}

/// Room that an axis needs left of the frame: tick labels and a label read upwards.
pub(crate) fn left_margin(y_ticks: &[Tick], y_label: &str) -> f64 {
    let label = if y_label.is_empty() { 0.0 } else { 1.4 * LABEL_SIZE + 8.0 };
    labels_width(y_ticks) + 11.0 + label
}

/// Room below the frame: tick labels and a label.
pub(crate) fn bottom_margin(x_label: &str) -> f64 {
    if x_label.is_empty() { 26.0 } else { 46.0 }
}

fn labels_width(ticks: &[Tick]) -> f64 {
    let widths = ticks.iter().filter_map(|tick| tick.label.as_deref());
    widths.map(|label| text::width(&ticks::plain(label), TICK_SIZE)).fold(0.0, f64::max)
}

fn tick_length(tick: &Tick) -> f64 {
    if tick.label.is_some() { TICK_LENGTH } else { 0.6 * TICK_LENGTH }
}

fn grid_stroke(tick: &Tick) -> Stroke {
    let colour = if tick.label.is_some() { Colour::GRID } else { Colour(0xf0, 0xf0, 0xf0) };
    Stroke::solid(colour, 0.8)
}

/// A small grey line of text at the lower left, such as what was left out.
pub(crate) fn draw_note(svg: &mut Svg, at: [f64; 2], note: &str, limit: f64) {
    let cut = text::fit(note, TICK_SIZE, limit);
    let attributes = format!(" fill=\"{}\"", Colour::GREY);
    svg.label(at, TICK_SIZE, Anchor::Start, &escape(&cut), &attributes);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_map_their_ends_to_zero_and_one() {
        let linear = Scale::exact(-2.0, 6.0, false).unwrap();
        assert_eq!(linear.fraction(0.0), Some(0.25));
        let log = Scale::exact(1e-3, 1e1, true).unwrap();
        assert!((log.fraction(1e-2).unwrap() - 0.25).abs() < 1e-15);
        assert_eq!(log.fraction(0.0), None);
        assert_eq!(log.fraction(-1.0), None);
        assert_eq!(linear.fraction(f64::NAN), None);
    }

    #[test]
    fn constants_get_an_interval_and_overflow_does_not() {
        assert_eq!(Scale::around([5.0], false, 0.05).unwrap().fraction(5.0), Some(0.5));
        assert_eq!(Scale::around([0.0, 0.0], false, 0.05).unwrap().fraction(0.0), Some(0.5));
        assert!(Scale::around([-1e308, 1e308], false, 0.05).is_none());
        assert!(Scale::around([], false, 0.05).is_none());
        assert!(Scale::around([5e-324, 1.7e308], true, 0.05).is_some());
    }
}
