//! What does it cost to rewrite some rows of a matrix, to let its frozen form follow, and to freeze it from nothing?
//!
//! The rows of the nodes nearest to the first one in number, as those around a needle's tip are; a row is rewritten with
//! its own numbers, or loses its last block and gets it back. Throughput counts rows.
//!
//! ```text
//! cargo bench -p stylet-benches --bench matrix_patch [-- --quick]
//! ```

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;
use stylet_solver::Block;
use stylet_solver::sparse::Frozen;

/// Rows that change at once: about those of thirty tetrahedra.
const ROWS: usize = 24;
/// Parts along the side: 2,744 to 17,576 nodes.
const CUBES: [usize; 2] = [13, 25];

fn patches(c: &mut Criterion) {
    for n in CUBES {
        let mut matrix = support::clamped_cube(n).matrix;
        let mut frozen = Frozen::<3>::new(&matrix);
        let size = matrix.n_rows();
        let first = size / 2;
        let rows: Vec<(usize, Vec<u32>, Vec<Block<3>>)> = (first..first + ROWS)
            .map(|row| {
                let (cols, blocks) = matrix.row(row);
                (row, cols.to_vec(), blocks.to_vec())
            })
            .collect();
        let mut group = c.benchmark_group("matrix_patch");
        group.throughput(Throughput::Elements(ROWS as u64));
        group.bench_function(BenchmarkId::new("numbers", size), |b| {
            b.iter(|| {
                for (row, cols, blocks) in &rows {
                    matrix.set_row(*row, cols, black_box(blocks)).expect("a row of the matrix");
                }
                frozen.refresh(&matrix);
            });
        });
        let mut shorter = false;
        group.bench_function(BenchmarkId::new("pattern", size), |b| {
            b.iter(|| {
                shorter = !shorter;
                for (row, cols, blocks) in &rows {
                    let len = cols.len() - usize::from(shorter);
                    matrix.set_row(*row, &cols[..len], black_box(&blocks[..len])).expect("a row of the matrix");
                }
                frozen.refresh(&matrix);
            });
        });
        group.throughput(Throughput::Elements(size as u64));
        group.bench_function(BenchmarkId::new("freeze", size), |b| b.iter(|| Frozen::<3>::new(black_box(&matrix))));
        group.finish();
    }
}

criterion_group! { name = benches; config = support::criterion(); targets = patches }
criterion_main!(benches);
