//! Options for bodies that follow paths: those of `follow`, and of the commands that draw paths.

use std::path::Path;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use glam::{DVec3, Mat3, Quat};
use tumble::paths::{BodyAxis, Direction, Follow, FollowError, PathFrame, PathSpeed, Twist};
use tumble::{Channel, Ends, TrackError, TrackSet, VectorKeys, VectorMethod};
use tumble_formats::motion::Motion;
use tumble_formats::path::{Pace, open_paths};
use tumble_formats::{Limits, Loaded, ReadOptions};

use crate::arguments::input::InputReader;
use crate::arguments::interpolation::{each_once, ends};
use crate::arguments::options::CommandLine;
use crate::arguments::output::one_of;
use crate::messages::exit::Failure;
use crate::messages::names;

/// The heading of these options in help.
pub(crate) const PATHS: &str = "Paths";

/// How paths are followed. Options that also exist for rotations are called `--path-…` here, in every command.
#[derive(Debug, Clone, Args)]
pub(crate) struct PathArguments {
    /// The duration in seconds: of paths without times
    #[arg(long, value_name = "S", conflicts_with = "pace", value_parser = positive)]
    seconds: Option<f64>,
    /// The distance that a body covers in a second on paths without times
    #[arg(long = "pace", alias = "rate", value_name = "UNITS", value_parser = positive)]
    pace: Option<f64>,
    /// How to interpolate: the curve through the points of a path
    #[arg(long, value_name = "METHOD", default_value = "bessel-overhauser", value_parser = methods())]
    path_method: VectorMethod,
    /// The boundary condition at the first and the last key: of a path, at its first and last point
    #[arg(long, value_name = "ENDS", default_value_t, value_parser = ends())]
    path_ends: Ends,
    /// Which way a body faces: tangent, ahead:DISTANCE, at:X,Y,Z or at:TRACK
    #[arg(long, value_name = "DIRECTION", default_value = "tangent", value_parser = DirectionArgument::parse)]
    direction: DirectionArgument,
    /// How the body is rotated about its direction (its roll); several are drawn side by side
    #[arg(
        id = "path_frame",
        long = "path-frame",
        alias = "frame",
        value_name = "FRAMES",
        value_delimiter = ',',
        default_value = "minimal",
        value_parser = frame()
    )]
    path_frames: Vec<PathFrame>,
    /// The upward direction: at the start for minimal frames, everywhere for fixed ones
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = vector, allow_hyphen_values = true)]
    path_up: DVec3,
    /// Ignore the upward directions of a file (ux, uy, uz): only minimal frames use them
    #[arg(long)]
    no_ups: bool,
    /// Whether the roll that is left at the end of a closed path is spread over the path or stays at its end
    #[arg(long, value_name = "TWIST", default_value_t, value_parser = twist())]
    twist: Twist,
    /// The speed along the curve: as-keyed, constant, or eased:A,B, which speeds up over the fraction A of the
    /// time and slows down over the fraction B [default: as-keyed]
    #[arg(long, value_name = "SPEED", default_value = "keys", hide_default_value = true, value_parser = speed)]
    path_speed: PathSpeed,
    /// The axis of the body that faces forward
    #[arg(long = "body-forward", alias = "forward", value_name = "AXIS", default_value = "z", value_parser = axis, allow_hyphen_values = true)]
    body_forward: BodyAxis,
    /// The axis of the body that faces up
    #[arg(long = "body-up", alias = "upward", value_name = "AXIS", default_value = "y", value_parser = axis, allow_hyphen_values = true)]
    body_up: BodyAxis,
}

fn frame() -> impl TypedValueParser<Value = PathFrame> {
    one_of(PathFrame::ALL.map(|frame| (frame.name(), frame_summary(frame), frame)))
}

/// A path frame's meaning in a few words, for help and pages.
pub(crate) fn frame_summary(frame: PathFrame) -> &'static str {
    match frame {
        PathFrame::Minimal => "no rotation about the direction (rotation-minimizing)",
        PathFrame::Fixed => "the upward axis stays as close to the upward direction as possible",
        PathFrame::Frenet => "the path's normal (Frenet), without its flips",
        other => other.name(),
    }
}

fn twist() -> impl TypedValueParser<Value = Twist> {
    let help = |twist| match twist {
        Twist::Spread => "spread evenly, so that the last pose equals the first",
        Twist::Free => "leave it",
    };
    one_of(Twist::ALL.map(|twist| (twist.name(), help(twist), twist)))
}

/// `--direction`; a track that it names is looked up in each input.
#[derive(Debug, Clone)]
enum DirectionArgument {
    Known(Direction),
    Track(String),
}

