//! Trajectories in the format of the KITTI odometry benchmark: twelve numbers on each line, the rows of a rotation
//! matrix with a translation, `r11 r12 r13 tx r21 r22 r23 ty r31 r32 r33 tz`, and one line for each frame. The times
//! of the frames are in a separate file, in seconds, one on each line.

use std::fmt::Write as _;
use std::io::{self, BufRead, Write};
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use tumble::FrameRate;
use tumble::names::counted;

use crate::decimal::{Decimal, decimal_count};
use crate::diagnostic::{Code, Diagnostic};
use crate::feature::Feature;
use crate::format::{
    Format, FormatOption, Loaded, MotionOptions, ReadOptions, TimeUnit, WriteError,
};
use crate::limits::Limits;
use crate::motion::SampledClip;
use crate::rotation_matrix::of_matrix;
use crate::source::Source;
use crate::text::lines::{Lines, tokens};
use crate::text::number;
use crate::times::FrameTimes;
use crate::tum::{Trajectory, TrajectoryPoses};

/// The KITTI format: the path of one body, without times.
pub static FORMAT: Format = Format {
    name: "kitti",
    summary: "a trajectory, a matrix on each line; times are in another file",
    extensions: &[],
    probe: |_| false,
    numbers_in_line: Some(12),
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: true,
    read: open_kitti,
    read_bytes: |name, bytes, options| read_kitti(name, &bytes[..], options),
    write: None,
    write_motion: Some(write_motion),
    features: &[Feature::Translations, Feature::Curves],
    options: &[
        FormatOption::SourceRate,
        FormatOption::TimesApart,
        FormatOption::RawTimes,
        FormatOption::Duplicates,
    ],
};

/// Reads the times of frames, in seconds, one on each line; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_frame_times(path: &Path, limits: Limits) -> Result<FrameTimes, Diagnostic> {
    Source::read_by(path, true, |name, reader| {
        read_frame_times(name, reader, limits)
    })
}

/// Reads the times of frames, in seconds; `name` is the input's name in messages.
///
/// # Errors
/// When the input is invalid or contains no time; the first error is returned.
pub fn read_frame_times(
    name: &str,
    reader: impl BufRead,
    limits: Limits,
) -> Result<FrameTimes, Diagnostic> {
    let mut lines = Lines::with_names(name, reader, limits)?;
    let mut found = FrameTimes {
        times: Vec::new(),
        decimals: 0,
        warnings: Vec::new(),
    };
    let mut unit = None;
    while let Some(line) = lines.next()? {
        let text = line.split('#').next().unwrap_or_default().replace(',', " ");
        for (column, token) in tokens(&text) {
            let read = number::parse(token);
            let read = read.map_err(|(code, message)| lines.refuse(column, code, message))?;
            if found.times.is_empty() {
                unit = TimeUnit::or_of_first(None, read.value, |unit| {
                    lines.warn(column, Code::TimeUnit, unit.assumed(token));
                });
            }
            let power = unit.map_or(0, TimeUnit::power);
            let Some(time) = Decimal::parse_in(token, power) else {
                let message = format!("the time {token} is out of range");
                return Err(lines.refuse(column, Code::TumTime, message));
            };
            found.decimals = found.decimals.max(decimal_count(token, power));
            found.times.push(time);
        }
        lines.reuse(line);
    }
    if found.times.is_empty() {
        let message = "no times; write the seconds of each frame, one a line".to_owned();
        return Err(lines.refuse_end(Code::Time, message));
    }
    found.warnings = lines.warnings;
    Ok(found)
}

fn open_kitti(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    Source::read_by(path, options.pipes, |name, reader| {
        read_kitti(name, reader, options)
    })
}

