//! Putting the faces of a mesh in space on the page, with colour bar, axes, lines and legend.

use super::view::{Vec3, View, dot, unit};
use super::{Colouring, Scene, SolidPicture, SpaceLine, SpaceMarks, Symbol};
use crate::axis::{LABEL_SIZE, TICK_SIZE, draw_note};
use crate::chart::{BORDER, TITLE_SIZE};
use crate::colour::Colour;
use crate::legend::{self, Entry, SAMPLE};
use crate::path::PathData;
use crate::svg::{Anchor, Page, Stroke, Svg, num};
use crate::{PALETTE, text};

/// Units of path data per px.
const UNITS: f64 = 10.0;
/// Where the light comes from: right, up, towards the viewer.
const LIGHT: Vec3 = [-0.35, 0.65, 0.65];
/// The darkest shade of a colour.
const SHADOW: f64 = 0.5;
/// How much white is in the colours of faces that are not laid open by the cut.
const PALE: f64 = 0.72;
/// Width of the white rim of lines and marks, px.
const RIM: f64 = 1.4;
const WHITE: Colour = Colour(0xff, 0xff, 0xff);
/// Names of the axes of space.
pub(super) const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];
/// Room for the axes at the lower left, px.
pub(super) const AXES: f64 = 34.0;

/// Where the mesh lies in the picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Placement {
    view: View,
    /// The point, in the axes of the view, at the upper left corner.
    corner: [f64; 2],
    px_per_unit: f64,
    /// Width and height, px.
    pub size: [f64; 2],
}

impl Placement {
    /// The box from `bounds[0]` to `bounds[1]` in a picture of at most `limit` px.
    pub fn around(bounds: &[Vec3; 2], view: &View, limit: [f64; 2]) -> Self {
        let corners = corners(bounds).map(|p| view.project(p));
        let range = |axis: usize| {
            let values = corners.iter().map(|p| p[axis]);
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
        };
        let ((left, right), (bottom, top)) = (range(0), range(1));
        let scale = (limit[0] / (right - left)).min(limit[1] / (top - bottom));
        let px_per_unit = if scale.is_finite() { scale } else { 1.0 };
        let size = [(right - left) * px_per_unit, (top - bottom) * px_per_unit];
        Self { view: *view, corner: [left, top], px_per_unit, size }
    }

    /// Position in px from the upper left corner, and how near it is to the viewer, in the same unit.
    pub fn place(&self, p: Vec3) -> Vec3 {
        let [x, y, depth] = self.view.project(p);
        let far = |x: f64| if x.is_finite() { x.clamp(-1e6, 1e6) } else { 0.0 };
        [
            far((x - self.corner[0]) * self.px_per_unit),
            far((self.corner[1] - y) * self.px_per_unit),
            depth * self.px_per_unit,
        ]
    }

    fn flat(&self, p: Vec3) -> [f64; 2] {
        let [x, y, _] = self.place(p);
        [x, y]
    }
}

/// The corners of a box; those that differ in one bit of their number are joined by an edge.
fn corners(bounds: &[Vec3; 2]) -> [Vec3; 8] {
    std::array::from_fn(|i| std::array::from_fn(|k| bounds[i >> k & 1][k]))
}

