//! Points of the body that are tracked: markers, seeds, and how far they are from where they were measured.

use serde::{Deserialize, Serialize};
use stylet_mesh::{CellId, SimplexMesh, geometry};
use stylet_tissue::summary::MarkerError;

/// How far outside a cell a point still counts as in it, in barycentric coordinates.
const SLACK: f64 = 1e-9;

/// Positions further than so many sizes of the body from it are in another unit.
const FAR: f64 = 10.0;

/// A material point: where it is in the undeformed body, and in which cell.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Tracked {
    /// Its name.
    pub name: String,
    /// Where it is in the undeformed body, m.
    pub at: [f64; 3],
    /// Where it is now, m.
    pub place: [f64; 3],
    cell: u32,
    weights: [f64; 4],
}

impl Tracked {
    /// Takes a point; one outside the body by rounding errors is that of the nearest cell.
    #[must_use]
    pub fn new(name: String, at: [f64; 3], mesh: &SimplexMesh<3, 4>, u: &[f64]) -> Self {
        let mut tracked = Self { name, at, place: at, cell: u32::MAX, weights: [0.0; 4] };
        tracked.follow(mesh, u);
        tracked
    }

    /// Moves it with the body, and finds its cell anew where the mesh has changed there.
    pub fn follow(&mut self, mesh: &SimplexMesh<3, 4>, u: &[f64]) {
        let within = |cell: CellId| {
            let weights = geometry::barycentric(&mesh.corners(cell), &self.at)?;
            weights.iter().all(|&w| w >= -SLACK).then_some(weights)
        };
        let kept = CellId(self.cell);
        let known = (self.cell != u32::MAX && mesh.is_live(kept)).then(|| within(kept)).flatten();
        if let Some(weights) = known {
            self.weights = weights;
        } else if let Some((cell, weights)) = nearest_cell(mesh, &self.at) {
            (self.cell, self.weights) = (cell.0, weights);
        }
        let vertices = mesh.cell(CellId(self.cell));
        self.place = std::array::from_fn(|k| {
            let moved = |i: usize| mesh.point(vertices[i])[k] + u[3 * vertices[i].index() + k];
            (0..4).map(|i| self.weights[i] * moved(i)).sum()
        });
    }
}

/// The cell that holds a point, or comes nearest to that in barycentric coordinates, and the coordinates there.
fn nearest_cell(mesh: &SimplexMesh<3, 4>, at: &[f64; 3]) -> Option<(CellId, [f64; 4])> {
    if let Some(found) = mesh.locate(*at) {
        return Some((found.cell, found.barycentric));
    }
    let least = |weights: &[f64; 4]| weights.iter().copied().fold(f64::INFINITY, f64::min);
    let cells = mesh.cells().filter_map(|cell| Some((cell, geometry::barycentric(&mesh.corners(cell), at)?)));
    let (cell, weights) = cells.max_by(|a, b| least(&a.1).total_cmp(&least(&b.1)))?;
    let inside = weights.map(|w| w.max(0.0));
    let sum: f64 = inside.iter().sum();
    Some((cell, inside.map(|w| w / sum)))
}

/// Measured positions.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Measured {
    /// Indices of the markers that were measured.
    pub markers: Vec<usize>,
    rows: Vec<(f64, Vec<[f64; 3]>)>,
}

