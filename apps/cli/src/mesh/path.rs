//! Where a needle goes: positions of its tip in a file, or a path made from a seed.

use crate::exit::Failure;
use crate::facts::count;
use std::path::Path;
use stylet_mesh::remesh::paths::{PathKind, path};

/// Where the tip goes.
pub enum TipPath<const D: usize> {
    /// Along these points.
    File(Vec<[f64; D]>),
    /// Along a path of this kind, made from this seed.
    Made(PathKind, u64),
}

impl<const D: usize> TipPath<D> {
    /// The path of this name.
    ///
    /// # Errors
    /// A file that cannot be read, or is no list of points.
    pub fn open(name: &str, seed: u64) -> Result<Self, Failure> {
        let kind = match name {
            "straight" => PathKind::Straight,
            "curved" => PathKind::Curved,
            "random" => PathKind::Random,
            "" => {
                let line = "--path: found nothing, expected straight, curved, random or a file";
                return Err(Failure::bad_input(line));
            }
            _ => return read(Path::new(name)).map(Self::File),
        };
        Ok(Self::Made(kind, seed))
    }

    /// The points of a cycle, in a mesh within the box from `lower` to `upper` with edges of length `edge`.
    pub fn points(&self, cycle: u32, [lower, upper]: [[f64; D]; 2], edge: f64) -> Vec<[f64; D]> {
        match self {
            Self::File(points) => points.clone(),
            Self::Made(kind, seed) => path(*kind, lower, upper, edge, seed.wrapping_add(cycle.into())),
        }
    }
}

fn read<const D: usize>(path: &Path) -> Result<Vec<[f64; D]>, Failure> {
    let name = path.display();
    let text = std::fs::read_to_string(path).map_err(|error| Failure::bad_input(format!("{name}: {error}")))?;
    let points = parse(&text).map_err(|reason| Failure::bad_input(format!("{name}: {reason}")))?;
    if points.len() < 2 {
        let found = count(points.len(), "position", "positions");
        return Err(Failure::bad_input(format!("{name}: found {found} of the tip, expected at least 2")));
    }
    Ok(points)
}

/// The points in a text; an error says in which line there is none.
fn parse<const D: usize>(text: &str) -> Result<Vec<[f64; D]>, String> {
    let mut points = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split_once('#').map_or(line, |(before, _)| before).trim();
        if line.is_empty() {
            continue;
        }
        let fields = line.split(',').flat_map(|part| {
            // A comma too many is a missing number.
            let words: Vec<&str> = part.split_whitespace().collect();
            if words.is_empty() { vec![""] } else { words }
        });
        let refuse = |found: String| format!("line {number}: found {found}, expected {D} numbers");
        let number = |word: &str| {
            let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
            number.ok_or_else(|| refuse(format!("`{}` in {}", cut(word), cut(line))))
        };
        let numbers = fields.map(number).collect::<Result<Vec<f64>, String>>()?;
        let n = numbers.len();
        let plural = if n == 1 { "" } else { "s" };
        points.push(numbers.try_into().map_err(|_| refuse(format!("{n} number{plural} in {}", cut(line))))?);
    }
    Ok(points)
}

/// The beginning of a text that may be long.
fn cut(text: &str) -> String {
    const MOST: usize = 60;
    let begin: String = text.chars().take(MOST).collect();
    if begin.len() < text.len() { begin + "..." } else { begin }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_points() {
        let text = "# tip\n0.5, 1.1 # outside\n\n0.5\t0.9\r\n 0.4,0.5\n";
        assert_eq!(parse::<2>(text), Ok(vec![[0.5, 1.1], [0.5, 0.9], [0.4, 0.5]]));
        assert_eq!(parse::<3>("1 2 3"), Ok(vec![[1.0, 2.0, 3.0]]));
        assert_eq!(parse::<2>(" \n#\n"), Ok(vec![]));
    }

    #[test]
    fn faults_are_told_by_line() {
        for (text, part) in [
            ("1 2\n1 2 3", "line 2: found 3 numbers in 1 2 3, expected 2 numbers"),
            ("\n1", "line 2: found 1 number in 1,"),
            ("1,x", "line 1: found `x` in 1,x"),
            ("1,,2", "line 1: found `` in 1,,2"),
            ("1,2,", "line 1: found `` in 1,2,"),
            ("nan 1", "line 1: found `nan`"),
            ("1 1e999", "line 1: found `1e999`"),
        ] {
            let line = parse::<2>(text).unwrap_err();
            assert!(line.contains(part), "{line}");
        }
        let long = parse::<2>(&"9".repeat(10_000).replace('9', "a")).unwrap_err();
        assert!(long.len() < 300, "{long}");
    }
}
