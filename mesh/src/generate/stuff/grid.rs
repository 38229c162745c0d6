//! The cubes that fill the box, and integer coordinates in it.

use super::{GenerateError, Settings};

/// Tetrahedra of a body-centred cubic lattice per cube.
const TETS_PER_CUBE: f64 = 12.0;
/// Cubes along one axis: twice as many, and one more, can be packed thrice in 64 bits.
const MAX_CELLS: f64 = (1 << 19) as f64;
/// By how much a cube's edge may differ from the size asked for, before the coarsest level is given up.
const STRETCH: f64 = 0.1;

/// A point of the lattice, in half edges of the finest cubes from the lowest corner of the box.
pub(super) type Site = [i32; 3];

/// A box divided into equal root cubes, each of which is divided into eight up to `depth` times.
pub(super) struct Grid {
    lower: [f64; 3],
    upper: [f64; 3],
    /// Root cubes along each axis.
    pub roots: [u32; 3],
    /// The level of the finest cubes; roots have level 0.
    pub depth: u8,
    /// The level of cubes at conforming borders.
    pub border: u8,
    size: f64,
}

impl Grid {
    /// Chooses the cubes.
    ///
    /// The edges of root cubes are `size` times a power of two, adapted to the box along each axis. A power for which
    /// some edge changes by more than a tenth is halved.
    pub fn new([lower, upper]: [[f64; 3]; 2], settings: &Settings) -> Result<Self, GenerateError> {
        for axis in 0..3 {
            let (lower, upper) = (lower[axis], upper[axis]);
            if !(lower < upper && (upper - lower).is_finite()) {
                return Err(GenerateError::Box { axis, lower, upper });
            }
        }
        let length: [f64; 3] = std::array::from_fn(|k| upper[k] - lower[k]);
        let most = levels_between(settings.coarsest, settings.size).floor().clamp(0.0, 16.0) as u8;
        let cubes = |levels: u8| length.map(|l| (l / (settings.size * f64::from(1_u32 << levels))).round().max(1.0));
        let fits = |levels: &u8| {
            let (cubes, edge) = (cubes(*levels), settings.size * f64::from(1_u32 << levels));
            (0..3).all(|k| (length[k] / cubes[k] / edge - 1.0).abs() <= STRETCH)
        };
        let border = (1..=most).rev().find(fits).unwrap_or(0);
        let finer = levels_between(settings.size, settings.finest()).ceil().clamp(0.0, 64.0);
        let cubes = cubes(border);
        let estimate = TETS_PER_CUBE * cubes.iter().product::<f64>();
        let along = cubes.iter().fold(0.0_f64, |a, b| a.max(*b)) * (f64::from(border) + finer).exp2();
        if estimate > settings.limit() as f64 || along > MAX_CELLS {
            // Too many cubes along an axis: along a surface there are at least their square.
            return Err(GenerateError::TooManyTets {
                estimate: estimate.max(TETS_PER_CUBE * along * along),
                limit: settings.limit(),
            });
        }
        let depth = border + finer as u8;
        Ok(Self { lower, upper, roots: cubes.map(|n| n as u32), depth, border, size: settings.size })
    }

    /// Position of a lattice point, m; on the upper faces of the box exactly.
    pub fn position(&self, site: Site) -> [f64; 3] {
        std::array::from_fn(|k| {
            let last = self.last(k);
            let along = f64::from(site[k]) / f64::from(last);
            if site[k] == last { self.upper[k] } else { self.lower[k] + along * (self.upper[k] - self.lower[k]) }
        })
    }

    /// The coordinate of sites on the upper face of an axis.
    pub fn last(&self, axis: usize) -> i32 {
        (self.roots[axis] << (self.depth + 1)) as i32
    }

    /// The faces of the box that hold a site, one bit each.
    pub fn faces(&self, site: Site) -> u8 {
        (0..3).map(|k| u8::from(site[k] == 0) << (2 * k) | u8::from(site[k] == self.last(k)) << (2 * k + 1)).sum()
    }

    /// The edges of a cube, m.
    pub fn edges(&self, level: u8) -> [f64; 3] {
        std::array::from_fn(|k| (self.upper[k] - self.lower[k]) / f64::from(self.roots[k]) / f64::from(1_u32 << level))
    }

    /// The distance from a cube's centre to its corners, m.
    pub fn reach(&self, level: u8) -> f64 {
        0.5 * self.edges(level).iter().map(|e| e * e).sum::<f64>().sqrt()
    }

    /// The coarsest level with cubes not larger than `size`, as far as the grid goes.
    pub fn level(&self, size: f64) -> u8 {
        let finer = levels_between(self.size, size).ceil() + f64::from(self.border);
        finer.clamp(0.0, f64::from(self.depth)) as u8
    }

    /// The volume of the box, m^3.
    pub fn volume(&self) -> f64 {
        (0..3).map(|k| self.upper[k] - self.lower[k]).product()
    }

    /// The lowest and the highest corner of the box.
    pub fn corners(&self) -> [[f64; 3]; 2] {
        [self.lower, self.upper]
    }
}

/// How often `coarse` is halved to come to `fine`, within a tenth.
fn levels_between(coarse: f64, fine: f64) -> f64 {
    let levels = (coarse / fine).log2();
    if (levels - levels.round()).abs() < STRETCH { levels.round() } else { levels }
}

/// The estimate of tetrahedra for a number of cubes.
pub(super) fn estimate(cubes: f64) -> f64 {
    TETS_PER_CUBE * cubes
}
