//! Several mesh pictures side by side, with one colour scale and one scale of length.

use std::path::Path;

use crate::PlotError;
use crate::axis::{Frame, LABEL_SIZE, Scale, bottom_margin, draw_note, extent, left_margin, too_wide};
use crate::chart::{BORDER, TITLE_SIZE};
use crate::colour::ColourMap;
use crate::colour_bar::ColourScale;
use crate::file::write_atomic;
use crate::legend;
use crate::mesh_picture::{MeshPicture, Prepared};
use crate::svg::{Anchor, Page, Svg};
use crate::text;

/// No side of a frame is shorter than this, px.
const SHORTEST: f64 = 90.0;
/// Largest height of a frame, px.
const TALLEST: f64 = 460.0;

/// Mesh pictures that share colours and length scale, such as an error field for several methods.
///
/// The `range`, `levels`, `colours` and `colour_label` of the pictures themselves are not used.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshPanel<'a> {
    /// Above all pictures; may be empty.
    pub title: String,
    /// From left to right, then from top to bottom.
    pub pictures: Vec<MeshPicture<'a>>,
    /// Pictures in a row; 0 stands for up to three.
    pub columns: usize,
    /// What the colours mean, with the unit.
    pub colour_label: String,
    /// Number of colour bands, 2 to 256.
    pub levels: usize,
    /// Values of the ends of the colour scale; by default those of all fields together.
    pub range: Option<(f64, f64)>,
    /// Colours for magnitudes or for signed values.
    pub colours: ColourMap,
}

impl Default for MeshPanel<'_> {
    fn default() -> Self {
        Self {
            title: String::new(),
            pictures: Vec::new(),
            columns: 0,
            colour_label: String::new(),
            levels: 32,
            range: None,
            colours: ColourMap::default(),
        }
    }
}

/// Lower left and upper right corner, mm.
type Window = [[f64; 2]; 2];

