//! Following the tip, and refining the mesh around it.

use super::{Insertion, Scratch};
use crate::error::NeedleError;
use crate::slab::solve_error;
use crate::stages::{Stage, Stages};
use crate::tip::{Inside, Tip, find_in_reference, follow};
use std::time::Instant;
use stylet_physics::material::Hyperelastic;

impl<M: Hyperelastic<2>> Insertion<M> {
    /// Follows the tip to its place in the last equilibrium, and refines the triangles that it touches there.
    pub(super) fn locate_and_refine(&mut self, stages: &mut Stages, since: &mut Instant) -> Result<bool, NeedleError> {
        let crossed = &mut self.scratch.crossed;
        crossed.clear();
        self.tip = follow(&self.slab.mesh, &self.slab.u, self.tip, self.needle.tip(), crossed);
        for &vertex in crossed.iter() {
            if !self.shaft.contains(vertex) && !self.shaft.ahead.contains(&vertex) {
                self.shaft.ahead.push(vertex);
            }
        }
        *since = stages.lap(Stage::Locate, *since);
        let Tip::Inside(inside) = self.tip else { return Ok(false) };
        let refined = self.refine_around(inside)?;
        if refined {
            *since = stages.lap(Stage::Refine, *since);
        }
        Ok(refined)
    }

    /// Bisects all triangles that touch the tip until none is longer than the finest level.
    fn refine_around(&mut self, start: Inside) -> Result<bool, NeedleError> {
        let point = start.in_reference(&self.slab.mesh);
        let mut inside = start;
        let mut refined = false;
        let too_long = self.longest_edge * (1.0 + 1e-9);
        loop {
            let Scratch { touching, marked, .. } = &mut self.scratch;
            inside.touching(&self.slab.mesh, touching);
            marked.clear();
            marked.extend(touching.iter().copied().filter(|&cell| self.slab.mesh.longest_edge(cell) > too_long));
            if marked.is_empty() {
                break;
            }
            self.slab.bisect(&self.scratch.marked, self.clock.cycles)?;
            refined = true;
            self.adopt_births();
            if !self.slab.mesh.is_live(inside.cell) {
                let born = self.slab.last_change().born.iter().copied();
                inside = find_in_reference(&self.slab.mesh, born, point)
                    .or_else(|| find_in_reference(&self.slab.mesh, self.slab.mesh.cells(), point))
                    .ok_or_else(|| {
                        solve_error(self.clock.cycles, format!("the tip's place {point:?} is in no triangle"))
                    })?;
            }
        }
        self.tip = Tip::Inside(inside);
        Ok(refined)
    }

    /// A vertex born between two needle nodes lies on the needle too.
    fn adopt_births(&mut self) {
        for birth in &self.slab.last_change().vertices {
            if birth.origin.parents().all(|(parent, _)| self.shaft.contains(parent)) {
                self.shaft.ahead.push(birth.vertex);
            }
        }
    }
}
