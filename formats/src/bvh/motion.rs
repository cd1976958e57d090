//! Reads the second half of a file: the frames, one row of numbers each, which become keys row by row.

use std::borrow::Cow;
use std::io::BufRead;

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::names::counted;
use tumble::{FrameRate, TrackSet};

use crate::bvh::hierarchy::{FIRST_WORD, Hierarchy};
use crate::diagnostic::{Code, Diagnostic};
use crate::format::ReadOptions;
use crate::motion::origin::{SMALL, origin_at_rest, relative};
use crate::motion::{ChannelInterpolation, Channels, Joint, Motion, Transform};
use crate::quaternion::rounded;
use crate::rate::{RateSource, itself, noticed_change, of, overridden};
use crate::text::blocks::Blocks;
use crate::text::lines::{Lines, tokens};
use crate::text::number;

/// The keys of all frames, in the order `[frame][joint]`: rotations of the joints with rotation channels, and
/// positions of the joints with position channels.
pub(super) struct FrameKeys {
    rate: FrameRate,
    count: usize,
    rotations: Blocks<Quat>,
    positions: Blocks<Vec3>,
    /// The rounding errors of the positions in f32, if one of the first frame is large enough for an origin.
    remainders: Option<Blocks<Vec3>>,
}

impl FrameKeys {
    /// Reads everything after `MOTION`.
    pub(super) fn read<R: BufRead>(
        lines: &mut Lines<R>,
        hierarchy: &Hierarchy,
        options: &ReadOptions,
    ) -> Result<Self, Diagnostic> {
        let frames = read_frames(lines)?;
        let joints = || hierarchy.joints.iter();
        let rotating = joints().filter(|joint| !joint.rotations.is_empty());
        let moving = joints().filter(|joint| !joint.positions.is_empty());
        let mut rows = Self {
            rate: read_rate(lines, options)?,
            count: 0,
            rotations: Blocks::new(rotating.count()),
            positions: Blocks::new(moving.count()),
            remainders: None,
        };
        let needed = needed_columns(hierarchy, options);
        let mut row = Vec::new();
        while let Some(line) = lines.next()? {
            let start = line.trim_start_matches([' ', '\t']);
            if start
                .get(..FIRST_WORD.len())
                .is_some_and(|word| word.eq_ignore_ascii_case(FIRST_WORD))
            {
                let message = "a second HIERARCHY; a file holds one, split it".to_owned();
                return Err(lines.refuse(1, Code::BvhSecond, message));
            }
            if !start.is_empty() {
                read_row(lines, &line, &needed, &mut row)?;
                if (rows.count as u64) < frames {
                    rows.push(hierarchy, &row);
                } else {
                    let message =
                        format!("a row after the last of {frames} frames; it is left out");
                    lines.warn(1, Code::BvhMoreRows, message);
                }
            }
            lines.reuse(line);
        }
        // Rows without numbers are blank lines.
        if (rows.count as u64) < frames && hierarchy.columns > 0 {
            let message = format!(
                "{} of {frames} frames; is the file truncated?",
                counted(rows.count, "row")
            );
            return Err(lines.refuse_end(Code::BvhCut, message));
        }
        if rows.count == 0 {
            let end = lines.refuse_end(Code::BvhNoFrames, "no frames; nothing moves".to_owned());
            lines.warnings.push(end);
        }
        Ok(rows)
    }

    fn push(&mut self, hierarchy: &Hierarchy, row: &[f64]) {
        if self.count == 0 {
            // If a position is so large that it needs an origin, it has at least half of the limit in every frame. So
            // the first frame decides.
            let is_large = |channel: &&(usize, usize)| row[channel.1].abs() >= 0.5 * SMALL;
            let mut all = hierarchy.joints.iter().flat_map(|joint| &joint.positions);
            let width = self.positions.width();
            self.remainders = all.find(is_large).map(|_| Blocks::new(width));
        }
        for joint in &hierarchy.joints {
            if !joint.rotations.is_empty() {
                self.rotations.push(rotation(&joint.rotations, row));
            }
            if !joint.positions.is_empty() {
                let mut position = joint.offset;
                for &(coordinate, column) in &joint.positions {
                    position[coordinate] = row[column];
                }
                let rounded = position.as_vec3();
                self.positions.push(rounded);
                if let Some(remainders) = &mut self.remainders {
                    remainders.push((position - rounded.as_dvec3()).as_vec3());
                }
            }
        }
        self.count += 1;
    }

