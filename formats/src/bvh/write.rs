//! Sampled clips as BVH: a joint for each track, angles that are continuous from frame to frame.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::io::{self, Write};

use glam::Vec3;
use tumble::{Channel, FrameRate};

use crate::bvh::{angles, rate};
use crate::diagnostic::{Code, Diagnostic, Place};
use crate::format::{MotionOptions, WriteError};
use crate::motion::Sampled;
use crate::names::usable_name;
use crate::warnings::Warnings;

/// Scales this close to 1 are 1: what rounding leaves of them.
const UNSCALED: f32 = 1e-5;

/// Up to here an f32 is exact to 8e-6 degrees; larger angles are written with six decimals, so that
/// a wheel that turns a hundred times reads back within 1e-6 rad too.
const EXACT_DEGREES: f64 = 256.0;

/// A joint where it comes in the file.
struct Node {
    track: usize,
    depth: usize,
    name: String,
    offset: Vec3,
    has_positions: bool,
}

/// Writes one clip, and says what BVH has no room for.
///
/// Roots, and joints whose translation changes, have position channels; the translation of the
/// others is their `OFFSET`. Tracks that have no skeleton, or are in the world already, are roots.
///
/// # Errors
/// When writing fails; for several clips, samples that are not frames of one rate, numbers that are
/// not finite, or a sequence of angles that has an axis twice. `InvalidInput` for lists whose
/// lengths are not those of the samples.
pub(super) fn write_motion(
    clips: &[Sampled<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let refuse = |message: String| Diagnostic::new(&options.name, Code::BvhWrite, message);
    let [sampled] = clips else {
        let message = format!("{} clips; a BVH file holds one, choose one", clips.len());
        return Err(refuse(message).into());
    };
    let axes = axes(options).map_err(refuse)?;
    let rate = check(sampled)?.map_err(refuse)?;
    let nodes = nodes(sampled).map_err(refuse)?;
    let mut warnings = Warnings::new(&options.name);
    warn_of_scales(sampled, &nodes, &mut warnings);
    let start = sampled.clip.time_offset as f64 + sampled.times[0];
    if start != 0.0 {
        warnings.warn(Code::StartMoved, || {
            let message = format!("the first sample is at {start} s; BVH begins at 0");
            (None, message)
        });
    }
    let mut text = hierarchy(&nodes, axes);
    let (frames, period) = (sampled.times.len(), frame_time(rate));
    text += &format!("MOTION\nFrames: {frames}\nFrame Time: {period}\n");
    out.write_all(text.as_bytes())?;
    let tracks = sampled.clip.set.track_count();
    let mut before = vec![[0.0; 3]; nodes.len()];
    for sample in 0..frames {
        text.clear();
        for (node, before) in nodes.iter().zip(&mut before) {
            if node.has_positions {
                for coordinate in translation(sampled, sample, node.track).to_array() {
                    push_f32(&mut text, coordinate);
                }
            }
            let rotation = sampled.rotations[sample * tracks + node.track];
            *before = angles::nearest(rotation.as_dquat().normalize(), axes, *before);
            for angle in *before {
                push_degrees(&mut text, angle.to_degrees());
            }
        }
        text.pop(); // the last blank
        text.push('\n');
        out.write_all(text.as_bytes())?;
    }
    Ok(warnings.into_list())
}

/// The shortest digits of a frame's seconds, with zeros behind them where the digits alone would be
/// read as another rate: 0.0167 is that of 60 frames a second.
fn frame_time(rate: FrameRate) -> String {
    let period = rate.time_of(1);
    let mut digits = period.to_string();
    if rate::of_period(&digits, period) != Some(rate) {
        digits += if digits.contains('.') { "" } else { "." };
        digits += "000000000000";
    }
    digits
}

/// The axes of the angles, each about those before it have turned: fixed axes in the other order are
/// the same.
fn axes(options: &MotionOptions) -> Result<[usize; 3], String> {
    let Some(sequence) = options.sequence else {
        return Ok([2, 0, 1]);
    };
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

/// The rate of the samples, each on the frame behind the one before.
fn check(sampled: &Sampled<'_>) -> io::Result<Result<FrameRate, String>> {
    let (times, tracks) = (sampled.times, sampled.clip.set.track_count());
    let samples = times.len() * tracks;
    let fits = |count: usize| count == 0 || count == samples;
    let (translations, skeleton) = (sampled.translations, &sampled.clip.skeleton);
    if sampled.rotations.len() != samples
        || !fits(translations.len())
        || !fits(sampled.scales.len())
        || !(skeleton.is_empty() || skeleton.len() == tracks)
    {
        let message = "lists of samples whose lengths are not those of times and tracks";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    if samples == 0 {
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
        return Ok(Err(
            "the samples are not frames of one rate; sample at a rate".to_owned(),
        ));
    };
    let off = |(frame, &time): (usize, &f64)| {
        ((time - times[0]) * rate.per_second() - frame as f64).abs() > 0.01
    };
    if let Some((_, time)) = times.iter().enumerate().find(|&sample| off(sample)) {
        let message = format!("the sample at {time} s is not on the next frame of {rate} a second");
        return Ok(Err(message));
    }
    Ok(Ok(rate))
}

/// The joints in the file's order, each before those that hang on it.
fn nodes(sampled: &Sampled<'_>) -> Result<Vec<Node>, String> {
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
                None => return Err(format!("track {track} hangs on track {parent} of {tracks}")),
            },
        }
    }
    let mut names = HashSet::new();
    let mut nodes = Vec::with_capacity(tracks);
    while let Some((track, depth)) = open.pop() {
        open.extend(children[track].iter().map(|&child| (child, depth + 1)));
        let first = translation(sampled, 0, track);
        let moves =
            (1..sampled.times.len()).any(|sample| translation(sampled, sample, track) != first);
        let rest = clip.rest(Channel::Translation, track);
        let has_positions = depth == 0 || moves;
        nodes.push(Node {
            track,
            depth,
            name: usable_name(clip.set.track(track).name.unwrap_or(""), track, &mut names),
            offset: if has_positions && !clip.skeleton.is_empty() {
                rest
            } else {
                first
            },
            has_positions,
        });
    }
    if nodes.len() < tracks {
        let message = "joints hang on each other in a circle; a skeleton has roots";
        return Err(message.to_owned());
    }
    Ok(nodes)
}

