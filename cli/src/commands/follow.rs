//! `tumble follow`: bodies on paths.

use std::path::PathBuf;

use clap::{ArgAction, Args};
use glam::Vec3;
use tumble::paths::{Follow, FollowError, Followed, PathFrame};
use tumble::{Engine, Error, Layout, SampleTimes, TrackSet, VectorMethod};
use tumble_formats::PATHS;
use tumble_formats::motion::{Joint, Motion, SampledClip, Transform};
use tumble_formats::outside::Outside;
use tumble_formats::path::PathFormat;
use tumble_formats::poses::{Poses, WORLD};
use tumble_formats::sample::Samples;
use tumble_formats::{Code, Diagnostic};

use crate::arguments::device::{DeviceArguments, OpenedDevice};
use crate::arguments::input::{GatheredInputs, InputSelection};
use crate::arguments::options::{CommandLine, ResultOptions};
use crate::arguments::path::PathArguments;
use crate::arguments::results::ResultArguments;
use crate::arguments::time::{SampleChoice, SamplingArguments};
use crate::batch::pipeline::{ClipWork, EvaluatedResult};
use crate::batch::preview::PlannedWork;
use crate::batch::room;
use crate::batch::target::WrittenFile;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// The help's notes on files.
const NOTES: &str = "\
If a path has no times, --seconds gives its duration or --pace its speed. The result is float32 of shape \
(frames, tracks, 7), x y z of the position and x y z w of the rotation, in NPY or CSV; or a clip of a \
motion file. Positions far from 0, such as those of maps, are float64. CPU and Vulkan give the same bits.

