//! The pictures of a run: the deformed mesh, the force at the base, the iterations of each cycle.

use crate::history::depth_and_force;
use crate::needle::{Needle, Vec2, along, dot};
use crate::scene::Method;
use crate::simulation::Simulation;
use crate::solid_picture;
use crate::tip::deformed;
use std::path::Path;
use stylet_mesh::VertexId;
use stylet_plot::{Chart, Colour, Marker, MeshPicture, PALETTE, PlotError, Polyline, Series, Style, outline_of};
use stylet_tissue::RunError;
use stylet_tissue::history::HistoryRow;
use stylet_tissue::output::plot_error;

/// From this many cycles on, single values are dots around their running mean.
const MANY_CYCLES: usize = 300;
/// From this many on, they are a line, which takes fewer bytes than as many dots.
const MOST_DOTS: usize = 5000;

/// The part of the needle that pictures show, m: from a tenth of the side before the entry to the tip.
pub(crate) fn visible_shaft<const D: usize>(needle: &Needle<D>, side: f64) -> [[f64; D]; 2] {
    // A needle that has been withdrawn is shown at full length.
    let behind = needle.pose().insert.max(0.0) + 0.1 * side;
    [along(needle.tip(), -behind, needle.tangent()), needle.tip()]
}

/// A picture of the mesh, and charts over the cycles where there are several.
///
/// # Errors
/// [`RunError::Output`].
pub fn draw<const D: usize, const N: usize>(
    simulation: &dyn Simulation<D, N>,
    folder: &Path,
    rows: &[HistoryRow],
) -> Result<(), RunError> {
    let path = folder.join("mesh.svg");
    let drawn = if D == 2 { mesh(simulation, &path) } else { solid_picture::cut_open(simulation, &path) };
    drawn.map_err(|e| plot_error(&path, e))?;
    if rows.len() < 2 {
        return Ok(());
    }
    let charts = [("force.svg", force(simulation, rows)), ("iterations.svg", iterations(simulation, rows))];
    for (name, chart) in charts {
        let path = folder.join(name);
        chart.write(&path).map_err(|e| plot_error(&path, e))?;
    }
    Ok(())
}

/// The deformed triangles coloured by the magnitude of the displacement, with the needle and its nodes.
fn mesh<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>, path: &Path) -> Result<(), PlotError> {
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let points: Vec<Vec2> = (0..mesh.n_vertex_slots()).map(|v| plane(deformed(mesh, u, VertexId::new(v)))).collect();
    let rest: Vec<Vec2> = mesh.points().iter().map(|&p| plane(p)).collect();
    let corners = |cell| {
        let v = mesh.oriented(cell);
        [v[0].0, v[1].0, v[2].0]
    };
    let triangles: Vec<[u32; 3]> = mesh.cells().map(corners).collect();
    let millimetres: Vec<f64> = u.chunks_exact(2).map(|u| 1e3 * u[0].hypot(u[1])).collect();
    let picture = MeshPicture {
        points: &points,
        triangles: &triangles,
        values: &millimetres,
        title: mesh_title(simulation),
        colour_label: "displacement (mm)".to_owned(),
        lines: simulation.needle().map(|needle| needle_line(simulation, needle)).into_iter().collect(),
        markers: node_markers(simulation),
        outline: outline_of(&rest, &triangles),
        ..MeshPicture::default()
    };
    picture.write(path)
}

/// The first two coordinates.
fn plane<const D: usize>(p: [f64; D]) -> Vec2 {
    [p[0], p[1]]
}

pub(crate) fn mesh_title<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>) -> String {
    let name = &simulation.scene().name;
    let cells = if D == 2 { "triangles" } else { "tetrahedra" };
    match simulation.needle() {
        Some(needle) => {
            format!("{name}: needle {:.1} mm in, {} {cells}", 1e3 * needle.pose().insert, simulation.mesh().n_cells())
        }
        None => format!("{name}: {} {cells}", simulation.mesh().n_cells()),
    }
}

fn needle_line<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>, needle: &Needle<D>) -> Polyline {
    let line = |points: Vec<Vec2>, label: &str| Polyline {
        points,
        colour: Colour::INK,
        label: label.to_owned(),
        tip: true,
        ..Polyline::default()
    };
    if simulation.scene().friction.is_some() {
        return line(visible_shaft(needle, simulation.scene().mesh.side).map(plane).to_vec(), "needle and tip");
    }
    // The load acts on a line of the undeformed slab, which the tissue carries along.
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let from_entry = simulation.needle_nodes().into_iter().rev();
    line(from_entry.map(|(vertex, _)| plane(deformed(mesh, u, vertex))).collect(), "loaded line, to the tip")
}

