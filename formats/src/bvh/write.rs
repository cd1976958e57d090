//! Writes sampled clips as BVH: a joint for each track, with angles that are continuous from frame to frame.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::{self, Write};

use glam::{DVec3, Vec3};
use tumble::{Channel, EulerSequence, FrameRate};

use crate::bvh::angles;
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{MotionOptions, WriteError, no_offsets, not_one_clip};
use crate::motion::SampledClip;
use crate::motion::WrittenChannel;
use crate::motion::origin::coordinate;
use crate::names::line_name;
use crate::rate::{RateSource, of};
use crate::warnings::Warnings;

/// The remedy for samples that BVH cannot store.
const RESAMPLE: &str =
    "`tumble eval --fps` makes frames at a constant rate (in Python, tumble.save(…, fps=…))";

/// Up to this angle an f32 is exact to 8e-6 degrees. Larger angles are written with six decimals, so that a wheel
/// that rotates a hundred times is also read back within 1e-6 rad.
const EXACT_DEGREES: f64 = 256.0;

/// A joint at its position in the file.
struct WrittenJoint {
    track: usize,
    depth: usize,
    name: String,
    offset: Vec3,
    /// The vector to add to its offset and positions.
    origin: DVec3,
    /// The numbers of a row, in their order.
    channels: Vec<WrittenChannel>,
    /// The axes of its angles, three different ones. Angles about axes without a channel are 0.
    axes: [usize; 3],
    end_sites: Vec<Vec3>,
}

/// The angle in radians up to which the angle of an axis without a channel counts as 0: the rounding error of f32.
const UNTURNED: f64 = 5e-7;

/// Writes one clip and returns warnings about data that BVH cannot store.
///
/// Joints of clips from BVH have the channels and End Sites of their file, and further channels only where the motion
/// needs them. Other joints have position channels if they are roots or if their translation changes; otherwise their
/// translation is their `OFFSET`. The last joints of a chain end in an End Site at the joint itself. Tracks without a
/// skeleton, and tracks relative to the world, are roots.
///
/// # Errors
/// When writing fails; when there are several clips; when samples are not frames of one rate, numbers are not finite,
/// or the sequence of angles has an axis twice. `InvalidInput` if the lengths of lists do not fit the samples.
pub(super) fn write_motion(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let refuse = |message: String| Diagnostic::new(&options.name, Code::BvhWrite, message);
    let [sampled] = clips else {
        let message = not_one_clip(clips.len(), "a BVH file");
        return Err(refuse(message).into());
    };
    let sequence = options.sequence.map(axes).transpose().map_err(refuse)?;
    let rate = check(sampled)?.map_err(refuse)?;
    let mut warnings = Warnings::new(&options.name);
    let nodes = nodes(sampled, sequence, &mut warnings).map_err(refuse)?;
    let start = sampled.clip.time_offset as f64 + sampled.times[0];
    if start != 0.0 {
        warnings.warn(Code::StartMoved, || {
            let message = format!("the first sample is at {start} s; BVH begins at 0");
            (None, message)
        });
    }
    let mut text = hierarchy(&nodes);
    let (frames, period) = (sampled.times.len(), frame_time(rate));
    text += &format!("MOTION\nFrames: {frames}\nFrame Time: {period}\n");
    out.write_all(text.as_bytes())?;
    let tracks = sampled.clip.set.track_count();
    let mut before = vec![[0.0; 3]; nodes.len()];
    for sample in 0..frames {
        text.clear();
        for (node, before) in nodes.iter().zip(&mut before) {
            let position = sampled.coordinates(sample, node.track);
            let rotation = sampled.rotations[sample * tracks + node.track];
            *before = angles::nearest(rotation.as_dquat().normalize(), node.axes, *before);
            for channel in &node.channels {
                match channel {
                    WrittenChannel::Position(axis) => {
                        text.push_str(&position[*axis]);
                        text.push(' ');
                    }
                    WrittenChannel::Rotation(axis) => {
                        let mut angles = node.axes.iter().zip(&*before);
                        let angle = angles.find(|(known, _)| *known == axis);
                        let angle = angle.map_or(0.0, |(_, angle)| *angle);
                        push_degrees(&mut text, angle.to_degrees());
                    }
                }
            }
        }
        text.truncate(text.trim_end_matches(' ').len());
        text.push('\n');
        out.write_all(text.as_bytes())?;
    }
    let unplaced = no_offsets(sampled.clip, options);
    Ok(unplaced.into_iter().chain(warnings.into_list()).collect())
}

/// The frame time in seconds, with the fewest digits. Zeros are appended if these digits alone would be read as
/// another rate: 0.0167 is that of 60 frames per second.
fn frame_time(rate: FrameRate) -> String {
    let period = rate.time_of(1);
    let mut digits = period.to_string();
    let read_back = of(&RateSource::FrameTime(&digits)).map(|found| found.grid);
    if read_back != Some(rate) {
        digits += if digits.contains('.') { "" } else { "." };
        digits += "000000000000";
    }
    digits
}