impl Measured {
    /// Reads a table with the head `time_s,NAME_x,NAME_y,NAME_z,...` and a row for each time, ascending and up to `end` (s).
    /// `names` are those of the markers; `bounds` are the lower and the upper corner of the box around the body, m. A byte order
    /// mark, which spreadsheets write, is skipped.
    ///
    /// # Errors
    /// The line, what was found and what was expected.
    pub fn read(text: &str, names: &[&str], bounds: &[[f64; 3]; 2], end: f64) -> Result<Self, String> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let head = lines.next().map_or("", |(_, line)| line);
        let columns: Vec<&str> = head.split(',').map(str::trim).collect();
        let mut measured = Self { markers: heads(&columns, names)?, rows: Vec::new() };
        let mut before = f64::NEG_INFINITY;
        for (index, line) in lines {
            let number = index + 1;
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            if cells.len() != columns.len() {
                let (found, expected) = (cells.len(), columns.len());
                return Err(format!("line {number}: found {found} columns, expected {expected} as in the head"));
            }
            let value = |cell: &&str| cell.parse().ok().filter(|x: &f64| x.is_finite());
            let numbers: Vec<Option<f64>> = cells.iter().map(value).collect();
            if let Some(column) = numbers.iter().position(Option::is_none) {
                let (found, name) = (cells[column], columns[column]);
                return Err(format!("line {number}: {name}: found {found:?}, expected a number"));
            }
            let numbers: Vec<f64> = numbers.into_iter().flatten().collect();
            if let Some(column) = (1..numbers.len()).find(|&column| is_far(numbers[column], (column - 1) % 3, bounds)) {
                let (name, found, axis) = (columns[column], numbers[column], (column - 1) % 3);
                let [low, high] = [bounds[0][axis], bounds[1][axis]];
                return Err(format!(
                    "line {number}: {name}: found {found}, more than {FAR} body sizes from the body, which reaches from \
                     {low:.4} to {high:.4} m there; expected metres"
                ));
            }
            let t = numbers[0];
            if !(t > before && (0.0..=end * (1.0 + 1e-9)).contains(&t)) {
                let expected = if t > before {
                    format!("from 0 to {end} s, the end of the run")
                } else {
                    format!("above {before} s")
                };
                return Err(format!("line {number}: time_s: found {t} s, expected a time {expected}"));
            }
            before = t;
            measured.rows.push((t, numbers[1..].as_chunks::<3>().0.to_vec()));
        }
        if measured.rows.is_empty() {
            return Err("found no row of positions, expected at least one below the head".into());
        }
        Ok(measured)
    }

    /// How far the markers were from where they were measured. `track` has the time (s) and the places of all markers (m)
    /// after each step, from the start on; between them places are linear. Times beyond the last one are left out.
    #[must_use]
    pub fn error(&self, track: &[(f64, Vec<[f64; 3]>)]) -> MarkerError {
        let mut distances = Vec::new();
        for (t, places) in &self.rows {
            let after = track.partition_point(|(time, _)| *time < *t - 1e-12);
            let Some((time, later)) = track.get(after) else { continue };
            let (from, earlier) = if after == 0 { (time, later) } else { (&track[after - 1].0, &track[after - 1].1) };
            let part = if time > from { (t - from) / (time - from) } else { 1.0 };
            for (&marker, place) in self.markers.iter().zip(places) {
                let (p, q) = (earlier[marker], later[marker]);
                let square = (0..3).map(|k| (p[k] + part * (q[k] - p[k]) - place[k]).powi(2)).sum::<f64>();
                distances.push(square.sqrt());
            }
        }
        let count = distances.len();
        let share = |limit: f64| distances.iter().filter(|d| **d < limit).count() as f64 / count.max(1) as f64;
        MarkerError {
            count,
            rms_m: (distances.iter().map(|d| d * d).sum::<f64>() / count.max(1) as f64).sqrt(),
            max_m: distances.iter().copied().fold(0.0, f64::max),
            below_1_mm: share(1e-3),
            below_2_mm: share(2e-3),
            below_3_mm: share(3e-3),
        }
    }
}

/// Whether a coordinate is so far from the body that its unit must be wrong.
fn is_far(x: f64, axis: usize, [low, high]: &[[f64; 3]; 2]) -> bool {
    let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    x < low[axis] - FAR * size || x > high[axis] + FAR * size
}

