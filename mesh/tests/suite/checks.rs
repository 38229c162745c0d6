//! Raw mesh checks and repair: every corruption is found and named, a mesh is made exactly of what has no fatal finding,
//! and repairing twice is repairing once.

use crate::support::{Random, start_mesh};
use proptest::prelude::*;
use stylet_mesh::SimplexMesh;
use stylet_mesh::check::{CheckSettings, Finding, Repair, RepairSettings, Report, check, repair};

type Soup<const D: usize, const N: usize> = (Vec<[f64; D]>, Vec<[u32; N]>);

/// A sound mesh as arrays, every cell of positive volume.
fn soup<const D: usize, const N: usize>(kind: u8, seed: u64) -> Soup<D, N> {
    let mesh = start_mesh::<D, N>(kind, seed);
    (mesh.points().to_vec(), mesh.cells().map(|c| mesh.oriented(c).map(|v| v.0)).collect())
}

fn look<const D: usize, const N: usize>((points, cells): &Soup<D, N>) -> Report {
    check(points, cells, &CheckSettings::default())
}

fn kinds(report: &Report) -> Vec<&'static str> {
    report.counts().iter().map(|count| count.0).collect()
}

/// The boundary of the unit cube as triangles that wind alike.
fn surface() -> Soup<3, 3> {
    let (points, cells) = soup::<3, 4>(0, 0);
    let mut facets: Vec<([u32; 3], [u32; 3])> = Vec::new();
    for [a, b, c, d] in cells {
        for facet in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let mut key = facet;
            key.sort_unstable();
            facets.push((key, facet));
        }
    }
    facets.sort_unstable();
    let outer = facets.chunk_by(|f, g| f.0 == g.0).filter(|group| group.len() == 1).map(|group| group[0].1);
    let raw = repair(&points, &outer.collect::<Vec<_>>(), &RepairSettings::default());
    (raw.points, raw.cells)
}

/// Spoils a sound mesh in one way that leaves the other ways alone, and says what should be found.
fn spoil<const D: usize, const N: usize>(
    soup: &mut Soup<D, N>,
    sound: usize,
    way: u8,
    random: &mut Random,
) -> Vec<Finding> {
    let (points, cells) = soup;
    let cell = random.below(sound);
    let (n, id) = (points.len(), cell as u32);
    match way {
        0 => {
            points.push([0.5; D]);
            points[n][random.below(D)] = [f64::NAN, f64::INFINITY, -1e300][random.below(3)];
            let axis = points[n].iter().position(|x| *x != 0.5).unwrap();
            vec![
                Finding::Coordinate { vertex: n as u32, axis, value: points[n][axis] },
                Finding::Unused { vertex: n as u32 },
            ]
        }
        1 => {
            let vertex = (n + random.below(1000)) as u32;
            let mut v = cells[cell];
            v[random.below(N)] = vertex;
            cells.push(v);
            vec![Finding::Index { cell: cells.len() as u32 - 1, vertex, n_vertices: n }]
        }
        2 => {
            let mut v = cells[cell];
            v[0] = v[N - 1];
            cells.push(v);
            vec![Finding::RepeatedVertex { cell: cells.len() as u32 - 1, vertex: v[0] }]
        }
        3 => {
            let mut v = cells[cell];
            v.rotate_left(random.below(N));
            cells.push(v);
            vec![Finding::Duplicate { cell: cells.len() as u32 - 1, of: id }]
        }
        4 => {
            let i = random.below(N - 1);
            cells[cell].swap(i, i + 1);
            vec![Finding::Inverted { cell: id }]
        }
        5 => {
            points.push(random.point());
            vec![Finding::Unused { vertex: n as u32 }]
        }
        _ => {
            // A copy of one cell, far away.
            let mut copy: [u32; N] = std::array::from_fn(|i| (n + i) as u32);
            let far = cells[cell].map(|v| points[v as usize].map(|x| x + 5.0));
            points.extend(far);
            // The cell may be one that was turned over before.
            if stylet_mesh::geometry::signed_measure(&far) < 0.0 {
                copy.swap(0, 1);
            }
            cells.push(copy);
            vec![Finding::Disconnected { cells: vec![cells.len() as u32 - 1] }]
        }
    }
}

