//! Samples clips at the times of a call: poses, velocities, world positions, matrices.

use std::collections::BTreeMap;
use std::str::FromStr;

use glam::{Quat, Vec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::json;
use tumble::{
    Axes, Engine, FrameRate, InterpolationOption, InterpolationOptions, Layout, OptionValue,
    Quantity, SampleTimes, Sampler, UnknownNameError,
};
use tumble_formats::motion::Motion;
use tumble_formats::sample::{ChannelMethods, MethodChoice, Samples};
use tumble_formats::world::{world, world_matrices};

use crate::answer::{Answer, Array, Fault};

/// The header of a call for samples. Numbers of options come as text, because readers of JSON may round their last digit.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SampleCall {
    pub(crate) clip: usize,
    quantity: Sampled,
    /// The frame rate. If set, the call's numbers are the start and the end of the frames [s]; otherwise they are the times.
    rate: Option<String>,
    /// The name of the method. Default: `authored`, the interpolation that the file states for each channel.
    method: Option<String>,
    #[serde(default, deserialize_with = "option")]
    layout: Option<Layout>,
    #[serde(default, deserialize_with = "option")]
    axes: Option<Axes>,
    /// Values of options of the curve by the names of [`InterpolationOption`].
    #[serde(flatten)]
    options: BTreeMap<String, Option<String>>,
}

/// The quantity that is sampled.
#[derive(Deserialize, Clone, Copy, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Sampled {
    /// Rotations, translations and scales.
    Pose,
    /// Angular velocities.
    Velocities,
    /// Angular accelerations.
    Accelerations,
    /// Positions and rotations in the world.
    World,
    /// Matrices in the world.
    Matrices,
}

/// Parses the name of a layout or of axes.
fn option<'de, D: Deserializer<'de>, T: FromStr<Err = UnknownNameError>>(
    deserializer: D,
) -> Result<Option<T>, D::Error> {
    let name = Option::<String>::deserialize(deserializer)?;
    let parsed: Result<Option<T>, UnknownNameError> = name.map(|name| name.parse()).transpose();
    parsed.map_err(D::Error::custom)
}

impl SampleCall {
    fn method(&self) -> Result<MethodChoice, UnknownNameError> {
        let name = self.method.as_deref();
        name.map_or(Ok(MethodChoice::AUTHORED), str::parse)
    }

    fn options(&self) -> Result<InterpolationOptions, Fault> {
        let mut options = InterpolationOptions::default().with_quantity(self.quantity());
        for (name, value) in &self.options {
            let option = InterpolationOption::named(name)
                .ok_or_else(|| Fault::new(format!("there is no option `{name}`")))?;
            if let Some(value) = value {
                option.set(&mut options, OptionValue::Text(value))?;
            }
        }
        Ok(options)
    }

    fn methods(&self) -> Result<ChannelMethods, Fault> {
        Ok(ChannelMethods {
            method: self.method()?,
            options: self.options()?,
        })
    }

    fn frames(&self, numbers: &[f64]) -> Result<SampleTimes, Fault> {
        let Some(rate) = &self.rate else {
            return Ok(SampleTimes::at(numbers.to_vec()));
        };
        let rate: FrameRate = rate.parse()?;
        match *numbers {
            [start, end] => Ok(SampleTimes::rate(rate).between(start, end)),
            [] => Ok(SampleTimes::rate(rate)),
            _ => Err(Fault::new("frames have a start and an end")),
        }
    }

    fn quantity(&self) -> Quantity {
        let axes = self.axes.unwrap_or(Axes::Body);
        match self.quantity {
            Sampled::Velocities => Quantity::Velocity(axes),
            Sampled::Accelerations => Quantity::Acceleration(axes),
            _ => Quantity::Rotation,
        }
    }

    /// Reorders values from sample by sample to the layout of the call, which is track by track by default.
    fn ordered<T: Copy>(&self, values: Vec<T>, tracks: usize) -> Vec<T> {
        if self.layout == Some(Layout::FrameMajor) || tracks < 2 {
            return values;
        }
        let samples = values.len() / tracks;
        let of_track = |track: usize| (0..samples).map(move |sample| sample * tracks + track);
        (0..tracks)
            .flat_map(of_track)
            .map(|index| values[index])
            .collect()
    }
}

