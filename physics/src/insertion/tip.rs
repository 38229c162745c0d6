//! The tip in the mesh: entry, cutting on, withdrawing. After each the mesh has a node at the tip and edges along the needle.

use super::entry::{Contact, contact, entered};
use super::{Insertion, InsertionError, Needle};
use crate::coupling::{CouplingNode, difference, inner, length, set_triple, triple, unit};
use crate::dynamics::State;
use crate::material::Hyperelastic;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use stylet_mesh::geometry::cross;
use stylet_mesh::remesh::{Motion, Outcome, RemeshError};
use stylet_mesh::{CellId, MeshChange, SimplexMesh, VertexId};
use stylet_mesh::{Displaced, Walk};
use stylet_solver::subspace::Constraint;

/// How far before the skin a needle waits for its entry, in edges; any small number does.
const BEFORE: f64 = 1e-3;
/// How far behind the skin it asks to be: below what the remesher takes for the skin itself.
const BEHIND: f64 = 2e-7;
/// Shortest edge from the skin to a tip, in edges of the cells there; what is shorter makes slivers. At 20 mm/s and edges of
/// 6 mm it is a little less than a frame of 20 ms.
const SHORTEST: f64 = 0.05;
/// Shortest way within the tissue that the mesh is asked to follow, in edges: a little more than the remesher takes for one place.
const LEAST: f64 = 1e-5;
/// Cosine between a needle and the normal of a skin that is square to it.
const SQUARE: f64 = 0.99;
/// Where the region ahead of a node is looked up, in edges.
const AHEAD: f64 = 1e-3;

/// What the mesh owes a tip: a way that was too short to be followed, which it has dragged the tissue along instead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Lag {
    /// Slip along the needle, m.
    pub slip: f64,
    /// In space, m.
    pub way: [f64; 3],
    /// Where the bevel has pointed on the way, m: a needle that turns cuts to all sides.
    pub across: [f64; 3],
}

/// What a tip did to the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct TipMove {
    /// Nodes of the needle were made, moved or deleted.
    pub remeshed: bool,
    /// The remesher found no way on; the tip stayed behind.
    pub blocked: bool,
}

impl<M: Hyperelastic<3>> Insertion<M> {
    /// A tip that was at `before`, in a body with the displacement `was`, and has no node: whether it has met the skin. If so it
    /// gets a node there.
    pub(super) fn meet(&mut self, k: usize, before: &[f64; 3], was: &[f64]) -> Result<TipMove, InsertionError> {
        let tip = self.needles[k].shaft.tip();
        let tangent = self.needles[k].shaft.tangent(self.needles[k].shaft.n_nodes() - 1);
        let back = 0.5 * self.integrator.settings().reach;
        let behind = std::array::from_fn(|i| tip[i] - back * tangent[i]);
        let u = &self.state.u;
        // Another needle may have changed the mesh since.
        let was = if was.len() == u.len() { was } else { u };
        // A needle before the skin that is grown or turned has not moved there; and a body that recoils may leave it inside.
        let met = contact(&self.mesh, [was, u], before, &tip)
            .or_else(|| contact(&self.mesh, [u, u], &behind, &tip))
            .or_else(|| entered(&self.mesh, u, &tip, &tangent));
        let Some(contact) = met else { return Ok(TipMove::default()) };
        let Contact { material, inwards, edge, .. } = contact;
        let off = |by: f64| std::array::from_fn(|i| material[i] + by * edge * inwards[i]);
        let id = self.needles[k].id;
        let remesh = |error| InsertionError::Remesh { needle: k, error };
        self.remesher.place_outside(&self.mesh, id, off(-BEFORE)).map_err(remesh)?;
        let mut change = MeshChange::default();
        let moved = self.remesher.advance(&mut self.mesh, id, off(BEHIND), Motion::Penetrating, &mut change);
        self.follow(&change)?;
        moved.map_err(|error| self.shared(k, error))?;
        let Some(vertex) = self.remesher.nodes(id).next() else { return Ok(TipMove::default()) };
        // The skin is where the tip has come to: it is dented by less than a step.
        self.place_vertex(vertex, &tip);
        // It moves with the tip from now on: an impact of what little mass it has.
        let last = self.needles[k].shaft.n_nodes() - 1;
        let Needle { shaft, .. } = &mut self.needles[k];
        set_triple(&mut self.state.v, vertex.index(), &triple(&shaft.v, last));
        set_triple(&mut self.state.a, vertex.index(), &triple(&shaft.a, last));
        shaft.nodes.push(CouplingNode::new(vertex.0));
        self.check_disjoint(k)?;
        Ok(TipMove { remeshed: true, blocked: false })
    }

