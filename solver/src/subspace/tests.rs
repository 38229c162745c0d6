use super::*;
use proptest::prelude::*;

pub(crate) fn direction<const B: usize>() -> impl Strategy<Value = [f64; B]> {
    proptest::array::uniform(-1.0..1.0f64).prop_filter_map("direction too short", |v: [f64; B]| {
        let length = inner(&v, &v).sqrt();
        (length > 0.1).then(|| v.map(|x| x / length))
    })
}

fn constraint<const B: usize>() -> impl Strategy<Value = Constraint<B>> {
    prop_oneof![
        Just(Constraint::Free),
        Just(Constraint::Fixed),
        direction().prop_map(Constraint::Line),
        direction().prop_map(Constraint::Plane),
    ]
}

fn subspace<const B: usize>(n: usize) -> impl Strategy<Value = Subspace<B>> {
    proptest::collection::vec(constraint(), n).prop_map(move |constraints| {
        let mut w = Subspace::new(n);
        for (node, c) in constraints.into_iter().enumerate() {
            w.set(node, c).unwrap();
        }
        w
    })
}

const N: usize = 9;

fn vector<const B: usize>() -> impl Strategy<Value = Vec<f64>> {
    proptest::collection::vec(-1.0..1.0f64, N * B)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn check_projection<const B: usize>(w: &Subspace<B>, u: &[f64], v: &[f64]) {
    let project = |v: &[f64]| {
        let mut p = v.to_vec();
        w.project(&mut p);
        p
    };
    let (pu, pv) = (project(u), project(v));
    // Idempotent and symmetric: an orthogonal projection.
    for (once, twice) in pv.iter().zip(project(&pv)) {
        assert!((once - twice).abs() <= 4.0 * f64::EPSILON);
    }
    assert!((dot(&pu, v) - dot(u, &pv)).abs() <= 1e-14 * (N * B) as f64);
    // Its trace is the dimension of the subspace.
    let trace: f64 = (0..N * B)
        .map(|k| {
            let mut e = vec![0.0; N * B];
            e[k] = 1.0;
            project(&e)[k]
        })
        .sum();
    assert!((trace - w.dofs() as f64).abs() < 1e-12);
    // The complement is what the projection takes away, and can be given back.
    let mut complement = vec![0.0; B * w.n_constrained()];
    w.project_complement(v, &mut complement);
    let mut split = v.to_vec();
    let mut from_split = complement.clone();
    w.split(&mut split, &mut from_split);
    assert_eq!((&split, &from_split), (&pv, &complement));
    w.add_complement(&complement, &mut split);
    for (a, b) in split.iter().zip(v) {
        assert!((a - b).abs() <= 2.0 * f64::EPSILON);
    }
}

proptest! {
    #[test]
    fn projects_orthogonally_in_2d(w in subspace::<2>(N), u in vector::<2>(), v in vector::<2>()) {
        check_projection(&w, &u, &v);
    }

    #[test]
    fn projects_orthogonally_in_3d(w in subspace::<3>(N), u in vector::<3>(), v in vector::<3>()) {
        check_projection(&w, &u, &v);
    }

    #[test]
    fn follows_a_dense_model(steps in proptest::collection::vec((0usize..20, constraint::<3>()), 0..60)) {
        let (mut w, mut model) = (Subspace::<3>::new(20), vec![Constraint::Free; 20]);
        for (node, c) in steps {
            w.set(node, c).unwrap();
            model[node] = c;
        }
        let listed: Vec<usize> = w.constrained().map(|(node, _)| node).collect();
        let expected: Vec<usize> = (0..20).filter(|&i| model[i] != Constraint::Free).collect();
        prop_assert_eq!(listed, expected);
        prop_assert_eq!(w.dofs(), model.iter().map(Constraint::dofs).sum::<usize>());
        w.resize(10);
        prop_assert_eq!(w.n_constrained(), model[..10].iter().filter(|c| **c != Constraint::Free).count());
        w.resize(20);
        prop_assert_eq!(w.get(15), Constraint::Free);
    }

    #[test]
    fn storing_changes_no_bit(w in subspace::<3>(N)) {
        let bytes = postcard::to_allocvec(&w).unwrap();
        let back: Subspace<3> = postcard::from_bytes(&bytes).unwrap();
        prop_assert_eq!(back, w);
    }
}

#[test]
fn bad_constraints_are_refused_and_leave_no_trace() {
    let mut w = Subspace::<2>::new(3);
    let out_of_range = SubspaceError::NodeOutOfRange { node: 3, n_nodes: 3 };
    assert_eq!(w.set(3, Constraint::Fixed), Err(out_of_range));
    for bad in [[f64::NAN, 0.0], [0.0, 0.0], [1.0, 1.0], [f64::INFINITY, 0.0], [1e200, 0.0]] {
        for constraint in [Constraint::Line(bad), Constraint::Plane(bad)] {
            assert!(matches!(w.set(1, constraint), Err(SubspaceError::NotUnit { node: 1, .. })));
        }
    }
    assert_eq!(w, Subspace::new(3));
    w.set(1, Constraint::Line([0.6 + 1e-8, 0.8])).unwrap();
    let Constraint::Line(t) = w.get(1) else { panic!("not a line") };
    assert!((inner(&t, &t) - 1.0).abs() <= 4.0 * f64::EPSILON);
}

#[test]
fn a_damaged_file_is_refused() {
    let raw = RawSubspace { n_nodes: 2, constrained: vec![(5, RawConstraint::Fixed)] };
    assert!(Subspace::<2>::try_from(raw).unwrap_err().contains("node 5"));
    let raw = RawSubspace { n_nodes: 2, constrained: vec![(0, RawConstraint::Line(vec![1.0]))] };
    assert!(Subspace::<2>::try_from(raw).unwrap_err().contains("1 entries"));
    let raw = RawSubspace { n_nodes: usize::MAX, constrained: vec![] };
    assert!(Subspace::<2>::try_from(raw).is_err());
}
