//! Reads the keys of one channel: times, values and tangents.

use glam::{DQuat, DVec4, Quat, Vec3};
use tumble::{TrackError, TrackSet, UNIT_TOLERANCE};

use crate::diagnostic::{Code, Diagnostic, Location};
use crate::gltf::reader::GltfReader;
use crate::gltf::schema::{Accessor, Sampler, TargetPath};
use crate::motion::keys::{Duplicates, Origin, select};
use crate::motion::{self, Motion, Scalar};
use crate::quaternion::dot;
use crate::warnings::Warnings;

/// A channel that moves a node.
pub(super) struct MovedChannel {
    /// Its index among the animation's channels.
    pub(super) channel: usize,
    pub(super) node: usize,
    pub(super) path: TargetPath,
    /// The number of elements of its values for each key: for weights the number of morph targets, otherwise 1.
    pub(super) elements: usize,
    /// Its sampler's index among the animation's samplers.
    pub(super) sampler_index: usize,
    pub(super) sampler: Sampler,
    pub(super) interpolation: motion::ChannelInterpolation,
    /// JSON pointers to the accessors of the sampler.
    input: String,
    pub(super) output: String,
    times: Accessor,
    values: Accessor,
}

/// Times that several channels may share.
pub(super) struct InputTimes(Vec<f64>);

impl InputTimes {
    pub(super) fn new(times: Vec<f64>) -> Self {
        Self(times)
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }
}

/// The keys of one channel.
pub(super) struct ChannelKeys {
    /// Times in seconds, strictly increasing; empty for a channel at rest.
    pub(super) times: Vec<f64>,
    values: ChannelValues,
}

/// The values, with the tangents at which the curve arrives and leaves, if there are any.
enum ChannelValues {
    Rotations(Vec<Quat>, Vec<[Quat; 2]>),
    Vectors(Vec<Vec3>, Vec<[Vec3; 2]>),
    /// In the orders `[key][target]` and `[key][side][target]`.
    Weights(Vec<f32>, Vec<f32>),
}

impl MovedChannel {
    /// `(channel, node, path)` is the index of the channel, its node and its target path, and `elements` the number of
    /// elements of a key; `pointer` is the JSON pointer to its sampler.
    ///
    /// # Errors
    /// When the interpolation is unknown, or when the number of values does not fit the times.
    pub(super) fn new(
        reader: &GltfReader<'_>,
        (channel, node, path): (usize, usize, TargetPath),
        elements: usize,
        (sampler_index, sampler): (usize, Sampler),
        pointer: &str,
    ) -> Result<Self, Diagnostic> {
        let interpolation = match sampler.interpolation.as_deref() {
            None | Some("LINEAR") => motion::ChannelInterpolation::Linear,
            Some("STEP") => motion::ChannelInterpolation::Step,
            Some("CUBICSPLINE") => motion::ChannelInterpolation::Cubic,
            Some(other) => {
                let message = format!(
                    "`{other}` is not an interpolation; there are LINEAR, STEP and CUBICSPLINE"
                );
                let pointer = format!("{pointer}/interpolation");
                return Err(reader.json.refuse(&pointer, Code::Interpolation, message));
            }
        };
        let (input, output) = (format!("{pointer}/input"), format!("{pointer}/output"));
        let times = reader.accessor(sampler.input, &input)?;
        let values = reader.accessor(sampler.output, &output)?;
        let needed = match interpolation {
            motion::ChannelInterpolation::Cubic => times.count.saturating_mul(3),
            _ => times.count,
        };
        let needed = needed.saturating_mul(elements as u64);
        if values.count != needed {
            let of_targets = match path {
                TargetPath::Weights => format!(" of {elements} morph targets"),
                _ => String::new(),
            };
            let message = format!(
                "{} values for {} times{of_targets}; {} needs {needed}",
                values.count,
                times.count,
                sampler.interpolation.as_deref().unwrap_or("LINEAR"),
            );
            return Err(reader.json.refuse(&output, Code::OutputCount, message));
        }
        Ok(Self {
            channel,
            node,
            path,
            elements,
            sampler_index,
            sampler,
            interpolation,
            input,
            output,
            times,
            values,
        })
    }

    /// Bytes of a key: its time, its value and its tangents.
    pub(super) fn key_bytes(&self) -> usize {
        let values = match self.interpolation {
            motion::ChannelInterpolation::Cubic => 3,
            _ => 1,
        };
        match self.path {
            // Each morph target becomes a scalar, which has its own list of times.
            TargetPath::Weights => self.elements * (size_of::<f64>() + values * size_of::<f32>()),
            _ => size_of::<f64>() + values * size_of::<Quat>(),
        }
    }

