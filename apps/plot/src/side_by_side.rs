//! Pictures of several sorts in one file.

use std::path::Path;

use crate::chart::{BORDER, TITLE_SIZE};
use crate::file::write_atomic;
use crate::svg::{Anchor, Page, Svg};
use crate::{HistogramPanel, MeshPanel, PlotError, SolidPicture, text};

/// A picture that can stand beside others.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "two panels, each made once")]
pub enum Picture<'a> {
    /// Plane meshes.
    Mesh(MeshPanel<'a>),
    /// A mesh in space.
    Solid(SolidPicture<'a>),
    /// Histograms.
    Histograms(HistogramPanel),
}

impl Picture<'_> {
    fn page(&self) -> Result<Page, PlotError> {
        match self {
            Self::Mesh(panel) => panel.page(),
            Self::Solid(picture) => picture.page(),
            Self::Histograms(panel) => panel.page(),
        }
    }
}

/// Pages, and whether each is centred in the height of its row.
fn row(pictures: &[Picture<'_>]) -> Result<Vec<(Page, bool)>, PlotError> {
    let page = |picture: &Picture<'_>| Ok((picture.page()?, matches!(picture, Picture::Histograms(_))));
    pictures.iter().map(page).collect()
}

/// Pictures from left to right, in one row or in two. Meshes have their upper edges at one height, histograms their middles at
/// that of the row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SideBySide<'a> {
    /// Above all; may be empty.
    pub title: String,
    /// The pictures.
    pub pictures: Vec<Picture<'a>>,
    /// A second row, such as smaller pictures of other times; may be empty.
    pub below: Vec<Picture<'a>>,
}

impl SideBySide<'_> {
    /// The pictures as one SVG document.
    ///
    /// # Errors
    /// Those of each of the pictures; [`PlotError::Empty`] without pictures.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let rows = [row(&self.pictures)?, row(&self.below)?];
        if rows.iter().all(Vec::is_empty) {
            return Err(PlotError::Empty { picture: self.title.clone(), points: 0 });
        }
        let top = if self.title.is_empty() { 0.0 } else { BORDER + 1.2 * TITLE_SIZE };
        let width_of = |row: &[(Page, bool)]| row.iter().map(|(page, _)| page.width).sum::<f64>();
        let width = rows.iter().map(|row| width_of(row)).fold(0.0, f64::max);
        let mut svg = Svg::new();
        if !self.title.is_empty() {
            let title = text::fit_bold(&self.title, TITLE_SIZE, width - 2.0 * BORDER);
            svg.bold([0.5 * width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        let mut upper = top;
        for row in rows {
            let tallest = row.iter().map(|(page, _)| page.height).fold(0.0, f64::max);
            let mut left = 0.5 * (width - width_of(&row));
            for (page, is_centred) in row {
                let down = if is_centred { 0.5 * (tallest - page.height) } else { 0.0 };
                let (corner, next) = ([left, upper + down], left + page.width);
                page.draw_into(&mut svg, corner);
                left = next;
            }
            upper += tallest;
        }
        Ok(svg.finish(width, upper, &self.title))
    }

    /// Writes the pictures to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }
}
