//! How the measures of quality are spread over a mesh.

use super::cell::{CellQuality, each_angle_deg, edge_range};
use super::{Histogram, Measure, Side};
use crate::{SimplexMesh, VertexId, geometry};
use serde::Serialize;

/// Ids of the worst cells are kept up to this many.
const MOST_WORST: usize = 10;

/// The quality of the cells of a mesh.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct QualityReport {
    /// Number of cells.
    pub n_cells: usize,
    /// Sum of the volumes (areas, lengths); inverted cells count negative.
    pub volume: f64,
    /// Length of the shortest edge; infinite without cells.
    pub shortest_edge: f64,
    /// Length of the longest edge.
    pub longest_edge: f64,
    /// The measures that these cells have, in the order of [`Measure::ALL`].
    pub measures: Vec<MeasureReport>,
}

/// How one measure is spread. Of cells without volume some measures are infinite; that counts as a value.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct MeasureReport {
    /// Which measure.
    pub measure: Measure,
    /// Number of values.
    pub count: usize,
    /// Cells of which the measure is not a number, because of their coordinates, or that have no angles at all.
    pub undefined: usize,
    /// Smallest value; NaN without values, as all that follow.
    pub min: f64,
    /// Mean of the finite values.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
    /// Below which value which part of the values lies.
    pub percentiles: Percentiles,
    /// Counts beyond the [limits](Measure::limits) of the measure.
    pub beyond: Vec<Beyond>,
    /// Counts in bins.
    pub histogram: Histogram,
    /// The worst cells, the worst first, up to ten; empty for a measure that has no bad side.
    pub worst: Vec<Worst>,
}

/// Percentiles by nearest rank: each is one of the values.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Percentiles {
    /// One in a hundred is not above it.
    pub p1: f64,
    /// Five in a hundred are not above it.
    pub p5: f64,
    /// A quarter is not above it.
    pub p25: f64,
    /// The median.
    pub p50: f64,
    /// Three quarters are not above it.
    pub p75: f64,
    /// 95 in a hundred are not above it.
    pub p95: f64,
    /// 99 in a hundred are not above it.
    pub p99: f64,
}

/// How many values lie beyond a limit.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Beyond {
    /// Which side is beyond.
    pub side: Side,
    /// The limit; values equal to it count.
    pub limit: f64,
    /// How many.
    pub count: usize,
}

/// A bad cell.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Worst {
    /// Its id.
    pub cell: u32,
    /// Its value.
    pub value: f64,
}

impl QualityReport {
    /// The report of one measure; `None` for one that these cells do not have.
    pub fn measure(&self, measure: Measure) -> Option<&MeasureReport> {
        self.measures.iter().find(|report| report.measure == measure)
    }
}

/// The quality of the live cells at rest.
pub fn report<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> QualityReport {
    report_at(mesh, |v| mesh.point(v))
}

/// The quality of the live cells with every vertex at `position(v)`, for instance displaced.
pub fn report_at<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    position: impl Fn(VertexId) -> [f64; D],
) -> QualityReport {
    report_of(mesh.cells().map(|c| (c.0, mesh.oriented(c).map(&position))))
}

/// The quality of cells given by an id and their corners.
pub fn report_of<const D: usize, const N: usize>(cells: impl Iterator<Item = (u32, [[f64; D]; N])>) -> QualityReport {
    let mut report =
        QualityReport { n_cells: 0, volume: 0.0, shortest_edge: f64::INFINITY, longest_edge: 0.0, measures: vec![] };
    let (mut angles, mut without_angles) = (Vec::new(), 0);
    let mut qualities: Vec<(u32, CellQuality)> = Vec::new();
    for (id, corners) in cells {
        let (shortest, longest) = edge_range(&corners);
        report.shortest_edge = report.shortest_edge.min(shortest);
        report.longest_edge = report.longest_edge.max(longest);
        report.volume += geometry::signed_measure(&corners);
        match each_angle_deg(&corners) {
            Some(each) => angles.extend(each),
            None => without_angles += 1,
        }
        qualities.push((id, CellQuality::of(&corners)));
    }
    report.n_cells = qualities.len();
    for measure in Measure::ALL.into_iter().filter(|measure| measure.is_defined(N)) {
        let mut part = if measure == Measure::Angle {
            let mut part = spread(measure, std::mem::take(&mut angles));
            part.undefined = without_angles;
            part
        } else {
            spread(measure, qualities.iter().filter_map(|(_, cell)| measure.of(cell)).collect())
        };
        part.worst = worst(measure, &qualities);
        report.measures.push(part);
    }
    report
}

/// The spread of some values.
fn spread(measure: Measure, mut values: Vec<f64>) -> MeasureReport {
    let given = values.len();
    values.retain(|x| !x.is_nan());
    let mut histogram = measure.bins();
    values.iter().for_each(|&x| histogram.add(x));
    let beyond = measure.limits().iter().map(|&(side, limit)| {
        let count = values.iter().filter(|&&x| side.holds(x, limit)).count();
        Beyond { side, limit, count }
    });
    let beyond = beyond.collect();
    let finite = values.iter().filter(|x| x.is_finite());
    let (sum, n_finite) = finite.fold((0.0, 0), |(sum, n), x| (sum + x, n + 1));
    values.sort_unstable_by(f64::total_cmp);
    let rank = |percent: usize| {
        let at = (percent * values.len()).div_ceil(100).max(1) - 1;
        values.get(at).copied().unwrap_or(f64::NAN)
    };
    let [p1, p5, p25, p50, p75, p95, p99] = [1, 5, 25, 50, 75, 95, 99].map(rank);
    MeasureReport {
        measure,
        count: values.len(),
        undefined: given - values.len(),
        min: rank(0),
        mean: if n_finite > 0 { sum / f64::from(n_finite) } else { f64::NAN },
        max: rank(100),
        percentiles: Percentiles { p1, p5, p25, p50, p75, p95, p99 },
        beyond,
        histogram,
        worst: Vec::new(),
    }
}

