//! `--probe x,y[,z]`

use crate::exit::Failure;

/// The points of a scene in `D` dimensions.
///
/// # Errors
/// Not as many finite numbers as the scene has dimensions.
pub fn parse<const D: usize>(texts: &[String]) -> Result<Vec<[f64; D]>, Failure> {
    texts.iter().map(|text| point(text).map_err(|reason| refuse::<D>(text, &reason))).collect()
}

/// Finite numbers with commas between them; an error says which part is none.
pub fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let number = |part: &&str| part.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| (*part).to_owned());
    let numbers = parts.iter().map(number).collect::<Result<Vec<f64>, String>>();
    numbers.map_err(|part| if parts.len() == 1 { text.to_owned() } else { format!("`{part}` in {text}") })
}

fn point<const D: usize>(text: &str) -> Result<[f64; D], String> {
    let numbers = numbers(text)?;
    let n = numbers.len();
    let plural = if n == 1 { "" } else { "s" };
    numbers.try_into().map_err(|_| format!("{n} number{plural} in {text}"))
}

fn refuse<const D: usize>(text: &str, found: &str) -> Failure {
    let names = &["x", "y", "z"][..D.min(3)];
    let found = if text.is_empty() { "nothing" } else { found };
    Failure::bad_input(format!(
        "--probe: found {found}, expected {} in m: the scene has {D} dimensions",
        names.join(",")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_as_many_finite_numbers_as_the_scene_has_dimensions() {
        let parse_one = |text: &str| parse::<2>(&[text.to_owned()]).map_err(|failure| failure.line);
        assert_eq!(parse_one("0.05, -1e-3"), Ok(vec![[0.05, -1e-3]]));
        for (text, found) in [
            ("0.05", "found 1 number in 0.05,"),
            ("1,2,3", "found 3 numbers in 1,2,3,"),
            ("", "found nothing,"),
            ("x,1", "found `x` in x,1,"),
            ("0.1,", "found `` in 0.1,,"),
            ("nan,0", "found `nan` in nan,0,"),
            ("0,inf", "found `inf` in 0,inf,"),
        ] {
            let line = parse_one(text).unwrap_err();
            assert!(line.contains(found) && line.contains("expected x,y in m"), "{line}");
        }
    }
}
