//! Colours: a palette for lines and perceptually even colour maps for fields.

use std::fmt;

/// An sRGB colour, 0 to 255 a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

impl Colour {
    /// Text and axes.
    pub const INK: Self = Self(0x22, 0x22, 0x22);
    /// Ticks, notes, outlines.
    pub const GREY: Self = Self(0x66, 0x66, 0x66);
    /// Grid lines.
    pub const GRID: Self = Self(0xdd, 0xdd, 0xdd);
    /// Cells without a value.
    pub const NO_DATA: Self = Self(0xc8, 0xc8, 0xc8);

    /// Half as far from white.
    pub fn paler(self) -> Self {
        let half = |c: u8| c / 2 + 128;
        Self(half(self.0), half(self.1), half(self.2))
    }
}

impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Colours that remain distinct with the common forms of colour blindness.
///
/// Source: Okabe & Ito, *Color Universal Design* (2008). Their yellow is left out: it does not show on white.
pub const PALETTE: [Colour; 7] = [
    Colour(0x00, 0x72, 0xb2), // blue
    Colour(0xd5, 0x5e, 0x00), // vermilion
    Colour(0x00, 0x9e, 0x73), // bluish green
    Colour(0xcc, 0x79, 0xa7), // reddish purple
    Colour(0xe6, 0x9f, 0x00), // orange
    Colour(0x56, 0xb4, 0xe9), // sky blue
    Colour(0x22, 0x22, 0x22), // black
];

/// Colours for areas that are told apart by them, such as regions of a body. None is near black or white, so that a line with a
/// rim shows on all of them; the last one, grey, suits what is around the others.
///
/// Source: Tol, *Colour schemes*, SRON technical note 3.2 (2021), schemes muted, light and bright.
pub(crate) const AREAS: [Colour; 12] = [
    Colour(0xcc, 0x66, 0x77), // rose
    Colour(0x44, 0x77, 0xaa), // blue
    Colour(0xdd, 0xcc, 0x77), // sand
    Colour(0x11, 0x77, 0x33), // green
    Colour(0x88, 0xcc, 0xee), // cyan
    Colour(0xee, 0x88, 0x66), // orange
    Colour(0x44, 0xaa, 0x99), // teal
    Colour(0x88, 0x22, 0x55), // wine
    Colour(0x99, 0x99, 0x33), // olive
    Colour(0xaa, 0x44, 0x99), // purple
    Colour(0xbb, 0xcc, 0x33), // pear
    Colour(0xdd, 0xdd, 0xdd), // pale grey
];

/// How a number becomes a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ColourMap {
    /// Dark violet over green to yellow, lightness growing evenly: for magnitudes.
    #[default]
    Sequential,
    /// Blue over near white to red, both ends equally dark: for signed differences. The range is made symmetric, so that
    /// zero is white.
    Diverging,
}

impl ColourMap {
    /// The colour at `t`, clamped to `0..=1`; NaN counts as 0.
    pub fn at(self, t: f64) -> Colour {
        let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
        let [lightness, chroma, hue] = match self {
            Self::Sequential => sequential(t),
            Self::Diverging => diverging(2.0 * t - 1.0),
        };
        let (sin, cos) = hue.to_radians().sin_cos();
        encode(oklab_to_linear_srgb([lightness, chroma * cos, chroma * sin]))
    }
}

/// Lightness, chroma and hue (degrees) in Oklch: a straight climb in lightness, and a turn from violet to yellow.
fn sequential(t: f64) -> [f64; 3] {
    [0.27 + 0.64 * t, 0.1 + 0.055 * t * t, 305.0 - 200.0 * t]
}

/// The same for `s` in `-1..=1`: white in the middle, hue by the sign.
fn diverging(s: f64) -> [f64; 3] {
    let hue = if s < 0.0 { 255.0 } else { 35.0 };
    [0.97 - 0.52 * s.abs(), 0.16 * s.abs().powf(0.9), hue]
}

