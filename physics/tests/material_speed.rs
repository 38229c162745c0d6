//! temporary
use std::time::Instant;
use stylet_physics::lanes::{LANES, Lane};
use stylet_physics::material::*;
fn run<M: Hyperelastic<3>>(name: &str, m: M) {
    let n = 3296usize;
    let mut state = 1u64;
    let mut rnd = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let f: Vec<[[Lane; 3]; 3]> = (0..n)
        .map(|_| {
            std::array::from_fn(|i| {
                std::array::from_fn(|k| std::array::from_fn(|_| if i == k { 1.0 } else { 0.0 } + 0.15 * rnd()))
            })
        })
        .collect();
    let g: Vec<[[Lane; 3]; 4]> = (0..n)
        .map(|_| {
            let mut g: [[Lane; 3]; 4] =
                std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| rnd())));
            for i in 0..3 {
                for l in 0..LANES {
                    g[0][i][l] = -(g[1][i][l] + g[2][i][l] + g[3][i][l]);
                }
            }
            g
        })
        .collect();
    let mut out = vec![[[[0.0; LANES]; 3]; 3]; n];
    let mut upper = vec![[[[0.0; LANES]; 3]; 3]; n * 10];
    let mut en = vec![[0.0; LANES]; n];
    let mut best = [f64::INFINITY; 4];
    for _ in 0..25 {
        let t = Instant::now();
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (f, o) in f.iter().zip(&mut out) {
                    *o = m.stress_lanes(f);
                }
            },
        );
        best[0] = best[0].min(t.elapsed().as_secs_f64());
        for (j, project) in [(1, false), (2, true)] {
            let t = Instant::now();
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || {
                    for k in 0..n {
                        m.element_stiffness_lanes(&f[k], &g[k], &[0.7; LANES], project, &mut upper[k * 10..][..10]);
                    }
                },
            );
            best[j] = best[j].min(t.elapsed().as_secs_f64());
        }
        let t = Instant::now();
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (f, o) in f.iter().zip(&mut en) {
                    *o = m.energy_lanes(f);
                }
            },
        );
        best[3] = best[3].min(t.elapsed().as_secs_f64());
    }
    let ns = best.map(|b| b * 1e9 / (n * LANES) as f64);
    println!(
        "{name:32} stress {:6.1} stiffness {:6.1} projected {:6.1} energy {:6.1} ns  {}",
        ns[0],
        ns[1],
        ns[2],
        ns[3],
        out[0][0][0][0] + upper[0][0][0][0] + en[0][0]
    );
}
#[test]
fn speed() {
    for model in Solid::MODELS {
        match Solid::from_young_poisson(model, 34e3, 0.45).unwrap() {
            Solid::Linear(m) => run(model, m),
            Solid::StVenantKirchhoff(m) => run(model, m),
            Solid::NeoHookean(m) => run(model, m),
            Solid::Corotated(m) => {
                run(model, m);
                run("corotated held", m.with_rotation(RotationTangent::Held))
            }
            Solid::FixedCorotated(m) => run(model, m),
            Solid::StableNeoHookean(m) => run(model, m),
            Solid::InvertibleStVenantKirchhoff(m) => run(model, m),
            Solid::InvertibleNeoHookean(m) => run(model, m),
            _ => {}
        }
    }
    run("solid: corotated", Solid::from_young_poisson("corotated", 34e3, 0.45).unwrap());
}
