//! Stick and slip of nodes that know nothing of each other, on a needle that moves as prescribed: closed forms.

use std::convert::Infallible;
use stylet_physics::coupling::SlipState::{Backward, Forward, Static};
use stylet_physics::coupling::{
    Answer, SearchMethod, SearchSettings, SearchWorkspace, SlipLimits, SlipState, StickSlip, search,
};

/// Node `i` moves by `u` in a step, `stiffness[i] u = load[i] + λ`; the needle moves by `drive`.
struct Independent {
    stiffness: Vec<f64>,
    load: Vec<f64>,
    drive: f64,
    limits: Vec<SlipLimits>,
}

impl StickSlip for Independent {
    type Error = Infallible;

    fn limits(&self) -> &[SlipLimits] {
        &self.limits
    }

    fn solve(&mut self, states: &[SlipState], _: f64, _: bool, answer: &mut Answer) -> Result<usize, Infallible> {
        answer.force.clear();
        answer.slip.clear();
        for (i, &state) in states.iter().enumerate() {
            let (k, b) = (self.stiffness[i], self.load[i]);
            let slipping = self.limits[i].slipping(state);
            let sticks = state == Static;
            answer.force.push(if sticks { k * self.drive - b } else { slipping });
            answer.slip.push(if sticks { 0.0 } else { self.drive - (b + slipping) / k });
        }
        Ok(1)
    }

    fn condense(&mut self, _: f64, w: &mut Vec<f64>, free_slip: &mut Vec<f64>) -> Result<usize, Infallible> {
        let n = self.stiffness.len();
        *w = vec![0.0; n * n];
        for (i, k) in self.stiffness.iter().enumerate() {
            w[i * n + i] = 1.0 / k;
        }
        *free_slip = self.stiffness.iter().zip(&self.load).map(|(k, b)| self.drive - b / k).collect();
        Ok(n)
    }
}

/// A search from the states of the last step, and what it found.
#[derive(Default)]
struct Contact {
    states: Vec<SlipState>,
    answer: Answer,
    workspace: SearchWorkspace,
    most_trials: usize,
}

impl Contact {
    fn step(&mut self, system: &mut Independent, method: SearchMethod) {
        // Direct solves, so that only rounding is left.
        let settings =
            SearchSettings { method, check_tolerance: 1e-12, solve_tolerance: 1e-12, ..SearchSettings::default() };
        let report = search(system, &mut self.states, &settings, &mut self.workspace, &mut self.answer).unwrap();
        assert!(report.consistent, "{report:?}");
        self.most_trials = self.most_trials.max(report.trials);
        for (force, slip) in self.answer.force.iter().zip(&self.answer.slip) {
            assert!(force * slip >= -1e-18, "friction of {force} N feeds energy into a slip of {slip} m");
        }
    }
}

const METHODS: [SearchMethod; 2] = [SearchMethod::Trials, SearchMethod::Condensed];

/// A block of 0.01 kg on a spring of 40 N/m, dragged by a needle at 0.02 m/s.
struct Block {
    system: Independent,
    contact: Contact,
    dt: f64,
    x: f64,
    v: f64,
}

const MASS: f64 = 0.01;
const SPRING: f64 = 40.0;
const SPEED: f64 = 0.02;

impl Block {
    fn new(fixed: f64, kinetic: f64, damping: f64, dt: f64) -> Self {
        let system = Independent {
            stiffness: vec![MASS / (dt * dt) + damping / dt + SPRING],
            load: vec![0.0],
            drive: SPEED * dt,
            limits: vec![SlipLimits::new(kinetic, 0.0, fixed / kinetic).unwrap()],
        };
        Self { system, contact: Contact::default(), dt, x: 0.0, v: SPEED }
    }

    /// Implicit Euler, which has no memory of accelerations: one that jumps as the block sticks does not ring on.
    fn step(&mut self, method: SearchMethod) -> SlipState {
        self.system.load[0] = MASS * self.v / self.dt - SPRING * self.x;
        self.contact.step(&mut self.system, method);
        let moved = self.system.drive - self.contact.answer.slip[0];
        self.x += moved;
        self.v = moved / self.dt;
        self.contact.states[0]
    }
}

