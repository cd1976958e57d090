//! Reduces the keys of clips. The poses stay near those of dense samples: at every sample, each joint is within an
//! angle and a distance of the original, in the world if the clip has a skeleton.
//!
//! Joints are reduced from the root on. The target of a joint is relative to its reduced parent, so that angles do
//! not add up along a chain. Distances do add up: if a joint exceeds its bound, the tolerances of this joint and its
//! ancestors shrink, and all keys are computed again. Bounds are checked by evaluating the keys as `eval` does.

mod keys;

use std::f64::consts::PI;

use glam::{DVec3, Quat};
use tumble::reduce::{ReduceError, ReducedCurve};
use tumble::reference::angle_between;
use tumble::{Channel, Engine, Error, SampleTimes, TrackError};

use crate::format::Quantization;
use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::world::{HierarchyError, WorldPose, parents_first, world};
use crate::motion::{ChannelInterpolation, Motion, carry_key_data};

/// The bounds and options of a reduction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReduceOptions {
    /// The curve through the keys.
    pub curve: ReducedCurve,
    /// The largest angle, in radians.
    pub angle: f64,
    /// The largest distance, in the file's unit of length. By default it is the arc of the angle at a radius of
    /// `shell` plus the length of the longest chain of joints, which counts as 1 or more.
    pub distance: Option<f64>,
    /// Points at this distance from each joint, in both directions along its axes, stay within the largest distance
    /// too.
    pub shell: f64,
    /// Whether all joints get keys at the same times, as most formats store them. Otherwise each channel gets
    /// separate times, as glTF stores them.
    pub together: bool,
    /// The quantization with which rotations will be written
    /// ([`MotionOptions::quantize`](crate::format::MotionOptions::quantize)); errors then include it.
    pub quantize: Option<Quantization>,
}

/// A reduced clip and its errors against the samples.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Reduced {
    /// The clip with few keys, in f32.
    pub clip: Motion,
    /// Number of keys of all channels, before and after.
    pub keys: [usize; 2],
    /// Times of the samples, in seconds.
    pub times: Vec<f64>,
    /// The bounds: the angle in radians, and the distance.
    pub bounds: [f64; 2],
    /// For each sample, the largest angle and the largest distance of all joints.
    pub errors: Vec<[f64; 2]>,
    /// For the largest angle and for the largest distance: the joint and the sample.
    pub worst: [(usize, usize); 2],
}

/// Why a clip cannot be reduced.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReduceMotionError {
    /// The samples could not be evaluated.
    #[error(transparent)]
    Evaluating(#[from] Error),
    /// An option or the samples are invalid.
    #[error(transparent)]
    Reducing(#[from] ReduceError),
    /// The parents of the joints do not make a hierarchy.
    #[error(transparent)]
    Hierarchy(#[from] HierarchyError),
    /// The reduced keys are not valid.
    #[error(transparent)]
    Keys(#[from] TrackError),
    /// Keys at the same times were requested, and a joint has steps; keys at the same times are joined by curves.
    #[error(
        "joint {joint} (`{name}`) holds each key until the next one, so that its keys stay at their own \
         times; write .glb"
    )]
    Steps {
        /// Index of the first such joint, from 0.
        joint: usize,
        /// Name of that joint.
        name: String,
    },
    /// A bound is smaller than the precision with which keys are stored.
    #[error(
        "the tolerance of {bound:.3e} {unit} cannot be reached: even with all samples as keys the error is \
         {found:.3e} {unit}, because keys are {kept}; give a larger tolerance"
    )]
    TooSmall {
        /// The largest error with all samples as keys.
        found: f64,
        /// The requested bound.
        bound: f64,
        /// The unit of both: `rad`, or `of the file's unit of length`.
        unit: &'static str,
        /// How rotations are stored: `f32`, or `of 16 bits`.
        kept: &'static str,
    },
}

/// How often tolerances shrink, each time to 95 % or less.
const ROUNDS: usize = 60;