impl MeshPanel<'_> {
    /// All pictures as one SVG document.
    ///
    /// # Errors
    /// Those of [`MeshPicture::to_svg`], for any of the pictures; [`PlotError::Empty`] without pictures.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        self.page().map(Page::document)
    }

    pub(crate) fn page(&self) -> Result<Page, PlotError> {
        if self.pictures.is_empty() {
            return Err(PlotError::Empty { picture: self.title.clone(), points: 0 });
        }
        let prepared: Vec<Prepared<'_>> = self.pictures.iter().map(MeshPicture::prepare).collect::<Result<_, _>>()?;
        let windows: Vec<Window> = prepared.iter().map(window).collect::<Result<_, _>>()?;
        let colours = self.colour_scale(&prepared)?;
        let columns = match self.columns {
            0 => self.pictures.len().min(3),
            n => n.min(self.pictures.len()),
        };
        let frames = frames(&windows, columns, &self.pictures)?;
        Ok(self.draw(&prepared, &colours, columns, &frames))
    }

    /// Writes the panel to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }

    fn name(&self) -> &str {
        if self.title.is_empty() { &self.pictures[0].title } else { &self.title }
    }

    fn colour_scale(&self, prepared: &[Prepared<'_>]) -> Result<ColourScale, PlotError> {
        let values = || prepared.iter().flat_map(Prepared::values);
        let (min, max) = extent(values()).unwrap_or((0.0, 0.0));
        ColourScale::around(min, max, self.range, self.colours, self.levels)
            .map_err(|[low, high]| too_wide(self.name(), [low, high]))
    }

    fn draw(&self, prepared: &[Prepared<'_>], colours: &ColourScale, columns: usize, frames: &Frames) -> Page {
        let mut svg = Svg::new();
        let top = BORDER + if self.title.is_empty() { 0.0 } else { 1.9 * TITLE_SIZE };
        let [cell_width, cell_height] = frames.cell;
        let rows = prepared.len().div_ceil(columns);
        let right = BORDER + columns as f64 * cell_width;
        let first = frames.frames[0].size[1];
        let bar_height = if rows == 1 { first.max(140.0) } else { cell_height.max(first).min(420.0) };
        let width = right + 12.0 + colours.room(bar_height, &self.colour_label) + BORDER;
        if !self.title.is_empty() {
            let title = text::fit_bold(&self.title, TITLE_SIZE, width - 2.0 * BORDER);
            svg.bold([0.5 * width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        for (i, (picture, local)) in prepared.iter().zip(&frames.frames).enumerate() {
            let cell = [BORDER + (i % columns) as f64 * cell_width, top + (i / columns) as f64 * cell_height];
            let frame = Frame { corner: [cell[0] + local.corner[0], cell[1] + local.corner[1]], ..*local };
            draw_cell(&mut svg, picture, &frame, colours, cell_width);
        }
        colours.draw(&mut svg, [right + 12.0, top + frames.frames[0].corner[1]], bar_height, &self.colour_label);

        let mut below = top + rows as f64 * cell_height;
        below = below.max(top + frames.frames[0].corner[1] + bar_height + 14.0);
        let mut entries = Vec::new();
        for entry in prepared.iter().flat_map(Prepared::entries) {
            if !entries.contains(&entry) {
                entries.push(entry);
            }
        }
        let entries = legend::shortened(entries);
        let room = width - 2.0 * BORDER;
        legend::draw_rows(&mut svg, &entries, [BORDER + frames.frames[0].corner[0], below], room);
        below += legend::row_layout(&entries, room).1;
        let left_out: usize = prepared.iter().map(Prepared::left_out).sum();
        if left_out > 0 {
            below += 1.6 * LABEL_SIZE;
            let note = format!("{left_out} triangles with positions that are not finite are left out.");
            draw_note(&mut svg, [BORDER, below - 4.0], &note, room);
        }
        Page { svg, width, height: below + 0.6 * BORDER, title: self.name().to_owned() }
    }
}

/// Whether two ends make an interval; false with NaN.
fn ascending(low: f64, high: f64) -> bool {
    low < high
}

fn draw_cell(svg: &mut Svg, picture: &Prepared<'_>, frame: &Frame, colours: &ColourScale, cell_width: f64) {
    let ticks = frame.ticks();
    let title = text::fit_bold(&picture.picture.title, 0.93 * TITLE_SIZE, cell_width - 20.0);
    if !title.is_empty() {
        let at = [frame.corner[0] + 0.5 * frame.size[0], frame.corner[1] - 9.0];
        svg.bold(at, 0.93 * TITLE_SIZE, Anchor::Middle, &title);
    }
    frame.draw_grid(svg, &ticks);
    picture.draw(svg, frame, colours);
    frame.draw_axes(svg, &ticks, ["x (mm)", "y (mm)"]);
}

/// What a picture shows, mm, with a small margin.
fn window(prepared: &Prepared<'_>) -> Result<Window, PlotError> {
    let title = &prepared.picture.title;
    let ends = |axis: usize| -> Result<[f64; 2], PlotError> {
        let (low, high) = match prepared.picture.view {
            Some([low, high]) if !ascending(low[axis], high[axis]) => {
                return Err(too_wide(title, [low[axis], high[axis]]));
            }
            Some([low, high]) => (low[axis], high[axis]),
            None => extent(prepared.positions().map(|p| p[axis])).unwrap_or((0.0, 0.0)),
        };
        let margin = if prepared.picture.view.is_some() { 0.0 } else { 0.03 * (high - low) };
        let window = [1e3 * (low - margin), 1e3 * (high + margin)];
        if (window[1] - window[0]).is_finite() { Ok(window) } else { Err(too_wide(title, [low, high])) }
    };
    let ([x0, x1], [y0, y1]) = (ends(0)?, ends(1)?);
    Ok([[x0, y0], [x1, y1]])
}

/// The frames of all pictures, relative to the corners of their cells.
struct Frames {
    frames: Vec<Frame>,
    /// Width and height of a cell, px.
    cell: [f64; 2],
}

fn frames(windows: &[Window], columns: usize, pictures: &[MeshPicture<'_>]) -> Result<Frames, PlotError> {
    let widest = match columns {
        1 => 620.0,
        2 => 430.0,
        _ => 330.0,
    };
    let length = |window: &Window, axis: usize| window[1][axis] - window[0][axis];
    let largest = |axis: usize| windows.iter().map(|window| length(window, axis)).fold(0.0, f64::max);
    let mut px_per_mm = (widest / largest(0)).min(TALLEST / largest(1));
    if !px_per_mm.is_finite() || px_per_mm == 0.0 {
        // A single point has no size: one mm across the frame.
        px_per_mm = widest;
    }
    let mut frames = Vec::new();
    for (window, picture) in windows.iter().zip(pictures) {
        let side = |axis: usize| -> Option<(f64, Scale)> {
            let px = (length(window, axis) * px_per_mm).max(SHORTEST);
            let (middle, half) = (0.5 * window[0][axis] + 0.5 * window[1][axis], 0.5 * px / px_per_mm);
            Some((px, Scale::exact(middle - half, middle + half, false)?))
        };
        let wrong = || too_wide(&picture.title, window.iter().flatten().copied());
        let ((width, x), (height, y)) = (side(0).ok_or_else(wrong)?, side(1).ok_or_else(wrong)?);
        frames.push(Frame { corner: [0.0, 0.0], size: [width, height], x, y });
    }
    let margin = frames.iter().map(|frame| left_margin(&frame.ticks()[1], "y (mm)")).fold(0.0, f64::max);
    let titled = pictures.iter().any(|picture| !picture.title.is_empty());
    let top = if titled { 1.9 * TITLE_SIZE } else { 6.0 };
    let size = |axis: usize| frames.iter().map(|frame| frame.size[axis]).fold(0.0, f64::max);
    let cell = [margin + size(0) + 22.0, top + size(1) + bottom_margin("x (mm)") + 8.0];
    for frame in &mut frames {
        frame.corner = [margin, top];
    }
    Ok(Frames { frames, cell })
}