/// The axes of the angles, each rotated by those before it. A sequence about fixed axes is the same in reverse order.
fn axes(sequence: EulerSequence) -> Result<[usize; 3], String> {
    let mut axes = sequence.axes();
    if !sequence.is_intrinsic() {
        axes.reverse();
    }
    if axes[0] == axes[2] {
        let message = "has an axis twice; a BVH joint has each channel once, as in ZXY";
        return Err(format!("the sequence {sequence} {message}"));
    }
    Ok(axes)
}

/// The rate of the samples, which must be consecutive frames of it.
fn check(sampled: &SampledClip<'_>) -> io::Result<Result<FrameRate, String>> {
    let (times, translations) = (sampled.times, sampled.translations);
    if sampled.checked_len()? == 0 {
        return Ok(Err(
            "no samples or no tracks; there is nothing to write".to_owned()
        ));
    }
    let finite = sampled.rotations.iter().all(|q| q.is_finite())
        && translations.iter().all(|at| at.is_finite());
    if !finite {
        return Ok(Err("a rotation or translation is not finite".to_owned()));
    }
    let Some(rate) = sampled.rate else {
        return Ok(Err(format!(
            "BVH stores frames at a constant rate, which these samples do not have; {RESAMPLE}"
        )));
    };
    let off = |(frame, &time): (usize, &f64)| {
        ((time - times[0]) * rate.per_second() - frame as f64).abs() > 0.01
    };
    if let Some((_, time)) = times.iter().enumerate().find(|&sample| off(sample)) {
        let message =
            format!("the sample at {time} s is not at the next frame of {rate} fps; {RESAMPLE}");
        return Ok(Err(message));
    }
    Ok(Ok(rate))
}

/// The joints in the file's order, parents before their children.
fn nodes(
    sampled: &SampledClip<'_>,
    sequence: Option<[usize; 3]>,
    warnings: &mut Warnings,
) -> Result<Vec<WrittenJoint>, String> {
    let clip = sampled.clip;
    let tracks = clip.set.track_count();
    let mut children = vec![Vec::new(); tracks];
    let mut open = Vec::new();
    for track in (0..tracks).rev() {
        let joint = clip.skeleton.get(track).filter(|_| !clip.is_world);
        match joint.and_then(|joint| joint.parent) {
            None => open.push((track, 0)),
            Some(parent) => match children.get_mut(parent) {
                Some(children) => children.push(track),
                None => {
                    return Err(format!(
                        "track {track} has the parent {parent}, but there are {tracks} tracks"
                    ));
                }
            },
        }
    }
    let mut names = HashSet::new();
    let mut nodes = Vec::with_capacity(tracks);
    while let Some((track, depth)) = open.pop() {
        open.extend(children[track].iter().map(|&child| (child, depth + 1)));
        let track_name = clip.set.track(track).name.unwrap_or("");
        let name = line_name(track_name, track, &mut names);
        if name != track_name && !track_name.is_empty() {
            warnings.warn(Code::NameChanged, || {
                let message = format!("`{}` is called `{name}` in BVH", track_name.escape_debug());
                (None, message)
            });
        }
        let is_leaf = children[track].is_empty();
        nodes.push(node(sampled, (track, depth, name), is_leaf, sequence));
    }
    if nodes.len() < tracks {
        let message = "the joints' parents form a cycle; a skeleton has a root";
        return Err(message.to_owned());
    }
    Ok(nodes)
}