/// The largest memory per sample and track during a call, bytes: rotation, translation and scale, their results, and
/// the copy in the other layout.
const SAMPLE: f64 = 200.0;

/// Samples a clip at the times of a call.
pub(crate) fn sample(
    engine: &Engine,
    clip: &Motion,
    call: &SampleCall,
    numbers: &[u8],
) -> Result<Answer, Fault> {
    let (numbers, _) = numbers.as_chunks();
    let numbers: Vec<f64> = numbers.iter().copied().map(f64::from_le_bytes).collect();
    let tracks = clip.set.track_count();
    let frames = call.frames(&numbers)?;
    let timeline = frames.resolve(tracks, clip.set.time_span())?;
    let bytes = tracks as f64 * timeline.len() as f64 * SAMPLE;
    // WebAssembly has no query for free memory, so the memory is reserved on trial before anything is computed.
    let has_room = bytes < usize::MAX as f64 / 2.0
        && Vec::<u8>::new().try_reserve_exact(bytes as usize).is_ok();
    if !has_room {
        return Err(Fault::new(format!(
            "{} samples of {tracks} tracks take {:.0} MB, more memory than there is; ask for fewer at a time",
            timeline.len(),
            bytes / 1e6
        )));
    }
    let methods = call.methods()?;
    let samples = timeline.len();
    let mut arrays = match call.quantity {
        Sampled::Velocities | Sampled::Accelerations => {
            let layout = call.layout.unwrap_or(Layout::TrackMajor);
            let rates = methods.rates(engine, clip, &frames, layout)?;
            let rates: Vec<Vec3> = rates.iter().map(|rate| rate.truncate()).collect();
            vec![("values", Array::Vectors(rates))]
        }
        Sampled::Pose => pose(methods.sample(engine, clip, &frames)?, call, tracks),
        Sampled::World => {
            let poses = world(clip, &methods.sample(engine, clip, &frames)?)?;
            let poses = call.ordered(poses, tracks);
            let positions = poses.iter().flat_map(|pose| pose.position.to_array());
            let rotations: Vec<Quat> = poses.iter().map(|pose| pose.rotation).collect();
            vec![
                ("positions", Array::F64(positions.collect())),
                ("rotations", Array::Quats(rotations)),
            ]
        }
        Sampled::Matrices => {
            let matrices = world_matrices(clip, &methods.sample(engine, clip, &frames)?)?;
            let matrices = call.ordered(matrices, tracks);
            let columns = matrices.iter().flat_map(|matrix| {
                let [x, y, z] = matrix.matrix3.to_cols_array_2d();
                let at = matrix.translation;
                [
                    x[0], x[1], x[2], 0.0, y[0], y[1], y[2], 0.0, z[0], z[1], z[2], 0.0, at.x,
                    at.y, at.z, 1.0,
                ]
            });
            let columns = columns.map(|number| number as f32);
            vec![("matrices", Array::F32(columns.collect()))]
        }
    };
    if call.rate.is_some() {
        arrays.push(("times", Array::F64(timeline.times(0).collect())));
    }
    Ok(Answer::new(
        json!({"tracks": tracks, "samples": samples}),
        arrays,
    ))
}

/// Uploads a clip's rotations for the method of the call, and creates a sampler of them.
pub(crate) fn sampler(engine: &Engine, clip: &Motion, call: &SampleCall) -> Result<Sampler, Fault> {
    let interpolations = call.methods()?.interpolations(clip);
    Ok(engine.upload(&clip.set, interpolations)?.sampler()?)
}

fn pose(samples: Samples, call: &SampleCall, tracks: usize) -> Vec<(&'static str, Array)> {
    let rotations = call.ordered(samples.rotations, tracks);
    let mut arrays = vec![("rotations", Array::Quats(rotations))];
    for (name, vectors) in [
        ("translations", samples.translations),
        ("scales", samples.scales),
    ] {
        if !vectors.is_empty() {
            arrays.push((name, Array::Vectors(call.ordered(vectors, tracks))));
        }
    }
    arrays
}
