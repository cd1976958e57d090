//! The scalars of a clip: numbers over time in addition to its tracks, such as the angles of a robot's joints.

use std::f32::consts::PI;

use glam::Vec3;
use tumble::names::counted;
use tumble::{Channel, Error, ScalarKeys, TrackError, VectorMethod};

use crate::motion::sample::{ChannelMethods, Samples};
use crate::motion::{ChannelInterpolation, Motion};
use crate::times::clock_text;

/// The kind and the limits of a scalar of a clip; its name and its keys are in the clip's set.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Scalar {
    /// The quantity.
    pub kind: ScalarKind,
    /// The number to add to each key: whole turns of an angle that was unwrapped.
    pub origin: f64,
    /// The smallest and the largest value that the joint allows.
    pub limits: Option<[f64; 2]>,
    /// How its keys are joined; `None` if the file does not say it.
    pub interpolation: Option<ChannelInterpolation>,
}

/// The quantity of a scalar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ScalarKind {
    /// An angle in radians.
    Angle,
    /// A length in the clip's unit.
    Length,
    /// A number without a unit, or with one that is not known.
    #[default]
    Plain,
    /// Whether something touches something, 0 or 1.
    Contact,
}

tumble::names! {
    ScalarKind, "kind of scalar",
    Angle => "angle",
    Length => "length",
    Plain => "plain",
    Contact => "contact",
}

/// Between the name of a scalar and its kind in the names of columns.
const OF_COLUMN: &str = ".scalar_";

impl ScalarKind {
    /// The name of the column of a table with a scalar of this kind: `knee.scalar_angle`.
    pub(crate) fn column(self, name: &str) -> String {
        format!("{name}{OF_COLUMN}{}", self.name())
    }

    /// The name and the kind of the scalar that a column has, by the column's name.
    pub(crate) fn of_column(column: &str) -> Option<(&str, Self)> {
        let (name, kind) = column.rsplit_once(OF_COLUMN)?;
        Some((name, kind.parse().ok()?))
    }
}

/// Angles from this magnitude on, in radians, are stored in steps of 6e-5 rad or more.
pub(crate) const COARSE_ANGLE: f32 = 512.0;

impl Scalar {
    /// A scalar of a kind; contacts are steps.
    #[must_use]
    pub fn of(kind: ScalarKind) -> Self {
        let is_contact = kind == ScalarKind::Contact;
        Self {
            kind,
            interpolation: is_contact.then_some(ChannelInterpolation::Step),
            ..Self::default()
        }
    }

    fn is_step(self) -> bool {
        self.interpolation == Some(ChannelInterpolation::Step)
    }
}

impl Motion {
    /// The kind and the limits of a scalar of the set; the default if none are known.
    #[must_use]
    pub fn scalar(&self, index: usize) -> Scalar {
        self.scalars.get(index).copied().unwrap_or_default()
    }

    /// Adds a scalar.
    ///
    /// # Errors
    /// As [`TrackSet::push_scalar`](tumble::TrackSet::push_scalar).
    pub fn push_scalar(&mut self, scalar: Scalar, keys: ScalarKeys<'_>) -> Result<(), TrackError> {
        self.add_scalar(scalar, keys.name, keys.times, keys.keys, keys.tangents)
    }

    pub(crate) fn add_scalar(
        &mut self,
        scalar: Scalar,
        name: &str,
        times: &[f64],
        keys: &[f32],
        tangents: &[[f32; 2]],
    ) -> Result<(), TrackError> {
        let index = self.set.push_scalar(name, times, keys, tangents)?;
        self.scalars.resize(index, Scalar::default());
        self.scalars.push(scalar);
        Ok(())
    }

