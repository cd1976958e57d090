//! Plays a clip faster or slower, or at other times.

use glam::{Quat, Vec3};
use tumble::{Channel, TrackError, TrackSet};

use crate::motion::Motion;
use crate::motion::grid::restore;
use crate::rate::Precision;

/// Why a clip cannot have other times.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RetimeError {
    /// The speed is not greater than 0, or not finite.
    #[error("the speed {speed} is not a number greater than 0")]
    Speed {
        /// The speed.
        speed: f64,
    },
    /// The start is not finite.
    #[error("the start {start} is not a finite number of seconds")]
    Start {
        /// The start.
        start: f64,
    },
    /// The times are not valid.
    #[error(transparent)]
    Track(#[from] TrackError),
}

/// Returns the clip, played `speed` times as fast. The first key is moved to `start`, in seconds; without `start`, it
/// stays at its time. Keys do not change; velocities and tangents, which are rates, are multiplied by the speed.
///
/// # Errors
/// When the speed is not greater than 0, a number is not finite, or times become too large or equal.
pub fn retime(clip: &Motion, speed: f64, start: Option<f64>) -> Result<Motion, RetimeError> {
    if !(speed > 0.0 && speed.is_finite()) {
        return Err(RetimeError::Speed { speed });
    }
    let first = clip.set.time_span().map_or(0.0, |span| span.0);
    let start = start.map_or(first, |start| clip.time_in_set(start));
    if !start.is_finite() {
        return Err(RetimeError::Start { start });
    }
    let is_moved = speed != 1.0 || start != first;
    let time = |&time: &f64| start + (time - first) / speed;
    let mut lists: Vec<Vec<f64>> = match is_moved {
        true => (clip.key_lists())
            .map(|list| list.iter().map(time).collect())
            .collect(),
        false => clip.key_lists().map(<[f64]>::to_vec).collect(),
    };
    let rate = match is_moved {
        true => restore(&mut lists, Precision::F64).filter(|_| clip.rate.is_some()),
        false => clip.rate,
    };
    // In the order of `key_lists`.
    let mut lists = lists.into_iter();
    let mut next = || lists.next().unwrap_or_default();
    let factor = speed as f32;
    let mut set = TrackSet::new();
    for (index, track) in clip.set.tracks().enumerate() {
        set.push(track.name.unwrap_or_default(), &next(), track.keys)?;
        if !track.tangents.is_empty() {
            let faster = |pair: &[Quat; 2]| pair.map(|tangent| tangent * factor);
            let tangents: Vec<_> = track.tangents.iter().map(faster).collect();
            set.set_tangents(index, &tangents)?;
        }
        if !track.velocities.is_empty() {
            let velocities: Vec<_> = track.velocities.iter().map(|&it| it * speed).collect();
            set.set_velocities(index, &velocities)?;
        }
        if !track.tcb.is_empty() {
            set.set_tcb(index, track.tcb)?;
        }
        for channel in [Channel::Translation, Channel::Scale] {
            let Some(keys) = clip.set.vector_keys(channel, index) else {
                continue;
            };
            let faster = |pair: &[Vec3; 2]| pair.map(|tangent| tangent * factor);
            let tangents: Vec<_> = keys.tangents.iter().map(faster).collect();
            match channel {
                Channel::Translation => {
                    set.set_translations(index, &next(), keys.keys, &tangents)?;
                }
                Channel::Scale => set.set_scales(index, &next(), keys.keys, &tangents)?,
            }
        }
    }
    let mut retimed = Motion {
        set,
        rate,
        ..clip.without_tracks()
    };
    for (index, keys) in clip.scalar_keys().enumerate() {
        let faster = |pair: &[f32; 2]| pair.map(|tangent| tangent * factor);
        let tangents: Vec<_> = keys.tangents.iter().map(faster).collect();
        let scalar = clip.scalar(index);
        retimed.add_scalar(scalar, keys.name, &next(), keys.keys, &tangents)?;
    }
    Ok(retimed)
}
