//! Trajectories in the format of the TUM RGB-D benchmark: `t x y z qx qy qz qw` on each line, separated by blanks or
//! commas, with `#` comments. Times are often seconds since 1970.

use std::fmt::Write as _;
use std::io::{BufRead, Write};
use std::path::Path;

use glam::{DQuat, DVec3, Quat};
use tumble::names::counted;
use tumble::{TrackError, TrackSet};

use crate::decimal::{Decimal, decimal_count, offset_of};
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::feature::Feature;
use crate::format::{
    Format, FormatOption, Loaded, MotionOptions, ReadOptions, TimeUnit, WriteError, not_one_clip,
};
use crate::motion::grid::restore;
use crate::motion::keys::{Origin, select};
use crate::motion::{Joint, Motion, SampledClip, Transform};
use crate::names::TRAJECTORY_TRACK;
use crate::printable::printable;
use crate::quaternion::ComponentOrder;
use crate::rate::Precision;
use crate::source::Source;
use crate::text::lines::{Lines, tokens};
use crate::text::number;
use crate::warnings::Warnings;

/// The pose on a line of a trajectory.
pub(crate) struct PoseLine {
    /// The numbers of a line, for messages.
    pub(crate) numbers: &'static str,
    /// Whether w is the first component of the quaternion.
    pub(crate) is_w_first: bool,
    /// The unit of the times, if the format defines it.
    pub(crate) unit: Option<TimeUnit>,
}

const LINE: PoseLine = PoseLine {
    numbers: "t x y z qx qy qz qw",
    is_w_first: false,
    unit: None,
};

/// The TUM format: the path of one body.
pub static FORMAT: Format = Format {
    name: "tum",
    summary: "a trajectory, `t x y z qx qy qz qw` on each line",
    extensions: &[],
    // The headings of the benchmark itself and of its tools; many files have none.
    probe: |start| {
        let line = start
            .split(|&byte| byte == b'\n')
            .next()
            .unwrap_or_default();
        let has = |words: &[u8]| line.windows(words.len()).any(|part| part == words);
        line.starts_with(b"#") && (has(b"ground truth trajectory") || has(b"tx ty tz"))
    },
    numbers_in_line: Some(8),
    is_text: true,
    numbers_repeated_names: false,
    guesses_time_unit: true,
    read: open_tum,
    read_bytes: |name, bytes, options| read_tum(name, &bytes[..], options),
    write: None,
    write_motion: Some(write_motion),
    features: &[
        Feature::Quaternions,
        Feature::Translations,
        Feature::Curves,
        Feature::UnevenTimes,
        Feature::Start,
        Feature::Nanoseconds,
    ],
    options: &[
        FormatOption::RawTimes,
        FormatOption::Duplicates,
        FormatOption::TimeUnit,
        FormatOption::BridgeGaps,
        FormatOption::SourceOrder,
    ],
};

/// Reads a TUM file; `-` is standard input.
///
/// # Errors
/// When the file cannot be opened or is invalid; the first error is returned.
pub fn open_tum(path: &Path, options: &ReadOptions) -> Result<Loaded, Diagnostic> {
    Source::read_by(path, options.pipes, |name, reader| {
        read_tum(name, reader, options)
    })
}

/// Reads poses; `name` is the input's name in messages. The only track is named `body`. Times from a million
/// seconds on, such as times since 1970, count from the whole second at or before the first time, which is the clip's
/// [`time_offset`](Motion::time_offset).
///
/// # Errors
/// When the input is invalid; the first error is returned.
pub fn read_tum(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
) -> Result<Loaded, Diagnostic> {
    read_lines(name, reader, options, &LINE)
}

/// Reads poses, one on each line.
pub(crate) fn read_lines(
    name: &str,
    reader: impl BufRead,
    options: &ReadOptions,
    format: &PoseLine,
) -> Result<Loaded, Diagnostic> {
    let mut lines = Lines::with_names(name, reader, options.limits)?;
    let mut poses = TrajectoryPoses {
        unit: options.time_unit.or(format.unit),
        is_w_first: match options.source_order {
            Some(order) => order == ComponentOrder::Wxyz,
            None => format.is_w_first,
        },
        bridges_gaps: options.bridge_gaps,
        ..TrajectoryPoses::default()
    };
    while let Some(line) = lines.next()? {
        let numbers = line.split('#').next().unwrap_or_default();
        if !numbers.trim().is_empty() {
            poses.read(&mut lines, numbers, &numbers.replace(',', " "), format)?;
        }
        lines.reuse(line);
    }
    if poses.times.is_empty() {
        let message = format!("no poses; a line is `{}`", format.numbers);
        return Err(lines.refuse_end(Code::TumEmpty, message));
    }
    poses.leave_out_gaps(&mut lines)?;
    poses.into_clip(name, lines.warnings, options)
}

