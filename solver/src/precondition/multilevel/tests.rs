use super::*;
use crate::Block;
use crate::precondition::Preconditioner;
use crate::precondition::restricted::restricted_inverse;
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};
use crate::team::Team;
use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use proptest::prelude::*;

/// A random matrix on a random hierarchy: the preconditioners are exact for any.
#[derive(Clone, Debug)]
struct Case<const B: usize> {
    a: Mat<f64>,
    w: Subspace<B>,
    nodes: Vec<u32>,
    parents: Vec<[u32; 2]>,
    generations: Vec<u16>,
    r: Vec<f64>,
}

fn case<const B: usize>() -> impl Strategy<Value = Case<B>> {
    (3usize..12).prop_flat_map(|n| {
        let numbers = |len| proptest::collection::vec(-1.0..1.0f64, len);
        let picks = proptest::collection::vec(0usize..1000, 2 * n);
        (Just(n), 2..n, picks, numbers(n * n * B * B), numbers(n * B), proptest::collection::vec(0u8..9, n)).prop_map(
            |(n, start, picks, g, r, kinds)| {
                let m = n * B;
                let a = Mat::from_fn(m, m, |i, j| {
                    (0..m).map(|k| g[i * m + k] * g[j * m + k]).sum::<f64>() + 0.5 * f64::from(i == j)
                });
                let mut w = Subspace::new(n);
                for (node, kind) in kinds.iter().enumerate() {
                    let axis = |k| std::array::from_fn(|i| f64::from(i == k % B));
                    let constraint = match kind {
                        0 => Constraint::Fixed,
                        1 => Constraint::Line(axis(node)),
                        2 => Constraint::Plane(axis(node + 1)),
                        _ => Constraint::Free,
                    };
                    w.set(node, constraint).unwrap();
                }
                let (mut parents, mut generations) = (vec![[0; 2]; start], vec![0u16; start]);
                for p in start..n - 1 {
                    let l = picks[2 * p] % p;
                    let r = (l + 1 + picks[2 * p + 1] % (p - 1)) % p;
                    parents.push([l as u32, r as u32]);
                    generations.push(1 + generations[l].max(generations[r]));
                }
                // The last node is in no hierarchy, unless it is a start node.
                let last = if start == n { n } else { n - 1 };
                parents.resize(n, [0; 2]);
                generations.resize(n, 9);
                let mut r = r;
                w.project(&mut r);
                Case { a, w, nodes: (0..last as u32).rev().collect(), parents, generations, r }
            },
        )
    })
}

impl<const B: usize> Case<B> {
    fn n(&self) -> usize {
        self.parents.len()
    }

    fn matrix(&self) -> BlockCsr<B> {
        let mut matrix = BlockCsr::new(self.n());
        let cols: Vec<u32> = (0..self.n() as u32).collect();
        for i in 0..self.n() {
            let block = |&j: &u32| -> Block<B> {
                std::array::from_fn(|k| std::array::from_fn(|l| self.a[(i * B + k, j as usize * B + l)]))
            };
            let blocks: Vec<Block<B>> = cols.iter().map(block).collect();
            matrix.set_row(i, &cols, &blocks).unwrap();
        }
        matrix
    }

    fn hierarchy(&self) -> BisectionHierarchy {
        BisectionHierarchy::new(self.nodes.iter().copied(), &self.parents, &self.generations).unwrap()
    }

    /// The corrections of the method by definition, each as (basis `E` in the finest space, `E (Eᵀ A E)⁺ Eᵀ`), finest level
    /// first; the last is that of the start nodes.
    fn corrections(&self) -> Vec<Mat<f64>> {
        let m = self.n() * B;
        let mut basis = Mat::<f64>::identity(m, m);
        self.project_columns(&mut basis, 0..self.n());
        let mut corrections: Vec<_> = (0..self.n()).map(|k| self.correction(&basis, k)).collect();
        let top = self.nodes.iter().map(|&p| self.generations[p as usize]).max().unwrap_or(0);
        for generation in (1..=top).rev() {
            let births: Vec<usize> = (0..self.n())
                .filter(|&p| self.nodes.contains(&(p as u32)) && self.generations[p] == generation)
                .collect();
            let parents: Vec<usize> = births.iter().flat_map(|&p| self.parents[p].map(|q| q as usize)).collect();
            let mut seen = vec![];
            for &k in parents.iter().chain(&births) {
                if !seen.contains(&k) {
                    seen.push(k);
                    corrections.push(self.correction(&basis, k));
                }
            }
            for &p in &births {
                for q in self.parents[p] {
                    for (i, k) in (0..m).flat_map(|i| (0..B).map(move |k| (i, k))) {
                        basis[(i, q as usize * B + k)] += 0.5 * basis[(i, p * B + k)];
                    }
                }
            }
            self.project_columns(&mut basis, parents.iter().copied());
        }
        let start: Vec<usize> = (0..self.n()).filter(|&p| self.generations[p] == 0).collect();
        let e = Mat::from_fn(m, start.len() * B, |i, j| basis[(i, start[j / B] * B + j % B)]);
        let mut galerkin = e.transpose() * &self.a * &e;
        for j in 0..start.len() * B {
            // Moves that are not allowed: the basis has no column for them.
            let unit: [f64; B] = std::array::from_fn(|k| f64::from(k == j % B));
            let allowed = self.w.get(start[j / B]).project(unit);
            for k in 0..B {
                galerkin[(j, j / B * B + k)] += unit[k] - allowed[k];
            }
        }
        corrections.push(&e * galerkin.llt(Side::Lower).unwrap().solve(e.transpose()));
        corrections
    }

