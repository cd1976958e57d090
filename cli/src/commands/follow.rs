//! `tumble follow`: bodies on paths.

use std::path::Path;
use std::time::Instant;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::{DVec3, Quat, Vec3};
use tumble::{
    BodyAxis, Direction, Ends, Engine, Error, Follow, Followed, Frame, Frames, Layout, PathSpeed,
    TrackSet, Twist, VectorMethod,
};
use tumble_formats::motion::{Joint, Motion, Sampled, Transform};
use tumble_formats::path::{Pace, open_paths};
use tumble_formats::poses::{Poses, WORLD};
use tumble_formats::sample::{Samples as Baked, continue_signs};
use tumble_formats::{Limits, ReadOptions};

use crate::arguments::device::DeviceArguments;
use crate::arguments::gather::Gathered;
use crate::arguments::input;
use crate::arguments::time::{Samples, Sampling};
use crate::batch::output::{self, Plan, Target, Wish};
use crate::batch::room;
use crate::messages::exit::{ALL_INPUTS, Failure, for_each};
use crate::messages::words;

/// Move bodies along paths: where each is at every frame, and which way it faces
#[derive(Debug, Args)]
#[command(after_help = "\
A path is CSV with the header `t,x,y,z` and, where wanted, `ux,uy,uz` (an upward direction at a
point; it may be blank), or NPY of shape (tracks, points, 3). Without times --seconds or --rate says
how long it takes. The result is float32 of shape (frames, tracks, 7), x y z of the position and
x y z w of the rotation, in NPY or CSV; or a clip of a motion file. CPU and Vulkan give the same bits.

