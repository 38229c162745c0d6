//! Time of one product `A x` with the 2x2 block matrix of a triangulated square, against scalar CSR of `sprs`.
//!
//! ```text
//! cargo run --release -p stylet-solver --example product_speed
//! ```

use std::hint::black_box;
use std::time::Instant;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::{LinearOperator, vector};

/// Blocks between the vertices of an `n x n` grid whose squares are cut along one diagonal: seven per inner vertex.
fn grid_matrix<const B: usize>(n: usize) -> BlockCsr<B> {
    let mut matrix = BlockCsr::new(n * n);
    for (i, j) in (0..n * n).map(|v| (v / n, v % n)) {
        let offsets = [(-1, -1), (-1, 0), (0, -1), (0, 0), (0, 1), (1, 0), (1, 1)];
        let (mut cols, mut blocks) = (Vec::new(), Vec::new());
        for (di, dj) in offsets {
            let (k, l) = (i as isize + di, j as isize + dj);
            let inside = 0..n as isize;
            if inside.contains(&k) && inside.contains(&l) {
                cols.push((k * n as isize + l) as u32);
                let diagonal = if (di, dj) == (0, 0) { 8.0 } else { -1.0 };
                let entry = |p: usize, q: usize| if p == q { diagonal } else { 0.1 };
                blocks.push(std::array::from_fn(|p| std::array::from_fn(|q| entry(p, q))));
            }
        }
        matrix.set_row(i * n + j, &cols, &blocks).expect("a row of the grid");
    }
    matrix
}

/// Shortest time of one call, in seconds, over batches of at least a millisecond.
fn seconds(mut f: impl FnMut()) -> f64 {
    let start = Instant::now();
    f();
    let per_batch = (1e-3 / start.elapsed().as_secs_f64().max(1e-7)).ceil() as usize;
    let batch = |f: &mut dyn FnMut()| {
        let start = Instant::now();
        for _ in 0..per_batch {
            f();
        }
        start.elapsed().as_secs_f64() / per_batch as f64
    };
    (0..100).map(|_| batch(&mut f)).fold(f64::INFINITY, f64::min)
}

fn measure<const B: usize>(n: usize) {
    let mut matrix = grid_matrix::<B>(n);
    let x: Vec<f64> = (0..matrix.dim()).map(|k| (k % 17) as f64).collect();
    let mut y = vec![0.0; x.len()];
    let blocks = matrix.n_blocks() as f64;

    let apply = seconds(|| matrix.apply(black_box(&x), &mut y));
    let fused = seconds(|| {
        black_box(matrix.apply_dot(black_box(&x), &mut y));
    });
    let dot = seconds(|| {
        black_box(vector::dot(black_box(&x), &y));
    });
    matrix.set_threads(2);
    let two = seconds(|| matrix.apply(black_box(&x), &mut y));

    let (indptr, indices, values) = matrix.to_scalar_csr();
    let scalar = sprs::CsMat::new((x.len(), x.len()), indptr, indices, values);
    let sprs = seconds(|| {
        y.fill(0.0);
        sprs::prod::mul_acc_mat_vec_csr(scalar.view(), black_box(&x[..]), &mut y[..]);
    });
    println!(
        "B={B} rows={:6} blocks={blocks:7}  apply {:8.2} us ({:5.2} ns/block)  apply_dot {:8.2}  dot {:6.2}  \
         two threads {:8.2}  sprs {:8.2} us  ratio {:5.2}",
        matrix.n_rows(),
        apply * 1e6,
        apply / blocks * 1e9,
        fused * 1e6,
        dot * 1e6,
        two * 1e6,
        sprs * 1e6,
        sprs / apply
    );
}

fn main() {
    for n in [17, 33, 65, 129, 257] {
        measure::<2>(n);
    }
    for n in [17, 65, 129] {
        measure::<3>(n);
    }
}
