//! The tissue cut open along the first needle: what it is made of and how far it has moved, and the same at other times.

use super::{Vec3, axes, dot};
use crate::record::{Snapshot, distance};
use crate::run::Run;
use std::path::Path;
use stylet_plot::{Colour, Cut, PALETTE, Picture, PlotError, SideBySide, SolidPicture, SpaceLine, SpaceMarks, Symbol};
use stylet_tissue::Simulation;

/// Yellow: the one colour that neither tissue nor needles have.
const SEED: Colour = Colour(0xf0, 0xe4, 0x42);
const MARKER: Colour = PALETTE[0];
/// Greatest width and height of the tissue on the page, px.
const LARGE: [f64; 2] = [520.0, 480.0];
const SMALL: [f64; 2] = [330.0, 300.0];

/// Draws the tissue when the needles were deepest, and smaller on the way in, then and at the end.
pub(super) fn draw(run: &Run, path: &Path) -> Result<(), PlotError> {
    let now = run.record.snapshot(run.frame_time(), &run.insertion);
    let shots = story(&run.record.snapshots, &now, run.opened.scene.time.dt);
    let views: Vec<View> = shots.iter().map(|shot| View::new(run, shot)).collect();
    let Some(main) = views.iter().max_by(|a, b| out(a.shot).total_cmp(&out(b.shot))) else { return Ok(()) };
    let large = [
        SolidPicture { title: "regions".to_owned(), ..main.by_region(run, LARGE) },
        SolidPicture { title: "how far the tissue has moved".to_owned(), ..main.by_movement(LARGE) },
    ];
    let mut below = Vec::new();
    for view in views.iter().filter(|_| views.len() > 1) {
        let title = moment(view.shot, main.shot);
        below.push(Picture::Solid(SolidPicture { title, key: false, ..view.by_region(run, SMALL) }));
    }
    let title = format!("{}: cut open along the needle at {:.2} s", run.opened.scene.name, main.shot.t);
    SideBySide { title, pictures: large.into_iter().map(Picture::Solid).collect(), below }.write(path)
}

/// The moments to show, in order of time: those kept, and the present one, unless it comes within a step of the last one kept.
fn story<'a>(kept: &'a [Snapshot], now: &'a Snapshot, dt: f64) -> Vec<&'a Snapshot> {
    let last = kept.last().map_or(f64::NEG_INFINITY, |shot| shot.t);
    let is_new = now.t > last + 0.5 * dt;
    kept.iter().chain(is_new.then_some(now)).collect()
}

/// How much of the needles is out of their sleeves, m.
fn out(shot: &Snapshot) -> f64 {
    shot.shafts.iter().flat_map(|shaft| shaft.windows(2)).map(|ends| distance(&ends[0], &ends[1])).sum()
}

/// What a small picture shows, and how far the tissue has moved at most.
fn moment(shot: &Snapshot, main: &Snapshot) -> String {
    let name = match shot.t.total_cmp(&main.t) {
        std::cmp::Ordering::Less => "on the way in",
        std::cmp::Ordering::Equal => "deepest",
        std::cmp::Ordering::Greater => "at the end",
    };
    let moved = 1e3 * shot.moved.iter().copied().fold(0.0, f32::max);
    format!("{name}, {:.1} s: \u{2264} {moved:.2} mm", shot.t)
}

/// A snapshot in the axes of the picture and in mm. The viewer looks along the second axis, and the third one points up.
struct View<'a> {
    shot: &'a Snapshot,
    axes: [Vec3; 3],
    base: Vec3,
    points: Vec<Vec3>,
    regions: Vec<f64>,
    millimetres: Vec<f64>,
    names: [&'static str; 3],
}

impl<'a> View<'a> {
    fn new(run: &Run, shot: &'a Snapshot) -> Self {
        let axes = axes(run);
        let mut view = Self {
            shot,
            axes,
            base: run.opened.needles[0].base,
            points: Vec::new(),
            regions: shot.regions.iter().map(|&region| f64::from(region)).collect(),
            millimetres: shot.moved.iter().map(|moved| 1e3 * f64::from(*moved)).collect(),
            names: [name(&axes[0], "along"), name(&axes[1].map(|x| -x), "away"), name(&axes[2], "up")],
        };
        view.points = shot.points.iter().map(|x| view.seen(&x.map(f64::from))).collect();
        view
    }