pub(super) fn page(picture: &SolidPicture<'_>, scene: &Scene, colours: &Colouring) -> Page {
    let mut svg = Svg::new();
    let top = BORDER + if picture.title.is_empty() { 6.0 } else { 1.9 * TITLE_SIZE };
    let [width, height] = scene.frame.size;
    let bar_height = (0.7 * height).clamp(120.0, 360.0);
    let bar_room = match colours {
        Colouring::Scale(scale) => 18.0 + scale.room(bar_height, &picture.colour_label),
        Colouring::Regions { .. } => 0.0,
    };
    let left = BORDER + AXES;
    let page_width = left + width + bar_room + BORDER;
    if !picture.title.is_empty() {
        let title = text::fit_bold(&picture.title, TITLE_SIZE, page_width - 2.0 * BORDER);
        svg.bold([0.5 * page_width, BORDER + TITLE_SIZE], TITLE_SIZE, Anchor::Middle, &title);
    }
    svg.open_group(&format!("transform=\"translate({} {})\"", num(left), num(top)));
    draw_box(&mut svg, scene);
    draw_faces(&mut svg, picture, scene, colours);
    picture.lines.iter().for_each(|line| draw_line(&mut svg, line, &scene.frame));
    picture.marks.iter().for_each(|marks| draw_marks(&mut svg, marks, &scene.frame));
    svg.close_group();
    draw_axes(&mut svg, &scene.view, picture.axis_names, [BORDER + 8.0, top + height - 8.0]);
    let mut below = top + height + 8.0;
    if let Colouring::Scale(scale) = colours {
        let at = [left + width + 18.0, top + 0.5 * (height - bar_height).max(0.0)];
        scale.draw(&mut svg, at, bar_height, &picture.colour_label);
        below = below.max(at[1] + bar_height + 14.0);
    }
    if !picture.key {
        return Page { svg, width: page_width, height: below + 0.4 * BORDER, title: picture.title.clone() };
    }
    let entries = legend::shortened(entries(picture, colours));
    let room = page_width - left - BORDER;
    legend::draw_rows(&mut svg, &entries, [left, below], room);
    below += legend::row_layout(&entries, room).1 + 1.4 * TICK_SIZE;
    let [low, high] = scene.bounds;
    let largest = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let unit = if picture.unit.is_empty() { String::new() } else { format!(" {}", picture.unit) };
    let reach = |(k, name): (usize, &&str)| {
        let [from, to] = [low[k], high[k]].map(|x| short(x, largest));
        format!("{} from {from} to {to}{unit}", name.replace('-', "\u{2212}"))
    };
    let sides: Vec<String> = picture.axis_names.iter().enumerate().map(reach).collect();
    let left_out = match scene.left_out {
        0 => String::new(),
        n => format!("; {n} cells with positions that are not finite are left out"),
    };
    draw_note(&mut svg, [BORDER, below], &format!("{}{left_out}", sides.join(", ")), page_width - 2.0 * BORDER);
    Page { svg, width: page_width, height: below + 0.7 * BORDER, title: picture.title.clone() }
}

/// At most four digits, and none that say nothing beside a picture `largest` wide: to within a hundredth of it, and finer by what
/// is left to the next power of ten.
fn short(x: f64, largest: f64) -> String {
    let step = 10f64.powf((largest / 100.0).log10().floor());
    let rounded = (x / step).round() * step;
    // Zero has no sign.
    let x = if !rounded.is_finite() {
        x
    } else if rounded == 0.0 {
        0.0
    } else {
        rounded
    };
    let digits = format!("{x:.3e}");
    digits
        .parse::<f64>()
        .map_or(
            digits,
            |x| {
                if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) { format!("{x:e}") } else { x.to_string() }
            },
        )
        .replace('-', "\u{2212}")
}

/// The box around the whole mesh, which shows where something was taken away.
pub(super) fn draw_box(svg: &mut Svg, scene: &Scene) {
    let corners = corners(&scene.bounds).map(|p| scene.frame.flat(p));
    let mut path = PathData::new(UNITS);
    for i in 0..8_usize {
        for k in (0..3).filter(|k| i >> k & 1 == 0) {
            path.polyline([corners[i], corners[i | 1 << k]]);
        }
    }
    let stroke = Stroke::solid(Colour(0xb8, 0xb8, 0xb8), 0.8 * UNITS).attributes();
    let group = PathData::group_attribute(UNITS);
    svg.raw(&format!("<path {group} fill=\"none\" {stroke} d=\"{}\"/>", path.data()));
}

/// How the edges of a face are drawn: dark for large faces, fainter for small ones, and in the colour of the face, so
/// that no gap shows, for the smallest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Edge {
    Own,
    Faint,
    Clear,
}