/// The poses of a body in a file.
#[derive(Default)]
pub(crate) struct TrajectoryPoses {
    pub(crate) times: Vec<Decimal>,
    /// The largest number of decimals of a time in seconds.
    pub(crate) decimals: u32,
    /// How many numbers the first line has; 0 before it is read.
    columns: usize,
    /// The unit of the times.
    unit: Option<TimeUnit>,
    /// Whether w is the first component of quaternions.
    is_w_first: bool,
    /// Whether poses with numbers that are NaN are left out.
    bridges_gaps: bool,
    pub(crate) positions: Vec<DVec3>,
    pub(crate) rotations: Vec<DQuat>,
    /// The line of each pose.
    pub(crate) lines: Vec<u64>,
}

impl TrajectoryPoses {
    /// Reads `line`; `original` is the same line with its commas.
    fn read<R: BufRead>(
        &mut self,
        lines: &mut Lines<R>,
        original: &str,
        line: &str,
        format: &PoseLine,
    ) -> Result<(), Diagnostic> {
        let found = tokens(line).count();
        if self.columns == 0 && found > 8 && !has_decimal_commas(original) {
            let further = counted(found - 8, "number");
            let message = format!("left out: {further} after each pose");
            lines.warn(
                tokens(line).nth(8).map_or(1, |(at, _)| at),
                Code::FurtherNumbers,
                message,
            );
            self.columns = found;
        }
        let columns = self.columns.max(8);
        if found != columns {
            let column = tokens(line)
                .nth(columns)
                .map_or(line.trim_end().len() as u64 + 1, |(at, _)| at);
            let more = if columns > 8 {
                " and those after the first pose"
            } else {
                ""
            };
            let message = format!(
                "{} where {columns} are expected: {}{more}",
                counted(found, "number"),
                format.numbers
            );
            return Err(lines.refuse(column, Code::TumPose, message));
        }
        let mut numbers = [0.0; 8];
        for (index, (column, token)) in tokens(line).enumerate().take(numbers.len()) {
            if index > 0 && self.bridges_gaps && number::is_nan(token) {
                numbers[index] = f64::NAN;
                continue;
            }
            let read = number::parse(token).map_err(|(code, message)| {
                let remedy = match code {
                    Code::NotFinite if index > 0 => ", or leave the pose out with --bridge-gaps",
                    _ => "",
                };
                lines.refuse(column, code, message + remedy)
            })?;
            if read.vanished {
                let message = format!("`{token}` is too small for f32; it becomes 0");
                lines.warn(column, Code::Tiny, message);
            }
            numbers[index] = read.value;
        }
        let (column, token) = tokens(line).next().unwrap_or((1, ""));
        if self.times.is_empty() {
            self.unit = TimeUnit::or_of_first(self.unit, numbers[0], |unit| {
                lines.warn(column, Code::TimeUnit, unit.assumed(token));
            });
        }
        let power = self.unit.map_or(0, TimeUnit::power);
        let Some(time) = Decimal::parse_in(token, power) else {
            let message = format!(
                "the time {token} is out of range; --time-unit ms, us or ns states another unit than seconds"
            );
            return Err(lines.refuse(column, Code::TumTime, message));
        };
        self.decimals = self.decimals.max(decimal_count(token, power));
        if self.is_w_first {
            numbers[4..].rotate_left(1);
        }
        let [_, x, y, z, qx, qy, qz, qw] = numbers;
        self.columns = columns;
        self.times.push(time);
        self.positions.push(DVec3::new(x, y, z));
        self.rotations.push(DQuat::from_xyzw(qx, qy, qz, qw));
        self.lines.push(lines.number);
        Ok(())
    }