    /// The times in the file.
    ///
    /// # Errors
    /// When they are not floats, or missing.
    pub(super) fn stored_times(&self, reader: &GltfReader<'_>) -> Result<Vec<f64>, Diagnostic> {
        let count = usize::try_from(self.times.count).unwrap_or(usize::MAX);
        reader.take(count, 2 * size_of::<f64>(), &self.input)?;
        let times = reader.times(self.sampler.input, &self.times, &self.input)?;
        reader.warn_of_stride(&self.times);
        if let Some(time) = times.iter().find(|time| **time < 0.0) {
            reader.warn(Code::NegativeTime, &self.input, || {
                format!("the time {time} is negative; it is read as it is")
            });
        }
        Ok(times)
    }

    /// The keys, at increasing times.
    ///
    /// # Errors
    /// When values are missing or invalid, or when times do not increase.
    pub(super) fn keys(
        &self,
        reader: &GltfReader<'_>,
        times: &InputTimes,
        duplicates: Duplicates,
    ) -> Result<ChannelKeys, Diagnostic> {
        let width = self.path.width() * self.elements;
        // Memory of one key: its numbers in f64, its index in the list of kept keys, and its quaternion.
        let elements = self.values.count.div_ceil(times.len().max(1) as u64) as usize;
        let each = 8 * elements * self.path.width() + 40;
        let _borrowed = reader.borrow(times.len(), each, &self.output)?;
        let mut times = times.0.clone();
        if times.is_empty() {
            reader.warn(Code::EmptySampler, &self.input, || {
                format!(
                    "the sampler has no keys; the {} of node {} is not animated",
                    self.path, self.node
                )
            });
        }
        let element = self.path.width();
        let numbers = reader.numbers(self.sampler.output, &self.values, element, &self.output)?;
        reader.warn_of_stride(&self.values);
        let is_cubic = self.interpolation == motion::ChannelInterpolation::Cubic;
        let key_width = if is_cubic { 3 * width } else { width };
        let of_key = |key: usize| &numbers[key * key_width..][..key_width];
        let warnings = &mut *reader.warnings.borrow_mut();
        let at_input = |_: usize| Location::Inside(self.input.clone());
        let at_output = |_: usize| Location::Inside(self.output.clone());
        let origin = Origin {
            file: reader.json.name,
            location: &at_input,
            duplicates,
        };
        let kept = origin.increasing(&mut times, |i, j| of_key(i) == of_key(j), warnings)?;
        select(&mut times, kept.as_deref());
        let kept = kept.unwrap_or_else(|| (0..times.len()).collect());
        if is_cubic && times.len() == 1 {
            warnings.warn(Code::CubicOfOne, || {
                (
                    Some(at_output(0)),
                    "CUBICSPLINE of one key; the value is constant",
                )
            });
        }
        // A CUBICSPLINE key has three values: in-tangent, value, out-tangent.
        let value = |key: usize, which: usize| {
            let of = |which: usize| &of_key(kept[key])[which * width..][..width];
            of(if is_cubic { which } else { 0 })
        };
        let keys = || 0..times.len();
        // The first key has no incoming tangent, and the last no outgoing one.
        let tangent = |key: usize, which: usize| {
            let is_used = if which == 0 {
                key > 0
            } else {
                key + 1 < times.len()
            };
            is_used.then(|| value(key, which))
        };
        let values = match self.path {
            TargetPath::Rotation => {
                let stored: Vec<DQuat> =
                    keys().map(|key| DQuat::from_slice(value(key, 1))).collect();
                let origin = Origin {
                    location: &at_output,
                    ..origin
                };
                let mut unit = origin.unit(stored.iter().copied(), warnings)?;
                if self.interpolation == motion::ChannelInterpolation::Linear {
                    half_turns(&mut unit, warnings, &at_output);
                }
                let tangents = keys().filter(|_| is_cubic).map(|key| {
                    // If a key is scaled to norm 1, its tangents are scaled by the same factor.
                    let norm = dot(stored[key], stored[key]).sqrt();
                    let norm = if (norm - 1.0).abs() <= UNIT_TOLERANCE {
                        1.0
                    } else {
                        norm
                    };
                    [0, 2].map(|which| {
                        let tangent = tangent(key, which).map_or(DVec4::ZERO, DVec4::from_slice);
                        Quat::from_vec4((tangent / norm).as_vec4())
                    })
                });
                let tangents = tangents.collect();
                ChannelValues::Rotations(unit, tangents)
            }
            TargetPath::Translation | TargetPath::Scale => {
                let vector = |numbers: &[f64]| glam::DVec3::from_slice(numbers).as_vec3();
                let tangents = keys()
                    .filter(|_| is_cubic)
                    .map(|key| [0, 2].map(|which| tangent(key, which).map_or(Vec3::ZERO, vector)));
                let tangents = tangents.collect();
                ChannelValues::Vectors(keys().map(|key| vector(value(key, 1))).collect(), tangents)
            }
            TargetPath::Weights => {
                let values = keys().flat_map(|key| value(key, 1).iter().map(|&it| it as f32));
                let mut tangents = Vec::new();
                for key in keys().filter(|_| is_cubic) {
                    for side in [0, 2] {
                        match tangent(key, side) {
                            Some(slopes) => tangents.extend(slopes.iter().map(|&it| it as f32)),
                            None => tangents.extend(std::iter::repeat_n(0.0f32, width)),
                        }
                    }
                }
                ChannelValues::Weights(values.collect(), tangents)
            }
        };
        Ok(ChannelKeys { times, values })
    }
}

