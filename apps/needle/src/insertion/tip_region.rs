//! Following the tip, and refining the mesh around it.

use super::{Insertion, Scratch};
use crate::error::NeedleError;
use crate::facet::distance_to_segment;
use crate::scene::Fineness;
use crate::slab::solve_error;
use crate::stages::{Stage, Stages};
use crate::tip::{Inside, Tip, deformed, deformed_corners, find_in_reference, follow};
use std::time::Instant;
use stylet_mesh::{CellId, VertexId};
use stylet_physics::material::Hyperelastic;

/// A node on the surface of the needle, up to rounding errors, is within its radius.
const ON_SURFACE: f64 = 1.0 + 1e-9;

impl<const D: usize, const N: usize, M: Hyperelastic<D>> Insertion<D, N, M> {
    /// Follows the tip to its place in the last equilibrium, and refines the cells that it touches there; in a cube
    /// those that the needle touches on its way.
    pub(super) fn locate_and_refine(&mut self, stages: &mut Stages, since: &mut Instant) -> Result<bool, NeedleError> {
        // The nodes of a start mesh of a few cells are far from the needle: it refines before it takes note of them.
        let refined_before = if matches!(self.fineness, Fineness::Fold(_)) {
            let refined = self.refine_along_the_way()?;
            *since = if refined { stages.lap(Stage::Refine, *since) } else { stages.lap_on(Stage::Refine, *since) };
            refined
        } else {
            false
        };
        let crossed = &mut self.scratch.crossed;
        crossed.clear();
        self.tip = follow(&self.slab.mesh, &self.slab.u, self.tip, self.needle.tip(), crossed);
        for index in 0..self.scratch.crossed.len() {
            self.note_ahead(self.scratch.crossed[index]);
        }
        self.note_within_radius();
        *since = stages.lap(Stage::Locate, *since);
        let Tip::Inside(inside) = self.tip else { return Ok(refined_before) };
        let refined = self.refine_around(inside)?;
        if refined {
            *since = stages.lap(Stage::Refine, *since);
        }
        Ok(refined_before || refined)
    }

    /// Takes note of a node that the tip will take when it has passed it.
    fn note_ahead(&mut self, vertex: VertexId) {
        if !self.shaft.contains(vertex) && !self.shaft.ahead.contains(&vertex) {
            self.shaft.ahead.push(vertex);
        }
    }

    /// Bisects all cells that touch the tip until all are fine enough.
    fn refine_around(&mut self, start: Inside<N>) -> Result<bool, NeedleError> {
        let point = start.in_reference(&self.slab.mesh);
        let mut inside = start;
        let mut refined = false;
        loop {
            inside.touching(&self.slab.mesh, &mut self.scratch.touching);
            if !self.bisect_what_is_coarse()? {
                break;
            }
            refined = true;
            self.find_again(&mut inside, point)?;
        }
        self.tip = Tip::Inside(inside);
        Ok(refined)
    }

    /// Bisects all cells that the needle touches on its way from where it was in the tissue to where it is, until all are
    /// fine enough. Leaves the last ones in the scratch.
    fn refine_along_the_way(&mut self) -> Result<bool, NeedleError> {
        let mut refined = false;
        self.scratch.touching.clear();
        let last_place = match self.tip {
            Tip::Inside(inside) => Some(inside.in_reference(&self.slab.mesh)),
            Tip::Outside(_) => None,
        };
        loop {
            self.scratch.crossed.clear();
            let (mesh, u) = (&self.slab.mesh, &self.slab.u);
            let to = self.needle.tip();
            let Tip::Inside(end) = follow(mesh, u, self.tip, to, &mut self.scratch.crossed) else { break };
            let from = match self.tip {
                Tip::Outside(point) => point,
                Tip::Inside(inside) => inside.in_space(mesh, u),
            };
            self.gather_touching(end.cell, from, to);
            if !self.bisect_what_is_coarse()? {
                break;
            }
            refined = true;
            if let (Tip::Inside(mut inside), Some(point)) = (self.tip, last_place) {
                self.find_again(&mut inside, point)?;
                self.tip = Tip::Inside(inside);
            }
        }
        Ok(refined)
    }

