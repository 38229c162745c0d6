use super::*;
use crate::LinearOperator;
use crate::sparse::Frozen;
use crate::team::Team;
use proptest::prelude::*;
use std::collections::BTreeMap;

type Model<const B: usize> = Vec<BTreeMap<u32, Block<B>>>;

/// One edit; columns beyond the matrix are folded back into it.
#[derive(Clone, Debug)]
enum Edit<const B: usize> {
    Set(usize, BTreeMap<u32, Block<B>>),
    Clear(usize),
    Grow(usize),
}

fn edit<const B: usize>() -> impl Strategy<Value = Edit<B>> {
    let block = proptest::array::uniform(proptest::array::uniform(-1.0..1.0f64));
    prop_oneof![
        6 => (0usize..40, proptest::collection::btree_map(0u32..40, block, 0..18)).prop_map(|(r, m)| Edit::Set(r, m)),
        1 => (0usize..40).prop_map(Edit::Clear),
        1 => (0usize..6).prop_map(Edit::Grow),
    ]
}

fn run<const B: usize>(edits: Vec<Edit<B>>) -> (BlockCsr<B>, Model<B>) {
    let mut matrix = BlockCsr::new(12);
    let mut model: Model<B> = vec![BTreeMap::new(); 12];
    for edit in edits {
        let n = model.len();
        match edit {
            Edit::Set(row, entries) => {
                let entries: BTreeMap<u32, _> = entries.into_iter().map(|(j, b)| (j % n as u32, b)).collect();
                write(&mut matrix, row % n, &entries);
                model[row % n] = entries;
            }
            Edit::Clear(row) => {
                matrix.clear_row(row % n).unwrap();
                model[row % n].clear();
            }
            Edit::Grow(by) => {
                matrix.resize(n + by).unwrap();
                model.resize(n + by, BTreeMap::new());
            }
        }
    }
    (matrix, model)
}

fn write<const B: usize>(matrix: &mut BlockCsr<B>, row: usize, entries: &BTreeMap<u32, Block<B>>) {
    let (cols, blocks): (Vec<u32>, Vec<Block<B>>) = entries.iter().map(|(j, b)| (*j, *b)).unzip();
    matrix.set_row(row, &cols, &blocks).unwrap();
}

fn bits(v: &[f64]) -> Vec<u64> {
    v.iter().map(|x| x.to_bits()).collect()
}

fn check<const B: usize>(edits: Vec<Edit<B>>) {
    let (matrix, model) = run(edits);
    let n = model.len();
    assert_eq!(matrix.n_blocks(), model.iter().map(BTreeMap::len).sum::<usize>());
    for i in 0..n {
        for j in 0..n {
            assert_eq!(matrix.get(i, j), model[i].get(&(j as u32)));
        }
    }
    // Patched and rebuilt: the same bits, in every kernel.
    let mut rebuilt = BlockCsr::new(n);
    for i in (0..n).rev() {
        write(&mut rebuilt, i, &model[i]);
    }
    assert_eq!(matrix, rebuilt);
    let x: Vec<f64> = (0..n * B).map(|k| (k as f64 * 0.7).sin()).collect();
    let [mut y, mut z] = [vec![f64::NAN; n * B], vec![f64::NAN; n * B]];
    matrix.apply(&x, &mut y);
    rebuilt.apply(&x, &mut z);
    assert_eq!(bits(&y), bits(&z));
    // Vectors need no alignment beyond that of a number.
    let shifted: Vec<f64> = std::iter::once(0.0).chain(x.iter().copied()).collect();
    let mut shifted_y = vec![0.0; n * B + 1];
    matrix.apply(&shifted[1..], &mut shifted_y[1..]);
    assert_eq!(bits(&y), bits(&shifted_y[1..]));
    // The fused product is the product and the dot.
    let xy = matrix.apply_dot(&x, &mut z);
    assert_eq!(bits(&y), bits(&z));
    assert_eq!(xy.to_bits(), crate::vector::dot(&x, &y).to_bits());
    // Against the dense matrix, up to rounding; against the sum in the promised order, bit for bit.
    let dense = matrix.to_dense();
    for (row, &y) in dense.chunks(n * B).zip(&y) {
        let sum: f64 = row.iter().zip(&x).map(|(a, x)| a * x).sum();
        assert!((sum - y).abs() <= 1e-13);
    }
    let by_columns = |i: usize| -> f64 {
        let sum = |l: usize| model[i / B].iter().fold(0.0, |s, (&j, b)| s + b[i % B][l] * x[j as usize * B + l]);
        (1..B).fold(sum(0), |s, l| s + sum(l))
    };
    let expected: Vec<f64> = (0..n * B).map(by_columns).collect();
    assert_eq!(bits(&y), bits(&expected));
    // Through a file.
    let bytes = postcard::to_allocvec(&matrix).unwrap();
    assert_eq!(postcard::from_bytes::<BlockCsr<B>>(&bytes).unwrap(), matrix);
}

