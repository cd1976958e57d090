//! Writes samples as arrays in an archive, in Tumble's layout, for clips of any format.

use std::io::{self, Cursor, Write};
use std::ops::Range;

use glam::{DVec3, Vec3};
use half::f16;
use tumble::{FrameRate, Layout};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::array::{ArrayHeader, Element};
use crate::diagnostic::{Code, Diagnostic};
use crate::format::{MotionOptions, WriteError, not_one_clip};
use crate::motion::WrittenJoint;
use crate::motion::{ChannelInterpolation, Joint, Motion, SampledClip, Scalar};
use crate::npz::plan::KeyKind;
use crate::npz::plan::scalars;
use crate::npz::{rotation_vector, tumble_layout};
use crate::quaternion::ComponentOrder;
use crate::rate::{Precision, RateSource, of};

/// An archive that is being written. It grows in memory, because the length and the checksum of a member precede its
/// bytes.
pub(crate) struct ArchiveWriter {
    zip: ZipWriter<Cursor<Vec<u8>>>,
}

/// The options of a member of `length` bytes that is stored as it is.
fn stored(length: usize) -> SimpleFileOptions {
    // Members near 4 GiB get sizes of 64 bits. The limit is lower than 4 GiB, because deflating may make a member
    // slightly longer.
    SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(length >= 0xF000_0000)
}

/// Number of bytes that are added to the archive at once.
const PIECE: usize = 1 << 16;

impl ArchiveWriter {
    pub(crate) fn new() -> Self {
        Self {
            zip: ZipWriter::new(Cursor::new(Vec::new())),
        }
    }

    /// Begins a member of `length` bytes.
    fn begin(&mut self, path: &str, length: usize, is_deflated: bool) -> io::Result<()> {
        let method = match is_deflated {
            true => CompressionMethod::Deflated,
            false => CompressionMethod::Stored,
        };
        let options = stored(length).compression_method(method);
        self.zip.start_file(path, options).map_err(io::Error::other)
    }

    /// Writes a member with these bytes.
    pub(super) fn bytes(&mut self, path: &str, bytes: &[u8], is_deflated: bool) -> io::Result<()> {
        self.begin(path, bytes.len(), is_deflated)?;
        self.zip.write_all(bytes)
    }

    /// Writes a member whose bytes begin at a multiple of `alignment` bytes in the archive.
    pub(crate) fn aligned(&mut self, path: &str, bytes: &[u8], alignment: u16) -> io::Result<()> {
        let options = stored(bytes.len()).with_alignment(alignment);
        self.zip
            .start_file(path, options)
            .map_err(io::Error::other)?;
        self.zip.write_all(bytes)
    }

    /// Writes an array of numbers; `fill` supplies them in C order.
    pub(crate) fn numbers(
        &mut self,
        path: &str,
        (element, shape): (&Element, &[usize]),
        is_deflated: bool,
        fill: impl FnOnce(&mut dyn FnMut(f64) -> io::Result<()>) -> io::Result<()>,
    ) -> io::Result<()> {
        let header = ArrayHeader::write(element, shape);
        let count: usize = shape.iter().product();
        let length = header.len() + count.saturating_mul(element.size().unwrap_or(8));
        self.begin(path, length, is_deflated)?;
        let mut buffer = header;
        fill(&mut |number| {
            match element {
                Element::F16 => buffer.extend(f16::from_f64(number).to_le_bytes()),
                Element::F32 => buffer.extend((number as f32).to_le_bytes()),
                Element::Signed(size) => buffer.extend(&(number as i64).to_le_bytes()[..*size]),
                Element::Unsigned(size) => buffer.extend(&(number as u64).to_le_bytes()[..*size]),
                _ => buffer.extend(number.to_le_bytes()),
            }
            if buffer.len() >= PIECE {
                self.zip.write_all(&buffer)?;
                buffer.clear();
            }
            Ok(())
        })?;
        self.zip.write_all(&buffer)
    }

    /// Writes texts as an array of UTF-32.
    pub(crate) fn texts(&mut self, path: &str, texts: &[&str], shape: &[usize]) -> io::Result<()> {
        let longest = texts.iter().map(|text| text.chars().count()).max();
        let length = longest.unwrap_or(0).max(1);
        let mut bytes = ArrayHeader::write(&Element::Unicode(length), shape);
        for text in texts {
            let padded = text.chars().chain(std::iter::repeat('\0')).take(length);
            bytes.extend(padded.flat_map(|character| u32::from(character).to_le_bytes()));
        }
        self.bytes(path, &bytes, false)
    }

