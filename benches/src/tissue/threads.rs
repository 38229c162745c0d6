//! `stylet bench threads-tissue`: forces, Jacobian and step by the number of threads, with the bits compared.

use super::{Released, Step, mesh, page, product_seconds, size};
use crate::timing::median;
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::time::Instant;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::LazyRule;
use stylet_solver::partition::partition;
use stylet_solver::team::Team;

/// "Tissue" of Table 2 of the 2009 paper, ms: forces and Jacobian of 13,375 tetrahedra on 1 to 7 threads.
const PUBLISHED_MS: [f64; 7] = [13.4, 7.7, 4.7, 3.9, 3.3, 3.0, 2.2];

/// s.
const DT: f64 = 20e-3;
const DAMPING: f64 = 10e-3;

const ABOUT: &str = "Forces and Jacobian (`F&J`), product and whole step by threads, with rows given to threads by the numbers of \
    their vertices or by METIS. Steps of 20 ms, damping time 10 ms. Published milliseconds are those of Table 2 of Chentanez et al. \
    (2009), for 13,375 tetrahedra on 1 to 7 threads of another machine. The bits of all runs of a rule are compared.";

/// Who sums which rows.
#[derive(Clone, Copy, PartialEq)]
enum Parts {
    /// Vertices cut by their numbers.
    ByNumber,
    /// The parts of METIS, as published.
    Metis,
}

pub(crate) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let mut report = Report::new("threads-tissue", options.threads);
    let mesh = mesh(options.quick);
    let mut threads: Vec<usize> = [1, 2, 4, 8].into_iter().filter(|&n| n <= options.threads).collect();
    if !threads.contains(&options.threads) {
        threads.push(options.threads);
    }
    for rule in [LazyRule::Always, LazyRule::Rotation(1000.0), LazyRule::Stiffness(10.0)] {
        say(&format!("{rule:?}"));
        compare(&mesh, rule, &threads, options, &mut report)?;
    }
    if let Some(folder) = &options.out {
        let page = page::markdown("Threads", ABOUT, &report, options.quick);
        report.write(folder, "threads-tissue.md", &page)?;
    }
    Ok(report)
}

/// One run on one number of threads.
struct Arm {
    threads: usize,
    parts: Parts,
    partition_seconds: f64,
    team: Team,
    released: Released,
    /// Of each step, s: product, forces, Jacobian, whole.
    times: [Vec<f64>; 4],
}

fn compare(
    mesh: &SimplexMesh<3, 4>,
    rule: LazyRule,
    threads: &[usize],
    options: &BenchOptions,
    report: &mut Report,
) -> Result<(), BenchError> {
    let mut arms = Vec::new();
    for &threads in threads {
        for parts in [Parts::ByNumber, Parts::Metis] {
            let team = Team::new(threads);
            let mut plain = Released::new(mesh, DT, DAMPING, rule, None, &team)?;
            let since = Instant::now();
            let owners = match parts {
                Parts::ByNumber => None,
                Parts::Metis => {
                    plain.product();
                    Some(partition(plain.body.stiffness(), threads)?.parts().to_vec())
                }
            };
            let partition_seconds = since.elapsed().as_secs_f64();
            let released = Released::new(mesh, DT, DAMPING, rule, owners.as_deref(), &team)?;
            arms.push(Arm { threads, parts, partition_seconds, team, released, times: Default::default() });
        }
    }
    let frozen = Released::new(mesh, DT, DAMPING, rule, None, &Team::serial())?.product();
    let x = vec![1.0; frozen.n_rows() * 3];
    let mut y = x.clone();
    for arm in &mut arms {
        for _ in 0..size(options.quick).1 {
            if options.stopped() {
                return Ok(());
            }
            let product = product_seconds(&frozen, &arm.team, &x, &mut y);
            let Step { seconds, stages, .. } = arm.released.step()?;
            for (times, t) in arm.times.iter_mut().zip([product, stages[0], stages[1], seconds]) {
                times.push(t);
            }
        }
    }
    rows(rule, &arms, report);
    Ok(())
}

fn rows(rule: LazyRule, arms: &[Arm], report: &mut Report) {
    let name = match rule {
        LazyRule::Rotation(threshold) => format!("lazy, (12) at {threshold}"),
        LazyRule::Stiffness(threshold) => format!("lazy, ours at {threshold} N/m"),
        _ => "all elements".into(),
    };
    let bits = |arm: &Arm| arm.released.state.u.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
    let (first, mut differing) = (bits(&arms[0]), 0);
    let mut alone = [f64::NAN; 4];
    for arm in arms {
        let times = arm.times.clone().map(|mut times| median(&mut times));
        if arm.threads == 1 && arm.parts == Parts::ByNumber {
            alone = times;
        }
        let same = bits(arm) == first;
        differing += usize::from(!same);
        let [product, forces, linearize, whole] = times;
        let mut row = Row {
            case: name.clone(),
            method: if arm.parts == Parts::Metis { "METIS" } else { "by number" }.into(),
            threads: arm.threads,
            ok: same,
            seconds: Some(whole),
            more: Numbers::from([
                ("threads", arm.threads as f64),
                ("F&J_ms", 1e3 * (forces + linearize)),
                ("F&J_speedup", (alone[1] + alone[2]) / (forces + linearize)),
                ("step_speedup", alone[3] / whole),
                ("product_speedup", alone[0] / product),
                ("partition_ms", if arm.parts == Parts::Metis { 1e3 * arm.partition_seconds } else { 0.0 }),
            ]),
            note: if same { String::new() } else { "the bits differ from those of the first run".into() },
            ..Row::default()
        };
        if let (LazyRule::Rotation(_), Some(&ms)) = (rule, PUBLISHED_MS.get(arm.threads - 1)) {
            row.published = [("F&J_ms", ms)].into();
        }
        report.rows.push(row);
    }
    report.figures.push(Figure::at_most(format!("{name}: runs whose bits differ"), differing as f64, 0.0));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_threads_and_parts_gives_the_same_bits() {
        let options = BenchOptions { quick: true, threads: 2, ..BenchOptions::default() };
        let report = run(&options, &mut |_| {}).unwrap();
        assert_eq!(report.rows.len(), 3 * 2 * 2);
        assert!(report.rows.iter().all(|row| row.ok) && report.figures.iter().all(Figure::reached), "{report:?}");
    }
}