/// Reads poses, one for each line. Their times are the options' `frame_times`; without these, poses are frames of the
/// options' `source_rate`. The only track is named `body`.
///
/// # Errors
/// When the input is invalid, when the options contain neither times nor a rate, or when the number of times is not
/// that of the poses; the first error is returned.
pub fn read_kitti(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    let mut lines = Lines::with_names(name, reader, options.limits)?;
    if options.source_rate.is_none() && options.frame_times.is_none() {
        let message = "KITTI's poses have no times; give their rate with --source-fps, or a file of times with \
                       --source-times";
        return Err(Diagnostic::new(name, Code::NoRate, message));
    }
    let mut poses = TrajectoryPoses::default();
    let mut columns = None;
    while let Some(line) = lines.next()? {
        let text = line.split('#').next().unwrap_or_default().replace(',', " ");
        if !text.trim().is_empty() {
            let [a, b, c] = read_rows(&mut lines, &text, &mut columns)?;
            let rotation = of_matrix([a, b, c].map(|[x, y, z, _]| [x, y, z]));
            let Some(rotation) = rotation else {
                let message = "the first three columns of the matrix are not a rotation".to_owned();
                return Err(lines.refuse(1, Code::NoRotation, message));
            };
            // A matrix does not determine the sign of the quaternion, so the sign of the pose before is continued.
            let last = poses.rotations.last();
            let is_negated = last.is_some_and(|last: &DQuat| last.dot(rotation) < 0.0);
            poses
                .rotations
                .push(if is_negated { -rotation } else { rotation });
            poses.positions.push(DVec3::new(a[3], b[3], c[3]));
            poses.lines.push(lines.number);
        }
        lines.reuse(line);
    }
    let count = poses.rotations.len();
    if count == 0 {
        let message = "no poses; a line is the three rows of a matrix".to_owned();
        return Err(lines.refuse_end(Code::TumEmpty, message));
    }
    match (&options.frame_times, options.source_rate) {
        (Some(found), _) => {
            if found.times.len() != count {
                let message = format!(
                    "the file has {}, and the file of times has {}; does it belong to another sequence?",
                    counted(count, "pose"),
                    counted(found.times.len(), "time")
                );
                return Err(Diagnostic::new(name, Code::FrameTimes, message));
            }
            poses.times.clone_from(&found.times);
            poses.decimals = found.decimals;
            let warnings = [&*found.warnings, &*lines.warnings].concat();
            poses.into_clip(name, warnings, options)
        }
        (None, Some(rate)) => {
            let times = (0..count as u64).map(|frame| rate.time_of(frame)).collect();
            let mut loaded = poses.at(name, 0, times, lines.warnings, options)?;
            loaded.clips[0].rate = Some(rate);
            Ok(loaded)
        }
        (None, None) => unreachable!("refused above"),
    }
}

/// The numbers of a line: the rows of a matrix.
const NUMBERS: usize = 12;

/// The fourth row of a matrix, which is constant.
const FOURTH_ROW: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Reads a line. `columns` is the number of numbers on the lines before it.
fn read_rows<R: BufRead>(
    lines: &mut Lines<R>,
    line: &str,
    columns: &mut Option<usize>,
) -> Result<[[f64; 4]; 3], Diagnostic> {
    let found = tokens(line).count();
    let expected = columns.unwrap_or(found.max(NUMBERS));
    if found != expected {
        let at = |index: usize| tokens(line).nth(index).map(|(at, _)| at);
        let column = at(expected).unwrap_or(line.trim_end().len() as u64 + 1);
        let after = match expected {
            NUMBERS => "",
            _ => ", and those after the first pose",
        };
        let numbers = counted(found, "number");
        let message =
            format!("{numbers} where {expected} are expected: three rows of a matrix{after}");
        return Err(lines.refuse(column, Code::KittiPose, message));
    }
    let mut rows = [[0.0; 4]; 3];
    let mut after = Vec::new();
    for (index, (column, token)) in tokens(line).enumerate() {
        // Further numbers are allowed to be anything. They are parsed because they may be a fourth row.
        let read = match number::parse(token) {
            Ok(read) => read.value,
            Err(_) if index >= NUMBERS => f64::NAN,
            Err((code, message)) => return Err(lines.refuse(column, code, message)),
        };
        match rows.as_flattened_mut().get_mut(index) {
            Some(number) => *number = read,
            None => after.push(read),
        }
    }
    if columns.is_none() {
        *columns = Some(found);
    }
    let is_known = lines
        .warnings
        .iter()
        .any(|warning| warning.code == Code::FurtherNumbers);
    if !is_known && !after.is_empty() && after != FOURTH_ROW {
        let column = tokens(line).nth(NUMBERS).map_or(1, |(at, _)| at);
        let further = counted(after.len(), "number");
        let message = format!("left out: {further} after each pose");
        lines.warn(column, Code::FurtherNumbers, message);
    }
    Ok(rows)
}

/// The largest distance of a time from its frame, in frames.
const OFF_FRAME: f64 = 0.01;

/// Decimals of a matrix' numbers: read back, they are the same rotation in f32.
const DECIMALS: usize = 12;