fn spoiled_meshes_are_described<const D: usize, const N: usize>(kind: u8, seed: u64, ways: &[u8]) {
    let sound = soup::<D, N>(kind, seed);
    assert!(look(&sound).is_clean(), "{}", look(&sound));
    let (mut spoiled, mut random) = (sound.clone(), Random::new(!seed));
    // One way after the other shifts no ids but may be told apart only if each is used once.
    let mut ways = ways.to_vec();
    ways.sort_unstable();
    ways.dedup();
    let mut expected: Vec<Finding> =
        ways.iter().flat_map(|&way| spoil(&mut spoiled, sound.1.len(), way, &mut random)).collect();
    // Cells named in a count of vertices see the vertices of later ways.
    for finding in &mut expected {
        if let Finding::Index { vertex, n_vertices, cell } = finding {
            *n_vertices = spoiled.0.len();
            if (*vertex as usize) < spoiled.0.len() {
                *vertex = u32::MAX;
                let v = &mut spoiled.1[*cell as usize];
                let at = v.iter().position(|&w| w as usize >= sound.0.len()).unwrap();
                v[at] = u32::MAX;
            }
        }
    }
    let report = look(&spoiled);
    let missing: Vec<&Finding> = expected.iter().filter(|f| !named(&report, f)).collect();
    assert!(missing.is_empty(), "not found: {missing:?} in\n{report}");
    assert_eq!(report.findings.len(), expected.len(), "expected {expected:?}, found\n{report}");
    assert_eq!(report.is_mesh(), !expected.iter().any(Finding::is_fatal));

    let repaired = repair(&spoiled.0, &spoiled.1, &RepairSettings::default());
    let left = check(&repaired.points, &repaired.cells, &CheckSettings::default());
    assert!(left.findings.iter().all(|f| matches!(f, Finding::Disconnected { .. })), "{left}");
    // What was spoiled is gone, what was sound is back up to even permutations.
    for (cell, v) in sound.1.iter().enumerate() {
        let (new, volume) = (repaired.new_cell[cell].unwrap(), |points: &[[f64; D]], v: &[u32; N]| {
            stylet_mesh::geometry::signed_measure(&v.map(|v| points[v as usize]))
        });
        let back = repaired.cells[new as usize];
        assert!(volume(&repaired.points, &back) * volume(&sound.0, v) > 0.0);
        let mut renamed = v.map(|v| repaired.new_vertex[v as usize].unwrap());
        let mut back = back;
        renamed.sort_unstable();
        back.sort_unstable();
        assert_eq!(renamed, back);
    }
}

fn named(report: &Report, finding: &Finding) -> bool {
    match finding {
        // NaN differs from itself.
        Finding::Coordinate { vertex, axis, .. } => report
            .findings
            .iter()
            .any(|f| matches!(f, Finding::Coordinate { vertex: v, axis: a, .. } if v == vertex && a == axis)),
        other => report.findings.contains(other),
    }
}

/// Whatever the arrays hold.
fn any_arrays_are_described<const D: usize, const N: usize>(soup: &Soup<D, N>) -> Result<(), TestCaseError> {
    let report = look(soup);
    let made = SimplexMesh::new(soup.0.clone(), soup.1.clone());
    prop_assert_eq!(made.is_ok(), report.is_mesh(), "{:?}\n{}", made.err(), report);
    prop_assert!(report.to_string().lines().count() == report.findings.len());
    prop_assert_eq!(look(soup).to_string(), report.to_string());

    for merge in [None, Some(0.0), Some(0.3)] {
        let settings = RepairSettings { merge };
        let once = repair(&soup.0, &soup.1, &settings);
        prop_assert_eq!((once.new_vertex.len(), once.new_cell.len()), (soup.0.len(), soup.1.len()));
        prop_assert_eq!(once.of_cells(&once.new_cell).len(), once.cells.len());
        prop_assert_eq!(once.of_vertices(&once.new_vertex).len(), once.points.len());
        let repairable =
            ["coordinate", "index", "repeated vertex", "flat", "duplicate", "inverted", "mirrored", "unused vertex"];
        let left = look(&(once.points.clone(), once.cells.clone()));
        prop_assert!(!kinds(&left).iter().any(|kind| repairable.contains(kind)), "{}", left);
        let twice = repair(&once.points, &once.cells, &settings);
        prop_assert!(twice.repairs.is_empty(), "{:?}", twice.repairs);
        prop_assert_eq!((&twice.points, &twice.cells), (&once.points, &once.cells));
        if !report.findings.iter().any(|f| repairable.contains(&f.kind())) && merge.is_none() {
            prop_assert!(once.repairs.is_empty() && once.points == soup.0 && once.cells == soup.1);
        }
    }
    Ok(())
}

