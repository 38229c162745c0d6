//! What stands in the way of an equilibrium, in words that name the culprit: moves that nothing holds, a load out of all
//! proportion to the stiffness, a material that locks, elements inside out.

use crate::body::Body;
use crate::material::Hyperelastic;
use nalgebra::{SMatrix, SVector};
use std::fmt;
use stylet_mesh::{CellId, SimplexMesh, VertexId};
use stylet_solver::subspace::Subspace;
use stylet_solver::vector;

/// Rigid modes of a body in space; in the plane there are three.
const MOST_MODES: usize = 6;

/// A rigid mode is free where constraints resist it by less than this share of how they resist translations.
const FREE: f64 = 1e-10;

/// Strains under a load above this are taken for a mistake in the units: 1000 %.
const ABSURD_STRAIN: f64 = 10.0;

/// Poisson's ratio from which P1 elements lock.
const LOCKING_POISSON: f64 = 0.45;

/// Something that keeps a body from an equilibrium, or makes it worthless.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// A connected part of the body may move as a rigid body: there is no equilibrium, or no single one.
    FreePart {
        /// Number of the part, from 0, by its first vertex.
        part: usize,
        /// Parts that the body has.
        n_parts: usize,
        /// A vertex of the part.
        vertex: VertexId,
        /// Vertices of the part.
        n_vertices: usize,
        /// What it may do, one of each independent motion.
        motions: Vec<Motion>,
    },
    /// The load is out of proportion to the stiffness.
    AbsurdStrain {
        /// Estimate of the strain: load over stiffness and cross-section.
        strain: f64,
        /// The load, N.
        load: f64,
        /// The largest extent of the body, m.
        size: f64,
    },
    /// Linear elements are too stiff in a material that is nearly incompressible.
    Locking {
        /// Poisson's ratio.
        poisson: f64,
    },
    /// Elements are inside out.
    Inverted {
        /// How many.
        count: usize,
        /// The worst ones with their `det F`, worst first.
        worst: Vec<(CellId, f64)>,
    },
}

/// A rigid motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Along this unit vector (the third coordinate is 0 in the plane).
    Translation([f64; 3]),
    /// About the axis of this direction through this point, m.
    Rotation {
        /// Unit vector.
        axis: [f64; 3],
        /// Point.
        through: [f64; 3],
    },
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Translation(t) => write!(f, "translation along {}", tuple(t)),
            Self::Rotation { axis, through } => {
                write!(f, "rotation about {} through {} m", tuple(axis), tuple(through))
            }
        }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FreePart { part, n_parts, vertex, n_vertices, motions } => {
                let which = if *n_parts == 1 {
                    "the body".to_owned()
                } else {
                    format!("part {} of {n_parts} ({n_vertices} vertices, vertex {} among them)", part + 1, vertex.0)
                };
                write!(f, "{which} is not held against ")?;
                let list: Vec<String> = motions.iter().map(Motion::to_string).collect();
                f.write_str(&list.join(", "))
            }
            Self::AbsurdStrain { strain, load, size } => write!(
                f,
                "the load of {load:.3e} N would strain a body of {size:.3e} m by about {:.1e} %",
                100.0 * strain
            ),
            Self::Locking { poisson } => {
                write!(f, "linear elements lock at a Poisson's ratio of {poisson}: displacements come out too small")
            }
            Self::Inverted { count, worst } => {
                let list: Vec<String> = worst.iter().map(|(cell, j)| format!("{} (det F = {j:.3e})", cell.0)).collect();
                let plural = if *count == 1 { "cell is" } else { "cells are" };
                write!(f, "{count} {plural} inside out: {}", list.join(", "))
            }
        }
    }
}

/// `(1, 0, 0.5)`, four digits.
fn tuple(x: &[f64; 3]) -> String {
    let digits = x.map(|x| {
        let text = format!("{x:.4}");
        let text = text.trim_end_matches('0').trim_end_matches('.');
        if text == "-0" { "0".to_owned() } else { text.to_owned() }
    });
    format!("({})", digits.join(", "))
}

/// The rigid motions that the constraints leave to the connected parts of a mesh, a finding for each part that has any.
///
/// Vertices without cells are no part. For the constraints at rest: those that move do not count as free.
///
/// # Panics
/// If the subspace does not have a node for each vertex slot.
pub fn examine_constraints<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    subspace: &Subspace<D>,
) -> Vec<Finding> {
    assert_eq!(subspace.n_nodes(), mesh.n_vertex_slots(), "a node for each vertex");
    let parts = connected_parts(mesh);
    let mut findings = Vec::new();
    for (part, vertices) in parts.iter().enumerate() {
        let motions = free_motions(mesh, subspace, vertices);
        if !motions.is_empty() {
            let (n_parts, n_vertices) = (parts.len(), vertices.len());
            findings.push(Finding::FreePart { part, n_parts, vertex: vertices[0], n_vertices, motions });
        }
    }
    findings
}