    /// Columns of a node are combinations along its allowed moves.
    fn project_columns(&self, basis: &mut Mat<f64>, nodes: impl IntoIterator<Item = usize>) {
        for node in nodes {
            for i in 0..basis.nrows() {
                let row: [f64; B] = std::array::from_fn(|k| basis[(i, node * B + k)]);
                for (k, v) in self.w.get(node).project(row).into_iter().enumerate() {
                    basis[(i, node * B + k)] = v;
                }
            }
        }
    }

    fn correction(&self, basis: &Mat<f64>, node: usize) -> Mat<f64> {
        let e = basis.subcols(node * B, B);
        let d = e.transpose() * &self.a * e;
        let d: Block<B> = std::array::from_fn(|i| std::array::from_fn(|j| d[(i, j)]));
        let inverse = restricted_inverse(&d, &self.w.get(node)).unwrap();
        e * Mat::from_fn(B, B, |i, j| inverse[i][j]) * e.transpose()
    }
}

fn applied(m: &impl Preconditioner, r: &[f64]) -> Vec<f64> {
    let mut z = vec![f64::NAN; r.len()];
    m.apply(r, &mut z);
    z
}

fn check<const B: usize>(case: &Case<B>) {
    let corrections = case.corrections();
    let r = Mat::from_fn(case.r.len(), 1, |i, _| case.r[i]);
    let sum = corrections.iter().fold(Mat::zeros(case.r.len(), 1), |z, c| z + c * &r);
    let mut product = Mat::<f64>::zeros(case.r.len(), 1);
    for c in corrections.iter().chain(corrections.iter().rev().skip(1)) {
        product = &product + c * (&r - &case.a * &product);
    }
    let (a, h) = (case.matrix(), case.hierarchy());
    let bpx = applied(&Bpx::new(&a, &case.w, &h).unwrap(), &case.r);
    let v = applied(&VCycle::new(&a, &case.w, &h).unwrap(), &case.r);
    let scale = sum.norm_max() + 1.0;
    for i in 0..case.r.len() {
        assert!((bpx[i] - sum[(i, 0)]).abs() <= 1e-10 * scale, "BPX, entry {i}: {} {}", bpx[i], sum[(i, 0)]);
        assert!((v[i] - product[(i, 0)]).abs() <= 1e-10 * scale, "V-cycle, entry {i}: {} {}", v[i], product[(i, 0)]);
    }
}

proptest! {
    #[test]
    fn both_are_their_definitions_1x1(case in case::<1>()) { check(&case); }

    #[test]
    fn both_are_their_definitions_2x2(case in case::<2>()) { check(&case); }

    #[test]
    fn both_are_their_definitions_3x3(case in case::<3>()) { check(&case); }
}