Examples:
  tumble follow road.csv --fps 60 -o poses.npy
  tumble follow paths/*.csv -o poses/                        a file for each path
  tumble follow paths -o poses --resume                      skips results that are done
  tumble follow lap.csv --path-ends loop --path-speed constant -o lap.glb
  tumble follow points.npy --pace 1.5 --path-method linear --direction ahead:0.5 -o walk.csv
  tumble follow orbit.csv --direction at:0,1,0 --path-frame fixed -o camera.glb";

/// The names and summaries of the formats of paths, for the help.
fn kinds() -> String {
    let kind =
        |format: &&PathFormat| format!("{} ({})", format.name.to_uppercase(), format.summary);
    let all: Vec<String> = PATHS.iter().map(kind).collect();
    all.join(" or ")
}

/// Move bodies along paths: the position and the orientation of each at every frame
#[derive(Debug, Args)]
#[command(
    mut_arg("path_method", |arg| arg.visible_short_alias('m').alias("method")),
    mut_arg("path_ends", |arg| arg.alias("ends")),
    mut_arg("path_up", |arg| arg.alias("up")),
    mut_arg("path_speed", |arg| arg.alias("speed")),
    mut_arg("path_frame", |arg| {
        let arg = arg.value_name("FRAME").help("How the body is rotated about its direction (its roll)");
        arg.action(ArgAction::Set).value_delimiter(None::<char>)
    })
)]
#[command(after_help = format!("Paths are {}.\n{NOTES}", kinds()))]
pub(crate) struct Arguments {
    #[command(flatten)]
    command_line: CommandLine,
    /// Paths: CSV or NPY files, directories of them, or patterns (`-`: standard input)
    #[arg(required = true, value_name = "PATH")]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    results: ResultArguments,
    #[command(flatten)]
    sampling: SamplingArguments,
    #[command(flatten)]
    path: PathArguments,
    #[command(flatten)]
    device: DeviceArguments,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let inputs = GatheredInputs::new(&arguments.paths, &InputSelection::default())?;
    let samples = arguments.sampling.samples()?;
    let options = arguments.options(&samples);
    let reader = arguments.path.clone();
    let work = PlannedWork {
        reader: &reader,
        options: &options,
    };
    let plan = arguments.results.plan(inputs, &work)?;
    let mut device = arguments.device.open()?;
    let mut pipeline = arguments.results.start(reader, plan, options);
    while let Some(work) = pipeline.next_work() {
        let made = arguments.body(&work, &samples, &mut device);
        pipeline.keep(&work, made.map(|result| (result, ())));
    }
    pipeline.finish()
}

impl Arguments {
    /// Everything that determines a result besides its input.
    fn options(&self, samples: &SampleChoice) -> ResultOptions {
        let mut options = self.command_line.options().of_command("follow");
        options.text += &format!(" times={}", samples.digest());
        options
    }

    /// Refuses options that have no effect on these paths.
    fn check_effects(&self, frame: PathFrame, name: &str) -> Result<(), Failure> {
        let line = &self.command_line;
        let refuse = |option: (&str, &str), on: &str, remedy: &str| {
            let refused = line.refuse(&[option], on, remedy);
            refused.map_err(|failure| failure.of(name))
        };
        let method = self.path.method();
        if matches!(method, VectorMethod::Step | VectorMethod::Linear) {
            let curve = format!("a path by {}", method.name());
            let remedy = "its curve depends on the two points that it joins; leave it out";
            refuse(("path_ends", "--path-ends"), &curve, remedy)?;
        }
        if frame == PathFrame::Frenet {
            refuse(
                ("path_up", "--path-up"),
                "Frenet's frames",
                "they follow from the path; leave it out",
            )?;
        }
        if frame != PathFrame::Minimal {
            let remedy =
                "only minimal frames can have a remaining rotation at the end; leave it out";
            refuse(("twist", "--twist"), "other frames than minimal", remedy)?;
        }
        Ok(())
    }

    /// Evaluates and writes the bodies on the paths of one file.
    fn body(
        &self,
        work: &ClipWork,
        samples: &SampleChoice,
        device: &mut OpenedDevice,
    ) -> Result<EvaluatedResult, Failure> {
        let paths = only_clip(work);
        let (name, set) = (&*work.name, &paths.set);
        let [frame] = self.path.frames()[..] else {
            return Err(Failure::usage("give a single --path-frame"));
        };
        self.check_effects(frame, name)?;
        let follow = self.path.follow(paths, name, frame)?;
        let frames = samples.of(paths, Outside::default(), name)?;
        let found = followed(device, name, set, &follow, &frames)?;
        let written = write(work, &frames, samples, &found)?;
        let done = format!(
            "{} × {}, {}",
            words::count(set.track_count(), "track"),
            words::count(found.rotations.sample_count(), "frame"),
            self.path.method(),
        );
        Ok(work.result(written, &done, Some(&device.label)))
    }
}

fn only_clip(work: &ClipWork) -> &Motion {
    let [paths] = work.clips()[..] else {
        unreachable!("all paths of a file are one clip");
    };
    paths
}

/// The bodies of a set at some frames, `[frame][track]`; warns of those without a clear direction.
pub(crate) fn followed(
    device: &mut OpenedDevice,
    name: &str,
    set: &TrackSet,
    follow: &Follow,
    frames: &SampleTimes,
) -> Result<Followed, Failure> {
    let timeline = room::in_memory(name, set, frames, 6)?;
    let work = |engine: &Engine| engine.follow(set, follow, frames, Layout::FrameMajor);
    let found = device
        .choose(set.track_count() * timeline.len())
        .and_then(|()| device.work(work))
        .map_err(|error| failed(name, &error))?;
    for warning in &found.warnings {
        let warning = warning.to_string();
        words::warn_of(Diagnostic::new(name, Code::BodyDirection, warning));
    }
    Ok(found)
}

/// A path that is refused is the fault of the input.
fn failed(name: &str, error: &Error) -> Failure {
    match error {
        Error::Follow(error) => {
            let hint = match error {
                FollowError::UpsUnused { .. } => " (--path-frame minimal, --no-ups)",
                _ => "",
            };
            Failure::new(ALL_INPUTS, format!("{name}: {error}{hint}"))
        }
        error => Failure::evaluating(name, error),
    }
}

/// Writes positions and rotations: numbers, or a clip with a joint for each body.
fn write(
    work: &ClipWork,
    frames: &SampleTimes,
    samples: &SampleChoice,
    found: &Followed,
) -> Result<WrittenFile, Failure> {
    let paths = only_clip(work);
    let (name, target) = (&*work.name, &work.target);
    let set = &paths.set;
    let timeline = frames
        .resolve(set.track_count(), set.time_span())
        .map_err(|error| Failure::evaluating(name, &error.into()))?;
    let positions = found.positions.as_slice();
    let format = target.format();
    if let Some(results) = &format.write {
        let each = positions.iter().zip(found.rotations.as_quats());
        let numbers = each.flat_map(|(position, rotation)| {
            let [x, y, z, _] = position.to_array();
            let [a, b, c, d] = rotation.to_array();
            [x, y, z, a, b, c, d]
        });
        let numbers: Vec<f32> = numbers.collect();
        let poses = Poses {
            set,
            timeline: &timeline,
            time_offset: paths.time_offset,
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
        SampleChoice::Rate { rate, .. } => Some(rate.of(paths)),
        SampleChoice::Times(_) | SampleChoice::Keys(_) => None,
    };
    let clip = Motion {
        set: set.clone(),
        skeleton: vec![rest; set.track_count()],
        rate,
        time_offset: paths.time_offset,
        origins: paths.origins.clone(),
        ..Motion::default()
    };
    let samples = Samples {
        times: timeline.times(0).collect(),
        rotations: found.rotations.as_quats().to_vec(),
        translations: positions
            .iter()
            .map(|position| Vec3::from_array([position.x, position.y, position.z]))
            .collect(),
        scales: Vec::new(),
        scalars: Vec::new(),
    };
    let notes = [("input", work.origin())];
    let sampled: [SampledClip<'_>; 1] = [samples.of(&clip, rate, &notes)];
    let options = target.motion_options();
    target.write_motion(|out| format.write_clips(&sampled, &options, out))
}
