//! Why a surface holds no solid.

/// How a surface of triangles fails to be the border of a solid. Triangles and points are named as given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// What [`check`](crate::check::check) finds.
    #[error("the surface has {count} faults: {kinds}; the first: {first}")]
    Unsound {
        /// Number of findings.
        count: usize,
        /// Their kinds, with numbers.
        kinds: String,
        /// The first of them.
        first: String,
    },
    /// Edges with one triangle.
    #[error(
        "the surface is open: {count} edges have one triangle, the first from point {from} to {to} of triangle {triangle}",
        from = edge[0], to = edge[1]
    )]
    Open {
        /// Number of edges.
        count: usize,
        /// Ends of the first.
        edge: [u32; 2],
        /// Its triangle.
        triangle: u32,
    },
    /// Triangles that have more in common than their corners and edges.
    #[error(
        "the surface touches or crosses itself: at least {count} pairs of triangles, such as {a} and {b}",
        a = triangles[0], b = triangles[1]
    )]
    Touching {
        /// Number of pairs; the search ends after some thousand.
        count: usize,
        /// The first pair found, by ids.
        triangles: [u32; 2],
    },
}
