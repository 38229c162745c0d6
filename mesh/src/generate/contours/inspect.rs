//! Checks of one organ's drawing, contour by contour, then slice by slice.

use super::{
    cull::cull,
    fault::{Fault, Repair},
    nest,
    organ::{Organ, Slice},
    polygon::{bounding_box, cross, edges, first_conflict},
    set::{ContourSettings, Drawing, PlanarContour},
    tidy::{put_in_order, remove_duplicates},
};
use crate::geometry::{distance2, dot, subtract};

/// Coordinates beyond this (m) are no anatomy, and their squares might overflow.
const FARTHEST: f64 = 1e6;
/// A contour may have this many points: finding where it crosses itself may take their number squared.
const MOST_POINTS: usize = 20_000;
/// A slice of an organ may have this many contours: each is compared with each.
const MOST_CONTOURS: usize = 1_000;
/// Ends are far apart if their gap is longer than this many times the longest other edge.
const OPEN: f64 = 4.0;
/// Points are on a line if they keep within this part of their extent beside it.
const SLIVER: f64 = 1e-6;
/// Slices are at equal distances if these vary by less than this part, or than the tolerance of planes.
const UNEQUAL: f64 = 1e-3;

/// A contour that passed on its own: its place in the drawing, its plane, its points.
struct Sound {
    contour: usize,
    z: f64,
    points: Vec<[f64; 2]>,
}

/// The organ that a drawing shows, or all its faults; repairs are added to the list.
pub(super) fn inspect(
    drawing: &Drawing,
    settings: &ContourSettings,
    repairs: &mut Vec<Repair>,
) -> Result<Organ, Vec<Fault>> {
    let (mut sound, mut faults) = (Vec::new(), Vec::new());
    for (contour, drawn) in drawing.contours.iter().enumerate() {
        match inspect_contour(&drawing.name, contour, drawn, settings, repairs) {
            Ok(found) => sound.extend(found),
            Err(fault) => faults.push(fault),
        }
    }
    // A stable sort: contours of a slice stay in the order of the drawing.
    sound.sort_by(|a, b| a.z.total_cmp(&b.z));
    let mut slices = Vec::new();
    for group in sound.chunk_by_mut(|a, b| b.z - a.z <= settings.plane) {
        match inspect_slice(&drawing.name, group, repairs) {
            Ok(slice) => slices.push(slice),
            Err(found) => faults.extend(found),
        }
    }
    if faults.is_empty() {
        match check_spacing(&drawing.name, &slices, settings, repairs) {
            Ok(thickness) => return Ok(Organ { name: drawing.name.clone(), slices, thickness }),
            Err(fault) => faults.push(fault),
        }
    }
    Err(faults)
}

/// One contour on its own; `None` if it was left out.
fn inspect_contour(
    organ: &str,
    contour: usize,
    drawn: &PlanarContour,
    settings: &ContourSettings,
    repairs: &mut Vec<Repair>,
) -> Result<Option<Sound>, Fault> {
    let organ = || organ.to_owned();
    let z = check_points(organ(), contour, drawn, settings)?;
    let mut points: Vec<[f64; 2]> = drawn.points.iter().map(|p| [p[0], p[1]]).collect();
    let removed = remove_duplicates(&mut points, settings.duplicate);
    if removed > 0 {
        repairs.push(Repair::DuplicatePoints { organ: organ(), contour, removed });
    }
    if points.len() >= 3 {
        check_closed(organ(), contour, drawn.open, &points)?;
    }
    let removed = cull(&mut points, settings.cull);
    if removed > 0 {
        repairs.push(Repair::Culled { organ: organ(), contour, removed });
    }
    if !encloses_area(&points) {
        repairs.push(Repair::Degenerate { organ: organ(), contour, points: points.len() });
        return Ok(None);
    }
    match put_in_order(&mut points) {
        Ok(0) => {}
        Ok(runs) => repairs.push(Repair::Reordered { organ: organ(), contour, runs }),
        Err(edges) => {
            return Err(Fault::SelfIntersecting { organ: organ(), contour, edges: edges.map(|i| points[i]), z });
        }
    }
    Ok(Some(Sound { contour, z, points }))
}

/// Checks the numbers of a contour, and returns its plane.
fn check_points(
    organ: String,
    contour: usize,
    drawn: &PlanarContour,
    settings: &ContourSettings,
) -> Result<f64, Fault> {
    let found = drawn.points.len();
    if found > MOST_POINTS {
        return Err(Fault::TooManyPoints { organ, contour, found, limit: MOST_POINTS });
    }
    let absurd = |x: &f64| x.is_nan() || x.abs() > FARTHEST;
    for (point, p) in drawn.points.iter().enumerate() {
        if let Some(&value) = p.iter().find(|x| absurd(x)) {
            return Err(Fault::Coordinate { organ, contour, point, value });
        }
    }
    let heights = || drawn.points.iter().map(|p| p[2]);
    let (lowest, highest) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    if highest - lowest > settings.plane {
        return Err(Fault::NotPlanar { organ, contour, lowest, highest });
    }
    Ok(if lowest == highest { lowest } else { f64::midpoint(lowest, highest) })
}

