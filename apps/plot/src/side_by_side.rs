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

/// Pictures from left to right, their middles at one height.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SideBySide<'a> {
    /// Above all; may be empty.
    pub title: String,
    /// The pictures.
    pub pictures: Vec<Picture<'a>>,
}

impl SideBySide<'_> {
    /// The pictures as one SVG document.
    ///
    /// # Errors
    /// Those of each of the pictures; [`PlotError::Empty`] without pictures.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        let pages: Vec<Page> = self.pictures.iter().map(Picture::page).collect::<Result<_, _>>()?;
        if pages.is_empty() {
            return Err(PlotError::Empty { picture: self.title.clone(), points: 0 });
        }
        let top = if self.title.is_empty() { 0.0 } else { BORDER + 1.2 * TITLE_SIZE };
        let width: f64 = pages.iter().map(|page| page.width).sum();
        let tallest = pages.iter().map(|page| page.height).fold(0.0, f64::max);
        let mut svg = Svg::new();
        if !self.title.is_empty() {
            let title = text::fit_bold(&self.title, TITLE_SIZE, width - 2.0 * BORDER);
            svg.bold([0.5 * width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        let mut left = 0.0;
        for page in pages {
            let (corner, next) = ([left, top + 0.5 * (tallest - page.height)], left + page.width);
            page.draw_into(&mut svg, corner);
            left = next;
        }
        Ok(svg.finish(width, top + tallest, &self.title))
    }

    /// Writes the pictures to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }
}
