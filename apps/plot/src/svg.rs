//! The few SVG elements that the pictures are made of, written deterministically and escaped.

use std::fmt::Write as _;

use crate::colour::Colour;
use crate::text;

/// Sans-serif faces found on the usual systems; none is embedded.
const FONTS: &str = "Helvetica, Arial, 'DejaVu Sans', 'Liberation Sans', sans-serif";

/// Where a text stands relative to its anchor point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// A stroke: colour, width in px, dashed or not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stroke {
    pub colour: Colour,
    pub width: f64,
    pub dashed: bool,
}

impl Stroke {
    pub fn solid(colour: Colour, width: f64) -> Self {
        Self { colour, width, dashed: false }
    }

    /// The attributes of this stroke, dashes scaled with the width.
    pub fn attributes(&self) -> String {
        let Self { colour, width, dashed } = *self;
        let dashes = if dashed {
            format!(" stroke-dasharray=\"{} {}\"", num(4.0 * width), num(3.0 * width))
        } else {
            String::new()
        };
        format!("stroke=\"{colour}\" stroke-width=\"{}\"{dashes}", num(width))
    }
}

/// An SVG document under construction; coordinates are px from the upper left corner.
pub(crate) struct Svg {
    body: String,
}

impl Svg {
    pub fn new() -> Self {
        Self { body: String::new() }
    }

    /// Adds an element, or several, as they are.
    pub fn raw(&mut self, element: &str) {
        self.body.push_str(element);
        self.body.push('\n');
    }

    pub fn open_group(&mut self, attributes: &str) {
        self.raw(&format!("<g {attributes}>"));
    }

    pub fn close_group(&mut self) {
        self.raw("</g>");
    }

    pub fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], stroke: Stroke) {
        let [x1, y1, x2, y2] = [x1, y1, x2, y2].map(num);
        self.raw(&format!("<line x1=\"{x1}\" y1=\"{y1}\" x2=\"{x2}\" y2=\"{y2}\" {}/>", stroke.attributes()));
    }

    /// A rectangle without outline.
    pub fn rect(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], fill: Colour) {
        let [x, y, width, height] = [x, y, width, height].map(num);
        self.raw(&format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"{fill}\"/>"));
    }

    /// A rectangle without filling.
    pub fn frame(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], stroke: Stroke) {
        let [x, y, width, height] = [x, y, width, height].map(num);
        let stroke = stroke.attributes();
        self.raw(&format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" fill=\"none\" {stroke}/>"));
    }

    /// A line of text, its baseline at `y`.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, content: &str) {
        self.label([x, y], size, anchor, &escape(content), "");
    }

    pub fn bold(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, content: &str) {
        self.label([x, y], size, anchor, &escape(content), " font-weight=\"bold\"");
    }

    /// A line of text read from below, centred at `[x, y]`.
    pub fn text_upwards(&mut self, [x, y]: [f64; 2], size: f64, content: &str) {
        let turn = format!(" transform=\"rotate(-90 {} {})\"", num(x), num(y));
        self.label([x, y], size, Anchor::Middle, &escape(content), &turn);
    }

    /// A line of text given as markup (escaped text and `tspan`s).
    pub fn label(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, markup: &str, attributes: &str) {
        let ([x, y, size], anchor) = ([x, y, size].map(num), anchor.name());
        self.raw(&format!(
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{size}\" text-anchor=\"{anchor}\"{attributes}>{markup}</text>"
        ));
    }

    /// The elements alone, to be set into another drawing.
    pub fn into_fragment(self) -> String {
        self.body.trim_end().to_owned()
    }

    /// The document, on a white ground. `title` is what a screen reader and a browser tab show.
    pub fn finish(self, width: f64, height: f64, title: &str) -> String {
        let [w, h] = [width, height].map(num);
        let mut text = String::with_capacity(self.body.len() + 512);
        writeln!(
            text,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\" role=\"img\" \
             font-family=\"{FONTS}\" fill=\"{}\">",
            Colour::INK
        )
        .expect("a String takes everything");
        writeln!(text, "<title>{}</title>", escape(&text::fit(title, 1.0, 200.0))).expect("a String takes everything");
        writeln!(text, "<rect width=\"{w}\" height=\"{h}\" fill=\"#ffffff\"/>").expect("a String takes everything");
        text.push_str(&self.body);
        text.push_str("</svg>\n");
        text
    }
}

/// A finished drawing and its size, px: a document of its own, or part of one.
pub(crate) struct Page {
    pub svg: Svg,
    pub width: f64,
    pub height: f64,
    pub title: String,
}

impl Page {
    pub fn document(self) -> String {
        self.svg.finish(self.width, self.height, &self.title)
    }

    /// The drawing with its upper left corner at `[x, y]` of another one.
    pub fn draw_into(self, svg: &mut Svg, [x, y]: [f64; 2]) {
        let [x, y, width, height] = [x, y, self.width, self.height].map(num);
        svg.raw(&format!("<svg x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\">"));
        svg.raw(&self.svg.into_fragment());
        svg.raw("</svg>");
    }
}

/// A number with at most two decimals and no trailing zeros; never an exponent, which some readers do not take.
pub(crate) fn num(x: f64) -> String {
    let text = format!("{x:.2}");
    let trimmed = text.trim_end_matches('0').trim_end_matches('.');
    if trimmed == "-0" { "0".into() } else { trimmed.into() }
}

/// Text for an element or an attribute. What XML cannot hold becomes U+FFFD, white space becomes a blank.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' | '\r' => escaped.push(' '),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => escaped.push('\u{fffd}'),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_leave_its_element() {
        assert_eq!(escape("</text><script>&\"'\0\n"), "&lt;/text&gt;&lt;script&gt;&amp;&quot;&#39;\u{fffd} ");
    }

    #[test]
    fn numbers_are_short_and_plain() {
        assert_eq!(num(1.0), "1");
        assert_eq!(num(-0.001), "0");
        assert_eq!(num(12.345_6), "12.35");
        assert_eq!(num(1e7), "10000000");
        assert_eq!(num(100.0), "100");
    }
}