/// The worst cells by a measure, equal ones by id.
fn worst(measure: Measure, qualities: &[(u32, CellQuality)]) -> Vec<Worst> {
    let Some(side) = measure.bad_side() else { return Vec::new() };
    let values =
        qualities.iter().filter_map(|(cell, quality)| Some(Worst { cell: *cell, value: measure.of(quality)? }));
    let mut list: Vec<Worst> = values.filter(|worst| !worst.value.is_nan()).collect();
    let order = |a: &Worst, b: &Worst| {
        let by_value = a.value.total_cmp(&b.value);
        if side == Side::Below { by_value } else { by_value.reverse() }.then(a.cell.cmp(&b.cell))
    };
    if list.len() > MOST_WORST {
        list.select_nth_unstable_by(MOST_WORST, order);
        list.truncate(MOST_WORST);
    }
    list.sort_unstable_by(order);
    list
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::generate::kuhn_box;
    use proptest::prelude::*;

    #[test]
    fn a_box_in_every_dimension() {
        fn angles<const D: usize, const N: usize>() -> MeasureReport {
            let mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [2; D]).unwrap();
            let report = report(&mesh);
            assert_eq!((report.n_cells, report.measures.len()), (mesh.n_cells(), 6));
            assert!((report.volume - 1.0).abs() < 1e-14);
            assert_eq!((report.shortest_edge, report.longest_edge), (0.5, 0.5 * (D as f64).sqrt()));
            report.measure(Measure::Angle).unwrap().clone()
        }
        // Dihedral angles of a path simplex: 45 degrees between neighbouring facets of the ends, 60 within, else 90.
        for angles in [angles::<2, 3>(), angles::<3, 4>(), angles::<4, 5>()] {
            let close = |x: f64, y: f64| assert!((x - y).abs() < 1e-9, "{x} {y}");
            close(angles.min, 45.0);
            close(angles.max, 90.0);
            assert_eq!(angles.histogram.counts.iter().sum::<usize>(), angles.count);
            assert!(angles.beyond.iter().all(|beyond| beyond.count == 0));
        }
    }

    #[test]
    fn displaced_meshes_show_inverted_and_flat_cells_by_id() {
        let mesh = kuhn_box::<2, 3>([0.0; 2], [1.0; 2], [1; 2]).unwrap();
        // Vertex 1 through the diagonal, vertex 2 onto it.
        let moved = |v: VertexId| [[0.0, 0.0], [0.2, 0.8], [0.5, 0.5], [1.0, 1.0]][v.index()];
        let report = report_at(&mesh, moved);
        let quality = report.measure(Measure::Quality).unwrap();
        assert_eq!(quality.worst.len(), 2);
        assert!(quality.worst[0].value < 0.0 && quality.worst[1].value == 0.0);
        assert_eq!((quality.beyond[0].count, quality.histogram.below), (2, 1));
        let aspect = report.measure(Measure::Aspect).unwrap();
        assert_eq!((aspect.worst[0].value, aspect.histogram.above), (f64::INFINITY, 1));
        assert_eq!(aspect.worst[0].cell, quality.worst[1].cell);
        assert!(aspect.mean.is_finite());
        let angles = report.measure(Measure::Angle).unwrap();
        assert_eq!((angles.count, angles.undefined), (3, 1));
    }

    #[test]
    fn segments_have_no_angles_and_nothing_has_no_values() {
        let rod = report_of([(7, [[0.0, 0.0, 0.0], [0.0, 3.0, 4.0]])].into_iter());
        assert_eq!(
            rod.measures.iter().map(|m| m.measure).collect::<Vec<_>>(),
            [Measure::Quality, Measure::Aspect, Measure::RadiusEdge]
        );
        assert_eq!((rod.volume, rod.measures[0].min, rod.measures[0].worst[0].cell), (5.0, 1.0, 7));
        let nothing = report_of(std::iter::empty::<(u32, [[f64; 2]; 3])>());
        assert!(nothing.measures.iter().all(|m| m.count == 0 && m.min.is_nan() && m.worst.is_empty()));
    }

    proptest! {
        #[test]
        fn spreads_agree_with_a_sort(values in prop::collection::vec(-0.5..1.5_f64, 1..300)) {
            let spread = spread(Measure::Quality, values.clone());
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let n = sorted.len();
            prop_assert_eq!((spread.min, spread.max), (sorted[0], sorted[n - 1]));
            prop_assert_eq!(spread.percentiles.p50, sorted[n.div_ceil(2) - 1]);
            let p = spread.percentiles;
            let not_above = |x: f64| sorted.iter().filter(|&&y| y <= x).count() as f64 / n as f64;
            for (part, x) in [(0.01, p.p1), (0.05, p.p5), (0.25, p.p25), (0.75, p.p75), (0.95, p.p95), (0.99, p.p99)] {
                prop_assert!(not_above(x) >= part);
                prop_assert!(sorted.iter().filter(|&&y| y < x).count() as f64 / (n as f64) < part);
            }
            let histogram = &spread.histogram;
            prop_assert_eq!(histogram.counts.iter().sum::<usize>() + histogram.below + histogram.above, n);
            prop_assert!((spread.mean - values.iter().sum::<f64>() / n as f64).abs() < 1e-12);
        }
    }
}