/// Vertices of the parts of a mesh that no cell connects, each ascending, in the order of their first vertices.
fn connected_parts<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Vec<Vec<VertexId>> {
    const NONE: u32 = u32::MAX;
    let mut root = vec![NONE; mesh.n_vertex_slots()];
    fn find(root: &mut [u32], mut v: usize) -> usize {
        while root[v] as usize != v {
            root[v] = root[root[v] as usize];
            v = root[v] as usize;
        }
        v
    }
    for cell in mesh.cells() {
        let vertices = mesh.cell(cell).map(VertexId::index);
        for v in vertices {
            if root[v] == NONE {
                root[v] = v as u32;
            }
        }
        for v in &vertices[1..] {
            let (a, b) = (find(&mut root, vertices[0]), find(&mut root, *v));
            // The smaller root stays, so that parts are named by their first vertex.
            root[a.max(b)] = a.min(b) as u32;
        }
    }
    let mut parts: Vec<Vec<VertexId>> = Vec::new();
    let mut part_of = vec![NONE; root.len()];
    for v in 0..root.len() {
        if root[v] == NONE {
            continue;
        }
        let first = find(&mut root, v);
        if part_of[first] == NONE {
            part_of[first] = parts.len() as u32;
            parts.push(Vec::new());
        }
        parts[part_of[first] as usize].push(VertexId::new(v));
    }
    parts
}

/// The rigid motions of some vertices that no constraint resists: the null space of the sum over constrained directions `n`
/// of `m mᵀ`, where `m` holds the displacements along `n` by the rigid modes about the centre of the vertices.
fn free_motions<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    subspace: &Subspace<D>,
    vertices: &[VertexId],
) -> Vec<Motion> {
    let mut centre = [0.0; D];
    for &v in vertices {
        let x = mesh.point(v);
        (0..D).for_each(|k| centre[k] += x[k] / vertices.len() as f64);
    }
    let distance = |v: VertexId| (0..D).map(|k| (mesh.point(v)[k] - centre[k]).powi(2)).sum::<f64>().sqrt();
    let size = vertices.iter().map(|&v| distance(v)).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let n_modes = D * (D + 1) / 2;
    let mut resistance = SMatrix::<f64, MOST_MODES, MOST_MODES>::zeros();
    for &v in vertices {
        let constraint = subspace.get(v.index());
        let arm: [f64; D] = std::array::from_fn(|k| (mesh.point(v)[k] - centre[k]) / size);
        for axis in 0..D {
            // The part of each axis that the constraint takes away, summed over axes, is its complement.
            let mut unit = [0.0; D];
            unit[axis] = 1.0;
            let allowed = constraint.project(unit);
            let held: [f64; D] = std::array::from_fn(|k| unit[k] - allowed[k]);
            if held.iter().all(|&x| x == 0.0) {
                continue;
            }
            let mut row = SVector::<f64, MOST_MODES>::zeros();
            for mode in 0..n_modes {
                let moved = rigid_mode(mode, &arm);
                row[mode] = (0..D).map(|k| held[k] * moved[k]).sum();
            }
            resistance += row * row.transpose();
        }
    }
    // Modes that this dimension does not have are no motions.
    let largest = (0..n_modes).map(|k| resistance[(k, k)]).fold(0.0, f64::max);
    for mode in n_modes..MOST_MODES {
        resistance[(mode, mode)] = largest.max(1.0);
    }
    let eigen = resistance.symmetric_eigen();
    let free = |k: &usize| eigen.eigenvalues[*k] <= FREE * largest;
    let basis: Vec<SVector<f64, MOST_MODES>> =
        (0..MOST_MODES).filter(free).map(|k| eigen.eigenvectors.column(k).into_owned()).collect();
    tidy(basis).iter().map(|mode| motion(mode, n_modes, &centre, size)).collect()
}

/// Displacement of a point with this arm by a rigid mode: translations along the axes, then rotations about x, y and z (in
/// the plane: one).
fn rigid_mode<const D: usize>(mode: usize, arm: &[f64; D]) -> [f64; D] {
    let mut moved = [0.0; D];
    if mode < D {
        moved[mode] = 1.0;
        return moved;
    }
    let (i, j) = if D == 2 { (0, 1) } else { [(1, 2), (2, 0), (0, 1)][mode - D] };
    moved[i] = -arm[j];
    moved[j] = arm[i];
    moved
}