    /// Whether a tip that slides by `slip` waits with what it has waited for before: at the skin the edge behind it would be much
    /// shorter than its cells, and moves within the tissue may be shorter than the mesh follows.
    pub(super) fn waits(&mut self, k: usize, slip: f64) -> bool {
        let needle = &self.needles[k];
        let least = if needle.shaft.nodes.len() == 1 { SHORTEST } else { LEAST };
        self.is_short(k, needle.lag.slip + slip, least)
    }

    /// Whether a slip is less than a part of the edges at the tip.
    fn is_short(&mut self, k: usize, slip: f64, part: f64) -> bool {
        let Some(tip) = self.needles[k].shaft.nodes.last() else { return false };
        self.mesh.star(VertexId(tip.vertex), &mut self.star);
        let edge = self.star.iter().map(|&cell| self.mesh.longest_edge(cell)).fold(f64::INFINITY, f64::min);
        slip < part * edge
    }

    /// The tissue is dragged along with the tip, and its mesh is owed the way.
    pub(super) fn wait(&mut self, k: usize, slip: f64) -> TipMove {
        if let Some(tip) = self.needles[k].shaft.nodes.last() {
            let (vertex, world) = (VertexId(tip.vertex), self.needles[k].shaft.tip());
            let (moved, across) = (self.moved(vertex, &world), self.bevel(k, slip));
            let lag = &mut self.needles[k].lag;
            lag.slip += slip;
            lag.way = std::array::from_fn(|i| lag.way[i] + moved[i]);
            lag.across = std::array::from_fn(|i| lag.across[i] + across[i]);
            self.place_vertex(vertex, &world);
        }
        TipMove::default()
    }

    /// From a vertex in the deformed body to a place.
    fn moved(&self, vertex: VertexId, to: &[f64; 3]) -> [f64; 3] {
        let (x, u) = (self.mesh.point(vertex), triple(&self.state.u, vertex.index()));
        std::array::from_fn(|i| to[i] - (x[i] + u[i]))
    }

    /// A tip in the tissue that has slid by `slip` along the needle: brings a node of the mesh to where it is, and changes the
    /// list of the needle's nodes. What is new there sticks until its state is guessed.
    pub(super) fn cut(&mut self, k: usize, slip: f64) -> Result<TipMove, InsertionError> {
        let (id, world) = (self.needles[k].id, self.needles[k].shaft.tip());
        let forward = slip > 0.0;
        let owed = std::mem::take(&mut self.needles[k].lag);
        let target = if forward { self.ahead(k, slip, &owed)? } else { self.behind(k, -slip) };
        let mut change = MeshChange::default();
        let motion = if forward { Motion::Penetrating } else { Motion::Retracting };
        let outcome = match target {
            Some(target) => self.remesher.advance(&mut self.mesh, id, target, motion, &mut change),
            None => self.remesher.withdraw(&mut self.mesh, id, &mut change),
        };
        self.follow(&change)?;
        let blocked = match outcome {
            Ok(report) if report.outcome == Outcome::Beyond => {
                return Err(InsertionError::LeftTissue { needle: k, at: world });
            }
            Ok(_) => false,
            Err(RemeshError::NoCandidate { .. }) => true,
            Err(error) => return Err(self.shared(k, error)),
        };
        let nodes: Vec<VertexId> = self.remesher.nodes(id).collect();
        let shaft = &mut self.needles[k].shaft;
        let old = std::mem::take(&mut shaft.nodes);
        shaft.nodes.extend(nodes.iter().map(|vertex| {
            let known = old.iter().find(|node| node.vertex == vertex.0);
            known.copied().unwrap_or(CouplingNode::new(vertex.0))
        }));
        if blocked && forward {
            // What the mesh cannot follow yet drags the tissue along, as long as it is little.
            self.needles[k].lag = owed;
            if self.is_short(k, self.needles[k].lag.slip + slip, SHORTEST) {
                self.wait(k, slip);
            }
        } else if forward && let Some(&tip) = nodes.last() {
            self.place_vertex(tip, &world);
        }
        if forward {
            self.check_disjoint(k)?;
        }
        Ok(TipMove { remeshed: true, blocked })
    }

