//! Times of the parts of a direct solve, for the stiffness of a cube of 13,182 tetrahedra.
//!
//! ```text
//! cargo run --release -p stylet-solver --example direct_speed
//! ```

#[path = "../tests/suite/common/elasticity.rs"]
mod elasticity;

use std::sync::Arc;
use std::time::{Duration, Instant};
use stylet_solver::linear::direct::{Factor, FactorNumber, FillOrder, Method, Symbolic};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Subspace;

/// The shortest of a few runs.
fn time(mut run: impl FnMut()) -> Duration {
    let once = |_| {
        let start = Instant::now();
        run();
        start.elapsed()
    };
    (0..12).map(once).min().unwrap_or_default()
}

fn measure<T: FactorNumber>(name: &str, symbolic: &Arc<Symbolic<3>>, method: Method, a: &BlockCsr<3>) {
    let w = Subspace::new(a.n_rows());
    let mut factor = Factor::<3, T>::new(symbolic.clone(), method, a, &w).expect("positive definite");
    let refactor = time(|| factor.refactor(a, &w).expect("positive definite"));
    let (mut one, mut many) = (vec![1.0; factor.dim()], vec![1.0; 60 * factor.dim()]);
    let solve = time(|| factor.solve(&mut one).expect("finite"));
    one.fill(1.0);
    let batch = time(|| {
        many.fill(1.0);
        factor.solve(&mut many).expect("finite");
    });
    println!("  {name} {method:?}: refactor {refactor:.1?}, solve {solve:.2?}, 60 right sides {batch:.1?}");
}

fn main() {
    let a = elasticity::cube(13, 0.34).a;
    for order in [FillOrder::MinimumDegree, FillOrder::NestedDissection] {
        let start = Instant::now();
        let symbolic = Arc::new(Symbolic::new(&a, order).expect("a symmetric pattern"));
        println!("{order:?}: analysis {:.1?}, {} numbers stored", start.elapsed(), symbolic.stored());
        for method in [Method::Llt, Method::Ldlt] {
            measure::<f64>("f64", &symbolic, method, &a);
            measure::<f32>("f32", &symbolic, method, &a);
        }
    }
}
