//! Equilibria of solids on meshes that are fine for a test: conjugate gradients with smoothed aggregation, on two threads.

use super::stop;
use stylet_mesh::SimplexMesh;
use stylet_physics::body::{Body, Loaded};
use stylet_physics::material::Hyperelastic;
use stylet_solver::linear::{CgSettings, CgWorkspace, projected_cg};
use stylet_solver::nonlinear::{Following, NewtonSettings, NewtonWorkspace, newton_cg_with};
use stylet_solver::precondition::aggregation::{Modes, SmoothedAggregation, SmoothedAggregationSettings};
use stylet_solver::sparse::Frozen;
use stylet_solver::stop::Stop;
use stylet_solver::subspace::Subspace;
use stylet_solver::team::Team;
use stylet_solver::vector;

/// The displacement, from `u` on, at which a solid balances `load`; nonlinear ones are loaded in `load_steps` equal parts.
pub fn equilibrium<M: Hyperelastic<3>>(
    mesh: &SimplexMesh<3, 4>,
    material: M,
    subspace: &Subspace<3>,
    load: &[f64],
    mut u: Vec<f64>,
    load_steps: usize,
) -> Vec<f64> {
    let team = Team::new(2);
    let mut body = Body::new(mesh, material, 1.0).unwrap();
    body.set_threads(2);
    if M::IS_LINEAR {
        linear(mesh, &body, subspace, load, &mut u, &team);
    } else {
        for step in 1..=load_steps {
            let part = step as f64 / load_steps as f64;
            let load: Vec<f64> = load.iter().map(|f| part * f).collect();
            newton(mesh, &mut body, subspace, &load, &mut u, &team);
        }
    }
    u
}

fn linear<M: Hyperelastic<3>>(
    mesh: &SimplexMesh<3, 4>,
    body: &Body<3, 4, M>,
    subspace: &Subspace<3>,
    load: &[f64],
    u: &mut [f64],
    team: &Team,
) {
    let (modes, settings) = (Modes::rigid(mesh.points()).unwrap(), SmoothedAggregationSettings::default());
    let m = SmoothedAggregation::<3, 6>::new_on(team, body.stiffness(), subspace, modes, settings).unwrap();
    let cg = CgSettings { stop: stop(1e-8), max_iterations: 1000 };
    let a = Frozen::<3>::new(body.stiffness());
    let report = projected_cg(&a, &m, subspace, load, u, &cg, &mut CgWorkspace::on(team)).unwrap();
    assert_eq!(report.stop, Stop::Converged, "{report:?}");
}

fn newton<M: Hyperelastic<3>>(
    mesh: &SimplexMesh<3, 4>,
    body: &mut Body<3, 4, M>,
    subspace: &Subspace<3>,
    load: &[f64],
    u: &mut [f64],
    team: &Team,
) {
    let (modes, settings) = (Modes::rigid(mesh.points()).unwrap(), SmoothedAggregationSettings::default());
    let mut cycle = SmoothedAggregation::<3, 6>::default();
    let follow = |m: &mut SmoothedAggregation<3, 6>, hessian: &_, w: &_| {
        SmoothedAggregation::new_on(team, hessian, w, modes.clone(), settings).map(|fresh| *m = fresh).is_ok()
    };
    let mut m = Following { m: &mut cycle, follow };
    let mut energy = Loaded::new(body, load);
    let (newton, mut ws) = (NewtonSettings::new(stop(1e-8)), NewtonWorkspace::on(team));
    let report = newton_cg_with(&mut energy, &mut m, subspace, vector::norm2(load), u, &newton, &mut ws).unwrap();
    assert_eq!(report.stop, Stop::Converged, "{report:?}");
}
