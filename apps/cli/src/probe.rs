//! `--probe x,y[,z]`

use crate::exit::Failure;

/// The points of a scene in `dim` dimensions.
///
/// # Errors
/// Not as many finite numbers as the scene has dimensions.
pub fn parse(texts: &[String], dim: usize) -> Result<Vec<Vec<f64>>, Failure> {
    texts.iter().map(|text| point(text, dim).map_err(|reason| refuse(text, dim, &reason))).collect()
}

/// Finite numbers with commas between them; an error says which part is none.
pub fn numbers(text: &str) -> Result<Vec<f64>, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let number = |part: &&str| part.parse::<f64>().ok().filter(|x| x.is_finite()).ok_or_else(|| (*part).to_owned());
    let numbers = parts.iter().map(number).collect::<Result<Vec<f64>, String>>();
    numbers.map_err(|part| if parts.len() == 1 { text.to_owned() } else { format!("`{part}` in {text}") })
}

fn point(text: &str, dim: usize) -> Result<Vec<f64>, String> {
    let numbers = numbers(text)?;
    let n = numbers.len();
    let plural = if n == 1 { "" } else { "s" };
    if n == dim { Ok(numbers) } else { Err(format!("{n} number{plural} in {text}")) }
}

fn refuse(text: &str, dim: usize, found: &str) -> Failure {
    let names = &["x", "y", "z"][..dim.min(3)];
    let found = if text.is_empty() { "nothing" } else { found };
    Failure::bad_input(format!(
        "--probe: found {found}, expected {} in m: the scene has {dim} dimensions",
        names.join(",")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_as_many_finite_numbers_as_the_scene_has_dimensions() {
        let parse_one = |text: &str| parse(&[text.to_owned()], 2).map_err(|failure| failure.line);
        assert_eq!(parse_one("0.05, -1e-3"), Ok(vec![vec![0.05, -1e-3]]));
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
