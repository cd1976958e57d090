//! One clip, or the paths, of the page: which methods it is shown by, when it is sampled, and its results.

use std::path::Path;

use clap::ValueEnum;
use glam::{Quat, Vec3};
use tumble::method::BESSEL_OVERHAUSER;
use tumble::{
    Axes, Channel, Error, Frames, Interpolation, Layout, Quantity, Timeline, TrackError, TrackSet,
};
use tumble_formats::gltf::skins::CarriedMesh;
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::world;

use crate::arguments::device::Opened;
use crate::arguments::input;
use crate::arguments::interpolation::{Manner, Wanted, each_once};
use crate::arguments::path::FrameArgument;
use crate::batch::room;
use crate::commands::travel::{Maker, Source, is_travel, places_of};
use crate::commands::view::page::StoredResult;
use crate::messages::colours::{self, Colour};
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Bytes of one rotation and its speed.
const ROTATION: f64 = 10.0;
/// Bytes of one position.
const POSITION: f64 = 6.0;

/// What makes a result: a method, for clips, or a frame, for paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Choice {
    By(Wanted),
    In(FrameArgument),
}

impl Choice {
    /// All methods, then all frames.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        let frames = FrameArgument::value_variants().iter().copied();
        Wanted::all().map(Self::By).chain(frames.map(Self::In))
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::By(wanted) => wanted.name(),
            Self::In(frame) => frame.name(),
        }
    }

    pub(crate) fn summary(self) -> &'static str {
        match self {
            Self::By(wanted) => wanted.summary(),
            Self::In(frame) => frame.summary(),
        }
    }

    pub(crate) fn colour(self) -> Colour {
        match self {
            Self::By(wanted) => wanted.0.map_or(colours::AUTHORED, colours::of_method),
            Self::In(frame) => frame.colour(),
        }
    }
}

/// One clip, or the paths, of an input.
pub(crate) struct Shown {
    /// What messages call it.
    pub(crate) name: String,
    /// What the page calls it.
    pub(crate) title: String,
    pub(crate) clip: Motion,
    /// The paths that bodies follow, where the input has these.
    pub(crate) path: Option<Source>,
    pub(crate) box_length: f64,
    /// What its joints carry.
    pub(crate) mesh: Option<CarriedMesh>,
    /// Seconds, increasing.
    pub(crate) times: Vec<f64>,
}

impl Shown {
    /// A clip of that input, without times. `is_one_of_several`: of the input's clips.
    pub(crate) fn new(
        path: &Path,
        clip: Motion,
        box_length: Option<f64>,
        is_one_of_several: bool,
    ) -> Self {
        let (mut name, mut title) = (input::name(path), input::file_name(path));
        if is_one_of_several || clip.name.is_some() {
            let own = input::clip_name(&clip);
            name = format!("{name} {own}");
            title = format!("{title}: {own}");
        }
        Self {
            name,
            title,
            clip,
            path: None,
            box_length: box_length.unwrap_or(1.0),
            mesh: None,
            times: Vec::new(),
        }
    }

    /// The paths of an input, without times.
    pub(crate) fn of_paths(path: &Path, source: Source) -> Self {
        let clip = Motion {
            set: source.set().clone(),
            ..Motion::default()
        };
        Self {
            path: Some(source),
            ..Self::new(path, clip, None, false)
        }
    }

    /// Whether bodies on paths are drawn, instead of bones or a chain.
    pub(crate) fn is_travel(&self) -> bool {
        is_travel(&self.clip)
    }

    /// The keys of all paths.
    pub(crate) fn places(&self) -> Vec<Vec3> {
        let set = &self.clip.set;
        let keys = |track| set.vector_keys(Channel::Translation, track);
        let all = (0..set.track_count()).filter_map(keys);
        all.flat_map(|keys| keys.keys).copied().collect()
    }

    /// How a body is turned to face as the source says.
    pub(crate) fn body_turn(&self) -> Quat {
        self.path.as_ref().map_or(Quat::IDENTITY, Source::body_turn)
    }

    /// Gives paths the rotations of their bodies at the keys, in a frame, as keys.
    pub(crate) fn give_keys(&mut self, choice: Choice, device: &mut Opened) -> Result<(), Failure> {
        let (Some(source), Choice::In(frame)) = (&self.path, choice) else {
            return Ok(());
        };
        let times = source.key_times();
        let frames = Frames::at(times.clone());
        let poses = source.sample(device, &self.name, Maker::Frame(frame), &frames)?;
        let (paths, mut set) = (source.set(), TrackSet::new());
        let refused =
            |error: TrackError| Failure::new(ALL_INPUTS, format!("{}: {error}", self.name));
        for track in 0..paths.track_count() {
            let Some(path) = paths.vector_keys(Channel::Translation, track) else {
                continue;
            };
            let turn = |time: &f64| {
                let sample = times.partition_point(|own| own < time);
                poses.rotations[sample * poses.tracks + track]
            };
            let turns: Vec<Quat> = path.times.iter().map(turn).collect();
            let place = set.track_count();
            set.push(&*paths.track_name(track), path.times, &turns)
                .and_then(|()| set.set_translations(place, path.times, path.keys, &[]))
                .map_err(refused)?;
        }
        self.clip.set = set;
        Ok(())
    }

