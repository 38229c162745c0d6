//! The scenes: a box that is fixed at one end, and what is done to it.

use super::{DENSITY, POISSON, TOLERANCE, YOUNG};
use std::time::Instant;
use stylet_mesh::SimplexMesh;
use stylet_mesh::generate::kuhn_box;
use stylet_physics::body::{Body, Density, MassKind};
use stylet_physics::material::Solid;
use stylet_physics::statics::{StaticError, StaticMethod, StaticSettings, StaticWorkspace, solve_static};
use stylet_solver::energy::Energy;
use stylet_solver::stop::{Criterion, StopRule};
use stylet_solver::subspace::{Constraint, Subspace};
use stylet_solver::team::Team;

/// A box that is fixed at `x = 0`, and what is done to it.
pub(super) struct Scene {
    pub name: &'static str,
    /// What it is, with its measures.
    pub about: &'static str,
    /// m.
    size: [f64; 3],
    /// Cells along each axis of the coarsest mesh.
    cells: [usize; 3],
    pub deed: Deed,
    /// Parts in which the deed is done.
    parts: usize,
}

#[derive(Clone, Copy)]
pub(super) enum Deed {
    /// Its own weight along +x.
    Weight,
    /// A force along +z, N, shared by the nodes of the other end.
    Bend(f64),
    /// The other end is turned about the axis, radians.
    Twist(f64),
    /// The other end is moved along x by this share of the length.
    Compress(f64),
}

/// `P L²/EI` is 1 in the bent beam.
pub(super) const SCENES: [Scene; 5] = [
    Scene {
        name: "hanging block",
        about: "A cube of side 0.1 m hangs from a bonded face by its weight, 9.81 N.",
        size: [0.1; 3],
        cells: [3, 3, 3],
        deed: Deed::Weight,
        parts: 1,
    },
    Scene {
        name: "bent beam",
        about: "A beam of 0.1 × 0.02 × 0.02 m, clamped at one end, bears 45.3 mN across the other (P L²/EI = 1).",
        size: [0.1, 0.02, 0.02],
        cells: [8, 3, 3],
        deed: Deed::Bend(0.045_333),
        parts: 4,
    },
    Scene {
        name: "twisted beam",
        about: "The same beam, its other end turned by a quarter of a turn. The force is the torque, N m.",
        size: [0.1, 0.02, 0.02],
        cells: [8, 3, 3],
        deed: Deed::Twist(std::f64::consts::FRAC_PI_2),
        parts: 6,
    },
    Scene {
        name: "compressed block",
        about: "A cube of side 0.1 m between bonded plates, compressed by 30 %.",
        size: [0.1; 3],
        cells: [3, 3, 3],
        deed: Deed::Compress(-0.3),
        parts: 6,
    },
    Scene {
        name: SMALL,
        about: "The same cube compressed by 0.01 %, where all laws are the linear one.",
        size: [0.1; 3],
        cells: [3, 3, 3],
        deed: Deed::Compress(-1e-4),
        parts: 1,
    },
];

/// The scene in which all laws agree.
pub(super) const SMALL: &str = "block at small strain";

/// What is measured of a solved scene.
pub(super) struct Outcome {
    /// Force, N, or torque, N m, at the fixed end, part by part.
    pub forces: Vec<f64>,
    /// Mean displacement of the other end along the deed, m.
    pub displacement: f64,
    pub newton: usize,
    pub cg: usize,
    pub smallest_j: f64,
    pub seconds: f64,
    pub tetrahedra: usize,
}

impl Outcome {
    /// Force or torque at the end.
    pub fn force(&self) -> f64 {
        self.forces.last().copied().unwrap_or(f64::NAN)
    }
}

impl Scene {
    /// Solves it with `finer` times the cells along each axis.
    pub fn solve(&self, model: &str, finer: usize, threads: usize) -> Result<Outcome, StaticError> {
        let cells = self.cells.map(|n| finer * n);
        let mesh = kuhn_box::<3, 4>([0.0; 3], self.size, cells).expect("a box");
        let solid = Solid::from_young_poisson(model, YOUNG, POISSON).expect("a law of the list");
        let mut body = Body::new(&mesh, solid, 1.0).expect("cells with volume");
        body.set_threads(threads);
        body.set_mass(MassKind::Lumped, &Density::Uniform(DENSITY)).expect("a density");
        let held = self.held(&mesh);
        let stop = StopRule { tolerance: TOLERANCE, criterion: Criterion::Reaction, round_floor: 0.0 };
        let settings = StaticSettings::new(StaticMethod::NewtonCg, stop);
        let mut workspace = StaticWorkspace::on(&Team::new(threads));
        let (mut load, mut u) = (vec![0.0; body.dim()], vec![0.0; body.dim()]);
        let mut internal = load.clone();
        let (mut forces, mut newton, mut cg) = (Vec::new(), 0, 0);
        let since = Instant::now();
        for part in 1..=self.parts {
            let [before, now] = [part - 1, part].map(|part| part as f64 / self.parts as f64);
            self.push(&mesh, before, now, &mut u);
            self.load(&body, &mesh, now, &mut load);
            let solved = solve_static(&mut body, &held, &load, &mut u, &settings, &mut workspace)?;
            (newton, cg) = (newton + solved.iterations, cg + solved.inner_iterations);
            body.internal_force(&u, &mut internal);
            forces.push(self.reaction(&mesh, &internal));
        }
        Ok(Outcome {
            forces,
            displacement: self.displacement(&mesh, &u),
            newton,
            cg,
            smallest_j: body.smallest_jacobian(&u).map_or(f64::NAN, |(_, jacobian)| jacobian),
            seconds: since.elapsed().as_secs_f64(),
            tetrahedra: mesh.n_cells(),
        })
    }

