//! What memory allows, and what products and iterations take.

use super::methods::settings;
use super::systems::cube;
use super::threads_text;
use super::triad::Triad;
use crate::timing::{in_turns, median, ratio};
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use std::hint::black_box;
use stylet_solver::LinearOperator;
use stylet_solver::linear::{CgSettings, CgWorkspace, MixedWorkspace, mixed_cg, projected_cg};
use stylet_solver::precondition::BlockJacobi;
use stylet_solver::sparse::Frozen;
use stylet_solver::team::Team;

/// A time of an iteration is the difference of a long and a short solve, over the difference of their iterations.
const ITERATIONS: [usize; 2] = [10, 60];

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let sizes: &[usize] = if options.quick { &[13] } else { &[13, 36] };
    for &cells in sizes {
        for threads in [1, 2].into_iter().filter(|&threads| threads <= options.threads) {
            if options.stopped() {
                return;
            }
            let turns = match (options.quick, cells) {
                (true, _) => 9,
                (false, 13) => 101,
                (false, _) => 15,
            };
            let size = if cells == 13 { "13k" } else { "280k" };
            say(&format!("{size}: products and iterations, {}", threads_text(threads)));
            one(size, cells, threads, turns, report);
        }
    }
}

fn one(size: &str, cells: usize, threads: usize, turns: usize, report: &mut Report) {
    let case = cube(cells, 0.34).case(None);
    let team = Team::new(threads);
    let n = case.load.len();
    let (a, a32) = (Frozen::<3>::new(&case.matrix), Frozen::<3, f32>::new(&case.matrix));
    let scalar = sprs::CsMat::<f64>::from(&case.matrix);
    let x: Vec<f64> = (0..n).map(|i| 1.0 + 1e-3 * (i % 7) as f64).collect();
    let x32: Vec<f32> = x.iter().map(|&x| x as f32).collect();
    let (mut y, mut y32) = (vec![0.0; n], vec![0.0_f32; n]);
    let (mut y_dynamic, mut y_sprs) = (y.clone(), y.clone());
    let mut triad = Triad::new(&team, a.bytes_moved());
    let mut triad32 = Triad::new(&team, a32.bytes_moved());

    let (m, m32) = (
        BlockJacobi::new(&case.matrix, &case.free).expect("positive definite"),
        BlockJacobi::in_single_precision(&case.matrix, &case.free).expect("positive definite"),
    );
    let (mut ws, mut ws32) = (CgWorkspace::on(&team), MixedWorkspace::on(&team));
    let mut u = vec![0.0; n];
    let mut u32 = u.clone();
    // Far from converged after these iterations, and not so tight that the solver checks its recurrence.
    let stop = settings(1e-5).stop;
    let mut pcg = |max_iterations: usize| {
        u.fill(0.0);
        let settings = CgSettings { stop, max_iterations };
        let report = projected_cg(&a, &m, &case.free, &case.load, &mut u, &settings, &mut ws);
        assert_eq!(report.expect("a sound system").iterations, max_iterations);
    };
    let mut mixed = |max_iterations: usize| {
        u32.fill(0.0);
        let settings = CgSettings { stop, max_iterations };
        let report = mixed_cg(&a, &a32, &m32, &case.free, &case.load, &mut u32, &settings, &mut ws32);
        assert_eq!(report.expect("a sound system").iterations, max_iterations);
    };
    let pcg = std::cell::RefCell::new(&mut pcg);
    let mixed = std::cell::RefCell::new(&mut mixed);
    let [few, many] = ITERATIONS;

    let times = in_turns(
        turns,
        500e-6,
        &mut [
            &mut || triad.run(),
            &mut || triad32.run(),
            &mut || a.apply_on(&team, black_box(&x), &mut y),
            &mut || a32.apply_on(&team, black_box(&x32), &mut y32),
            &mut || case.matrix.apply_on(&team, black_box(&x), &mut y_dynamic),
            &mut || {
                y_sprs.fill(0.0);
                sprs::prod::mul_acc_mat_vec_csr(scalar.view(), black_box(&x[..]), &mut y_sprs[..]);
            },
            &mut || (pcg.borrow_mut())(few),
            &mut || (pcg.borrow_mut())(many),
            &mut || (mixed.borrow_mut())(few),
            &mut || (mixed.borrow_mut())(many),
        ],
    );
    let [triad, triad32, product, product32, dynamic, sprs, few, many, few32, many32] = &times[..] else {
        unreachable!("ten works")
    };
    let iteration = |few: &[f64], many: &[f64]| -> Vec<f64> {
        let [short, long] = ITERATIONS;
        many.iter().zip(few).map(|(many, few)| (many - few) / (long - short) as f64).collect()
    };
    let (pcg, pcg32) = (iteration(few, many), iteration(few32, many32));

    let (bytes, bytes32) = (a.bytes_moved() as f64, a32.bytes_moved() as f64);
    let rows: [(&str, &[f64], f64, &[f64]); 8] = [
        ("triad of the bytes of f64", triad, bytes, triad),
        ("triad of the bytes of f32", triad32, bytes32, triad32),
        ("product, frozen f64", product, bytes, triad),
        ("product, frozen f32", product32, bytes32, triad32),
        ("product, dynamic f64", dynamic, bytes, triad),
        ("product, sprs f64, one thread", sprs, bytes, triad),
        ("block-Jacobi PCG iteration, f64", &pcg, bytes, triad),
        ("block-Jacobi PCG iteration, f32", &pcg32, bytes32, triad32),
    ];
    for (method, times, bytes, triad) in rows {
        let seconds = median(&mut times.to_vec());
        report.rows.push(Row {
            case: format!("{size}, kernels"),
            method: method.into(),
            threads,
            ok: true,
            seconds: Some(seconds),
            more: Numbers::from([
                ("us", 1e6 * seconds),
                ("mb", 1e-6 * bytes),
                ("gb_s", 1e-9 * bytes / seconds),
                ("per_triad", ratio(times, triad)),
            ]),
            ..Row::default()
        });
    }
    if threads != 2 {
        return;
    }
    let figures = &mut report.figures;
    if cells == 13 {
        figures.push(Figure::at_most("13k product f64, over the triad of its bytes", ratio(product, triad), 1.5));
        figures.push(Figure::plain("13k product f32, over the triad of its bytes", ratio(product32, triad32)));
        figures.push(Figure::at_least("13k product f64, times faster than sprs", ratio(sprs, product), 10.0));
        figures.push(Figure::at_most("13k product, f32 over f64", ratio(product32, product), 0.8));
        figures.push(Figure::at_most("13k PCG iteration over its product, f64", ratio(&pcg, product), 1.6));
        figures.push(Figure::at_most("13k PCG iteration over its product, f32", ratio(&pcg32, product32), 1.8));
    } else {
        figures.push(Figure::at_most("280k product, f32 over f64", ratio(product32, product), 0.55));
        figures.push(Figure::plain("280k product f64, over the triad of its bytes", ratio(product, triad)));
        figures.push(Figure::plain("280k PCG iteration over its product, f64", ratio(&pcg, product)));
    }
}
