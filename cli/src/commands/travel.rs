//! Bodies on paths, sampled for pictures: from files of paths, and from clips whose joints are all
//! moving roots, as `tumble follow` writes them.

use std::path::{Path, PathBuf};

use clap::Args;
use glam::{DQuat, DVec3, Quat, Vec3, Vec4};
use tumble::paths::PathFrame;
use tumble::{Channel, Engine, Error, SampleTimes, TrackSet};
use tumble_formats::motion::Motion;
use tumble_formats::path::looks_like_paths;
use tumble_formats::world::{WorldPose, world};
use tumble_formats::{Code, Diagnostic};
use tumble_routes::mesh::Mesh;

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::CurveChoice;
use crate::arguments::options::CommandLine;
use crate::arguments::path::PathArguments;
use crate::arguments::tracks::TrackArguments;
use crate::batch::room;
use crate::commands::follow::followed;
use crate::commands::route::surface::{Surface, kinds};
use crate::messages::colours::{self, Colour};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::names;

/// How many points a picture of a curve has, besides its keys.
const CURVE_POINTS: usize = 600;
/// How many facets along a side a net of control points is drawn with.
const FACETS: usize = 32;

/// The options of the ground and the objects that are drawn beside the bodies on paths.
#[derive(Debug, Clone, Args)]
pub(crate) struct Scenery {
    /// The ground and objects on it.
    #[arg(
        long = "mesh",
        value_name = "FILES",
        value_delimiter = ',',
        help = format!(
            "Draw the ground and objects on it, each {}; bodies then stand on their paths, instead of \
             being centred on them",
            kinds()
        )
    )]
    pub(crate) meshes: Vec<PathBuf>,
    /// The length of a body on a path [default: a tenth of the path's size]
    #[arg(long, alias = "body", value_name = "LENGTH", value_parser = crate::arguments::path::positive)]
    pub(crate) body_length: Option<f64>,
    /// How many frames to draw as small axes along a path
    #[arg(long, alias = "axes", value_name = "N", default_value_t = 40)]
    pub(crate) drawn_frames: usize,
}

impl Scenery {
    /// Refuses its options where no bodies on paths are drawn.
    pub(crate) fn refuse(command_line: &CommandLine) -> Result<(), Failure> {
        let remedy = "it is for bodies on paths; leave it out";
        command_line.refuse_group::<Self>("boxes and skeletons", remedy)
    }

    /// The meshes, in the order in which they were named.
    pub(crate) fn read(&self) -> Result<Vec<Mesh>, Failure> {
        let read = |path: &PathBuf| match Surface::read(path, 0.0)? {
            Surface::Mesh(mesh) => Ok(*mesh),
            Surface::Net(net) => net.facets(FACETS).map_err(|error| {
                let message = format!("cannot be drawn: {error}");
                let fault = Diagnostic::new(path.display().to_string(), Code::Net, message);
                Failure::input(&fault, "")
            }),
        };
        self.meshes.iter().map(read).collect()
    }

    /// The length of the bodies on paths through these positions.
    pub(crate) fn length(&self, positions: &[Vec3]) -> f32 {
        let low = positions
            .iter()
            .copied()
            .reduce(Vec3::min)
            .unwrap_or_default();
        let high = positions
            .iter()
            .copied()
            .reduce(Vec3::max)
            .unwrap_or_default();
        let tenth = (high - low).length() / 10.0;
        let default = if tenth > 0.0 && tenth.is_finite() {
            tenth
        } else {
            1.0
        };
        self.body_length.map_or(default, |length| length as f32)
    }
}

/// Bodies at some samples.
#[derive(Debug, Clone)]
pub(crate) struct Travel {
    /// The name of the frame, or of the method.
    pub(crate) name: String,
    pub(crate) times: Vec<f64>,
    pub(crate) tracks: usize,
    /// `[sample][track]`.
    pub(crate) rotations: Vec<Quat>,
    /// `[sample][track]`, relative to the [origin](TravelSource::origin) of the source.
    pub(crate) positions: Vec<Vec3>,
}