    /// Where the tip is in the undeformed body with the way that the mesh owes it, moved across by the bevel.
    fn ahead(&mut self, k: usize, slip: f64, owed: &Lag) -> Result<Option<[f64; 3]>, InsertionError> {
        let shaft = &self.needles[k].shaft;
        let tip_place = shaft.tip();
        let world: [f64; 3] = std::array::from_fn(|i| tip_place[i] + owed.way[i]);
        let Some(tip) = shaft.nodes.last().copied() else { return Ok(None) };
        let positions = Displaced { points: self.mesh.points(), displacement: &self.state.u };
        self.mesh.star(VertexId(tip.vertex), &mut self.star);
        let left = || InsertionError::LeftTissue { needle: k, at: world };
        let configuration = self.mesh.configuration(&positions).map_err(|_| left())?;
        let Some(start) = self.star.first() else { return Err(left()) };
        let (cell, weights) = match configuration.walk(*start, world) {
            Walk::Found(found) => (found.cell, found.barycentric),
            Walk::Left { .. } => return Err(left()),
            // Cells that are turned inside out lead a walk astray.
            Walk::Lost => self.cell_of(&world).ok_or_else(left)?,
        };
        let corners = self.mesh.corners(cell);
        let walked: [f64; 3] = std::array::from_fn(|i| (0..4).map(|c| weights[c] * corners[c][i]).sum());
        let vertex = VertexId(tip.vertex);
        let at = self.mesh.point(vertex);
        let (walk, moved) = (difference(&walked, &at), self.moved(vertex, &world));
        let across = self.bevel(k, slip);
        let across: [f64; 3] = std::array::from_fn(|i| owed.across[i] + across[i]);
        // The element ahead tells how far the tip has come, but not which way: in it the displacement falls from that of the tip,
        // which the bevel has put off its path, to that of the tissue ahead. Taken at its word it would bring the tip back by as
        // much as the bevel moves it, and more the smaller the element.
        let ambient =
            self.ambient_gradient(k, vertex, cell).and_then(|f| f.try_inverse()).unwrap_or(Matrix3::identity());
        let along: [f64; 3] = (ambient * Vector3::from(moved)).into();
        let ahead = inner(&walk, &unit(&along));
        // Cells that are turned inside out lead it back.
        let far = if ahead > 0.0 { ahead } else { length(&walk) };
        let across: [f64; 3] = (ambient * Vector3::from(across)).into();
        let scale = far / length(&along);
        if !scale.is_finite() {
            return Ok(Some(walked));
        }
        Ok(Some(std::array::from_fn(|i| at[i] + scale * (along[i] + across[i]))))
    }

    /// How far the bevel puts a tip off its path that has slid by `slip`.
    fn bevel(&mut self, k: usize, slip: f64) -> [f64; 3] {
        let Needle { settings, shaft, .. } = &self.needles[k];
        if settings.bevel == 0.0 {
            return [0.0; 3];
        }
        shaft.rod.frames(&shaft.x, &shaft.director, &mut self.frames);
        self.frames.last().map_or([0.0; 3], |frame| frame[1].map(|e| slip * settings.bevel.tan() * e))
    }

