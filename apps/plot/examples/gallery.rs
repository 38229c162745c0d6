//! Draws one picture of each sort, of made-up fields: `cargo run -p stylet-plot --example gallery -- out/gallery`.
//!
//! ```text
//!   work_precision.svg   log-log chart with pairs of solid and dashed series
//!   forces.svg           a long history in lines and steps, with a limit
//!   slab.svg             a deformed slab with a needle, 512 triangles
//!   slab_fine.svg        the same with 33 000 triangles
//!   pair.svg             two fields with one colour scale
//! ```

use std::error::Error;
use std::f64::consts::PI;
use std::path::PathBuf;

use stylet_plot::{
    Chart, Colour, ColourMap, Marker, MeshPanel, MeshPicture, PALETTE, Polyline, Series, Style, outline_of,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).unwrap_or_else(|| "out/gallery".into()));
    std::fs::create_dir_all(&folder)?;
    work_precision().write(folder.join("work_precision.svg"))?;
    forces().write(folder.join("forces.svg"))?;
    let (coarse, fine) = (Slab::new(16), Slab::new(128));
    coarse.picture("Needle in a slab, 512 triangles").write(folder.join("slab.svg"))?;
    fine.picture("Needle in a slab, 32 768 triangles").write(folder.join("slab_fine.svg"))?;
    pair(&coarse, &fine).write(folder.join("pair.svg"))?;
    println!("5 pictures in {}", folder.display());
    Ok(())
}

fn work_precision() -> Chart {
    let run = |name: &str, rate: f64, colour: usize, dashed: bool| Series {
        name: name.into(),
        points: (0..9).map(|i| (1e-3 * 1.9f64.powi(i), 0.2 * 10f64.powf(-rate * f64::from(i)))).collect(),
        style: Style::LinePoints,
        dashed,
        colour: Some(colour),
    };
    Chart {
        title: "Error against time, slab with 16 384 unknowns".into(),
        x_label: "time of a solve (s)".into(),
        y_label: "relative error of the displacement".into(),
        log_x: true,
        log_y: true,
        series: vec![
            run("projected CG", 0.9, 0, false),
            run("projected CG, published", 0.8, 0, true),
            run("Newton-CG", 1.35, 1, false),
            run("Newton-CG, published", 1.2, 1, true),
            run("nonlinear CG", 0.5, 2, false),
        ],
        ..Chart::default()
    }
}

fn forces() -> Chart {
    let time = |i: u32| f64::from(i) * 1e-3;
    let wobble = |t: f64| 0.04 * (40.0 * t).sin() + 0.02 * (333.0 * t).sin();
    let base = (0..20_000).map(time).map(|t| (t, 0.11 * t + wobble(t))).collect();
    let friction = (0..20).map(|i| (f64::from(i), 0.1 * f64::from(i))).collect();
    Chart {
        title: "Force on the needle".into(),
        x_label: "time (s)".into(),
        y_label: "axial force (N)".into(),
        series: vec![
            Series { name: "base".into(), points: base, ..Series::default() },
            Series { name: "friction".into(), points: friction, style: Style::Steps, ..Series::default() },
            Series {
                name: "measured".into(),
                points: (1..10)
                    .map(|i| (2.0 * f64::from(i), 0.23 * f64::from(i) + 0.05))
                    .chain([(5.0, f64::NAN)])
                    .collect(),
                style: Style::Points,
                ..Series::default()
            },
        ],
        levels: vec![(1.6, "puncture of the capsule".into())],
        ..Chart::default()
    }
}

/// A slab of 0.1 m, pushed down and sideways by a needle at half its height.
struct Slab {
    rest: Vec<[f64; 2]>,
    points: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    /// Length of the displacement, mm.
    values: Vec<f64>,
}

fn displacement([x, y]: [f64; 2]) -> [f64; 2] {
    let (s, t) = (x / 0.1, y / 0.1);
    let bump = (-((s - 0.55).powi(2) + (t - 0.5).powi(2)) / 0.05).exp() * (PI * t).sin();
    [0.012 * bump, 0.002 * bump * (2.0 * PI * s).cos()]
}

impl Slab {
    fn new(n: u32) -> Self {
        let h = 0.1 / f64::from(n);
        let rest: Vec<[f64; 2]> =
            (0..=n).flat_map(|j| (0..=n).map(move |i| [f64::from(i) * h, f64::from(j) * h])).collect();
        let triangles = (0..n)
            .flat_map(|j| (0..n).map(move |i| j * (n + 1) + i))
            .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
            .collect();
        let moved = |p: &[f64; 2]| [p[0] + displacement(*p)[0], p[1] + displacement(*p)[1]];
        let length = |p: &[f64; 2]| 1e3 * displacement(*p)[0].hypot(displacement(*p)[1]);
        let (points, values) = (rest.iter().map(moved).collect(), rest.iter().map(length).collect());
        Self { rest, points, triangles, values }
    }

    fn picture(&self, title: &str) -> MeshPicture<'_> {
        let needle = (0..=40).map(|i| -0.03 + 0.085 * f64::from(i) / 40.0).map(|x| [x, 0.05 + 0.4 * x * x]).collect();
        MeshPicture {
            points: &self.points,
            triangles: &self.triangles,
            values: &self.values,
            title: title.into(),
            colour_label: "displacement (mm)".into(),
            lines: vec![Polyline { points: needle, label: "needle".into(), tip: true, ..Polyline::default() }],
            markers: vec![Marker { at: [0.08, 0.03], colour: PALETTE[1], label: "probe".into() }],
            outline: outline_of(&self.rest, &self.triangles),
            ..MeshPicture::default()
        }
    }
}

/// The field on two meshes, side by side, on the scale for signed values.
fn pair<'a>(coarse: &'a Slab, fine: &'a Slab) -> MeshPanel<'a> {
    let plain = |slab: &'a Slab, title: &str| MeshPicture {
        lines: vec![Polyline {
            points: vec![[0.0, 0.05], [0.055, 0.05]],
            colour: Colour(0, 0, 0),
            ..Polyline::default()
        }],
        markers: Vec::new(),
        ..slab.picture(title)
    };
    MeshPanel {
        title: "Two meshes, one colour scale".into(),
        pictures: vec![plain(coarse, "512 triangles"), plain(fine, "32 768 triangles")],
        colour_label: "displacement (mm)".into(),
        colours: ColourMap::Diverging,
        ..MeshPanel::default()
    }
}
