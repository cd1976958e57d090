//! Cuts a part out of a clip, from one time to another.

use glam::Vec3;
use tumble::{Channel, Engine, Error, SampleTimes, TrackError, TrackSet, signs_differ};

use crate::motion::sample::ChannelMethods;
use crate::motion::{Motion, carry_key_data};
use crate::rate::{Precision, on_frames};

/// Why a part of a clip cannot be cut out.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrimError {
    /// The part does not overlap the clip.
    #[error("nothing lies from {start} to {end} s: keys lie from {first} to {last} s")]
    Empty {
        /// Start of the part, in seconds.
        start: f64,
        /// End of the part, in seconds.
        end: f64,
        /// First key time of the clip, in seconds.
        first: f64,
        /// Last key time of the clip, in seconds.
        last: f64,
    },
    /// A new key at a cut would need the tangents, velocities or tensions that the other keys have.
    #[error(
        "track {track} (`{name}`) has tangents, velocities or tensions at its keys, and no key is at {time} s: cut at \
         one of its keys, or sample it (`tumble eval --start --end`)"
    )]
    NoKeyAtCut {
        /// Index of the first such track, from 0.
        track: usize,
        /// Name of that track.
        name: String,
        /// Time of the cut, in seconds.
        time: f64,
    },
    /// A new key of a scalar at a cut would need the tangents that its other keys have.
    #[error(
        "the scalar `{name}` has tangents at its keys, and no key is at {time} s: cut at one of its keys, or sample it \
         (`tumble eval --start --end`)"
    )]
    NoScalarKeyAtCut {
        /// Name of the first such scalar.
        name: String,
        /// Time of the cut, in seconds.
        time: f64,
    },
    /// A key at the cut could not be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
    /// An evaluated key is not valid.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Cuts out the part of a clip from `start` to `end`, in seconds. Keys keep their times. A channel with keys on both
/// sides of a cut, but none at it, gets a key there, evaluated by the interpolation of the channel. Curves that
/// depend only on the two keys of an interval (steps, lines and arcs) stay the same. Curves that depend on keys
/// outside the part change in the intervals next to the cuts.
///
/// # Errors
/// When the part does not overlap the clip or `start` is after `end`, when a new key would need tangents, velocities
/// or tensions, or when `engine` fails.
pub fn trim(clip: &Motion, start: f64, end: f64, engine: &Engine) -> Result<Motion, TrimError> {
    let set = &clip.set;
    let (first, last) = set.time_span().unwrap_or_default();
    let overlaps = start <= end && start <= last && end >= first;
    if !overlaps {
        return Err(TrimError::Empty {
            start,
            end,
            first,
            last,
        });
    }
    let methods = ChannelMethods::AUTHORED;
    let cuts = methods.sample(engine, clip, &SampleTimes::at(vec![start, end]))?;
    let tracks = set.track_count();
    let mut trimmed = TrackSet::new();
    for (index, track) in set.tracks().enumerate() {
        let name = || set.track_name(index);
        let refuse = |time| TrimError::NoKeyAtCut {
            track: index,
            name: name(),
            time,
        };
        let part = TrimmedKeys::of(track.times, start, end);
        let has_more =
            !track.tangents.is_empty() || !track.velocities.is_empty() || !track.tcb.is_empty();
        if let Some(time) = part.made().filter(|_| has_more) {
            return Err(refuse(time));
        }
        let values = [cuts.rotations[index], cuts.rotations[tracks + index]];
        let (times, mut keys) = part.keys(track.times, track.keys, values);
        // A new key gets the sign with which the curve continues.
        for i in 1..keys.len() {
            if part.is_made(i) && signs_differ(keys[i - 1], keys[i]) {
                keys[i] = -keys[i];
            }
        }
        if let [first, second, ..] = &mut keys[..]
            && part.before
            && signs_differ(*second, *first)
        {
            *first = -*first;
        }
        trimmed.push(track.name.unwrap_or_default(), &times, &keys)?;
        let new_track = trimmed.track_count() - 1;
        carry_key_data(&mut trimmed, new_track, &track, part.kept.clone())?;
        for (channel, samples) in [
            (Channel::Translation, &cuts.translations),
            (Channel::Scale, &cuts.scales),
        ] {
            let Some(vectors) = set.vector_keys(channel, index) else {
                continue;
            };
            let part = TrimmedKeys::of(vectors.times, start, end);
            if let Some(time) = part.made().filter(|_| !vectors.tangents.is_empty()) {
                return Err(refuse(time));
            }
            let values: [Vec3; 2] = [samples[index], samples[tracks + index]];
            let (times, keys) = part.keys(vectors.times, vectors.keys, values);
            let tangents = match vectors.tangents.is_empty() {
                true => &[],
                false => &vectors.tangents[part.kept.clone()],
            };
            match channel {
                Channel::Translation => {
                    trimmed.set_translations(new_track, &times, &keys, tangents)?;
                }
                Channel::Scale => trimmed.set_scales(new_track, &times, &keys, tangents)?,
            }
        }
    }
    let rate = clip.rate.filter(|&rate| {
        let times = trimmed.tracks().flat_map(|track| track.times);
        on_frames(times.copied(), rate, 0.0, Precision::F64)
    });
    let mut part = Motion {
        set: trimmed,
        rate,
        ..clip.without_tracks()
    };
    let scalars = set.scalar_count();
    for (index, keys) in clip.scalar_keys().enumerate() {
        let kept = TrimmedKeys::of(keys.times, start, end);
        if let Some(time) = kept.made().filter(|_| !keys.tangents.is_empty()) {
            let name = keys.name.to_owned();
            return Err(TrimError::NoScalarKeyAtCut { name, time });
        }
        let values = [cuts.scalars[index], cuts.scalars[scalars + index]];
        let (times, numbers) = kept.keys(keys.times, keys.keys, values);
        let tangents = match keys.tangents.is_empty() {
            true => &[],
            false => &keys.tangents[kept.kept.clone()],
        };
        part.add_scalar(clip.scalar(index), keys.name, &times, &numbers, tangents)?;
    }
    Ok(part)
}