/// Reduces the keys of a clip.
///
/// # Errors
/// * When a bound is not a finite number of 0 or more, or is smaller than the stored precision.
/// * When the parents do not make a hierarchy.
/// * When joints with steps should get keys at the same times.
/// * When the clip cannot be evaluated.
pub fn reduce(
    clip: &Motion,
    engine: &Engine,
    options: &ReduceOptions,
) -> Result<Reduced, ReduceMotionError> {
    for tolerance in [Some(options.angle), options.distance, Some(options.shell)] {
        if let Some(tolerance) = tolerance.filter(|limit| !(limit.is_finite() && *limit >= 0.0)) {
            return Err(ReduceError::Tolerance { tolerance }.into());
        }
    }
    let reduction = Reduction::new(clip, engine, options)?;
    let joints = clip.set.track_count();
    let mut tolerances = Tolerances {
        angles: vec![options.angle; joints],
        distances: vec![reduction.distance; joints],
    };
    let mut round = 0;
    loop {
        let reduced = reduction.attempt(&tolerances)?;
        let found = reduction.measure(&reduced)?;
        if !reduction.tighten(&found, &mut tolerances) {
            return Ok(found.into_reduced(&reduction, reduced));
        }
        round += 1;
        if round == ROUNDS {
            return Err(found.too_small(&reduction));
        }
    }
}

/// Makes all samples keys, quantized by the coarsest steps that the bounds allow. If many keys are needed, these are
/// smaller after meshopt's compression than fewer keys with separate times. `None` if 16 bits are not exact enough.
///
/// # Errors
/// As [`reduce`].
pub fn quantize_all(
    clip: &Motion,
    engine: &Engine,
    options: &ReduceOptions,
) -> Result<Option<(Reduced, Quantization)>, ReduceMotionError> {
    let attempt = |level: u32| -> Result<Option<(Reduced, Quantization)>, ReduceMotionError> {
        let quantization = filtered(level);
        let options = ReduceOptions {
            quantize: Some(quantization),
            ..*options
        };
        let reduction = Reduction::new(clip, engine, &options)?;
        let all = reduction.all()?;
        let found = reduction.measure(&all)?;
        let joints = clip.set.track_count();
        let mut tolerances = Tolerances {
            angles: vec![0.0; joints],
            distances: vec![0.0; joints],
        };
        let is_exceeded = reduction.tighten(&found, &mut tolerances);
        Ok((!is_exceeded).then(|| (found.into_reduced(&reduction, all), quantization)))
    };
    let Some(mut best) = attempt(FINEST)? else {
        return Ok(None);
    };
    let (mut low, mut high) = (0, FINEST);
    while low < high {
        let middle = u32::midpoint(low, high);
        match attempt(middle)? {
            Some(found) => (best, high) = (found, middle),
            None => low = middle + 1,
        }
    }
    Ok(Some(best))
}

/// The level of the finest steps; those of level 0 are about 10 degrees apart.
const FINEST: u32 = 10;

/// The quantization of a level. Each level has one bit more than the one before; level 0 has 6.
fn filtered(level: u32) -> Quantization {
    Quantization::Filtered((1 << (5 + level.min(FINEST))) - 1)
}

/// The tolerance of each joint's curve.
struct Tolerances {
    angles: Vec<f64>,
    /// The tolerances of translations.
    distances: Vec<f64>,
}

/// A clip and its samples.
struct Reduction<'a> {
    clip: &'a Motion,
    engine: &'a Engine,
    options: &'a ReduceOptions,
    /// The bound of distances.
    distance: f64,
    times: Vec<f64>,
    samples: Samples,
    poses: Vec<WorldPose>,
    /// The joints, in an order in which parents come before their children.
    order: Vec<usize>,
    parents: Vec<Option<usize>>,
}

/// The largest errors of a reduced clip, of each joint and of each sample.
struct MeasuredErrors {
    /// By joint: angle and distance.
    joints: Vec<[f64; 2]>,
    /// By sample: angle and distance.
    samples: Vec<[f64; 2]>,
    worst: [(usize, usize); 2],
}

