//! Whether triangles are the border of a solid.

use super::triangle::{self, pierces, touch};
use super::{ClosedSurface, SurfaceError};
use crate::check::{CheckSettings, Finding, RepairSettings, Report, check, repair};
use crate::geometry::{distance2, dot};

/// Triangles nearer to each other than this part of the size of the surface touch.
const NEAR: f64 = 1e-9;
/// Pairs of triangles that touch after which no more are looked for: of a heap of triangles there are too many.
const PAIRS: usize = 1_000;
/// Cosine of the angle between triangles at an edge, less one, below which they are folded onto each other.
const FOLDED: f64 = 1e-12;

/// The triangles, wound alike within each part, and how many were turned for it.
pub(super) fn checked(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(Vec<[u32; 3]>, usize), SurfaceError> {
    let mut report = check(points, triangles, &CheckSettings { coincidence: 0.0 });
    let windings = report.findings.iter().filter(|finding| matches!(finding, Finding::Inverted { .. })).count();
    report.findings.retain(is_fault);
    if let Some(first) = report.findings.first() {
        let (count, kinds, first) = (report.findings.len(), kinds(&report), first.to_string());
        return Err(SurfaceError::Unsound { count, kinds, first });
    }
    if windings == 0 {
        neighbours(triangles)?;
        return Ok((triangles.to_vec(), 0));
    }
    // Nothing is left to be removed, so that all triangles keep their places.
    let repaired = repair(points, triangles, &RepairSettings::default());
    let mut point_of = vec![0; repaired.points.len()];
    for (v, new) in repaired.new_vertex.iter().enumerate() {
        new.iter().for_each(|&new| point_of[new as usize] = v as u32);
    }
    let turned: Vec<[u32; 3]> = repaired.cells.iter().map(|t| t.map(|v| point_of[v as usize])).collect();
    neighbours(&turned)?;
    Ok((turned, windings))
}

/// Whether a finding keeps triangles from being the border of a solid. Points in one place make parts touch, which is found
/// with all else that touches.
fn is_fault(finding: &Finding) -> bool {
    !matches!(
        finding,
        Finding::Unused { .. } | Finding::Disconnected { .. } | Finding::Inverted { .. } | Finding::Coincident { .. }
    )
}

fn kinds(report: &Report) -> String {
    let counts = report.counts();
    counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect::<Vec<_>>().join(", ")
}

/// The triangle across the edge from each corner to the next, of triangles that wind alike.
pub(super) fn neighbours(triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>, SurfaceError> {
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (t, corners) in triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            edges.push((a.min(b), a.max(b), t as u32, i as u8));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[0; 3]; triangles.len()];
    let mut open: Option<SurfaceError> = None;
    for group in edges.chunk_by(|e, f| (e.0, e.1) == (f.0, f.1)) {
        match (group, &mut open) {
            (&[(_, _, s, i), (_, _, t, j)], _) => {
                neighbours[s as usize][i as usize] = t;
                neighbours[t as usize][j as usize] = s;
            }
            (_, Some(SurfaceError::Open { count, .. })) => *count += 1,
            (&[(a, b, triangle, _), ..], _) => open = Some(SurfaceError::Open { count: 1, edge: [a, b], triangle }),
            ([], _) => {}
        }
    }
    open.map_or(Ok(neighbours), Err)
}

/// Refuses triangles that touch or cross; `order` gives their ids.
pub(super) fn check_touching(surface: &ClosedSurface, order: &[u32]) -> Result<(), SurfaceError> {
    let [low, high] = surface.tree.bounds();
    let near = NEAR * distance2(&low, &high).sqrt();
    let mut pairs = Vec::new();
    for t in 0..surface.triangles.len() as u32 {
        let corners = surface.corners(t);
        let low = std::array::from_fn(|k| corners.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min) - near);
        let high = std::array::from_fn(|k| corners.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max) + near);
        surface.tree.visit(&low, &high, |s| {
            if s < t && meet(surface, s, t, near) {
                let (a, b) = (order[s as usize], order[t as usize]);
                pairs.push([a.min(b), a.max(b)]);
            }
        });
        if pairs.len() >= PAIRS {
            break;
        }
    }
    match pairs.iter().min() {
        Some(&triangles) => Err(SurfaceError::Touching { count: pairs.len(), triangles }),
        None => Ok(()),
    }
}

/// Whether two triangles have more in common than corners and edges.
fn meet(surface: &ClosedSurface, s: u32, t: u32, near: f64) -> bool {
    let (a, b) = (surface.corners(s), surface.corners(t));
    let (p, q) = (surface.triangles[s as usize], surface.triangles[t as usize]);
    let shared: Vec<usize> = (0..3).filter(|&i| q.contains(&p[i])).collect();
    let opposite = |corners: &[[f64; 3]; 3], i: usize| [corners[(i + 1) % 3], corners[(i + 2) % 3]];
    match shared[..] {
        [] => touch(&a, &b, near),
        [i] => {
            let j = q.iter().position(|v| *v == p[i]).expect("the shared corner");
            pierces(&opposite(&a, i), &b) || pierces(&opposite(&b, j), &a)
        }
        // Wound alike, triangles that go on past their edge have the same normal.
        _ => dot(&triangle::unit_normal(&a), &triangle::unit_normal(&b)) <= FOLDED - 1.0,
    }
}
