//! The dihedral angles that stuffing can make: an exhaustive search with proved bounds.
//!
//! One tetrahedron of the body-centred cubic lattice stands for all, as they are congruent and the rule for diagonals is
//! symmetric with them. Each of its vertices is inside, outside, or was moved onto the surface along one of its 14 edges; each
//! edge from inside to outside has a cut between its limits. The search goes through all signs, all directions that warping
//! can choose together, and all parts that [`split`](super::split) makes. Of a dihedral angle, the two vertices off its edge
//! move on segments and turn around the edge monotonically, so that their ends suffice. For the two ends of the edge, a
//! square of parameters is divided until a bound on the derivative shows that no angle in it is outside those found, less
//! [`SLACK`].

use super::complex::Vertex;
use super::{split, warp};
use crate::geometry::{distance2, dot, subtract};

/// The bounds hold up to this, degrees.
pub const SLACK: f64 = 0.01;

/// The canonical tetrahedron: corners 0 and 1, centres 2 and 3, in half edges of a cube.
pub const TET: [[i32; 3]; 4] = [[0, 0, 0], [2, 0, 0], [1, 1, -1], [1, 1, 1]];

/// A vertex that lies anywhere on a segment from `base` to `base + way`.
#[derive(Clone, Copy)]
struct Mobile {
    base: [f64; 3],
    way: [f64; 3],
}

impl Mobile {
    fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.base[k] + t * self.way[k])
    }

    fn length(&self) -> f64 {
        dot(&self.way, &self.way).sqrt()
    }
}

/// The extreme angles found, degrees.
#[derive(Clone, Copy, Debug)]
pub struct Extremes {
    pub min: f64,
    pub max: f64,
    /// Smallest determinant of edge vectors over the longest edge cubed, at the ends of all segments.
    pub flattest: f64,
}

pub struct Rule<'a> {
    /// Limits of long and short edges.
    pub long: f64,
    pub short: f64,
    /// Which edges are divided first.
    pub rank: &'a dyn Fn([i32; 3], [i32; 3]) -> u8,
}

impl Rule<'_> {
    fn limit(&self, p: [i32; 3], q: [i32; 3]) -> f64 {
        if (0..3).filter(|&k| p[k] != q[k]).count() == 1 { self.long } else { self.short }
    }
}

fn spokes() -> Vec<[i32; 3]> {
    let mut spokes = Vec::new();
    for k in 0..3 {
        for s in [-2, 2] {
            let mut d = [0; 3];
            d[k] = s;
            spokes.push(d);
        }
    }
    for i in 0..8 {
        spokes.push(std::array::from_fn(|k| 2 * (i >> k & 1) - 1));
    }
    spokes
}

/// The extreme angles over everything, or over the sign patterns that are let through.
pub fn search(rule: &Rule, through: impl Fn([i8; 4]) -> bool) -> Extremes {
    let mut extremes = Extremes { min: 180.0, max: 0.0, flattest: 1.0 };
    let spokes = spokes();
    for pattern in 0..81 {
        let signs = [1, 3, 9, 27].map(|p| (pattern / p % 3) as i8 - 1);
        if !through(signs) {
            continue;
        }
        // Opposite edges may have one rank: then any of the two may come first.
        let mut parts: Vec<_> = (0..8).flat_map(|ties| parts(signs, rule, ties)).collect();
        parts.sort_unstable();
        parts.dedup();
        let zeros: Vec<usize> = (0..4).filter(|i| signs[*i] == 0).collect();
        for combination in 0..spokes.len().pow(zeros.len() as u32) {
            let mut ways = [[0; 3]; 4];
            let mut rest = combination;
            for &z in &zeros {
                ways[z] = spokes[rest % spokes.len()];
                rest /= spokes.len();
            }
            if is_possible(signs, &ways) {
                for part in &parts {
                    part_angles(part, &ways, rule, &mut extremes);
                }
            }
        }
    }
    extremes
}