    fn seen(&self, x: &Vec3) -> Vec3 {
        [dot(x, &self.axes[0]), -dot(x, &self.axes[1]), dot(x, &self.axes[2])].map(|x| 1e3 * x)
    }

    fn picture<'p>(&'p self, values: &'p [f64], size: [f64; 2]) -> SolidPicture<'p> {
        SolidPicture {
            points: &self.points,
            tetrahedra: &self.shot.tetrahedra,
            values,
            cut: Some(Cut::through(self.seen(&self.base), [0.0, -1.0, 0.0])),
            towards: [0.12, -1.0, 0.25],
            axis_names: self.names,
            unit: "mm",
            lines: self.shafts(),
            marks: self.marks(),
            size,
            ..SolidPicture::default()
        }
    }

    fn by_region<'p>(&'p self, run: &Run, size: [f64; 2]) -> SolidPicture<'p> {
        SolidPicture {
            by_region: true,
            region_names: run.opened.geometry.regions.iter().map(|region| region.name.clone()).collect(),
            colour_label: "region".to_owned(),
            ..self.picture(&self.regions, size)
        }
    }

    fn by_movement(&self, size: [f64; 2]) -> SolidPicture<'_> {
        SolidPicture { colour_label: "displacement (mm)".to_owned(), ..self.picture(&self.millimetres, size) }
    }

    fn shafts(&self) -> Vec<SpaceLine> {
        let line = |(k, shaft): (usize, &Vec<Vec3>)| SpaceLine {
            points: shaft.iter().map(|x| self.seen(x)).collect(),
            colour: if k == 0 { Colour::INK } else { PALETTE[k % PALETTE.len()] },
            label: if k == 0 { "needle and tip".to_owned() } else { format!("needle {}", k + 1) },
            tip: true,
            ..SpaceLine::default()
        };
        self.shot.shafts.iter().enumerate().map(line).collect()
    }

    fn marks(&self) -> Vec<SpaceMarks> {
        let of = |places: &[Vec3], colour, symbol, label: &str| SpaceMarks {
            points: places.iter().map(|x| self.seen(x)).collect(),
            colour,
            symbol,
            label: label.to_owned(),
        };
        vec![
            of(&self.shot.markers, MARKER, Symbol::Cross, "markers"),
            of(&self.shot.seeds, SEED, Symbol::Disc, "seeds"),
        ]
    }
}

/// The axis of space that a direction is along, with its sign; another name for others.
fn name(direction: &Vec3, otherwise: &'static str) -> &'static str {
    let along = |k: usize, sign: f64| sign * direction[k] > 1.0 - 1e-9;
    let names = [("x", 0, 1.0), ("y", 1, 1.0), ("z", 2, 1.0), ("-x", 0, -1.0), ("-y", 1, -1.0), ("-z", 2, -1.0)];
    names.iter().find(|(_, k, sign)| along(*k, *sign)).map_or(otherwise, |(name, ..)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shot(t: f64) -> Snapshot {
        Snapshot { t, moved: vec![2e-4, 1e-3], ..Snapshot::default() }
    }

    #[test]
    fn the_end_is_a_moment_of_its_own_unless_the_needles_are_deepest_then() {
        let times = |shots: Vec<&Snapshot>| shots.iter().map(|shot| shot.t).collect::<Vec<_>>();
        let kept = [shot(2.0), shot(5.0)];
        assert_eq!(times(story(&kept, &shot(9.4), 0.02)), [2.0, 5.0, 9.4]);
        assert_eq!(times(story(&kept, &shot(5.0), 0.02)), [2.0, 5.0]);
        assert_eq!(times(story(&[], &shot(1.0), 0.02)), [1.0]);
    }

    #[test]
    fn moments_are_named_by_their_order() {
        let main = shot(5.0);
        let names = [2.1, 5.0, 9.4].map(|t| moment(&shot(t), &main));
        assert_eq!(names[0], "on the way in, 2.1 s: \u{2264} 1.00 mm");
        assert!(names[1].starts_with("deepest, 5.0 s") && names[2].starts_with("at the end, 9.4 s"));
    }
}
