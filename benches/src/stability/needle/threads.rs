//! The bits of an insertion on 1, 2 and 8 threads, and of the same again (J12).

use super::{FORCES, named, scene};
use crate::insertion::setup::{BEVEL, FRAME, Leg, Numerics, SPEED, Scene, wire};
use crate::{BenchError, BenchOptions, Figure, Numbers, Report, Row};
use std::ops::ControlFlow;
use stylet_solver::team::Team;

/// The first is run again at the end.
const THREADS: [usize; 4] = [1, 2, 8, 1];

pub(in crate::stability) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    // Large enough that threads share the work.
    let (cells, cycles) = if options.quick { (8, 1) } else { (8, 5) };
    let name = named("J12 1, 2, 8 threads, flexible needle", "fixed-corotated", 0.45);
    say(&name);
    let ends: Result<Vec<(u64, Vec<u64>)>, BenchError> =
        THREADS.iter().map(|&threads| end(cells, cycles, threads)).collect();
    let mut row = Row { case: name, threads: 8, ..Row::default() };
    match ends {
        Err(error) => row.note = error.to_string(),
        Ok(ends) => {
            let differing = ends.iter().filter(|end| end.1 != ends[0].1).count();
            row.ok = differing == 0;
            row.more = Numbers::from([
                ("steps", ends[0].0 as f64),
                ("runs", ends.len() as f64),
                ("differing", differing as f64),
            ]);
        }
    }
    report.figures.push(Figure::at_most(
        "J12: runs of a needle whose bits differ, or fail",
        f64::from(u8::from(!row.ok)),
        0.0,
    ));
    report.rows.push(row);
}

/// Steps, and the bits of all that moves after them.
fn end(cells: usize, cycles: usize, threads: usize) -> Result<(u64, Vec<u64>), BenchError> {
    let legs = [Leg::insert(0.04, SPEED), Leg::insert(-0.03, SPEED), Leg::insert(-0.01, SPEED)].repeat(cycles);
    let scene = Scene { needle: wire(super::ENTRY, BEVEL), ..scene(cells, 0.45, FORCES, legs) };
    let mut run = scene.start(&Numerics::default(), &Team::new(threads))?;
    let mut steps = 0;
    scene.follow(&mut run, FRAME, |_, _, _| {
        steps += 1;
        ControlFlow::Continue(())
    })?;
    let (state, shaft) = (run.state(), &run.needles()[0].shaft);
    let all = [&state.u, &state.v, &state.a, &shaft.x, &shaft.v, &shaft.a];
    Ok((steps, all.into_iter().flatten().map(|x| x.to_bits()).collect()))
}
