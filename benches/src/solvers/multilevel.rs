//! Multilevel preconditioners on meshes that are bisected around a point: iterations against depth.

use super::methods::settings;
use crate::{BenchOptions, Figure, Numbers, Report, Row};
use stylet_mesh::generate::kuhn_box;
use stylet_mesh::{MeshChange, SimplexMesh, VertexId};
use stylet_physics::body::Body;
use stylet_physics::material::Linear;
use stylet_solver::linear::{CgWorkspace, projected_cg};
use stylet_solver::precondition::multilevel::{BisectionHierarchy, Bpx, VCycle};
use stylet_solver::precondition::{BlockJacobi, Preconditioner};
use stylet_solver::stop::Stop;
use stylet_solver::subspace::{Constraint, Subspace};

/// What the meshes are bisected around.
const POINT: [f64; 3] = [0.3141, 0.2718, 0.5772];
const TOLERANCE: f64 = 1e-8;

pub(super) fn run(options: &BenchOptions, say: &mut dyn FnMut(&str), report: &mut Report) {
    let (plane, solid): (&[i32], &[i32]) =
        if options.quick { (&[6, 12], &[4, 6]) } else { (&[6, 8, 10, 12, 14, 16, 18, 20], &[4, 5, 6, 7, 8, 9, 10]) };
    let plane = table::<2, 3>("plane strain", plane, options, say, report);
    let solid = table::<3, 4>("solid", solid, options, say, report);
    for (name, counts) in [("plane strain", &plane), ("solid", &solid)] {
        let Some(&[bpx, v]) = counts.first() else { continue };
        let most = |k: usize| counts.iter().map(|count| count[k]).fold(0.0, f64::max);
        report.figures.push(Figure::at_most(format!("BPX, {name}: growth of iterations"), most(0) / bpx, 1.2));
        report.figures.push(Figure::at_most(format!("V-cycle, {name}: growth of iterations"), most(1) - v, 1.0));
        if name == "plane strain" {
            report.figures.push(Figure::at_most("V-cycle, plane strain: most iterations", most(1), 10.0));
        }
    }
}

/// Iterations of BPX and of the V-cycle by depth; infinite for a solve that failed.
fn table<const D: usize, const N: usize>(
    name: &str,
    depths: &[i32],
    options: &BenchOptions,
    say: &mut dyn FnMut(&str),
    report: &mut Report,
) -> Vec<[f64; 2]> {
    let mut counts = Vec::new();
    for &depth in depths {
        if options.stopped() {
            break;
        }
        say(&format!("{name} bisected to 2^-{depth}"));
        let [block_jacobi, bpx, v] = one::<D, N>(name, depth, report);
        report.figures.extend(
            (depth == depths[depths.len() - 1])
                .then(|| Figure::plain(format!("block Jacobi, {name}, 2^-{depth}: iterations"), block_jacobi)),
        );
        counts.push([bpx, v]);
    }
    counts
}

fn one<const D: usize, const N: usize>(name: &str, depth: i32, report: &mut Report) -> [f64; 3] {
    let mut mesh = kuhn_box::<D, N>([0.0; D], [1.0; D], [1; D]).expect("a box");
    let point: [f64; D] = std::array::from_fn(|k| POINT[k]);
    mesh.refine_around(point, 2_f64.powi(-depth), &mut MeshChange::default()).expect("room for some thousand cells");
    let material = Linear::from_young_poisson(1.0, 0.34).expect("a material");
    let body = Body::new(&mesh, material, 1.0).expect("cells with volume");
    let a = body.stiffness();
    let w = clamped(&mesh);
    let mut b: Vec<f64> = (0..D * mesh.n_vertex_slots()).map(|k| (1.7 * k as f64).sin()).collect();
    w.project(&mut b);
    let hierarchy =
        BisectionHierarchy::new(mesh.vertices().map(|v| v.0), mesh.parents_slice(), mesh.generations_slice());

    let iterate = |m: &dyn Preconditioner| {
        let mut x = vec![0.0; b.len()];
        let solve = projected_cg(a, m, &w, &b, &mut x, &settings(TOLERANCE), &mut CgWorkspace::new());
        solve.map_err(|e| e.to_string()).map(|report| (report.iterations, report.stop))
    };
    let hierarchy = hierarchy.map_err(|e| e.to_string());
    let hierarchy = hierarchy.as_ref().map_err(String::clone);
    let runs = [
        ("block-jacobi", BlockJacobi::new(a, &w).map_err(|e| e.to_string()).and_then(|m| iterate(&m))),
        ("bpx", hierarchy.clone().and_then(|h| iterate(&Bpx::new(a, &w, h).map_err(|e| e.to_string())?))),
        ("v-cycle", hierarchy.and_then(|h| iterate(&VCycle::new(a, &w, h).map_err(|e| e.to_string())?))),
    ];
    runs.map(|(preconditioner, run)| {
        let row = Row {
            case: format!("{name}, 2^-{depth}"),
            method: "cg".into(),
            preconditioner: preconditioner.into(),
            tolerance: Some(TOLERANCE),
            threads: 1,
            more: Numbers::from([("nodes", mesh.n_vertices() as f64)]),
            ..Row::default()
        };
        match run {
            Ok((iterations, Stop::Converged)) => {
                report.rows.push(Row { ok: true, iterations: Some(iterations as u64), ..row });
                iterations as f64
            }
            Ok((_, stop)) => {
                report.rows.push(Row { note: format!("{stop:?}"), ..row });
                f64::INFINITY
            }
            Err(note) => {
                report.rows.push(Row { note, ..row });
                f64::INFINITY
            }
        }
    })
}

/// The face x = 1 and what is no vertex.
fn clamped<const D: usize, const N: usize>(mesh: &SimplexMesh<D, N>) -> Subspace<D> {
    let mut w = Subspace::new(mesh.n_vertex_slots());
    for (v, x) in mesh.points().iter().enumerate() {
        if x[0] == 1.0 || !mesh.is_vertex(VertexId(v as u32)) {
            w.set(v, Constraint::Fixed).expect("a vertex slot");
        }
    }
    w
}
