//! The scale of colours: bands between levels, and the bar that explains them.

use crate::axis::{LABEL_SIZE, TICK_SIZE};
use crate::colour::{Colour, ColourMap};
use crate::svg::{Anchor, Stroke, Svg, num};
use crate::{text, ticks};

/// Width of the bar, px.
const WIDTH: f64 = 16.0;

/// Bands of equal width between two numbers, and their colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ColourScale {
    pub map: ColourMap,
    pub low: f64,
    pub high: f64,
    pub bands: usize,
    /// Whether there are values below `low` and above `high`; they have the colours of the ends.
    pub beyond: [bool; 2],
}

impl ColourScale {
    /// Bands for values from `min` to `max`, or over a given range; the ends as an error if they are not in order or too
    /// far apart.
    pub fn around(
        min: f64,
        max: f64,
        range: Option<(f64, f64)>,
        map: ColourMap,
        levels: usize,
    ) -> Result<Self, [f64; 2]> {
        let (mut low, mut high) = range.unwrap_or((min, max));
        if !(max - min).is_finite() {
            return Err([min, max]);
        }
        let ascending = low < high; // false with NaN
        if range.is_some() && !ascending {
            return Err([low, high]);
        }
        if map == ColourMap::Diverging && range.is_none() {
            high = low.abs().max(high.abs());
            low = -high;
        }
        if low == high {
            // A constant field: an interval around it, so that the bar has numbers.
            let pad = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
            (low, high) = (low - pad, high + pad);
        }
        if !(high - low).is_finite() {
            return Err([low, high]);
        }
        Ok(Self { map, low, high, bands: levels.clamp(2, 256), beyond: [min < low, max > high] })
    }

    /// The band of a finite value.
    pub fn band_of(&self, value: f64) -> usize {
        let t = (value - self.low) / (self.high - self.low);
        // The cast saturates.
        ((t * self.bands as f64) as usize).min(self.bands - 1)
    }

    /// Colour of a finite value.
    pub fn of(&self, value: f64) -> Colour {
        self.band(self.band_of(value))
    }

    /// The levels between the bands, ascending.
    pub fn levels(&self) -> Vec<f64> {
        let width = (self.high - self.low) / self.bands as f64;
        (1..self.bands).map(|k| self.low + k as f64 * width).collect()
    }

    /// Colour of band `k`, counted from the lowest.
    pub fn band(&self, k: usize) -> Colour {
        let steps = (self.bands - 1).max(1) as f64;
        self.map.at(if self.bands == 1 { 0.5 } else { k as f64 / steps })
    }

    fn ticks(&self, height: f64) -> Vec<ticks::Tick> {
        ticks::linear(self.low, self.high, ((height / 40.0) as usize).clamp(2, 10))
    }

    /// Width of bar, numbers and label, px.
    pub fn room(&self, height: f64, label: &str) -> f64 {
        let label = if label.is_empty() { 0.0 } else { 1.6 * LABEL_SIZE };
        WIDTH + 8.0 + self.numbers_width(height) + label
    }

    fn numbers_width(&self, height: f64) -> f64 {
        let labels = self.ticks(height).into_iter().filter_map(|tick| tick.label);
        labels.map(|label| text::width(&ticks::plain(&label), TICK_SIZE)).fold(0.0, f64::max)
    }

    /// Draws the bar with its upper left corner at `[x, y]`.
    pub fn draw(&self, svg: &mut Svg, [x, y]: [f64; 2], height: f64, label: &str) {
        let step = height / self.bands as f64;
        for k in 0..self.bands {
            // Each band reaches to the top of the bar, so that no gap shows between it and the next.
            let reach = height - k as f64 * step;
            svg.rect([x, y], [WIDTH, reach], self.band(k));
        }
        svg.frame([x, y], [WIDTH, height], Stroke::solid(Colour::INK, 0.8));
        self.draw_ends(svg, [x, y], height);
        for tick in self.ticks(height) {
            let t = (tick.at - self.low) / (self.high - self.low);
            let at = y + (1.0 - t.clamp(0.0, 1.0)) * height;
            svg.line([x + WIDTH, at], [x + WIDTH + 4.0, at], Stroke::solid(Colour::INK, 0.8));
            let markup = tick.label.unwrap_or_default();
            svg.label([x + WIDTH + 7.0, at + 0.36 * TICK_SIZE], TICK_SIZE, Anchor::Start, &markup, "");
        }
        if !label.is_empty() {
            let label = text::fit(label, LABEL_SIZE, height + 60.0);
            let right = x + WIDTH + 8.0 + self.numbers_width(height) + 1.3 * LABEL_SIZE;
            svg.text_upwards([right, y + 0.5 * height], LABEL_SIZE, &label);
        }
    }

    /// Points at the ends of the bar beyond which there are values.
    fn draw_ends(&self, svg: &mut Svg, [x, y]: [f64; 2], height: f64) {
        let [left, right, middle] = [x, x + WIDTH, x + 0.5 * WIDTH].map(num);
        let ends = [(0, self.band(0), y + height, 9.0), (1, self.band(self.bands - 1), y, -9.0)];
        for (end, colour, base, reach) in ends {
            if self.beyond[end] {
                let [base, tip] = [base, base + reach].map(num);
                let stroke = Stroke::solid(Colour::INK, 0.8).attributes();
                svg.raw(&format!("<path fill=\"{colour}\" {stroke} d=\"M{left} {base}H{right}L{middle} {tip}z\"/>"));
            }
        }
    }
}
