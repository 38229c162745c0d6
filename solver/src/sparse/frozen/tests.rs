use super::*;
use crate::sparse::SparseError;
use crate::team::Team;
use crate::{Block, LinearOperator};
use proptest::prelude::*;

fn row<const B: usize>(n: usize, i: usize, seed: u64) -> (Vec<u32>, Vec<Block<B>>) {
    let mix = |k: u64| {
        seed.wrapping_add(k).wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407) >> 33
    };
    let len = mix(1) as usize % 12;
    let mut cols: Vec<u32> = (0..len as u64).map(|k| ((i as u64 + mix(k + 2) % 40) % n as u64) as u32).collect();
    cols.sort_unstable();
    cols.dedup();
    let blocks = cols
        .iter()
        .map(|&c| {
            std::array::from_fn(|p| std::array::from_fn(|q| mix(u64::from(c) + (p * B + q) as u64) as f64 * 1e-9 - 1.0))
        })
        .collect();
    (cols, blocks)
}

fn follow<const B: usize>(edits: &[(usize, usize, u64)]) -> Result<(), SparseError> {
    let mut matrix = BlockCsr::<B>::new(5);
    let (mut frozen, mut frozen32) = (Frozen::<B>::new(&matrix), Frozen::<B, f32>::default());
    for &(n, burst, seed) in edits {
        // Rows that the new size would cut off are cleared, and rewritten without the columns it cuts off.
        for i in 0..matrix.n_rows() {
            let cut = i >= n || matrix.row(i).0.last().is_some_and(|&col| col as usize >= n);
            if cut {
                matrix.clear_row(i)?;
            }
        }
        matrix.resize(n)?;
        for k in 0..burst {
            let i = (seed as usize % n + k * k) % n;
            let (cols, blocks) = row::<B>(n, i, seed.wrapping_add(k as u64));
            matrix.set_row(i, &cols, &blocks)?;
        }
        let x: Vec<f64> = (0..matrix.dim()).map(|k| (k as f64 * 0.7).sin()).collect();
        let (mut y, mut z) = (vec![0.0; x.len()], vec![1.0; x.len()]);
        frozen.refresh(&matrix);
        matrix.apply(&x, &mut y);
        let dot = frozen.apply_dot(&x, &mut z);
        assert_eq!(y, z);
        assert_eq!(dot, crate::vector::dot(&x, &y));
        assert_eq!(frozen.n_blocks(), matrix.n_blocks());
        let fresh = Frozen::<B>::new(&matrix);
        assert_eq!(fresh.streamed_blocks(), frozen.fresh.iter().map(|&n| n as usize).sum::<usize>());

        for k in [1, 3, 8, 13] {
            let many: Vec<f64> = (0..x.len() * k).map(|at| ((at / k) as f64 * 0.7 + (at % k) as f64).sin()).collect();
            for threads in [1, 2] {
                let mut products = vec![f64::NAN; many.len()];
                frozen.apply_many(&Team::new(threads), k, &many, &mut products, &mut []);
                for c in 0..k {
                    let one: Vec<f64> = many.iter().skip(c).step_by(k).copied().collect();
                    frozen.apply(&one, &mut z);
                    assert!(products.iter().skip(c).step_by(k).eq(&z), "vector {c} of {k}");
                }
            }
        }

        frozen32.refresh(&matrix);
        let x32: Vec<f32> = x.iter().map(|&v| v as f32).collect();
        let mut y32 = vec![0.0f32; x.len()];
        frozen32.apply(&x32, &mut y32);
        for (y, y32) in y.iter().zip(&y32) {
            assert!((y - f64::from(*y32)).abs() < 1e-4 * 12.0 * B as f64);
        }
    }
    Ok(())
}

fn edits() -> impl Strategy<Value = Vec<(usize, usize, u64)>> {
    proptest::collection::vec((1usize..700, 0usize..60, any::<u64>()), 1..12)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_sequence_of_edits_is_followed_1x1(edits in edits()) { follow::<1>(&edits).unwrap(); }

    #[test]
    fn any_sequence_of_edits_is_followed_2x2(edits in edits()) { follow::<2>(&edits).unwrap(); }

    #[test]
    fn any_sequence_of_edits_is_followed_3x3(edits in edits()) { follow::<3>(&edits).unwrap(); }

    #[test]
    fn any_sequence_of_edits_is_followed_6x6(edits in edits()) { follow::<6>(&edits).unwrap(); }
}

/// A band matrix: every row as long as its neighbours.
fn band(n: usize) -> BlockCsr<3> {
    let mut matrix = BlockCsr::new(n);
    for i in 0..n {
        let cols: Vec<u32> = (i.saturating_sub(6)..(i + 7).min(n)).map(|j| j as u32).collect();
        let blocks = vec![[[1.0, 0.5, 0.25], [0.5, 2.0, 0.1], [0.0, 0.3, -1.0]]; cols.len()];
        matrix.set_row(i, &cols, &blocks).unwrap();
    }
    matrix
}

#[test]
fn padding_that_edits_leave_is_cleared() {
    let mut matrix = band(3000);
    let mut frozen = Frozen::<3>::new(&matrix);
    let mut state = 1u64;
    for _ in 0..1000 {
        for _ in 0..40 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let i = (state >> 33) as usize % 2980;
            let len = 9 + (state >> 20) as usize % 9;
            let cols: Vec<u32> = (i as u32..(i + len) as u32).collect();
            matrix.set_row(i, &cols, &vec![[[1.0; 3]; 3]; len]).unwrap();
        }
        frozen.refresh(&matrix);
    }
    let fresh = Frozen::<3>::new(&matrix);
    let ratio = frozen.streamed_blocks() as f64 / fresh.streamed_blocks() as f64;
    assert!(ratio < 1.05, "{ratio}");
    // Places that slices left are handed out again.
    assert!(frozen.arena.end() < 3 * fresh.arena.end(), "{} of {}", frozen.arena.end(), fresh.arena.end());
}

#[test]
fn a_refresh_costs_the_rows_that_changed() {
    let mut matrix = band(3000);
    let mut frozen = Frozen::<3>::new(&matrix);
    assert_eq!(frozen.rows_copied(), 3000);
    frozen.refresh(&matrix);
    frozen.refresh(&matrix.clone());
    assert_eq!(frozen.rows_copied(), 3000);
    matrix.add_to_block(17, 18, &[[1.0; 3]; 3]).unwrap();
    matrix.row_mut(1500).1[3][0][0] = 7.0;
    *matrix.get_mut(2999, 2999).unwrap() = [[0.0; 3]; 3];
    frozen.refresh(&matrix);
    assert_eq!(frozen.rows_copied(), 3003);
    // A clone that went another way is another matrix.
    let mut other = matrix.clone();
    other.clear_row(5).unwrap();
    matrix.clear_row(6).unwrap();
    frozen.refresh(&matrix);
    frozen.refresh(&other);
    let x = vec![1.0; 9000];
    let (mut y, mut z) = (vec![0.0; 9000], vec![0.0; 9000]);
    other.apply(&x, &mut y);
    frozen.apply(&x, &mut z);
    assert_eq!(y, z);
}
