//! An estimated path beside its reference: errors after an alignment, at the poses of the reference.

use clap::ValueEnum;
use serde::Serialize;
use tumble::{Engine, Frames, Interpolation, method};
use tumble_formats::motion::Motion;
use tumble_formats::printable::printable;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::trajectory::{Align, Alignment, Errors, Pose, Statistics, Step};
use tumble_formats::world::world;

use crate::messages::exit::{ALL_INPUTS, Failure};
use crate::messages::words;

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum AlignArgument {
    /// as they are
    None,
    /// move the second
    Position,
    /// move it, and turn it about z
    Yaw,
    /// move and turn it
    Se3,
    /// move, turn and scale it
    Sim3,
}

impl AlignArgument {
    fn align(self) -> Align {
        match self {
            Self::None => Align::None,
            Self::Position => Align::Position,
            Self::Yaw => Align::Yaw,
            Self::Se3 => Align::Se3,
            Self::Sim3 => Align::Sim3,
        }
    }
}

/// Reads `1s` or `0.5m`, for clap.
pub(crate) fn step(text: &str) -> Result<Step, String> {
    let fault = || "not a step over 0, such as 1s or 0.5m".to_owned();
    let (number, unit) = text.split_at(text.len() - text.chars().last().map_or(0, char::len_utf8));
    let number: f64 = number.trim().parse().map_err(|_| fault())?;
    if !(number.is_finite() && number > 0.0) {
        return Err(fault());
    }
    match unit {
        "s" => Ok(Step::Seconds(number)),
        "m" => Ok(Step::Metres(number)),
        _ => Err(fault()),
    }
}

/// What is asked for.
pub(crate) struct Measure {
    pub(crate) align: AlignArgument,
    pub(crate) absolute: bool,
    pub(crate) step: Option<Step>,
    /// Seconds between neighbouring keys of the second path beyond which it is not interpolated.
    pub(crate) max_gap: Option<f64>,
}

/// What two paths come to.
#[derive(Debug, Serialize)]
pub(crate) struct Compared {
    inputs: [String; 2],
    /// Poses of the first path that have one of the second.
    poses: usize,
    /// Those that are before or after the second, and those in its gaps.
    outside: usize,
    in_gaps: usize,
    /// First and last time, seconds.
    span: [f64; 2],
    alignment: Laid,
    pub(crate) ape: Option<Found>,
    rpe: Option<Found>,
}

/// What lays the second path over the first: scale, then rotation, then translation.
#[derive(Debug, Serialize)]
struct Laid {
    by: String,
    scale: f64,
    /// x y z w, and by how much it turns.
    rotation: [f64; 4],
    degrees: f64,
    translation: [f64; 3],
}

/// Errors of one kind.
#[derive(Debug, Serialize)]
pub(crate) struct Found {
    count: usize,
    /// Lengths, as in the files.
    pub(crate) translation: Numbers,
    /// Degrees.
    pub(crate) rotation: Numbers,
}

#[derive(Debug, Serialize)]
pub(crate) struct Numbers {
    rmse: f64,
    mean: f64,
    median: f64,
    std: f64,
    min: f64,
    pub(crate) max: f64,
}

impl Numbers {
    fn of(errors: &[f64], factor: f64) -> Option<Self> {
        let found = Statistics::of(errors)?;
        Some(Self {
            rmse: found.rmse * factor,
            mean: found.mean * factor,
            median: found.median * factor,
            std: found.deviation * factor,
            min: found.smallest * factor,
            max: found.largest * factor,
        })
    }
}

impl Found {
    fn of(errors: &Errors) -> Option<Self> {
        Some(Self {
            count: errors.distances.len(),
            translation: Numbers::of(&errors.distances, 1.0)?,
            rotation: Numbers::of(&errors.angles, 1f64.to_degrees())?,
        })
    }
}

