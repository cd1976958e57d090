//! One clip, or the paths, of the page: which methods it is shown by, when it is sampled, and its results.

use std::path::{Path, PathBuf};

use glam::{DVec3, Quat, Vec3};
use serde::Serialize;
use tumble::paths::PathFrame;
use tumble::{Axes, Channel, Error, Layout, Quantity, SampleTimes, Timeline, TrackError, TrackSet};
use tumble_formats::carried_mesh::CarriedMesh;
use tumble_formats::motion::Motion;
use tumble_formats::world::world;

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::{CurveChoice, InterpolationArguments, distinct_methods};
use crate::arguments::path::frame_summary;
use crate::batch::room;
use crate::commands::travel::{Maker, TravelSource, is_travel, positions_of, scene_origin};
use crate::commands::view::result::StoredResult;
use crate::messages::colours::{self, Colour};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::names;
use crate::messages::words;
use tumble_formats::sample::MethodChoice;

/// Bytes of one rotation and its speed.
const ROTATION: f64 = 10.0;
/// Bytes of one position.
const POSITION: f64 = 6.0;

/// How a result is made: by a method, for clips, or by a frame, for paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ResultChoice {
    By(MethodChoice),
    In(PathFrame),
}

impl ResultChoice {
    /// All methods, then all frames.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        MethodChoice::all()
            .map(Self::By)
            .chain(PathFrame::ALL.map(Self::In))
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::By(method) => method.name(),
            Self::In(frame) => frame.name(),
        }
    }

    pub(crate) fn summary(self) -> &'static str {
        match self {
            Self::By(method) => method.summary(),
            Self::In(frame) => frame_summary(frame),
        }
    }

    pub(crate) fn colour(self) -> Colour {
        match self {
            Self::By(method) => colours::of_choice(method),
            Self::In(frame) => colours::of_frame(frame),
        }
    }
}

/// One clip, or the paths, of an input.
pub(crate) struct ShownClip {
    /// The input.
    pub(crate) file: PathBuf,
    /// Its name in messages.
    pub(crate) name: String,
    /// Its title on the page.
    pub(crate) title: String,
    pub(crate) clip: Motion,
    /// The paths that bodies follow, where the input has these.
    pub(crate) path: Option<TravelSource>,
    pub(crate) box_length: f64,
    /// The mesh that its joints move.
    pub(crate) mesh: Option<CarriedMesh>,
    /// Seconds, increasing.
    pub(crate) times: Vec<f64>,
    /// Clips of later inputs that are shown with it.
    pub(crate) ghosts: Vec<Ghost>,
}

/// A clip that is shown with another one, as the page's scripts read it.
#[derive(Debug, Clone, Serialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Ghost {
    /// Its index among the page's clips.
    pub(super) set: usize,
    /// The seconds to add to a time of the clip for the same time of the ghost.
    pub(super) shift: f64,
    /// The indices of the joints of clip and ghost that are compared.
    pub(super) pairs: Vec<[usize; 2]>,
    /// Whether their rotations are compared in the world, instead of relative to the parents.
    pub(super) in_world: bool,
    /// A note about joints that are not compared, or not as a reader expects, with the reason.
    pub(super) note: String,
}

impl ShownClip {
    /// A clip of this input, without times. `is_one_of_several`: whether the input has several clips.
    pub(crate) fn new(
        path: &Path,
        clip: Motion,
        box_length: Option<f64>,
        is_one_of_several: bool,
    ) -> Self {
        let (mut name, mut title) = (names::input(path), names::file(path));
        if is_one_of_several || clip.name.is_some() {
            let clip_name = names::clip(&clip);
            name = format!("{name} {clip_name}");
            title = format!("{title}: {clip_name}");
        }
        Self {
            file: path.to_owned(),
            name,
            title,
            clip,
            path: None,
            box_length: box_length.unwrap_or(1.0),
            mesh: None,
            times: Vec::new(),
            ghosts: Vec::new(),
        }
    }

    /// The paths of an input, without times.
    pub(crate) fn of_paths(path: &Path, source: TravelSource) -> Self {
        let clip = Motion {
            set: source.set().clone(),
            ..Motion::default()
        };
        Self {
            path: Some(source),
            ..Self::new(path, clip, None, false)
        }
    }

    /// The clip as it was read, with its clock and its origins.
    pub(crate) fn motion(&self) -> &Motion {
        self.path.as_ref().map_or(&self.clip, TravelSource::clip)
    }

    /// The origin that positions are relative to.
    pub(crate) fn origin(&self) -> DVec3 {
        scene_origin(self.motion())
    }

    /// Whether bodies on paths are drawn, instead of bones or a chain.
    pub(crate) fn is_travel(&self) -> bool {
        is_travel(&self.clip)
    }

    /// The keys of all paths.
    pub(crate) fn key_positions(&self) -> Vec<Vec3> {
        let set = &self.clip.set;
        let keys = |track| set.vector_keys(Channel::Translation, track);
        let all = (0..set.track_count()).filter_map(keys);
        all.flat_map(|keys| keys.keys).copied().collect()
    }

    /// The rotation of a body to the axes that the source says.
    pub(crate) fn body_rotation(&self) -> Quat {
        self.path
            .as_ref()
            .map_or(Quat::IDENTITY, TravelSource::body_rotation)
    }

