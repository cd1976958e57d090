//! Finds routes over surfaces, which become the keys of paths.
//!
//! A [`Mesh`](mesh::Mesh) finds the [`Route`](route::Route) between two of its points by one of four methods
//! ([`By`](route::By)): the shortest path, the cut by a plane, a greedy walk along edges, or the shortest path along
//! edges. A [`Net`](net::Net) is a Bézier surface. [`Ground`](ground::Ground) is a mesh with holes around obstacles.
//! [`walkers`] plans when bodies walk their routes, and where they wait for moving bodies.
//!
//! **Design.** Routes are found once, before anything is evaluated. Therefore all arithmetic is f64 on the CPU, and
//! this crate does not depend on the engine. The shortest route is exact on the triangles themselves, not on a graph
//! of their edges, because a path along edges is longer, and bends where the surface does not. Sine and arctangent
//! are those of `libm`, so that every system finds the same route. Lengths are in the unit of the mesh.
//!
//! **Data flow.**
//!
//! 1. [`mesh`]: equal positions are welded; polygons are cut into triangles; faces are wound alike; open sides are
//!    divided where a corner of another face lies on them. The result is a `Surface`: positions, triangles, normals
//!    and `Links`. The links contain, for each half-edge (side of a face, numbered 3 × face + side), the half-edge of
//!    the neighbouring face, and for each vertex its corners. A tree of boxes finds the nearest face.
//! 2. `endpoints`: start and goal are moved to the surface and become vertices of a copy of it, the `Task`.
//! 3. A search returns a list of `Spot`s, points on edges: `exact` (windows of unfolded straight paths, in a heap),
//!    `plane`, `greedy` or `edges` (Dijkstra).
//! 4. [`Route`](route::Route): the points, the unit normals at them, and the length.
//! 5. [`walkers`]: routes with speeds become plans, which are times at points, so that walkers keep a distance from
//!    each other and from moving bodies.
//!
//! [`Ground`](ground::Ground) adds a step before these: it halves triangles near obstacles, keeps those that are
//! clear, and searches on them. [`Net`](net::Net) has two methods: a straight line in (u, v), or the shortest route
//! on facets.

// Tests may use functions whose last bit differs between systems (clippy.toml).
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
