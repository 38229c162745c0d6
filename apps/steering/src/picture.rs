//! The pictures of a run.

use crate::record::{Snapshot, Trace, snapshot};
use crate::run::Run;
use std::path::Path;
use stylet_physics::coupling::SlipState;
use stylet_plot::{
    Chart, Colour, Cut, PALETTE, Picture, PlotError, Series, SideBySide, SolidPicture, SpaceLine, Style,
};
use stylet_tissue::history::HistoryRow;
use stylet_tissue::output::{output_error, plot_error};
use stylet_tissue::stages::{Stage, Stages};
use stylet_tissue::{RunError, Simulation};

type Vec3 = [f64; 3];

/// Draws all pictures, and writes tables of markers and seeds.
///
/// # Errors
/// [`RunError::Output`].
pub(crate) fn draw(run: &Run, folder: &Path, rows: &[HistoryRow]) -> Result<(), RunError> {
    let path = folder.join("mesh.svg");
    cut_open(run, &path).map_err(|error| plot_error(&path, error))?;
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

/// The tissue cut open along the needle when it was deepest: its regions, and how far it has moved.
fn cut_open(run: &Run, path: &Path) -> Result<(), PlotError> {
    let now = snapshot(run.frame_time(), &run.insertion, &run.record.markers);
    let shot = run.record.snapshot.as_ref().unwrap_or(&now);
    let axes = axes(run);
    // The viewer of a picture looks along its second axis, and its third one points up.
    let seen = |x: &Vec3| -> Vec3 { [dot(x, &axes[0]), -dot(x, &axes[1]), dot(x, &axes[2])] };
    let points: Vec<Vec3> = shot.points.iter().map(seen).collect();
    let regions: Vec<f64> = shot.regions.iter().map(|&region| f64::from(region)).collect();
    let millimetres: Vec<f64> = shot.moved.iter().map(|moved| 1e3 * moved).collect();
    let base = seen(&run.opened.needles[0].base);
    let picture = |values| SolidPicture {
        points: &points,
        tetrahedra: &shot.tetrahedra,
        values,
        cut: Some(Cut::through(base, [0.0, -1.0, 0.0])),
        towards: [0.12, -1.0, 0.25],
        axis_names: [axis_name(&axes[0], "along"), axis_name(&axes[1].map(|x| -x), "away"), axis_name(&axes[2], "up")],
        lines: shafts(shot, seen).into_iter().chain(trails(run, shot, seen)).collect(),
        size: [520.0, 480.0],
        ..SolidPicture::default()
    };
    let names = run.opened.geometry.regions.iter().map(|region| region.name.clone()).collect();
    let by_region = SolidPicture {
        by_region: true,
        region_names: names,
        colour_label: "region".to_owned(),
        title: "regions".to_owned(),
        ..picture(&regions)
    };
    let moved = SolidPicture {
        colour_label: "displacement (mm)".to_owned(),
        title: "how far the tissue has moved".to_owned(),
        ..picture(&millimetres)
    };
    let title = format!("{}: cut open along the needle at {:.2} s", run.opened.scene.name, shot.t);
    SideBySide { title, pictures: vec![Picture::Solid(by_region), Picture::Solid(moved)] }.write(path)
}

/// The axis of space that a direction is along, with its sign; another name for others.
fn axis_name(direction: &Vec3, otherwise: &'static str) -> &'static str {
    let along = |k: usize, sign: f64| sign * direction[k] > 1.0 - 1e-9;
    let names = [("x", 0, 1.0), ("y", 1, 1.0), ("z", 2, 1.0), ("-x", 0, -1.0), ("-y", 1, -1.0), ("-z", 2, -1.0)];
    names.iter().find(|(_, k, sign)| along(*k, *sign)).map_or(otherwise, |(name, ..)| name)
}

fn shafts(shot: &Snapshot, seen: impl Fn(&Vec3) -> Vec3) -> Vec<SpaceLine> {
    let line = |(k, shaft): (usize, &Vec<Vec3>)| SpaceLine {
        points: shaft.iter().map(&seen).collect(),
        colour: if k == 0 { Colour::INK } else { PALETTE[k % PALETTE.len()] },
        label: if k == 0 { "needle and tip".to_owned() } else { format!("needle {}", k + 1) },
        tip: true,
        ..SpaceLine::default()
    };
    shot.shafts.iter().enumerate().map(line).collect()
}

/// Markers as short crosses: a line of no length is not seen.
fn trails(run: &Run, shot: &Snapshot, seen: impl Fn(&Vec3) -> Vec3) -> Vec<SpaceLine> {
    let size =
        0.01 * (0..3).map(|k| run.opened.geometry.bounds[1][k] - run.opened.geometry.bounds[0][k]).fold(0.0, f64::max);
    let cross = |(k, marker): (usize, &Vec3)| {
        let [x, y, z] = seen(marker);
        let gap = [f64::NAN; 3];
        SpaceLine {
            points: vec![[x - size, y, z], [x + size, y, z], gap, [x, y, z - size], [x, y, z + size]],
            colour: PALETTE[1],
            width: 2.0,
            label: if k == 0 { "markers".to_owned() } else { String::new() },
            tip: false,
        }
    };
    shot.markers.iter().enumerate().map(cross).collect()
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
            let way = |place: fn(&Trace) -> Option<Vec3>| {
                let points = traces[..traces.len().min(last + 1)].iter().filter_map(place);
                points.map(|x| (at(&x, &along), at(&x, axis))).collect::<Vec<_>>()
            };
            let colour = Some(2 * k + view);
            series.push(Series {
                name: format!("{of}{name}: in the undeformed tissue"),
                points: way(|trace| trace.reference),
                colour,
                ..Series::default()
            });
            series.push(Series {
                name: format!("{of}{name}: in space"),
                points: way(|trace| Some(trace.tip)),
                colour,
                dashed: true,
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
    let seeds: Vec<(f64, f64)> =
        run.record.seeds.iter().map(|(.., seed)| (at(&seed.at, &along), at(&seed.at, &up))).collect();
    if !seeds.is_empty() {
        let name = "seeds, from the side".to_owned();
        series.push(Series { name, points: seeds, style: Style::Points, colour: Some(4), ..Series::default() });
    }
    Chart {
        title: format!("{}: path of the tip", run.opened.scene.name),
        x_label: "along the needle, from the sleeve (mm)".to_owned(),
        y_label: "across: up in the view from the side (mm)".to_owned(),
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
    Chart {
        title: format!("{}: force of the sleeve on the needle", run.opened.scene.name),
        x_label: "time (s)".to_owned(),
        y_label: "force (N)".to_owned(),
        series,
        ..Chart::default()
    }
}

/// Friction states along the first needle over time.
fn states(run: &Run) -> Chart {
    let traces = run.record.traces.first().map_or(&[][..], |traces| traces);
    let of = |wanted: SlipState, name: &str, colour| Series {
        name: name.to_owned(),
        points: traces
            .iter()
            .flat_map(|trace| trace.states.iter().map(move |(s, state)| (trace.t, *s, *state)))
            .filter(|(.., state)| *state == wanted)
            .map(|(t, s, _)| (t, 1e3 * f64::from(s)))
            .collect(),
        style: Style::Points,
        colour: Some(colour),
        ..Series::default()
    };
    Chart {
        title: format!("{}: friction states along the shaft", run.opened.scene.name),
        x_label: "time (s)".to_owned(),
        y_label: "distance from the entry along the needle (mm)".to_owned(),
        series: vec![
            of(SlipState::Static, "sticks", 0),
            of(SlipState::Forward, "slides forward", 1),
            of(SlipState::Backward, "slides back", 2),
        ],
        ..Chart::default()
    }
}

/// What each step took, by stage.
fn stages(run: &Run, rows: &[HistoryRow]) -> Chart {
    let columns = run.columns();
    let series = |&stage: &Stage| Series {
        name: Stages::names()[stage as usize].to_owned(),
        points: rows.iter().map(|row| (row.time_s, 1e3 * row.stage_seconds[stage as usize])).collect(),
        ..Series::default()
    };
    Chart {
        title: format!("{}: time of each step by stage", run.opened.scene.name),
        x_label: "time (s)".to_owned(),
        y_label: "wall time (ms)".to_owned(),
        series: columns.stages.iter().map(series).collect(),
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