Examples:
  tumble follow road.csv --fps 60 -o poses.npy
  tumble follow paths/*.csv -o poses/                        a file for each path
  tumble follow lap.csv --ends loop --speed constant -o lap.glb
  tumble follow points.npy --rate 1.5 --method linear --direction ahead:0.5 -o walk.csv
  tumble follow orbit.csv --direction at:0,1,0 --frame fixed -o camera.glb")]
pub(crate) struct Arguments {
    /// Paths: CSV or NPY files, directories of them, or patterns (`-`: standard input)
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<std::path::PathBuf>,
    #[arg(short, long = "out", value_name = "OUT", help = output::out_help())]
    out: Option<std::path::PathBuf>,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// The format of the results [default: by the name of the output, else npy]
    #[arg(long, visible_alias = "to", value_parser = output::format())]
    format: Option<&'static tumble_formats::Format>,
    #[command(flatten)]
    sampling: Sampling,
    /// The duration of paths without times, seconds
    #[arg(long, value_name = "S", conflicts_with = "rate", value_parser = positive)]
    seconds: Option<f64>,
    /// The way that a body covers in a second on paths without times
    #[arg(long, value_name = "UNITS", value_parser = positive)]
    rate: Option<f64>,
    /// The curve through the points
    #[arg(short, long, value_name = "METHOD", default_value = "bessel-overhauser", value_parser = methods())]
    method: VectorMethod,
    /// What happens at the first and the last point
    #[arg(long, value_name = "ENDS", default_value = "parabolic")]
    ends: EndsArgument,
    /// Which way a body faces: tangent, ahead:DISTANCE, at:X,Y,Z or at:TRACK
    #[arg(long, value_name = "WAY", default_value = "tangent", value_parser = Way::parse)]
    direction: Way,
    /// How it is turned about this direction
    #[arg(long, value_name = "FRAME", default_value = "minimal")]
    frame: FrameArgument,
    /// The upward direction: at the start of minimal frames, everywhere of fixed ones
    #[arg(long, value_name = "X,Y,Z", default_value = "0,1,0", value_parser = vector, allow_hyphen_values = true)]
    up: DVec3,
    /// What becomes of the turn about the direction that a closed path leaves over
    #[arg(long, value_name = "TWIST", default_value = "spread")]
    twist: TwistArgument,
    /// keys, constant, or eased:A,B: growing over the part A of the time, falling over the part B
    #[arg(long, value_name = "SPEED", default_value = "keys", value_parser = speed)]
    speed: PathSpeed,
    /// The axis of the body that faces forward
    #[arg(long, value_name = "AXIS", default_value = "z", value_parser = axis, allow_hyphen_values = true)]
    forward: BodyAxis,
    /// The axis of the body that faces up
    #[arg(long, value_name = "AXIS", default_value = "y", value_parser = axis, allow_hyphen_values = true)]
    upward: BodyAxis,
    #[command(flatten)]
    device: DeviceArguments,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum EndsArgument {
    /// the parabola through the last three points
    Parabolic,
    /// no acceleration
    Natural,
    /// start and end at rest
    Clamped,
    /// the velocity of the straight line between the last two points
    Secant,
    /// the last point repeats the first
    Loop,
    /// the first and the last interval stand still
    Frozen,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum FrameArgument {
    /// it never turns about its direction
    Minimal,
    /// its upward axis is as near to --up as it can be
    Fixed,
    /// as the path's normal has it, without its half turns
    Frenet,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum TwistArgument {
    /// it is spread evenly: the last pose is the first
    Spread,
    /// it stays
    Free,
}

/// A direction; the track that it may name is looked for in each input.
#[derive(Debug, Clone)]
enum Way {
    Known(Direction),
    Track(String),
}

impl Way {
    fn parse(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            text.trim()
                .parse::<f64>()
                .map_err(|_| wrong(text, "number"))
        };
        match text.split_once(':') {
            None if text == "tangent" => Ok(Self::Known(Direction::Tangent)),
            Some(("ahead", distance)) => Ok(Self::Known(Direction::Ahead(number(distance)?))),
            Some(("at", place)) => match vector(place) {
                Ok(point) => Ok(Self::Known(Direction::Point(point))),
                Err(_) if !place.is_empty() => Ok(Self::Track(place.to_owned())),
                Err(error) => Err(error),
            },
            _ => Err("a body faces tangent, ahead:DISTANCE, at:X,Y,Z or at:TRACK".to_owned()),
        }
    }

    fn of(&self, set: &TrackSet, name: &str) -> Result<Direction, Failure> {
        let wanted = match self {
            Self::Known(direction) => return Ok(*direction),
            Self::Track(wanted) => wanted,
        };
        let mut tracks = 0..set.track_count();
        let found = tracks.find(|&track| set.track_name(track) == wanted.as_str());
        let found = found.or_else(|| {
            wanted
                .parse()
                .ok()
                .filter(|&track| track < set.track_count())
        });
        found
            .map(Direction::Track)
            .ok_or_else(|| Failure::usage(format!("{name}: has no track `{wanted}` to look at")))
    }
}

fn wrong(text: &str, what: &str) -> String {
    format!("`{text}` is no finite {what}")
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text
        .parse::<f64>()
        .ok()
        .filter(|number| number.is_finite() && *number > 0.0);
    number.ok_or_else(|| wrong(text, "number above 0"))
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
        _ => Err(wrong(text, "vector X,Y,Z")),
    }
}

fn speed(text: &str) -> Result<PathSpeed, String> {
    let parts = text
        .strip_prefix("eased:")
        .and_then(|parts| parts.split_once(','));
    match (text, parts) {
        ("keys", _) => Ok(PathSpeed::Keys),
        ("constant", _) => Ok(PathSpeed::Constant),
        (_, Some((start, end))) => match (start.parse(), end.parse()) {
            (Ok(start), Ok(end)) => Ok(PathSpeed::Eased { start, end }),
            _ => Err(wrong(text, "pair of parts")),
        },
        _ => Err("a speed is keys, constant or eased:A,B".to_owned()),
    }
}

fn axis(text: &str) -> Result<BodyAxis, String> {
    text.parse()
        .map_err(|error: tumble::FollowError| error.to_string())
}

fn methods() -> impl TypedValueParser<Value = VectorMethod> {
    let names = VectorMethod::ALL.map(VectorMethod::name);
    PossibleValuesParser::new(names).try_map(|name| name.parse::<VectorMethod>())
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Gathered::new(&arguments.paths, None)?;
    let samples = arguments.sampling.samples()?;
    let plan = output::plan(
        &inputs,
        Wish {
            out: arguments.out.as_deref(),
            format: arguments.format,
            overwrite: arguments.overwrite,
            resume: false,
        },
    )?;
    let mut device = arguments.device.open()?;
    let Plan { targets, .. } = plan;
    let jobs: Vec<_> = inputs.paths().into_iter().zip(targets).collect();
    for_each(&jobs, |(path, target)| {
        let started = Instant::now();
        let name = input::name(path);
        let set = arguments.read(path)?;
        let follow = arguments.follow(&set, &name)?;
        let frames = samples.of(&set, &name);
        room::in_memory(&name, &set, &frames, 6)?;
        let work = |engine: &Engine| engine.follow(&set, &follow, &frames, Layout::FrameMajor);
        let found = device.work(work).map_err(|error| failed(&name, &error))?;
        for warning in &found.warnings {
            words::warning(&format!("{name}: {warning}"));
        }
        let written = write(&set, &frames, &samples, &found, target, &name)?;
        written.commit()?;
        words::note(&format!(
            "{name}: {} × {}, {}, on {} in {} → {target}",
            words::count(set.track_count(), "track"),
            words::count(found.rotations.samples(), "frame"),
            arguments.method,
            device.label,
            words::duration(started.elapsed()),
        ));
        Ok(())
    })
}

/// What a path is refused for is the input's fault.
fn failed(name: &str, error: &Error) -> Failure {
    match error {
        Error::Follow(error) => Failure::new(ALL_INPUTS, format!("{name}: {error}")),
        error => Failure::evaluating(name, error),
    }
}

impl Arguments {
    fn read(&self, path: &Path) -> Result<TrackSet, Failure> {
        let pace = match (self.seconds, self.rate) {
            (Some(seconds), _) => Some(Pace::Seconds(seconds)),
            (None, rate) => rate.map(Pace::Rate),
        };
        let options = ReadOptions {
            limits: Limits::default(),
            ..ReadOptions::default()
        };
        open_paths(path, &input::stem(path), pace, &options)
            .map_err(|diagnostic| Failure::input(&diagnostic, ""))
    }

    fn follow(&self, set: &TrackSet, name: &str) -> Result<Follow, Failure> {
        Ok(Follow {
            method: self.method,
            ends: match self.ends {
                EndsArgument::Parabolic => Ends::Parabolic,
                EndsArgument::Natural => Ends::Natural,
                EndsArgument::Clamped => Ends::Clamped {
                    start: DVec3::ZERO,
                    end: DVec3::ZERO,
                },
                EndsArgument::Secant => Ends::Secant,
                EndsArgument::Loop => Ends::Loop,
                EndsArgument::Frozen => Ends::Frozen,
            },
            direction: self.direction.of(set, name)?,
            frame: match self.frame {
                FrameArgument::Minimal => Frame::Minimal,
                FrameArgument::Fixed => Frame::Fixed,
                FrameArgument::Frenet => Frame::Frenet,
            },
            up: self.up,
            twist: match self.twist {
                TwistArgument::Spread => Twist::Spread,
                TwistArgument::Free => Twist::Free,
            },
            speed: self.speed,
            axes: [self.forward, self.upward],
        })
    }
}

/// Writes positions and rotations: numbers, or a clip with a joint for each body.
fn write(
    set: &TrackSet,
    frames: &Frames,
    samples: &Samples,
    found: &Followed,
    target: &Target,
    name: &str,
) -> Result<crate::batch::place::Written, Failure> {
    let timeline = frames
        .resolve(set.track_count(), set.time_span())
        .map_err(|error| Failure::evaluating(name, &error.into()))?;
    let places = found.positions.as_slice();
    let format = target.format();
    if let Some(results) = &format.write {
        let each = places.iter().zip(found.rotations.as_quats());
        let numbers = each.flat_map(|(place, turn)| {
            let [x, y, z, _] = place.to_array();
            let [a, b, c, d] = turn.to_array();
            [x, y, z, a, b, c, d]
        });
        let numbers: Vec<f32> = numbers.collect();
        let poses = Poses {
            set,
            timeline: &timeline,
            components: &WORLD,
            numbers: &numbers,
        };
        return target.prepare(|out| (results.poses)(&poses, out));
    }
    let rest = Joint {
        parent: None,
        rest: Transform::default(),
    };
    let rate = match samples {
        Samples::Rate { rate, .. } => Some(*rate),
        Samples::Times(_) => None,
    };
    let clip = Motion {
        set: set.clone(),
        skeleton: vec![rest; set.track_count()],
        rate,
        ..Motion::default()
    };
    let mut rotations: Vec<Quat> = found.rotations.as_quats().to_vec();
    continue_signs(&mut rotations, set.track_count());
    let samples = Baked {
        times: timeline.times(0).collect(),
        rotations,
        translations: places
            .iter()
            .map(|place| Vec3::from_array([place.x, place.y, place.z]))
            .collect(),
        scales: Vec::new(),
    };
    let notes = [("input", name.to_owned())];
    let sampled: [Sampled<'_>; 1] = [samples.of(&clip, rate, &notes)];
    let options = target.motion_options();
    target.write_motion(|out| match format.write_motion {
        Some(write) => write(&sampled, &options, out),
        None => Ok(Vec::new()),
    })
}
