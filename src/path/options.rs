//! How bodies follow paths: the options, and the errors and warnings about them and about paths.

use glam::{DQuat, DVec3};

use crate::curve::options::Ends;
use crate::method::vector_method::VectorMethod;
use crate::names::names;
use crate::path::speed::PathSpeed;
use crate::threads::stop::StoppedError;

/// How the bodies of a set follow their paths, which are the tracks' translations.
///
/// ```
/// use tumble::glam::{DVec3, Vec3};
/// use tumble::paths::{Direction, Follow, PathFrame, PathSpeed};
/// use tumble::{Device, Engine, SampleTimes, Layout, TrackSet};
/// let mut set = TrackSet::new();
/// let road = [[0.0, 0.0, 0.0], [4.0, 0.0, 1.0], [8.0, 1.0, 0.0]];
/// set.push_path("car", &[0.0, 1.0, 3.0], &road, &[])?;
/// let follow = Follow {
///     speed: PathSpeed::Eased { start: 0.2, end: 0.2 },
///     direction: Direction::Point(DVec3::new(4.0, 3.0, 0.0)),
///     frame: PathFrame::Fixed,
///     axes: ["z".parse()?, "y".parse()?],
///     ..Follow::default()
/// };
/// let engine = Engine::new(Device::Cpu)?;
/// let found = engine.follow(&set, &follow, &SampleTimes::fps(30), Layout::TrackMajor)?;
/// assert_eq!(found.positions.get(0, 0), Some(Vec3::ZERO));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Follow {
    /// The curve through the points.
    pub method: VectorMethod,
    /// Its ends. With [`Ends::Loop`] the path is closed: its last point repeats the first, and so
    /// does its last pose.
    pub ends: Ends,
    /// The direction in which a body faces.
    pub direction: Direction,
    /// How it is turned about its direction.
    pub frame: PathFrame,
    /// The upward direction: at the start for [`PathFrame::Minimal`], everywhere for [`PathFrame::Fixed`].
    pub up: DVec3,
    /// What is done with the roll by which a closed path misses its first pose.
    pub twist: Twist,
    /// When a body is where.
    pub speed: PathSpeed,
    /// The axis of the body that faces forward, and the one that faces up.
    pub axes: [BodyAxis; 2],
}

impl Default for Follow {
    /// Along the tangent of a Bessel-Overhauser curve, without a roll about it, as keyed, with z
    /// forward and y up.
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

/// The direction in which a body on a path faces. One that stands still keeps its last direction, at the start
/// the first to come.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Direction {
    /// Along the path.
    #[default]
    Tangent,
    /// To the point this far ahead along the path; beyond an open path's end straight on.
    Ahead(f64),
    /// To a point.
    Point(DVec3),
    /// To the body on a track of the set, which itself faces along its path.
    Track(usize),
}

/// How a body is turned about its direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum PathFrame {
    /// It never turns about its direction (Bishop 1975; Wang et al. 2008).
    #[default]
    Minimal,
    /// Its upward axis is as near to the upward direction as it can be.
    Fixed,
    /// As the path's principal normal has it, without its flips by 180°: they are undone where the
    /// path has an inflection and where its second derivative jumps.
    Frenet,
}

names! {
    PathFrame, "frame",
    Minimal => "minimal",
    Fixed => "fixed",
    Frenet => "frenet",
}

/// What is done with the angle by which a minimal frame is off after one round of a closed path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Twist {
    /// It is spread evenly over the path, so that the last pose is the first.
    #[default]
    Spread,
    /// It stays.
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

/// `+x` is a name of `x` too.
impl std::str::FromStr for BodyAxis {
    type Err = FollowError;

    fn from_str(name: &str) -> Result<Self, FollowError> {
        let name = match name.strip_prefix('+') {
            Some(letter) if !letter.starts_with('-') => letter,
            _ => name,
        };
        let found = Self::ALL.into_iter().find(|axis| axis.name() == name);
        found.ok_or(FollowError::Axes)
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

    /// The name by which programs call it: `x`, `-y`.
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

    /// Its direction in the body.
    #[must_use]
    pub fn direction(self) -> DVec3 {
        DVec3::AXES[self.0 % 3] * self.1
    }
}

impl Follow {
    /// Refuses options that mean nothing.
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

    /// The rotation from the body's own axes to z forward, y up.
    pub(crate) fn body_axes(&self) -> DQuat {
        let [forward, up] = self.axes.map(BodyAxis::direction);
        let axes = glam::DMat3::from_cols(up.cross(forward), up, forward);
        DQuat::from_mat3(&axes).conjugate()
    }

    pub(crate) fn is_closed(&self) -> bool {
        self.ends == Ends::Loop
    }
}

/// Why bodies cannot follow as asked. Indices count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FollowError {
    /// The track has no translations.
    #[error("track {track} has no path; give it translations, or push it as a path")]
    NoPath {
        /// The track's index in the set.
        track: usize,
    },
    /// A closed path's ends are apart.
    #[error(
        "track {track}: the last point of the loop is {gap:e} from the first, more than a millionth of its size; repeat the first point at the end"
    )]
    OpenLoop {
        /// The track's index in the set.
        track: usize,
        /// The distance.
        gap: f64,
    },
    /// No direction.
    #[error("the upward direction ({}, {}, {}) has no length", up.x, up.y, up.z)]
    Up {
        /// The value.
        up: DVec3,
    },
    /// An upward direction at a key, with a frame that has its own.
    #[error(
        "track {track} has upward directions at its keys, which only the minimal frame follows; choose that \
         frame, or leave the directions out"
    )]
    UpsUnused {
        /// The track's index in the set.
        track: usize,
    },
    /// The distance must be positive.
    #[error("the body cannot look {distance} ahead; give a distance above 0")]
    Ahead {
        /// The value.
        distance: f64,
    },
    /// The point is not finite.
    #[error("the body cannot look at ({}, {}, {}); give finite numbers", point.x, point.y, point.z)]
    Point {
        /// The value.
        point: DVec3,
    },
    /// There is no track to look at.
    #[error("track {track} cannot look at track {target}: the set has no such track")]
    Target {
        /// The track's index in the set.
        track: usize,
        /// The track to look at.
        target: usize,
    },
    /// Frenet's frame belongs to the tangent.
    #[error(
        "Frenet's frame faces along the path only; choose another frame, or the tangent as the direction"
    )]
    FrenetAside,
    /// The parts must be between 0 and 1, together too.
    #[error(
        "speed cannot grow over {start} and fall over {end} of the time; both parts together are at most 1"
    )]
    Eased {
        /// The first part.
        start: f64,
        /// The last part.
        end: f64,
    },
    /// The work was stopped ([`Stop`](crate::Stop)).
    #[error(transparent)]
    Stopped(#[from] StoppedError),
    /// Forward and upward must be different axes.
    #[error("a body's forward and upward axes must be two different ones of x, y, z, -x, -y, -z")]
    Axes,
}

/// Something unusual about a path, which is followed all the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FollowWarning {
    /// There is no direction.
    #[error("track {track} stands still; it looks along +z")]
    StandsStill {
        /// The track's index in the set.
        track: usize,
    },
    /// Both ways round are equally far.
    #[error(
        "track {track}: the roll left over at the end of the path is 180°, so its direction is ambiguous"
    )]
    HalfTurn {
        /// The track's index in the set.
        track: usize,
    },
}