/// Whether vertices can have been moved along these ways: in some order, each towards a vertex of the other sign that had
/// not been moved before.
fn is_possible(signs: [i8; 4], ways: &[[i32; 3]; 4]) -> bool {
    let zeros: Vec<usize> = (0..4).filter(|i| signs[*i] == 0).collect();
    let towards = |v: usize| (0..4).find(|&w| w != v && (0..3).all(|k| TET[v][k] + ways[v][k] == TET[w][k]));
    // No cycles.
    for &z in &zeros {
        let mut at = z;
        for _ in 0..4 {
            match towards(at) {
                Some(w) if signs[w] == 0 => at = w,
                _ => break,
            }
            if at == z {
                return false;
            }
        }
    }
    (0..1 << zeros.len()).any(|bits| {
        let mut before = signs;
        for (i, &z) in zeros.iter().enumerate() {
            before[z] = if bits >> i & 1 == 1 { 1 } else { -1 };
        }
        zeros.iter().all(|&z| towards(z).is_none_or(|w| before[w] == -before[z]))
    })
}

/// A corner of a part: a vertex of the tetrahedron or the cut of one of its edges.
type Corner = (usize, usize);

fn parts(signs: [i8; 4], rule: &Rule, ties: u8) -> Vec<[Corner; 4]> {
    let mut cuts: Vec<(usize, usize)> = super::cut::EDGES.iter().map(|e| (e[0], e[1])).collect();
    cuts.retain(|(i, j)| signs[*i] * signs[*j] < 0);
    cuts.sort_by_key(|(i, j)| {
        let rank = (rule.rank)(TET[*i], TET[*j]);
        (rank, (*i == 0) == (ties >> rank & 1 == 1))
    });
    let mut parts = vec![[(0, 0), (1, 1), (2, 2), (3, 3)]];
    for cut in cuts {
        let (a, b) = ((cut.0, cut.0), (cut.1, cut.1));
        for p in 0..parts.len() {
            let part: [Corner; 4] = parts[p];
            if part.contains(&a) && part.contains(&b) {
                parts[p] = part.map(|v| if v == b { cut } else { v });
                parts.push(part.map(|v| if v == a { cut } else { v }));
            }
        }
    }
    parts
}

fn part_angles(part: &[Corner; 4], ways: &[[i32; 3]; 4], rule: &Rule, extremes: &mut Extremes) {
    let mobile = part.map(|(i, j)| {
        let (p, q) = (TET[i].map(f64::from), TET[j].map(f64::from));
        if i == j {
            let limit = rule.limit([0; 3], ways[i]);
            Mobile { base: p, way: ways[i].map(|x| limit * f64::from(x)) }
        } else {
            let (limit, d) = (rule.limit(TET[i], TET[j]), subtract(&q, &p));
            Mobile { base: std::array::from_fn(|k| p[k] + limit * d[k]), way: d.map(|x| (1.0 - 2.0 * limit) * x) }
        }
    });
    for bits in 0..16 {
        if (0..4).all(|i| bits >> i & 1 == 0 || mobile[i].length() > 0.0) {
            let corners: [[f64; 3]; 4] = std::array::from_fn(|i| mobile[i].at(f64::from(bits >> i & 1)));
            extremes.flattest = extremes.flattest.min(crate::geometry::relative_measure(&corners).abs());
        }
    }
    for (k, l) in [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)] {
        let [i, j] = {
            let mut rest = (0..4).filter(|m| *m != k && *m != l);
            [rest.next().unwrap(), rest.next().unwrap()]
        };
        for ends in 0..4 {
            let (tk, tl) = (f64::from(ends & 1), f64::from(ends >> 1));
            if (tk > 0.0 && mobile[k].length() == 0.0) || (tl > 0.0 && mobile[l].length() == 0.0) {
                continue;
            }
            divide(&mobile[i], &mobile[j], &mobile[k].at(tk), &mobile[l].at(tl), extremes);
        }
    }
}

