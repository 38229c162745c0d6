//! `[[constraint]]`: what nodes may do, and where they are taken.

use super::geometry::{Geometry, fixed};
use super::select::{pick, selects};
use stylet_mesh::VertexId;
use stylet_scene::Row;
use stylet_solver::subspace::{Constraint, Subspace};

/// Cosine from which two directions count as one.
const PARALLEL: f64 = 1.0 - 1e-12;

/// One row, ready for use.
#[derive(Clone, Debug)]
pub(super) struct Held<const D: usize> {
    nodes: Vec<VertexId>,
    constraint: Constraint<D>,
    way: Option<Way<D>>,
    /// Time from which it is there no more, s.
    until: f64,
}

/// Where constrained nodes are taken.
#[derive(Clone, Debug)]
struct Way<const D: usize> {
    offset: [f64; D],
    angle: f64,
    axis: [f64; 3],
    through: [f64; D],
    /// Time and share; empty: evenly.
    motion: Vec<(f64, f64)>,
}

/// Checks a row, as far as it can be checked alone.
pub(super) fn check_row(row: &Row) -> Result<(), String> {
    if !selects(row) {
        return Err("found no place, expected one of side, box, plane, region, tag or group".into());
    }
    let ways = ["components", "normal", "direction"].iter().filter(|name| row.value(name).is_some()).count();
    if ways > 1 {
        return Err("found more than one of components, normal and direction, expected at most one".into());
    }
    let moved = row.value("offset").is_some() || row.value("angle").is_some();
    for (name, needs, there) in [
        ("motion", "offset or angle", moved),
        ("axis", "angle", row.value("angle").is_some()),
        ("through", "angle", row.value("angle").is_some()),
    ] {
        if row.value(name).is_some() && !there {
            return Err(format!("found {name} alone, expected {needs} beside it"));
        }
    }
    if let Some(motion) = row.value("motion") {
        let times: Vec<f64> = motion.rows()?.iter().map(|row| row.get("t").unwrap_or(0.0)).collect();
        if let Some(pair) = times.windows(2).find(|pair| pair[1] <= pair[0]) {
            return Err(format!("motion: found t = {} after {}, expected ascending times", pair[1], pair[0]));
        }
    }
    Ok(())
}

impl<const D: usize> Held<D> {
    /// The nodes that a row picks and what they may do.
    ///
    /// # Errors
    /// The column, what was found and what was expected.
    pub fn of<const N: usize>(row: &Row, geometry: &Geometry<D, N>, regions: &[Row]) -> Result<Self, String> {
        let nodes: Vec<VertexId> = pick(row, geometry, regions)?.vertices().collect();
        let way = Way::of(row, geometry, &nodes)?;
        Ok(Self { nodes, constraint: constraint_of(row)?, way, until: row.get("until").unwrap_or(f64::INFINITY) })
    }

    /// Whether it is there at this time.
    pub fn is_there(&self, t: f64) -> bool {
        t < self.until
    }

    /// Whether it takes nodes anywhere.
    pub fn moves(&self) -> bool {
        self.way.is_some()
    }

    /// Takes its directions from the moves that are allowed.
    pub fn restrict(&self, subspace: &mut Subspace<D>) {
        for v in &self.nodes {
            let both = intersection(&subspace.get(v.index()), &self.constraint);
            // The node exists and directions are unit vectors, so that nothing is refused.
            let set = subspace.set(v.index(), both);
            debug_assert!(set.is_ok(), "{set:?}");
        }
    }

    /// Writes into `u` (m, flat) where its nodes are at time `t` of `end`; the directions it leaves free stay as they are.
    pub fn prescribe(&self, points: &[[f64; D]], t: f64, end: f64, u: &mut [f64]) {
        let Some(way) = &self.way else { return };
        let share = way.share(t, end);
        for v in &self.nodes {
            let place = way.displacement(&points[v.index()], share);
            let at = &mut u[D * v.index()..][..D];
            let now: [f64; D] = std::array::from_fn(|k| at[k]);
            let (free, of_place) = (self.constraint.project(now), self.constraint.project(place));
            (0..D).for_each(|k| at[k] = free[k] + place[k] - of_place[k]);
        }
    }
}

/// What the nodes of a row may do.
fn constraint_of<const D: usize>(row: &Row) -> Result<Constraint<D>, String> {
    if let Some(normal) = row.value("normal") {
        return Ok(Constraint::Plane(unit("normal", normal.floats()?)?));
    }
    if let Some(direction) = row.value("direction") {
        return Ok(Constraint::Line(unit("direction", direction.floats()?)?));
    }
    let Some(flags) = row.value("components") else { return Ok(Constraint::Fixed) };
    let flags: [f64; D] = fixed("components", flags.floats()?)?;
    if let Some(flag) = flags.iter().find(|flag| **flag != 0.0 && **flag != 1.0) {
        return Err(format!("components: found {flag}, expected 0 or 1 for each axis"));
    }
    let held: Vec<usize> = (0..D).filter(|&k| flags[k] == 1.0).collect();
    let axis = |k: usize| std::array::from_fn(|i| if i == k { 1.0 } else { 0.0 });
    match held[..] {
        [] => Err("components: found zeros alone, expected at least one 1".into()),
        [k] if D > 1 => Ok(Constraint::Plane(axis(k))),
        _ if held.len() == D => Ok(Constraint::Fixed),
        _ => Ok(Constraint::Line(axis((0..D).find(|k| !held.contains(k)).unwrap_or(0)))),
    }
}

fn unit<const D: usize>(key: &str, numbers: &[f64]) -> Result<[f64; D], String> {
    let x: [f64; D] = fixed(key, numbers)?;
    let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 0.0 && length.is_finite() {
        Ok(x.map(|x| x / length))
    } else {
        Err(format!("{key}: found a vector of length {length}, expected a direction"))
    }
}

