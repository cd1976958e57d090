//! Errors and warnings about meshes and routes.

use glam::DVec3;
use thiserror::Error;

/// Why vertices and faces are no mesh.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// No face that has an area.
    #[error("the mesh has no faces; give one with triangles or polygons")]
    Empty,
    /// A coordinate is NaN or infinite, or beyond 1e75, where areas overflow.
    #[error("vertex {vertex} (from 0) is at {position}; coordinates must be numbers below 1e75")]
    NotFinite {
        /// Counted from 0.
        vertex: usize,
        /// Where it is said to be.
        position: DVec3,
    },
    /// A face names a vertex that is not there.
    #[error("face {face} (from 0) names vertex {vertex}, and there are {count} from 0 on")]
    Index {
        /// Counted from 0.
        face: usize,
        /// The vertex that it names.
        vertex: u64,
        /// The number of vertices.
        count: usize,
    },
    /// A face of fewer than three corners.
    #[error("face {face} (from 0) has {corners} corners; a face has three or more")]
    Corners {
        /// Counted from 0.
        face: usize,
        /// How many it has.
        corners: usize,
    },
    /// Three different corners on a line.
    #[error(
        "face {face} (from 0) has no area: its corners {corners:?} lie on a line; remove it, or \
         collapse its shortest edge"
    )]
    Flat {
        /// Counted from 0.
        face: usize,
        /// Where its corners are.
        corners: [DVec3; 3],
    },
    /// The sides of a polygon cross each other.
    #[error("the sides of face {face} (from 0) cross each other; cut it into triangles")]
    Crosses {
        /// Counted from 0.
        face: usize,
    },
    /// A polygon of very many corners that is not convex.
    #[error(
        "face {face} (from 0) is not convex and has {corners} corners, and can have {max}; cut it into triangles"
    )]
    TooManyCorners {
        /// Counted from 0.
        face: usize,
        /// How many it has.
        corners: usize,
        /// How many it can have.
        max: usize,
    },
    /// A distance for welding that is none.
    #[error("vertices cannot be welded within {tolerance}; give a distance from 0")]
    Weld {
        /// The distance.
        tolerance: f64,
    },
    /// More triangles than are counted in 32 bits, three corners each.
    #[error("the mesh has {triangles} triangles, and can have {max}; simplify it")]
    TooMany {
        /// How many it has.
        triangles: usize,
        /// How many it can have.
        max: usize,
    },
}

/// Something unusual about a mesh, which is used all the same.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshWarning {
    /// Triangles with two equal corners.
    #[error(
        "{count} triangles have equal corners and are dropped; the first is of face {face} (from 0)"
    )]
    Dropped {
        /// How many.
        count: usize,
        /// The face of the first, from 0.
        face: usize,
    },
    /// Polygons whose corners lie in no plane.
    #[error(
        "{count} polygons are not flat; they are divided into triangles in their mean plane; the first is face {face} (from 0)"
    )]
    NotFlat {
        /// How many.
        count: usize,
        /// The first, from 0.
        face: usize,
    },
    /// Triangles with the same corners as others.
    #[error(
        "{count} triangles have the same corners as others, as in a two-sided sheet; they count once; the first is of face {face} (from 0)"
    )]
    Doubled {
        /// How many.
        count: usize,
        /// The face of the first, from 0.
        face: usize,
    },
    /// Corners that lie on the sides of other faces.
    #[error("{count} corners are on boundary edges of other faces; these faces are divided there")]
    SidesCut {
        /// How many.
        count: usize,
    },
    /// Open sides that almost touch.
    #[error(
        "{count} corners are within {distance:e} of an open side that they do not touch, as at a seam; routes do not cross it: weld them (--weld DISTANCE)"
    )]
    Seam {
        /// How many.
        count: usize,
        /// The distance that was looked at.
        distance: f64,
    },
    /// Triangles that were wound in the opposite direction to their neighbours.
    #[error(
        "{count} triangles wind in the opposite direction to their neighbours; they are reversed"
    )]
    Rewound {
        /// How many.
        count: usize,
    },
    /// A surface with one side, as a Möbius strip.
    #[error("the surface has one side only: it has no normals")]
    OneSided,
}

/// Why there is no route.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum RouteError {
    /// A coordinate of the start or the goal is NaN or infinite.
    #[error("invalid point {point}: coordinates must be finite numbers")]
    NotFinite {
        /// The point.
        point: DVec3,
    },
    /// Start and goal lie on pieces that do not touch.
    #[error(
        "start and goal are on parts of the surface that are not connected: the start's has {start} \
         triangles, the goal's {goal}; if a seam separates them, weld it (--weld DISTANCE)"
    )]
    OtherPiece {
        /// Triangles of the piece that the start lies on.
        start: usize,
        /// Triangles of the piece that the goal lies on.
        goal: usize,
    },
    /// The start or the goal is not on free ground.
    #[error(
        "{point} is not on free ground: it is within the clearance of an obstacle (or nearer to it \
         than the finest edge), or too steep; free ground is {distance} away"
    )]
    NotFree {
        /// The start or the goal, on the surface.
        point: DVec3,
        /// From there to the nearest free ground.
        distance: f64,
    },
    /// Neither half of the cut arrives.
    #[error("the cut by the plane does not lead from start to goal; use `--by exact`")]
    NoPlaneRoute,
    /// No normal tells which plane is meant.
    #[error(
        "the plane is not defined: the normals at start and goal are opposite, or run along the line \
         between them; use `--by exact`"
    )]
    NoPlane,
    /// An edge of three faces: the cut branches.
    #[error(
        "a cut by a plane needs edges of at most two faces, and this mesh has edges of three or more; use `--by exact`"
    )]
    PlaneBranches,
    /// A surface with one side has no normals.
    #[error(
        "the surface has one side only, as a Möbius strip, and so no normals; use `--by exact`"
    )]
    OneSided,
    /// The search for the shortest route needs too much memory.
    #[error(
        "the shortest route over {triangles} triangles needs more than {max} windows, about 1 GiB; \
         simplify the mesh, or use `--by edges`"
    )]
    TooLarge {
        /// Triangles of the mesh.
        triangles: usize,
        /// Windows that are kept at most.
        max: usize,
    },
}
