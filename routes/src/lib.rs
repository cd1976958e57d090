//! Routes: where the keys of a path come from.
//!
//! A [`Mesh`](mesh::Mesh) gives the [`Route`](route::Route) between two of its points: the shortest
//! one, the cut by a plane, a greedy walk along edges, or the shortest walk along edges
//! ([`By`](route::By)). A [`Net`](net::Net) is a Bézier surface; [`Ground`](ground::Ground) is a mesh
//! with holes where obstacles stand, and [`walkers`] wait for what moves. All arithmetic is f64 on
//! the CPU. Lengths are in the unit of the mesh.

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod edges;
pub mod error;
mod exact;
mod greedy;
pub mod ground;
pub mod mesh;
pub mod net;
mod places;
mod plane;
pub mod route;
mod together;
mod triangle;
pub mod walkers;
