//! Errors and warnings about meshes and routes.

use glam::DVec3;
use thiserror::Error;

/// Why vertices and faces do not make a mesh.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshError {
    /// There is no face with an area.
    #[error("the mesh has no faces with an area; give one with triangles or polygons")]
    Empty,
    /// A coordinate is NaN or infinite, or its magnitude exceeds 1e75, where areas overflow.
    #[error("vertex {vertex} (from 0) is at {position}; coordinates must be numbers below 1e75")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
        /// Its position.
        position: DVec3,
    },
    /// A face contains a vertex that does not exist.
    #[error("face {face} (from 0) names vertex {vertex}, and there are {count} from 0 on")]
    Index {
        /// Index of the face, from 0.
        face: usize,
        /// Index of the vertex.
        vertex: u64,
        /// The number of vertices.
        count: usize,
    },
    /// A face has fewer than three corners.
    #[error("face {face} (from 0) has {corners} corners; a face has three or more")]
    Corners {
        /// Index of the face, from 0.
        face: usize,
        /// Number of its corners.
        corners: usize,
    },
    /// The sides of a polygon cross each other.
    #[error("the sides of face {face} (from 0) cross each other; cut it into triangles")]
    Crosses {
        /// Index of the face, from 0.
        face: usize,
    },
    /// A polygon that is not convex has too many corners.
    #[error(
        "face {face} (from 0) is not convex and has {corners} corners, and can have {max}; cut it into triangles"
    )]
    TooManyCorners {
        /// Index of the face, from 0.
        face: usize,
        /// Number of its corners.
        corners: usize,
        /// The largest number of corners.
        max: usize,
    },
    /// The distance for welding is negative or not finite.
    #[error("vertices cannot be welded within {tolerance}; give a distance from 0")]
    Weld {
        /// The distance.
        tolerance: f64,
    },
    /// There are too many triangles to number their corners in 32 bits.
    #[error("the mesh has {triangles} triangles, and can have {max}; simplify it")]
    TooMany {
        /// Number of triangles.
        triangles: usize,
        /// The largest number of triangles.
        max: usize,
    },
}

/// An unusual property of a mesh, which can be used nevertheless.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MeshWarning {
    /// Triangles with two equal corners are dropped.
    #[error(
        "{count} triangles have equal corners and are dropped; the first is of face {face} (from 0)"
    )]
    Dropped {
        /// Number of such triangles.
        count: usize,
        /// Index of the face of the first one, from 0.
        face: usize,
    },
    /// Faces whose corners lie on a line, as where three triangles meet at a T-joint, are left out. Their neighbours
    /// are connected as far as their corners lie on each other's sides.
    #[error(
        "{count} faces have no area, since their corners lie on a line; they are left out; the first is face {face} (from 0)"
    )]
    NoArea {
        /// Number of such faces.
        count: usize,
        /// Index of the first one, from 0.
        face: usize,
    },
    /// Polygons whose corners do not lie in one plane are cut in their mean plane.
    #[error(
        "{count} polygons are not flat; they are divided into triangles in their mean plane; the first is face {face} (from 0)"
    )]
    NotFlat {
        /// Number of such polygons.
        count: usize,
        /// Index of the first one, from 0.
        face: usize,
    },
    /// Triangles with the same corners as others count once.
    #[error(
        "{count} triangles have the same corners as others, as in a two-sided sheet; they count once; the first is of face {face} (from 0)"
    )]
    Doubled {
        /// Number of such triangles.
        count: usize,
        /// Index of the face of the first one, from 0.
        face: usize,
    },
    /// Corners lie on open sides of other faces, which are divided there.
    #[error("{count} corners are on boundary edges of other faces; these faces are divided there")]
    SidesCut {
        /// Number of such corners.
        count: usize,
    },
    /// Open sides almost touch, as at a seam. Routes do not cross it.
    #[error(
        "{count} corners are within {distance:e} of an open side that they do not touch, as at a seam; routes do not cross it: weld them (--weld DISTANCE)"
    )]
    Seam {
        /// Number of corners near an open side of another face.
        count: usize,
        /// The distance within which corners count.
        distance: f64,
    },
    /// Triangles that were wound in the opposite direction to their neighbours are reversed.
    #[error(
        "{count} triangles wind in the opposite direction to their neighbours; they are reversed"
    )]
    Rewound {
        /// Number of such triangles.
        count: usize,
    },
    /// The surface has only one side, like a Möbius strip, and therefore no normals.
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
    /// Start and goal lie on pieces of the surface that are not connected.
    #[error(
        "start and goal are on parts of the surface that are not connected: the start's has {start} \
         triangles, the goal's {goal}; if a seam separates them, weld it (--weld DISTANCE)"
    )]
    OtherPiece {
        /// Number of triangles of the piece with the start.
        start: usize,
        /// Number of triangles of the piece with the goal.
        goal: usize,
    },
    /// The start or the goal is not on free ground.
    #[error(
        "{point} is not on free ground: it is within the clearance of an obstacle (or nearer to it \
         than the finest edge), or too steep; free ground is {distance} away"
    )]
    NotFree {
        /// The start or the goal, moved to the surface.
        point: DVec3,
        /// Distance of this point from the nearest free ground.
        distance: f64,
    },
    /// The cut by the plane does not lead from start to goal in either direction.
    #[error("the cut by the plane does not lead from start to goal; use `--by exact`")]
    NoPlaneRoute,
    /// The normals at start and goal do not define a plane.
    #[error(
        "the plane is not defined: the normals at start and goal are opposite, or run along the line \
         between them; use `--by exact`"
    )]
    NoPlane,
    /// An edge has three or more faces, so that the cut branches.
    #[error(
        "a cut by a plane needs edges of at most two faces, and this mesh has edges of three or more; use `--by exact`"
    )]
    PlaneBranches,
    /// The surface has only one side, and therefore no normals.
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
        /// Number of triangles of the mesh.
        triangles: usize,
        /// The largest number of windows.
        max: usize,
    },
}