/// Sticking and slipping nodes in two colours, each named once in the legend. A static load has neither.
fn node_markers<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>) -> Vec<Marker> {
    if simulation.scene().friction.is_none() {
        return Vec::new();
    }
    let (mesh, u) = (simulation.mesh(), simulation.displacement());
    let mut named = [false; 2];
    let mark = |(vertex, sticks): (VertexId, bool)| {
        let kind = usize::from(sticks);
        let label =
            if std::mem::replace(&mut named[kind], true) { "" } else { ["slipping node", "sticking node"][kind] };
        Marker { at: plane(deformed(mesh, u, vertex)), colour: [PALETTE[4], PALETTE[1]][kind], label: label.to_owned() }
    };
    simulation.needle_nodes().into_iter().map(mark).collect()
}

/// The force that holds the base, along the needle and across it, against the insertion of the tip.
pub fn force<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>, rows: &[HistoryRow]) -> Chart {
    let needle = simulation.needle();
    let along = needle.map_or(crate::needle::direction(0.0, 0.0), Needle::tangent);
    let across = needle.map_or(crate::needle::direction(std::f64::consts::FRAC_PI_2, 0.0), Needle::normal);
    let upward = needle.and_then(Needle::upward);
    let series = |name: &str, direction: [f64; D]| Series {
        name: name.to_owned(),
        points: rows.iter().map(depth_and_force).map(|(depth, force)| (1e3 * depth, dot(force, direction))).collect(),
        ..Series::default()
    };
    Chart {
        title: format!("{}: force at the base of the needle", simulation.scene().name),
        x_label: "insertion of the tip (mm)".to_owned(),
        y_label: "force (N)".to_owned(),
        series: [("along the needle", Some(along)), ("across, to its left", Some(across)), ("across, upwards", upward)]
            .into_iter()
            .filter_map(|(name, direction)| direction.map(|direction| series(name, direction)))
            .collect(),
        ..Chart::default()
    }
}

/// The iterations of each cycle.
pub fn iterations<const D: usize, const N: usize>(simulation: &dyn Simulation<D, N>, rows: &[HistoryRow]) -> Chart {
    let scene = simulation.scene();
    let what = match scene.solver.method {
        Some(Method::NonlinearCg) => "nonlinear CG iterations",
        _ => "CG iterations",
    };
    let points: Vec<(f64, f64)> = rows.iter().map(|row| (row.step as f64, row.iterations as f64)).collect();
    let many = points.len() >= MANY_CYCLES;
    let mean = many.then(|| {
        let half = points.len() / 100;
        Series {
            name: format!("mean over {} cycles", 2 * half + 1),
            points: running_mean(&points, half),
            colour: Some(1),
            ..Series::default()
        }
    });
    let style = match points.len() {
        0..MANY_CYCLES => Style::Steps,
        MANY_CYCLES..MOST_DOTS => Style::Points,
        _ => Style::Line,
    };
    let each = Series {
        name: "one cycle".to_owned(),
        points,
        style,
        colour: Some(if many { 5 } else { 0 }),
        ..Series::default()
    };
    Chart {
        title: format!("{}: {what} per cycle", scene.name),
        x_label: "cycle".to_owned(),
        y_label: what.to_owned(),
        series: std::iter::once(each).chain(mean).collect(),
        ..Chart::default()
    }
}

/// The mean of each ordinate and its `half` neighbours on either side, fewer at the ends.
fn running_mean(points: &[(f64, f64)], half: usize) -> Vec<(f64, f64)> {
    // Sums of iteration counts are exact in f64, so that differences of prefix sums are too.
    let mut sums = Vec::with_capacity(points.len() + 1);
    sums.push(0.0);
    for &(_, y) in points {
        sums.push(sums[sums.len() - 1] + y);
    }
    let mean = |(i, &(x, _)): (usize, &(f64, f64))| {
        let (from, to) = (i.saturating_sub(half), (i + half + 1).min(points.len()));
        (x, (sums[to] - sums[from]) / (to - from) as f64)
    };
    points.iter().enumerate().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_mean_is_the_mean_of_the_window() {
        let points: Vec<(f64, f64)> = (0..50).map(|i| (f64::from(i), f64::from(i * 37 % 11))).collect();
        for (i, (x, mean)) in running_mean(&points, 3).into_iter().enumerate() {
            let window = &points[i.saturating_sub(3)..(i + 4).min(50)];
            let expected = window.iter().map(|p| p.1).sum::<f64>() / window.len() as f64;
            assert_eq!((x, mean), (points[i].0, expected));
        }
    }
}