/// The keys of a channel between the cuts, and where new keys are needed.
struct TrimmedKeys {
    /// The keys that stay.
    kept: std::ops::Range<usize>,
    start: f64,
    end: f64,
    /// Whether a new key is needed at the start.
    before: bool,
    /// Whether a new key is needed at the end.
    after: bool,
}

impl TrimmedKeys {
    fn of(times: &[f64], start: f64, end: f64) -> Self {
        let first = times.partition_point(|&time| time < start);
        let behind = times.partition_point(|&time| time <= end).max(first);
        // A single key is a constant, so its time does not matter.
        if times.len() == 1 {
            return Self {
                kept: 0..1,
                start,
                end,
                before: false,
                after: false,
            };
        }
        // If a channel begins or ends inside the range, its value is held there, as before.
        let before = first > 0 && times.get(first).is_none_or(|&time| time > start);
        let after = behind < times.len()
            && (behind == 0 || times[behind - 1] < end)
            && (end > start || !before);
        Self {
            kept: first..behind,
            start,
            end,
            before,
            after,
        }
    }

    /// The time of a new key.
    fn made(&self) -> Option<f64> {
        match (self.before, self.after) {
            (true, _) => Some(self.start),
            (false, true) => Some(self.end),
            (false, false) => None,
        }
    }

    /// Whether the key at this index is new.
    fn is_made(&self, index: usize) -> bool {
        let behind = usize::from(self.before) + self.kept.len();
        self.before && index == 0 || self.after && index == behind
    }

    /// The keys of the part; `made` are the values at the two cuts.
    fn keys<T: Copy>(&self, times: &[f64], keys: &[T], made: [T; 2]) -> (Vec<f64>, Vec<T>) {
        let before = self.before.then_some((self.start, made[0]));
        let after = self.after.then_some((self.end, made[1]));
        let kept = times[self.kept.clone()].iter().copied();
        let kept = kept.zip(keys[self.kept.clone()].iter().copied());
        before.into_iter().chain(kept).chain(after).unzip()
    }
}

#[cfg(test)]
mod tests {
    use glam::Quat;
    use tumble::Device;

    use super::*;
    use crate::motion::{ChannelInterpolation, Channels};