/// The first slip and what follows: when it starts, how long it lasts, the extremes of `x`, and when the next one starts.
fn first_slip(dt: f64, method: SearchMethod) -> [f64; 5] {
    let mut block = Block::new(0.4, 0.2, 0.0, dt);
    let (mut starts, mut stops) = (Vec::new(), Vec::new());
    let (mut lowest, mut highest) = (f64::INFINITY, 0.0_f64);
    let mut before = Static;
    let mut steps = 0;
    while starts.len() < 2 {
        let state = block.step(method);
        let t = f64::from(steps) * dt;
        match (before, state) {
            (Static, Forward) => starts.push(t),
            (Forward, Static) => stops.push(t),
            (a, b) => assert_eq!(a, b, "at {t} s"),
        }
        highest = highest.max(block.x);
        if !starts.is_empty() {
            lowest = lowest.min(block.x);
        }
        before = state;
        steps += 1;
        assert!(t < 2.0, "{starts:?} {stops:?}");
    }
    assert_eq!((stops.len(), block.contact.most_trials <= 2), (1, true));
    [starts[0], stops[0] - starts[0], highest, lowest, starts[1] - starts[0]]
}

/// Closed form: a slip lasts `(π + asin(v / A ω) + atan2(v / ω, D)) / ω` with `D = (F_s − F_k) / k` and `A² = D² + (v / ω)²`,
/// about the place `F_k / k`, from which the block goes `A` to either side.
#[test]
fn a_block_on_a_spring_sticks_and_slips_with_the_period_of_the_closed_form() {
    let expected = [0.5, 0.0516703, 10.00999e-3, -0.00999e-3, 0.5516703];
    let tolerance = [1e-4, 1e-5, 1e-7, 1e-6, 1e-4];
    for method in METHODS {
        let [coarse, fine] = [4e-6, 1e-6].map(|dt| first_slip(dt, method));
        for (i, (found, exact)) in fine.iter().zip(expected).enumerate() {
            assert!((found - exact).abs() < tolerance[i], "number {i}: {found}, expected {exact}");
        }
        // The error of implicit Euler is of first order.
        for i in [3, 4] {
            let order = ((coarse[i] - expected[i]) / (fine[i] - expected[i])).abs().log2() / 2.0;
            assert!((0.8..1.2).contains(&order), "{coarse:?} {fine:?}: order {order} of number {i}");
        }
    }
}

#[test]
fn with_equal_limits_the_block_oscillates_about_the_friction_force() {
    for method in METHODS {
        let dt = 1e-6;
        let mut block = Block::new(0.3, 0.3, 0.0, dt);
        let (mut start, mut touches) = (None, Vec::new());
        let (mut lowest, mut highest) = (f64::INFINITY, 0.0_f64);
        let mut before = Static;
        let frequency = (SPRING / MASS).sqrt();
        let period = std::f64::consts::TAU / frequency;
        for step in 0..700_000 {
            let t = f64::from(step) * dt;
            let state = block.step(method);
            if before == Static && state == Forward {
                start = start.or(Some((t, block.x)));
            }
            if let Some((start, _)) = start
                && t > start + period
            {
                lowest = lowest.min(block.x);
                highest = highest.max(block.x);
                // The block is as fast as the needle, which it never overtakes, once in each period.
                if block.v > SPEED * (1.0 - 1e-3) && touches.last().is_none_or(|last| t - last > 0.5 * period) {
                    touches.push(t);
                }
            }
            before = state;
        }
        let (t, x) = start.unwrap();
        assert!((t - 0.375).abs() < 1e-4 && (x - 7.5e-3).abs() < 1e-6, "{t} s, {x} m");
        assert!((period - 0.0993459).abs() < 1e-7);
        assert!((highest - 7.5e-3 - 0.316228e-3).abs() < 1e-3 * 0.316228e-3, "{highest}");
        assert!((7.5e-3 - lowest - 0.316228e-3).abs() < 1e-3 * 0.316228e-3, "{lowest}");
        assert!(touches.len() >= 2, "{touches:?}");
        for pair in touches.windows(2) {
            assert!((pair[1] - pair[0] - period).abs() < 0.02 * period, "{touches:?}");
        }
    }
}

#[test]
fn a_damped_block_settles_where_the_spring_bears_the_friction() {
    for method in METHODS {
        let mut block = Block::new(0.3, 0.3, 0.2, 1e-4);
        for _ in 0..20_000 {
            block.step(method);
        }
        assert!((block.x - 7.5e-3).abs() < 1e-9, "{}", block.x);
        assert_eq!(block.contact.states, [Forward]);
    }
}

/// Springs of 50, 50, 100, 100, 200 N/m with friction of 0.1, 0.2, 0.2, 0.3, 0.1 N, at rest.
struct Springs {
    system: Independent,
    contact: Contact,
    x: [f64; 5],
    needle: f64,
}