    /// What the scene is about: the displacement under a load, the force of a motion.
    pub fn answer(&self, outcome: &Outcome) -> f64 {
        match self.deed {
            Deed::Weight | Deed::Bend(_) => outcome.displacement,
            Deed::Twist(_) | Deed::Compress(_) => outcome.force(),
        }
    }

    /// How far the other end has been moved at the end of each part, %.
    pub fn percents(&self) -> Vec<f64> {
        let Deed::Compress(strain) = self.deed else { return Vec::new() };
        (1..=self.parts).map(|part| -100.0 * strain * part as f64 / self.parts as f64).collect()
    }

    fn is_far(&self, x: &[f64; 3]) -> bool {
        x[0] > (1.0 - 1e-9) * self.size[0]
    }

    fn is_fixed(&self, x: &[f64; 3]) -> bool {
        x[0] < 1e-9 * self.size[0]
    }

    fn held(&self, mesh: &SimplexMesh<3, 4>) -> Subspace<3> {
        let both = matches!(self.deed, Deed::Twist(_) | Deed::Compress(_));
        let mut held = Subspace::new(mesh.n_vertex_slots());
        for (vertex, x) in mesh.points().iter().enumerate() {
            if self.is_fixed(x) || both && self.is_far(x) {
                held.set(vertex, Constraint::Fixed).expect("a vertex of the mesh");
            }
        }
        held
    }

    /// Moves the whole body as far as the other end is moved, in proportion to `x`: a start for the next part.
    fn push(&self, mesh: &SimplexMesh<3, 4>, before: f64, now: f64, u: &mut [f64]) {
        for (x, u) in mesh.points().iter().zip(u.as_chunks_mut::<3>().0) {
            let share = x[0] / self.size[0];
            match self.deed {
                Deed::Compress(strain) => u[0] += (now - before) * strain * x[0],
                Deed::Twist(angle) => {
                    let (sin, cos) = ((now - before) * angle * share).sin_cos();
                    let [y, z] = [1, 2].map(|k| x[k] + u[k] - 0.5 * self.size[k]);
                    u[1] += cos * y - sin * z - y;
                    u[2] += sin * y + cos * z - z;
                }
                Deed::Weight | Deed::Bend(_) => {}
            }
        }
    }

    fn load(&self, body: &Body<3, 4, Solid>, mesh: &SimplexMesh<3, 4>, now: f64, load: &mut [f64]) {
        load.fill(0.0);
        match self.deed {
            Deed::Weight => body.add_gravity(&[now * 9.81, 0.0, 0.0], load),
            Deed::Bend(force) => {
                // Lumped: a node has what the weight of the mass about it is of that of the whole end.
                let end: Vec<usize> = (0..mesh.points().len()).filter(|&v| self.is_far(&mesh.points()[v])).collect();
                let mass: f64 = end.iter().map(|&v| body.lumped_mass()[v]).sum();
                end.iter().for_each(|&v| load[3 * v + 2] = now * force * body.lumped_mass()[v] / mass);
            }
            Deed::Twist(_) | Deed::Compress(_) => {}
        }
    }

    /// Force that the body exerts on what holds it at `x = 0`, along the deed, N; in the twist the torque, N m.
    fn reaction(&self, mesh: &SimplexMesh<3, 4>, internal: &[f64]) -> f64 {
        let of_node = |(x, f): (&[f64; 3], &[f64; 3])| match self.deed {
            Deed::Weight | Deed::Compress(_) => -f[0],
            Deed::Bend(_) => -f[2],
            Deed::Twist(_) => (x[2] - 0.5 * self.size[2]) * f[1] - (x[1] - 0.5 * self.size[1]) * f[2],
        };
        let fixed = mesh.points().iter().zip(internal.as_chunks::<3>().0).filter(|(x, _)| self.is_fixed(x));
        fixed.map(of_node).sum()
    }

    /// Mean over the nodes of the other end, m; nothing for ends that are turned.
    fn displacement(&self, mesh: &SimplexMesh<3, 4>, u: &[f64]) -> f64 {
        let axis = match self.deed {
            Deed::Weight | Deed::Compress(_) => 0,
            Deed::Bend(_) => 2,
            Deed::Twist(_) => return 0.0,
        };
        let far = mesh.points().iter().zip(u.as_chunks::<3>().0).filter(|(x, _)| self.is_far(x));
        let (sum, count) = far.fold((0.0, 0), |(sum, count), (_, u)| (sum + u[axis], count + 1));
        sum / f64::from(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reactions_balance_loads() {
        let [hanging, bent, ..] = &SCENES;
        // The block weighs 9.81 N, of which the fixed nodes carry their own share: a sixth of two half cells.
        let outcome = hanging.solve("neo-hookean", 2, 1).unwrap();
        assert!(outcome.displacement > 0.0 && outcome.force() > 8.0 && outcome.force() < 9.81);
        let outcome = bent.solve("stable-neo-hookean", 2, 1).unwrap();
        assert!((outcome.forces[3] - 0.045_333).abs() < 1e-5, "{}", outcome.forces[3]);
    }
}