    /// Ends the archive and writes it to `out`.
    pub(crate) fn finish(self, out: &mut dyn Write) -> io::Result<()> {
        let archive = self.zip.finish().map_err(io::Error::other)?;
        out.write_all(archive.get_ref())
    }
}

/// Passes the keys of some tracks at all samples to `put`, in C order.
pub(super) fn keys(
    values: KeyKind,
    tracks: Range<usize>,
    layout: Layout,
    sampled: &SampledClip<'_>,
    put: &mut dyn FnMut(f64) -> io::Result<()>,
) -> io::Result<()> {
    let all = sampled.clip.set.track_count();
    let frames = sampled.times.len();
    let mut before: Vec<Option<DVec3>> = vec![None; tracks.len()];
    let first_track = tracks.start;
    let mut key = |track: usize, frame: usize| -> io::Result<()> {
        let at = frame * all + track;
        let vector = |list: &[Vec3], rest| list.get(at).copied().unwrap_or(rest).as_dvec3();
        let rotation = sampled.rotations[at];
        let three = match values {
            KeyKind::Quaternion(order) => {
                let [x, y, z, w] = rotation.to_array();
                let numbers = match order {
                    ComponentOrder::Xyzw => [x, y, z, w],
                    ComponentOrder::Wxyz => [w, x, y, z],
                };
                return numbers
                    .into_iter()
                    .try_for_each(|number| put(number.into()));
            }
            KeyKind::RotationVector => {
                let before = &mut before[track - first_track];
                *before.insert(rotation_vector::log(rotation, *before))
            }
            KeyKind::Form(_) => {
                let message = "archives that --map explains are not written again in their layout";
                return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
            }
            KeyKind::Translation => {
                sampled.clip.origin(track) + vector(sampled.translations, Vec3::ZERO)
            }
            KeyKind::Scale => vector(sampled.scales, Vec3::ONE),
        };
        three.to_array().into_iter().try_for_each(&mut *put)
    };
    match layout {
        Layout::TrackMajor => tracks
            .into_iter()
            .try_for_each(|track| (0..frames).try_for_each(|f| key(track, f))),
        Layout::FrameMajor => {
            (0..frames).try_for_each(|frame| tracks.clone().try_for_each(|track| key(track, frame)))
        }
    }
}

/// Checks that the number of samples fits the times and the tracks.
pub(super) fn check(sampled: &SampledClip<'_>, name: &str) -> Result<(), WriteError> {
    let (tracks, frames) = (sampled.clip.set.track_count(), sampled.times.len());
    let count = sampled.rotations.len();
    let has_keys = tracks > 0 || sampled.clip.set.scalar_count() > 0;
    if has_keys && frames > 0 && tracks.checked_mul(frames) == Some(count) {
        return Ok(());
    }
    let message = format!("{count} rotations for {tracks} tracks at {frames} times");
    Err(Diagnostic::new(name, Code::Layout, message).into())
}

/// The arrays of Tumble's layout that contain keys or their times.
const KEYS: [&str; 5] = ["rotations", "translations", "scales", "times", "fps"];

/// The name of the array of a note.
pub(super) fn note_name(note: &str) -> String {
    let is_reserved = KEYS.contains(&note) || tumble_layout::CONSTANTS.contains(&note);
    match is_reserved {
        true => format!("note_{note}"),
        false => note.to_owned(),
    }
}

/// Writes how the samples were made, one text array for each note.
pub(super) fn notes(members: &mut ArchiveWriter, sampled: &SampledClip<'_>) -> io::Result<()> {
    for (note, text) in sampled.notes {
        members.texts(&format!("{}.npy", note_name(note)), &[text], &[])?;
    }
    Ok(())
}

