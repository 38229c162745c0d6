//! The pictures of a run: the deformed body, and energies over time.

use crate::error::RunError;
use crate::history::HistoryRow;
use crate::output::plot_error;
use std::path::Path;
use stylet_mesh::SimplexMesh;
use stylet_plot::{Chart, MeshPicture, PlotError, Series, SolidPicture, outline_of};

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

fn body<const D: usize, const N: usize>(
    name: &str,
    mesh: &SimplexMesh<D, N>,
    u: &[f64],
    path: &Path,
) -> Result<(), PlotError> {
    let title = format!("{name}: {} elements", mesh.n_cells());
    let colour_label = "displacement (mm)".to_owned();
    let millimetres: Vec<f64> = u.chunks_exact(D).map(|u| 1e3 * u.iter().map(|x| x * x).sum::<f64>().sqrt()).collect();
    let place = |v: usize, k: usize| if k < D { mesh.points()[v][k] + u[D * v + k] } else { 0.0 };
    if D == 2 {
        let points: Vec<[f64; 2]> = (0..mesh.n_vertex_slots()).map(|v| [place(v, 0), place(v, 1)]).collect();
        let rest: Vec<[f64; 2]> = mesh.points().iter().map(|x| [x[0], x[1]]).collect();
        let triangles: Vec<[u32; 3]> = mesh.cells().map(|c| std::array::from_fn(|k| mesh.cell(c)[k].0)).collect();
        let picture = MeshPicture {
            points: &points,
            triangles: &triangles,
            values: &millimetres,
            title,
            colour_label,
            outline: outline_of(&rest, &triangles),
            ..MeshPicture::default()
        };
        return picture.write(path);
    }
    let points: Vec<[f64; 3]> = (0..mesh.n_vertex_slots()).map(|v| std::array::from_fn(|k| place(v, k))).collect();
    let tetrahedra: Vec<[u32; 4]> = mesh.cells().map(|c| std::array::from_fn(|k| mesh.cell(c)[k].0)).collect();
    let mean = |v: &[u32; 4]| v.iter().map(|&v| millimetres[v as usize]).sum::<f64>() / 4.0;
    let values: Vec<f64> = tetrahedra.iter().map(mean).collect();
    let picture = SolidPicture {
        points: &points,
        tetrahedra: &tetrahedra,
        values: &values,
        title,
        colour_label,
        ..SolidPicture::default()
    };
    picture.write(path)
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