/// Linear elements on an interval of `2^depth` elements, both ends fixed.
fn interval(depth: u32) -> (BlockCsr<1>, Subspace<1>, BisectionHierarchy) {
    let n = (1usize << depth) + 1;
    let mut a = BlockCsr::new(n);
    for i in 0..n {
        let cols: Vec<u32> = (i.saturating_sub(1)..(i + 2).min(n)).map(|j| j as u32).collect();
        let blocks: Vec<_> = cols.iter().map(|&j| [[if j as usize == i { 2.0 } else { -1.0 }]]).collect();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    let mut w = Subspace::new(n);
    w.set(0, Constraint::Fixed).unwrap();
    w.set(n - 1, Constraint::Fixed).unwrap();
    let (mut parents, mut generations) = (vec![[0; 2]; n], vec![0; n]);
    for i in 1..n as u32 - 1 {
        let step = 1 << i.trailing_zeros();
        parents[i as usize] = [i - step, i + step];
        generations[i as usize] = (depth - i.trailing_zeros()) as u16;
    }
    (a, w, BisectionHierarchy::new(0..n as u32, &parents, &generations).unwrap())
}

#[test]
fn teams_do_not_change_a_bit() {
    let (a, w, h) = interval(14);
    let m = Bpx::new(&a, &w, &h).unwrap();
    let mut r: Vec<f64> = (0..w.dim()).map(|k| (k as f64 * 0.3).sin()).collect();
    w.project(&mut r);
    let serial = applied(&m, &r);
    for threads in [1, 2, 8] {
        let mut z = vec![f64::NAN; r.len()];
        m.apply_on(&Team::new(threads), &r, &mut z);
        assert!(z.iter().zip(&serial).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

#[test]
fn the_size_is_linear_in_the_nodes() {
    let (a, w, h) = interval(14);
    assert_eq!((h.n_generations(), h.start().len()), (14, 2));
    let (bpx, v) = (Bpx::new(&a, &w, &h).unwrap(), VCycle::new(&a, &w, &h).unwrap());
    assert_eq!((bpx.n_levels(), v.n_levels()), (15, 15));
    assert!(bpx.n_corrections() <= 4 * w.n_nodes() && v.n_blocks() <= 12 * w.n_nodes());
}

#[test]
fn a_hierarchy_that_makes_no_sense_is_refused() {
    let parents = [[0, 0], [1, 1], [0, 1], [2, 1]];
    let generations = [0, 0, 1, 2];
    let new = |nodes: &[u32], parents: &[[u32; 2]], generations: &[u16]| {
        BisectionHierarchy::new(nodes.iter().copied(), parents, generations).map(|_| ())
    };
    assert_eq!(new(&[0, 1, 2, 3], &parents, &generations), Ok(()));
    assert_eq!(new(&[0], &parents, &generations[..3]), Err(MultilevelError::Lengths { parents: 4, generations: 3 }));
    assert_eq!(new(&[4], &parents, &generations), Err(MultilevelError::NodeOutOfRange { node: 4, n_nodes: 4 }));
    assert_eq!(new(&[1, 1], &parents, &generations), Err(MultilevelError::Listed { node: 1 }));
    let bad = |node, parents, generation| Err(MultilevelError::Parents { node, parents, generation });
    assert_eq!(new(&[0, 2], &parents, &generations), bad(2, [0, 1], 1)); // parent 1 is not listed
    assert_eq!(new(&[0, 1, 2, 3], &[[0, 0], [1, 1], [1, 1], [2, 1]], &generations), bad(2, [1, 1], 1));
    assert_eq!(new(&[0, 1, 2, 3], &[[0, 0], [1, 1], [0, 9], [2, 1]], &generations), bad(2, [0, 9], 1));
    assert_eq!(new(&[0, 1, 2, 3], &parents, &[0, 0, 2, 2]), bad(3, [2, 1], 2));
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused() {
    let (mut a, w, h) = interval(2);
    let shape = MultilevelError::Shape { rows: 5, nodes: 4, listed: 5 };
    assert_eq!(Bpx::new(&a, &Subspace::new(4), &h).unwrap_err(), shape);
    a.get_mut(1, 1).unwrap()[0][0] = -2.0;
    let error = VCycle::new(&a, &w, &h).unwrap_err();
    assert_eq!(error, MultilevelError::NotPositive { node: 1, level: 0, pivot: -2.0 });
    // Positive on the diagonal, but not between nodes: seen one level on.
    a.get_mut(1, 1).unwrap()[0][0] = 2.0;
    a.get_mut(1, 2).unwrap()[0][0] = -9.0;
    a.get_mut(2, 1).unwrap()[0][0] = -9.0;
    assert!(matches!(Bpx::new(&a, &w, &h), Err(MultilevelError::NotPositive { node: 2, level: 2, .. })));
    // Nothing holds the interval: its start nodes can move together.
    let (mut a, _, h) = interval(2);
    a.get_mut(0, 0).unwrap()[0][0] = 1.0;
    a.get_mut(4, 4).unwrap()[0][0] = 1.0;
    assert!(matches!(Bpx::new(&a, &Subspace::new(5), &h), Err(MultilevelError::Coarse { node: 4, .. })));
}