/// Few places and few names, so that everything that can go wrong does.
fn arrays<const D: usize, const N: usize>() -> impl Strategy<Value = Soup<D, N>> {
    let number = prop_oneof![
        20 => (0..4_i8).prop_map(f64::from),
        2 => -1.0..4.0_f64,
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, 1e308, 1e-300, -0.0]),
    ];
    let points = prop::collection::vec(prop::collection::vec(number, D), 1..14);
    let name = prop_oneof![30 => 0..12_u32, 1 => any::<u32>()];
    let cells = prop::collection::vec(prop::collection::vec(name, N), 0..10);
    (points, cells).prop_map(|(points, cells)| {
        let points = points.into_iter().map(|p| p.try_into().unwrap()).collect();
        (points, cells.into_iter().map(|v| v.try_into().unwrap()).collect())
    })
}

/// Part of a sound mesh, with some vertices moved: gaps, pinches, flat and inverted cells.
fn torn<const D: usize, const N: usize>(seed: u64) -> Soup<D, N> {
    let mut random = Random::new(seed);
    let (mut points, mut cells) = soup::<D, N>((seed % 3) as u8, seed);
    cells.retain(|_| random.below(3) > 0);
    for _ in 0..random.below(3) {
        let (at, to) = (random.below(points.len()), random.below(points.len()));
        points[at] = if random.below(2) == 0 { points[to] } else { random.point() };
    }
    (points, cells)
}

proptest! {
    #[test]
    fn spoiled_meshes(kind in 0..3_u8, seed in any::<u64>(), ways in prop::collection::vec(0..7_u8, 1..4)) {
        spoiled_meshes_are_described::<2, 3>(kind, seed, &ways);
        spoiled_meshes_are_described::<3, 4>(kind, seed, &ways);
    }

    #[test]
    fn any_arrays(flat in arrays::<2, 3>(), solid in arrays::<3, 4>(), surface in arrays::<3, 3>(), rod in arrays::<2, 2>()) {
        any_arrays_are_described(&flat)?;
        any_arrays_are_described(&solid)?;
        any_arrays_are_described(&surface)?;
        any_arrays_are_described(&rod)?;
    }

    #[test]
    fn torn_meshes(seed in any::<u64>()) {
        any_arrays_are_described(&torn::<2, 3>(seed))?;
        any_arrays_are_described(&torn::<3, 4>(seed))?;
        any_arrays_are_described(&torn::<4, 5>(seed))?;
    }

    #[test]
    fn windings_are_restored(seed in any::<u64>(), share in 0..50_usize) {
        let mut random = Random::new(seed);
        let (points, mut cells) = surface();
        let flipped: Vec<u32> = (0..cells.len() as u32).filter(|_| random.below(100) < share).collect();
        prop_assume!(2 * flipped.len() < cells.len());
        for &cell in &flipped {
            let i = random.below(2);
            cells[cell as usize].swap(i, i + 1);
        }
        let report = check(&points, &cells, &CheckSettings::default());
        let found: Vec<Finding> = flipped.iter().map(|&cell| Finding::Inverted { cell }).collect();
        prop_assert_eq!(&report.findings, &found);
        let repaired = repair(&points, &cells, &RepairSettings::default());
        let expected: Vec<Repair> =
            if flipped.is_empty() { vec![] } else { vec![Repair::Turned { cells: flipped.clone() }] };
        prop_assert_eq!(&repaired.repairs, &expected);
        prop_assert!(check(&points, &repaired.cells, &CheckSettings::default()).is_clean());
    }
}