/// Two rotations whose dot product is within this of 0 differ by 180°, up to the rounding of f32.
const HALF_TURN_PRODUCT: f64 = 1.0 / (1u64 << 21) as f64;

/// Between neighbouring keys that differ by 180°, sets keep the signs of the keys. This makes the inner product of the
/// two keys positive or 0, because glTF defines the shorter arc by the sign of this product.
fn half_turns(keys: &mut [Quat], warnings: &mut Warnings, location: &dyn Fn(usize) -> Location) {
    for key in 1..keys.len() {
        let product = dot(keys[key - 1].as_dquat(), keys[key].as_dquat());
        if product.abs() > HALF_TURN_PRODUCT {
            continue;
        }
        warnings.warn(Code::HalfTurn, || {
            let message = format!("keys {} and {key} are half a turn apart", key - 1);
            (Some(location(key)), message)
        });
        if product < 0.0 {
            keys[key] = -keys[key];
        }
    }
}

impl ChannelKeys {
    /// The keys of a channel of a joint that will be left out.
    pub(super) fn at_rest() -> Self {
        Self {
            times: Vec::new(),
            values: ChannelValues::Vectors(Vec::new(), Vec::new()),
        }
    }

    /// Adds a track of these rotations.
    ///
    /// # Errors
    /// When a number is not finite.
    pub(super) fn push(&self, set: &mut TrackSet, name: &str) -> Result<(), TrackError> {
        let ChannelValues::Rotations(keys, tangents) = &self.values else {
            return Ok(());
        };
        let track = set.track_count();
        set.push(name, &self.times, keys)?;
        match tangents.is_empty() {
            true => Ok(()),
            false => set.set_tangents(track, tangents),
        }
    }

    /// Adds a scalar for each morph target; `name` gives their names.
    ///
    /// # Errors
    /// When a number is not finite, or too large.
    pub(super) fn push_weights(
        &self,
        motion: &mut Motion,
        (elements, interpolation): (usize, motion::ChannelInterpolation),
        name: impl Fn(usize) -> String,
    ) -> Result<(), TrackError> {
        let ChannelValues::Weights(values, tangents) = &self.values else {
            return Ok(());
        };
        let scalar = Scalar {
            interpolation: Some(interpolation),
            ..Scalar::default()
        };
        for target in 0..elements {
            let keys: Vec<f32> = values
                .iter()
                .skip(target)
                .step_by(elements)
                .copied()
                .collect();
            let slopes: Vec<f32> = tangents
                .iter()
                .skip(target)
                .step_by(elements)
                .copied()
                .collect();
            let slopes = slopes.as_chunks::<2>().0;
            motion.add_scalar(scalar, &name(target), &self.times, &keys, slopes)?;
        }
        Ok(())
    }

    /// Adds these translations or scales to the last track.
    ///
    /// # Errors
    /// When a number is not finite.
    pub(super) fn set(&self, set: &mut TrackSet, path: TargetPath) -> Result<(), TrackError> {
        let ChannelValues::Vectors(keys, tangents) = &self.values else {
            return Ok(());
        };
        let track = set.track_count() - 1;
        match path {
            TargetPath::Scale => set.set_scales(track, &self.times, keys, tangents),
            _ => set.set_translations(track, &self.times, keys, tangents),
        }
    }
}