/// Compares the one track of two clips.
pub(crate) fn compare(
    engine: &Engine,
    clips: [(&str, &Motion, usize); 2],
    measure: &Measure,
) -> Result<Compared, Failure> {
    let [
        (first_name, first, first_track),
        (second_name, second, second_track),
    ] = clips;
    let refuse = |message: String| {
        Failure::new(
            ALL_INPUTS,
            format!("{first_name} and {second_name}: {message}"),
        )
    };
    // Each clip counts from whole seconds of its own.
    let shift = (first.time_offset - second.time_offset) as f64;
    let keys = second.set.track(second_track).times;
    let (mut outside, mut in_gaps) = (0, 0);
    let mut times = Vec::new();
    for &time in first.set.track(first_track).times {
        let there = time + shift;
        let next = keys.partition_point(|&key| key < there);
        let is_key = keys.get(next) == Some(&there);
        if !is_key && (next == 0 || next == keys.len()) {
            outside += 1;
        } else if !is_key
            && measure
                .max_gap
                .is_some_and(|gap| keys[next] - keys[next - 1] > gap)
        {
            in_gaps += 1;
        } else {
            times.push(time);
        }
    }
    if times.is_empty() {
        return Err(refuse(
            "no pose of the first lies at a time of the second".to_owned(),
        ));
    }
    let lines = ChannelMethods {
        method: Some(method::SLERP),
        with: &|method| Interpolation::from(method),
    };
    let poses = |name: &str, clip: &Motion, track: usize, by: &ChannelMethods<'_>, shift: f64| {
        let frames = Frames::at(times.iter().map(|time| time + shift).collect::<Vec<_>>());
        let samples = by.sample(engine, clip, &frames);
        let samples = samples.map_err(|error| Failure::evaluating(name, &error))?;
        let poses = world(clip, &samples)
            .map_err(|error| Failure::new(ALL_INPUTS, format!("{name}: {error}")))?;
        let tracks = clip.set.track_count();
        let poses = poses.iter().skip(track).step_by(tracks).map(|pose| Pose {
            position: pose.position,
            rotation: pose.rotation.as_dquat().normalize(),
        });
        Ok(poses.collect::<Vec<_>>())
    };
    let reference = poses(
        first_name,
        first,
        first_track,
        &ChannelMethods::AUTHORED,
        0.0,
    )?;
    let estimate = poses(second_name, second, second_track, &lines, shift)?;
    let alignment = Alignment::of(&reference, &estimate, measure.align.align());
    let estimate: Vec<Pose> = estimate.iter().map(|&pose| alignment.apply(pose)).collect();
    let ape = (measure.absolute).then(|| Errors::absolute(&reference, &estimate));
    let rpe = measure
        .step
        .map(|step| Errors::relative(&reference, &estimate, &times, step));
    if rpe
        .as_ref()
        .is_some_and(|errors| errors.distances.is_empty())
    {
        return Err(refuse("--rpe is longer than the whole path".to_owned()));
    }
    let by = measure.align.to_possible_value();
    Ok(Compared {
        inputs: [first_name.to_owned(), second_name.to_owned()],
        poses: times.len(),
        outside,
        in_gaps,
        span: [times[0], times[times.len() - 1]].map(|time| time + first.time_offset as f64),
        alignment: Laid {
            by: by.map_or_else(String::new, |value| value.get_name().to_owned()),
            scale: alignment.scale,
            rotation: alignment.rotation.to_array(),
            degrees: alignment.angle().to_degrees(),
            translation: alignment.translation.to_array(),
        },
        ape: ape.as_ref().and_then(Found::of),
        rpe: rpe.as_ref().and_then(Found::of),
    })
}

impl Compared {
    /// Lines that say it.
    pub(crate) fn lines(&self) -> String {
        let [first, second] = self.inputs.each_ref().map(|name| printable(name));
        let mut text = format!(
            "{first} and {second}: {} from {} to {} s",
            words::count(self.poses, "pose"),
            self.span[0],
            self.span[1]
        );
        for (count, why) in [
            (self.outside, "outside the times of the second"),
            (self.in_gaps, "in its gaps"),
        ] {
            if count > 0 {
                text += &format!(", {count} {why}");
            }
        }
        let Laid {
            by,
            scale,
            degrees,
            translation: [x, y, z],
            ..
        } = &self.alignment;
        if by != "none" {
            text += &format!(
                "\n  aligned      by {by}: scale {scale:.6}, turned {degrees:.4}°, moved {x:.6} {y:.6} {z:.6}"
            );
        }
        for (what, found) in [("absolute", &self.ape), ("relative", &self.rpe)] {
            let Some(found) = found else { continue };
            for (of, unit, numbers) in [
                ("translation", "", &found.translation),
                ("rotation", "°", &found.rotation),
            ] {
                let Numbers {
                    rmse,
                    mean,
                    median,
                    std,
                    min,
                    max,
                } = numbers;
                text += &format!(
                    "\n  {what:<8} {of:<11} rmse {rmse:.6}{unit}, mean {mean:.6}{unit}, median {median:.6}{unit}, \
                     std {std:.6}{unit}, min {min:.6}{unit}, max {max:.6}{unit} ({})",
                    found.count
                );
            }
        }
        text.push('\n');
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_of_seconds_or_metres() {
        assert_eq!(step("1s"), Ok(Step::Seconds(1.0)));
        assert_eq!(step("0.5 m"), Ok(Step::Metres(0.5)));
        for bad in ["", "s", "1", "0m", "-1s", "infs", "1km", "1\u{e4}"] {
            assert!(step(bad).is_err(), "{bad}");
        }
    }
}
