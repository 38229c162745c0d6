//! Several meshes in space side by side, such as the instants of a motion: one box, one view, one colour scale.

use std::path::Path;

use super::view::{Vec3, View};
use super::{Colouring, Scene, SolidPicture, bounds, draw};
use crate::PlotError;
use crate::axis::{LABEL_SIZE, draw_note, extent, too_wide};
use crate::chart::{BORDER, TITLE_SIZE};
use crate::colour::ColourMap;
use crate::colour_bar::ColourScale;
use crate::file::write_atomic;
use crate::svg::{Anchor, Page, Svg, num};
use crate::text;

/// Between two pictures, px.
const GAP: f64 = 14.0;

/// Meshes in space that share view, box and colours.
///
/// The `range`, `levels`, `colours`, `colour_label`, `by_region`, `towards` and `size` of the pictures themselves are not
/// used. Their titles stand above each.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidPanel<'a> {
    /// Above all pictures; may be empty.
    pub title: String,
    /// From left to right.
    pub pictures: Vec<SolidPicture<'a>>,
    /// What the colours mean, with the unit.
    pub colour_label: String,
    /// Number of colour bands, 2 to 256.
    pub levels: usize,
    /// Values of the ends of the colour scale; by default those of the cells that are drawn in any of the pictures.
    pub range: Option<(f64, f64)>,
    /// Colours for magnitudes or for signed values.
    pub colours: ColourMap,
    /// The direction in which the viewer is.
    pub towards: Vec3,
    /// Greatest width and height of one mesh on the page, px.
    pub size: [f64; 2],
}

impl Default for SolidPanel<'_> {
    fn default() -> Self {
        let SolidPicture { levels, colours, towards, .. } = SolidPicture::default();
        Self {
            title: String::new(),
            pictures: Vec::new(),
            colour_label: String::new(),
            levels,
            range: None,
            colours,
            towards,
            size: [230.0, 230.0],
        }
    }
}