/// Writes one clip in Tumble's layout, with these arrays:
///
/// - `rotations` (tracks, frames, x y z w) in f32, `times` in f64, and `fps` if there is a rate, of which the last time
///   may be no frame;
/// - `translations` and `scales` (tracks, frames, 3), if tracks have them; with origins, translations are f64 and the
///   origins are added;
/// - `names` and `name`, of the tracks and of the clip; `is_world`, if poses are relative to the world;
/// - `parents`, and `rest` (tracks, 10) as `tx ty tz x y z w sx sy sz` if the skeleton has a rest pose;
/// - `no_world`, a text, if poses in the world cannot be computed, such as those of a body whose offsets are unknown;
/// - `samplers` (tracks, 3), if the clip specifies how its channels are interpolated;
/// - `bvh_channels` (tracks) and `end_sites` (sites, track x y z) of clips from BVH;
/// - one text for each note on how the samples were made.
///
/// # Errors
/// When there is not exactly one clip, when the number of samples does not fit, or when writing fails.
pub fn write_npz(
    clips: &[SampledClip<'_>],
    options: &MotionOptions,
    out: &mut dyn Write,
) -> Result<Vec<Diagnostic>, WriteError> {
    let [sampled] = clips else {
        let message = not_one_clip(clips.len(), "NPZ");
        return Err(Diagnostic::new(&options.name, Code::OneClip, message).into());
    };
    check(sampled, &options.name)?;
    let clip = sampled.clip;
    let (tracks, frames) = (clip.set.track_count(), sampled.times.len());
    let mut members = ArchiveWriter::new();
    let quaternions = KeyKind::Quaternion(ComponentOrder::Xyzw);
    for (path, values, is_there) in [
        ("rotations.npy", quaternions, tracks > 0),
        (
            "translations.npy",
            KeyKind::Translation,
            !sampled.translations.is_empty(),
        ),
        ("scales.npy", KeyKind::Scale, !sampled.scales.is_empty()),
    ] {
        if is_there {
            let shape = [tracks, frames, values.width()];
            let is_wide = values == KeyKind::Translation && sampled.has_origins();
            let element = if is_wide { Element::F64 } else { Element::F32 };
            members.numbers(path, (&element, &shape), false, |put| {
                keys(values, 0..tracks, Layout::TrackMajor, sampled, put)
            })?;
        }
    }
    scalar_arrays(&mut members, sampled)?;
    times(&mut members, sampled)?;
    if let Some(rate) = rate_of_frames(sampled) {
        let scalar = (&Element::F64, &[][..]);
        members.numbers("fps.npy", scalar, false, |put| put(rate.per_second()))?;
    }
    let names: Vec<&str> = clip
        .set
        .tracks()
        .map(|track| track.name.unwrap_or(""))
        .collect();
    if names.iter().any(|name| !name.is_empty()) {
        members.texts("names.npy", &names, &[tracks])?;
    }
    skeleton(&mut members, clip, sampled.has_origins())?;
    samplers(&mut members, clip)?;
    written_joints(&mut members, &clip.written_joints)?;
    if clip.is_world {
        let truth = (&Element::Unsigned(1), &[][..]);
        members.numbers("is_world.npy", truth, false, |put| put(1.0))?;
    }
    if let Some(reason) = &clip.no_world {
        members.texts(&format!("{}.npy", tumble_layout::NO_WORLD), &[reason], &[])?;
    }
    if let Some(name) = &clip.name {
        members.texts("name.npy", &[name], &[])?;
    }
    notes(&mut members, sampled)?;
    members.finish(out)?;
    Ok(Vec::new())
}

/// Writes the scalars, their names, kinds and limits.
fn scalar_arrays(members: &mut ArchiveWriter, sampled: &SampledClip<'_>) -> io::Result<()> {
    let clip = sampled.clip;
    let count = clip.set.scalar_count();
    if count == 0 {
        return Ok(());
    }
    let all: Vec<Scalar> = (0..count).map(|index| clip.scalar(index)).collect();
    let is_wide = all.iter().any(|scalar| scalar.origin != 0.0);
    let element = if is_wide { Element::F64 } else { Element::F32 };
    let path = |name: &str| format!("{name}.npy");
    let shape = [count, sampled.times.len()];
    members.numbers(
        &path(tumble_layout::SCALARS),
        (&element, &shape),
        false,
        |put| scalars::put(sampled, (0, count), Layout::TrackMajor, put),
    )?;
    let names: Vec<&str> = clip.scalar_keys().map(|keys| keys.name).collect();
    members.texts(&path(tumble_layout::SCALAR_NAMES), &names, &[count])?;
    let kinds: Vec<&str> = all.iter().map(|scalar| scalar.kind.name()).collect();
    members.texts(&path(tumble_layout::SCALAR_KINDS), &kinds, &[count])?;
    let has_default =
        |scalar: &Scalar| scalar.interpolation == Scalar::of(scalar.kind).interpolation;
    if !all.iter().all(has_default) {
        let samplers: Vec<&str> = all.iter().map(scalar_sampler).collect();
        members.texts(&path(tumble_layout::SCALAR_SAMPLERS), &samplers, &[count])?;
    }
    if all.iter().all(|scalar| scalar.limits.is_none()) {
        return Ok(());
    }
    let limits = (&Element::F64, &[count, 2][..]);
    members.numbers(&path(tumble_layout::SCALAR_LIMITS), limits, false, |put| {
        let mut limits = all
            .iter()
            .flat_map(|scalar| scalar.limits.unwrap_or([f64::NAN; 2]));
        limits.try_for_each(put)
    })
}

fn scalar_sampler(scalar: &Scalar) -> &'static str {
    match scalar.interpolation {
        Some(ChannelInterpolation::Step) => "STEP",
        Some(ChannelInterpolation::Linear) => "LINEAR",
        // The layout has no tangents.
        Some(ChannelInterpolation::Cubic) | None => "",
    }
}

