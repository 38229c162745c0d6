//! The pictures of a run.

mod cut_open;
mod events;
mod slip;

use crate::geometry::Surface;
use crate::motion::Motion;
use crate::record::Trace;
use crate::run::Run;
use std::path::Path;
use stylet_plot::{Chart, PlotError, Series, Style};
use stylet_tissue::history::HistoryRow;
use stylet_tissue::output::{output_error, plot_error};
use stylet_tissue::stages::{Stage, Stages};
use stylet_tissue::{RunError, Simulation};

type Vec3 = [f64; 3];

/// Shorter times than this are one to the picture of stages, s.
const SHORTEST: f64 = 1e-5;

/// Draws all pictures, and writes tables of markers and seeds.
///
/// # Errors
/// [`RunError::Output`].
pub(crate) fn draw(run: &Run, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError> {
    let path = folder.join("mesh.svg");
    cut_open::draw(run, &path).map_err(|error| plot_error(&path, error))?;
    tables(run, folder)?;
    if rows.len() < 2 {
        return Ok(());
    }
    let charts = [
        ("path.svg", tip_path(run)),
        ("force.svg", force(run)),
        ("states.svg", states(run)),
        ("stages.svg", stages(run, rows)),
    ];
    for (name, chart) in charts {
        let path = folder.join(name);
        match chart.write(&path) {
            // A needle that never touched has no path and no states.
            Ok(()) | Err(PlotError::Empty { .. }) => {}
            Err(error) => return Err(plot_error(&path, error)),
        }
    }
    Ok(())
}

/// Directions of a needle's own view: along it, towards the viewer, and up, where the bevel bends it at the start.
fn axes(run: &Run) -> [Vec3; 3] {
    let needle = &run.opened.needles[0];
    let along = needle.direction;
    let part: f64 = (0..3).map(|k| along[k] * needle.bevel_direction[k]).sum();
    let up: Vec3 = std::array::from_fn(|k| needle.bevel_direction[k] - part * along[k]);
    let length = up.iter().map(|x| x * x).sum::<f64>().sqrt();
    let up = up.map(|x| x / length);
    [along, stylet_mesh::geometry::cross(&along, &up), up]
}

fn dot(p: &Vec3, q: &Vec3) -> f64 {
    (0..3).map(|k| p[k] * q[k]).sum()
}

/// Where the tips went, from two sides.
fn tip_path(run: &Run) -> Chart {
    let [along, side, up] = axes(run);
    let base = run.opened.needles[0].base;
    let at = |x: &Vec3, axis: &Vec3| 1e3 * (dot(x, axis) - dot(&base, axis));
    let mut series = Vec::new();
    for (k, traces) in run.record.traces.iter().enumerate() {
        let of = if run.record.traces.len() > 1 { format!("needle {}, ", k + 1) } else { String::new() };
        for (view, (axis, name)) in [(&up, "from the side"), (&side, "from above")].into_iter().enumerate() {
            // On the way in: the way back is in the same channel.
            let deepest = traces.iter().map(|trace| trace.depth).fold(0.0, f64::max);
            let last = traces.iter().position(|trace| trace.depth >= deepest).unwrap_or(0);
            let way = |place: &dyn Fn(&Trace) -> Option<Vec3>| {
                let points = traces[..traces.len().min(last + 1)].iter().filter_map(place);
                points.map(|x| (at(&x, &along), at(&x, axis))).collect::<Vec<_>>()
            };
            let colour = Some(2 * k + view);
            let at_entry = traces.iter().find_map(|trace| trace.reference);
            let pierced = events::puncture(traces).map_or(f64::INFINITY, |trace| trace.t);
            series.push(Series {
                name: format!("{of}{name}: in the undeformed tissue"),
                points: way(&|trace| trace.reference),
                colour,
                ..Series::default()
            });
            series.push(Series {
                name: format!("{of}{name}: in space"),
                points: way(&|trace| (trace.t >= pierced).then_some(trace.tip)),
                colour,
                dashed: true,
                ..Series::default()
            });
            series.push(Series {
                name: if view == 0 { format!("{of}entry") } else { String::new() },
                points: at_entry.map(|x| (at(&x, &along), at(&x, axis))).into_iter().collect(),
                style: Style::Points,
                colour: Some(3),
                ..Series::default()
            });
        }
    }
    let markers =
        [(&up, "from the side"), (&side, "from above")].into_iter().enumerate().map(|(view, (axis, name))| Series {
            name: format!("markers, {name}"),
            points: run.record.markers.iter().map(|marker| (at(&marker.at, &along), at(&marker.at, axis))).collect(),
            style: Style::Points,
            colour: Some(view),
            ..Series::default()
        });
    series.extend(markers.filter(|series| !series.points.is_empty()));
    let views = [(&up, "seeds"), (&side, "")].into_iter();
    let seeds = views.map(|(axis, name)| Series {
        name: name.to_owned(),
        points: run.record.seeds.iter().map(|(.., seed)| (at(&seed.at, &along), at(&seed.at, axis))).collect(),
        style: Style::Points,
        colour: Some(4),
        ..Series::default()
    });
    series.extend(seeds.filter(|series| !series.points.is_empty()));
    Chart {
        title: format!("{}: path of the tip", run.opened.scene.name),
        x_label: "along the needle, from the sleeve (mm)".to_owned(),
        y_label: "across (mm)".to_owned(),
        note: "Not drawn: the tip in space while it dents the skin, which then springs back along the needle and takes the tip \
               with it for a few steps."
            .to_owned(),
        equal: true,
        series,
        ..Chart::default()
    }
}

/// The force of the sleeve on the needle over time.
fn force(run: &Run) -> Chart {
    let [along, side, up] = axes(run);
    let mut series = Vec::new();
    for (k, traces) in run.record.traces.iter().enumerate() {
        let of = if run.record.traces.len() > 1 { format!("needle {}, ", k + 1) } else { String::new() };
        for (j, (axis, name)) in [(along, "along it"), (up, "up"), (side, "aside")].into_iter().enumerate() {
            series.push(Series {
                name: format!("{of}{name}"),
                points: traces.iter().map(|trace| (trace.t, dot(&trace.force, &axis))).collect(),
                colour: Some(3 * k + j),
                ..Series::default()
            });
        }
    }
    let surfaces = layers(run);
    let layers: Vec<events::Layer> = surfaces
        .iter()
        .map(|(name, surface, thickness)| events::Layer { name, surface: surface.as_ref(), thickness: *thickness })
        .collect();
    let needles = run.record.traces.iter().zip(&run.opened.motions).enumerate();
    let of_needle = |(k, (traces, motion)): (usize, (&Vec<Trace>, &Motion))| {
        let of = if run.record.traces.len() > 1 { format!("needle {}: ", k + 1) } else { String::new() };
        let named = move |(t, name): (f64, String)| (t, format!("{of}{name}"));
        events::of(traces, &layers, motion).into_iter().map(named).collect::<Vec<_>>()
    };
    let marks = needles.flat_map(of_needle).collect();
    Chart {
        title: format!("{}: force of the sleeve on the needle", run.opened.scene.name),
        x_label: "time (s)".to_owned(),
        y_label: "force (N)".to_owned(),
        series,
        marks,
        ..Chart::default()
    }
}

/// Layers that the scene has around its regions, with names, surfaces and thicknesses; the skin is known by the depth.
fn layers(run: &Run) -> Vec<(String, Surface, f64)> {
    let rows = run.opened.scene.membranes.iter();
    let of = rows.filter_map(|row| Some((row.value("of")?.text().ok()?.to_owned(), row.get("thickness")?)));
    of.filter(|(name, _)| name != "body")
        .filter_map(|(name, thickness)| {
            let surface = run.opened.geometry.surface(&name).ok()?;
            Some((format!("capsule of {name}"), surface, thickness))
        })
        .collect()
}

/// Friction states along the first needle over time.
fn states(run: &Run) -> Chart {
    let traces = run.record.traces.first().map_or(&[][..], |traces| traces);
    let of = if run.record.traces.len() > 1 { " of needle 1" } else { "" };
    slip::chart(traces, format!("{}: friction states along the shaft{of}", run.opened.scene.name))
}

/// What each step took, by stage.
fn stages(run: &Run, rows: &[HistoryRow]) -> Chart {
    let columns = run.columns();
    // A stage that takes next to nothing in most steps would be a line along the lower edge.
    let is_seen = |&&stage: &&Stage| {
        2 * rows.iter().filter(|row| row.stage_seconds[stage as usize] >= SHORTEST).count() >= rows.len()
    };
    let series = |&stage: &Stage| Series {
        name: Stages::names()[stage as usize].to_owned(),
        points: rows.iter().map(|row| (row.time_s, 1e3 * row.stage_seconds[stage as usize].max(SHORTEST))).collect(),
        ..Series::default()
    };
    Chart {
        title: format!("{}: time of each step by stage", run.opened.scene.name),
        x_label: "time (s)".to_owned(),
        y_label: "wall time (ms)".to_owned(),
        log_y: true,
        series: columns.stages.iter().filter(is_seen).map(series).collect(),
        note: format!("Less than {} ms is drawn as that.", 1e3 * SHORTEST),
        ..Chart::default()
    }
}

/// `markers.csv`, in the layout that `markers.file` has, and `seeds.csv`.
fn tables(run: &Run, folder: &Path) -> Result<(), RunError> {
    use std::fmt::Write as _;
    let record = &run.record;
    let mut files = Vec::new();
    if !record.markers.is_empty() {
        let mut text = String::from("time_s");
        for marker in &record.markers {
            let name = &marker.name;
            let _ = write!(text, ",{name}_x,{name}_y,{name}_z");
        }
        text.push('\n');
        for (t, places) in &record.track {
            let _ = write!(text, "{t:?}");
            places.iter().flatten().for_each(|x| text += &format!(",{x:?}"));
            text.push('\n');
        }
        files.push(("markers.csv", text));
    }
    if !record.seeds.is_empty() {
        let mut text = String::from("needle,depth_m,at_x,at_y,at_z,x,y,z\n");
        for seed in record.seed_summaries() {
            let _ = write!(text, "{},{:?}", seed.needle, seed.depth_m);
            seed.at.iter().chain(&seed.place).for_each(|x| text += &format!(",{x:?}"));
            text.push('\n');
        }
        files.push(("seeds.csv", text));
    }
    for (name, text) in files {
        let path = folder.join(name);
        std::fs::write(&path, text).map_err(|error| output_error(&path, error))?;
    }
    Ok(())
}