    /// Makes a clip with one track for each joint; joints without rotation channels have one key.
    pub(super) fn into_clip<R: BufRead>(
        self,
        lines: &Lines<R>,
        hierarchy: &Hierarchy,
    ) -> Result<Motion, Diagnostic> {
        // If there are no frames, every track gets one key, at time 0.
        let count = self.count.max(1);
        let times: Vec<f64> = (0..count as u64)
            .map(|frame| self.rate.time_of(frame))
            .collect();
        let rotations = self.rotations.into_columns();
        let positions = self.positions.into_columns();
        let mut rotations = rotations.chunks_exact(count);
        let mut positions = positions.chunks_exact(count);
        let remainders = self
            .remainders
            .map(Blocks::into_columns)
            .unwrap_or_default();
        let mut remainders = remainders.chunks_exact(count);
        let mut origins = vec![DVec3::ZERO; hierarchy.joints.len()];
        let mut set = TrackSet::new();
        let mut skeleton = Vec::with_capacity(hierarchy.joints.len());
        // Rotations are unit and times in order here; the set checks both again.
        let refuse =
            |error: tumble::TrackError| lines.refuse_whole(Code::BvhRow, error.to_string());
        for (track, joint) in hierarchy.joints.iter().enumerate() {
            let has_keys = !joint.rotations.is_empty();
            let keys = has_keys
                .then(|| rotations.next())
                .flatten()
                .unwrap_or(&[Quat::IDENTITY]);
            set.push(&joint.name, &times[..keys.len()], keys)
                .map_err(refuse)?;
            let has_keys = !joint.positions.is_empty();
            if let Some(keys) = has_keys.then(|| positions.next()).flatten() {
                let mut points = Cow::Borrowed(keys);
                if let Some(remainders) = remainders.next() {
                    let whole = keys.iter().zip(remainders);
                    let whole: Vec<DVec3> =
                        whole.map(|(a, b)| a.as_dvec3() + b.as_dvec3()).collect();
                    let (origin, about_it) = relative(&whole);
                    (origins[track], points) = (origin, Cow::Owned(about_it));
                }
                set.set_translations(track, &times, &points, &[])
                    .map_err(refuse)?;
            } else {
                origins[track] = origin_at_rest(joint.parent, joint.offset);
            }
            let rest = Transform {
                translation: (joint.offset - origins[track]).as_vec3(),
                ..Transform::default()
            };
            skeleton.push(Joint {
                parent: joint.parent,
                rest,
            });
        }
        let mut clip = Motion {
            set,
            skeleton,
            rate: Some(self.rate),
            origins: match origins.iter().all(|&origin| origin == DVec3::ZERO) {
                true => Vec::new(),
                false => origins,
            },
            // The format does not define the interpolation; other programs interpolate linearly.
            channels: (hierarchy.joints.iter())
                .map(|joint| Channels {
                    rotation: linear(!joint.rotations.is_empty()),
                    translation: linear(!joint.positions.is_empty()),
                    scale: None,
                })
                .collect(),
            written_joints: (hierarchy.joints.iter())
                .map(|joint| joint.written.clone())
                .collect(),
            ..Motion::default()
        };
        let mut end_sites = clip
            .written_joints
            .iter()
            .flat_map(|joint| &joint.end_sites);
        if clip.has_unplaced_joints() && end_sites.all(|&site| site == Vec3::ZERO) {
            clip.no_world = Some(NO_OFFSETS.to_owned());
        }
        Ok(clip)
    }
}

/// Such files are written by programs that know the rotations of joints but not their positions, for example of a body
/// whose shape is unknown.
const NO_OFFSETS: &str = "all offsets in the file are 0, so the positions of joints relative to their parents are \
                          unknown; give them with --offsets";

/// The interpolation of a channel, if it has keys.
fn linear(has_keys: bool) -> Option<ChannelInterpolation> {
    has_keys.then_some(ChannelInterpolation::Linear)
}

/// The product of rotations about the axes of `channels`. The first is the outermost factor: each axis is rotated by
/// the rotations before it.
fn rotation(channels: &[(usize, usize)], row: &[f64]) -> Quat {
    let mut q = DQuat::IDENTITY.to_array();
    for &(axis, column) in channels {
        let (sine, cosine) = libm::sincos(row[column] * (std::f64::consts::PI / 360.0));
        let (i, j, k) = (axis, (axis + 1) % 3, (axis + 2) % 3);
        let mut next = [0.0; 4];
        next[i] = q[i] * cosine + q[3] * sine;
        next[j] = q[j] * cosine + q[k] * sine;
        next[k] = q[k] * cosine - q[j] * sine;
        next[3] = q[3] * cosine - q[i] * sine;
        q = next;
    }
    rounded(DQuat::from_array(q))
}

/// Reads the number of `Frames: 120`.
fn read_frames<R: BufRead>(lines: &mut Lines<R>) -> Result<u64, Diagnostic> {
    let field = read_field(lines, &["frames"], Code::BvhFrames, "Frames: 120")?;
    let whole = field.text.parse();
    whole.map_err(|_| {
        let message = format!(
            "`{}` is not a number of frames; write a whole number",
            field.text
        );
        lines.refuse(field.column, Code::BvhFrames, message)
    })
}