impl Travel {
    /// The positions of one body.
    pub(crate) fn line(&self, track: usize) -> impl Iterator<Item = Vec3> {
        self.positions
            .iter()
            .skip(track)
            .step_by(self.tracks)
            .copied()
    }

    /// Angular velocities in the bodies' own axes between neighbouring samples, `[sample][track]`; the last
    /// sample has that of the one before it.
    pub(crate) fn velocities(&self) -> Vec<Vec4> {
        let samples = self.times.len();
        let mut found = Vec::with_capacity(self.rotations.len());
        for sample in 0..samples {
            let from = sample.min(samples.saturating_sub(2));
            let seconds = self
                .times
                .get(from + 1)
                .map_or(1.0, |next| next - self.times[from]);
            for track in 0..self.tracks {
                let [before, after] = [from, from + 1].map(|at| {
                    let index = at * self.tracks + track;
                    self.rotations
                        .get(index)
                        .unwrap_or(&Quat::IDENTITY)
                        .as_dquat()
                });
                let step = match samples {
                    0 | 1 => DVec3::ZERO,
                    _ => between(before, after).to_scaled_axis(),
                };
                found.push((step / seconds).as_vec3().extend(0.0));
            }
        }
        found
    }

    /// The samples of a body that are nearest to `count` points evenly spaced along its path.
    pub(crate) fn evenly(&self, track: usize, count: usize) -> Vec<usize> {
        let positions: Vec<Vec3> = self.line(track).collect();
        let mut length = 0.0;
        let mut lengths = vec![0.0];
        for pair in positions.windows(2) {
            length += f64::from((pair[1] - pair[0]).length());
            lengths.push(length);
        }
        let last = count.saturating_sub(1).max(1);
        let mut found: Vec<usize> = (0..count)
            .map(|i| {
                let target = length * i as f64 / last as f64;
                let after = lengths.partition_point(|&reached| reached < target);
                let after = after.min(lengths.len() - 1);
                let before = after.saturating_sub(1);
                match lengths[after] - target < target - lengths[before] {
                    true => after,
                    false => before,
                }
            })
            .collect();
        found.dedup();
        found.retain(|&sample| sample < positions.len());
        found
    }
}

/// The shorter rotation from one to the other, in the axes of the first.
fn between(before: DQuat, after: DQuat) -> DQuat {
    let step = (before.normalize().inverse() * after.normalize()).normalize();
    if step.w < 0.0 { -step } else { step }
}

/// The origin of a picture of a clip, subtracted from all positions: the first that a track has.
pub(crate) fn scene_origin(clip: &Motion) -> DVec3 {
    let mut origins = clip.origins.iter().copied();
    origins
        .find(|&origin| origin != DVec3::ZERO)
        .unwrap_or_default()
}

/// Where joints are in a picture of their clip.
pub(crate) fn positions_of(clip: &Motion, poses: &[WorldPose]) -> Vec<Vec3> {
    let origin = scene_origin(clip);
    let positions = poses.iter().map(|pose| (pose.position - origin).as_vec3());
    positions.collect()
}

/// Where the bodies of a picture come from.
pub(crate) enum TravelSource {
    /// Paths, and how they are followed.
    Paths(Box<Motion>, Box<PathArguments>),
    /// A clip of moving roots.
    Clip(Box<Motion>),
}

/// How one result is made of a source: by a frame for paths, by a method for clips.
#[expect(
    clippy::large_enum_variant,
    reason = "there are few of them, and they are copied freely"
)]
#[derive(Debug, Clone, Copy)]
pub(crate) enum Maker {
    Frame(PathFrame),
    Method(CurveChoice),
}

impl Maker {
    pub(crate) fn colour(self) -> Colour {
        match self {
            Self::Frame(frame) => colours::of_frame(frame),
            Self::Method(choice) => colours::of_choice(choice.method),
        }
    }
}

/// Whether a file is one of paths; standard input is not.
pub(crate) fn is_path_file(path: &Path) -> bool {
    !names::is_standard(path) && looks_like_paths(path)
}

/// Whether all joints of a clip are roots, and some of them move.
pub(crate) fn is_travel(clip: &Motion) -> bool {
    let moves = |track| {
        let keys = clip.set.vector_keys(Channel::Translation, track);
        keys.is_some_and(|keys| keys.keys.len() > 1)
    };
    clip.no_world.is_none()
        && clip.skeleton.iter().all(|joint| joint.parent.is_none())
        && (0..clip.set.track_count()).any(moves)
}