/// What both constraints allow.
fn intersection<const D: usize>(a: &Constraint<D>, b: &Constraint<D>) -> Constraint<D> {
    let dot = |x: &[f64; D], y: &[f64; D]| (0..D).map(|k| x[k] * y[k]).sum::<f64>();
    match (a, b) {
        (Constraint::Free, other) | (other, Constraint::Free) => *other,
        (Constraint::Fixed, _) | (_, Constraint::Fixed) => Constraint::Fixed,
        (Constraint::Line(s), Constraint::Line(t)) if dot(s, t).abs() >= PARALLEL => *a,
        (Constraint::Line(_), Constraint::Line(_)) => Constraint::Fixed,
        (Constraint::Line(t), Constraint::Plane(n)) | (Constraint::Plane(n), Constraint::Line(t)) => {
            if dot(t, n).abs() <= 1e-6 { Constraint::Line(*t) } else { Constraint::Fixed }
        }
        (Constraint::Plane(m), Constraint::Plane(n)) if dot(m, n).abs() >= PARALLEL => *a,
        (Constraint::Plane(m), Constraint::Plane(n)) if D == 3 => {
            let cross: [f64; D] = std::array::from_fn(|k| {
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                m[i] * n[j] - m[j] * n[i]
            });
            let length = dot(&cross, &cross).sqrt();
            Constraint::Line(cross.map(|x| x / length))
        }
        (Constraint::Plane(_), Constraint::Plane(_)) => Constraint::Fixed,
    }
}

impl<const D: usize> Way<D> {
    fn of<const N: usize>(row: &Row, geometry: &Geometry<D, N>, nodes: &[VertexId]) -> Result<Option<Self>, String> {
        if row.value("offset").is_none() && row.value("angle").is_none() {
            return Ok(None);
        }
        let vector = |key: &str| row.value(key).map(|value| fixed::<D>(key, value.floats()?)).transpose();
        let mut centre = [0.0; D];
        for &v in nodes {
            (0..D).for_each(|k| centre[k] += geometry.mesh.point(v)[k] / nodes.len() as f64);
        }
        let axis = match (row.value("axis"), row.value("angle")) {
            (None, Some(_)) if D == 3 => return Err("found angle without axis, expected an axis in space".into()),
            (Some(axis), _) if D == 3 => unit::<3>("axis", axis.floats()?)?,
            _ => [0.0, 0.0, 1.0],
        };
        let rows = row.value("motion").map_or(Ok(&[][..]), |value| value.rows())?;
        let pair = |row: &Row| (row.get("t").unwrap_or(0.0), row.get("share").unwrap_or(0.0));
        Ok(Some(Self {
            offset: vector("offset")?.unwrap_or([0.0; D]),
            angle: row.get("angle").unwrap_or(0.0),
            axis,
            through: vector("through")?.unwrap_or(centre),
            motion: rows.iter().map(pair).collect(),
        }))
    }

    /// How much of the way is gone at time `t`.
    fn share(&self, t: f64, end: f64) -> f64 {
        let Some(&(first, share)) = self.motion.first() else { return t / end };
        if t <= first {
            // From nothing at the start.
            return if first > 0.0 { share * t / first } else { share };
        }
        for pair in self.motion.windows(2) {
            let ((t0, s0), (t1, s1)) = (pair[0], pair[1]);
            if t <= t1 {
                return s0 + (s1 - s0) * (t - t0) / (t1 - t0);
            }
        }
        self.motion[self.motion.len() - 1].1
    }

    /// Displacement of a point at a share of the way: a rotation by Rodrigues' formula, and a shift.
    fn displacement(&self, x: &[f64; D], share: f64) -> [f64; D] {
        let (sin, cos) = (share * self.angle).sin_cos();
        let pad = |k: usize| if k < D { x[k] - self.through[k] } else { 0.0 };
        let (r, n) = ([pad(0), pad(1), pad(2)], &self.axis);
        let along = (0..3).map(|k| n[k] * r[k]).sum::<f64>();
        std::array::from_fn(|k| {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let cross = n[i] * r[j] - n[j] * r[i];
            share * self.offset[k] + (cos - 1.0) * (r[k] - n[k] * along) + sin * cross
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_two_constraints_allow() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let (plane, line) = (Constraint::<3>::Plane, Constraint::<3>::Line);
        for (a, b, both) in [
            (Constraint::Free, plane(x), plane(x)),
            (plane(x), Constraint::Fixed, Constraint::Fixed),
            (plane(x), plane(x), plane(x)),
            (plane(x), plane(y), line(z)),
            (line(z), plane(x), line(z)),
            (line(z), plane(z), Constraint::Fixed),
            (line(x), line(y), Constraint::Fixed),
        ] {
            assert_eq!(intersection(&a, &b), both, "{a:?} and {b:?}");
        }
    }

    #[test]
    fn a_way_turns_and_shifts() {
        let way = Way::<3> {
            offset: [0.0, 0.0, 0.5],
            angle: std::f64::consts::PI,
            axis: [0.0, 0.0, 1.0],
            through: [1.0, 0.0, 0.0],
            motion: vec![(1.0, 0.5), (2.0, 1.0)],
        };
        let u = way.displacement(&[2.0, 0.0, 3.0], way.share(1.0, 9.0));
        for (u, expected) in u.iter().zip([-1.0, 1.0, 0.25]) {
            assert!((u - expected).abs() < 1e-15, "{u} for {expected}");
        }
        let shares: Vec<f64> = [0.0, 0.5, 1.5, 3.0].iter().map(|&t| way.share(t, 9.0)).collect();
        assert_eq!(shares, [0.0, 0.25, 0.75, 1.0]);
    }
}