impl<'a> Reduction<'a> {
    fn new(
        clip: &'a Motion,
        engine: &'a Engine,
        options: &'a ReduceOptions,
    ) -> Result<Self, ReduceMotionError> {
        let times = clip.key_times();
        let samples =
            ChannelMethods::AUTHORED.sample(engine, clip, &SampleTimes::at(times.clone()))?;
        let joints = clip.set.track_count();
        // If poses in the world cannot be computed, each track is reduced without its parent.
        let hangs = clip.no_world.is_none() && !clip.is_world;
        let parents: Vec<Option<usize>> = (0..joints)
            .map(|joint| clip.skeleton.get(joint)?.parent.filter(|_| hangs))
            .collect();
        let poses = poses(clip, &samples)?;
        let order = match hangs {
            true => parents_first(clip, joints)?,
            false => (0..joints).collect(),
        };
        let mut reduction = Self {
            clip,
            engine,
            options,
            distance: 0.0,
            times,
            samples,
            poses,
            order,
            parents,
        };
        let reach = reduction.reach().max(1.0) + options.shell;
        reduction.distance = options.distance.unwrap_or(options.angle.min(PI) * reach);
        Ok(reduction)
    }

    /// The length of the longest chain of joints from a root, at rest or at the first sample.
    fn reach(&self) -> f64 {
        let mut lengths = vec![0.0f64; self.parents.len()];
        for &joint in &self.order {
            if let Some(parent) = self.parents[joint] {
                let translation = self.samples.translations.get(joint).copied();
                let translation =
                    translation.unwrap_or_else(|| self.clip.rest(Channel::Translation, joint));
                lengths[joint] = lengths[parent] + f64::from(translation.length());
            }
        }
        lengths.into_iter().fold(0.0, f64::max)
    }

    /// The errors of a clip against the samples, evaluated as `eval` does.
    fn measure(&self, reduced: &Motion) -> Result<MeasuredErrors, ReduceMotionError> {
        let frames = SampleTimes::at(self.times.clone());
        let quantized = self.options.quantize.map(|bits| quantized(reduced, bits));
        let quantized = quantized.transpose()?;
        let reduced = quantized.as_ref().unwrap_or(reduced);
        let samples = ChannelMethods::AUTHORED.sample(self.engine, reduced, &frames)?;
        let poses = poses(reduced, &samples)?;
        let joints = self.parents.len();
        let mut measured = MeasuredErrors {
            joints: vec![[0.0; 2]; joints],
            samples: vec![[0.0; 2]; self.times.len()],
            worst: [(0, 0); 2],
        };
        let mut largest = [-1.0; 2];
        for (index, (expected, found)) in self.poses.iter().zip(&poses).enumerate() {
            let (sample, joint) = (index / joints, index % joints);
            let [a, b] = [expected, found].map(|pose| pose.rotation.as_dquat());
            let angle = angle_between(a, b);
            let moved = found.position - expected.position;
            let mut distance = moved.length();
            if self.options.shell > 0.0 {
                for axis in DVec3::AXES.map(|axis| axis * self.options.shell) {
                    for point in [axis, -axis] {
                        distance = distance.max((moved + (b * point - a * point)).length());
                    }
                }
            }
            for (kind, error) in [angle, distance].into_iter().enumerate() {
                let error = if error.is_nan() { f64::INFINITY } else { error };
                let joints = &mut measured.joints[joint][kind];
                *joints = joints.max(error);
                let samples = &mut measured.samples[sample][kind];
                *samples = samples.max(error);
                if error > largest[kind] {
                    (largest[kind], measured.worst[kind]) = (error, (joint, sample));
                }
            }
        }
        Ok(measured)
    }

