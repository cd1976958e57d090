//! `tumble follow`: bodies on paths.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{ArgAction, Args};
use glam::Vec3;
use tumble::{Engine, Error, Follow, FollowError, Followed, Frames, Layout, TrackSet};
use tumble_formats::motion::{Joint, Motion, Sampled, Transform};
use tumble_formats::poses::{Poses, WORLD};
use tumble_formats::sample::Samples as Baked;
use tumble_formats::{Limits, Loaded};

use crate::arguments::device::{DeviceArguments, Opened};
use crate::arguments::gather::Gathered;
use crate::arguments::given::Given;
use crate::arguments::input;
use crate::arguments::path::PathArguments;
use crate::arguments::results::Results;
use crate::arguments::time::{Samples, Sampling};
use crate::batch::output::Target;
use crate::batch::place::Written;
use crate::batch::room;
use crate::batch::run::Evaluated;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Move bodies along paths: where each is at every frame, and which way it faces
#[derive(Debug, Args)]
#[command(
    mut_arg("path_method", |arg| arg.long("method").short('m')),
    mut_arg("path_ends", |arg| arg.long("ends")),
    mut_arg("path_up", |arg| arg.long("up")),
    mut_arg("path_speed", |arg| arg.long("speed")),
    mut_arg("path_frames", |arg| {
        let arg = arg.value_name("FRAME").help("How it is turned about this direction");
        arg.action(ArgAction::Set).value_delimiter(None::<char>)
    })
)]
#[command(after_help = "\
A path is CSV with the header `t,x,y,z` and, where wanted, `ux,uy,uz` (an upward direction at a
point; it may be blank), or NPY of shape (tracks, points, 3). Without times --seconds or --rate says
how long it takes. The result is float32 (float64 of positions far from 0, such as those of maps) of
shape (frames, tracks, 7), x y z of the position and x y z w of the rotation, in NPY or CSV; or a clip of a motion file. CPU and Vulkan give the same bits.

Examples:
  tumble follow road.csv --fps 60 -o poses.npy
  tumble follow paths/*.csv -o poses/                        a file for each path
  tumble follow paths -o poses --resume                      goes on where it stopped
  tumble follow lap.csv --ends loop --speed constant -o lap.glb
  tumble follow points.npy --rate 1.5 --method linear --direction ahead:0.5 -o walk.csv
  tumble follow orbit.csv --direction at:0,1,0 --frame fixed -o camera.glb")]
pub(crate) struct Arguments {
    #[command(flatten)]
    given: Given,
    /// Paths: CSV or NPY files, directories of them, or patterns (`-`: standard input)
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    results: Results,
    #[command(flatten)]
    sampling: Sampling,
    #[command(flatten)]
    path: PathArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = Gathered::new(&arguments.paths, None)?;
    let samples = arguments.sampling.samples()?;
    let plan = arguments.results.plan(&inputs)?;
    let mut device = arguments.device.open()?;
    let read = |path: &Path| -> Result<Loaded, Failure> {
        let paths = arguments.path.read(path)?;
        Ok(Loaded::of(paths, Vec::new()))
    };
    let options = arguments.options(&samples);
    let results = &arguments.results;
    let most = Limits::default().file;
    results.make_of((read, most), plan, options, |file, loaded, target, done| {
        let path = file.path();
        for clip in &loaded.clips {
            let made = arguments.body(path, clip, &samples, target, &mut device)?;
            done(target.name(), made)?;
        }
        Ok(())
    })
}

impl Arguments {
    /// All that decides over the bytes of a result besides its input.
    fn options(&self, samples: &Samples) -> String {
        let times = samples.digest();
        format!("follow {} times={times}", self.given.options())
    }

    /// The bodies on the paths of one file, written.
    fn body(
        &self,
        path: &Path,
        paths: &Motion,
        samples: &Samples,
        target: &Target,
        device: &mut Opened,
    ) -> Result<Evaluated, Failure> {
        let started = Instant::now();
        let (name, set) = (input::name(path), &paths.set);
        let [frame] = self.path.frames()[..] else {
            return Err(Failure::usage("a body is followed in one frame at a time"));
        };
        let follow = self.path.follow(paths, &name, frame)?;
        let frames = samples.of(set, &name);
        let found = followed(device, &name, set, &follow, &frames)?;
        let written = write(paths, &frames, samples, &found, target, &name)?;
        let told = format!(
            "{name}: {} × {}, {}, on {} in {} → {target}",
            words::count(set.track_count(), "track"),
            words::count(found.rotations.samples(), "frame"),
            self.path.method(),
            device.label,
            words::duration(started.elapsed()),
        );
        Ok(Evaluated {
            written,
            device: device.label.clone(),
            told,
        })
    }
}

/// Where the bodies of a set are at some frames, `[frame][track]`; warnings are said.
pub(crate) fn followed(
    device: &mut Opened,
    name: &str,
    set: &TrackSet,
    follow: &Follow,
    frames: &Frames,
) -> Result<Followed, Failure> {
    let timeline = room::in_memory(name, set, frames, 6)?;
    let work = |engine: &Engine| engine.follow(set, follow, frames, Layout::FrameMajor);
    let found = device
        .choose(set.track_count() * timeline.len())
        .and_then(|()| device.work(work))
        .map_err(|error| failed(name, &error))?;
    for warning in &found.warnings {
        words::warning(&format!("{name}: {warning}"));
    }
    Ok(found)
}

/// What a path is refused for is the input's fault.
fn failed(name: &str, error: &Error) -> Failure {
    match error {
        Error::Follow(error) => {
            let hint = match error {
                FollowError::UpsUnused { .. } => " (--frame minimal, --no-ups)",
                _ => "",
            };
            Failure::new(ALL_INPUTS, format!("{name}: {error}{hint}"))
        }
        error => Failure::evaluating(name, error),
    }
}

/// Writes positions and rotations: numbers, or a clip with a joint for each body.
fn write(
    paths: &Motion,
    frames: &Frames,
    samples: &Samples,
    found: &Followed,
    target: &Target,
    name: &str,
) -> Result<Written, Failure> {
    let set = &paths.set;
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
            origins: &paths.origins,
        };
        return target.prepare(|out| (results.poses)(&poses, out));
    }
    let rest = Joint {
        parent: None,
        rest: Transform::default(),
    };
    let rate = match samples {
        Samples::Rate { rate, .. } => Some(*rate),
        Samples::Times(_) | Samples::Keys(_) => None,
    };
    let clip = Motion {
        set: set.clone(),
        skeleton: vec![rest; set.track_count()],
        rate,
        origins: paths.origins.clone(),
        ..Motion::default()
    };
    let samples = Baked {
        times: timeline.times(0).collect(),
        rotations: found.rotations.as_quats().to_vec(),
        translations: places
            .iter()
            .map(|place| Vec3::from_array([place.x, place.y, place.z]))
            .collect(),
        scales: Vec::new(),
    };
    let notes = [("input", name.to_owned())];
    let sampled: [Sampled<'_>; 1] = [samples.of(&clip, rate, &notes)];
    let options = target.motion_options();
    target.write_motion(|out| format.write_clips(&sampled, &options, out))
}