    /// The point of the channel that is `slide` (m, of the deformed body) behind the tip, in the undeformed body; `None` where
    /// the channel ends before.
    fn behind(&self, k: usize, slide: f64) -> Option<[f64; 3]> {
        let shaft = &self.needles[k].shaft;
        let points = self.mesh.points();
        let mut left = slide;
        for pair in shaft.nodes.windows(2).rev() {
            let (from, to) = (points[pair[1].vertex as usize], points[pair[0].vertex as usize]);
            let place = |vertex: u32| -> [f64; 3] {
                let (x, u) = (points[vertex as usize], triple(&self.state.u, vertex as usize));
                std::array::from_fn(|i| x[i] + u[i])
            };
            let long = length(&difference(&place(pair[1].vertex), &place(pair[0].vertex)));
            if left < long {
                let part = left / long;
                return Some(std::array::from_fn(|i| from[i] + part * (to[i] - from[i])));
            }
            left -= long;
        }
        None
    }

    /// Carries the fields, the body, the constraints and the weight across a change of the mesh.
    pub(super) fn follow(&mut self, change: &MeshChange) -> Result<(), InsertionError> {
        if change.is_empty() {
            return Ok(());
        }
        // The body keeps rows of vertices that are gone; so do the fields.
        let n = self.mesh.n_vertex_slots().max(self.body.n_vertices());
        let State { u, v, a, .. } = &mut self.state;
        let past = self.integrator.past_mut().iter_mut().filter(|field| !field.is_empty());
        for field in [u, v, a].into_iter().chain(past) {
            change.carry_field::<3>(field);
            field.resize(3 * n, 0.0);
            for removed in change.removed.iter().filter(|removed| removed.index() < n) {
                set_triple(field, removed.index(), &[0.0; 3]);
            }
        }
        self.subspace.resize(n);
        for birth in &change.vertices {
            // What is born among held vertices is held; a vertex that moves keeps what holds it.
            let moved = birth.origin.parents().any(|(parent, _)| parent == birth.vertex);
            let held = birth.origin.parents().all(|(parent, _)| self.is_held(parent));
            if !moved && self.is_born(birth.vertex) {
                let constraint = if held { Constraint::Fixed } else { Constraint::Free };
                let _ = self.subspace.set(birth.vertex.index(), constraint);
            }
        }
        for removed in change.removed.iter().filter(|removed| removed.index() < n) {
            let _ = self.subspace.set(removed.index(), Constraint::Fixed);
        }
        self.body.apply_change(&self.mesh, change)?;
        self.integrator.tissue().remeshed();
        self.weigh();
        Ok(())
    }

    fn is_held(&self, vertex: VertexId) -> bool {
        matches!(self.subspace.get(vertex.index()), Constraint::Fixed)
    }

    /// Whether a vertex is new to the body: it had no mass before.
    fn is_born(&self, vertex: VertexId) -> bool {
        self.body.lumped_mass().get(vertex.index()).is_none_or(|&mass| mass == 0.0)
    }

    fn place_vertex(&mut self, vertex: VertexId, world: &[f64; 3]) {
        let x = self.mesh.point(vertex);
        set_triple(&mut self.state.u, vertex.index(), &difference(world, &x));
    }

    /// A needle in the way of another by name, everything else as the remesher says.
    fn shared(&self, k: usize, error: RemeshError) -> InsertionError {
        match error {
            RemeshError::SharedElement { other, cell, .. } => {
                let other = self.needles.iter().position(|needle| needle.id.0 == other).unwrap_or(0);
                InsertionError::SharedElement { needle: k, other, cell }
            }
            error => InsertionError::Remesh { needle: k, error },
        }
    }

