//! Thirty tetrahedra change: what the matrix and its frozen form take to follow, and what a thousand changes leave behind.

use super::systems::{SIDE, assembled, jittered_cube, soft};
use super::threads_text;
use crate::timing::{in_turns, median, ratio};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::cell::{Cell, RefCell};
use std::hint::black_box;
use stylet_mesh::SimplexMesh;
use stylet_mesh::random::SplitMix64;
use stylet_solver::LinearOperator;
use stylet_solver::sparse::{BlockCsr, ElementBlocks, ElementContributions, Frozen};
use stylet_solver::team::Team;

/// Tetrahedra of a patch.
const PATCH: usize = 30;

/// A matrix, what it is made of, and its frozen form.
struct Patched {
    matrix: BlockCsr<3>,
    contributions: ElementContributions<3, 4>,
    frozen: Frozen<3>,
}

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let (patches, turns) = if options.quick { (100, 9) } else { (1000, 101) };
    say(&format!("13k: patches of {PATCH} tetrahedra"));
    let mesh = jittered_cube(13);
    let (matrix, contributions) = assembled(&mesh, |_| soft());
    let frozen = Frozen::new(&matrix);
    let mut body = Patched { matrix, contributions, frozen };
    let team = Team::new(options.threads.min(2));
    let patch = cells_near(&mesh, [0.5 * SIDE; 3]);
    cost(&mut body, &patch, &team, turns, report);

    let mut random = SplitMix64::new(7);
    for _ in 0..patches {
        let at = std::array::from_fn(|_| SIDE * random.unit());
        body.cut_and_mend(&cells_near(&mesh, at));
    }
    aged(&body, patches, &team, turns, report);
}

/// The cells whose centres are nearest to a place.
fn cells_near(mesh: &SimplexMesh<3, 4>, at: [f64; 3]) -> Vec<usize> {
    let distance = |corners: [[f64; 3]; 4]| -> f64 {
        (0..3).map(|k| (corners.iter().map(|x| x[k]).sum::<f64>() / 4.0 - at[k]).powi(2)).sum()
    };
    let mut cells: Vec<(f64, usize)> = mesh.cells().map(|cell| (distance(mesh.corners(cell)), cell.index())).collect();
    cells.select_nth_unstable_by(PATCH - 1, |a, b| a.0.total_cmp(&b.0));
    cells[..PATCH].iter().map(|(_, cell)| *cell).collect()
}

impl Patched {
    /// New numbers for the elements that have changed by more than a half, those of `patch`.
    fn replace(&mut self, change: &[f64], patch: &[usize], blocks: &[ElementBlocks<3, 4>]) {
        let new = |element: usize| {
            let place = patch.iter().position(|&other| other == element);
            blocks[place.expect("an element of the patch")]
        };
        self.contributions
            .update_where(&mut self.matrix, |element| change[element], 0.5, new)
            .expect("elements of the body");
    }

    /// Takes the elements out and puts them back: the pattern follows both times.
    fn cut_and_mend(&mut self, patch: &[usize]) {
        let Self { matrix, contributions, frozen } = self;
        let kept: Vec<_> = patch
            .iter()
            .map(|&element| {
                let nodes = *contributions.nodes(element).expect("an element of the body");
                (element, nodes, *contributions.contribution(element).expect("an element of the body"))
            })
            .collect();
        contributions.change(matrix, patch.iter().copied(), []).expect("elements of the body");
        frozen.refresh(matrix);
        contributions.change(matrix, [], kept).expect("elements that were taken out");
        frozen.refresh(matrix);
    }
}

fn cost(body: &mut Patched, patch: &[usize], team: &Team, turns: usize, report: &mut Report) {
    let own: Vec<_> = patch.iter().map(|&e| *body.contributions.contribution(e).expect("an element")).collect();
    let mut softer = own.clone();
    softer
        .iter_mut()
        .for_each(|e| e.as_flattened_mut().as_flattened_mut().as_flattened_mut().iter_mut().for_each(|k| *k *= 0.5));
    let x: Vec<f64> = (0..body.matrix.dim()).map(|i| 1.0 + 1e-3 * (i % 7) as f64).collect();
    let (mut y, mut z) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let mut change = vec![0.0; body.contributions.elements().last().map_or(0, |last| last + 1)];
    patch.iter().for_each(|&element| change[element] = 1.0);
    let body = RefCell::new(body);
    let soft = Cell::new(false);
    let replace = |body: &mut Patched| {
        soft.set(!soft.get());
        body.replace(&change, patch, if soft.get() { &softer } else { &own });
    };
    let times = in_turns(
        turns,
        200e-6,
        &mut [
            &mut || body.borrow().frozen.apply_on(team, black_box(&x), &mut y),
            &mut || body.borrow().frozen.apply(black_box(&x), &mut z),
            &mut || replace(&mut body.borrow_mut()),
            &mut || {
                let body = &mut *body.borrow_mut();
                replace(body);
                body.frozen.refresh(&body.matrix);
            },
            &mut || body.borrow_mut().cut_and_mend(patch),
        ],
    );
    let [product, product_serial, matrix, replaced, both] = &times[..] else { unreachable!("five works") };
    let changed: Vec<f64> = both.iter().map(|seconds| 0.5 * seconds).collect();
    let works = [
        ("30 elements replaced, matrix alone", matrix),
        ("30 elements replaced", replaced),
        ("30 elements removed or inserted", &changed),
    ];
    for (method, times) in works {
        let (seconds, products) = (median(&mut times.to_vec()), ratio(times, product));
        report.rows.push(Row {
            case: "13k, patch".into(),
            method: method.into(),
            threads: 1,
            ok: true,
            seconds: Some(seconds),
            more: Numbers::from([
                ("us", 1e6 * seconds),
                ("products", products),
                ("serial_products", ratio(times, product_serial)),
            ]),
            ..Row::default()
        });
        if !method.contains("alone") {
            let name = format!("{method}, in products on {}", threads_text(team.size()));
            report.figures.push(Figure::at_most(name, products, 2.0));
        }
    }
}

fn aged(body: &Patched, patches: usize, team: &Team, turns: usize, report: &mut Report) {
    let fresh = Frozen::<3>::new(&body.matrix);
    let x: Vec<f64> = (0..body.matrix.dim()).map(|i| 1.0 + 1e-3 * (i % 7) as f64).collect();
    let (mut y, mut z) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let times = in_turns(
        turns,
        500e-6,
        &mut [&mut || body.frozen.apply_on(team, black_box(&x), &mut y), &mut || {
            fresh.apply_on(team, black_box(&x), &mut z)
        }],
    );
    let bytes = body.frozen.bytes_moved() as f64 / fresh.bytes_moved() as f64;
    let time = ratio(&times[0], &times[1]);
    report.rows.push(Row {
        case: "13k, patch".into(),
        method: format!("product after {patches} patches"),
        threads: team.size(),
        ok: y == z,
        seconds: Some(median(&mut times[0].clone())),
        more: Numbers::from([("bytes_of_fresh", bytes), ("time_of_fresh", time)]),
        note: if y == z { String::new() } else { "differs from the product of a fresh matrix".into() },
        ..Row::default()
    });
    report.figures.push(Figure::at_most(format!("bytes after {patches} patches, over a fresh matrix"), bytes, 1.05));
    report.figures.push(Figure::at_most(format!("product after {patches} patches, over a fresh matrix"), time, 1.1));
}
