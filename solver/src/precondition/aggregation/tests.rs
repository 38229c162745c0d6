use super::aggregates::{Aggregates, NONE};
use super::graph::Graph;
use super::modes::Modes;
use super::tentative::orthonormalise;
use super::two_level::{Form, TwoLevel};
use crate::precondition::projected::Projected;
use crate::precondition::{ChebyshevSettings, Preconditioner, PreconditionerError};
use crate::sparse::BlockCsr;
use crate::subspace::{Constraint, Subspace};
use crate::team::Team;
use crate::vector::norm2;
use crate::{Block, LinearOperator};
use proptest::prelude::*;

/// A graph's Laplacian, plus `shift`.
fn laplacian<const B: usize>(n: usize, edges: &[(usize, usize)], shift: f64) -> BlockCsr<B> {
    let mut dense = vec![0.0; n * n];
    for &(i, j) in edges.iter().filter(|(i, j)| i != j) {
        if dense[i * n + j] == 0.0 {
            (dense[i * n + j], dense[j * n + i]) = (-1.0, -1.0);
            dense[i * n + i] += 1.0;
            dense[j * n + j] += 1.0;
        }
    }
    let mut a = BlockCsr::new(n);
    for i in 0..n {
        dense[i * n + i] += shift;
        let cols: Vec<u32> = (0..n).filter(|j| dense[i * n + j] != 0.0).map(|j| j as u32).collect();
        let block = |j: &u32| -> Block<B> {
            std::array::from_fn(|k| std::array::from_fn(|l| if k == l { dense[i * n + *j as usize] } else { 0.0 }))
        };
        let blocks: Vec<_> = cols.iter().map(block).collect();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    a
}

fn edges() -> impl Strategy<Value = (usize, Vec<(usize, usize)>)> {
    (1usize..60).prop_flat_map(|n| (Just(n), proptest::collection::vec((0..n, 0..n), 0..2 * n)))
}

fn graph_of<const B: usize>(a: &BlockCsr<B>, strength: f64) -> Graph {
    let rows = Projected::<B>::default();
    let serial = Graph::new(&Team::serial(), rows.rows(a), strength);
    assert_eq!(serial, Graph::new(&Team::new(2), rows.rows(a), strength));
    serial
}

/// Nodes with neighbours lie in one aggregate each, others in none; aggregates are connected.
fn check_partition(graph: &Graph, aggregates: &Aggregates) {
    let mut seen = vec![0; graph.n_nodes()];
    for k in 0..aggregates.count() {
        let nodes = aggregates.nodes(k);
        assert!(nodes.is_sorted() && !nodes.is_empty());
        nodes.iter().for_each(|&i| seen[i as usize] += 1);
        assert!(nodes.iter().all(|&i| aggregates.of[i as usize] == k as u32));
        let mut reached = vec![nodes[0]];
        let mut at = 0;
        while let Some(&i) = reached.get(at) {
            let inside = |j: &&u32| aggregates.of[**j as usize] == k as u32 && !reached.contains(j);
            let new: Vec<u32> = graph.neighbours(i as usize).iter().filter(inside).copied().collect();
            reached.extend(new);
            at += 1;
        }
        assert_eq!(reached.len(), nodes.len(), "aggregate {k} is not connected");
    }
    for (i, seen) in seen.into_iter().enumerate() {
        let isolated = graph.neighbours(i).is_empty();
        assert_eq!(seen, usize::from(!isolated));
        assert_eq!(aggregates.of[i] == NONE, isolated);
    }
}

proptest! {
    #[test]
    fn aggregates_divide_the_graph((n, edges) in edges(), count in 1usize..20) {
        let graph = graph_of(&laplacian::<1>(n, &edges, 1.0), 0.0);
        let standard = Aggregates::neighbourhoods(&graph);
        check_partition(&graph, &standard);
        let coupled = (0..n).filter(|&i| !graph.neighbours(i).is_empty()).count();
        prop_assert!(2 * standard.count() <= coupled, "aggregates of one node");
        let balls = Aggregates::balls(&graph, count);
        check_partition(&graph, &balls);
    }

    /// `modes = Q coarse` with orthonormal columns, on any aggregates, flat and single ones included.
    #[test]
    fn modes_are_in_the_range_of_the_tentative_prolongator(
        places in proptest::collection::vec(proptest::array::uniform3(-1.0..1.0f64), 1..40),
        assignment in proptest::collection::vec(0u32..6, 40),
        shape in 0usize..4,
        scale in -4i32..4,
    ) {
        // All of space, a plane, a line, a point; far from the origin or near it.
        let flat = |p: &[f64; 3]| std::array::from_fn(|k| if k + shape < 3 { p[k] * 10f64.powi(scale) } else { 0.7 });
        let places: Vec<[f64; 3]> = places.iter().map(flat).collect();
        let modes = Modes::<3, 6>::rigid(&places).unwrap();
        let aggregates = Aggregates::from_assignment(assignment[..places.len()].to_vec(), 6);
        let constraints = vec![Constraint::Free; places.len()];
        let (mut q, mut coarse) = (Vec::new(), Modes::default());
        orthonormalise(modes.nodal(), &constraints, &aggregates, &mut q, &mut coarse);
        for (node, (q, mode)) in q.iter().zip(modes.nodal()).enumerate() {
            let r = &coarse.nodal()[aggregates.of[node] as usize];
            for k in 0..3 {
                for m in 0..6 {
                    let value: f64 = (0..6).map(|l| q[k][l] * r[l][m]).sum();
                    prop_assert!((value - mode[k][m]).abs() < 1e-12, "{value} {}", mode[k][m]);
                }
            }
        }
        for aggregate in 0..6 {
            for k in 0..6 {
                for m in 0..6 {
                    let rows = aggregates.nodes(aggregate).iter().flat_map(|&i| &q[i as usize]);
                    let value: f64 = rows.map(|row| row[k] * row[m]).sum();
                    let present = coarse.nodal()[aggregate][k][k] != 0.0;
                    let unit = f64::from(k == m && present);
                    prop_assert!((value - unit).abs() < 1e-12, "{k} {m} {value}");
                }
            }
        }
    }

    /// Every node its own aggregate, and modes that span all of its moves: the coarse solve is the solution.
    #[test]
    fn two_levels_of_single_nodes_solve_directly(
        (n, edges) in edges(),
        kinds in proptest::collection::vec(0u8..5, 60),
        numbers in proptest::collection::vec(-1.0..1.0f64, 180),
    ) {
        let a = laplacian::<3>(n, &edges, 0.3);
        let mut w = Subspace::new(n);
        for (node, kind) in kinds[..n].iter().enumerate() {
            w.set(node, match kind {
                0 => Constraint::Fixed,
                1 => Constraint::Line([0.6, 0.0, 0.8]),
                2 => Constraint::Plane([0.0, 0.8, -0.6]),
                _ => Constraint::Free,
            }).unwrap();
        }
        let places: Vec<[f64; 3]> = (0..n).map(|i| std::array::from_fn(|k| numbers[3 * i + k])).collect();
        let smoother = ChebyshevSettings::new(2);
        let modes = Modes::<3, 6>::rigid(&places).unwrap();
        let mut m = TwoLevel::new(&a, &w, modes, Form::VCycle(smoother), None).unwrap();
        m.forget();
        m.rebuild_with(&Team::serial(), &a, &w, &|graph| {
            Aggregates::from_assignment((0..graph.n_nodes() as u32).collect(), graph.n_nodes())
        }).unwrap();
        let mut r = numbers[..3 * n].to_vec();
        w.project(&mut r);
        let (mut z, mut az) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        m.apply(&r, &mut z);
        a.apply(&z, &mut az);
        w.project(&mut az);
        let error: Vec<f64> = az.iter().zip(&r).map(|(az, r)| az - r).collect();
        prop_assert!(norm2(&error) <= 1e-11 * norm2(&r), "{}", norm2(&error));
    }
}

#[test]
fn strength_drops_weak_couplings() {
    // A path whose middle edge is weak.
    let mut a = laplacian::<1>(4, &[(0, 1), (1, 2), (2, 3)], 0.1);
    a.get_mut(1, 2).unwrap()[0][0] = -1e-3;
    a.get_mut(2, 1).unwrap()[0][0] = -1e-3;
    let graph = graph_of(&a, 0.05);
    assert_eq!([graph.neighbours(1), graph.neighbours(2)], [&[0], &[3]]);
    assert_eq!(Aggregates::neighbourhoods(&graph).of, [0, 0, 1, 1]);
    assert_eq!(graph_of(&a, 0.0).neighbours(1), [0, 2]);
}

#[test]
fn coordinates_that_are_not_finite_are_named_and_coincident_ones_are_not_divided_by() {
    for bad in [f64::NAN, f64::INFINITY] {
        let error = Modes::<2, 3>::rigid(&[[0.0, 0.0], [1.0, bad]]).unwrap_err();
        assert_eq!(error, PreconditionerError::Coordinates { node: 1 });
    }
    for places in [vec![[3.0, 4.0]; 5], vec![[1e308, -1e308]; 2], vec![]] {
        let modes = Modes::<2, 3>::rigid(&places).unwrap();
        assert!(modes.nodal().iter().flatten().flatten().all(|v| v.is_finite()));
        assert_eq!(modes.n_nodes(), places.len());
    }
}

/// Constants on a graph without a shift cost nothing: the coarse matrix is singular, and its row is named.
#[test]
fn a_singular_coarse_matrix_is_refused() {
    let edges: Vec<(usize, usize)> = (0..39).map(|i| (i, i + 1)).collect();
    let a = laplacian::<1>(40, &edges, 0.0);
    let error = TwoLevel::new(&a, &Subspace::new(40), Modes::constants(40), Form::Additive, None).unwrap_err();
    assert!(matches!(error, PreconditionerError::Coarse { .. }), "{error}");
}
