//! What three meshes, each with half the edges of the one before, tell about the limit.

/// Values at three levels and what they tend to.
pub struct Halvings {
    levels: [Vec<f64>; 3],
    /// Richardson's extrapolation of the last two levels, for the order two of P1 elements.
    pub limit: Vec<f64>,
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

impl Halvings {
    /// From the values at a level: 1, 2 and 4 times the cells of the coarsest mesh along each axis.
    pub fn new(values: impl FnMut(usize) -> Vec<f64>) -> Self {
        let levels = [1, 2, 4].map(values);
        let limit = levels[2].iter().zip(&levels[1]).map(|(fine, middle)| fine + (fine - middle) / 3.0).collect();
        Self { levels, limit }
    }

    /// Asserts that the error against `table` falls 1.6 times or more from level to level.
    #[track_caller]
    pub fn assert_falls(&self, name: &str, table: &[f64]) {
        let errors = [0, 1, 2].map(|level: usize| distance(&self.levels[level], table));
        let rates = [errors[0] / errors[1], errors[1] / errors[2]];
        println!("{name}: levels {:?}, limit {:?}, table {table:?}", self.levels, self.limit);
        println!("{name}: errors {errors:?} fall by {rates:?}");
        assert!(rates.iter().all(|&rate| rate >= 1.6), "{name}: errors {errors:?} fall by {rates:?}");
    }

    /// Asserts that the limit of every vector of `D` values is within `tolerance` of the length of the table's.
    #[track_caller]
    pub fn assert_limit<const D: usize>(&self, name: &str, table: &[f64], tolerance: f64) {
        assert_eq!(self.limit.len(), table.len());
        for (found, table) in self.limit.chunks_exact(D).zip(table.chunks_exact(D)) {
            let (error, size) = (distance(found, table), distance(table, &[0.0; D]));
            println!("{name}: limit {found:?}, table {table:?}: {:.2} %", 100.0 * error / size);
            assert!(error <= tolerance * size, "{name}: limit {found:?}, table {table:?}");
        }
    }
}
