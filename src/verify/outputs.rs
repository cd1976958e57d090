//! Verification of outputs that are computed from rotations: velocities, accelerations, poses in the world, and every
//! encoding.

use glam::{DQuat, Quat, Vec3};
use rayon::prelude::*;

use crate::curve::options::{Axes, Quantity, Speed};
use crate::device::Device;
use crate::engine::Engine;
use crate::error::Error;
use crate::method::interpolation::Interpolation;
use crate::output::encoding::Encoding;
use crate::output::rotations::{Layout, Rotations, Vectors};
use crate::pose::skeleton::Skeleton;
use crate::reference::curve::ReferenceCurve;
use crate::reference::quaternion::angle_between;
use crate::threads::{OutOfThreadsError, on_threads, stop};
use crate::time::frames::{SampleTimes, Timeline};
use crate::tracks::set::{Track, TrackSet};
use crate::verify::{KeyTimes, RATE_BOUND, differences, worse};

/// The result of the verification of one output.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
#[non_exhaustive]
pub struct OutputVerification {
    /// The output's name.
    pub output: String,
    /// The number of values compared between the device and the CPU: one for each track and sample.
    pub values: u64,
    /// The number of values whose bits differ.
    pub differing: u64,
    /// The largest error against the reference: in radians for rotations, and relative to the track's largest value
    /// for velocities and accelerations. That value counts as at least a thousandth of a radian per key interval of
    /// mean length (per square of it for accelerations).
    pub max_error: f64,
    /// The bound of the error.
    pub error_bound: f64,
}

impl OutputVerification {
    /// Whether all bits agree and the error is within its bound.
    #[must_use]
    pub fn passes(&self) -> bool {
        self.differing == 0 && self.max_error <= self.error_bound
    }
}

const QUANTITIES: [(&str, Quantity); 4] = [
    ("velocity", Quantity::Velocity(Axes::Body)),
    ("velocity, parent", Quantity::Velocity(Axes::Parent)),
    ("acceleration", Quantity::Acceleration(Axes::Body)),
    ("acceleration, parent", Quantity::Acceleration(Axes::Parent)),
];

/// The maximum number of samples whose derivatives are compared with the reference, which is slow.
const RATES_CHECKED: usize = 4096;

/// Verifies every output of one method.
pub(crate) fn verify(
    engine: &Engine,
    set: &TrackSet,
    interpolation: Interpolation,
    frames: &SampleTimes,
    timeline: &Timeline,
) -> Result<Vec<OutputVerification>, Error> {
    let cpu = Engine::new(Device::Cpu)?;
    let mut outputs = Vec::new();
    for (name, quantity) in QUANTITIES {
        let interpolation = Interpolation {
            quantity,
            ..interpolation
        };
        let found = engine.rates(set, interpolation, frames, Layout::TrackMajor)?;
        let expected = cpu.rates(set, interpolation, frames, Layout::TrackMajor)?;
        outputs.push(OutputVerification {
            output: name.to_owned(),
            values: found.as_slice().len() as u64,
            differing: differences(found.as_slice(), expected.as_slice(), 1).0,
            max_error: rate_error(set, interpolation, timeline, &found)?,
            error_bound: match (interpolation.speed, quantity) {
                (Speed::AsKeyed, _) => RATE_BOUND,
                // At constant speed, the direction changes fast where the keyed curve was slow.
                (Speed::Constant, Quantity::Velocity(_)) => 1e-5,
                (Speed::Constant, _) => 1e-3,
            },
        });
    }
    let (clip, layout) = (engine.upload(set, interpolation)?, Layout::TrackMajor);
    let rotations = cpu.evaluate(set, interpolation, frames)?;
    outputs.push(world(engine, &cpu, set, &rotations)?);
    let rotations: &[[f32; 4]] = bytemuck::cast_slice(rotations.as_quats());
    let mut expected = Vec::new();
    for encoding in Encoding::ALL {
        let Some(error_bound) = encoding.row().error_bound else {
            continue; // not for rotations
        };
        let found = clip
            .request(frames)
            .layout(layout)
            .encoding(encoding)
            .evaluate_bytes()?;
        let bytes = encoding.bytes();
        expected.resize(rotations.len() * bytes, 0);
        encoding.encode_all(rotations, &mut expected);
        let error = |(stored, &rotation): (&[u8], &[f32; 4])| {
            let both = [encoding.decode_one(stored), rotation];
            let [decoded, rotation] = both.map(|value| Quat::from_array(value).as_dquat());
            worse(angle_between(decoded, rotation))
        };
        outputs.push(OutputVerification {
            output: encoding.to_string(),
            values: rotations.len() as u64,
            differing: differences(&found, &expected, bytes).0,
            max_error: (found.chunks(bytes).zip(rotations))
                .map(error)
                .fold(0.0, f64::max),
            error_bound,
        });
    }
    Ok(outputs)
}