    /// The cells of the deformed body that are within the needle's radius of a segment, from a cell on it on.
    fn gather_touching(&mut self, start: CellId, from: [f64; D], to: [f64; D]) {
        let Self { slab, scratch: Scratch { touching, seen, .. }, friction, .. } = self;
        let radius = friction.surface.radius * ON_SURFACE;
        seen.resize(slab.mesh.n_slots().max(seen.len()), false);
        touching.clear();
        touching.push(start);
        seen[start.index()] = true;
        let mut next = 0;
        while let Some(&cell) = touching.get(next) {
            next += 1;
            for neighbor in (0..N).filter_map(|facet| slab.mesh.neighbor(cell, facet)) {
                let near = || {
                    let corners = deformed_corners(&slab.mesh, &slab.u, neighbor);
                    distance_to_segment(&corners, from, to) <= radius
                };
                if !seen[neighbor.index()] && near() {
                    seen[neighbor.index()] = true;
                    touching.push(neighbor);
                }
            }
        }
        touching.iter().for_each(|cell| seen[cell.index()] = false);
    }

    /// Takes note of the nodes of the cells that were touched last that form the needle in the mesh: those within its
    /// radius, and of each edge through its surface the end that is nearer to the surface. So the jagged surface of these
    /// nodes lies on either side of the needle's.
    fn note_within_radius(&mut self) {
        if self.friction.surface.radius == 0.0 {
            return;
        }
        let radius = self.friction.surface.radius;
        self.scratch.near.clear();
        for index in 0..self.scratch.touching.len() {
            let vertices = self.slab.mesh.cell(self.scratch.touching[index]);
            let places = vertices.map(|v| self.needle.frame_of(deformed(&self.slab.mesh, &self.slab.u, v)));
            // How far each corner is within the surface; negative outside.
            let depth = places.map(|place| radius * ON_SURFACE - place.from_axis());
            let is_nearer = |a: usize| (0..N).any(|b| depth[b] >= 0.0 && -depth[a] < depth[b]);
            let too_far = -self.forgotten_ahead();
            let forms_needle = |a: &usize| places[*a].behind > too_far && (depth[*a] >= 0.0 || is_nearer(*a));
            self.scratch.near.extend((0..N).filter(forms_needle).map(|a| vertices[a]));
        }
        self.scratch.near.sort_unstable();
        self.scratch.near.dedup();
        for index in 0..self.scratch.near.len() {
            self.note_ahead(self.scratch.near[index]);
        }
    }

    /// Whether a node is in the cylinder of the needle, or not far ahead of it.
    fn is_within_radius(&self, vertex: VertexId) -> bool {
        let place = self.needle.frame_of(deformed(&self.slab.mesh, &self.slab.u, vertex));
        place.from_axis() <= self.friction.surface.radius * ON_SURFACE && place.behind > -self.forgotten_ahead()
    }

    /// Bisects those of the touched cells that are too coarse, once. Returns whether there were any.
    fn bisect_what_is_coarse(&mut self) -> Result<bool, NeedleError> {
        let Scratch { touching, marked, .. } = &mut self.scratch;
        let mesh = &self.slab.mesh;
        marked.clear();
        match self.fineness {
            Fineness::Size(longest_edge) => {
                let too_long = longest_edge * (1.0 + 1e-9);
                marked.extend(touching.iter().copied().filter(|&cell| mesh.longest_edge(cell) > too_long));
            }
            Fineness::Fold(fold) => marked.extend(touching.iter().copied().filter(|&cell| mesh.level(cell) < fold)),
        }
        if marked.is_empty() {
            return Ok(false);
        }
        self.slab.bisect(&self.scratch.marked, self.clock.cycles)?;
        self.adopt_births();
        Ok(true)
    }

    /// Finds the cell that the place `point` of the undeformed body is in after a bisection.
    fn find_again(&self, inside: &mut Inside<N>, point: [f64; D]) -> Result<(), NeedleError> {
        if self.slab.mesh.is_live(inside.cell) {
            return Ok(());
        }
        let born = self.slab.last_change().born.iter().copied();
        *inside = find_in_reference(&self.slab.mesh, born, point)
            .or_else(|| find_in_reference(&self.slab.mesh, self.slab.mesh.cells(), point))
            .ok_or_else(|| solve_error(self.clock.cycles, format!("the tip's place {point:?} is in no cell")))?;
        Ok(())
    }

    /// A vertex born between two needle nodes lies on the needle too, and so does one born within its radius.
    fn adopt_births(&mut self) {
        let has_radius = self.friction.surface.radius > 0.0;
        for birth in &self.slab.last_change().vertices {
            let between = birth.origin.parents().all(|(parent, _)| self.shaft.contains(parent));
            if between || has_radius && self.is_within_radius(birth.vertex) {
                self.shaft.ahead.push(birth.vertex);
            }
        }
    }
}
