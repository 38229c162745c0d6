use super::*;
use crate::Block;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};
use proptest::prelude::*;

fn block<const B: usize>(entry: impl Fn(usize, usize) -> f64) -> Block<B> {
    std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
}

/// `G Gᵀ + I/10`: symmetric positive definite.
fn spd<const B: usize>() -> impl Strategy<Value = Block<B>> {
    proptest::array::uniform(proptest::array::uniform(-1.0..1.0f64)).prop_map(|g: Block<B>| {
        block(|i, j| (0..B).map(|k| g[i][k] * g[j][k]).sum::<f64>() + if i == j { 0.1 } else { 0.0 })
    })
}

fn constraint<const B: usize>() -> impl Strategy<Value = Constraint<B>> {
    let direction = proptest::array::uniform(-1.0..1.0f64).prop_filter_map("short", |v: [f64; B]| {
        let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        (length > 0.1).then(|| v.map(|x| x / length))
    });
    (0..4, direction).prop_map(|(kind, d)| match kind {
        0 => Constraint::Free,
        1 => Constraint::Fixed,
        2 => Constraint::Line(d),
        _ => Constraint::Plane(d),
    })
}

fn diagonal_matrix<const B: usize>(blocks: &[Block<B>]) -> BlockCsr<B> {
    let mut matrix = BlockCsr::new(blocks.len());
    for (i, block) in blocks.iter().enumerate() {
        matrix.set_row(i, &[i as u32], &[*block]).unwrap();
    }
    matrix
}

/// The nodal matrix of a preconditioner, column by column.
fn nodal<const B: usize>(m: &impl Preconditioner, n: usize, node: usize) -> Block<B> {
    let mut columns = [[0.0; B]; B];
    for (l, column) in columns.iter_mut().enumerate() {
        let (mut r, mut z) = (vec![0.0; n * B], vec![f64::NAN; n * B]);
        r[node * B + l] = 1.0;
        m.apply(&r, &mut z);
        column.copy_from_slice(&z[node * B..][..B]);
    }
    block(|i, j| columns[j][i])
}

/// `M = T (Tᵀ D T)⁻¹ Tᵀ` is the one symmetric matrix with `M = P M` and `M D P = P`.
fn check_restricted_inverse<const B: usize>(m: &Block<B>, d: &Block<B>, c: &Constraint<B>) {
    let unit = |j: usize| std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 });
    let columns: [[f64; B]; B] = std::array::from_fn(|j| c.project(unit(j)));
    let p: Block<B> = block(|i, j| columns[j][i]);
    let product = |a: &Block<B>, b: &Block<B>| block(|i, j| (0..B).map(|k| a[i][k] * b[k][j]).sum());
    let close =
        |a: &Block<B>, b: &Block<B>| a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() <= 1e-11);
    assert!(close(&product(m, &product(d, &p)), &p), "M D P = P fails for {c:?}");
    assert!(close(&product(&p, m), m), "P M = M fails for {c:?}");
    assert!(close(&block(|i, j| m[j][i]), m), "not symmetric for {c:?}");
}

fn check<const B: usize>(blocks: &[Block<B>], first: &[Constraint<B>], second: &[Constraint<B>]) {
    let n = blocks.len();
    let matrix = diagonal_matrix(blocks);
    let mut w = Subspace::new(n);
    for (node, c) in first.iter().enumerate() {
        w.set(node, *c).unwrap();
    }
    let mut jacobi = Jacobi::new(&matrix, &w).unwrap();
    let mut block_jacobi = BlockJacobi::new(&matrix, &w).unwrap();
    let mut following = BlockJacobi::<B>::default();
    following.follow(&matrix, &w).unwrap();
    // Switch the constraints of every other node, as friction does, and update those nodes alone.
    let changed: Vec<usize> = (0..n).step_by(2).collect();
    for &node in &changed {
        w.set(node, second[node]).unwrap();
        jacobi.update_node(&matrix, &w, node).unwrap();
    }
    block_jacobi.update_nodes(&matrix, &w, changed).unwrap();
    following.follow(&matrix, &w).unwrap();
    let (fresh, fresh_block) = (Jacobi::new(&matrix, &w).unwrap(), BlockJacobi::new(&matrix, &w).unwrap());
    for node in 0..n {
        let c = w.get(node);
        let diagonal = block(|i, j| if i == j { blocks[node][i][i] } else { 0.0 });
        check_restricted_inverse(&nodal(&jacobi, n, node), &diagonal, &c);
        check_restricted_inverse(&nodal(&block_jacobi, n, node), &blocks[node], &c);
        assert_eq!(nodal::<B>(&jacobi, n, node), nodal(&fresh, n, node));
        assert_eq!(nodal::<B>(&block_jacobi, n, node), nodal(&fresh_block, n, node));
        assert_eq!(&nodal::<B>(&block_jacobi, n, node), block_jacobi.inverse(node));
        assert_eq!(following.inverse(node), fresh_block.inverse(node));
    }
    // One block is written.
    let mut matrix = matrix;
    let (_, blocks) = matrix.row_mut(n - 1);
    blocks.iter_mut().flatten().flatten().for_each(|x| *x *= 2.0);
    following.follow(&matrix, &w).unwrap();
    let fresh = BlockJacobi::new(&matrix, &w).unwrap();
    (0..n).for_each(|node| assert_eq!(following.inverse(node), fresh.inverse(node)));
}