    fn clip(sampler: Option<ChannelInterpolation>) -> Motion {
        let mut clip = Motion::default();
        for (track, times) in [
            [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0],
            [0.5, 0.75, 2.0, 2.5, 4.0, 6.0, 9.0, 10.0],
        ]
        .iter()
        .enumerate()
        {
            let keys: Vec<Quat> = (0..8u8)
                .map(|key| Quat::from_rotation_y(f32::from(key * key) * 0.2 + track as f32))
                .collect();
            clip.set.push("", times, &keys).unwrap();
            let positions: Vec<Vec3> = keys.iter().map(|q| *q * Vec3::X).collect();
            clip.set
                .set_translations(track, times, &positions, &[])
                .unwrap();
            clip.channels.push(Channels {
                rotation: sampler,
                translation: sampler,
                scale: None,
            });
        }
        clip
    }

    /// The largest angle and distance between a clip and its part, from a time to a time.
    fn largest(whole: &Motion, part: &Motion, from: f64, to: f64) -> (f64, f32) {
        let engine = Engine::new(Device::Cpu).unwrap();
        let frames = SampleTimes::fps(60).between(from, to);
        let methods = ChannelMethods::AUTHORED;
        let [a, b] = [whole, part].map(|clip| methods.sample(&engine, clip, &frames).unwrap());
        let angle =
            |(a, b): (&Quat, &Quat)| tumble::reference::angle_between(a.as_dquat(), b.as_dquat());
        (
            a.rotations
                .iter()
                .zip(&b.rotations)
                .map(angle)
                .fold(0.0, f64::max),
            a.translations
                .iter()
                .zip(&b.translations)
                .map(|(a, b)| a.distance(*b))
                .fold(0.0, f32::max),
        )
    }

    #[test]
    fn arcs_lines_and_steps_stay_the_same_curve() {
        let engine = Engine::new(Device::Cpu).unwrap();
        for sampler in [ChannelInterpolation::Linear, ChannelInterpolation::Step] {
            let whole = clip(Some(sampler));
            let part = trim(&whole, 1.25, 5.5, &engine).unwrap();
            assert_eq!(part.set.track(0).times, [1.25, 2.0, 3.0, 4.0, 5.0, 5.5]);
            assert_eq!(part.set.track(1).times, [1.25, 2.0, 2.5, 4.0, 5.5]);
            assert_eq!(part.set.track(0).keys[1..5], whole.set.track(0).keys[2..6]);
            let (angle, distance) = largest(&whole, &part, 1.25, 5.5);
            assert!(
                angle < 1e-6 && distance < 1e-6,
                "{sampler:?}: {angle} {distance}"
            );
        }
    }

    #[test]
    fn smooth_curves_change_beside_the_cuts_alone() {
        let engine = Engine::new(Device::Cpu).unwrap();
        let whole = clip(None);
        let part = trim(&whole, 0.25, 6.75, &engine).unwrap();
        let (angle, distance) = largest(&whole, &part, 2.0, 4.0);
        assert!(angle < 1e-6 && distance < 1e-6, "{angle} {distance}");
        let ends = largest(&whole, &part, 0.25, 6.75);
        assert!(ends.0 < 0.5, "{ends:?}");
    }

    #[test]
    fn cuts_on_keys_make_none_and_empty_parts_are_refused() {
        let engine = Engine::new(Device::Cpu).unwrap();
        let mut whole = clip(Some(ChannelInterpolation::Linear));
        whole.set = whole.set.select([0]).unwrap();
        whole.channels.truncate(1);
        let part = trim(&whole, 2.0, 5.0, &engine).unwrap();
        assert_eq!(part.set.track(0).times, [2.0, 3.0, 4.0, 5.0]);
        let one = trim(&whole, 2.5, 2.5, &engine).unwrap();
        assert_eq!(one.set.track(0).times, [2.5]);
        for (start, end) in [(8.0, 9.0), (-2.0, -1.0), (3.0, 2.0)] {
            let refused = trim(&whole, start, end, &engine);
            assert!(matches!(refused, Err(TrimError::Empty { .. })));
        }
        whole
            .set
            .set_tangents(0, &[[Quat::IDENTITY; 2]; 8])
            .unwrap();
        assert!(trim(&whole, 2.0, 5.0, &engine).is_ok());
        let refused = trim(&whole, 2.0, 5.5, &engine).unwrap_err();
        assert!(refused.to_string().contains("5.5 s"), "{refused}");
    }
}