/// The rate of the samples, or of all but the last one, if the clip ends between two frames: programs that read no times
/// then play the last interval a little slower, and nothing is missing.
pub(super) fn rate_of_frames(sampled: &SampledClip<'_>) -> Option<FrameRate> {
    const FEWEST: usize = 3;
    sampled.rate.or_else(|| {
        let (_, frames) = sampled.times.split_last()?;
        let frames = (frames.len() >= FEWEST).then(|| [frames.to_vec()])?;
        of(&RateSource::Times(&frames, Precision::F64))?.rate()
    })
}

/// Writes the times of all samples.
pub(super) fn times(members: &mut ArchiveWriter, sampled: &SampledClip<'_>) -> io::Result<()> {
    let shape = [sampled.times.len()];
    members.numbers("times.npy", (&Element::F64, &shape), false, |put| {
        let offset = sampled.clip.time_offset as f64;
        sampled
            .times
            .iter()
            .try_for_each(|&time| put(time + offset))
    })
}

/// Writes how channels are interpolated, if the clip specifies it. Samples of cubics are joined by straight lines.
fn samplers(members: &mut ArchiveWriter, clip: &Motion) -> io::Result<()> {
    let name = |sampler: Option<ChannelInterpolation>| match sampler {
        None => "",
        Some(ChannelInterpolation::Step) => "STEP",
        Some(ChannelInterpolation::Linear | ChannelInterpolation::Cubic) => "LINEAR",
    };
    let all = clip.channels.iter();
    let all = all
        .flat_map(|channels| [channels.rotation, channels.translation, channels.scale].map(name));
    let all: Vec<&str> = all.collect();
    match all.is_empty() {
        true => Ok(()),
        false => members.texts(
            &format!("{}.npy", tumble_layout::SAMPLERS),
            &all,
            &[all.len() / 3, 3],
        ),
    }
}

/// Writes how a file of BVH wrote the joints.
fn written_joints(members: &mut ArchiveWriter, joints: &[WrittenJoint]) -> io::Result<()> {
    if joints.is_empty() {
        return Ok(());
    }
    let texts: Vec<String> = joints.iter().map(WrittenJoint::channels_text).collect();
    let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
    let path = format!("{}.npy", tumble_layout::BVH_CHANNELS);
    members.texts(&path, &texts, &[texts.len()])?;
    let sites = joints.iter().enumerate();
    let sites =
        sites.flat_map(|(track, joint)| joint.end_sites.iter().map(move |site| (track, site)));
    let rows: Vec<[f64; 4]> = sites
        .map(|(track, site)| {
            let [x, y, z] = site.as_dvec3().to_array();
            [track as f64, x, y, z]
        })
        .collect();
    let shape = (&Element::F64, &[rows.len(), 4][..]);
    members.numbers(
        &format!("{}.npy", tumble_layout::END_SITES),
        shape,
        false,
        |put| rows.iter().flatten().try_for_each(|&number| put(number)),
    )
}

/// Writes parents, and the rest pose if there is one.
fn skeleton(members: &mut ArchiveWriter, clip: &Motion, has_origins: bool) -> io::Result<()> {
    let joints = &clip.skeleton;
    if joints.is_empty() {
        return Ok(());
    }
    let shape = [joints.len()];
    members.numbers("parents.npy", (&Element::Signed(4), &shape), false, |put| {
        let parents = joints
            .iter()
            .map(|joint| joint.parent.map_or(-1.0, |parent| parent as f64));
        parents.into_iter().try_for_each(put)
    })?;
    if joints.iter().all(|joint| joint.rest == Default::default()) {
        return Ok(());
    }
    let shape = [joints.len(), 10];
    let element = if has_origins {
        Element::F64
    } else {
        Element::F32
    };
    members.numbers("rest.npy", (&element, &shape), false, |put| {
        joints
            .iter()
            .enumerate()
            .try_for_each(|(track, Joint { rest, .. })| {
                let position = clip.origin(track) + rest.translation.as_dvec3();
                let [x, y, z, w] = rest.rotation.to_array();
                let [sx, sy, sz] = rest.scale.to_array();
                let others = [x, y, z, w, sx, sy, sz].map(f64::from);
                let mut numbers = position.to_array().into_iter().chain(others);
                numbers.try_for_each(&mut *put)
            })
    })
}
