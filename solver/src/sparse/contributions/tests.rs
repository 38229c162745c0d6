use super::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

const ROWS: usize = 9;
type Elements<const B: usize> = BTreeMap<usize, ([u32; 3], ElementBlocks<B, 3>)>;

#[derive(Clone, Debug)]
enum Step<const B: usize> {
    Insert(usize, [u32; 3], ElementBlocks<B, 3>),
    Remove(usize),
    Update(Vec<(usize, ElementBlocks<B, 3>)>),
}

/// A symmetric element matrix, whose magnitude varies over six orders.
fn blocks<const B: usize>() -> impl Strategy<Value = ElementBlocks<B, 3>> {
    (proptest::collection::vec(-1.0..1.0f64, 9 * B * B), -3i32..3).prop_map(|(v, scale)| {
        let at = |a: usize, i: usize, b: usize, j: usize| v[(a * B + i) * 3 * B + b * B + j] * 10f64.powi(scale);
        std::array::from_fn(|a| {
            std::array::from_fn(|b| std::array::from_fn(|i| std::array::from_fn(|j| at(a, i, b, j) + at(b, j, a, i))))
        })
    })
}

fn step<const B: usize>() -> impl Strategy<Value = Step<B>> {
    let element = 0usize..12;
    let nodes = (0..ROWS as u32, 1..ROWS as u32 - 1, 1u32..4).prop_map(|(a, b, c)| {
        let n = ROWS as u32;
        let (a, b) = (a, (a + b) % n);
        let c = (0..n).cycle().skip((b + c) as usize).find(|c| *c != a && *c != b).unwrap();
        [a, b, c]
    });
    prop_oneof![
        3 => (element.clone(), nodes, blocks()).prop_map(|(e, n, b)| Step::Insert(e, n, b)),
        1 => element.clone().prop_map(Step::Remove),
        4 => proptest::collection::vec((element, blocks()), 0..8).prop_map(Step::Update),
    ]
}

fn fresh<const B: usize>(elements: &Elements<B>) -> BlockCsr<B> {
    let mut matrix = BlockCsr::new(ROWS);
    let mut contributions = ElementContributions::new(RefreshRule::default());
    // Inserted in the wrong order: the sums do not depend on it.
    contributions.change(&mut matrix, [], elements.iter().rev().map(|(&e, &(n, b))| (e, n, b))).unwrap();
    matrix
}

/// Magnitudes of all contributions to each entry.
fn magnitudes<const B: usize>(elements: &Elements<B>) -> Vec<f64> {
    let n = ROWS * B;
    let mut sums = vec![0.0; n * n];
    for (nodes, blocks) in elements.values() {
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            for (i, j) in (0..B).flat_map(|i| (0..B).map(move |j| (i, j))) {
                sums[(nodes[a] as usize * B + i) * n + nodes[b] as usize * B + j] += f64::abs(blocks[a][b][i][j]);
            }
        }
    }
    sums
}

fn check<const B: usize>(steps: Vec<Step<B>>, rule: RefreshRule) {
    let mut matrix = BlockCsr::<B>::new(ROWS);
    let mut lazy = ElementContributions::<B, 3>::new(rule);
    let mut elements = Elements::<B>::new();
    // The largest magnitudes ever, those taken out and put in included: an upper bound of S.
    let mut largest = vec![0.0f64; (ROWS * B).pow(2)];
    for step in steps {
        let before = (magnitudes(&elements), matrix.clone());
        match step {
            Step::Insert(e, nodes, blocks) => {
                let removed = elements.contains_key(&e).then_some(e);
                lazy.change(&mut matrix, removed, [(e, nodes, blocks)]).unwrap();
                elements.insert(e, (nodes, blocks));
            }
            Step::Remove(e) => {
                let outcome = lazy.change(&mut matrix, [e], []);
                assert_eq!(outcome.is_ok(), elements.remove(&e).is_some());
            }
            Step::Update(updates) => {
                let updates: BTreeMap<usize, _> = updates.into_iter().collect();
                let measure = |e| f64::from(u8::from(updates.contains_key(&e)));
                let report = lazy.update_where(&mut matrix, measure, 0.5, |e| updates[&e]).unwrap();
                let mut count = 0;
                for (e, blocks) in updates {
                    if let Some(element) = elements.get_mut(&e) {
                        element.1 = blocks;
                        count += 1;
                    }
                }
                assert_eq!(report.elements, count);
            }
        }
        let after = magnitudes(&elements);
        for (largest, (a, b)) in largest.iter_mut().zip(before.0.iter().zip(&after)) {
            *largest = largest.max(a + b);
        }
        // Pattern exactly, numbers within the bound, symmetry bit for bit.
        let expected = fresh(&elements);
        let n_elements = elements.len() as f64;
        let bound = (f64::from(rule.max_replacements) + n_elements) * f64::EPSILON;
        let dense = (matrix.to_dense(), expected.to_dense());
        for row in 0..ROWS {
            assert_eq!(matrix.row(row).0, expected.row(row).0);
        }
        for (k, (a, b)) in dense.0.iter().zip(&dense.1).enumerate() {
            assert!((a - b).abs() <= bound * largest[k], "{a} {b} {}", largest[k]);
        }
        assert_eq!(matrix.asymmetry(), 0.0);
        for row in 0..ROWS {
            let listed = lazy.changed_rows().contains(&(row as u32));
            assert!(listed || matrix.row(row) == before.1.row(row), "row {row} changed unseen");
        }
    }
    lazy.refresh(&mut matrix).unwrap();
    assert_eq!(matrix, fresh(&elements)); // equal bits: no zero is negative in one and positive in the other alone
}