    /// Where an angle without limits first changes by more than half a turn between two keys, as wrapped angles do.
    pub(crate) fn angle_jump(&self) -> Option<String> {
        let angles = self.scalar_keys().enumerate().filter(|(index, _)| {
            let scalar = self.scalar(*index);
            scalar.kind == ScalarKind::Angle && scalar.limits.is_none()
        });
        let jumps = angles.filter_map(|(_, keys)| {
            let mut steps = keys.keys.windows(2);
            let key = steps.position(|pair| (pair[1] - pair[0]).abs() > PI)?;
            Some((keys, key))
        });
        let jumps: Vec<(ScalarKeys<'_>, usize)> = jumps.collect();
        let (keys, key) = jumps.first()?;
        let degrees = (keys.keys[key + 1] - keys.keys[*key]).to_degrees();
        let others = match jumps.len() {
            1 => String::new(),
            count => format!(" (and {})", counted(count - 1, "more joint")),
        };
        Some(format!(
            "`{}` changes by {degrees:.0}° between its keys at {} and {} s{others}; if it was wrapped to one turn, unwrap \
             it (--robot does it for hinges without limits, numpy.unwrap for others)",
            keys.name,
            clock_text(self.time_offset, keys.times[*key]),
            clock_text(self.time_offset, keys.times[key + 1])
        ))
    }

    /// The angle whose keys are furthest from 0, if f32 stores them in coarse steps: many turns of a wheel.
    pub(crate) fn coarse_angle(&self) -> Option<String> {
        let angles = self
            .scalar_keys()
            .enumerate()
            .filter(|(index, _)| self.scalar(*index).kind == ScalarKind::Angle);
        let largest = angles.map(|(index, keys)| {
            let magnitudes = keys.keys.iter().map(|key| key.abs());
            (magnitudes.fold(0.0, f32::max), index, keys.name)
        });
        let all: Vec<(f32, usize, &str)> =
            largest.filter(|angle| angle.0 >= COARSE_ANGLE).collect();
        let (largest, index, name) = all.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
        let side = match self.scalar(index).origin {
            0.0 => "",
            _ => " on each side of its middle",
        };
        let step = largest.next_up() - largest;
        let others = match all.len() {
            1 => String::new(),
            count => format!(" (and {})", counted(count - 1, "more joint")),
        };
        Some(format!(
            "`{name}`{others} reaches {largest:.0} rad{side}: keys are f32, whose steps are {step:.1e} rad there; shorter \
             files have finer steps"
        ))
    }

    /// The one method for all positions, scales and scalars that change, but for steps; `None` if their samplers
    /// differ. A robot whose root stands still is interpolated as its joints are.
    #[must_use]
    pub fn numbers_method(&self, methods: &ChannelMethods) -> Option<VectorMethod> {
        if let Some(method) = methods.method.0 {
            return Some(method.scalar_method());
        }
        let channels = [Channel::Translation, Channel::Scale];
        let tracks = 0..self.set.track_count();
        let mut vectors = tracks
            .flat_map(|track| channels.map(|channel| (track, channel)))
            .filter_map(|(track, channel)| self.set.vector_keys(channel, track));
        let is_moved = vectors.any(|keys| {
            !keys.tangents.is_empty() || keys.keys.iter().any(|key| *key != keys.keys[0])
        });
        let of_vectors = is_moved.then(|| methods.vector_method_of(self));
        let changing = self.scalar_keys().enumerate().filter(|(index, keys)| {
            let changes = keys.keys.iter().any(|key| *key != keys.keys[0]);
            (changes || !keys.tangents.is_empty()) && !self.scalar(*index).is_step()
        });
        let of_scalars = changing.map(|(index, _)| {
            Some(match self.scalar(index).interpolation {
                Some(ChannelInterpolation::Cubic) => VectorMethod::GltfCubic,
                Some(_) => VectorMethod::Linear,
                None => VectorMethod::BesselOverhauser,
            })
        });
        let mut all = of_vectors.into_iter().chain(of_scalars);
        let first = all.next().unwrap_or(Some(VectorMethod::BesselOverhauser));
        first.filter(|_| all.all(|method| method == first))
    }

    /// The keys of all scalars.
    pub fn scalar_keys(&self) -> impl Iterator<Item = ScalarKeys<'_>> {
        (0..self.set.scalar_count()).filter_map(|index| self.set.scalar(index))
    }

    /// The clip with the scalars of another clip; those that are lengths are multiplied by `scale`.
    ///
    /// # Errors
    /// When a key exceeds the largest number of a scalar.
    pub(crate) fn with_scalars_of(mut self, clip: &Self, scale: f64) -> Result<Self, TrackError> {
        for (index, keys) in clip.scalar_keys().enumerate() {
            let mut scalar = clip.scalar(index);
            if scalar.kind != ScalarKind::Length || scale == 1.0 {
                self.push_scalar(scalar, keys)?;
                continue;
            }
            let scaled = |number: f32| (f64::from(number) * scale) as f32;
            scalar.origin *= scale;
            scalar.limits = scalar
                .limits
                .map(|limits| limits.map(|limit| limit * scale));
            let numbers: Vec<f32> = keys.keys.iter().copied().map(scaled).collect();
            let tangents: Vec<[f32; 2]> = keys.tangents.iter().map(|two| two.map(scaled)).collect();
            self.add_scalar(scalar, keys.name, keys.times, &numbers, &tangents)?;
        }
        Ok(self)
    }

    /// The clip with samples as the keys of the scalars of another clip.
    ///
    /// # Errors
    /// When a sample is not a valid key.
    pub(crate) fn with_sampled_scalars_of(
        mut self,
        clip: &Self,
        samples: &Samples,
    ) -> Result<Self, TrackError> {
        let count = clip.set.scalar_count();
        for (index, keys) in clip.scalar_keys().enumerate() {
            let mut scalar = clip.scalar(index);
            if scalar.interpolation == Some(ChannelInterpolation::Cubic) {
                scalar.interpolation = Some(ChannelInterpolation::Linear);
            }
            let values = samples.scalars.iter().skip(index).step_by(count);
            let values: Vec<f32> = values.copied().collect();
            self.add_scalar(scalar, keys.name, &samples.times, &values, &[])?;
        }
        Ok(self)
    }
}

/// Smooths scalars, which are in the order `[sample][scalar]`; steps stay.
pub(crate) fn smoothed(
    clip: &Motion,
    scalars: &[f32],
    smooth: impl Fn(&[Vec3], usize) -> Result<Vec<Vec3>, Error>,
) -> Result<Vec<f32>, Error> {
    let count = clip.set.scalar_count();
    if count == 0 || scalars.is_empty() {
        return Ok(scalars.to_vec());
    }
    // Three scalars at a time are evaluated as the components of a vector; components do not influence each other.
    let packs = count.div_ceil(3);
    let packed: Vec<Vec3> = scalars
        .chunks_exact(count)
        .flat_map(|row| row.chunks(3))
        .map(|three| {
            let component = |index: usize| three.get(index).copied().unwrap_or(0.0);
            Vec3::new(component(0), component(1), component(2))
        })
        .collect();
    let found = smooth(&packed, packs)?;
    let mut all = scalars.to_vec();
    for (row, found) in all.chunks_exact_mut(count).zip(found.chunks_exact(packs)) {
        for (index, value) in row.iter_mut().enumerate() {
            if !clip.scalar(index).is_step() {
                *value = found[index / 3][index % 3];
            }
        }
    }
    Ok(all)
}
