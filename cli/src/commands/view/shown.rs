//! One clip of the page: which methods it is shown by, when it is sampled, and its results.

use std::path::Path;

use tumble::method::BESSEL_OVERHAUSER;
use tumble::{Axes, Channel, Error, Frames, Interpolation, Layout, Quantity, Timeline};
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::world::world;

use crate::arguments::device::Opened;
use crate::arguments::input;
use crate::arguments::interpolation::{Manner, Wanted, each_once};
use crate::batch::room;
use crate::commands::view::page::StoredResult;
use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

/// Bytes of one rotation and its speed.
const ROTATION: f64 = 10.0;
/// Bytes of one position.
const POSITION: f64 = 6.0;

/// One clip of an input.
pub(crate) struct Shown {
    /// What messages call it.
    pub(crate) name: String,
    /// What the page calls it.
    pub(crate) title: String,
    pub(crate) clip: Motion,
    pub(crate) box_length: f64,
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
            box_length: box_length.unwrap_or(1.0),
            times: Vec::new(),
        }
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
            true => words::count(tracks, "joint"),
            false => words::boxes(tracks),
        }
    }

    /// These methods. What a file without a word of its channels calls for is bessel-overhauser,
    /// which is not shown twice.
    pub(crate) fn methods(&self, methods: &[Wanted]) -> Vec<Wanted> {
        if !self.clip.channels.is_empty() {
            return methods.to_vec();
        }
        let meant = Wanted(Some(BESSEL_OVERHAUSER));
        let mut own = methods.to_vec();
        if own.contains(&meant) {
            own.retain(|wanted| wanted.0.is_some());
        }
        let own: Vec<Wanted> = own.iter().map(|it| Wanted(it.0.or(meant.0))).collect();
        each_once(own.iter())
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

    /// What one method makes of it.
    pub(crate) fn result(
        &self,
        wanted: Wanted,
        manner: Manner,
        device: &mut Opened,
    ) -> Result<StoredResult, Failure> {
        let Self { name, clip, .. } = self;
        let frames = Frames::at(self.times.clone());
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
        let result = StoredResult::new(wanted, tracks, &samples.rotations, &velocities);
        if !self.has_places() {
            return Ok(result);
        }
        let refused = |message: &str| Failure::new(ALL_INPUTS, format!("{name}: {message}"));
        let poses = world(clip, &samples).map_err(|error| refused(&error.to_string()))?;
        result.at(&poses).ok_or_else(|| {
            refused("a joint is farther away than numbers go; scale the translations down")
        })
    }
}