impl TravelSource {
    /// The paths of a file.
    pub(crate) fn of_paths(
        path: &Path,
        arguments: &PathArguments,
        tracks: &TrackArguments,
    ) -> Result<Self, Failure> {
        let paths = arguments.read(path)?;
        let paths = tracks.select(&paths, &names::input(path))?.into_owned();
        Ok(Self::Paths(Box::new(paths), Box::new(arguments.clone())))
    }

    pub(crate) fn clip(&self) -> &Motion {
        match self {
            Self::Paths(clip, _) | Self::Clip(clip) => clip,
        }
    }

    pub(crate) fn set(&self) -> &TrackSet {
        &self.clip().set
    }

    /// The origin that all positions are relative to.
    pub(crate) fn origin(&self) -> DVec3 {
        match self {
            Self::Paths(clip, _) | Self::Clip(clip) => scene_origin(clip),
        }
    }

    /// The rotation of a body that faces along z, with y up, to the body axes of the source.
    pub(crate) fn body_rotation(&self) -> Quat {
        match self {
            Self::Paths(_, arguments) => arguments.body_rotation(),
            Self::Clip(_) => Quat::IDENTITY,
        }
    }

    /// The times of all keys, in order.
    pub(crate) fn key_times(&self) -> Vec<f64> {
        let set = self.set();
        let keys = |track| set.vector_keys(Channel::Translation, track);
        let all = (0..set.track_count()).filter_map(keys);
        let mut times: Vec<f64> = all.flat_map(|keys| keys.times).copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The bodies at some frames.
    pub(crate) fn sample(
        &self,
        device: &mut OpenedDevice,
        name: &str,
        maker: Maker,
        frames: &SampleTimes,
    ) -> Result<Travel, Failure> {
        let set = self.set();
        let tracks = set.track_count();
        let timeline = frames
            .resolve(tracks, set.time_span())
            .map_err(|error| Failure::evaluating(name, &error.into()))?;
        let times = timeline.times(0).collect();
        match (self, maker) {
            (Self::Paths(paths, arguments), Maker::Frame(frame)) => {
                let follow = arguments.follow(paths, name, frame)?;
                let found = followed(device, name, set, &follow, frames)?;
                let positions = found.positions.as_slice().iter();
                Ok(Travel {
                    name: frame.name().to_owned(),
                    times,
                    tracks,
                    rotations: found.rotations.as_quats().to_vec(),
                    positions: positions.map(|position| position.truncate()).collect(),
                })
            }
            (Self::Clip(clip), Maker::Method(choice)) => {
                let timeline = room::in_memory(name, set, frames, 7)?;
                let work = |engine: &Engine| choice.sample(engine, clip, frames);
                let samples = device
                    .choose(tracks * timeline.len())
                    .and_then(|()| device.work(work))
                    .map_err(|error: Error| Failure::evaluating(name, &error))?;
                let poses = world(clip, &samples)
                    .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?;
                Ok(Travel {
                    name: choice.method.name().to_owned(),
                    times,
                    tracks,
                    rotations: poses.iter().map(|pose| pose.rotation).collect(),
                    positions: positions_of(clip, &poses),
                })
            }
            _ => Err(Failure::usage(format!(
                "{name}: frames are for paths, methods for clips"
            ))),
        }
    }

    /// The bodies at many even times from the first key to the last, and at the keys: a curve with its
    /// corners.
    pub(crate) fn trail(
        &self,
        device: &mut OpenedDevice,
        name: &str,
        maker: Maker,
    ) -> Result<Travel, Failure> {
        let mut times = self.key_times();
        if let (Some(&first), Some(&last)) = (times.first(), times.last()) {
            let at = |i: usize| first + (last - first) * i as f64 / CURVE_POINTS as f64;
            times.extend((1..CURVE_POINTS).map(at));
            times.sort_by(f64::total_cmp);
            times.dedup();
        }
        self.sample(device, name, maker, &SampleTimes::at(times))
    }
}