const N: usize = 6;

proptest! {
    #[test]
    fn inverts_on_the_allowed_moves_1x1(b in proptest::array::uniform6(spd::<1>()),
            c in proptest::array::uniform6(constraint()), d in proptest::array::uniform6(constraint())) {
        check(&b, &c, &d);
    }

    #[test]
    fn inverts_on_the_allowed_moves_2x2(b in proptest::array::uniform6(spd::<2>()),
            c in proptest::array::uniform6(constraint()), d in proptest::array::uniform6(constraint())) {
        check(&b, &c, &d);
    }

    #[test]
    fn inverts_on_the_allowed_moves_3x3(b in proptest::array::uniform6(spd::<3>()),
            c in proptest::array::uniform6(constraint()), d in proptest::array::uniform6(constraint())) {
        check(&b, &c, &d);
    }
}

#[test]
fn a_diagonal_that_is_not_positive_is_named() {
    let mut blocks = vec![[[2.0, 0.0], [0.0, 2.0]]; N];
    let w = Subspace::<2>::new(N);
    for (bad, pivot) in [(0.0, 0.0), (-3.0, -3.0)] {
        blocks[4] = [[2.0, 0.0], [0.0, bad]];
        let matrix = diagonal_matrix(&blocks);
        let error = Err(PreconditionerError::NotPositive { row: 4, pivot });
        assert_eq!(Jacobi::new(&matrix, &w).map(drop), error);
        assert_eq!(BlockJacobi::new(&matrix, &w).map(drop), error);
        // Along a line that avoids the bad direction, or with the node fixed, nothing is wrong.
        for c in [Constraint::Fixed, Constraint::Line([1.0, 0.0]), Constraint::Plane([0.0, 1.0])] {
            let mut w = w.clone();
            w.set(4, c).unwrap();
            assert!(Jacobi::new(&matrix, &w).is_ok());
            assert!(BlockJacobi::new(&matrix, &w).is_ok());
        }
    }
    // Positive diagonal, indefinite block.
    blocks[4] = [[1.0, 2.0], [2.0, 1.0]];
    let matrix = diagonal_matrix(&blocks);
    assert!(Jacobi::new(&matrix, &w).is_ok());
    assert_eq!(BlockJacobi::new(&matrix, &w).map(drop), Err(PreconditionerError::NotPositive { row: 4, pivot: -3.0 }));
    // An empty row.
    assert!(matches!(
        BlockJacobi::new(&BlockCsr::new(1), &Subspace::<2>::new(1)),
        Err(PreconditionerError::NotPositive { row: 0, .. })
    ));
}

#[test]
fn shapes_are_checked() {
    let matrix = diagonal_matrix(&[[[1.0]]; 3]);
    let error = Err(PreconditionerError::Shape { rows: 3, nodes: 2 });
    assert_eq!(Jacobi::new(&matrix, &Subspace::new(2)).map(drop), error);
    assert_eq!(BlockJacobi::new(&matrix, &Subspace::new(2)).map(drop), error);
    let w = Subspace::new(3);
    let out_of_range = Err(PreconditionerError::NodeOutOfRange { node: 3, n_nodes: 3 });
    assert_eq!(Jacobi::new(&matrix, &w).unwrap().update_node(&matrix, &w, 3), out_of_range);
    assert_eq!(BlockJacobi::new(&matrix, &w).unwrap().update_node(&matrix, &w, 3), out_of_range);
}
