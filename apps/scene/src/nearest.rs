//! The declared name closest to a misspelt one.

use strsim::osa_distance;

/// Longest part of a misspelt name that is compared: the distance takes time in the product of the lengths.
const LIMIT: usize = 80;

/// The candidate with the smallest distance to `found`; the first one of a tie.
///
/// The distance counts insertions, deletions, substitutions and swaps of neighbours. Two mistakes count as small ones
/// whatever the lengths: a shortened or extended name in the right table, and the right name in the wrong table.
pub fn nearest<'a>(found: &str, candidates: impl IntoIterator<Item = &'a str>) -> &'a str {
    let found: String = found.chars().take(LIMIT).collect();
    candidates.into_iter().min_by_key(|candidate| distance(&found, candidate)).unwrap_or("")
}

fn distance(found: &str, candidate: &str) -> usize {
    let split =
        |path: &'_ str| path.rsplit_once('.').map_or(("".to_owned(), path.to_owned()), |(a, b)| (a.into(), b.into()));
    let ((table, name), (known_table, known)) = (split(found), split(candidate));
    let shortened = !name.is_empty() && (known.starts_with(&name) || name.starts_with(&known));
    if shortened && table == known_table {
        return 1;
    }
    let elsewhere = 2 * osa_distance(&name, &known) + 2;
    osa_distance(found, candidate).min(elsewhere)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swaps_and_wrong_tables_are_small_errors() {
        let keys = ["mesh.h_ref", "mesh.h_start", "material.young", "solver.tolerance"];
        assert_eq!(nearest("mesh.h_strat", keys), "mesh.h_start");
        assert_eq!(nearest("mesh.young", keys), "material.young");
        assert_eq!(nearest("solver.tol", keys), "solver.tolerance");
        assert_eq!(nearest("", []), "");
    }
}