proptest! {
    #[test]
    fn edits_equal_a_dense_model_1x1(edits in proptest::collection::vec(edit::<1>(), 0..60)) { check(edits); }

    #[test]
    fn edits_equal_a_dense_model_2x2(edits in proptest::collection::vec(edit::<2>(), 0..60)) { check(edits); }

    #[test]
    fn edits_equal_a_dense_model_3x3(edits in proptest::collection::vec(edit::<3>(), 0..60)) { check(edits); }

    #[test]
    fn edits_equal_a_dense_model_5x5(edits in proptest::collection::vec(edit::<5>(), 0..30)) { check(edits); }
}

/// A band matrix large enough for threads.
fn band(n: usize) -> BlockCsr<2> {
    let mut matrix = BlockCsr::new(n);
    for i in 0..n {
        let cols: Vec<u32> = (i.saturating_sub(3)..(i + 4).min(n)).map(|j| j as u32).collect();
        let block = |&j: &u32| [[(j as f64).cos(), 0.3], [-0.2, (i as f64).sin()]];
        let blocks: Vec<_> = cols.iter().map(block).collect();
        matrix.set_row(i, &cols, &blocks).unwrap();
    }
    matrix
}

#[test]
fn threads_do_not_change_a_bit() {
    let matrix = band(12_000);
    let frozen = Frozen::<2>::new(&matrix);
    let x: Vec<f64> = (0..matrix.dim()).map(|k| (k as f64 * 0.1).sin()).collect();
    let mut reference = vec![0.0; x.len()];
    let dot = matrix.apply_dot(&x, &mut reference);
    for threads in [0, 1, 2, 8] {
        let team = Team::new(threads);
        for matrix in [&matrix as &dyn LinearOperator, &frozen] {
            let mut y = vec![0.0; x.len()];
            assert_eq!(matrix.apply_dot_on(&team, &x, &mut y).to_bits(), dot.to_bits());
            assert_eq!(bits(&y), bits(&reference));
            y.fill(0.0);
            matrix.apply_on(&team, &x, &mut y);
            assert_eq!(bits(&y), bits(&reference));
        }
    }
}

#[test]
fn a_row_that_grows_moves_alone() {
    let mut matrix = band(100);
    let (capacity, written) = (matrix.capacity(), matrix.rows_written());
    let before: Vec<u32> = matrix.slots.iter().map(|s| s.start).collect();
    let cols: Vec<u32> = (0..20).collect();
    matrix.set_row(50, &cols, &[[[1.0; 2]; 2]; 20]).unwrap();
    assert_eq!(matrix.rows_written() - written, 1);
    assert_eq!(matrix.capacity(), capacity + 20);
    let after: Vec<u32> = matrix.slots.iter().map(|s| s.start).collect();
    let moved: Vec<usize> = (0..100).filter(|&i| before[i] != after[i]).collect();
    assert_eq!(moved, [50]);
    // The place it left serves the next row of that size.
    matrix.resize(101).unwrap();
    matrix.set_row(100, &cols[..7], &[[[1.0; 2]; 2]; 7]).unwrap();
    assert_eq!(matrix.slots[100].start, before[50]);
}

#[test]
fn memory_stays_bounded_when_rows_change_for_ever() {
    let mut matrix = BlockCsr::<2>::new(50);
    let mut peak = 0;
    for step in 0..20_000usize {
        let (row, len) = (step * 7 % 50, 4 + step * 13 % 9);
        let cols: Vec<u32> = (0..len as u32).collect();
        matrix.set_row(row, &cols, &vec![[[1.0; 2]; 2]; len]).unwrap();
        if step % 3 == 0 {
            matrix.clear_row(step * 11 % 50).unwrap();
        }
        if step == 2_000 {
            peak = matrix.capacity();
        }
    }
    assert!(matrix.capacity() <= peak + 50 * 12, "{} after {peak}", matrix.capacity());
}