/// Writes the poses of one clip of one track. Their times go to a separate file ([`write_frame_times`]) if there is
/// one. Otherwise they must be frames of a rate, which a warning contains.
fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let path = Trajectory::of(clips, options)?;
    let mut warnings = Vec::new();
    if !options.times_apart {
        let times = path.sampled.times;
        let is_frame = |rate: FrameRate, (frame, &time): (usize, &f64)| {
            ((time - times[0]) * rate.per_second() - frame as f64).abs() < OFF_FRAME
        };
        let are_frames =
            |&rate: &FrameRate| times.iter().enumerate().all(|frame| is_frame(rate, frame));
        let Some(rate) = path.sampled.rate.filter(are_frames) else {
            let message = "its times are not frames of one rate, and KITTI stores no times; write them to a separate \
                           file with --times-out";
            return Err(path.refuse(message.to_owned()));
        };
        let first = path.sampled.time_digits(0).unwrap_or_default();
        let message = format!(
            "KITTI stores no times; left out: the poses are at {rate} fps, from {first} s on (--times-out writes the \
             times)"
        );
        warnings.push(Diagnostic::new(&options.name, Code::NoRoom, message));
    }
    let mut text = String::new();
    for sample in 0..path.sampled.times.len() {
        let (rotation, position) = path.pose(sample)?;
        let rows = DMat3::from_quat(rotation.as_dquat().normalize()).transpose();
        let each = rows.to_cols_array_2d().into_iter().zip(position);
        for (row, (numbers, position)) in each.enumerate() {
            let blank = if row == 0 { "" } else { " " };
            let [a, b, c] = numbers.map(decimals);
            let _ = write!(text, "{blank}{a} {b} {c} {position}"); // memory takes everything
        }
        text.push('\n');
        out.write_all(text.as_bytes())?;
        text.clear();
    }
    warnings.extend(path.no_positions());
    Ok(warnings)
}