    /// Whether its tracks are joints at places of their own; else they are the boxes of a chain.
    pub(crate) fn has_places(&self) -> bool {
        let is_placed = !self.clip.skeleton.is_empty() || self.clip.has_vectors();
        is_placed && self.clip.no_world.is_none()
    }

    /// Bytes that one method's results at so many samples take before they are packed.
    pub(crate) fn bytes(&self, samples: usize) -> f64 {
        let position = if self.has_places() { POSITION } else { 0.0 };
        self.rotations(samples) * (ROTATION + position)
    }

    /// How many rotations there are at so many samples.
    pub(crate) fn rotations(&self, samples: usize) -> f64 {
        self.clip.set.track_count() as f64 * samples as f64
    }

    /// `4 boxes`, `22 joints`.
    pub(crate) fn tracks(&self) -> String {
        let tracks = self.clip.set.track_count();
        match self.has_places() {
            _ if self.path.is_some() => words::count(tracks, "path"),
            true => words::count(tracks, "joint"),
            false => words::boxes(tracks),
        }
    }

    /// These methods, or the frames of paths. What a file without a word of its channels calls for is bessel-overhauser,
    /// which is not shown twice.
    pub(crate) fn methods(&self, methods: &[Wanted]) -> Vec<Choice> {
        if let Some(Source::Paths(_, arguments)) = &self.path {
            return arguments.frames().into_iter().map(Choice::In).collect();
        }
        if !self.clip.channels.is_empty() {
            return methods.iter().copied().map(Choice::By).collect();
        }
        let meant = Wanted(Some(BESSEL_OVERHAUSER));
        let mut own = methods.to_vec();
        if own.contains(&meant) {
            own.retain(|wanted| wanted.0.is_some());
        }
        let own: Vec<Wanted> = own.iter().map(|it| Wanted(it.0.or(meant.0))).collect();
        each_once(own.iter()).into_iter().map(Choice::By).collect()
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

    /// The samples that frames mean for it.
    pub(crate) fn timeline(&self, frames: &Frames) -> Result<Timeline, Failure> {
        let set = &self.clip.set;
        frames
            .resolve(set.track_count(), set.time_span())
            .map_err(|error| Failure::evaluating(&self.name, &error.into()))
    }

    /// What one method, or one frame, makes of it.
    pub(crate) fn result(
        &self,
        choice: Choice,
        manner: Manner,
        device: &mut Opened,
    ) -> Result<StoredResult, Failure> {
        let Self { name, clip, .. } = self;
        let frames = Frames::at(self.times.clone());
        let refused = |message: &str| Failure::new(ALL_INPUTS, format!("{name}: {message}"));
        let far = "a joint is farther away than numbers go; scale the translations down";
        let wanted = match (choice, &self.path) {
            (Choice::By(wanted), _) => wanted,
            (Choice::In(_), None) => return Err(refused("frames are for paths")),
            (Choice::In(frame), Some(source)) => {
                let found = source.sample(device, name, Maker::Frame(frame), &frames)?;
                let result =
                    StoredResult::new(choice, found.tracks, &found.rotations, &found.velocities());
                return result.at(&found.places).ok_or_else(|| refused(far));
            }
        };
        // Rotations and velocities, and of joints with places vectors and poses too.
        let copies = if self.has_places() { 7 } else { 3 };
        room::in_memory(name, &clip.set, &frames, copies)?;
        let rotation = |method| manner.with(method);
        let velocity = |method| Interpolation {
            quantity: Quantity::Velocity(Axes::Body),
            ..manner.with(method)
        };
        let rotations = ChannelMethods {
            method: wanted.0,
            with: &rotation,
        };
        let velocities = ChannelMethods {
            with: &velocity,
            ..rotations
        };
        let (samples, velocities) = device
            .choose(clip.set.track_count() * self.times.len())
            .and_then(|()| {
                device.work(|engine| {
                    let layout = Layout::FrameMajor;
                    Ok::<_, Error>((
                        rotations.sample(engine, clip, &frames)?,
                        velocities.rates(engine, clip, &frames, layout)?,
                    ))
                })
            })
            .map_err(|error| Failure::evaluating(name, &error))?;
        let tracks = clip.set.track_count();
        let result = StoredResult::new(choice, tracks, &samples.rotations, &velocities);
        if !self.has_places() {
            return Ok(result);
        }
        let poses = world(clip, &samples).map_err(|error| refused(&error.to_string()))?;
        let places = places_of(clip, &poses);
        result.at(&places).ok_or_else(|| refused(far))
    }
}