/// The markers of a head.
fn heads(columns: &[&str], names: &[&str]) -> Result<Vec<usize>, String> {
    if columns.first() != Some(&"time_s") {
        let found = columns.first().unwrap_or(&"");
        return Err(format!("line 1: found {found:?} in the first column, expected time_s"));
    }
    if columns.len() < 4 || columns.len() % 3 != 1 {
        let found = columns.len();
        return Err(format!("line 1: found {found} columns, expected time_s and three for each marker"));
    }
    let mut markers = Vec::new();
    for triple in columns[1..].as_chunks::<3>().0 {
        let name = triple[0].strip_suffix("_x").unwrap_or(triple[0]);
        let expected = [format!("{name}_x"), format!("{name}_y"), format!("{name}_z")];
        if let Some(k) = (0..3).find(|&k| triple[k] != expected[k]) {
            return Err(format!("line 1: found column {}, expected {}", triple[k], expected[k]));
        }
        let Some(marker) = names.iter().position(|known| *known == name) else {
            let known =
                if names.is_empty() { "a scene with markers".into() } else { format!("one of {}", names.join(", ")) };
            return Err(format!("line 1: found marker {name}, expected {known}"));
        };
        if markers.contains(&marker) {
            return Err(format!("line 1: found marker {name} once more, expected each marker once"));
        }
        markers.push(marker);
    }
    Ok(markers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_mesh::generate::kuhn_box;

    const BOX: [[f64; 3]; 2] = [[0.0; 3], [1.0, 2.0, 4.0]];

    #[test]
    fn a_byte_order_mark_is_skipped_and_times_after_the_end_are_left_out() {
        let measured = Measured::read("\u{feff}time_s,a_x,a_y,a_z\n0.5,0,41.9,0\n", &["a"], &BOX, 1.0).unwrap();
        assert_eq!(measured.error(&[(0.0, vec![[0.0; 3]]), (0.4, vec![[0.0; 3]])]).count, 0);
        assert_eq!(measured.error(&[(0.0, vec![[0.0; 3]]), (0.5, vec![[0.0; 3]])]).count, 1);
    }

    #[test]
    fn points_follow_the_body() {
        let mesh = kuhn_box::<3, 4>([0.0; 3], [1.0; 3], [2, 2, 2]).unwrap();
        let u: Vec<f64> = mesh.points().iter().flat_map(|x| [0.1 * x[1], 0.0, -0.2 * x[0]]).collect();
        for at in [[0.3, 0.7, 0.2], [1.0, 0.5, 1.0], [1.0 + 1e-12, 0.2, 0.9]] {
            let tracked = Tracked::new("a".into(), at, &mesh, &u);
            let expected = [at[0] + 0.1 * at[1], at[1], at[2] - 0.2 * at[0]];
            assert!((0..3).all(|k| (tracked.place[k] - expected[k]).abs() < 1e-11), "{tracked:?}");
        }
    }

    #[test]
    fn errors_are_distances_at_the_times_of_the_file() {
        let text = "time_s,b_x,b_y,b_z,a_x,a_y,a_z\n0.5,0,0,0,0.0005,0,0\n1.0,0,0,0.0025,0.001,0,0\n";
        let measured = Measured::read(text, &["a", "b"], &BOX, 2.0).unwrap();
        // a moves along x by 1 mm a second, b stays.
        let track: Vec<_> = (0..3).map(|k| (f64::from(k), vec![[1e-3 * f64::from(k), 0.0, 0.0], [0.0; 3]])).collect();
        let error = measured.error(&track);
        assert_eq!((error.count, error.max_m), (4, 2.5e-3));
        assert!((error.rms_m - 1.25e-3).abs() < 1e-15);
        assert_eq!([error.below_1_mm, error.below_2_mm, error.below_3_mm], [0.75, 0.75, 1.0]);
    }

    #[test]
    fn files_that_do_not_fit_are_refused_by_line() {
        let refusal = |text: &str| Measured::read(text, &["a"], &BOX, 1.0).unwrap_err();
        let head = "time_s,a_x,a_y,a_z\n";
        for (text, reason) in [
            ("t,a_x,a_y,a_z\n".to_owned(), "line 1: found \"t\" in the first column, expected time_s"),
            ("time_s,a_x,a_y\n".to_owned(), "line 1: found 3 columns, expected time_s and three for each marker"),
            ("time_s,a_x,a_z,a_y\n".to_owned(), "line 1: found column a_z, expected a_y"),
            ("time_s,c_x,c_y,c_z\n".to_owned(), "line 1: found marker c, expected one of a"),
            (
                "time_s,a_x,a_y,a_z,a_x,a_y,a_z\n".to_owned(),
                "line 1: found marker a once more, expected each marker once",
            ),
            (
                format!("{head}0,0,43,0\n"),
                "line 2: a_y: found 43, more than 10 body sizes from the body, which reaches from 0.0000 to 2.0000 m there; \
                 expected metres",
            ),
            (format!("{head}0,1,2\n"), "line 2: found 3 columns, expected 4 as in the head"),
            (format!("{head}\n0,1,x,2\n"), "line 3: a_y: found \"x\", expected a number"),
            (format!("{head}0,1,1,nan\n"), "line 2: a_z: found \"nan\", expected a number"),
            (format!("{head}0.5,0,0,0\n0.5,0,0,0\n"), "line 3: time_s: found 0.5 s, expected a time above 0.5 s"),
            (
                format!("{head}1.5,0,0,0\n"),
                "line 2: time_s: found 1.5 s, expected a time from 0 to 1 s, the end of the run",
            ),
            (head.to_owned(), "found no row of positions, expected at least one below the head"),
        ] {
            assert_eq!(refusal(&text), reason);
        }
    }
}