fn translation(sampled: &Sampled<'_>, sample: usize, track: usize) -> Vec3 {
    let tracks = sampled.clip.set.track_count();
    let found = sampled.translations.get(sample * tracks + track).copied();
    found.unwrap_or_else(|| sampled.clip.rest(Channel::Translation, track))
}

fn warn_of_scales(sampled: &Sampled<'_>, nodes: &[Node], warnings: &mut Warnings) {
    let tracks = sampled.clip.set.track_count();
    for node in nodes {
        let mut own = sampled.scales.iter().skip(node.track).step_by(tracks);
        if own.any(|scale| !scale.abs_diff_eq(Vec3::ONE, UNSCALED)) {
            warnings.warn(Code::Scales, || {
                let message = "the joint is scaled; BVH has no scales, they are left out";
                (Some(Place::Inside(node.name.clone())), message)
            });
        }
    }
}

/// All up to `MOTION`.
fn hierarchy(nodes: &[Node], axes: [usize; 3]) -> String {
    let mut text = String::from("HIERARCHY\n");
    for (place, node) in nodes.iter().enumerate() {
        let (indent, keyword) = (
            "  ".repeat(node.depth),
            if node.depth == 0 { "ROOT" } else { "JOINT" },
        );
        text += &format!(
            "{indent}{keyword} {}\n{indent}{{\n{indent}  OFFSET ",
            node.name
        );
        push_vector(&mut text, node.offset);
        let positions = if node.has_positions {
            " Xposition Yposition Zposition"
        } else {
            ""
        };
        let count = if node.has_positions { 6 } else { 3 };
        text += &format!("{indent}  CHANNELS {count}{positions}");
        for axis in axes {
            text += [" Xrotation", " Yrotation", " Zrotation"][axis];
        }
        text.push('\n');
        let next = nodes.get(place + 1).map_or(0, |next| next.depth);
        if next <= node.depth {
            text += &format!(
                "{indent}  End Site\n{indent}  {{\n{indent}    OFFSET 0 0 0\n{indent}  }}\n"
            );
        }
        for depth in (next..=node.depth).rev() {
            text += &format!("{}}}\n", "  ".repeat(depth));
        }
    }
    text
}

fn push_vector(text: &mut String, vector: Vec3) {
    for coordinate in vector.to_array() {
        push_f32(text, coordinate);
    }
    text.pop();
    text.push('\n');
}

/// The shortest digits that read back as this f32, and a blank. Subnormal numbers are 0, as when
/// they are read.
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
