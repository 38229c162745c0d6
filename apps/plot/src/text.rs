//! How wide a label will be. A viewer brings its own sans-serif font, so this is an estimate on the wide side.

/// Width of `text` in px at a font size of `size` px.
pub(crate) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(em).sum::<f64>() * size
}

/// Width of one character in em, from the advance widths common to DejaVu Sans and Helvetica, rounded up.
fn em(c: char) -> f64 {
    match c {
        'i' | 'j' | 'l' | '|' | '\'' | '.' | ',' | ':' | ';' | '!' | ' ' => 0.33,
        'f' | 't' | 'r' | 'I' | '(' | ')' | '[' | ']' | '-' | '/' => 0.42,
        'm' | 'w' | 'M' | 'W' | '@' | '%' => 0.95,
        'A'..='Z' => 0.72,
        '=' | '<' | '>' | '+' | '\u{2212}' | '~' => 0.84,
        // Wide scripts: Hangul, kana, Chinese characters, full-width forms, emoji.
        '\u{1100}'..='\u{115f}'
        | '\u{2e80}'..='\u{a4cf}'
        | '\u{ac00}'..='\u{d7a3}'
        | '\u{f900}'..='\u{faff}'
        | '\u{ff00}'..='\u{ff60}'
        | '\u{1f300}'..='\u{1faff}' => 1.1,
        _ => 0.63,
    }
}

/// How much wider a bold face is.
const BOLD: f64 = 1.14;

/// Width of `text` in bold, px.
pub(crate) fn bold_width(text: &str, size: f64) -> f64 {
    BOLD * width(text, size)
}

/// [`fit`] for bold text.
pub(crate) fn fit_bold(text: &str, size: f64, limit: f64) -> String {
    fit(text, size, limit / BOLD)
}

/// `text`, cut with an ellipsis where it would be wider than `limit` px.
pub(crate) fn fit(text: &str, size: f64, limit: f64) -> String {
    if width(text, size) <= limit {
        return text.to_owned();
    }
    let mut used = size; // room for the ellipsis
    let kept: String = text
        .chars()
        .take_while(|&c| {
            used += em(c) * size;
            used <= limit
        })
        .collect();
    format!("{}…", kept.trim_end())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_title_is_cut_to_fit() {
        let long = "displacement ".repeat(100);
        let cut = fit(&long, 16.0, 300.0);
        assert!(cut.ends_with('…') && width(&cut, 16.0) <= 310.0, "{cut}");
        assert_eq!(fit("short", 16.0, 300.0), "short");
    }
}