impl Springs {
    fn new() -> Self {
        let limits = [0.1, 0.2, 0.2, 0.3, 0.1].map(|friction| SlipLimits::new(friction, 0.0, 1.0).unwrap());
        let system = Independent {
            stiffness: vec![50.0, 50.0, 100.0, 100.0, 200.0],
            load: vec![0.0; 5],
            drive: 0.0,
            limits: limits.to_vec(),
        };
        Self { system, contact: Contact::default(), x: [0.0; 5], needle: 0.0 }
    }

    /// Moves the needle to this place in steps of 0.01 mm. Returns the work done on it, and calls `seen` after each step.
    fn move_to(&mut self, place: f64, method: SearchMethod, mut seen: impl FnMut(f64, &[SlipState], f64)) -> f64 {
        let steps = ((place - self.needle).abs() / 1e-5).round() as usize;
        let (start, mut work) = (self.needle, 0.0);
        for step in 1..=steps {
            let before = self.force();
            let target = start + (place - start) * step as f64 / steps as f64;
            self.system.drive = target - self.needle;
            for i in 0..5 {
                self.system.load[i] = -self.system.stiffness[i] * self.x[i];
            }
            self.contact.step(&mut self.system, method);
            for (x, slip) in self.x.iter_mut().zip(&self.contact.answer.slip) {
                *x += self.system.drive - slip;
            }
            self.needle = target;
            work += 0.5 * (before + self.force()) * self.system.drive;
            seen(target, &self.contact.states, self.force());
        }
        work
    }

    fn force(&self) -> f64 {
        self.x.iter().zip(&self.system.stiffness).map(|(x, k)| k * x).sum()
    }
}

#[test]
fn five_nodes_on_a_rigid_needle_follow_their_loop() {
    for method in METHODS {
        let mut springs = Springs::new();
        let (mut first, mut forces) = ([None; 5], Vec::new());
        springs.move_to(8e-3, method, |place, states, force| {
            for (first, state) in first.iter_mut().zip(states) {
                if *state != Static {
                    first.get_or_insert(place);
                }
            }
            forces.push((place, force));
        });
        // A node slips in the first step beyond the place where the spring bears its friction.
        for (first, expected) in first.iter().zip([2e-3, 4e-3, 2e-3, 3e-3, 0.5e-3]) {
            let late = first.unwrap() - expected;
            assert!((-1e-9..1.01e-5).contains(&late), "{first:?}, expected {expected}");
        }
        let at = |forces: &[(f64, f64)], place: f64| {
            let nearest = forces.iter().min_by(|a, b| (a.0 - place).abs().total_cmp(&(b.0 - place).abs()));
            nearest.unwrap().1
        };
        for (place, expected) in [(2e-3, 0.7), (4e-3, 0.9), (8e-3, 0.9)] {
            assert!((at(&forces, place) - expected).abs() < 1e-12, "{} N at {place} m", at(&forces, place));
        }
        forces.clear();
        springs.move_to(-8e-3, method, |place, _, force| forces.push((place, force)));
        for (place, expected) in [(4e-3, -0.5), (0.0, -0.9), (-8e-3, -0.9)] {
            assert!((at(&forces, place) - expected).abs() < 1e-12, "{} N at {place} m", at(&forces, place));
        }
        let crossing = forces.windows(2).find(|pair| pair[0].1 > 0.0 && pair[1].1 <= 0.0).unwrap();
        let [(a, fa), (b, fb)] = [crossing[0], crossing[1]];
        let zero = a + (b - a) * fa / (fa - fb);
        assert!((zero - 17e-3 / 3.0).abs() < 1e-12, "{zero}");
        let loss = springs.move_to(8e-3, method, |_, _, _| ()) + springs.move_to(-8e-3, method, |_, _, _| ());
        assert!((loss - 19.4e-3).abs() < 1e-12, "{loss} J");
        assert!(springs.contact.states.iter().all(|&state| state == Backward));
    }
}

/// A needle held still for 10,000 steps, after a pull below all limits: nothing creeps.
#[test]
fn what_sticks_does_not_creep() {
    for method in METHODS {
        let mut springs = Springs::new();
        springs.move_to(0.4e-3, method, |_, _, _| ());
        let x = springs.x;
        springs.system.drive = 0.0;
        for _ in 0..10_000 {
            for i in 0..5 {
                springs.system.load[i] = -springs.system.stiffness[i] * springs.x[i];
            }
            springs.contact.step(&mut springs.system, method);
            assert!(springs.contact.answer.slip.iter().all(|&slip| slip == 0.0));
        }
        assert_eq!((springs.x, springs.contact.states.as_slice()), (x, [Static; 5].as_slice()));
    }
}
