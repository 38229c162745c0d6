//! A steel needle in the tissue, coupled in null-space form: iterations against those of the tissue alone.

use super::grid::TARGET;
use super::methods::settings;
use super::systems::{Case, SIDE, cube};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::random::SplitMix64;
use stylet_solver::linear::{CgWorkspace, NullSpace, NullSpaceWorkspace, null_space_cg, projected_cg};
use stylet_solver::precondition::BlockJacobi;
use stylet_solver::sparse::{BlockCsr, Frozen};
use stylet_solver::subspace::Constraint;

/// Of steel, Pa.
const YOUNG: f64 = 200e9;
/// Of steel, kg/m³.
const DENSITY: f64 = 7850.0;
/// m.
const RADIUS: f64 = 0.5e-3;
/// Random patterns of sticking, sliding and free nodes, beside all sticking and all sliding.
const PATTERNS: usize = 6;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let steps: &[Option<f64>] = if options.quick { &[Some(1e-3)] } else { &[Some(1e-3), Some(20e-3), None] };
    let mut most: f64 = 0.0;
    for poisson in if options.quick { vec![0.34] } else { vec![0.34, 0.45, 0.49] } {
        let system = cube(13, poisson);
        for &dt in steps {
            if options.stopped() {
                return;
            }
            let case = system.case(dt);
            say(&format!("{}: coupled needle", case.name));
            let row = one(&case, dt);
            most = most.max(if row.ok { row.more["of_alone"] } else { f64::INFINITY });
            report.rows.push(row);
        }
    }
    report.figures.push(Figure::at_most("coupled needle: most iterations over those of the tissue alone", most, 1.1));
}

fn one(case: &Case, dt: Option<f64>) -> Row {
    let row = Row { case: format!("{}, needle", case.name), tolerance: Some(TARGET), threads: 1, ..Row::default() };
    let (a, m) = match BlockJacobi::new(&case.matrix, &case.free) {
        Ok(m) => (Frozen::<3>::new(&case.matrix), m),
        Err(error) => return Row { note: error.to_string(), ..row },
    };
    let mut u = vec![0.0; case.load.len()];
    let alone = projected_cg(&a, &m, &case.free, &case.load, &mut u, &settings(TARGET), &mut CgWorkspace::new());
    let coupled = attached(case, dt).and_then(|(mut form, n)| {
        let zero = vec![0.0; 3 * n];
        let mut ws = NullSpaceWorkspace::new();
        let mut counts = Vec::new();
        for pattern in patterns(n) {
            for (node, free) in pattern.into_iter().enumerate() {
                form.set_free(node, free).map_err(|e| e.to_string())?;
            }
            let (mut u, mut v) = (vec![0.0; case.load.len()], zero.clone());
            let right = (&case.load[..], &zero[..], &zero[..]);
            let report = null_space_cg(&form, &a, &m, right, (&mut u, &mut v), &settings(TARGET), &mut ws);
            counts.push(report.map_err(|e| e.to_string())?.iterations);
        }
        Ok(counts)
    });
    match (alone, coupled) {
        (Err(error), _) => Row { note: error.to_string(), ..row },
        (_, Err(note)) => Row { note, ..row },
        (Ok(alone), Ok(counts)) => {
            let most = counts.iter().copied().max().unwrap_or(0);
            Row {
                ok: true,
                iterations: Some(most as u64),
                more: Numbers::from([
                    ("alone", alone.iterations as f64),
                    ("of_alone", most as f64 / alone.iterations as f64),
                    ("patterns", counts.len() as f64),
                ]),
                ..row
            }
        }
    }
}

/// All sticking, all sliding, and mixtures.
fn patterns(n: usize) -> Vec<Vec<Constraint<3>>> {
    let sliding = Constraint::Line([1.0, 0.0, 0.0]);
    let mut random = SplitMix64::new(11);
    let mut mixed = || match random.next_u64() % 5 {
        0 | 1 => Constraint::Fixed,
        2 | 3 => sliding,
        _ => Constraint::Free,
    };
    let mut all = vec![vec![Constraint::Fixed; n], vec![sliding; n]];
    all.extend((0..PATTERNS).map(|_| (0..n).map(|_| mixed()).collect()));
    all
}

/// A straight needle along the axis whose nodes are the tissue's, and how many they are.
fn attached(case: &Case, dt: Option<f64>) -> Result<(NullSpace<3>, usize), String> {
    let nodes = nodes_near_axis(&case.places);
    let spacing = (case.places[nodes[nodes.len() - 1]][0] - case.places[nodes[0]][0]) / (nodes.len() - 1) as f64;
    let needle = needle(nodes.len(), spacing, dt);
    let attachments = nodes.iter().map(|&node| vec![(node, 1.0)]).collect();
    let free = vec![Constraint::Fixed; nodes.len()];
    let form = NullSpace::new(&case.matrix, &case.free, needle, attachments, &free).map_err(|e| e.to_string())?;
    Ok((form, nodes.len()))
}

/// For places along the axis the nearest nodes, each once.
fn nodes_near_axis(places: &[[f64; 3]]) -> Vec<usize> {
    let nearest = |x: f64| {
        let distance = |p: &[f64; 3]| (p[0] - x).powi(2) + (p[1] - 0.5 * SIDE).powi(2) + (p[2] - 0.5 * SIDE).powi(2);
        (0..places.len()).min_by(|&i, &j| distance(&places[i]).total_cmp(&distance(&places[j]))).unwrap_or(0)
    };
    let mut nodes: Vec<usize> = (0..40).map(|k| nearest(0.95 * SIDE * f64::from(k) / 39.0)).collect();
    nodes.dedup();
    nodes
}

/// A chain of springs, `EA/h` along x and `EI κ² h` across, its first two nodes held by a hand as stiff as one spring; for a
/// time step with its mass.
fn needle(n: usize, h: f64, dt: Option<f64>) -> BlockCsr<3> {
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let (stretch, bend) = (YOUNG * area / h, YOUNG * area * RADIUS * RADIUS / (4.0 * h.powi(3)));
    let (scale, mass) = dt.map_or((1.0, 0.0), |dt| (0.25 * dt * dt, DENSITY * area * h));
    let mut along = vec![vec![0.0; n]; n];
    let mut across = along.clone();
    // The energy of each spring is that of a difference of neighbours.
    let add = |matrix: &mut Vec<Vec<f64>>, first: usize, weights: &[f64], k: f64| {
        for (i, a) in weights.iter().enumerate() {
            for (j, b) in weights.iter().enumerate() {
                matrix[first + i][first + j] += scale * k * a * b;
            }
        }
    };
    (0..n - 1).for_each(|i| add(&mut along, i, &[-1.0, 1.0], stretch));
    (0..n - 2).for_each(|i| add(&mut across, i, &[1.0, -2.0, 1.0], bend));
    for i in 0..2 {
        add(&mut along, i, &[1.0], stretch);
        add(&mut across, i, &[1.0], stretch);
    }
    let mut matrix = BlockCsr::new(n);
    for i in 0..n {
        let near: Vec<usize> = (i.saturating_sub(2)..(i + 3).min(n)).collect();
        let block = |j: usize| {
            let m = if i == j { mass } else { 0.0 };
            let (k, l) = (along[i][j] + m, across[i][j] + m);
            [[k, 0.0, 0.0], [0.0, l, 0.0], [0.0, 0.0, l]]
        };
        let cols: Vec<u32> = near.iter().map(|&j| j as u32).collect();
        let blocks: Vec<_> = near.iter().map(|&j| block(j)).collect();
        matrix.set_row(i, &cols, &blocks).expect("a band");
    }
    matrix
}
