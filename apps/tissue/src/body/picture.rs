//! The pictures of a run: the deformed body, and energies over time.

use super::instants::Instant;
use crate::error::RunError;
use crate::history::HistoryRow;
use crate::output::plot_error;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_plot::{Chart, MeshPanel, MeshPicture, PlotError, Series, SolidPanel, SolidPicture, outline_of};
use stylet_solver::vector;

/// Draws the deformed body coloured by displacement, and the energies where there are several rows.
///
/// # Errors
/// [`RunError::Output`].
pub(super) fn draw<const D: usize, const N: usize>(
    name: &str,
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    rows: &[HistoryRow],
    folder: &Path,
) -> Result<(), RunError> {
    let path = folder.join("mesh.svg");
    body(name, mesh, u, &path).map_err(|e| plot_error(&path, e))?;
    if rows.len() < 2 {
        return Ok(());
    }
    let path = folder.join("energy.svg");
    energies(name, rows).write(&path).map_err(|e| plot_error(&path, e))
}

/// Draws the instants that were kept side by side, the outside of solids; nothing if there are none.
///
/// # Errors
/// [`RunError::Output`].
pub(super) fn draw_instants<const D: usize, const N: usize>(
    name: &str,
    mesh: &SimplexMesh<D, N>,
    instants: &[Instant],
    folder: &Path,
) -> Result<(), RunError> {
    if instants.is_empty() {
        return Ok(());
    }
    let title = format!("{name}: {} elements", mesh.n_cells());
    let drawn: Vec<Drawn> = instants.iter().map(|instant| Drawn::of(mesh, &instant.u)).collect();
    let times = instants.iter().map(|instant| format!("{:.3} s", instant.t));
    let path = folder.join("instants.svg");
    let written = if D == 2 {
        let pictures = drawn.iter().zip(times).map(|(drawn, time)| drawn.plane(time)).collect();
        MeshPanel { title, pictures, colour_label: COLOURS.into(), columns: drawn.len().min(4), ..MeshPanel::default() }
            .write(&path)
    } else {
        let pictures = drawn.iter().zip(times).map(|(drawn, time)| drawn.solid(time)).collect();
        SolidPanel { title, pictures, colour_label: COLOURS.into(), ..SolidPanel::default() }.write(&path)
    };
    written.map_err(|e| plot_error(&path, e))
}

fn body<const D: usize, const N: usize>(
    name: &str,
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    path: &Path,
) -> Result<(), PlotError> {
    let title = format!("{name}: {} elements", mesh.n_cells());
    let drawn = Drawn::of(mesh, u);
    if D == 2 { drawn.plane(title).write(path) } else { drawn.solid(title).write(path) }
}

/// What the colours mean.
const COLOURS: &str = "displacement (mm)";

/// A deformed mesh as pictures take it: in two dimensions triangles, in three tetrahedra.
struct Drawn {
    rest: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    places: Vec<[f64; 2]>,
    tetrahedra: Vec<[u32; 4]>,
    points: Vec<[f64; 3]>,
    /// By vertex in two dimensions, by tetrahedron in three.
    millimetres: Vec<f64>,
}

impl Drawn {
    fn of<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>, u: &[f64]) -> Self {
        let by_vertex: Vec<f64> = u.chunks_exact(D).map(|u| 1e3 * vector::norm2(u)).collect();
        let place = |v: usize, k: usize| if k < D { mesh.points()[v][k] + u[D * v + k] } else { 0.0 };
        let vertices = 0..mesh.n_vertex_slots();
        let mut drawn = Self {
            rest: Vec::new(),
            triangles: Vec::new(),
            places: Vec::new(),
            tetrahedra: Vec::new(),
            points: Vec::new(),
            millimetres: Vec::new(),
        };
        if D == 2 {
            drawn.rest = mesh.points().iter().map(|x| [x[0], x[1]]).collect();
            drawn.triangles = mesh.cells().map(|c| std::array::from_fn(|k| mesh.cell(c)[k].0)).collect();
            drawn.places = vertices.map(|v| [place(v, 0), place(v, 1)]).collect();
            drawn.millimetres = by_vertex;
        } else {
            drawn.tetrahedra = mesh.cells().map(|c| std::array::from_fn(|k| mesh.cell(c)[k].0)).collect();
            drawn.points = vertices.map(|v| std::array::from_fn(|k| place(v, k))).collect();
            let mean = |v: &[u32; 4]| v.iter().map(|&v| by_vertex[v as usize]).sum::<f64>() / 4.0;
            drawn.millimetres = drawn.tetrahedra.iter().map(mean).collect();
        }
        drawn
    }

    fn plane(&self, title: String) -> MeshPicture<'_> {
        MeshPicture {
            points: &self.places,
            triangles: &self.triangles,
            values: &self.millimetres,
            title,
            colour_label: COLOURS.into(),
            outline: outline_of(&self.rest, &self.triangles),
            ..MeshPicture::default()
        }
    }

    fn solid(&self, title: String) -> SolidPicture<'_> {
        SolidPicture {
            points: &self.points,
            tetrahedra: &self.tetrahedra,
            values: &self.millimetres,
            title,
            colour_label: COLOURS.into(),
            ..SolidPicture::default()
        }
    }
}

fn energies(name: &str, rows: &[HistoryRow]) -> Chart {
    let series = |label: &str, column: usize| Series {
        name: label.to_owned(),
        points: rows.iter().map(|row| (row.time_s, row.quantities.get(column).copied().unwrap_or(f64::NAN))).collect(),
        ..Series::default()
    };
    Chart {
        title: format!("{name}: energies"),
        x_label: "time (s)".to_owned(),
        y_label: "energy (J)".to_owned(),
        series: vec![series("strain", 0), series("kinetic", 1), series("load", 2)],
        ..Chart::default()
    }
}
