//! The legend: what each line and marker is.

use crate::axis::LABEL_SIZE;
use crate::svg::{Anchor, Svg};
use crate::text;

/// Height of one entry, px.
const ROW: f64 = 19.0;
/// Length of the sample of a line, px.
pub(crate) const SAMPLE: f64 = 28.0;
const GAP: f64 = 8.0;
/// A name wider than this is cut, px: a legend beside the data is as wide as its longest name, and a sentence would take more
/// room than the data.
const NAME_LIMIT: f64 = 400.0;
/// Beyond this many entries a last line says how many there are.
const MOST: usize = 40;

/// One entry: a sample drawn around the origin over [`SAMPLE`] px to the right, and a name.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Entry {
    /// SVG elements.
    pub sample: String,
    pub name: String,
}

/// Entries with names cut to length; those without a name are left out.
pub(crate) fn shortened(entries: Vec<Entry>) -> Vec<Entry> {
    let mut entries: Vec<Entry> = entries.into_iter().filter(|entry| !entry.name.trim().is_empty()).collect();
    let more = entries.len().saturating_sub(MOST);
    entries.truncate(MOST);
    for entry in &mut entries {
        entry.name = text::fit(&entry.name, LABEL_SIZE, NAME_LIMIT);
    }
    if more > 0 {
        entries.push(Entry { sample: String::new(), name: format!("and {more} more") });
    }
    entries
}

fn entry_width(entry: &Entry) -> f64 {
    SAMPLE + GAP + text::width(&entry.name, LABEL_SIZE)
}

fn draw_entry(svg: &mut Svg, entry: &Entry, [x, y]: [f64; 2]) {
    if !entry.sample.is_empty() {
        svg.open_group(&format!("transform=\"translate({} {})\"", crate::svg::num(x), crate::svg::num(y)));
        svg.raw(&entry.sample);
        svg.close_group();
    }
    svg.text([x + SAMPLE + GAP, y + 0.36 * LABEL_SIZE], LABEL_SIZE, Anchor::Start, &entry.name);
}

/// Width and height of a column of entries.
pub(crate) fn column_size(entries: &[Entry]) -> [f64; 2] {
    [entries.iter().map(entry_width).fold(0.0, f64::max), ROW * entries.len() as f64]
}

/// Draws entries one below the other; `corner` is the upper left one.
pub(crate) fn draw_column(svg: &mut Svg, entries: &[Entry], [x, y]: [f64; 2]) {
    for (i, entry) in entries.iter().enumerate() {
        draw_entry(svg, entry, [x, y + ROW * (i as f64 + 0.5)]);
    }
}

/// Positions of entries set in rows of at most `width` px, and the height of all rows.
pub(crate) fn row_layout(entries: &[Entry], width: f64) -> (Vec<[f64; 2]>, f64) {
    let (mut x, mut y) = (0.0, 0.5 * ROW);
    let mut places = Vec::new();
    for entry in entries {
        if x > 0.0 && x + entry_width(entry) > width {
            (x, y) = (0.0, y + ROW);
        }
        places.push([x, y]);
        x += entry_width(entry) + 22.0;
    }
    (places, if entries.is_empty() { 0.0 } else { y + 0.5 * ROW })
}

/// Draws entries in rows from the upper left `corner`.
pub(crate) fn draw_rows(svg: &mut Svg, entries: &[Entry], corner: [f64; 2], width: f64) {
    for (entry, [x, y]) in entries.iter().zip(row_layout(entries, width).0) {
        draw_entry(svg, entry, [corner[0] + x, corner[1] + y]);
    }
}