#[test]
fn spoiled_meshes_in_four_dimensions() {
    for seed in 0..4 {
        spoiled_meshes_are_described::<4, 5>((seed % 3) as u8, seed, &[0, 1, 2, 3, 4, 5, 6]);
    }
}

#[test]
fn meshes_wound_the_other_way_are_said_to_be_mirrored() {
    let (points, mut cells) = soup::<3, 4>(1, 7);
    cells.iter_mut().skip(1).for_each(|v| v.swap(0, 2));
    let report = check(&points, &cells, &CheckSettings::default());
    assert_eq!(report.findings, [Finding::Inverted { cell: 0 }, Finding::Mirrored { cells: cells.len() - 1 }]);
    let repaired = repair(&points, &cells, &RepairSettings::default());
    assert_eq!(repaired.repairs, [Repair::Turned { cells: (1..cells.len() as u32).collect() }]);
}

#[test]
fn joints_are_named_once() {
    // Three triangles at one edge, two pairs of triangles with a vertex in common.
    let fins: Soup<3, 3> = (
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, -1.0, 0.0]],
        vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]],
    );
    assert_eq!(look(&fins).findings, [Finding::SharedFacet { facet: vec![0, 1], cells: vec![0, 1, 2] }]);
    let bow: Soup<2, 3> = (
        vec![[0.0, 0.0], [1.0, -1.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0]],
        vec![[0, 1, 2], [0, 2, 3], [0, 4, 5], [0, 5, 6]],
    );
    let parts = vec![vec![0, 1], vec![2, 3]];
    assert_eq!(look(&bow).findings, [Finding::Pinched { face: vec![0], parts }]);
    // Two tetrahedra at an edge: its ends are not named.
    let hinge: Soup<3, 4> = (
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [-1.0, -1.0, 0.0]],
        vec![[0, 1, 2, 3], [0, 1, 5, 4]],
    );
    let report = look(&hinge);
    assert!(
        matches!(&report.findings[..], [Finding::Inverted { .. }, Finding::Pinched { face, .. }] if *face == [0, 1])
            || matches!(&report.findings[..], [Finding::Pinched { face, .. }] if *face == [0, 1]),
        "{report}"
    );
    assert_eq!(report.n_parts, 1);
    // Folded over the common edge.
    let folded: Soup<2, 3> = (vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.2, 0.3]], vec![[0, 1, 2], [0, 1, 3]]);
    assert_eq!(look(&folded).findings, [Finding::Overlap { facet: vec![0, 1], cells: [0, 1] }]);
}

#[test]
fn a_strip_with_one_side_cannot_be_oriented() {
    // Six quadrilaterals around, the last joined to the first with a half turn.
    let n = 6;
    let at = |i: usize, top: bool| {
        let (i, top) = if i == n { (0, !top) } else { (i, top) };
        (2 * i + usize::from(top)) as u32
    };
    let place = |i: usize, side: f64| {
        let angle = std::f64::consts::TAU * i as f64 / n as f64;
        let (out, up) = ((0.5 * angle).cos() * side, (0.5 * angle).sin() * side);
        [(2.0 + out) * angle.cos(), (2.0 + out) * angle.sin(), up]
    };
    let points: Vec<[f64; 3]> = (0..n).flat_map(|i| [place(i, -0.5), place(i, 0.5)]).collect();
    let quads = |i: usize| {
        let [a, b, c, d] = [at(i, false), at(i + 1, false), at(i, true), at(i + 1, true)];
        [[a, b, c], [c, b, d]]
    };
    let cells: Vec<[u32; 3]> = (0..n).flat_map(quads).collect();
    let report = check(&points, &cells, &CheckSettings::default());
    assert_eq!(kinds(&report), ["not orientable"], "{report}");
    assert!(report.is_mesh());
    assert!(repair(&points, &cells, &RepairSettings::default()).repairs.is_empty());
    // Cut open it can.
    let report = check(&points, &cells[..10], &CheckSettings::default());
    assert!(report.is_clean(), "{report}");
}

