//! A steel needle in the cube of [`elasticity`](super::elasticity): a chain of stretch and bending springs.

use super::elasticity::{Cube, gradients};
use super::from_dense;
use stylet_solver::linear::Constraints;
use stylet_solver::sparse::BlockCsr;
use stylet_solver::subspace::Constraint;

const YOUNG: f64 = 200e9; // Pa
const RADIUS: f64 = 0.5e-3; // m
const DENSITY: f64 = 7850.0; // kg/m³
const SIDE: f64 = 0.1; // of the cube, m

/// A straight needle along x.
#[derive(Clone, Debug)]
pub struct Needle {
    /// Stiffness, N/m, or `M + dt²/4 K`, kg.
    pub matrix: BlockCsr<3>,
    /// Per node: the cube's nodes around it and its barycentric coordinates; none outside.
    pub attachments: Vec<Vec<(usize, f64)>>,
}

/// Where a needle is attached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mesh {
    /// Nodes on the middle axis, each inside a tetrahedron.
    Inside,
    /// Nodes at nodes of the cube, next to the axis, as after remeshing.
    AtNodes,
}

impl Needle {
    /// Up to `n` nodes, the first outside of the cube and held by a hand as stiff as the needle. `dt` is the time step of Newmark's
    /// rule; without it the needle is in equilibrium.
    pub fn new(cube: &Cube, n: usize, dt: Option<f64>, mesh: Mesh) -> Self {
        let cells = (1..).find(|c| c * (c + 1) * (c + 1) * 3 == cube.load.len()).unwrap();
        let h = SIDE / cells as f64;
        let (mut places, mut attachments) = (vec![[-h, SIDE / 2.0, SIDE / 2.0]], vec![vec![]]);
        if mesh == Mesh::AtNodes {
            let node = |p: usize| (p * (cells + 1) + cells / 2) * (cells + 1) + cells / 2;
            places[0] = [-h, h * (cells / 2) as f64, h * (cells / 2) as f64];
            // Nodes along a mesh line, each once: fewer than `n` where the cube has fewer.
            for k in 0..n - 1 {
                let p = k * (cells - 1) / (n - 2);
                if attachments.last() == Some(&vec![(node(p), 1.0)]) {
                    continue;
                }
                places.push(cube.coordinates[node(p)]);
                attachments.push(vec![(node(p), 1.0)]);
            }
        } else {
            for k in 0..n - 1 {
                let x = 1e-3 + (SIDE - h - 2e-3) * k as f64 / (n - 2) as f64;
                places.push([x, SIDE / 2.0, SIDE / 2.0]);
                attachments.push(locate(cube, cells, places[k + 1]));
            }
        }
        let n = places.len();
        let k = stiffness(&places);
        let mass = DENSITY * std::f64::consts::PI * RADIUS * RADIUS * (places[n - 1][0] - places[0][0]) / n as f64;
        let matrix = from_dense(n, |i, j| match dt {
            Some(dt) => 0.25 * dt * dt * k[i][j] + if i == j { mass } else { 0.0 },
            None => k[i][j],
        });
        Self { matrix: without_zeros(&matrix), attachments }
    }

    pub fn len(&self) -> usize {
        self.attachments.len()
    }

    /// `0` sticks, `1` slides along the needle, anything else or no attachment is free.
    pub fn free(&self, states: &[u8]) -> Vec<Constraint<3>> {
        let state = |(attachment, state): (&Vec<_>, &u8)| match (attachment.is_empty(), state) {
            (false, 0) => Constraint::Fixed,
            (false, 1) => Constraint::Line([1.0, 0.0, 0.0]),
            _ => Constraint::Free,
        };
        self.attachments.iter().zip(states).map(state).collect()
    }
}

/// The matrix of both bodies, the big one's nodes first.
pub fn both<const B: usize>(big: &BlockCsr<B>, small: &BlockCsr<B>) -> BlockCsr<B> {
    let n = big.n_rows();
    let mut a = BlockCsr::new(n + small.n_rows());
    for i in 0..n {
        let (cols, blocks) = big.row(i);
        a.set_row(i, cols, blocks).unwrap();
    }
    for i in 0..small.n_rows() {
        let (cols, blocks) = small.row(i);
        let cols: Vec<u32> = cols.iter().map(|col| col + n as u32).collect();
        a.set_row(n + i, &cols, blocks).unwrap();
    }
    a
}

