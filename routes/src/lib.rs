//! Routes: where the keys of a path come from.
//!
//! A [`Mesh`](mesh::Mesh) gives the [`Route`](route::Route) between two of its points: the shortest
//! one, the cut by a plane, a greedy walk along edges, or the shortest walk along edges
//! ([`By`](route::By)). A [`Net`](net::Net) is a Bézier surface; [`Ground`](ground::Ground) is a mesh
//! with holes where obstacles stand, and [`walkers`] wait for moving bodies.
//!
//! **Why it is so.** Routes are found once, before anything is evaluated, so all arithmetic is f64 on
//! the CPU and nothing here knows the engine. The shortest route is exact on the triangles as they are,
//! not on a graph of their edges, because a path along edges is longer, and bends where the surface
//! does not. Sine and arc tangent are `libm`'s, so that every system finds the same route. Lengths are in
//! the unit of the mesh.
//!
//! **The way of the data.**
//!
//! 1. [`mesh`]: files are read (OBJ, PLY); equal positions are welded; polygons are cut into triangles;
//!    faces are wound alike; open sides are cut where another face's corner lies on them. The result is a
//!    `Surface`: positions, triangles, normals and `Links`, which name for each half-edge (side of a
//!    face, numbered 3 × face + side) the one beyond it, and for each vertex its corners. A tree of boxes
//!    finds the nearest face.
//! 2. `endpoints`: start and goal are moved to the surface and become vertices of a copy of it, the
//!    `Task`.
//! 3. A search gives a list of `Spot`s, points on edges: `exact` (windows of unfolded straight paths, in
//!    a heap), `plane`, `greedy` or `edges` (Dijkstra).
//! 4. [`Route`](route::Route): the points, the unit normals there, and the length.
//! 5. [`walkers`]: routes with speeds become plans, times at points, so that walkers pass each other and
//!    moving bodies at a distance.
//!
//! [`Ground`](ground::Ground) puts a step before these: it halves triangles near obstacles and keeps
//! those that are clear, and searches on them. [`Net`](net::Net) has a line of its own in (u, v); its
//! shortest route is searched on facets.

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod edges;
mod endpoints;
pub mod error;
mod exact;
mod greedy;
pub mod ground;
pub mod mesh;
pub mod net;
mod plane;
pub mod route;
mod together;
mod triangle;
pub mod walkers;