    /// Refuses a tip whose cells another needle touches.
    fn check_disjoint(&mut self, k: usize) -> Result<(), InsertionError> {
        if self.needles.len() < 2 {
            return Ok(());
        }
        let Some(tip) = self.needles[k].shaft.nodes.last() else { return Ok(()) };
        self.mesh.star(VertexId(tip.vertex), &mut self.star);
        for &cell in &self.star {
            for vertex in self.mesh.cell(cell) {
                let touches = |needle: &Needle| needle.nodes().iter().any(|node| node.vertex == vertex.0);
                let other = (0..self.needles.len()).find(|&other| other != k && touches(&self.needles[other]));
                if let Some(other) = other {
                    return Err(InsertionError::SharedElement { needle: k, other, cell: cell.0 });
                }
            }
        }
        Ok(())
    }

    /// The region of the tissue that lies from a vertex in a direction of the undeformed body.
    pub(super) fn region_ahead(&mut self, vertex: u32, direction: &[f64; 3]) -> u32 {
        self.mesh.star(VertexId(vertex), &mut self.star);
        let x = self.mesh.point(VertexId(vertex));
        let best =
            self.star.iter().copied().max_by(|&a, &b| {
                depth_of(&self.mesh, a, &x, direction).total_cmp(&depth_of(&self.mesh, b, &x, direction))
            });
        best.map_or(0, |cell| self.mesh.region(cell))
    }

    /// Whether the undeformed tissue is the same all around a direction at a vertex: no border of a region is there, nor skin but
    /// such as lies square to the direction. The cells around it are in `star`, where [`region_ahead`](Self::region_ahead) of the
    /// same vertex has left them.
    pub(super) fn is_even(&self, vertex: u32, direction: &[f64; 3]) -> bool {
        let (mesh, star) = (&self.mesh, &self.star);
        let region = star.first().map(|&cell| mesh.region(cell));
        let skin = |cell, facet: usize| mesh.cell(cell)[facet].0 != vertex && mesh.boundary_tag(cell, facet).is_some();
        let is_square = |cell, facet: usize| {
            let corners = mesh.corners(cell);
            let [a, b, c] = [1, 2, 3].map(|k| corners[(facet + k) % 4]);
            let normal = unit(&cross(&difference(&b, &a), &difference(&c, &a)));
            inner(&normal, direction).abs() > SQUARE
        };
        star.iter().all(|&cell| {
            Some(mesh.region(cell)) == region && (0..4).all(|facet| !skin(cell, facet) || is_square(cell, facet))
        })
    }

    /// The direction of the needle at a coupling node in the undeformed body, towards the tip.
    pub(super) fn material_tangent(&self, k: usize, node: usize) -> [f64; 3] {
        let shaft = &self.needles[k].shaft;
        let point = |i: usize| self.mesh.point(VertexId(shaft.nodes[i].vertex));
        match (node, shaft.nodes.len()) {
            (_, 1) => shaft.tangent(shaft.n_nodes() - 1),
            (node, q) if node + 1 < q => unit(&difference(&point(node + 1), &point(node))),
            (node, _) => unit(&difference(&point(node), &point(node - 1))),
        }
    }
}

/// How deep within a cell the point a little ahead of `x` is: its least barycentric coordinate.
fn depth_of(mesh: &SimplexMesh<3, 4>, cell: CellId, x: &[f64; 3], direction: &[f64; 3]) -> f64 {
    let corners = mesh.corners(cell);
    let ahead = AHEAD * mesh.longest_edge(cell);
    let p = std::array::from_fn(|i| x[i] + ahead * direction[i]);
    let lambda = stylet_mesh::geometry::barycentric(&corners, &p);
    lambda.map_or(f64::NEG_INFINITY, |lambda| lambda.iter().copied().fold(f64::INFINITY, f64::min))
}

/// Makes the motion of a needle at its coupling nodes that of the tissue, but along itself.
pub(super) fn agree(v: &mut [f64], node: usize, tissue: &[f64; 3], tangent: &[f64; 3]) {
    let own = triple(v, node);
    let along = inner(tangent, &own) - inner(tangent, tissue);
    set_triple(v, node, &std::array::from_fn(|i| tissue[i] + along * tangent[i]));
}
