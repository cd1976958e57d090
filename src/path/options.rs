//! Options for bodies that follow paths, and errors and warnings about the options and the paths.

use glam::{DQuat, DVec3};

use crate::curve::options::Ends;
use crate::method::vector_method::VectorMethod;
use crate::names::fields::with_fields;
use crate::names::names;
use crate::path::speed::PathSpeed;
use crate::threads::stop::StoppedError;

/// Options for the bodies of a set that follow their paths. The paths are the tracks' translations.
///
/// ```
/// use tumble::glam::{DVec3, Vec3};
/// use tumble::paths::{Direction, Follow, PathFrame, PathSpeed};
/// use tumble::{Device, Engine, SampleTimes, Layout, TrackSet};
/// let mut set = TrackSet::new();
/// let road = [[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [8.0, 1.0, 0.0]];
/// set.push_path("car", &[0.0, 1.0, 3.0], &road, &[])?;
/// let follow = Follow::default()
///     .with_speed(PathSpeed::Eased { start: 0.2, end: 0.2 })
///     .with_direction(Direction::Point(DVec3::new(4.0, 3.0, 0.0)))
///     .with_frame(PathFrame::Fixed)
///     .with_axes(["z".parse()?, "y".parse()?]);
/// let engine = Engine::new(Device::Cpu)?;
/// let found = engine.follow(&set, &follow, &SampleTimes::fps(30), Layout::TrackMajor)?;
/// assert_eq!(found.positions.get(0, 0), Some(Vec3::ZERO));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Follow {
    /// The curve through the points.
    pub method: VectorMethod,
    /// The ends of the curve. With [`Ends::Loop`] the path is closed: the last point must equal the first, and the last
    /// pose equals the first pose.
    pub ends: Ends,
    /// The direction in which a body faces.
    pub direction: Direction,
    /// The rotation of the body about its direction.
    pub frame: PathFrame,
    /// The upward direction: for [`PathFrame::Minimal`] at the start, for [`PathFrame::Fixed`] everywhere.
    pub up: DVec3,
    /// The treatment of the roll by which the last pose of a closed path differs from its first.
    pub twist: Twist,
    /// The speed on the path.
    pub speed: PathSpeed,
    /// The axis of the body that faces forward, and the axis that faces up.
    pub axes: [BodyAxis; 2],
}

impl Default for Follow {
    /// A Bessel-Overhauser curve with the speed of its keys; the body faces along the tangent without a roll about
    /// it, with z forward and y up.
    fn default() -> Self {
        Self {
            method: VectorMethod::BesselOverhauser,
            ends: Ends::Parabolic,
            direction: Direction::Tangent,
            frame: PathFrame::Minimal,
            up: DVec3::Y,
            twist: Twist::Spread,
            speed: PathSpeed::Keys,
            axes: [BodyAxis(2, 1.0), BodyAxis(1, 1.0)],
        }
    }
}

with_fields! {
    Follow:
    with_method(method: VectorMethod),
    with_ends(ends: Ends),
    with_direction(direction: Direction),
    with_frame(frame: PathFrame),
    with_up(up: DVec3),
    with_twist(twist: Twist),
    with_speed(speed: PathSpeed),
    with_axes(axes: [BodyAxis; 2]),
}

/// The direction in which a body on a path faces. A body that stands still keeps its last direction; at the start it
/// has the first direction that follows.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum Direction {
    /// Along the path.
    #[default]
    Tangent,
    /// To the point at this distance ahead along the path. After the end of an open path, the path continues
    /// straight.
    Ahead(f64),
    /// To a point.
    Point(DVec3),
    /// To the body on the track with this index in the set. That body faces along its path.
    Track(usize),
}

/// The rotation of a body about its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum PathFrame {
    /// The body does not rotate about its direction (Bishop 1975; Wang et al. 2008).
    #[default]
    Minimal,
    /// The body's upward axis is as near to the upward direction as possible.
    Fixed,
    /// The body follows the path's principal normal. The normal's flips by 180°, at inflections and at jumps of the
    /// second derivative, are removed.
    Frenet,
}

names! {
    PathFrame, "frame",
    Minimal => "minimal",
    Fixed => "fixed",
    Frenet => "frenet",
}

/// The treatment of the roll that a minimal frame has gained after one round of a closed path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Twist {
    /// The roll is removed evenly over the path, so that the last pose equals the first.
    #[default]
    Spread,
    /// The roll is not changed.
    Free,
}

names! {
    Twist, "twist",
    Spread => "spread",
    Free => "free",
}

/// An axis of a body: x, y or z (0, 1 or 2) and its sign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyAxis(pub(crate) usize, pub(crate) f64);

/// Parses the name of an axis; `+x` is the same as `x`.
impl std::str::FromStr for BodyAxis {
    type Err = FollowError;

    fn from_str(name: &str) -> Result<Self, FollowError> {
        let name = match name.strip_prefix('+') {
            Some(letter) if !letter.starts_with('-') => letter,
            _ => name,
        };
        let found = Self::ALL.into_iter().find(|axis| axis.name() == name);
        found.ok_or_else(|| FollowError::UnknownAxis {
            name: name.to_owned(),
        })
    }
}

impl std::fmt::Display for BodyAxis {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(self.name())
    }
}