/// The reduced row echelon form of a basis: as many zeros as possible, so that motions read well.
fn tidy(mut basis: Vec<SVector<f64, MOST_MODES>>) -> Vec<SVector<f64, MOST_MODES>> {
    // Rotations are eliminated first, so that what is left of the others are pure translations.
    let mut done = 0;
    for column in (0..MOST_MODES).rev() {
        let largest = (done..basis.len()).max_by(|&a, &b| basis[a][column].abs().total_cmp(&basis[b][column].abs()));
        let Some(pivot) = largest.filter(|&row| basis[row][column].abs() > 1e-6) else { continue };
        basis.swap(done, pivot);
        let row = basis[done] / basis[done][column];
        basis[done] = row;
        for other in (0..basis.len()).filter(|&other| other != done) {
            let factor = basis[other][column];
            basis[other] -= row * factor;
        }
        done += 1;
    }
    basis.reverse();
    basis
}

/// In words: a translation, or a rotation about an axis that need not go through the centre.
fn motion<const D: usize>(mode: &SVector<f64, MOST_MODES>, n_modes: usize, centre: &[f64; D], size: f64) -> Motion {
    let pad = |k: usize| if k < D { centre[k] } else { 0.0 };
    let mut shift = [0.0; 3];
    (0..D).for_each(|k| shift[k] = mode[k]);
    let spin = match n_modes {
        3 => [0.0, 0.0, mode[2]],
        _ => [mode[3], mode[4], mode[5]],
    };
    let norm = |x: &[f64; 3]| vector::norm2(x);
    let speed = norm(&spin);
    if speed <= 1e-6 * norm(&shift) {
        let length = norm(&shift);
        return Motion::Translation(shift.map(|x| x / length));
    }
    // The points of the axis have no velocity across it: centre + (spin x shift) / |spin|^2, in units of the size.
    let cross = [
        spin[1] * shift[2] - spin[2] * shift[1],
        spin[2] * shift[0] - spin[0] * shift[2],
        spin[0] * shift[1] - spin[1] * shift[0],
    ];
    let through = std::array::from_fn(|k| pad(k) + size * cross[k] / (speed * speed));
    Motion::Rotation { axis: spin.map(|x| x / speed), through }
}

/// Whether the load (N, flat) is out of all proportion to a body of Young's modulus `young` (Pa, the smallest one): an
/// estimate of the strain by the load over the cross-section of the volume (m^3) and the largest extent (m) of the body.
pub fn examine_load<const D: usize, const N: usize>(
    mesh: &SimplexMesh<D, N>,
    thickness: f64,
    young: f64,
    load: &[f64],
) -> Option<Finding> {
    let mut bounds = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    let (mut volume, mut sum) = (0.0, [0.0; D]);
    for cell in mesh.cells() {
        volume += mesh.volume(cell).abs() * thickness;
        for corner in mesh.corners(cell) {
            (0..D).for_each(|k| bounds[0][k] = bounds[0][k].min(corner[k]));
            (0..D).for_each(|k| bounds[1][k] = bounds[1][k].max(corner[k]));
        }
    }
    for f in load.as_chunks::<D>().0 {
        (0..D).for_each(|k| sum[k] += f[k].abs());
    }
    let size = (0..D).map(|k| bounds[1][k] - bounds[0][k]).fold(0.0, f64::max);
    let load = vector::norm2(&sum);
    let strain = load * size / (volume * young);
    (strain > ABSURD_STRAIN).then_some(Finding::AbsurdStrain { strain, load, size })
}

/// Whether P1 elements lock at this Poisson's ratio.
pub fn examine_material(poisson: f64) -> Option<Finding> {
    (poisson > LOCKING_POISSON).then_some(Finding::Locking { poisson })
}

/// The cells that are inside out at the displacement `u`, the worst eight by name; `None` if there are none.
pub fn inverted_cells<const D: usize, const N: usize, M: Hyperelastic<D>>(
    body: &Body<D, N, M>,
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
) -> Option<Finding> {
    let det = |cell| Some((cell, body.jacobian(cell, u)?));
    let mut worst: Vec<(CellId, f64)> = mesh.cells().filter_map(det).filter(|(_, j)| *j <= 0.0 || j.is_nan()).collect();
    let count = worst.len();
    worst.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    worst.truncate(8);
    (count > 0).then_some(Finding::Inverted { count, worst })
}
