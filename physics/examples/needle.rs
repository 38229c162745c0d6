//! A flexible needle in and out of a block of gel, step by step, on the physics layer alone:
//! `cargo run --release -p stylet-physics --example needle`.

use std::time::Instant;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, LazyRule, MassKind};
use stylet_physics::coupling::{CoupledSettings, SlipState};
use stylet_physics::insertion::{BaseMotion, Insertion, NeedleSettings, UniformInteraction};
use stylet_physics::material::FixedCorotated;
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (side, cells, dt, speed) = (0.1, 10, 0.02, 0.02);
    let team = Team::new(2);

    // The block: gelatine of 15 kPa, held at its bottom.
    let mesh = kuhn_box::<3, 4>([0.0; 3], [side; 3], [cells; 3])?;
    let mut body = Body::new(&mesh, FixedCorotated::from_young_poisson(15e3, 0.45)?, 1.0)?;
    body.set_mass(MassKind::Lumped, &Density::Uniform(1000.0))?;
    body.set_lazy_rule(LazyRule::Strain(0.05));
    body.set_team(&team);
    let mut held = Subspace::new(mesh.n_vertex_slots());
    for vertex in mesh.vertices().filter(|&v| mesh.point(v)[2] < 1e-9) {
        held.set(vertex.index(), Constraint::Fixed)?;
    }

    // How steps are made, and what the gel does to a needle.
    let mut settings = CoupledSettings::new(dt, 0.2 * side / cells as f64);
    settings.dynamics.damping.stiffness = 0.01;
    let forces = UniformInteraction { friction: 12.0, viscosity: 200.0, cutting: 0.2 };
    let mut insertion = Insertion::new(mesh, body, held, settings, forces, [0.0; 3], &team)?;

    // A nitinol wire with a bevel of 5 degrees, 2 mm before the skin: in, hold, out.
    let wire = NeedleSettings::nitinol([-0.102, 0.0512, 0.0523], [1.0, 0.0, 0.0])?;
    insertion.add_needle(NeedleSettings { bevel: 5.0_f64.to_radians(), ..wire })?;
    println!(" time (s)  depth (mm)  up (mm)  base (N)  iterations  states (entry to tip)");
    let since = Instant::now();
    for step in 0..480 {
        let insert = match step {
            0..180 => speed,
            180..220 => 0.0,
            _ => -speed,
        };
        let report = insertion.step(&[BaseMotion { insert, ..BaseMotion::default() }], dt)?;
        if step % 20 == 0 {
            let needle = &insertion.needles()[0];
            let states: String = needle.nodes().iter().map(|node| letter(node.state)).collect();
            println!(
                "{:9.2}  {:10.2}  {:7.2}  {:8.3}  {:10}  {states}",
                insertion.state().t,
                1e3 * needle.depth(),
                1e3 * (needle.shaft.tip()[2] - 0.0523),
                needle.base_force[0],
                report.iterations
            );
        }
    }
    println!("{:.2} ms a step", 1e3 * since.elapsed().as_secs_f64() / 480.0);
    Ok(())
}

fn letter(state: SlipState) -> char {
    match state {
        SlipState::Static => '=',
        SlipState::Forward => '>',
        SlipState::Backward => '<',
    }
}