/// Whether the last point leads back to the first.
fn check_closed(organ: String, contour: usize, said_open: bool, points: &[[f64; 2]]) -> Result<(), Fault> {
    let lengths: Vec<f64> = edges(points).map(|(a, b)| distance2(&a, &b).sqrt()).collect();
    let (gap, others) = lengths.split_last().expect("three points or more");
    let longest = others.iter().fold(0.0_f64, |longest, &l| longest.max(l));
    if said_open || *gap > OPEN * longest {
        return Err(Fault::Open { organ, contour, gap: *gap, longest });
    }
    Ok(())
}

/// Whether there are three points that are not on a line. (The area will not do: that of a figure of eight may be zero.)
fn encloses_area(points: &[[f64; 2]]) -> bool {
    let Some(a) = points.first() else { return false };
    let farthest = points.iter().max_by(|p, q| distance2(a, p).total_cmp(&distance2(a, q)));
    let along = farthest.map_or([0.0; 2], |b| subtract(b, a));
    let extent2 = dot(&along, &along);
    points.iter().any(|p| cross(&along, &subtract(p, a)).abs() > SLIVER * extent2)
}

/// The contours of one plane together.
fn inspect_slice(organ: &str, group: &mut [Sound], repairs: &mut Vec<Repair>) -> Result<Slice, Vec<Fault>> {
    let z = group[0].z;
    if group.len() > MOST_CONTOURS {
        let (organ, found) = (organ.to_owned(), group.len());
        return Err(vec![Fault::TooManyContours { organ, z, found, limit: MOST_CONTOURS }]);
    }
    let mut kept: Vec<&mut Sound> = Vec::with_capacity(group.len());
    let mut faults = Vec::new();
    for one in group {
        if let Some(first) = kept.iter().find(|other| same_outline(&one.points, &other.points)) {
            let (contour, of) = (one.contour, first.contour);
            repairs.push(Repair::RepeatedContour { organ: organ.to_owned(), contour, of });
            continue;
        }
        for other in &kept {
            if let Some(near) = crossing(&other.points, &one.points) {
                let contours = [other.contour, one.contour];
                faults.push(Fault::Overlapping { organ: organ.to_owned(), contours, near, z });
            }
        }
        kept.push(one);
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let contours = kept.into_iter().map(|sound| std::mem::take(&mut sound.points)).collect();
    Ok(Slice { z, parts: nest::parts(contours) })
}

/// Where an edge of the first contour starts that conflicts with the second.
fn crossing(one: &[[f64; 2]], other: &[[f64; 2]]) -> Option<[f64; 2]> {
    let [[low, high], [from, to]] = [bounding_box(one), bounding_box(other)];
    let apart = (0..2).any(|k| high[k] < from[k] || to[k] < low[k]);
    if apart { None } else { first_conflict(one, Some(other)).map(|(i, _)| one[i]) }
}

/// Whether two contours have the same points in the same order, wherever they start and whichever way they run.
fn same_outline(one: &[[f64; 2]], other: &[[f64; 2]]) -> bool {
    let n = one.len();
    if n != other.len() {
        return false;
    }
    // A contour may touch itself, so that its first point is there twice.
    let mut starts = (0..n).filter(|&s| other[s] == one[0]).take(2);
    let along = |s: usize| (0..n).all(|i| one[i] == other[(s + i) % n]);
    let against = |s: usize| (0..n).all(|i| one[i] == other[(s + n - i) % n]);
    starts.any(|s| along(s) || against(s))
}

/// Remarks on the distances between slices; returns the thickness of a single one.
fn check_spacing(
    organ: &str,
    slices: &[Slice],
    settings: &ContourSettings,
    repairs: &mut Vec<Repair>,
) -> Result<f64, Fault> {
    let organ = organ.to_owned();
    match slices {
        [] => return Err(Fault::NoContours { organ }),
        [slice] => {
            let z = slice.z;
            let Some(thickness) = settings.thickness else { return Err(Fault::SingleSlice { organ, z }) };
            repairs.push(Repair::SingleSlice { organ, z, thickness });
            return Ok(thickness);
        }
        _ => {}
    }
    let distances = slices.windows(2).map(|pair| pair[1].z - pair[0].z);
    let (smallest, largest) = distances.fold((f64::INFINITY, 0.0_f64), |(s, l), d| (s.min(d), l.max(d)));
    if largest - smallest > (UNEQUAL * largest).max(2.0 * settings.plane) {
        repairs.push(Repair::UnequalSpacing { organ, smallest, largest });
    }
    Ok(0.0)
}