impl BodyAxis {
    /// Every axis.
    pub const ALL: [Self; 6] = [
        Self(0, 1.0),
        Self(1, 1.0),
        Self(2, 1.0),
        Self(0, -1.0),
        Self(1, -1.0),
        Self(2, -1.0),
    ];

    /// The name that programs use: `x`, `-y`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match (self.0 % 3, self.1 < 0.0) {
            (0, false) => "x",
            (1, false) => "y",
            (_, false) => "z",
            (0, true) => "-x",
            (1, true) => "-y",
            (_, true) => "-z",
        }
    }

    /// The direction of the axis in the body's frame.
    #[must_use]
    pub fn direction(self) -> DVec3 {
        DVec3::AXES[self.0 % 3] * self.1
    }
}

impl Follow {
    /// Refuses invalid options.
    pub(crate) fn check(&self) -> Result<(), FollowError> {
        if !(self.up.is_finite() && self.up.length() > 0.0) {
            return Err(FollowError::Up { up: self.up });
        }
        match self.direction {
            Direction::Ahead(distance) if !(distance > 0.0 && distance.is_finite()) => {
                return Err(FollowError::Ahead { distance });
            }
            Direction::Point(point) if !point.is_finite() => {
                return Err(FollowError::Point { point });
            }
            Direction::Tangent => {}
            _ if self.frame == PathFrame::Frenet => return Err(FollowError::FrenetAside),
            _ => {}
        }
        if let PathSpeed::Eased { start, end } = self.speed {
            let parts = [start, end].iter().all(|part| (0.0..=1.0).contains(part));
            if !parts || start + end > 1.0 {
                return Err(FollowError::Eased { start, end });
            }
        }
        let [forward, up] = self.axes;
        if forward.0 == up.0 {
            return Err(FollowError::Axes);
        }
        Ok(())
    }

    /// The rotation from the body's axes to z forward, y up.
    pub(crate) fn body_axes(&self) -> DQuat {
        let [forward, up] = self.axes.map(BodyAxis::direction);
        let axes = glam::DMat3::from_cols(up.cross(forward), up, forward);
        DQuat::from_mat3(&axes).conjugate()
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.ends == Ends::Loop
    }
}

/// Why bodies cannot follow paths as requested. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FollowError {
    /// The track has no translations.
    #[error("track {track} has no path; give it translations, or push it as a path")]
    NoPath {
        /// The track's index in the set.
        track: usize,
    },
    /// The last point of a closed path differs from the first.
    #[error(
        "track {track}: the last point of the loop is {gap} from the first, more than a millionth of its size; repeat the first point at the end"
    )]
    OpenLoop {
        /// The track's index in the set.
        track: usize,
        /// The distance between the two points.
        gap: f64,
    },
    /// The upward direction has no length, or is not finite.
    #[error("the upward direction ({}, {}, {}) has no length", up.x, up.y, up.z)]
    Up {
        /// The upward direction.
        up: DVec3,
    },
    /// Keys have upward directions, but the frame is not [`PathFrame::Minimal`].
    #[error(
        "track {track} has upward directions at its keys, which only the minimal frame follows; choose that \
         frame, or leave the directions out"
    )]
    UpsUnused {
        /// The track's index in the set.
        track: usize,
    },
    /// The distance of [`Direction::Ahead`] is not positive.
    #[error("the body cannot look {distance} ahead; give a distance above 0")]
    Ahead {
        /// The distance.
        distance: f64,
    },
    /// The point of [`Direction::Point`] is not finite.
    #[error("the body cannot look at ({}, {}, {}); give finite numbers", point.x, point.y, point.z)]
    Point {
        /// The point.
        point: DVec3,
    },
    /// The track of [`Direction::Track`] does not exist.
    #[error("track {track} cannot look at track {target}: the set has no such track")]
    Target {
        /// The track's index in the set.
        track: usize,
        /// The index of the target track.
        target: usize,
    },
    /// [`PathFrame::Frenet`] is requested with a direction other than [`Direction::Tangent`].
    #[error(
        "Frenet's frame faces along the path only; choose another frame, or the tangent as the direction"
    )]
    FrenetAside,
    /// The fractions of [`PathSpeed::Eased`] are not between 0 and 1, or their sum exceeds 1.
    #[error(
        "speed cannot grow over {start} and fall over {end} of the time; both parts together are at most 1"
    )]
    Eased {
        /// The fraction at the start.
        start: f64,
        /// The fraction at the end.
        end: f64,
    },
    /// The work was stopped ([`Stop`](crate::Stop)).
    #[error(transparent)]
    Stopped(#[from] StoppedError),
    /// The forward and the upward axis are not different axes.
    #[error("a body's forward and upward axes must be two different ones of x, y, z, -x, -y, -z")]
    Axes,
    /// No axis of a body has this name.
    #[error("there is no axis `{name}`; there are x, y, z, -x, -y, -z")]
    UnknownAxis {
        /// The text.
        name: String,
    },
}

/// A warning about a path that is followed nevertheless.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FollowWarning {
    /// The body stands still on the whole path, so it has no direction.
    #[error("track {track} does not move; it faces +z")]
    StandsStill {
        /// The track's index in the set.
        track: usize,
    },
    /// The roll after one round is 180°, so it can be removed in two directions.
    #[error(
        "track {track}: the roll left over at the end of the path is 180°, so its direction is ambiguous"
    )]
    HalfTurn {
        /// The track's index in the set.
        track: usize,
    },
}