/// Verifies rotations in the world, with the tracks as a chain.
fn world(
    engine: &Engine,
    cpu: &Engine,
    set: &TrackSet,
    local: &Rotations,
) -> Result<OutputVerification, Error> {
    let (tracks, samples) = (set.track_count(), local.sample_count());
    let chain = Skeleton::chain(tracks, 1.0)?;
    let found = engine.world(local, &chain)?;
    let expected = cpu.world(local, &chain)?;
    let mut output = OutputVerification {
        output: "world".to_owned(),
        values: found.as_slice().len() as u64,
        differing: differences(found.as_slice(), expected.as_slice(), 1).0,
        max_error: 0.0,
        // Each track of the chain adds its own rounding.
        error_bound: 1e-6 + 4e-7 * tracks as f64,
    };
    for sample in 0..samples {
        let mut above = DQuat::IDENTITY;
        for track in 0..tracks {
            let rotation = local.get(track, sample).unwrap_or(Quat::NAN);
            above = (above * rotation.as_dquat()).normalize();
            let rotation = found.rotation(track, sample).unwrap_or(Quat::NAN);
            let error = worse(angle_between(rotation.as_dquat(), above));
            output.max_error = output.max_error.max(error);
        }
    }
    Ok(output)
}

fn rate_error(
    set: &TrackSet,
    interpolation: Interpolation,
    timeline: &Timeline,
    found: &Vectors,
) -> Result<f64, OutOfThreadsError> {
    let samples = timeline.len();
    let each = (samples * set.track_count()).div_ceil(RATES_CHECKED).max(1);
    let stop = stop::current();
    let track = |index: usize| {
        let track = set.track(index);
        let keys = KeyTimes::new(&track, &interpolation);
        let times = &*keys.times;
        let curve = ReferenceCurve::of(&interpolation, Track { times, ..track });
        let expected = |time: f64| {
            let (body, axes) = match interpolation.quantity {
                Quantity::Velocity(axes) => (curve.velocity(time), axes),
                Quantity::Acceleration(axes) => (curve.acceleration(time), axes),
                Quantity::Rotation => unreachable!("a rate"),
            };
            match axes {
                Axes::Body => body,
                Axes::Parent => curve.rotation(time) * body,
            }
        };
        let (mut error, mut largest) = (0.0f64, rate_floor(times, interpolation.quantity));
        for sample in (0..samples).step_by(each) {
            if stop::check_of(stop.as_ref()).is_err() {
                return 0.0; // the caller checks for the stop again
            }
            let time = keys.of_sample(timeline, index, sample);
            let found = found.get(index, sample).unwrap_or(Vec3::NAN).as_dvec3();
            let error_at = |time: f64| (found - expected(time)).length();
            error = error.max(keys.least_error(time, error_at));
            // All samples may be at keys, where a velocity can be 0 although it is large between them.
            for near in within_interval(times, time).into_iter().chain([time]) {
                largest = largest.max(expected(near).length());
            }
        }
        error / largest
    };
    on_threads(|| {
        let errors = (0..set.track_count()).into_par_iter().map(track);
        errors.reduce(|| 0.0, f64::max)
    })
}

/// The smallest scale of errors: a thousandth of a radian per key interval of mean length, or per square of it for
/// accelerations. The acceleration of a rotation at constant velocity is only rounding.
fn rate_floor(keys: &[f64], quantity: Quantity) -> f64 {
    let mean = match keys {
        [first, .., last] => (last - first) / (keys.len() - 1) as f64,
        _ => 1.0,
    };
    match quantity {
        Quantity::Acceleration(_) => 1e-3 / (mean * mean),
        _ => 1e-3 / mean,
    }
}

/// Three times within the key interval that contains `time`; `time` itself if it is outside the
/// keys.
fn within_interval(keys: &[f64], time: f64) -> [f64; 3] {
    let after = keys.partition_point(|&key| key <= time);
    let (Some(before), Some(&end)) = (after.checked_sub(1), keys.get(after)) else {
        return [time; 3];
    };
    let start = keys[before];
    [0.02, 0.25, 0.5].map(|t| start + (end - start) * t)
}