/// A number of a matrix as text, without trailing zeros.
fn decimals(number: f64) -> String {
    let text = format!("{number:.DECIMALS$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.to_owned()
}

/// Writes the times of a clip's samples, in seconds, one on each line.
///
/// # Errors
/// When writing fails, or (`InvalidInput`) when a time is out of range.
pub fn write_frame_times(sampled: &SampledClip<'_>, out: &mut dyn Write) -> io::Result<()> {
    for sample in 0..sampled.times.len() {
        let Some(digits) = sampled.time_digits(sample) else {
            let message = format!("the time {} s is out of range", sampled.times[sample]);
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        };
        writeln!(out, "{digits}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec3;

    use super::*;
    use crate::motion::Motion;
    use crate::motion::keyed::keyed;

    #[test]
    fn rows_of_matrices_are_poses_at_a_rate() {
        let text = "1 0 0 1.5 0 1 0 -2 0 0 1 3\n0 -1 0 2 1 0 0 0 0 0 1 0\n";
        let options = ReadOptions {
            source_rate: tumble::FrameRate::new(10, 1).ok(),
            ..ReadOptions::default()
        };
        let clip = &read_kitti("k.txt", text.as_bytes(), &options)
            .unwrap()
            .clips[0];
        let track = clip.set.track(0);
        assert_eq!(track.times, [0.0, 0.1]);
        let quarter = glam::Quat::from_rotation_z(std::f32::consts::FRAC_PI_2);
        assert!(track.keys[1].dot(quarter).abs() > 1.0 - 1e-6);
        let moved = clip
            .set
            .vector_keys(tumble::Channel::Translation, 0)
            .unwrap();
        assert_eq!(moved.keys, [Vec3::new(1.5, -2.0, 3.0), Vec3::X * 2.0]);
        let refused = |text: &str, options: &ReadOptions| {
            read_kitti("k.txt", text.as_bytes(), options)
                .unwrap_err()
                .code
        };
        assert_eq!(refused(text, &ReadOptions::default()), Code::NoRate);
        assert_eq!(refused("1 0 0 0\n", &options), Code::KittiPose);
        assert_eq!(
            refused(
                "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0 0\n",
                &options
            ),
            Code::KittiPose
        );
        // A frame number before the matrix, as in KITTI-360. If it is read as part of the matrix, this is not a
        // rotation.
        assert_eq!(
            refused("7 1 0 0 1.5 0 1 0 -2 0 0 1 3\n", &options),
            Code::NoRotation
        );
        let mirrored = "1 0 0 0 0 1 0 0 0 0 -1 0\n";
        assert_eq!(refused(mirrored, &options), Code::NoRotation);
        assert_eq!(refused("\n", &options), Code::TumEmpty);
    }

    /// A fourth row is skipped; other numbers after the matrix are left out with one warning.
    #[test]
    fn numbers_after_a_matrix_are_a_fourth_row_or_named() {
        let options = ReadOptions {
            source_rate: tumble::FrameRate::new(10, 1).ok(),
            ..ReadOptions::default()
        };
        let read = |after: &str| {
            let text =
                format!("1 0 0 1.5 0 1 0 -2 0 0 1 3{after}\n0 -1 0 2 1 0 0 0 0 0 1 0{after}\n");
            read_kitti("k.txt", text.as_bytes(), &options).unwrap()
        };
        let plain = read("");
        assert_eq!(plain.warnings, []);
        for (after, warned) in [
            (" 0 0 0 1", None),
            (" 0 0 0 1.0", None),
            (" 0.25 ok", Some("2 numbers")),
        ] {
            let found = read(after);
            assert_eq!(
                found.clips[0].set.track(0).keys,
                plain.clips[0].set.track(0).keys
            );
            let messages: Vec<_> = found
                .warnings
                .iter()
                .map(|warning| (warning.code, &*warning.message))
                .collect();
            let expected = warned.map(|count| format!("left out: {count} after each pose"));
            let expected: Vec<_> = expected
                .iter()
                .map(|message| (Code::FurtherNumbers, &**message))
                .collect();
            assert_eq!(messages, expected, "{after}");
        }
    }

    fn write(
        clip: &Motion,
        options: &MotionOptions,
    ) -> Result<(String, Vec<Diagnostic>), WriteError> {
        let samples = keyed(clip).unwrap();
        let mut out = Vec::new();
        let sampled = [samples.of(clip, clip.rate, &[])];
        let warnings = FORMAT.write_clips(&sampled, options, &mut out)?;
        let mut times = Vec::new();
        write_frame_times(&sampled[0], &mut times).unwrap();
        out.extend(times);
        Ok((String::from_utf8(out).unwrap(), warnings))
    }

    /// Times of their own, which lie on no frames, and seconds since 1970 among them.
    #[test]
    fn poses_have_the_times_of_a_file() {
        let poses = "1 0 0 1.5 0 1 0 -2 0 0 1 3\n0 -1 0 2 1 0 0 0 0 0 1 0\n0.8 -0.6 0 0 0.6 0.8 0 0 0 0 1 0\n";
        let times = "1.305031098665900000e+09\n1305031098.7\n1305031099.25\n";
        let read = |poses: &str, times: &str| {
            let times = read_frame_times("times.txt", times.as_bytes(), Limits::default())?;
            let options = ReadOptions {
                frame_times: Some(Arc::new(times)),
                ..ReadOptions::default()
            };
            read_kitti("k.txt", poses.as_bytes(), &options)
        };
        let clip = &read(poses, times).unwrap().clips[0];
        assert_eq!(clip.time_offset, 1_305_031_098);
        assert_eq!(clip.set.track(0).times, [0.6659, 0.7, 1.25]);
        let apart = MotionOptions {
            times_apart: true,
            ..MotionOptions::default()
        };
        let (text, warnings) = write(clip, &apart).unwrap();
        assert_eq!(warnings, []);
        let (matrices, seconds) = text.split_at(text.find("1305").unwrap());
        assert_eq!(
            seconds,
            "1305031098.665900000\n1305031098.700000000\n1305031099.250000000\n"
        );
        let again = &read(matrices, seconds).unwrap().clips[0];
        assert_eq!(again.set.track(0).times, clip.set.track(0).times);
        assert_eq!(again.set.track(0).keys, clip.set.track(0).keys);
        // Without a file of times, poses at uneven times cannot be read again.
        let refused = write(clip, &MotionOptions::default());
        assert!(matches!(refused, Err(WriteError::Refused(fault)) if fault.code == Code::TumWrite));
        let code = |poses: &str, times: &str| read(poses, times).unwrap_err().code;
        assert_eq!(code(poses, "0\n1\n"), Code::FrameTimes);
        assert_eq!(code(poses, "0\n1\n1\n"), Code::EqualTimes);
        assert_eq!(code(poses, "0\n2\n1\n"), Code::TimeNotIncreasing);
        assert_eq!(code(poses, "0\nx\n1\n"), Code::Number);
        assert_eq!(code(poses, "0\n1e15\n1\n"), Code::TumTime);
        assert_eq!(code(poses, "# none\n"), Code::Time);
    }

    #[test]
    fn a_rate_is_said_where_times_are_not_written() {
        let options = ReadOptions {
            source_rate: tumble::FrameRate::new(10, 1).ok(),
            ..ReadOptions::default()
        };
        let text = "1 0 0 1.5 0 1 0 -2 0 0 1 3\n0 -1 0 2 1 0 0 0 0 0 1 0\n";
        let clip = &read_kitti("k.txt", text.as_bytes(), &options)
            .unwrap()
            .clips[0];
        let (written, warnings) = write(clip, &MotionOptions::default()).unwrap();
        assert_eq!(written, format!("{text}0\n0.1\n"));
        assert_eq!(warnings[0].code, Code::NoRoom);
        assert!(warnings[0].message.contains("10 fps, from 0 s"));
    }
}