impl DirectionArgument {
    fn parse(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| expected("number"));
        match text.split_once(':') {
            None if text == "tangent" => Ok(Self::Known(Direction::Tangent)),
            Some(("ahead", distance)) => Ok(Self::Known(Direction::Ahead(number(distance)?))),
            Some(("at", target)) => match vector(target) {
                Ok(point) => Ok(Self::Known(Direction::Point(point))),
                Err(_) if !target.is_empty() => Ok(Self::Track(target.to_owned())),
                Err(error) => Err(error),
            },
            _ => Err("a body faces tangent, ahead:DISTANCE, at:X,Y,Z or at:TRACK".to_owned()),
        }
    }

    fn of(&self, set: &TrackSet, name: &str) -> Result<Direction, Failure> {
        let track_name = match self {
            Self::Known(direction) => return Ok(*direction),
            Self::Track(text) => text,
        };
        let mut tracks = 0..set.track_count();
        let found = tracks.find(|&track| set.track_name(track) == track_name.as_str());
        let found = found.or_else(|| {
            track_name
                .parse()
                .ok()
                .filter(|&track| track < set.track_count())
        });
        found.map(Direction::Track).ok_or_else(|| {
            Failure::usage(format!("{name}: has no track `{track_name}` to look at"))
        })
    }
}

fn expected(kind: &str) -> String {
    format!("expected a finite {kind}")
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let number = text
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| expected("number above 0"))
}

fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Result<Vec<f64>, _> = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect();
    match numbers.as_deref() {
        Ok(&[x, y, z]) if x.is_finite() && y.is_finite() && z.is_finite() => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err(expected("vector X,Y,Z")),
    }
}

fn speed(text: &str) -> Result<PathSpeed, String> {
    let parts = text
        .strip_prefix("eased:")
        .and_then(|parts| parts.split_once(','));
    match (text, parts) {
        // `keys` is the older name, which manifests may contain.
        ("as-keyed" | "keys", _) => Ok(PathSpeed::Keys),
        ("constant", _) => Ok(PathSpeed::Constant),
        (_, Some((start, end))) => match (start.parse(), end.parse()) {
            (Ok(start), Ok(end)) => Ok(PathSpeed::Eased { start, end }),
            _ => Err(expected("pair of fractions")),
        },
        _ => Err("a speed is as-keyed, constant or eased:A,B".to_owned()),
    }
}

fn axis(text: &str) -> Result<BodyAxis, String> {
    let axis = text.parse();
    axis.map_err(|error: FollowError| error.to_string())
}

fn methods() -> impl TypedValueParser<Value = VectorMethod> {
    let names = VectorMethod::ALL.map(VectorMethod::name);
    PossibleValuesParser::new(names).try_map(|name| name.parse::<VectorMethod>())
}

impl PathArguments {
    /// Refuses these options if there are no paths.
    pub(crate) fn refuse(command_line: &CommandLine, on: &str) -> Result<(), Failure> {
        command_line.refuse_group::<Self>(on, "it is for files of paths; leave it out")
    }

    /// The curve.
    pub(crate) fn method(&self) -> VectorMethod {
        self.path_method
    }

    /// The frames, each once; at least one.
    pub(crate) fn frames(&self) -> Vec<PathFrame> {
        each_once(self.path_frames.iter())
    }

    /// The rotation of a body that faces along z, with y up, to `--body-forward` and `--body-up`.
    pub(crate) fn body_rotation(&self) -> Quat {
        let [z, y] = [self.body_forward, self.body_up].map(|axis| axis.direction().as_vec3());
        Quat::from_mat3(&Mat3::from_cols(y.cross(z), y, z))
    }

    /// Reads the paths of a file, a track each.
    pub(crate) fn read(&self, path: &Path) -> Result<Motion, Failure> {
        let pace = match (self.seconds, self.pace) {
            (Some(seconds), _) => Some(Pace::Seconds(seconds)),
            (None, pace) => pace.map(Pace::Rate),
        };
        let options = ReadOptions {
            limits: Limits::default(),
            ..ReadOptions::default()
        };
        let mut paths = open_paths(path, &names::stem(path), pace, &options)
            .map_err(|diagnostic| Failure::input(&diagnostic, ""))?;
        if self.no_ups {
            paths.set = without_ups(&paths.set)
                .map_err(|error| Failure::evaluating(&names::input(path), &error.into()))?;
        }
        Ok(paths)
    }

    /// How the paths of a file, which messages call `name`, are followed in a frame.
    pub(crate) fn follow(
        &self,
        paths: &Motion,
        name: &str,
        frame: PathFrame,
    ) -> Result<Follow, Failure> {
        Ok(Follow::default()
            .with_method(self.path_method)
            .with_ends(self.path_ends)
            .with_direction(match self.direction.of(&paths.set, name)? {
                Direction::Point(point) => Direction::Point(point - paths.origin(0)),
                direction => direction,
            })
            .with_frame(frame)
            .with_up(self.path_up)
            .with_twist(self.twist)
            .with_speed(self.path_speed)
            .with_axes([self.body_forward, self.body_up]))
    }
}

impl InputReader for PathArguments {
    fn read(&self, path: &Path) -> Result<Loaded, Failure> {
        Ok(Loaded::of(self.read(path)?, Vec::new()))
    }

    fn limits(&self) -> Limits {
        Limits::default()
    }
}

/// The paths alone, without their upward directions.
fn without_ups(set: &TrackSet) -> Result<TrackSet, TrackError> {
    let mut plain = TrackSet::new();
    for track in 0..set.track_count() {
        let name = set.track_name(track);
        if let Some(VectorKeys { times, keys, .. }) = set.vector_keys(Channel::Translation, track) {
            plain.push_path(&name, times, keys, &[])?;
        }
    }
    Ok(plain)
}
