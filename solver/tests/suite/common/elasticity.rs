//! Linear elasticity of a cube, assembled from indices alone: the solver knows no mesh, and its tests need a real matrix.
#![allow(dead_code)] // each program that shares this file uses its part

use stylet_solver::Block;
use stylet_solver::sparse::BlockCsr;

/// A cube of tetrahedra, clamped on the face `x = side`.
#[derive(Clone, Debug)]
pub struct Cube {
    /// Stiffness of the free nodes, N/m.
    pub a: BlockCsr<3>,
    /// Places of the free nodes, m.
    pub coordinates: Vec<[f64; 3]>,
    /// Gravity along -y, 2 N along +x shared by the nodes near the axis, N.
    pub load: Vec<f64>,
    /// Lumped masses, kg, one per free node.
    pub masses: Vec<f64>,
}

/// `cells` a side, six Kuhn tetrahedra each, side 0.1 m, inner nodes moved by up to 15 % of a cell, E = 34 kPa,
/// 1000 kg/m³: the model system "13k" has 13 cells, "280k" has 36.
pub fn cube(cells: usize, poisson: f64) -> Cube {
    cube_with(cells, poisson, |_| 1.0)
}

/// As [`cube`], the stiffness of each tetrahedron scaled by a factor that depends on its centre.
pub fn cube_with(cells: usize, poisson: f64, scale: impl Fn([f64; 3]) -> f64) -> Cube {
    cube_turned(cells, poisson, scale, |_| 0.0)
}

/// As [`cube_with`], each tetrahedron turned about the z axis by an angle that depends on its centre: `R K Rᵀ`, the stiffness of
/// a bent body in corotational elasticity.
pub fn cube_turned(
    cells: usize,
    poisson: f64,
    scale: impl Fn([f64; 3]) -> f64,
    angle: impl Fn([f64; 3]) -> f64,
) -> Cube {
    let (young, density, side) = (34e3, 1000.0, 0.1);
    let mu = young / (2.0 * (1.0 + poisson));
    let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let n = cells + 1;
    let id = |p: [usize; 3]| (p[0] * n + p[1]) * n + p[2];
    let h = side / cells as f64;
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let mut places = Vec::new();
    for k in 0..n * n * n {
        let p = [k / (n * n), k / n % n, k % n];
        let inner = p.iter().all(|&c| c > 0 && c < cells);
        places.push(p.map(|c| h * (c as f64 + if inner { 0.15 * random() } else { 0.0 })));
    }
    // Nodes of the clamped face come last: their rows are left out.
    let n_free = cells * n * n;
    let mut rows: Vec<Vec<(u32, Block<3>)>> = vec![Vec::new(); n_free];
    let mut load = vec![0.0; 3 * n_free];
    let mut masses = vec![0.0; n_free];
    for cell in 0..cells * cells * cells {
        let base = [cell / (cells * cells), cell / cells % cells, cell % cells];
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut corner = base;
            let mut tet = [id(base); 4];
            for (k, axis) in order.into_iter().enumerate() {
                corner[axis] += 1;
                tet[k + 1] = id(corner);
            }
            let (gradients, volume) = gradients(tet.map(|v| places[v]));
            let centre = std::array::from_fn(|k| tet.iter().map(|&v| places[v][k]).sum::<f64>() / 4.0);
            let factor = volume * scale(centre);
            let gradients = gradients.map(|g| turn(g, angle(centre)));
            for (a, &i) in tet.iter().enumerate() {
                if i >= n_free {
                    continue;
                }
                masses[i] += density * volume / 4.0;
                load[3 * i + 1] -= 9.81 * density * volume / 4.0;
                for (b, &j) in tet.iter().enumerate() {
                    if j < n_free {
                        add(&mut rows[i], j as u32, &stiffness(&gradients[a], &gradients[b], factor, lambda, mu));
                    }
                }
            }
        }
    }
    let near: Vec<usize> = (0..n_free)
        .filter(|&i| {
            let [x, y, z] = places[i];
            (y - side / 2.0).hypot(z - side / 2.0) <= 5e-3 && x < 0.07
        })
        .collect();
    for &i in &near {
        load[3 * i] += 2.0 / near.len() as f64;
    }
    let mut a = BlockCsr::new(n_free);
    for (i, row) in rows.iter_mut().enumerate() {
        row.sort_by_key(|(j, _)| *j);
        let (cols, blocks): (Vec<u32>, Vec<Block<3>>) = row.iter().copied().unzip();
        a.set_row(i, &cols, &blocks).unwrap();
    }
    places.truncate(n_free);
    Cube { a, coordinates: places, load, masses }
}