proptest! {
    #[test]
    fn lazy_is_fresh_1x1(steps in proptest::collection::vec(step::<1>(), 1..60)) {
        check(steps, RefreshRule { max_replacements: 5, rows_per_update: 1 });
    }

    #[test]
    fn lazy_is_fresh_3x3(steps in proptest::collection::vec(step::<3>(), 1..40)) {
        check(steps, RefreshRule { max_replacements: 1000, rows_per_update: 0 });
    }
}

fn ones(scale: f64) -> ElementBlocks<1, 2> {
    [[[[scale]], [[-scale]]], [[[-scale]], [[scale]]]]
}

#[test]
fn rows_are_refreshed_on_schedule() {
    let mut matrix = BlockCsr::new(4);
    let mut lazy = ElementContributions::new(RefreshRule { max_replacements: 3, rows_per_update: 0 });
    lazy.change(&mut matrix, [], (0..3).map(|e| (e, [e as u32, e as u32 + 1], ones(0.1)))).unwrap();
    let mut refreshed = Vec::new();
    for step in 0..6 {
        let one = |e| if e == 0 { 1.0 } else { 0.0 };
        let report = lazy.update_where(&mut matrix, one, 0.5, |_| ones(0.1 * f64::from(step))).unwrap();
        assert_eq!(report.elements, 1);
        refreshed.push(report.rows_refreshed);
    }
    assert_eq!(refreshed, [0, 0, 2, 0, 0, 2]);
    // In turn: rows 0 and 1 have replacements, one row per call.
    lazy.rule = RefreshRule { max_replacements: 1000, rows_per_update: 1 };
    let report = lazy.update_where(&mut matrix, |e| f64::from(u8::from(e == 0)), 0.5, |_| ones(7.0)).unwrap();
    assert_eq!(report, LazyReport { elements: 1, rows_refreshed: 1 });
    assert_eq!((lazy.replacements[0], lazy.replacements[1]), (0, 1));
    let none = lazy.update_where(&mut matrix, |_| 0.0, 0.5, |_| ones(0.0)).unwrap();
    assert_eq!(none, LazyReport { elements: 0, rows_refreshed: 1 });
    let none = lazy.update_where(&mut matrix, |_| 0.0, 0.5, |_| ones(0.0)).unwrap();
    assert_eq!(none, LazyReport::default());
    assert!(lazy.changed_rows().is_empty());
}

#[test]
fn drift_that_is_never_refreshed_is_seen() {
    // The test of the bound can fail: a huge contribution put in and taken out again leaves its rounding error.
    let mut matrix = BlockCsr::new(2);
    let mut lazy = ElementContributions::new(RefreshRule { max_replacements: 1000, rows_per_update: 0 });
    lazy.change(&mut matrix, [], [(0, [0, 1], ones(0.1)), (1, [0, 1], ones(0.1))]).unwrap();
    for value in [1e8, 0.1] {
        lazy.update_where(&mut matrix, |e| e as f64, 0.5, |_| ones(value)).unwrap();
    }
    let drifted = matrix.diagonal(0)[0][0];
    assert!(drifted != 0.2 && (drifted - 0.2).abs() <= 4.0 * f64::EPSILON * 1e8);
    lazy.refresh(&mut matrix).unwrap();
    assert_eq!(matrix.diagonal(0)[0][0], 0.2);
}

#[test]
fn bad_elements_are_refused() {
    let mut matrix = BlockCsr::new(3);
    let mut lazy = ElementContributions::<1, 2>::new(RefreshRule::default());
    lazy.change(&mut matrix, [], [(4, [0, 1], ones(1.0))]).unwrap();
    let before = matrix.clone();
    let mut insert = |e, nodes, blocks| lazy.change(&mut matrix, [], [(e, nodes, blocks)]).unwrap_err();
    assert_eq!(insert(4, [1, 2], ones(1.0)), ContributionError::InUse { element: 4 });
    assert_eq!(insert(5, [1, 3], ones(1.0)), ContributionError::Node { element: 5, node: 3, n_rows: 3 });
    assert_eq!(insert(5, [1, 1], ones(1.0)), ContributionError::Node { element: 5, node: 1, n_rows: 3 });
    let mut bad = ones(1.0);
    bad[1][0][0][0] = f64::NAN;
    assert_eq!(insert(5, [1, 2], bad), ContributionError::NotFinite { element: 5, a: 1, b: 0 });
    assert_eq!(insert(usize::MAX, [1, 2], ones(1.0)), ContributionError::TooLarge { element: usize::MAX });
    assert_eq!(lazy.change(&mut matrix, [3], []).unwrap_err(), ContributionError::Missing { element: 3 });
    let nan = lazy.update_where(&mut matrix, |_| f64::NAN, 0.5, |_| ones(1.0)).unwrap_err();
    assert!(matches!(nan, ContributionError::Measure { element: 4, .. }));
    let nan = lazy.update_where(&mut matrix, |_| 1.0, 0.5, |_| bad).unwrap_err();
    assert_eq!(nan, ContributionError::NotFinite { element: 4, a: 1, b: 0 });
    assert_eq!(matrix, before);
    let mut other = BlockCsr::new(3);
    let foreign = lazy.update_where(&mut other, |_| 1.0, 0.5, |_| ones(1.0)).unwrap_err();
    assert_eq!(foreign, ContributionError::Matrix(SparseError::NotStored { row: 0, col: 0 }));
}
