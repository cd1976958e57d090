//! One input, sampled: the numbers of curves.

pub(crate) mod curves;

use glam::Quat;
use tumble::{Interpolation, Layout, SampleTimes, ScalarQuantity, Timeline, TrackSet, Vectors};
use tumble_formats::motion::Motion;
use tumble_formats::outside::Outside;

use crate::arguments::device::OpenedDevice;
use crate::arguments::interpolation::CurveChoice;
use crate::arguments::time::SampleChoice;
use crate::batch::room;
use crate::commands::plot::figure::TimeAxis;
use crate::messages::exit::Failure;
use crate::messages::words;

/// More keys than this stand too close for upright lines.
const UPRIGHTS: usize = 200;

/// Even times of a curve, so that it is smooth in the picture.
const EVEN_TIMES: usize = 1000;

/// The samples of curves.
pub(crate) struct PlotSamples {
    pub(crate) request: SampleChoice,
    /// Whether the command line says the rate of frames; else a curve has as many as the picture needs.
    pub(crate) is_rate_chosen: bool,
    pub(crate) outside: Outside,
}

/// The times of a curve that goes through its keys: frames of a rate that was chosen, else even times, and
/// all keys between the first of them and `last`.
fn with_keys(frames: Vec<f64>, last: Option<f64>, clip: &Motion, is_rate_chosen: bool) -> Vec<f64> {
    let (Some(&first), Some(&last_frame)) = (frames.first(), frames.last()) else {
        return frames;
    };
    let last = last.unwrap_or(last_frame).max(last_frame);
    let mut times = match is_rate_chosen || frames.len() > EVEN_TIMES {
        true => frames,
        false => {
            let at = |i: usize| first + (last - first) * i as f64 / EVEN_TIMES as f64;
            (0..=EVEN_TIMES).map(at).collect()
        }
    };
    let keys = clip.key_times();
    times.extend(keys.into_iter().filter(|key| (first..=last).contains(key)));
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

/// One input, and how to evaluate it.
pub(crate) struct PlotSource<'a> {
    pub(crate) name: String,
    pub(crate) clip: &'a Motion,
    pub(crate) set: &'a TrackSet,
    pub(crate) choices: &'a [CurveChoice],
    pub(crate) frames: SampleTimes,
    pub(crate) timeline: Timeline,
    pub(crate) x: TimeAxis,
    pub(crate) about: String,
}