pub(super) fn draw_faces(svg: &mut Svg, picture: &SolidPicture<'_>, scene: &Scene, colours: &Colouring) {
    let width = |px: f64| num(px * UNITS);
    let group = PathData::group_attribute(UNITS);
    svg.open_group(&format!("{group} stroke=\"#1c1c1c\" stroke-linejoin=\"round\""));
    let stroke = |edge: Edge, fill: Colour| match edge {
        Edge::Clear => format!("stroke-width=\"{}\"", width(0.45)),
        Edge::Faint => format!("stroke-width=\"{}\"", width(0.2)),
        Edge::Own => format!("stroke=\"{fill}\" stroke-width=\"{}\"", width(scene.grain.max(0.3))),
    };
    let mut open: Option<String> = None;
    for face in &scene.faces {
        let corners = face.corners.map(|i| scene.frame.flat(picture.points[i as usize]));
        let mut path = PathData::new(UNITS);
        path.ring(corners);
        if path.is_empty() {
            continue;
        }
        let base = colours.of(picture.values[face.cell as usize]);
        // Without a cut all faces are outer ones.
        let base = if face.is_cut || picture.cut.is_none() { base } else { pale(base) };
        let fill = shaded(base, face.normal, &scene.view);
        // Neighbours in the order that look alike share a group; a path of their own keeps them from hiding each other.
        let look = format!("fill=\"{fill}\" {}", stroke(if picture.edges { edge(&corners) } else { Edge::Own }, fill));
        if open.as_ref() != Some(&look) {
            if open.is_some() {
                svg.close_group();
            }
            svg.open_group(&look);
            open = Some(look);
        }
        svg.raw(&format!("<path d=\"{}\"/>", path.data()));
    }
    if open.is_some() {
        svg.close_group();
    }
    svg.close_group();
}

fn edge(corners: &[[f64; 2]; 3]) -> Edge {
    let length = |i: usize, j: usize| (corners[i][0] - corners[j][0]).hypot(corners[i][1] - corners[j][1]);
    let longest = length(0, 1).max(length(1, 2)).max(length(2, 0));
    match longest {
        x if x >= 14.0 => Edge::Clear,
        x if x >= 3.0 => Edge::Faint,
        _ => Edge::Own,
    }
}

fn pale(Colour(r, g, b): Colour) -> Colour {
    let [r, g, b] = [r, g, b].map(|c| (255.0 * PALE + f64::from(c) * (1.0 - PALE)).round() as u8);
    Colour(r, g, b)
}

/// Lambert's law, stretched so that even what is turned away from the light has shades; in few steps, so that faces have
/// few colours.
fn shaded(Colour(r, g, b): Colour, normal: Vec3, view: &View) -> Colour {
    let light = unit(LIGHT).unwrap_or(LIGHT);
    let lit = 0.5 + 0.5 * dot(view.project(normal), light);
    let shade = SHADOW + (1.0 - SHADOW) * (16.0 * lit).round() / 16.0;
    let [r, g, b] = [r, g, b].map(|c| (f64::from(c) * shade).round() as u8);
    Colour(r, g, b)
}

pub(super) fn draw_line(svg: &mut Svg, line: &SpaceLine, frame: &Placement) {
    let width = stroke_width(line);
    let mut path = PathData::new(UNITS);
    for run in line.points.split(|p| p.iter().any(|x| !x.is_finite())) {
        path.polyline(run.iter().map(|&p| frame.flat(p)));
    }
    let group = PathData::group_attribute(UNITS);
    for (colour, width) in [(WHITE, width + 2.0 * RIM), (line.colour, width)] {
        let stroke = Stroke::solid(colour, UNITS * width).attributes();
        svg.raw(&format!("<path {group} fill=\"none\" stroke-linecap=\"round\" {stroke} d=\"{}\"/>", path.data()));
    }
    let tip = line.points.iter().rev().find(|p| p.iter().all(|x| x.is_finite()));
    if let (true, Some(&tip)) = (line.tip, tip) {
        svg.raw(&dot_at(frame.flat(tip), width + 1.5, line.colour));
    }
}

fn draw_marks(svg: &mut Svg, marks: &SpaceMarks, frame: &Placement) {
    for p in marks.points.iter().filter(|p| p.iter().all(|x| x.is_finite())) {
        svg.raw(&mark_at(frame.flat(*p), marks));
    }
}