    /// Removes the poses that have a number that is NaN.
    fn leave_out_gaps<R: BufRead>(&mut self, lines: &mut Lines<R>) -> Result<(), Diagnostic> {
        let is_gap =
            |pose: &usize| self.positions[*pose].is_nan() || self.rotations[*pose].is_nan();
        let (gaps, kept): (Vec<usize>, Vec<usize>) = (0..self.times.len()).partition(is_gap);
        let Some(&first) = gaps.first() else {
            return Ok(());
        };
        if kept.is_empty() {
            let message = "no pose is without a gap".to_owned();
            return Err(lines.refuse_end(Code::NotFinite, message));
        }
        let mut warnings = Warnings::new(lines.file());
        warnings.warn_of(gaps.len(), Code::Bridged, || {
            let location = Location::Text {
                line: self.lines[first],
                column: 1,
            };
            let poses = counted(gaps.len(), "pose");
            let message =
                format!("{poses} with missing numbers; the path is interpolated from the others");
            (Some(location), message)
        });
        lines.warnings.append(&mut warnings.into_list());
        select(&mut self.times, Some(&kept));
        select(&mut self.positions, Some(&kept));
        select(&mut self.rotations, Some(&kept));
        select(&mut self.lines, Some(&kept));
        Ok(())
    }

    /// The clip. Times since 1970 count from the whole second at or before the first.
    pub(crate) fn into_clip(
        self,
        name: &str,
        of_lines: Vec<Diagnostic>,
        options: &ReadOptions,
    ) -> Result<Loaded, Diagnostic> {
        let offset = offset_of(self.times[0].whole_seconds());
        let mut times = [self.times.iter().map(|time| time.since(offset)).collect()];
        let rate = match options.raw_times {
            true => None,
            false => restore(&mut times, Precision::Decimals(self.decimals)),
        };
        let [times] = times;
        let mut loaded = self.at(name, offset, times, of_lines, options)?;
        loaded.clips[0].rate = rate;
        Ok(loaded)
    }

    /// The clip with poses at these times, in seconds after the whole second `offset`.
    pub(crate) fn at(
        self,
        name: &str,
        offset: i64,
        mut times: Vec<f64>,
        of_lines: Vec<Diagnostic>,
        options: &ReadOptions,
    ) -> Result<Loaded, Diagnostic> {
        let location = |key: usize| Location::Text {
            line: self.lines[key],
            column: 1,
        };
        let origin = Origin {
            file: name,
            location: &location,
            duplicates: options.duplicates,
        };
        let mut warnings = Warnings::new(name);
        let mut positions = self.positions;
        let mut keys = origin.unit(self.rotations, &mut warnings)?;
        let equal = |i: usize, j: usize| keys[i] == keys[j] && positions[i] == positions[j];
        let from_offset = |mut said: Diagnostic| {
            let of_times = [Code::EqualKeys, Code::EqualTimes, Code::TimeNotIncreasing];
            if offset != 0 && of_times.contains(&said.code) {
                said.message += &format!(" (times are counted from second {offset})");
            }
            said
        };
        let kept = origin.increasing(&mut times, equal, &mut warnings);
        let kept = kept.map_err(from_offset)?;
        select(&mut times, kept.as_deref());
        select(&mut positions, kept.as_deref());
        select(&mut keys, kept.as_deref());
        let mut set = TrackSet::new();
        // The keys were checked above; this reports an error that the checks missed.
        let refuse = |error: TrackError| Diagnostic::new(name, Code::TumPose, error.to_string());
        set.push(TRAJECTORY_TRACK, &times, &keys).map_err(refuse)?;
        let mut clip = Motion {
            set,
            skeleton: vec![Joint {
                parent: None,
                rest: Transform::default(),
            }],
            time_offset: offset,
            ..Motion::default()
        };
        clip.set_positions(0, &times, &positions).map_err(refuse)?;
        let warnings = of_lines
            .into_iter()
            .chain(warnings.into_list().into_iter().map(from_offset));
        Ok(Loaded::of(clip, warnings.collect()))
    }
}

/// Whether commas seem to be decimal commas: there are commas within numbers that blanks separate.
fn has_decimal_commas(line: &str) -> bool {
    let mut words = line.split_whitespace();
    line.split_whitespace().count() > 1 && words.any(|word| word.trim_matches(',').contains(','))
}