impl<'a> PlotSource<'a> {
    pub(crate) fn new(
        name: String,
        clip: &'a Motion,
        choices: &'a [CurveChoice],
        samples: &PlotSamples,
    ) -> Result<Self, Failure> {
        let set = &clip.set;
        let mut frames = samples.request.of(clip, samples.outside, &name)?;
        let resolve = |frames: &SampleTimes| {
            let timeline = frames.resolve(set.track_count(), set.time_span());
            timeline.map_err(|error| Failure::evaluating(&name, &error.into()))
        };
        if let SampleChoice::Rate { .. } = samples.request
            && let Some(span) = set.time_span()
        {
            // If only one box is drawn, it still has the frames of the whole set.
            frames = frames.spanning(span);
        }
        let mut timeline = resolve(&frames)?;
        room::to_draw(&name, timeline.len())?;
        if timeline.is_empty() {
            return Err(Failure::usage(format!(
                "{name}: there are no samples to plot"
            )));
        }
        let mut about = match samples.request {
            SampleChoice::Rate { rate, .. } => {
                let count = words::count(timeline.len(), "frame");
                format!("{count}, {} per second", rate.of(clip))
            }
            SampleChoice::Times(_) | SampleChoice::Keys(_) => words::count(timeline.len(), "time"),
        };
        if let SampleChoice::Rate { .. } = samples.request {
            let times: Vec<f64> = timeline.times(0).collect();
            let last = samples.request.end_of(clip, samples.outside);
            let times = with_keys(times, last, clip, samples.is_rate_chosen);
            frames = SampleTimes::at(times);
            timeline = resolve(&frames)?;
            room::to_draw(&name, timeline.len())?;
            if !samples.is_rate_chosen {
                about = words::count(timeline.len(), "sample");
            }
        }
        let (first, last) = timeline
            .times(0)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), time| {
                (time.min(first), time.max(last))
            });
        let x = TimeAxis::of(first, last, clip.time_offset);
        Ok(Self {
            name,
            clip,
            set,
            choices,
            frames,
            timeline,
            x,
            about,
        })
    }

    /// How the rotations of a box are interpolated.
    pub(crate) fn interpolation(&self, choice: CurveChoice, index: usize) -> Interpolation {
        choice.of_track(self.clip, index)
    }

    /// The samples of one box, each with the sign that continues the one before it: a
    /// quaternion and its negative are the same rotation, and a curve does not jump.
    pub(crate) fn rotations(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        interpolation: Interpolation,
    ) -> Result<Vec<Quat>, Failure> {
        let mut rotations = self.evaluate(device, index, interpolation)?;
        for i in 1..rotations.len() {
            if rotations[i].dot(rotations[i - 1]) < 0.0 {
                rotations[i] = -rotations[i];
            }
        }
        Ok(rotations)
    }

    pub(crate) fn evaluate(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        interpolation: Interpolation,
    ) -> Result<Vec<Quat>, Failure> {
        let one = self.one(index)?;
        device
            .collect(&one, interpolation, &self.frames, Layout::TrackMajor)
            .map_err(|error| Failure::evaluating(&self.name, &error))
    }

    /// The samples of one scalar, without its origin.
    pub(crate) fn scalar_samples(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        choice: CurveChoice,
    ) -> Result<Vec<f64>, Failure> {
        let mut one = Motion::default();
        if let Some(keys) = self.set.scalar(index) {
            let added = one.push_scalar(self.clip.scalar(index), keys);
            added.map_err(|error| Failure::evaluating(&self.name, &error.into()))?;
        }
        let methods = choice.channel_methods();
        let found = device.choose(self.timeline.len()).and_then(|()| {
            device.work(|engine| methods.scalars(engine, &one, &self.frames, ScalarQuantity::Value))
        });
        let found = found.map_err(|error| Failure::evaluating(&self.name, &error))?;
        Ok(found.into_iter().map(f64::from).collect())
    }

    /// The velocities or accelerations of one box.
    pub(crate) fn rates(
        &self,
        device: &mut OpenedDevice,
        index: usize,
        interpolation: Interpolation,
    ) -> Result<Vectors, Failure> {
        let (one, layout) = (self.one(index)?, Layout::TrackMajor);
        device
            .choose(self.timeline.len())
            .and_then(|()| {
                device.work(|engine| engine.rates(&one, interpolation, &self.frames, layout))
            })
            .map_err(|error| Failure::evaluating(&self.name, &error))
    }

    /// The track of one box, after a check that its samples, the points of its curve and the drawing fit
    /// into memory.
    fn one(&self, index: usize) -> Result<TrackSet, Failure> {
        let one = (self.set.select([index]))
            .map_err(|error| Failure::evaluating(&self.name, &error.into()))?;
        room::in_memory(&self.name, &one, &self.frames, 4)?;
        Ok(one)
    }

    /// Points over the samples.
    pub(crate) fn points(&self, values: impl IntoIterator<Item = f64>) -> Vec<(f64, f64)> {
        let x = self.timeline.times(0).map(|time| time - self.x.origin);
        x.zip(values).collect()
    }

    /// The keys within the samples: their times, and their values with the sign of the curve there.
    pub(crate) fn keys(&self, index: usize, rotations: &[Quat]) -> Vec<(f64, Quat)> {
        let track = self.set.track(index);
        let times: Vec<f64> = self.timeline.times(0).collect();
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return Vec::new();
        };
        // Keys up to half a frame outside the samples are drawn too, because frames are rounded.
        let room = (last - first) / (2 * times.len()) as f64;
        let keys = track.times.iter().zip(track.keys);
        let inside = keys.filter(|&(&time, _)| time >= first - room && time <= last + room);
        let placed = inside.map(|(&time, &key)| {
            let after = times.partition_point(|&sample| sample < time);
            let near = rotations[after.min(rotations.len() - 1)];
            let key = if key.dot(near) < 0.0 { -key } else { key };
            (time - self.x.origin, key)
        });
        placed.collect()
    }

    pub(crate) fn key_positions(&self, index: usize) -> Vec<f64> {
        let times = self.set.track(index).times;
        if times.len() > UPRIGHTS {
            return Vec::new();
        }
        let positions = times.iter().map(|&time| time - self.x.origin);
        positions
            .filter(|x| self.x.axis.range.contains(x))
            .collect()
    }
}