/// Rows `e·(x_i − Σ w u − g_i) = 0` for the directions `e` in which a node is tied.
pub fn rows<const B: usize>(
    n_big: usize,
    attachments: &[Vec<(usize, f64)>],
    free: &[Constraint<B>],
    g: &[f64],
) -> Constraints {
    let mut c = Constraints::new((n_big + attachments.len()) * B);
    for (i, (attachment, free)) in attachments.iter().zip(free).enumerate() {
        let others = match *free {
            Constraint::Free => Constraint::Fixed,
            Constraint::Fixed => Constraint::Free,
            Constraint::Line(t) => Constraint::Plane(t),
            Constraint::Plane(n) => Constraint::Line(n),
        };
        let (basis, count) = others.basis();
        for e in &basis[..count] {
            let mut row = vec![0.0; c.dim()];
            for k in 0..B {
                row[(n_big + i) * B + k] = e[k];
                attachment.iter().for_each(|(big, weight)| row[big * B + k] -= weight * e[k]);
            }
            let cols: Vec<usize> = (0..row.len()).filter(|k| row[*k] != 0.0).collect();
            let values: Vec<f64> = cols.iter().map(|k| row[*k]).collect();
            c.push(&cols, &values, (0..B).map(|k| e[k] * g[i * B + k]).sum()).unwrap();
        }
    }
    c
}

/// Stretch `EA/l` along x, bending `EI l̄ κ²` across, a spring `EA/l` in all directions at the first two nodes.
fn stiffness(places: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let n = places.len();
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let inertia = area * RADIUS * RADIUS / 4.0;
    let length = |i: usize| places[i + 1][0] - places[i][0];
    let mut k = vec![vec![0.0; 3 * n]; 3 * n];
    for i in 0..n - 1 {
        let s = YOUNG * area / length(i);
        for (a, b, sign) in [(i, i, 1.0), (i, i + 1, -1.0), (i + 1, i, -1.0), (i + 1, i + 1, 1.0)] {
            k[3 * a][3 * b] += sign * s;
        }
    }
    for i in 1..n - 1 {
        let (before, after) = (length(i - 1), length(i));
        let mean = 0.5 * (before + after);
        let curvature = [1.0 / before, -1.0 / before - 1.0 / after, 1.0 / after].map(|c| c / mean);
        for (a, ca) in curvature.iter().enumerate() {
            for (b, cb) in curvature.iter().enumerate() {
                for axis in [1, 2] {
                    k[3 * (i - 1 + a) + axis][3 * (i - 1 + b) + axis] += YOUNG * inertia * mean * ca * cb;
                }
            }
        }
    }
    for (dof, row) in k.iter_mut().enumerate().take(6) {
        row[dof] += YOUNG * area / length(0);
    }
    k
}

fn without_zeros(a: &BlockCsr<3>) -> BlockCsr<3> {
    let mut out = BlockCsr::new(a.n_rows());
    for i in 0..a.n_rows() {
        let (cols, blocks) = a.row(i);
        let kept = cols.iter().zip(blocks).filter(|(_, b)| b.as_flattened().iter().any(|v| *v != 0.0));
        let (cols, blocks): (Vec<u32>, Vec<_>) = kept.map(|(c, b)| (*c, *b)).unzip();
        out.set_row(i, &cols, &blocks).unwrap();
    }
    out
}

/// The tetrahedron around a place, as nodes and barycentric coordinates.
fn locate(cube: &Cube, cells: usize, place: [f64; 3]) -> Vec<(usize, f64)> {
    let n = cells + 1;
    for cell in 0..(cells - 1) * cells * cells {
        let base = [cell / (cells * cells), cell / cells % cells, cell % cells];
        for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let (mut corner, mut tet) = (base, [0; 4]);
            tet[0] = (corner[0] * n + corner[1]) * n + corner[2];
            for (k, axis) in order.into_iter().enumerate() {
                corner[axis] += 1;
                tet[k + 1] = (corner[0] * n + corner[1]) * n + corner[2];
            }
            let x = tet.map(|v| cube.coordinates[v]);
            let (g, _) = gradients(x);
            let weight =
                |a: usize| -> f64 { f64::from(a == 0) + (0..3).map(|k| g[a][k] * (place[k] - x[0][k])).sum::<f64>() };
            if (0..4).all(|a| weight(a) >= -1e-12) {
                return (0..4).map(|a| (tet[a], weight(a))).collect();
            }
        }
    }
    panic!("{place:?} lies outside of the cube's free nodes");
}
