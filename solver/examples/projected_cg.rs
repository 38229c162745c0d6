//! A stretched net: `min ½ xᵀA x − bᵀx` over the moves that the constraints allow.
//!
//! ```text
//!   |o--o--o--o          o  node with two displacements, springs between neighbours
//!   |o--o--o--o  -> b    |  fixed side
//!   |o--=--=--o          =  nodes that slide along a line
//! ```
//!
//! Prints iterations and the time per iteration for each preconditioner:
//!
//! ```text
//! cargo run --release -p stylet-solver --example projected_cg
//! ```

use std::time::Instant;
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::precondition::{BlockJacobi, Identity, Jacobi, Preconditioner};
use stylet_solver::sparse::BlockCsr;
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};

/// Springs along the edges of an `n x n` grid, diagonals included, so that the net resists shear.
fn net(n: usize) -> BlockCsr<2> {
    let mut a = BlockCsr::new(n * n);
    let directions = [(-1, -1), (-1, 0), (0, -1), (0, 0), (0, 1), (1, 0), (1, 1)];
    for (i, j) in (0..n * n).map(|v| (v / n, v % n)) {
        let (mut cols, mut blocks) = (Vec::new(), Vec::new());
        let mut diagonal = [[0.0; 2]; 2];
        for (di, dj) in directions {
            let (k, l) = (i as isize + di, j as isize + dj);
            if (0..n as isize).contains(&k) && (0..n as isize).contains(&l) {
                let (dx, dy) = (dj as f64, di as f64);
                let length2 = dx * dx + dy * dy;
                let spring = if length2 == 0.0 {
                    [[0.0; 2]; 2]
                } else {
                    [[dx * dx / length2, dx * dy / length2], [dx * dy / length2, dy * dy / length2]]
                };
                for p in 0..2 {
                    for q in 0..2 {
                        diagonal[p][q] += spring[p][q];
                    }
                }
                cols.push((k * n as isize + l) as u32);
                blocks.push(spring.map(|row| row.map(|s| -s)));
            }
        }
        let own = cols.iter().position(|&c| c as usize == i * n + j).expect("the grid holds its own node");
        blocks[own] = diagonal;
        a.set_row(i * n + j, &cols, &blocks).expect("a row of the grid");
    }
    a
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for n in [17, 65, 129] {
        let a = net(n);
        let mut w = Subspace::new(n * n);
        for i in 0..n {
            w.set(i * n, Constraint::Fixed)?;
        }
        for j in 1..n / 2 {
            w.set(n / 2 * n + j, Constraint::Line([0.8, 0.6]))?;
        }
        let mut b = vec![0.0; 2 * n * n];
        b[2 * (n * n / 2 + n - 1)] = 1.0;
        let preconditioners: [(&str, Box<dyn Preconditioner>); 3] = [
            ("none", Box::new(Identity)),
            ("Jacobi", Box::new(Jacobi::new(&a, &w)?)),
            ("block Jacobi", Box::new(BlockJacobi::new(&a, &w)?)),
        ];
        let stop = StopRule { tolerance: 1e-4, criterion: Criterion::Reaction, round_floor: 0.0 };
        let settings = CgSettings { stop, max_iterations: 10_000 };
        let mut ws = CgWorkspace::new();
        for (name, m) in &preconditioners {
            let mut best = f64::INFINITY;
            let mut iterations = 0;
            for _ in 0..5 {
                let mut x = vec![0.0; b.len()];
                let start = Instant::now();
                let report = projected_cg(&a, m.as_ref(), &w, &b, &mut x, &settings, &mut ws)?;
                iterations = report.iterations;
                best = best.min(start.elapsed().as_secs_f64() / iterations as f64);
            }
            println!("{:6} nodes  {name:12}  {iterations:5} iterations  {:7.2} us each", n * n, best * 1e6);
        }
    }
    Ok(())
}
