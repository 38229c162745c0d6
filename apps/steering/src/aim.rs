//! Whether needles start outside the tissue and can reach it.

use crate::geometry::Geometry;
use crate::motion::Motion;
use stylet_mesh::geometry::cross;
use stylet_physics::insertion::NeedleSettings;

/// Most edges of a needle out of its sleeve: beyond, its length or that of its edges is a typing error.
const MOST_EDGES: f64 = 1000.0;

/// Checks that a needle has no more edges than can be stepped, after what a motion pushes out up to `end` (s).
///
/// # Errors
/// What was found and what was expected.
pub fn check_edges(needle: &NeedleSettings, motion: &Motion, end: f64) -> Result<(), String> {
    let longest = needle.length + motion.extremes(end)[1].1;
    if longest <= MOST_EDGES * needle.edge {
        return Ok(());
    }
    Err(format!(
        "found {:e} m, expected at least {:.3e} m: the needle is {longest:.4} m long at most, in {MOST_EDGES} edges at most",
        needle.edge,
        longest / MOST_EDGES
    ))
}

/// Checks that a motion up to `end` (s) leaves half an edge of the needle out of its sleeve, which the step needs.
///
/// # Errors
/// What was found and what was expected.
pub fn check_withdrawal(needle: &NeedleSettings, motion: &Motion, end: f64) -> Result<(), String> {
    let (t, least) = motion.extremes(end)[0];
    let most = needle.length - 0.5 * needle.length / (needle.length / needle.edge).round().max(1.0);
    if -least <= most + 1e-9 * needle.length {
        return Ok(());
    }
    Err(format!(
        "found a needle that is {:.4} m further back at {t} s than at the start, expected at most {most:.4} m: length = {} m \
         less half an edge",
        -least, needle.length
    ))
}

/// Checks a needle against the undeformed body: no part of it starts inside, its axis meets the body, and it is pushed far enough.
/// The axis of a needle whose sleeve is moved, or that is bent by nature, is not looked at.
///
/// # Errors
/// The column, what was found and what was expected.
pub fn check(needle: &NeedleSettings, motion: &Motion, end: f64, geometry: &Geometry) -> Result<(), String> {
    // Columns have shorter names than the settings of the library.
    let of_column = |text: String| {
        text.replace("needle.bend.curvature", "curvature").replace("needle.bend.length", "curved_length")
    };
    let shaft = needle.shaft().map_err(|error| of_column(error.to_string()))?;
    for node in 0..shaft.n_nodes() {
        let at = shaft.place(node);
        if let Some(found) = geometry.mesh.locate(at) {
            let region = &geometry.regions[geometry.mesh.region(found.cell) as usize];
            let what = if node <= 1 { "its base" } else { "a part of it" };
            let fixed = if region.fixed { ", which is fixed" } else { "" };
            return Err(format!(
                "base: found {what} at {} m inside the tissue, in region {}{fixed}; expected all of the needle outside at the start",
                point(&at),
                region.name
            ));
        }
    }
    if motion.moves_sleeve() || needle.bend.is_some() {
        return Ok(());
    }
    let Some(distance) = first_hit(&needle.base, &needle.direction, geometry) else {
        return Err(format!(
            "direction: found an axis from {} along {} that misses the body, expected one that meets it; the body reaches {}",
            point(&needle.base),
            point(&needle.direction),
            geometry.extent()
        ));
    };
    let reached = needle.length + motion.extremes(end)[1].1;
    if reached <= distance {
        return Err(format!(
            "motion: found a needle that comes {reached:.4} m out of its sleeve at most, expected more than the {distance:.4} m to the body"
        ));
    }
    Ok(())
}

/// Distance along a ray to the surface of the body, m.
fn first_hit(from: &[f64; 3], direction: &[f64; 3], geometry: &Geometry) -> Option<f64> {
    let mesh = &geometry.mesh;
    let hits = mesh.boundary_facets().filter_map(|(cell, facet)| {
        let corners = mesh.corners(cell);
        let mut others = (0..4).filter(|&k| k != facet).map(|k| corners[k]);
        let [a, b, c] = std::array::from_fn(|_| others.next().unwrap_or(corners[facet]));
        hit(from, direction, &[a, b, c])
    });
    hits.min_by(f64::total_cmp)
}

/// Where a ray meets a triangle (Möller and Trumbore 1997).
fn hit(from: &[f64; 3], direction: &[f64; 3], [a, b, c]: &[[f64; 3]; 3]) -> Option<f64> {
    let minus = |p: &[f64; 3], q: &[f64; 3]| -> [f64; 3] { std::array::from_fn(|k| p[k] - q[k]) };
    let dot = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| p[k] * q[k]).sum::<f64>();
    let (e1, e2) = (minus(b, a), minus(c, a));
    let p = cross(direction, &e2);
    let det = dot(&e1, &p);
    if det == 0.0 {
        return None;
    }
    let t = minus(from, a);
    let u = dot(&t, &p) / det;
    let q = cross(&t, &e1);
    let v = dot(direction, &q) / det;
    let s = dot(&e2, &q) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && s > 0.0).then_some(s)
}

fn point(x: &[f64; 3]) -> String {
    format!("({:.4}, {:.4}, {:.4})", x[0], x[1], x[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Scene;
    use stylet_scene::{Row, Value};

    #[test]
    fn needles_too_long_for_their_edges_or_pulled_back_too_far_are_named() {
        let check = |edge: f64, speeds: &[f64]| {
            let needle =
                NeedleSettings { length: 0.02, edge, ..NeedleSettings::nitinol([0.0; 3], [1.0, 0.0, 0.0]).unwrap() };
            let rows = speeds.iter().zip(0..).flat_map(|(speed, k)| {
                let row = |t: i32| Row::from_iter([("t", f64::from(t)), ("insert", *speed)]);
                [row(k), row(k + 1)]
            });
            let mut row = Row::default();
            row.set("motion", Value::Rows(rows.collect()));
            let (motion, end) = (Motion::of(&row).unwrap(), speeds.len() as f64);
            (check_edges(&needle, &motion, end).err(), check_withdrawal(&needle, &motion, end).err())
        };
        assert_eq!(check(1e-4, &[0.0799, -0.09]), (None, None));
        let reason = check(0.9e-4, &[0.08, -0.08]).0.unwrap();
        assert!(reason.starts_with("found 9e-5 m, expected at least 1.000e-4 m"), "{reason}");
        // Half an edge of 5 mm has to stay out.
        assert_eq!(check(5e-3, &[0.03, -0.047]), (None, None));
        let reason = check(5e-3, &[0.03, -0.048]).1.unwrap();
        assert!(reason.starts_with("found a needle that is 0.0180 m further back at 2 s"), "{reason}");
        assert!(reason.contains("expected at most 0.0175 m"), "{reason}");
    }

    #[test]
    fn the_way_to_the_body_is_measured() {
        let geometry = Geometry::of(&Scene::default()).unwrap();
        let distance = first_hit(&[-0.03, 0.041, 0.052], &[1.0, 0.0, 0.0], &geometry).unwrap();
        assert!((distance - 0.03).abs() < 1e-12);
        assert_eq!(first_hit(&[-0.03, 0.041, 0.052], &[-1.0, 0.0, 0.0], &geometry), None);
        assert_eq!(first_hit(&[-0.03, 0.141, 0.052], &[1.0, 0.0, 0.0], &geometry), None);
    }
}
