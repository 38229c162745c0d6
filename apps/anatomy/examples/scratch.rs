//! scratch
use stylet_anatomy::plan::*;
use stylet_mesh::generate::implicit::Implicit;
use std::ops::ControlFlow;
fn main() {
    let mut args = std::env::args().skip(1);
    let name = args.next().unwrap();
    let scene = if name.ends_with(".toml") { stylet_anatomy::shapes::ShapeScene::read(&name).unwrap() } else { built_in(&name).unwrap().unwrap() };
    let mut plan = Plan::of_shapes(&scene);
    if let Some(size) = args.next() { plan = plan.with_size(size.parse().unwrap()); }
    match plan.mesh(&Effort::default(), &mut |_| ControlFlow::Continue(())) {
        Err(e) => println!("{e}"),
        Ok(made) => {
            println!("{} tets {} nodes, {:?} s\n{:?}\n{:?}", made.tets.cells.len(), made.tets.points.len(), made.seconds, made.straight, made.improved);
            for r in &made.regions { println!("{:24} {:6} {:.4e} {:.4e} {:.2} %", r.name, r.cells, r.volume, r.source_volume, 100.0*(r.volume/r.source_volume-1.0)); }
            println!("{:?} {:?} border {:e}", made.warnings(), made.stuffed.cube, made.stuffed.border_error); let t=println!("{:?} {:?}", made.warnings(), made.stuffed.cube); println!("border {:e}", made.stuffed.border_error); let t = &made.tets; let mut lab=vec![0u8; t.points.len()]; for (c,r) in t.cells.iter().zip(&t.regions) { for v in c { lab[*v as usize] |= 1 << (*r).min(7); } } for (v,l) in lab.iter().enumerate() { if *l==3 { let d=plan.strata.solids()[0].distance(&t.points[v]); if d.abs()>1e-6 { println!("{v} {:?} {d:e}", t.points[v]); } } }
        }
    }
}
