//! Replacements of known outcome, and what is refused.

use super::adjacency::{Complex, NONE};
use super::*;
use crate::generate::implicit::Sphere;

fn go(_: &Sweep) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

const BOX: [[f64; 3]; 2] = [[-10.0; 3], [10.0; 3]];

/// Cells around the segment from (0, 0, -h) to (0, 0, h), with a regular ring of n vertices.
fn around_an_edge(n: u32, h: f64) -> Tets {
    let ring = (0..n).map(|k| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
        [cos, sin, 0.0]
    });
    let points: Vec<_> = [[0.0, 0.0, -h], [0.0, 0.0, h]].into_iter().chain(ring).collect();
    let cells: Vec<_> = (0..n).map(|k| [0, 1, 2 + k, 2 + (k + 1) % n]).collect();
    Tets { points, regions: vec![0; cells.len()], cells }
}

/// Improves by replacements alone: the vertices are on a boundary that is no face of the box, and stay.
fn flipped(mut tets: Tets) -> (Tets, ImproveReport) {
    let settings = ImproveSettings { least_angle_deg: 60.0, greatest_angle_deg: 80.0, ..Default::default() };
    let before = tets.points.clone();
    let report = improve(&mut tets, &Strata::new(vec![]), &[], BOX, &settings, &mut go).unwrap();
    assert_eq!(tets.points, before);
    assert_eq!(report.moved, 0);
    (tets, report)
}

#[test]
fn three_cells_around_a_long_edge_become_two() {
    let (tets, report) = flipped(around_an_edge(3, 0.3));
    // The edge is short, and its angles of 120 degrees are the worst: without it there are two flat caps, which are worse.
    assert_eq!((tets.cells.len(), report.replaced), (3, 0));
    let (tets, report) = flipped(around_an_edge(3, 1.5));
    assert_eq!((tets.cells.len(), report.replaced), (2, 1));
    assert!(report.after.min_deg > report.before.min_deg && report.after.max_deg < report.before.max_deg);
    // And back, where the facet is the better choice: the two caps of a short edge.
    let caps =
        Tets { points: around_an_edge(3, 0.3).points, cells: vec![[2, 3, 4, 1], [2, 4, 3, 0]], regions: vec![0; 2] };
    let (tets, report) = flipped(caps);
    assert_eq!((tets.cells.len(), report.replaced), (3, 1));
}

#[test]
fn rings_are_triangulated_where_that_is_best() {
    for n in 4..=8 {
        // The edge is near to one side of the ring, where the cell is nearly flat.
        let mut start = around_an_edge(n, 0.8);
        let (sin, cos) = (std::f64::consts::PI / f64::from(n)).sin_cos();
        start.points[..2].iter_mut().for_each(|p| (p[0], p[1]) = (0.9 * cos * cos, 0.9 * cos * sin));
        let volume = volume_of(&start);
        let (tets, report) = flipped(start);
        assert!(report.replaced >= 1, "{n}");
        assert!(report.after.min_quality > report.before.min_quality);
        assert!((volume_of(&tets) - volume).abs() < 1e-14 * volume);
    }
    // A square flattened along y: the short diagonal serves both ends of the edge.
    let mut kite = around_an_edge(4, 1.0);
    kite.points[3][1] *= 0.5;
    kite.points[5][1] *= 0.5;
    let (tets, _) = flipped(kite);
    assert_eq!(tets.cells.len(), 4);
    assert!(tets.cells.iter().all(|cell| cell.contains(&3) && cell.contains(&5)));
}

fn volume_of(tets: &Tets) -> f64 {
    tets.cells.iter().map(|cell| signed_measure(&cell.map(|v| tets.points[v as usize]))).sum()
}

#[test]
fn nothing_is_replaced_across_a_border() {
    let mut tets = around_an_edge(3, 1.5);
    tets.regions = vec![0, 1, 1];
    let ball = Strata::new(vec![Box::new(Sphere::new([0.0; 3], 1.0).unwrap())]);
    let before = tets.clone();
    let report = improve(&mut tets, &ball, &[], BOX, &ImproveSettings::default(), &mut go).unwrap();
    assert_eq!(report.replaced, 0);
    assert_eq!(tets, before);
}

#[test]
fn neighbours_stay_what_a_search_finds() {
    let tets = around_an_edge(6, 2.0);
    let mut complex = Complex::new(&tets).unwrap();
    let mut flipper = Flipper::new(Targets::new(&ImproveSettings::default()));
    while (0..complex.cells.len() as u32).any(|t| complex.lives(t) && flipper.improve(&tets.points, &mut complex, t)) {}
    let ids: Vec<u32> = (0..complex.cells.len() as u32).filter(|&t| complex.lives(t)).collect();
    assert_ne!(ids.len(), 6);
    let patched: Vec<[u32; 4]> = ids.iter().map(|&t| complex.neighbours[t as usize]).collect();
    let (cells, regions) = complex.into_cells();
    let fresh = Complex::new(&Tets { points: tets.points, cells, regions }).unwrap();
    let named = |n: u32| if n == NONE { NONE } else { ids[n as usize] };
    assert_eq!(patched, fresh.neighbours.iter().map(|n| n.map(named)).collect::<Vec<_>>());
}

#[test]
fn what_is_refused_is_named() {
    let good = around_an_edge(3, 0.5);
    let refuse = |change: fn(&mut Tets, &mut ImproveSettings, &mut Vec<bool>, &mut [[f64; 3]; 2])| {
        let (mut tets, mut settings, mut flags, mut bounds) = (good.clone(), ImproveSettings::default(), vec![], BOX);
        change(&mut tets, &mut settings, &mut flags, &mut bounds);
        let (before, nothing) = (tets.clone(), Strata::new(vec![]));
        let error = improve(&mut tets, &nothing, &flags, bounds, &settings, &mut go).unwrap_err();
        assert_eq!(format!("{before:?}"), format!("{tets:?}"));
        error.to_string()
    };
    assert_eq!(
        refuse(|_, s, _, _| s.least_angle_deg = f64::NAN),
        "the least angle in degrees is NaN: expected more than 0, at most 60"
    );
    assert_eq!(
        refuse(|_, s, _, _| s.greatest_angle_deg = 180.0),
        "the greatest angle in degrees is 180: expected at least 80, less than 180"
    );
    assert_eq!(refuse(|_, s, _, _| s.least_quality = 0.0), "the least quality is 0: expected more than 0, at most 1");
    assert_eq!(
        refuse(|_, _, _, b| b[1][2] = -20.0),
        "axis 2 of the box runs from -1e1 to -2e1: it needs finite low < high"
    );
    assert_eq!(refuse(|_, _, f, _| f.push(true)), "1 flags of conforming borders for 0 solids: give one each, or none");
    assert_eq!(refuse(|t, _, _, _| t.regions.truncate(1)), "1 regions for 3 cells");
    assert_eq!(refuse(|t, _, _, _| t.regions[2] = 5), "cell 2 has region 5: expected at most 0");
    assert_eq!(refuse(|t, _, _, _| t.cells[1][3] = 99), "cell 1 names point 99, but there are 5");
    assert!(refuse(|t, _, _, _| t.cells[1].swap(0, 1)).starts_with("cell 1 has volume -"));
    assert_eq!(refuse(|t, _, _, _| t.points[0][0] = f64::NAN), "cell 0 has volume NaN: expected a positive one");
    assert_eq!(
        refuse(|t, _, _, _| {
            t.cells.push(t.cells[0]);
            t.regions.push(0);
        }),
        "cells 0 and 2 meet a facet from the same side, or a third one does"
    );
}