impl SolidPanel<'_> {
    /// All pictures as one SVG document.
    ///
    /// # Errors
    /// Those of [`SolidPicture::to_svg`], for any of the pictures; [`PlotError::Empty`] without pictures.
    pub fn to_svg(&self) -> Result<String, PlotError> {
        self.page().map(Page::document)
    }

    /// Writes the panel to a file, all at once or not at all.
    ///
    /// # Errors
    /// Those of [`to_svg`](Self::to_svg), and [`PlotError::Write`] with the path.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), PlotError> {
        write_atomic(path.as_ref(), &self.to_svg()?)
    }

    pub(crate) fn page(&self) -> Result<Page, PlotError> {
        let scenes = self.scenes()?;
        let values = self.pictures.iter().zip(&scenes).flat_map(|(picture, scene)| picture.shown_values(scene));
        let (min, max) = extent(values).unwrap_or((0.0, 0.0));
        let scale = ColourScale::around(min, max, self.range, self.colours, self.levels)
            .map_err(|[low, high]| too_wide(&self.title, [low, high]))?;
        Ok(self.draw(&scenes, scale))
    }

    /// What is seen of each mesh, in the box around all of them.
    fn scenes(&self) -> Result<Vec<Scene>, PlotError> {
        let mut corners = Vec::with_capacity(2 * self.pictures.len());
        for picture in &self.pictures {
            picture.check()?;
            corners.extend(picture.bounds()?);
        }
        let around = bounds(corners).ok_or_else(|| PlotError::Empty { picture: self.title.clone(), points: 0 })?;
        if (0..3).any(|k| !(around[1][k] - around[0][k]).is_finite()) {
            return Err(too_wide(&self.title, around.into_iter().flatten()));
        }
        let alike = |picture: &SolidPicture<'_>| {
            SolidPicture { towards: self.towards, size: self.size, ..picture.clone() }.scene(&around)
        };
        self.pictures.iter().map(alike).collect()
    }

    fn draw(&self, scenes: &[Scene], scale: ColourScale) -> Page {
        let mut svg = Svg::new();
        let [width, height] = scenes[0].frame.size;
        let titled = self.pictures.iter().any(|picture| !picture.title.is_empty());
        let top = BORDER + if self.title.is_empty() { 0.0 } else { 1.9 * TITLE_SIZE };
        let below_titles = top + if titled { 1.6 * LABEL_SIZE } else { 0.0 };
        let left = BORDER + draw::AXES;
        let bar_left = left + scenes.len() as f64 * (width + GAP);
        let bar_height = height.max(120.0);
        let page_width = bar_left + scale.room(bar_height, &self.colour_label) + BORDER;
        if !self.title.is_empty() {
            let title = text::fit_bold(&self.title, TITLE_SIZE, page_width - 2.0 * BORDER);
            svg.bold([0.5 * page_width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
        }
        let colours = Colouring::Scale(scale);
        for (k, (picture, scene)) in self.pictures.iter().zip(scenes).enumerate() {
            let corner = left + k as f64 * (width + GAP);
            let title = text::fit_bold(&picture.title, LABEL_SIZE, width);
            svg.bold([corner + 0.5 * width, top + LABEL_SIZE], LABEL_SIZE, Anchor::Middle, &title);
            svg.open_group(&format!("transform=\"translate({} {})\"", num(corner), num(below_titles)));
            draw::draw_box(&mut svg, scene);
            draw::draw_faces(&mut svg, picture, scene, &colours);
            picture.lines.iter().for_each(|line| draw::draw_line(&mut svg, line, &scene.frame));
            svg.close_group();
        }
        draw::draw_axes(
            &mut svg,
            &View::from(self.towards),
            draw::AXIS_NAMES,
            [BORDER + 8.0, below_titles + height - 8.0],
        );
        scale.draw(&mut svg, [bar_left, below_titles], bar_height, &self.colour_label);
        let mut below = below_titles + bar_height + 14.0;
        let left_out: usize = scenes.iter().map(|scene| scene.left_out).sum();
        if left_out > 0 {
            below += LABEL_SIZE;
            let note = format!("{left_out} cells with positions that are not finite are left out.");
            draw_note(&mut svg, [BORDER, below], &note, page_width - 2.0 * BORDER);
        }
        Page { svg, width: page_width, height: below + 0.6 * BORDER, title: self.title.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [Vec3; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn picture<'a>(points: &'a [Vec3], values: &'a [f64]) -> SolidPicture<'a> {
        SolidPicture { points, tetrahedra: &[[0, 1, 2, 3]], values, title: "one".into(), ..SolidPicture::default() }
    }

    #[test]
    fn pictures_share_box_and_colours() {
        let double = CORNERS.map(|p| p.map(|x| 2.0 * x));
        let panel =
            SolidPanel { pictures: vec![picture(&CORNERS, &[1.0]), picture(&double, &[5.0])], ..SolidPanel::default() };
        let scenes = panel.scenes().unwrap();
        assert!(scenes.iter().all(|scene| scene.bounds == [[0.0; 3], [2.0; 3]]));
        let place = |k: usize, p: Vec3| scenes[k].frame.place(p);
        assert_eq!(place(0, [1.0; 3]), place(1, [1.0; 3]));
        let svg = panel.to_svg().unwrap();
        assert!(svg.starts_with("<svg") && svg.matches(">one</text>").count() == 2, "{svg}");
    }

    #[test]
    fn nothing_to_show_is_an_error() {
        assert!(matches!(SolidPanel::default().to_svg(), Err(PlotError::Empty { .. })));
        let far = CORNERS.map(|p| p.map(|x| f64::MAX * x));
        let near = far.map(|p| p.map(|x| -x));
        let panel =
            SolidPanel { pictures: vec![picture(&far, &[1.0]), picture(&near, &[1.0])], ..SolidPanel::default() };
        assert!(matches!(panel.to_svg(), Err(PlotError::Range { .. })));
        let short = SolidPanel { pictures: vec![picture(&CORNERS, &[])], ..SolidPanel::default() };
        assert!(matches!(short.to_svg(), Err(PlotError::Shape { .. })));
    }
}