#[test]
fn bad_edits_are_refused_and_leave_no_trace() {
    let mut matrix = band(10);
    let before = matrix.clone();
    let zero = [[0.0; 2]; 2];
    let row_out = SparseError::RowOutOfRange { row: 10, n_rows: 10 };
    assert_eq!(matrix.set_row(10, &[], &[]), Err(row_out));
    assert_eq!(matrix.clear_row(10), Err(row_out));
    let col_out = SparseError::ColumnOutOfRange { row: 1, col: 10, n_rows: 10 };
    assert_eq!(matrix.set_row(1, &[0, 10], &[zero; 2]), Err(col_out));
    let descending = SparseError::NotAscending { row: 1, position: 2 };
    assert_eq!(matrix.set_row(1, &[0, 3, 3], &[zero; 3]), Err(descending));
    let shape = SparseError::Shape { row: 1, cols: 1, blocks: 2 };
    assert_eq!(matrix.set_row(1, &[0], &[zero; 2]), Err(shape));
    let nan = SparseError::NotFinite { row: 1, col: 4 };
    assert_eq!(matrix.set_row(1, &[0, 4], &[zero, [[0.0, 0.0], [f64::NAN, 0.0]]]), Err(nan));
    assert_eq!(matrix.add_to_block(1, 4, &[[f64::INFINITY; 2]; 2]), Err(nan));
    assert_eq!(matrix.add_to_block(0, 9, &zero), Err(SparseError::NotStored { row: 0, col: 9 }));
    assert!(matches!(matrix.resize(9), Err(SparseError::InUse { n_rows: 9, .. })));
    assert!(matches!(matrix.resize(usize::MAX), Err(SparseError::TooLarge(_))));
    assert_eq!(matrix, before);

    matrix.add_to_block(2, 2, &[[1.0, 2.0], [3.0, 4.0]]).unwrap();
    assert_eq!(matrix.diagonal(2)[1][0], before.diagonal(2)[1][0] + 3.0);
    assert_eq!(matrix.get_mut(0, 9), None);
}

#[test]
fn empty_rows_at_the_end_can_be_dropped() {
    let mut matrix = BlockCsr::<2>::new(3);
    matrix.set_row(0, &[0, 1], &[[[1.0; 2]; 2]; 2]).unwrap();
    matrix.resize(2).unwrap();
    assert_eq!(matrix.n_rows(), 2);
    assert!(matrix.resize(1).is_err()); // row 0 refers to column 1
}

#[test]
fn asymmetry_is_the_largest_difference() {
    let mut matrix = BlockCsr::<2>::new(2);
    matrix.set_row(0, &[0, 1], &[[[2.0, 1.0], [1.0, 2.0]], [[1.0, 2.0], [3.0, 4.0]]]).unwrap();
    matrix.set_row(1, &[0], &[[[1.0, 3.0], [2.0, 3.5]]]).unwrap();
    assert_eq!(matrix.asymmetry(), 0.5);
}

#[test]
fn scalar_rows_agree_with_sprs() {
    let matrix = band(40);
    let (indptr, indices, values) = matrix.to_scalar_csr().into_parts();
    let scalar = sprs::CsMat::new((80, 80), indptr, indices, values);
    let x: Vec<f64> = (0..80).map(f64::from).collect();
    let mut y = vec![0.0; 80];
    matrix.apply(&x, &mut y);
    let mut expected = vec![0.0; 80];
    sprs::prod::mul_acc_mat_vec_csr(scalar.view(), &x[..], &mut expected[..]);
    for (a, b) in expected.iter().zip(&y) {
        assert!((a - b).abs() <= 1e-12 * a.abs().max(1.0));
    }
}

#[test]
fn a_damaged_file_is_refused() {
    #[derive(serde::Serialize)]
    struct Rows(usize, Vec<u32>, Vec<u32>, Vec<f64>);
    let read = |rows: Rows| postcard::from_bytes::<BlockCsr<1>>(&postcard::to_allocvec(&rows).unwrap());
    assert!(read(Rows(1, vec![1, 0], vec![1], vec![2.0])).is_ok());
    assert!(read(Rows(2, vec![1, 0], vec![1], vec![2.0])).is_err()); // block size
    assert!(read(Rows(1, vec![1, 0], vec![2], vec![2.0])).is_err()); // column
    assert!(read(Rows(1, vec![1, 1], vec![1], vec![2.0])).is_err()); // lengths
    assert!(read(Rows(1, vec![u32::MAX, 1], vec![1], vec![2.0])).is_err());
    assert!(read(Rows(1, vec![1, 0], vec![1], vec![f64::NAN])).is_err());
}