    /// Reduces the tolerances where bounds are exceeded; returns whether any is.
    fn tighten(&self, found: &MeasuredErrors, tolerances: &mut Tolerances) -> bool {
        let mut factors = vec![1.0f64; self.parents.len()];
        for (joint, &[angle, distance]) in found.joints.iter().enumerate() {
            // The ratio of the bound to the error would have been enough; 0.95 of it makes another round unlikely. One
            // round reduces a tolerance at most to 0.3 of its value.
            let part = |bound: f64, error: f64| (0.95 * bound / error).clamp(0.3, 0.95);
            if angle > self.options.angle {
                factors[joint] = factors[joint].min(part(self.options.angle, angle));
            }
            if distance > self.distance {
                let part = part(self.distance, distance);
                let mut above = Some(joint);
                while let Some(ancestor) = above {
                    factors[ancestor] = factors[ancestor].min(part);
                    above = self.parents[ancestor];
                }
            }
        }
        for (joint, &factor) in factors.iter().enumerate() {
            tolerances.angles[joint] *= factor;
            tolerances.distances[joint] *= factor;
        }
        factors.iter().any(|&factor| factor < 1.0)
    }
}

impl MeasuredErrors {
    fn into_reduced(self, reduction: &Reduction<'_>, clip: Motion) -> Reduced {
        Reduced {
            keys: [reduction.clip, &clip].map(Motion::key_count),
            clip,
            times: reduction.times.clone(),
            bounds: [reduction.options.angle, reduction.distance],
            errors: self.samples,
            worst: self.worst,
        }
    }

    fn too_small(&self, reduction: &Reduction<'_>) -> ReduceMotionError {
        let largest = |kind: usize| {
            self.joints
                .iter()
                .map(|largest| largest[kind])
                .fold(0.0, f64::max)
        };
        let bound = reduction.options.angle;
        let kept = match reduction.options.quantize {
            Some(_) => "of 16 bits",
            None => "f32",
        };
        match largest(0) > bound {
            true => ReduceMotionError::TooSmall {
                found: largest(0),
                bound,
                unit: "rad",
                kept,
            },
            false => ReduceMotionError::TooSmall {
                found: largest(1),
                bound: reduction.distance,
                unit: "of the file's unit of length",
                kept,
            },
        }
    }
}

/// The clip that is read back after its rotations were written with a quantization.
fn quantized(clip: &Motion, quantization: Quantization) -> Result<Motion, TrackError> {
    let mut short = clip.without_tracks().with_scalars_of(clip, 1.0)?;
    for (index, track) in clip.set.tracks().enumerate() {
        let keys: Vec<Quat> = match clip.channels.get(index).map(|channels| channels.rotation) {
            // The rest pose of a node is stored in f32, and tangents may be too long for 16 bits.
            Some(None | Some(ChannelInterpolation::Cubic)) => track.keys.to_vec(),
            _ => {
                let keys = track.keys.iter();
                keys.map(|&key| quantization.read_back(key)).collect()
            }
        };
        short
            .set
            .push(clip.set.track_name(index), track.times, &keys)?;
        carry_key_data(&mut short.set, index, &track, 0..keys.len())?;
        if let Some(vectors) = clip.set.vector_keys(Channel::Translation, index) {
            let (times, keys, tangents) = (vectors.times, vectors.keys, vectors.tangents);
            short.set.set_translations(index, times, keys, tangents)?;
        }
        if let Some(vectors) = clip.set.vector_keys(Channel::Scale, index) {
            let (times, keys, tangents) = (vectors.times, vectors.keys, vectors.tangents);
            short.set.set_scales(index, times, keys, tangents)?;
        }
    }
    Ok(short)
}

/// Poses in the world, or relative to the parents if those cannot be computed.
fn poses(clip: &Motion, samples: &Samples) -> Result<Vec<WorldPose>, HierarchyError> {
    if clip.no_world.is_none() {
        return world(clip, samples);
    }
    let each = samples.rotations.iter().enumerate();
    Ok(each
        .map(|(index, &rotation)| WorldPose {
            position: samples
                .translations
                .get(index)
                .copied()
                .unwrap_or_default()
                .as_dvec3(),
            rotation,
        })
        .collect())
}