/// Reads the rate of `Frame Time: 0.0083333`. With `raw_times` the frame time is the printed number, not that of a common
/// rate. If another rate replaces it, the number is not checked.
fn read_rate<R: BufRead>(
    lines: &mut Lines<R>,
    options: &ReadOptions,
) -> Result<FrameRate, Diagnostic> {
    let Field { column, text } = read_field(
        lines,
        &["frame", "time"],
        Code::BvhFrameTime,
        "Frame Time: 0.0083333",
    )?;
    let period = match number::parse(&text) {
        Ok(number) => number.value,
        Err((Code::NotFinite | Code::TooLarge, _)) if options.override_rate.is_some() => f64::NAN,
        Err((code, message)) => return Err(lines.refuse(column, code, message)),
    };
    let rate = match options.raw_times {
        true => itself(period),
        false => of(&RateSource::FrameTime(&text)).map(|found| found.grid),
    };
    let out_of_range = || format!("a frame time of {text} s is out of range (1e-9 to 1e9 s)");
    if let Some(other) = options.override_rate {
        let message = match rate {
            Some(rate) => overridden(rate, other),
            None => format!(
                "{}; because of --override-fps it is read at {}",
                out_of_range(),
                other.in_words()
            ),
        };
        if rate != Some(other) {
            lines.warn(column, Code::TwoRates, message);
        }
        return Ok(other);
    }
    let rate = rate.ok_or_else(|| {
        let message = out_of_range() + "; --override-fps replaces it";
        lines.refuse(column, Code::BvhFrameTime, message)
    })?;
    if let Some(change) = noticed_change(period, rate) {
        let (longer, percent) = match change > 0.0 {
            true => ("longer", 100.0 * change),
            false => ("shorter", -100.0 * change),
        };
        let message = format!(
            "the frame time {text} is read as that of {}, which makes the clip {percent:.1} % {longer}; --raw-times \
             keeps {text}",
            rate.in_words()
        );
        lines.warn(column, Code::FrameTimeRounded, message);
    }
    Ok(rate)
}

/// The text after a line's keyword and colon.
struct Field {
    column: u64,
    text: String,
}

fn read_field<R: BufRead>(
    lines: &mut Lines<R>,
    words: &[&str],
    code: Code,
    example: &str,
) -> Result<Field, Diagnostic> {
    while let Some(line) = lines.next()? {
        let mut rest = line.trim_start();
        if rest.is_empty() {
            lines.reuse(line);
            continue;
        }
        for word in words {
            let found = rest.split_at_checked(word.len());
            let found = found.filter(|(start, _)| start.eq_ignore_ascii_case(word));
            rest = found.map_or("", |(_, rest)| rest.trim_start());
        }
        let value = rest.strip_prefix(':').unwrap_or_default();
        let mut values = tokens(value);
        let (Some((column, text)), None) = (values.next(), values.next()) else {
            let found: String = line.trim().chars().take(24).collect();
            let message = format!("`{found}` where `{example}` is expected, with one number");
            return Err(lines.refuse(1, code, message));
        };
        return Ok(Field {
            column: (line.len() - value.len()) as u64 + column,
            text: text.to_owned(),
        });
    }
    let message = format!("`{example}` is missing; is the file truncated?");
    Err(lines.refuse_end(code, message))
}

/// For each column of a row, whether it belongs to a joint that is needed.
fn needed_columns(hierarchy: &Hierarchy, options: &ReadOptions) -> Vec<bool> {
    let Some(selection) = &options.tracks else {
        return vec![true; hierarchy.columns];
    };
    let joints = || hierarchy.joints.iter();
    let parents: Vec<Option<usize>> = joints().map(|joint| joint.parent).collect();
    let are_needed = selection.are_needed(joints().map(|joint| &*joint.name), &parents);
    let mut needed = vec![false; hierarchy.columns];
    for (joint, is_needed) in joints().zip(are_needed) {
        for &(_, column) in joint.rotations.iter().chain(&joint.positions) {
            needed[column] = is_needed;
        }
    }
    needed
}

/// Reads the numbers of a row; `needed` has an entry for each.
fn read_row<R: BufRead>(
    lines: &mut Lines<R>,
    line: &str,
    needed: &[bool],
    row: &mut Vec<f64>,
) -> Result<(), Diagnostic> {
    let columns = needed.len();
    row.clear();
    for (column, token) in tokens(line) {
        let number = match number::parse(token) {
            Ok(number) if row.len() < columns => number,
            // The number belongs to a joint that will be left out, so it need not be finite.
            Err((Code::NotFinite, _)) if needed.get(row.len()) == Some(&false) => {
                row.push(0.0);
                continue;
            }
            Err((code, message)) if tokens(line).count() == columns => {
                return Err(lines.refuse(column, code, message));
            }
            // Report the wrong number of columns instead: it explains more.
            _ => return Err(wrong_count(lines, line, columns)),
        };
        if number.vanished {
            let message = format!("`{token}` is too small for f32; it becomes 0");
            lines.warn(column, Code::Tiny, message);
        }
        row.push(number.value);
    }
    if row.len() < columns {
        return Err(wrong_count(lines, line, columns));
    }
    Ok(())
}

fn wrong_count<R: BufRead>(lines: &Lines<R>, line: &str, columns: usize) -> Diagnostic {
    let found = tokens(line).count();
    let first_extra = tokens(line).nth(columns).map(|(column, _)| column);
    let column = first_extra.unwrap_or(line.trim_end().len() as u64 + 1);
    let numbers = counted(found, "number");
    let message = format!("{numbers} where {columns} are expected, one for each channel");
    lines.refuse(column, Code::BvhRow, message)
}