#[test]
fn hanging_vertices_are_named_in_every_dimension() {
    fn halved<const D: usize, const N: usize>() {
        // Bisect one cell of a box without its neighbours: the midpoint of its longest edge hangs on them.
        let (mut points, mut cells) = soup::<D, N>(0, 0);
        let middle = points.len() as u32;
        let v = cells[0];
        let distance = |i: usize, j: usize| {
            let (p, q) = (points[v[i] as usize], points[v[j] as usize]);
            stylet_mesh::geometry::distance2(&p, &q)
        };
        let pairs = || (0..N).flat_map(|j| (0..j).map(move |i| (i, j)));
        let (i, j) = pairs().max_by(|a, b| distance(a.0, a.1).total_cmp(&distance(b.0, b.1))).unwrap();
        let (p, q) = (points[v[i] as usize], points[v[j] as usize]);
        points.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
        cells[0][i] = middle;
        let mut second = v;
        second[j] = middle;
        cells.push(second);
        let report = check(&points, &cells, &CheckSettings::default());
        assert!(report.hanging_searched);
        // Where the boundary is near, its edges are pinched as well.
        let hanging = report.findings.iter().filter(|finding| !matches!(finding, Finding::Pinched { .. }));
        let mut count = 0;
        for finding in hanging {
            let Finding::Hanging { vertex, cell, facet } = finding else { panic!("{report}") };
            assert_eq!((*vertex, facet.len()), (middle, N - 1));
            let named = cells[*cell as usize];
            assert!(facet.contains(&v[i]) && facet.contains(&v[j]) && facet.iter().all(|w| named.contains(w)));
            count += 1;
        }
        // The diagonal lies on as many facets of the cell as there are vertices beside its ends, all of them inside.
        assert_eq!(count, D - 1, "{report}");
    }
    halved::<2, 3>();
    halved::<3, 4>();
    halved::<4, 5>();
}

#[test]
fn vertices_merge_only_on_request() {
    // Two triangles of a soup, as STL has them.
    let soup: Soup<3, 3> = (
        vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0 + 1e-6, 0.0],
        ],
        vec![[0, 1, 2], [3, 4, 5]],
    );
    let report = look(&soup);
    assert_eq!(
        report.findings,
        [Finding::Coincident { vertices: vec![1, 3] }, Finding::Disconnected { cells: vec![1] }]
    );
    assert_eq!(repair(&soup.0, &soup.1, &RepairSettings::default()).repairs, []);
    let exact = repair(&soup.0, &soup.1, &RepairSettings { merge: Some(0.0) });
    assert_eq!(exact.repairs, [Repair::Merged { kept: 1, merged: vec![3] }]);
    assert_eq!(exact.cells, [[0, 1, 2], [1, 3, 4]]);
    let near = repair(&soup.0, &soup.1, &RepairSettings { merge: Some(1e-5) });
    assert_eq!((near.points.len(), near.cells), (4, vec![[0, 1, 2], [1, 3, 2]]));
    assert_eq!(near.new_vertex, [0, 1, 2, 1, 3, 2].map(Some));
}

#[test]
fn a_crowd_of_overlapping_facets_ends_the_search_in_time() {
    let mut random = Random::new(3);
    let n = 3_000;
    let points: Vec<[f64; 3]> = (0..4 * n).map(|_| random.point()).collect();
    let cells: Vec<[u32; 4]> = (0..n).map(|i| [4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3]).collect();
    let report = check(&points, &cells, &CheckSettings::default());
    assert!(!report.hanging_searched);
    assert_eq!(report.n_parts, n as usize);
}

#[test]
fn nothing_is_a_finding_too() {
    let report = check::<2, 3>(&[], &[], &CheckSettings::default());
    assert_eq!((report.findings.as_slice(), report.is_mesh(), report.n_parts), (&[Finding::NoCells][..], false, 0));
    assert_eq!(repair::<2, 3>(&[], &[], &RepairSettings::default()).repairs, []);
}
