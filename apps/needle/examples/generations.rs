//! The insertions of Figure 6.14 beside those with a mesh one generation finer: cells, time, force at the base, and the place
//! that the tip has come to in the tissue.
//!
//! ```text
//! cargo run --release -p stylet-needle --example generations
//! ```

use stylet_needle::{NeedleError, builtin};
use stylet_tissue::Scenario;
use stylet_tissue::summary::Summary;

/// Material and generations of the figure, and the cells that it names.
const PUBLISHED: [(&str, i64, Option<usize>); 3] =
    [("linear", 12, Some(2420)), ("linear", 20, None), ("neo-hookean", 20, Some(29562))];

fn main() -> Result<(), NeedleError> {
    println!("material     fold   cells  published  cycles  seconds  force (N)  tip (mm)");
    let mut seconds = Vec::new();
    for (model, fold, published) in PUBLISHED {
        let (coarse, fine) = (insert(model, fold)?, insert(model, fold + 1)?);
        print_row(model, fold, published, &coarse);
        print_row(model, fold + 1, None, &fine);
        let ([force, tip], [finer_force, finer_tip]) = (force_and_tip(&coarse), force_and_tip(&fine));
        let share = 100.0 * (force / finer_force - 1.0);
        println!("  differs by {share:.1} % in the force and by {:.3} mm in the tip", 1e3 * (tip - finer_tip));
        seconds.push((fold, coarse.wall_s, coarse.elements));
    }
    let [_, (_, linear, cells), (_, neo_hookean, as_many)] = seconds[..] else { return Ok(()) };
    println!("neo-Hookean over linear at 20 generations, {as_many} and {cells} cells: {:.2}", neo_hookean / linear);
    Ok(())
}

fn insert(model: &str, fold: i64) -> Result<Summary, NeedleError> {
    let scene = builtin::open("cube3d-insertion", &[format!("material.model={model}"), format!("mesh.fold={fold}")])?;
    let mut run = scene.start(2)?;
    while !run.finished() {
        run.step()?;
    }
    Ok(run.summary(&[]))
}

/// Force along the needle at its base, N, and depth of the tip in the undeformed tissue, m.
fn force_and_tip(summary: &Summary) -> [f64; 2] {
    summary.needle.as_ref().map_or([f64::NAN; 2], |needle| [needle.base_force[0], needle.tip_reference[0]])
}

fn print_row(model: &str, fold: i64, published: Option<usize>, summary: &Summary) {
    let [force, tip] = force_and_tip(summary);
    let published = published.map_or("-".to_owned(), |cells| cells.to_string());
    let (cells, cycles, seconds) = (summary.elements, summary.steps, summary.wall_s);
    println!(
        "{model:<12} {fold:>4} {cells:>7} {published:>10} {cycles:>7} {seconds:>8.2} {force:>10.3} {:>9.3}",
        1e3 * tip
    );
}