impl Cube {
    /// `M + dt²/4 K` with the lumped mass.
    pub fn dynamic(&self, dt: f64) -> BlockCsr<3> {
        let mut a = self.a.clone();
        for i in 0..a.n_rows() {
            let (cols, blocks) = a.row_mut(i);
            let diagonal = cols.binary_search(&(i as u32)).unwrap();
            for block in blocks.iter_mut() {
                block.as_flattened_mut().iter_mut().for_each(|v| *v *= 0.25 * dt * dt);
            }
            (0..3).for_each(|k| blocks[diagonal][k][k] += self.masses[i]);
        }
        a
    }
}

fn add(row: &mut Vec<(u32, Block<3>)>, j: u32, block: &Block<3>) {
    let Some((_, sum)) = row.iter_mut().find(|(col, _)| *col == j) else {
        return row.push((j, *block));
    };
    for (sum, value) in sum.as_flattened_mut().iter_mut().zip(block.as_flattened()) {
        *sum += value;
    }
}

/// `v` turned about the z axis. `K_ab` is isotropic in its gradients: turning them turns the block from both sides.
pub fn turn([x, y, z]: [f64; 3], angle: f64) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    [cos * x - sin * y, sin * x + cos * y, z]
}

/// `V [λ g_a g_bᵀ + μ g_b g_aᵀ + μ (g_a·g_b) I]`.
fn stiffness(a: &[f64; 3], b: &[f64; 3], volume: f64, lambda: f64, mu: f64) -> Block<3> {
    let inner: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
    std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            volume * (lambda * a[i] * b[j] + mu * b[i] * a[j] + if i == j { mu * inner } else { 0.0 })
        })
    })
}

/// Gradients of the hat functions, and the volume.
pub(super) fn gradients(x: [[f64; 3]; 4]) -> ([[f64; 3]; 4], f64) {
    let e: [[f64; 3]; 3] = std::array::from_fn(|k| std::array::from_fn(|c| x[k + 1][c] - x[0][c]));
    let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let det: f64 = (0..3).map(|k| e[0][k] * cross(e[1], e[2])[k]).sum();
    let g: [[f64; 3]; 3] = std::array::from_fn(|k| cross(e[(k + 1) % 3], e[(k + 2) % 3]).map(|v| v / det));
    let first = std::array::from_fn(|c| -(g[0][c] + g[1][c] + g[2][c]));
    ([first, g[0], g[1], g[2]], det.abs() / 6.0)
}

#[test]
fn the_model_system_has_the_published_size_and_is_in_balance() {
    let s = cube(13, 0.34);
    assert_eq!((s.a.n_rows(), s.a.n_blocks()), (2548, 33_902));
    assert!(s.a.asymmetry() < 1e-10);
    // A rigid move costs nothing at nodes that are not next to the clamped face.
    let x: Vec<f64> = s.coordinates.iter().flat_map(|p| [1.0 - p[1], p[0], 2.0]).collect();
    let mut y = vec![0.0; x.len()];
    stylet_solver::LinearOperator::apply(&s.a, &x, &mut y);
    let far = 3 * 14 * 14 * 11;
    assert!(y[..far].iter().all(|v| v.abs() < 1e-8), "{:?}", y[..far].iter().fold(0.0f64, |m, v| m.max(v.abs())));
    let weight: f64 = s.load.chunks(3).map(|f| f[1]).sum();
    assert!(weight < -9.0 && weight > -9.81);
    assert!((s.load.chunks(3).map(|f| f[0]).sum::<f64>() - 2.0).abs() < 1e-12);
}