/// The first track without a parent: its name, or its index if it has none.
fn root_name(clip: &Motion) -> String {
    let mut joints = clip.skeleton.iter();
    let root = joints.position(|joint| joint.parent.is_none()).unwrap_or(0);
    let name = clip.set.get(root).and_then(|track| track.name);
    name.filter(|name| !name.is_empty())
        .map_or_else(|| root.to_string(), |name| printable(name).into_owned())
}

/// The samples of the only track of the only clip, to be written as a trajectory.
pub(crate) struct Trajectory<'a> {
    pub(crate) sampled: &'a SampledClip<'a>,
    options: &'a MotionOptions,
}

impl<'a> Trajectory<'a> {
    /// # Errors
    /// When there is not exactly one clip of one track, or when the lengths of lists do not fit.
    pub(crate) fn of(
        clips: &'a [SampledClip<'a>],
        options: &'a MotionOptions,
    ) -> Result<Self, WriteError> {
        let refuse = |message: String| Diagnostic::new(&options.name, Code::TumWrite, message);
        let [sampled] = clips else {
            return Err(refuse(not_one_clip(clips.len(), "a trajectory")).into());
        };
        match sampled.clip.set.track_count() {
            1 => {}
            0 => return Err(refuse("no tracks; a trajectory has one".to_owned()).into()),
            tracks => {
                let message = format!(
                    "{tracks} tracks; a trajectory has one: choose one without a parent, such as --tracks {} (in Python, \
                     by Clip.select)",
                    root_name(sampled.clip)
                );
                return Err(refuse(message).into());
            }
        }
        sampled.checked_len()?;
        Ok(Self { sampled, options })
    }

    pub(crate) fn refuse(&self, message: String) -> WriteError {
        Diagnostic::new(&self.options.name, Code::TumWrite, message).into()
    }

    /// The warning about a clip whose positions are not known.
    pub(crate) fn no_positions(&self) -> Option<Diagnostic> {
        let is_placed =
            !self.sampled.translations.is_empty() || !self.sampled.clip.skeleton.is_empty();
        let message = "the clip has no positions; 0 0 0 is written for all poses".to_owned();
        (!is_placed).then(|| Diagnostic::new(&self.options.name, Code::NoPositions, message))
    }

    /// The rotation of a sample, and its position as text.
    ///
    /// # Errors
    /// When one of them is not finite.
    pub(crate) fn pose(&self, sample: usize) -> Result<(Quat, [String; 3]), WriteError> {
        let position = self.sampled.translation(sample, 0);
        let rotation = self.sampled.rotations[sample];
        if !position.is_finite() || !rotation.is_finite() {
            let time = self.sampled.times[sample];
            return Err(self.refuse(format!("the pose at {time} s is not finite")));
        }
        let normal = |number: f32| if number.is_normal() { number } else { 0.0 };
        let rotation = Quat::from_array(rotation.to_array().map(normal));
        Ok((rotation, self.sampled.coordinates(sample, 0)))
    }

    /// The error of a time that files cannot store.
    pub(crate) fn out_of_range(&self, sample: usize) -> WriteError {
        let time = self.sampled.times[sample];
        self.refuse(format!("the time {time} s is out of range"))
    }
}

/// Writes one clip of one track. Times keep all digits, even those since 1970. Other numbers have the fewest digits
/// that are read back as the same f32, relative to an origin if there is one.
fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let path = Trajectory::of(clips, options)?;
    let mut text = String::from("# timestamp tx ty tz qx qy qz qw\n");
    for (key, value) in path.sampled.notes {
        let value = value.replace(char::is_control, " ");
        text += &format!("# {key}: {value}\n");
    }
    for sample in 0..path.sampled.times.len() {
        let digits = path.sampled.time_digits(sample);
        let digits = digits.ok_or_else(|| path.out_of_range(sample))?;
        let (rotation, position) = path.pose(sample)?;
        let [x, y, z] = position;
        let [qx, qy, qz, qw] = rotation.to_array();
        // The result is ignored, because writing to memory cannot fail.
        let _ = writeln!(text, "{digits} {x} {y} {z} {qx} {qy} {qz} {qw}");
        out.write_all(text.as_bytes())?;
        text.clear();
    }
    out.write_all(text.as_bytes())?;
    Ok(path.no_positions().into_iter().collect())
}