fn mark_at([x, y]: [f64; 2], marks: &SpaceMarks) -> String {
    let colour = marks.colour;
    let [x, y] = [x, y].map(num);
    match marks.symbol {
        Symbol::Cross => {
            let arms = format!("M{x} {y}m-4.5 0h9m-4.5-4.5v9");
            let stroke = |colour: Colour, width: f64| Stroke::solid(colour, width).attributes();
            let [rim, own] = [stroke(WHITE, 2.0 + 2.0 * RIM), stroke(colour, 2.0)];
            format!("<path d=\"{arms}\" stroke-linecap=\"round\" {rim}/><path d=\"{arms}\" {own}/>")
        }
        Symbol::Disc => {
            let disc = |radius: f64, colour: Colour| {
                format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\"/>")
            };
            [disc(5.6, Colour::INK), disc(4.8, WHITE), disc(3.4, colour)].concat()
        }
    }
}

fn stroke_width(line: &SpaceLine) -> f64 {
    if line.width.is_finite() { line.width.clamp(0.2, 50.0) } else { 2.5 }
}

fn dot_at([x, y]: [f64; 2], radius: f64, colour: Colour) -> String {
    let [x, y, radius] = [x, y, radius].map(num);
    format!("<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\" fill=\"{colour}\" stroke=\"#ffffff\" stroke-width=\"1\"/>")
}

/// The directions of the axes, with their names.
pub(super) fn draw_axes(svg: &mut Svg, view: &View, names: [&str; 3], [x, y]: [f64; 2]) {
    let length = 26.0;
    for (axis, name) in names.iter().enumerate() {
        let [right, up, _] = view.project(std::array::from_fn(|k| f64::from(u8::from(k == axis))));
        let at = |t: f64| [x + t * right, y - t * up];
        svg.line([x, y], at(length), Stroke::solid(PALETTE[[1, 2, 0][axis]], 1.6));
        // An axis that points at the viewer has its name beside it.
        let [label_x, label_y] = at(length + 8.0);
        svg.text([label_x, label_y + 0.36 * TICK_SIZE], TICK_SIZE, Anchor::Middle, name);
    }
}

fn entries(picture: &SolidPicture<'_>, colours: &Colouring) -> Vec<Entry> {
    let fragment = |draw: &dyn Fn(&mut Svg)| {
        let mut svg = Svg::new();
        draw(&mut svg);
        svg.into_fragment()
    };
    let mut entries = Vec::new();
    for line in &picture.lines {
        let stroke = Stroke::solid(line.colour, stroke_width(line));
        let mut sample = fragment(&|svg| svg.line([0.0, 0.0], [SAMPLE, 0.0], stroke));
        if line.tip {
            sample.push_str(&dot_at([SAMPLE, 0.0], stroke.width + 1.5, line.colour));
        }
        entries.push(Entry { sample, name: line.label.clone() });
    }
    for marks in picture.marks.iter().filter(|marks| !marks.points.is_empty()) {
        entries.push(Entry { sample: mark_at([0.5 * SAMPLE, 0.0], marks), name: marks.label.clone() });
    }
    if let Colouring::Regions { regions, .. } = colours {
        for &region in regions {
            let patch = |svg: &mut Svg| {
                svg.rect([6.0, -0.4 * LABEL_SIZE], [SAMPLE - 12.0, 0.8 * LABEL_SIZE], colours.of(region))
            };
            entries.push(Entry { sample: fragment(&patch), name: region_name(picture, region) });
        }
    }
    entries
}

/// What a region is called.
fn region_name(picture: &SolidPicture<'_>, region: f64) -> String {
    let named = if region >= 0.0 { picture.region_names.get(region as usize) } else { None };
    let label = if picture.colour_label.is_empty() { "region" } else { &picture.colour_label };
    named.cloned().unwrap_or_else(|| format!("{label} {region}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_that_are_seen() {
        assert_eq!(short(-1.597e-4, 0.12), "0");
        assert_eq!(short(-0.05025, 0.12), "\u{2212}0.05");
        assert_eq!([short(120.02, 120.1), short(-50.25, 120.1), short(1.188e-17, 120.1)], ["120", "\u{2212}50", "0"]);
        assert_eq!([short(2.5e-6, 4e-6), short(3.0, 0.0)], ["2.5e\u{2212}6", "3"]);
    }
}
