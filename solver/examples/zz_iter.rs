#[path = "../tests/suite/common/elasticity.rs"]
mod elasticity;
use std::time::Instant;
use stylet_solver::LinearOperator;
use stylet_solver::linear::*;
use stylet_solver::precondition::*;
use stylet_solver::sparse::Frozen;
use stylet_solver::stop::*;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
fn best(mut f: impl FnMut(), per: usize) -> f64 {
    (0..200).map(|_| { let s = Instant::now(); for _ in 0..per { f(); } s.elapsed().as_secs_f64() / per as f64 }).fold(f64::INFINITY, f64::min)
}
fn main() {
    let s = elasticity::cube(13, 0.34);
    let w = Subspace::new(s.a.n_rows());
    let (f64s, f32s) = (Frozen::<3>::new(&s.a), Frozen::<3, f32>::new(&s.a));
    let m = BlockJacobi::new(&s.a, &w).unwrap();
    let m32 = BlockJacobi::in_single_precision(&s.a, &w).unwrap();
    let x: Vec<f64> = s.load.clone();
    let x32: Vec<f32> = x.iter().map(|&v| v as f32).collect();
    let (mut y, mut y32) = (vec![0.0; x.len()], vec![0.0f32; x.len()]);
    let (p, q, mut u, mut r) = (x.clone(), x.clone(), x.clone(), x.clone());
    println!("dot {:.2} xpby {:.2} step {:.2} bj {:.2} dot32 {:.2} bj32 {:.2}", 1e6*best(|| _ = std::hint::black_box(stylet_solver::vector::dot(&p, &u)), 20),
     1e6*best(|| stylet_solver::vector::xpby(&p, 0.99, &mut u), 20),
     1e6*best(|| _ = std::hint::black_box(stylet_solver::vector::step_residual(1e-9, &p, &q, &mut u, &mut r)), 20),
     1e6*best(|| m.apply(&p, &mut u), 20),
     1e6*best(|| _ = std::hint::black_box(stylet_solver::vector::dot(&x32, &x32)), 20),
     1e6*best(|| m32.apply(&x32, &mut y32), 20));
    for threads in [1, 2] {
        let team = Team::new(threads);
        let p = best(|| _ = std::hint::black_box(f64s.apply_dot_on(&team, &x, &mut y)), 20);
        let p32 = best(|| _ = std::hint::black_box(f32s.apply_dot_on(&team, &x32, &mut y32)), 20);
        let stop = StopRule { tolerance: 1e-300, criterion: Criterion::External, round_floor: 0.0 };
        let settings = CgSettings { stop: StopRule { tolerance: 1e-9, ..stop }, max_iterations: 20 };
        let mut ws = CgWorkspace::on(&team);
        let mut z = vec![0.0; x.len()];
        let it = best(|| { z.fill(0.0); projected_cg(&f64s, &m, &w, &s.load, &mut z, &settings, &mut ws).unwrap(); }, 1) / 20.0;
        let mut ws = MixedWorkspace::on(&team);
        let it32 = best(|| { z.fill(0.0); mixed_cg(&f64s, &f32s, &m32, &w, &s.load, &mut z, &settings, &mut ws).unwrap(); }, 1) / 20.0;
        println!("{threads}: product {:.1} {:.1}; iteration {:.1} = {:.2}, f32 {:.1} = {:.2} us", p*1e6, p32*1e6, it*1e6, it/p, it32*1e6, it32/p32);
        let mut fr = f64s.clone(); let mut a = s.a.clone();
        let patch = best(|| { for k in 0..60 { let i = 900 + 7 * k; a.row_mut(i); } fr.refresh(&a); }, 5);
        println!("   60 rows {:.1} us", patch*1e6);
    }
}
