//! Where an axis has its marks, and what they say.

/// One mark of an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub at: f64,
    /// Markup of the label (it holds digits, signs and `tspan`s only); `None` for a minor mark.
    pub label: Option<String>,
}

impl Tick {
    fn minor(at: f64) -> Self {
        Self { at, label: None }
    }
}

/// Marks at round numbers within `min..=max`, about `target` of them.
///
/// Steps are 1, 2 or 5 times a power of ten, so that labels stay short.
pub(crate) fn linear(min: f64, max: f64, target: usize) -> Vec<Tick> {
    let step = round_step((max - min) / target.max(1) as f64);
    if !(step > 0.0 && step.is_finite()) {
        return Vec::new();
    }
    let (first, last) = ((min / step - 1e-9).ceil(), (max / step + 1e-9).floor());
    // A range far from zero and narrower than the spacing of doubles has no marks to tell apart.
    if first.abs().max(last.abs()) >= 1e14 || last - first > 1000.0 {
        return Vec::new();
    }
    (first as i64..=last as i64)
        .map(|i| Tick { at: i as f64 * step, label: Some(label(i as f64 * step, step, min.abs().max(max.abs()))) })
        .collect()
}

/// The first of 1, 2, 5 times a power of ten that is not below `step`.
pub(crate) fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let mantissa = step / power;
    let round = [1.0, 2.0, 5.0].into_iter().find(|r| mantissa <= r * (1.0 + 1e-9)).unwrap_or(10.0);
    round * power
}

/// A number on an axis with marks every `step`: as many decimals as the step has, or a power of ten if that is long.
fn label(x: f64, step: f64, largest: f64) -> String {
    let decimals = (-step.log10() - 1e-9).ceil().max(0.0);
    if x == 0.0 {
        return "0".into();
    }
    if largest < 1e5 && (decimals <= 5.0 || (decimals <= 10.0 && largest >= 0.1)) {
        return minus(&format!("{x:.*}", decimals as usize));
    }
    let digits = ((largest.log10().floor() - step.log10().floor()).max(0.0) as usize).min(15);
    let exponent = largest.log10().floor();
    scientific(x / 10f64.powf(exponent), exponent as i32, digits)
}

fn scientific(mantissa: f64, exponent: i32, digits: usize) -> String {
    format!("{}×{}", minus(&format!("{mantissa:.digits$}")), power_of_ten(exponent))
}

fn power_of_ten(exponent: i32) -> String {
    format!("10<tspan dy=\"-0.45em\" font-size=\"75%\">{}</tspan>", minus(&exponent.to_string()))
}

fn minus(text: &str) -> String {
    text.replace('-', "\u{2212}")
}

/// Marks of a logarithmic axis over `min..=max`, both positive: labelled decades (every second, third … if there are
/// more than `target`), minor marks between them, and labels on 2 and 5 where less than two decades are in view.
pub(crate) fn logarithmic(min: f64, max: f64, target: usize) -> Vec<Tick> {
    let (low, high) = (min.log10(), max.log10());
    let decades = high - low;
    if decades < 0.7 {
        // Less than a decade is read like a linear scale.
        return linear(min, max, target).into_iter().filter(|tick| tick.at > 0.0).collect();
    }
    let stride = (decades / target.max(1) as f64).ceil().max(1.0) as i32;
    let labels: &[i32] = if decades < 2.0 { &[1, 2, 5] } else { &[1] };
    let mut ticks = Vec::new();
    for exponent in low.floor() as i32..=high.ceil() as i32 {
        for digit in 1..10 {
            // Parsing is correctly rounded; powers of ten are not.
            let Ok(at) = format!("{digit}e{exponent}").parse::<f64>() else {
                continue;
            };
            if !(at >= min * (1.0 - 1e-9) && at <= max * (1.0 + 1e-9)) {
                continue;
            }
            if labels.contains(&digit) && exponent.rem_euclid(stride) == 0 {
                ticks.push(Tick { at, label: Some(log_label(digit, exponent, decades)) });
            } else if (stride == 1 && decades <= 10.0) || digit == 1 {
                ticks.push(Tick::minor(at));
            }
        }
    }
    ticks
}

fn log_label(digit: i32, exponent: i32, decades: f64) -> String {
    if decades < 5.0 && (-3..=4).contains(&exponent) {
        return format!("{digit}e{exponent}").parse::<f64>().map_or_else(|_| String::new(), |x| x.to_string());
    }
    if digit == 1 { power_of_ten(exponent) } else { format!("{digit}×{}", power_of_ten(exponent)) }
}

/// How many characters of a label are seen: its markup without tags.
pub(crate) fn plain(label: &str) -> String {
    let mut inside = false;
    label
        .chars()
        .filter(|&c| {
            let tag = inside || c == '<';
            inside = (inside && c != '>') || c == '<';
            !tag
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<String> {
        ticks.iter().filter_map(|tick| tick.label.as_deref().map(plain)).collect()
    }

    #[test]
    fn linear_marks_are_round() {
        assert_eq!(labels(&linear(0.0, 100.0, 5)), ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(labels(&linear(-0.3, 0.3, 6)), ["−0.3", "−0.2", "−0.1", "0", "0.1", "0.2", "0.3"]);
        assert_eq!(labels(&linear(0.0, 3e-7, 3)), ["0", "1×10−7", "2×10−7", "3×10−7"]);
        assert_eq!(labels(&linear(0.0, 2e6, 4)), ["0", "0.5×106", "1.0×106", "1.5×106", "2.0×106"]);
    }

    #[test]
    fn degenerate_ranges_have_few_marks_and_do_not_hang() {
        for (min, max) in [(1.0, 1.0), (1e300, 1.1e300), (1.0, 1.0 + 1e-15), (-1e308, 1e308), (0.0, 5e-324)] {
            assert!(linear(min, max, 6).len() < 20, "{min} {max}");
        }
    }

    #[test]
    fn many_decades_are_thinned() {
        let ticks = logarithmic(1e-14, 1.0, 7);
        assert_eq!(labels(&ticks), ["10−14", "10−12", "10−10", "10−8", "10−6", "10−4", "10−2", "100"]);
        assert!(logarithmic(1e-300, 1e300, 8).len() < 700);
    }

    #[test]
    fn few_decades_have_plain_labels_and_minor_marks() {
        assert_eq!(labels(&logarithmic(0.1, 100.0, 8)), ["0.1", "1", "10", "100"]);
        assert_eq!(labels(&logarithmic(1.0, 20.0, 8)), ["1", "2", "5", "10", "20"]);
        assert_eq!(logarithmic(1.0, 100.0, 8).len(), 19);
        assert_eq!(labels(&logarithmic(20.0, 30.0, 5)), ["20", "22", "24", "26", "28", "30"]);
    }
}