/// The angles at the edge from `a` to `b` between `c` and `d`, wherever the ends are.
fn divide(a: &Mobile, b: &Mobile, c: &[f64; 3], d: &[f64; 3], extremes: &mut Extremes) {
    let half = |m: &Mobile| if m.length() > 0.0 { 0.5 } else { 0.0 };
    let mut squares = vec![([0.5, 0.5], [half(a), half(b)])];
    while let Some(([s, t], [ws, wt])) = squares.pop() {
        let (p, q) = (a.at(s), b.at(t));
        let angle = dihedral_deg(&p, &q, c, d);
        extremes.min = extremes.min.min(angle);
        extremes.max = extremes.max.max(angle);
        let (ds, dt) = (ws * a.length(), wt * b.length());
        let change = (turn(&p, &q, c, ds, dt) + turn(&p, &q, d, ds, dt)).to_degrees();
        if angle - change >= extremes.min - SLACK && angle + change <= extremes.max + SLACK {
            continue;
        }
        if ds >= dt {
            let w = 0.5 * ws;
            squares.extend([([s - w, t], [w, wt]), ([s + w, t], [w, wt])]);
        } else {
            let w = 0.5 * wt;
            squares.extend([([s, t - w], [ws, w]), ([s, t + w], [ws, w])]);
        }
    }
}

/// By how much the half-plane from the line through `p` and `q` towards `c` turns at most when `p` moves by `dp` and `q`
/// by `dq`, radians: the derivatives are `|1 - s| / h` and `|s| / h` with the height `h` of `c` over the line and its foot
/// at `p + s (q - p)`.
fn turn(p: &[f64; 3], q: &[f64; 3], c: &[f64; 3], dp: f64, dq: f64) -> f64 {
    let (e, f) = (subtract(q, p), subtract(c, p));
    let length = dot(&e, &e).sqrt();
    let along = dot(&e, &f) / length;
    let height = (dot(&f, &f) - along * along).max(0.0).sqrt();
    let shortest = length - dp - dq;
    if shortest <= 0.0 {
        return f64::INFINITY;
    }
    let s = (distance2(c, p).sqrt() + dp) / shortest;
    let one_less_s = (distance2(c, q).sqrt() + dq) / shortest;
    let displaced = one_less_s * dp + s * dq;
    if height <= displaced { f64::INFINITY } else { displaced / (height - displaced) }
}

/// The angle between the half-planes from the line through `p` and `q` towards `c` and `d`.
fn dihedral_deg(p: &[f64; 3], q: &[f64; 3], c: &[f64; 3], d: &[f64; 3]) -> f64 {
    let e = subtract(q, p);
    let off = |x: &[f64; 3]| {
        let f = subtract(x, p);
        let s = dot(&e, &f) / dot(&e, &e);
        subtract(&f, &e.map(|y| s * y))
    };
    let (u, v) = (off(c), off(d));
    (dot(&u, &v) / (dot(&u, &u) * dot(&v, &v)).sqrt()).clamp(-1.0, 1.0).acos().to_degrees()
}

/// The rule of the generator.
fn generators() -> Rule<'static> {
    Rule { long: warp::LONG, short: warp::SHORT, rank: &|p, q| split::rank(&vertex(p), &vertex(q)) }
}

fn vertex(site: [i32; 3]) -> Vertex {
    Vertex { site: Some(site), is_centre: site[0] % 2 != 0, faces: 0, on: 0 }
}

#[test]
fn both_sides_of_a_surface_keep_within_the_bounds() {
    let found = search(&generators(), |signs| signs != [0; 4]);
    assert!(found.min - SLACK >= warp::ANGLES_DEG[0] && found.max + SLACK <= warp::ANGLES_DEG[1], "{found:?}");
    // So the guard of warping never refuses a move that the proof counts on.
    assert!(found.flattest > warp::FLATTEST, "{found:?}");
}
