//! The door to METIS: a graph that it cannot stumble over, and the two calls made to it.
#![allow(unsafe_code)] // METIS_NodeND has no safe wrapper, and no other library orders 3D meshes as well

use crate::ordering::Adjacency;
use std::sync::{Mutex, PoisonError};

/// METIS draws from the generator of the C library, one for the whole process: a second call would disturb the first.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Any fixed number: the same graph gives the same result.
const SEED: i32 = 42;

/// A simple undirected graph with 32-bit indices: no loops, each edge once from either end, neighbours ascending.
#[derive(Debug)]
pub(crate) struct MetisGraph {
    xadj: Vec<i32>,
    adjncy: Vec<i32>,
}

/// Why METIS cannot be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetisError {
    /// More than 32-bit indices can name.
    #[error("a graph of {nodes} nodes and {ends} ends of edges is too large for METIS")]
    TooLarge {
        /// Number of nodes.
        nodes: usize,
        /// Number of ends of edges.
        ends: usize,
    },
    /// METIS gave up.
    #[error("METIS ended with status {status}")]
    Failed {
        /// Its return code: -2 bad input, -3 out of memory, -4 otherwise.
        status: i32,
    },
}

impl MetisGraph {
    /// The graph with loops left out, and with an edge wherever one of the two ends names the other.
    pub(crate) fn new(graph: &(impl Adjacency + ?Sized)) -> Result<Self, MetisError> {
        let n = graph.n_nodes();
        let edges =
            || (0..n).flat_map(|i| graph.neighbours(i).iter().map(move |&j| (i, j as usize))).filter(|(i, j)| i != j);
        // Both directions of every entry, then each row sorted and rid of repetitions.
        let mut starts = vec![0usize; n + 1];
        for (i, j) in edges() {
            starts[i + 1] += 1;
            starts[j + 1] += 1;
        }
        for i in 0..n {
            starts[i + 1] += starts[i];
        }
        let too_large = || MetisError::TooLarge { nodes: n, ends: starts[n] };
        // METIS counts the ends of edges in its index type, with room to spare for what it builds from them.
        if n > i32::MAX as usize / 8 || starts[n] > i32::MAX as usize / 2 {
            return Err(too_large());
        }
        let mut adjncy = vec![0i32; starts[n]];
        let mut next = starts.clone();
        for (i, j) in edges() {
            adjncy[next[i]] = j as i32; // below the bound checked above
            next[i] += 1;
            adjncy[next[j]] = i as i32;
            next[j] += 1;
        }
        let mut xadj = Vec::with_capacity(n + 1);
        xadj.push(0);
        let mut kept = 0;
        for i in 0..n {
            adjncy[starts[i]..starts[i + 1]].sort_unstable();
            let first = kept;
            for at in starts[i]..starts[i + 1] {
                if kept == first || adjncy[kept - 1] != adjncy[at] {
                    adjncy[kept] = adjncy[at];
                    kept += 1;
                }
            }
            xadj.push(kept as i32); // as above
        }
        adjncy.truncate(kept);
        Ok(Self { xadj, adjncy })
    }

    pub(crate) fn n_nodes(&self) -> usize {
        self.xadj.len() - 1
    }

    pub(crate) fn has_edges(&self) -> bool {
        !self.adjncy.is_empty()
    }

    /// A nested-dissection order, old numbers in the new order. The graph has an edge.
    pub(crate) fn node_nd(&mut self) -> Result<Vec<i32>, MetisError> {
        assert!(self.has_edges(), "METIS is not asked about graphs without edges");
        let n = self.n_nodes();
        let mut nodes = n as i32; // checked by `new`
        let (mut order, mut inverse) = (vec![-1i32; n], vec![-1i32; n]);
        let mut options = [-1i32; metis_sys::METIS_NOPTIONS as usize];
        options[metis_sys::moptions_et_METIS_OPTION_SEED as usize] = SEED;
        let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: `xadj` has `nodes + 1` ascending offsets from 0 to the length of `adjncy`; all entries of `adjncy` are
        // nodes, no node is its own neighbour and every edge is there from both ends (see `new`). Weights may be null. Both
        // outputs have `nodes` entries, `options` the length that the library asks for, with -1 for its defaults. All of
        // them live until the call returns, and it keeps no pointer.
        let status = unsafe {
            metis_sys::METIS_NodeND(
                &raw mut nodes,
                self.xadj.as_mut_ptr(),
                self.adjncy.as_mut_ptr(),
                std::ptr::null_mut(),
                options.as_mut_ptr(),
                order.as_mut_ptr(),
                inverse.as_mut_ptr(),
            )
        };
        if status == metis_sys::rstatus_et_METIS_OK { Ok(order) } else { Err(MetisError::Failed { status }) }
    }

    /// The part of each node, below `n_parts`. There are at least two parts, more nodes than parts, and edges.
    pub(crate) fn part_kway(&self, n_parts: i32) -> Result<Vec<i32>, MetisError> {
        assert!(self.has_edges() && n_parts >= 2 && self.n_nodes() > n_parts as usize);
        let mut parts = vec![0; self.n_nodes()];
        let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let graph = metis::Graph::new(1, n_parts, &self.xadj, &self.adjncy).expect("the graph is checked");
        let status = match graph.set_option(metis::option::Seed(SEED)).part_kway(&mut parts) {
            Ok(_) => return Ok(parts),
            Err(metis::Error::Input) => metis_sys::rstatus_et_METIS_ERROR_INPUT,
            Err(metis::Error::Memory) => metis_sys::rstatus_et_METIS_ERROR_MEMORY,
            Err(metis::Error::Other) => metis_sys::rstatus_et_METIS_ERROR,
        };
        Err(MetisError::Failed { status })
    }
}
