//! scratch
use std::time::Instant;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::coupling::{CoupledSettings, SearchSettings, SlipState};
use stylet_physics::dynamics::DynamicsSettings;
use stylet_physics::insertion::{BaseMotion, Insertion, NeedleSettings, UniformInteraction};
use stylet_physics::material::*;
use stylet_physics::rod::Tangent;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

fn arg<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::args().find_map(|a| a.strip_prefix(&format!("{name}=")).and_then(|v| v.parse().ok())).unwrap_or(default)
}

fn main() {
    let n: usize = arg("n", 10);
    let dt: f64 = arg("dt", 0.02);
    let bevel: f64 = arg("bevel", 5.0_f64).to_radians();
    let e: f64 = arg("E", 15e3);
    let mesh = kuhn_box::<3, 4>([0.0; 3], [0.1; 3], [n, n, n]).unwrap();
    let mut body = Body::new(&mesh, FixedCorotated::from_young_poisson(e, arg("nu", 0.45)).unwrap(), 1.0).unwrap();
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0)).unwrap();
    let team = if arg("threads", 1) == 1 { Team::serial() } else { Team::new(arg("threads", 1)) };
    body.set_team(&team);
    let tau: f64 = arg("tau", 0.01);
    if tau > 0.0 {
        body.set_viscosity(
            0,
            Viscosity::kelvin_voigt(Lame::from_young_poisson(e, arg("nu", 0.45)).unwrap(), tau).unwrap(),
        )
        .unwrap();
    }
    let mut w = Subspace::new(mesh.n_vertex_slots());
    for (i, x) in mesh.points().iter().enumerate() {
        if x[2] < 1e-9 {
            w.set(i, Constraint::Fixed).unwrap();
        }
    }
    let lazy: f64 = arg("lazy", 0.0);
    if lazy > 0.0 {
        body.set_lazy_rule(stylet_physics::body::LazyRule::Strain(lazy));
    }
    let mut dynamics = DynamicsSettings::new(dt);
    dynamics.damping.stiffness = arg("ray", 0.0);
    if arg("be", 0) == 1 {
        dynamics.scheme = stylet_physics::dynamics::Scheme::BackwardEuler;
    }
    let settings = CoupledSettings {
        dynamics,
        search: SearchSettings::default(),
        coupling: match arg("kkt", 0) {
            1 => stylet_physics::coupling::CouplingMethod::KktCg,
            2 => stylet_physics::coupling::CouplingMethod::KktMinres,
            3 => stylet_physics::coupling::CouplingMethod::ConstraintPreconditioned,
            _ => stylet_physics::coupling::CouplingMethod::NullSpace,
        },
        tangent: if arg("exact", 0) == 1 { Tangent::Exact } else { Tangent::GaussNewton },
        needle_scheme: if arg("ntrap", 0) == 1 {
            stylet_physics::dynamics::Scheme::TRAPEZOID
        } else {
            stylet_physics::dynamics::Scheme::BackwardEuler
        },
        reach: 0.05 / n as f64,
        gravity: [0.0; 3],
    };
    let cut = UniformInteraction { friction: arg("f", 12.0), viscosity: arg("eta", 200.0), cutting: arg("cut", 0.2) };
    let mut ins = Insertion::new(mesh, body, w, settings, cut, [0.0; 3], &team).unwrap();
    let mut needle = NeedleSettings::nitinol([-0.105, 0.0512, 0.0523], [1.0, 0.0, 0.0]).unwrap();
    needle.bevel = bevel;
    needle.damping = arg("ndamp", 0.0);
    ins.add_needle(needle).unwrap();
    let v: f64 = arg("v", 0.02);
    let depth: f64 = arg("depth", 0.07);
    let steps = (depth / v / dt) as usize;
    let total = 2 * steps + steps / 2 + 20;
    let (mut frames, mut iters) = (Vec::new(), 0);
    for step in 0..total {
        let insert = if step < steps {
            v
        } else if step < steps + steps / 4 {
            0.0
        } else {
            -v
        };
        let since = Instant::now();
        let r = match ins.step(&[BaseMotion { insert, ..Default::default() }], dt) {
            Ok(r) => r,
            Err(e) => {
                println!("step {step}: {e}");
                break;
            }
        };
        frames.push(since.elapsed().as_secs_f64());
        iters += r.iterations;
        let nd = &ins.needles()[0];
        if step % arg("every", 10) == 0 || r.substeps > 1 && arg("v2", 0) == 1 {
            let t = nd.shaft.tip();
            let s: String = nd
                .nodes()
                .iter()
                .map(|n| match n.state {
                    SlipState::Static => 'S',
                    SlipState::Forward => '+',
                    SlipState::Backward => '-',
                })
                .collect();
            let f: f64 = nd.forces.iter().sum();
            println!(
                "{step} t {:.3} tip {:.5} {:.5} {:.5} in {:.4} n {} F {:.4} {:.4} {:.4} sumf {f:.4} sub {} tri {} it {} blk {} cons {} {s}",
                ins.state().t,
                t[0],
                t[1],
                t[2],
                nd.depth(),
                nd.shaft.n_nodes(),
                nd.base_force[0],
                nd.base_force[1],
                nd.base_force[2],
                r.substeps,
                r.trials,
                r.iterations,
                r.blocked,
                r.consistent
            );
        }
    }
    frames.sort_by(f64::total_cmp);
    println!(
        "median {:.3} ms p99 {:.3} ms max {:.3} iters {} tets {}",
        1e3 * frames[frames.len() / 2],
        1e3 * frames[frames.len() * 99 / 100],
        1e3 * frames[frames.len() - 1],
        iters,
        ins.mesh().n_cells()
    );
    let t = ins.times();
    println!("{t:#?}");
}