/// Oklab to linear sRGB.
///
/// Source: Ottosson, *A perceptual color space for image processing* (2020).
fn oklab_to_linear_srgb([lightness, a, b]: [f64; 3]) -> [f64; 3] {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    ]
}

/// The transfer curve of sRGB (IEC 61966-2-1), in 8 bits.
fn encode(linear: [f64; 3]) -> Colour {
    let [r, g, b] = linear.map(|x| {
        let x = x.clamp(0.0, 1.0);
        let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
        (255.0 * y).round() as u8
    });
    Colour(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance of linear light.
    fn luminance(Colour(r, g, b): Colour) -> f64 {
        let linear = |c: u8| {
            let y = f64::from(c) / 255.0;
            if y <= 0.040_45 { y / 12.92 } else { ((y + 0.055) / 1.055).powf(2.4) }
        };
        0.2126 * linear(r) + 0.7152 * linear(g) + 0.0722 * linear(b)
    }

    #[test]
    fn white_and_black_convert_exactly() {
        assert_eq!(encode(oklab_to_linear_srgb([1.0, 0.0, 0.0])), Colour(255, 255, 255));
        assert_eq!(encode(oklab_to_linear_srgb([0.0, 0.0, 0.0])), Colour(0, 0, 0));
    }

    #[test]
    fn the_sequential_map_grows_lighter_all_the_way() {
        let levels: Vec<f64> = (0..=50).map(|i| luminance(ColourMap::Sequential.at(f64::from(i) / 50.0))).collect();
        assert!(levels.windows(2).all(|w| w[1] > w[0]), "{levels:?}");
        assert!(levels[0] < 0.04 && levels[50] > 0.7, "{levels:?}");
    }

    #[test]
    fn the_diverging_map_is_balanced_about_white() {
        for i in 0..=20 {
            let s = f64::from(i) / 40.0;
            let (low, high) =
                (luminance(ColourMap::Diverging.at(0.5 - s)), luminance(ColourMap::Diverging.at(0.5 + s)));
            assert!((low - high).abs() < 0.06, "{s}: {low} {high}");
        }
        assert!(luminance(ColourMap::Diverging.at(0.5)) > 0.85);
    }

    #[test]
    fn the_maps_stay_almost_within_srgb() {
        for i in 0..=100 {
            let t = f64::from(i) / 100.0;
            for [lightness, chroma, hue] in [sequential(t), diverging(2.0 * t - 1.0)] {
                let (sin, cos) = hue.to_radians().sin_cos();
                let rgb = oklab_to_linear_srgb([lightness, chroma * cos, chroma * sin]);
                // Clipping a channel by 0.03 of linear light is not visible.
                assert!(rgb.iter().all(|x| (-0.03..=1.03).contains(x)), "t = {t}, hue {hue}: {rgb:?}");
            }
        }
    }

    #[test]
    fn areas_are_told_apart_and_show_a_dark_line_with_a_white_rim() {
        for (i, a) in AREAS.iter().enumerate() {
            // A contrast of 2 to 1 with the line, or with its rim (WCAG 2.1, 1.4.11, asks for 3 of a thin line alone).
            let (ink, white, here) = (luminance(Colour::INK), 1.0, luminance(*a));
            assert!((here + 0.05) / (ink + 0.05) > 2.0 || (white + 0.05) / (here + 0.05) > 2.0, "{a}");
            for b in &AREAS[..i] {
                let far = |p: u8, q: u8| u32::from(p.abs_diff(q)).pow(2);
                assert!(far(a.0, b.0) + far(a.1, b.1) + far(a.2, b.2) > 45 * 45, "{a} {b}");
            }
        }
    }

    #[test]
    fn any_number_has_a_colour() {
        assert_eq!(ColourMap::Sequential.at(f64::NAN), ColourMap::Sequential.at(0.0));
        assert_eq!(ColourMap::Sequential.at(f64::INFINITY), ColourMap::Sequential.at(1.0));
    }
}