    /// Gives paths the rotations of their bodies at the keys, in a frame, as keys.
    pub(crate) fn give_keys(
        &mut self,
        choice: ResultChoice,
        device: &mut OpenedDevice,
    ) -> Result<(), Failure> {
        let (Some(source), ResultChoice::In(frame)) = (&self.path, choice) else {
            return Ok(());
        };
        let times = source.key_times();
        let frames = SampleTimes::at(times.clone());
        let poses = source.sample(device, &self.name, Maker::Frame(frame), &frames)?;
        let (paths, mut set) = (source.set(), TrackSet::new());
        let refused =
            |error: TrackError| Failure::new(ALL_INPUTS, format!("{}: {error}", self.name));
        for track in 0..paths.track_count() {
            let Some(path) = paths.vector_keys(Channel::Translation, track) else {
                continue;
            };
            let rotation_at = |time: &f64| {
                let sample = times.partition_point(|key| key < time);
                poses.rotations[sample * poses.tracks + track]
            };
            let rotations: Vec<Quat> = path.times.iter().map(rotation_at).collect();
            let index = set.track_count();
            set.push(&*paths.track_name(track), path.times, &rotations)
                .and_then(|()| set.set_translations(index, path.times, path.keys, &[]))
                .map_err(refused)?;
        }
        self.clip.set = set;
        Ok(())
    }

    /// Whether its tracks are joints with positions; else they are the boxes of a chain.
    pub(crate) fn has_positions(&self) -> bool {
        let is_placed = !self.clip.skeleton.is_empty() || self.clip.has_vectors();
        is_placed && self.clip.no_world.is_none()
    }

    /// The bytes of one method's results at this many samples, before packing.
    pub(crate) fn bytes(&self, samples: usize) -> f64 {
        let position = if self.has_positions() { POSITION } else { 0.0 };
        self.rotations(samples) * (ROTATION + position)
    }

    /// The number of rotations at this many samples.
    pub(crate) fn rotations(&self, samples: usize) -> f64 {
        self.clip.set.track_count() as f64 * samples as f64
    }

    /// `4 boxes`, `22 joints`.
    pub(crate) fn tracks(&self) -> String {
        let tracks = self.clip.set.track_count();
        match self.has_positions() {
            _ if self.path.is_some() => words::count(tracks, "path"),
            true => words::count(tracks, "joint"),
            false => words::boxes(tracks),
        }
    }

    /// These methods, or the frames of paths. The method of a file that states none is bessel-overhauser,
    /// which is not shown twice.
    pub(crate) fn methods(&self, methods: &[MethodChoice]) -> Vec<ResultChoice> {
        if let Some(TravelSource::Paths(_, arguments)) = &self.path {
            return arguments
                .frames()
                .into_iter()
                .map(ResultChoice::In)
                .collect();
        }
        let distinct = distinct_methods(methods, &self.clip);
        distinct.into_iter().map(ResultChoice::By).collect()
    }

    /// The times of all keys, in order.
    pub(crate) fn key_times(&self) -> Vec<f64> {
        let set = &self.clip.set;
        let rotations = set.tracks().flat_map(|track| track.times);
        let vectors = (0..set.track_count()).flat_map(|track| {
            let channels = [Channel::Translation, Channel::Scale];
            let keys = channels.map(|channel| set.vector_keys(channel, track));
            keys.into_iter().flatten().flat_map(|keys| keys.times)
        });
        let mut times: Vec<f64> = rotations.chain(vectors).copied().collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    }

    /// The sample times of the clip for these frames.
    pub(crate) fn timeline(&self, frames: &SampleTimes) -> Result<Timeline, Failure> {
        let set = &self.clip.set;
        frames
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(&self.name, &error.into()))
    }

    /// The samples of the clip by one method, or of the path in one frame.
    pub(crate) fn result(
        &self,
        choice: ResultChoice,
        interpolation: InterpolationArguments,
        device: &mut OpenedDevice,
    ) -> Result<StoredResult, Failure> {
        let Self { name, clip, .. } = self;
        let frames = SampleTimes::at(self.times.clone());
        let refused = |message: &str| Failure::new(ALL_INPUTS, format!("{name}: {message}"));
        let too_large = "a position is too large for f32; scale the translations down";
        let argument = match (choice, &self.path) {
            (ResultChoice::By(argument), _) => argument,
            (ResultChoice::In(_), None) => return Err(refused("frames are for paths")),
            (ResultChoice::In(frame), Some(source)) => {
                let found = source.sample(device, name, Maker::Frame(frame), &frames)?;
                let result = StoredResult::new(
                    choice.name(),
                    found.tracks,
                    &found.rotations,
                    &found.velocities(),
                );
                return result
                    .at(&found.positions)
                    .ok_or_else(|| refused(too_large));
            }
        };
        // Memory for rotations and velocities; for joints with positions also for vectors and poses.
        let copies = if self.has_positions() { 7 } else { 3 };
        room::in_memory(name, &clip.set, &frames, copies)?;
        let rotations = CurveChoice::of_rotations(argument, interpolation);
        let velocities = rotations.of(Quantity::Velocity(Axes::Body));
        let (samples, velocities) = device
            .choose(clip.set.track_count() * self.times.len())
            .and_then(|()| {
                device.work(|engine| {
                    let layout = Layout::FrameMajor;
                    Ok::<_, Error>((
                        rotations.sample(engine, clip, &frames)?,
                        (velocities.channel_methods()).rates(engine, clip, &frames, layout)?,
                    ))
                })
            })
            .map_err(|error| Failure::evaluating(name, &error))?;
        let tracks = clip.set.track_count();
        let result = StoredResult::new(choice.name(), tracks, &samples.rotations, &velocities);
        if !self.has_positions() {
            return Ok(result);
        }
        let poses = world(clip, &samples).map_err(|error| refused(&error.to_string()))?;
        let positions = positions_of(clip, &poses);
        result.at(&positions).ok_or_else(|| refused(too_large))
    }
}