/// One joint, from its track, its depth and its name.
fn node(
    sampled: &SampledClip<'_>,
    (track, depth, name): (usize, usize, String),
    is_leaf: bool,
    sequence: Option<[usize; 3]>,
) -> WrittenJoint {
    let clip = sampled.clip;
    let written = clip.written_joints.get(track).filter(|_| !clip.is_world);
    let samples = 0..sampled.times.len();
    let first = sampled.translation(0, track);
    let rest = clip.rest(Channel::Translation, track);
    let mut channels = written.map_or_else(Vec::new, |joint| joint.channels.clone());
    let has_positions = |channels: &[WrittenChannel]| {
        let is_position = |channel: &WrittenChannel| matches!(channel, WrittenChannel::Position(_));
        channels.iter().any(is_position)
    };
    let moves = |axis: usize| {
        let mut all = samples.clone();
        all.any(|sample| sampled.translation(sample, track)[axis] != first[axis])
    };
    let is_root = written.is_none() && depth == 0;
    let is_moved = is_root || (0..3).any(moves);
    let has_rest = (has_positions(&channels) || is_moved) && !clip.skeleton.is_empty();
    let offset = if has_rest { rest } else { first };
    // Coordinates that move although the file has no channel for them, so that OFFSET is not enough.
    let is_missing = |axis: &usize| {
        !channels.contains(&WrittenChannel::Position(*axis))
            && (is_root || moves(*axis) || first[*axis] != offset[*axis])
    };
    let missing: Vec<usize> = match is_moved && !has_positions(&channels) {
        true => vec![0, 1, 2],
        false => (0..3).filter(is_missing).collect(),
    };
    let last = channels
        .iter()
        .rposition(|channel| matches!(channel, WrittenChannel::Position(_)));
    let index = last.map_or(0, |last| last + 1);
    let missing = missing.into_iter().map(WrittenChannel::Position);
    channels.splice(index..index, missing);
    let file_axes = WrittenChannel::rotations(&channels);
    let mut axes = sequence.unwrap_or([2, 0, 1]);
    if sequence.is_none() && !file_axes.is_empty() {
        // First the axes of the file in their order, then those that the file does not have.
        let others = (0..3).filter(|axis| !file_axes.contains(axis));
        let all = file_axes.iter().copied().chain(others);
        axes.iter_mut()
            .zip(all)
            .for_each(|(slot, axis)| *slot = axis);
    }
    let is_partial = written.is_some() && file_axes.len() < 3;
    if sequence.is_some() || !is_partial || uses_other_axes(sampled, track, axes, &file_axes) {
        // All three rotation channels are written at the position of the file's first one.
        let is_rotation = |channel: &WrittenChannel| matches!(channel, WrittenChannel::Rotation(_));
        let first_rotation = channels.iter().position(is_rotation);
        let is_sorted = file_axes == axes;
        if !is_sorted {
            let index = first_rotation.unwrap_or(channels.len());
            channels.retain(|channel| !is_rotation(channel));
            channels.splice(index..index, axes.map(WrittenChannel::Rotation));
        }
    }
    let end_sites = match written {
        Some(joint) => joint.end_sites.clone(),
        None if is_leaf => vec![Vec3::ZERO],
        None => Vec::new(),
    };
    WrittenJoint {
        track,
        depth,
        name,
        offset,
        origin: clip.origin(track),
        channels,
        axes,
        end_sites,
    }
}

/// Whether a joint's rotation needs axes other than the first ones of `axes`, those in `among`.
fn uses_other_axes(
    sampled: &SampledClip<'_>,
    track: usize,
    axes: [usize; 3],
    among: &[usize],
) -> bool {
    let tracks = sampled.clip.set.track_count();
    let mut before = [0.0; 3];
    let mut rotations = sampled.rotations.iter().skip(track).step_by(tracks);
    rotations.any(|rotation| {
        before = angles::nearest(rotation.as_dquat().normalize(), axes, before);
        let mut angles = axes.iter().zip(before);
        angles.any(|(axis, angle)| !among.contains(axis) && angle.abs() > UNTURNED)
    })
}

/// The text up to `MOTION`.
fn hierarchy(nodes: &[WrittenJoint]) -> String {
    let mut text = String::from("HIERARCHY\n");
    for (index, node) in nodes.iter().enumerate() {
        let (indent, keyword) = (
            indentation(node.depth),
            if node.depth == 0 { "ROOT" } else { "JOINT" },
        );
        text += &format!(
            "{indent}{keyword} {}\n{indent}{{\n{indent}  OFFSET ",
            node.name
        );
        push_vector(&mut text, node.origin, node.offset);
        text += &format!("{indent}  CHANNELS {}", node.channels.len());
        for channel in &node.channels {
            text += &format!(" {channel}");
        }
        text.push('\n');
        let next = nodes.get(index + 1).map_or(0, |next| next.depth);
        for &site in &node.end_sites {
            text += &format!("{indent}  End Site\n{indent}  {{\n{indent}    OFFSET ");
            push_vector(&mut text, DVec3::ZERO, site);
            text += &format!("{indent}  }}\n");
        }
        for depth in (next..=node.depth).rev() {
            text += &format!("{}}}\n", indentation(depth));
        }
    }
    text
}

/// The indentation of a line at this depth. It grows only to the depth of a chain of bones, because the blanks of a
/// long chain would otherwise outweigh its joints.
fn indentation(depth: usize) -> String {
    const DEEPEST: usize = 64;
    "  ".repeat(depth.min(DEEPEST))
}

fn push_vector(text: &mut String, origin: DVec3, vector: Vec3) {
    for axis in 0..3 {
        text.push_str(&coordinate(origin[axis], vector[axis]));
        text.push(' ');
    }
    text.pop();
    text.push('\n');
}

/// Appends the shortest digits that are read back as this f32, and a blank. Subnormal numbers are written as 0, as
/// they are also read.
fn push_f32(text: &mut String, number: f32) {
    let number = if number.is_normal() { number } else { 0.0 };
    let _ = write!(text, "{number} "); // memory takes everything
}

fn push_degrees(text: &mut String, degrees: f64) {
    if degrees.abs() <= EXACT_DEGREES {
        let is_noise = degrees.abs() < 1e-9;
        return push_f32(text, if is_noise { 0.0 } else { degrees as f32 });
    }
    let digits = format!("{degrees:.6}");
    text.push_str(digits.trim_end_matches('0').trim_end_matches('.'));
    text.push(' ');
}
