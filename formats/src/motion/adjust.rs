//! Converts clips to another unit of length or another up axis, and places their joints.

use std::f64::consts::FRAC_1_SQRT_2;
use std::io::BufRead;
use std::path::Path;

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::{Channel, JointMatchError, Joints, TrackError};

use crate::diagnostic::{Code, Diagnostic};
use crate::format::{Adjustment, Loaded, Space};
use crate::limits::Limits;
use crate::motion::{Body, Joint, Motion, Transform, carry_key_data};
use crate::source::Source;
use crate::text::lines::{Lines, tokens};
use crate::text::number;

/// The axis that points up after a conversion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum UpAxis {
    /// y becomes the up axis. Unless the file specifies its up axis, it was z before, as in SMPL's files.
    Y,
    /// z becomes the up axis. Unless the file specifies its up axis, it was y before, as in glTF and BVH.
    Z,
}

tumble::names! {
    UpAxis, "axis",
    Y => "y",
    Z => "z",
}

impl UpAxis {
    /// The unit vector along this axis.
    #[must_use]
    pub fn direction(self) -> DVec3 {
        match self {
            Self::Y => DVec3::Y,
            Self::Z => DVec3::Z,
        }
    }

    /// The rotation about x by 90° that makes this axis the up axis, for [`adjust`]: from z up to y up, or from y up
    /// to z up. Its components are constants, because the sines of different systems differ in the last bit.
    #[must_use]
    pub fn rotation(self) -> DQuat {
        let x = match self {
            Self::Y => -FRAC_1_SQRT_2,
            Self::Z => FRAC_1_SQRT_2,
        };
        DQuat::from_xyzw(x, 0.0, 0.0, FRAC_1_SQRT_2)
    }

    /// The rotation that makes this axis the up axis. The up axis before it is that of `space`; without `space` the
    /// rotation is [`rotation`](Self::rotation).
    #[must_use]
    pub fn rotation_from(self, space: Option<Space>) -> DQuat {
        let axis = self.direction();
        let quarter = |axis: DVec3| {
            let [x, y, z] = (axis * FRAC_1_SQRT_2).to_array();
            DQuat::from_xyzw(x, y, z, FRAC_1_SQRT_2)
        };
        match space.map(|space| space.up) {
            None => self.rotation(),
            Some(up) if up == axis => DQuat::IDENTITY,
            Some(up) if up == -axis => DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
            Some(up) => quarter(up.cross(axis)),
        }
    }
}

/// Applies [`adjust`] to all clips of a file, scales the length of its boxes and updates [`Loaded::space`]. `up` is
/// the up axis after the conversion; `None` keeps the axes.
///
/// # Errors
/// As [`adjust`].
pub fn adjust_all(loaded: &mut Loaded, scale: f64, up: Option<UpAxis>) -> Result<(), TrackError> {
    let rotation = up.map_or(DQuat::IDENTITY, |up| up.rotation_from(loaded.space));
    if rotation == DQuat::IDENTITY && scale == 1.0 {
        return Ok(());
    }
    for clip in &mut loaded.clips {
        *clip = adjust(clip, scale, rotation)?;
        if let (Some(body), Some(up)) = (&mut clip.body, up) {
            body.up = Some(up.direction());
        }
    }
    if let Some(length) = &mut loaded.box_length {
        *length *= scale;
    }
    loaded.space = loaded.space.map(|space| Space {
        up: up.map_or(space.up, UpAxis::direction),
        metres: space.metres / scale,
    });
    loaded.adjustment = Some(Adjustment::Space);
    Ok(())
}

/// Multiplies all translations of a clip by `scale` and rotates all roots by `rotation`: keys, tangents and rest
/// poses. If the clip's poses are relative to the world, every track is a root. The rest rotations of an SMPL body stay as
/// they are, because they are those of its model, whose axes do not depend on the world. The computation is in f64; each
/// result is rounded to f32 once.
///
/// # Errors
/// When a translation exceeds the largest f32.
pub fn adjust(clip: &Motion, scale: f64, rotation: DQuat) -> Result<Motion, TrackError> {
    let mut adjusted = clip.without_tracks();
    let ends = adjusted
        .written_joints
        .iter_mut()
        .flat_map(|joint| &mut joint.end_sites);
    for end in ends {
        *end = (end.as_dvec3() * scale).as_vec3();
    }
    if let Some(body) = &mut adjusted.body {
        body.pelvis = (rotation * (body.pelvis.as_dvec3() * scale)).as_vec3();
        body.up = body.up.map(|up| rotation * up);
    }
    for (index, track) in clip.set.tracks().enumerate() {
        let joint = clip.skeleton.get(index);
        let is_root = clip.is_world || joint.is_none_or(|joint| joint.parent.is_none());
        let rotation = if is_root { rotation } else { DQuat::IDENTITY };
        let rotated = |key: Quat| match is_root {
            true => (rotation * key.as_dquat()).as_quat(),
            false => key,
        };
        let exactly = |vector: DVec3| rotation * (vector * scale);
        let moved = |vector: Vec3| exactly(vector.as_dvec3()).as_vec3();
        let before = clip.origin(index);
        // Far from 0, origins are rounded to whole numbers, which f64 adds exactly. Positions are then as near to the
        // origin as before.
        let origin = exactly(before);
        let origin = DVec3::select(
            origin.abs().cmpge(DVec3::splat(16.0)),
            origin.round(),
            origin,
        );
        let keys: Vec<Quat> = track.keys.iter().map(|&key| rotated(key)).collect();
        let set = &mut adjusted.set;
        set.push(track.name.unwrap_or_default(), track.times, &keys)?;
        carry_key_data(set, index, &track, 0..keys.len())?;
        if !track.tangents.is_empty() {
            let tangents = track.tangents.iter().map(|both| both.map(rotated));
            set.set_tangents(index, &tangents.collect::<Vec<_>>())?;
        }
        if let Some(vectors) = clip.set.vector_keys(Channel::Translation, index) {
            let shifted = |key: &Vec3| (exactly(before + key.as_dvec3()) - origin).as_vec3();
            let keys: Vec<Vec3> = vectors.keys.iter().map(shifted).collect();
            let both = |both: &[Vec3; 2]| both.map(moved);
            let tangents: Vec<_> = vectors.tangents.iter().map(both).collect();
            set.set_translations(index, vectors.times, &keys, &tangents)?;
        }
        if let Some(vectors) = clip.set.vector_keys(Channel::Scale, index) {
            set.set_scales(index, vectors.times, vectors.keys, vectors.tangents)?;
        }
        if let Some(joint) = adjusted.skeleton.get_mut(index) {
            joint.rest = Transform {
                translation: (exactly(before + joint.rest.translation.as_dvec3()) - origin)
                    .as_vec3(),
                rotation: match clip.body {
                    Some(_) => joint.rest.rotation,
                    None => rotated(joint.rest.rotation),
                },
                ..joint.rest
            };
        }
        adjusted.set_origin(index, origin);
    }
    adjusted.with_scalars_of(clip, scale)
}

/// Sets the offsets of the joints of all clips of a file by [`set_offsets`]; `numbers` has those of each clip. If they
/// replace offsets in the file, a warning is added to [`Loaded::warnings`]; `input` is the name of the file in it.
///
/// # Errors
/// As [`set_offsets`]; the clips are then unchanged. When a translation with the pelvis added is not a finite f32.
pub fn set_all_offsets(
    loaded: &mut Loaded,
    input: &str,
    numbers: &[Vec<f64>],
) -> Result<(), OffsetsError> {
    let mut placed = loaded.clips.clone();
    for (clip, numbers) in placed.iter_mut().zip(numbers) {
        set_offsets(clip, numbers)?;
    }
    let clips = loaded.clips.iter().zip(&placed);
    let replaced = clips.clone().find_map(|(before, after)| {
        let moved = replaced_offsets(before, after);
        let &first = moved.first()?;
        let [was, is] = [before, after].map(|clip| clip.rest_position(first).to_array());
        let ([x, y, z], [a, b, c]) = (was, is);
        let joints = match moved.len() {
            1 => "1 joint".to_owned(),
            count => format!("{count} joints"),
        };
        Some(format!(
            "the offsets of {joints} in the file are replaced: that of `{}` is {x} {y} {z} there, and now {a} {b} {c}",
            before.set.track_name(first)
        ))
    });
    let is_other = |(before, after): (&Motion, &Motion)| {
        before.body != after.body
            || (0..after.skeleton.len())
                .any(|joint| before.rest_position(joint) != after.rest_position(joint))
    };
    if clips.into_iter().any(is_other) {
        loaded.adjustment = loaded.adjustment.or(Some(Adjustment::Offsets));
    }
    loaded.clips = placed;
    let warning = replaced.map(|message| Diagnostic::new(input, Code::OffsetsReplaced, message));
    loaded.warnings.extend(warning);
    Ok(())
}

/// The joints with an offset, other than 0, in the first clip that is another one in the second.
fn replaced_offsets(before: &Motion, after: &Motion) -> Vec<usize> {
    let is_replaced = |&joint: &usize| {
        let offset = before.rest_position(joint);
        offset != DVec3::ZERO && offset != after.rest_position(joint)
    };
    (0..before.skeleton.len()).filter(is_replaced).collect()
}

/// Sets where each joint rests relative to its parent, for files that do not contain this: motion of SMPL bodies,
/// whose joint positions depend on the shape of the body. `numbers` are x, y, z of each joint, in the order of the
/// tracks. For an SMPL body, the offset of the root is the position of the pelvis when `trans` is 0; it is added to the
/// translations of the root.
///
/// # Errors
/// When there are not three numbers for each joint of the clip, or a joint with a parent is moved by translation keys; the
/// clip is then unchanged. When a translation with the pelvis added is not a finite f32.
pub fn set_offsets(clip: &mut Motion, numbers: &[f64]) -> Result<(), OffsetsError> {
    let joints = clip.skeleton.len();
    let (offsets, rest) = numbers.as_chunks::<3>();
    if joints == 0 || offsets.len() != joints || !rest.is_empty() {
        let numbers = numbers.len();
        return Err(OffsetsError::Numbers { numbers, joints });
    }
    // Some formats have keys for all joints, also for joints that stay at their offsets.
    let moves = |joint: &usize| {
        let Joint { parent, rest } = clip.skeleton[*joint];
        let keys = clip.set.vector_keys(Channel::Translation, *joint);
        parent.is_some()
            && keys.is_some_and(|keys| keys.keys.iter().any(|&key| key != rest.translation))
    };
    if let Some(joint) = (0..joints).find(moves) {
        let name = clip.set.track_name(joint);
        return Err(OffsetsError::Moved { joint, name });
    }
    let lacks_offsets = clip.lacks_offsets();
    // SMPL's `trans` is relative to the pelvis of the body shape.
    let root = (clip.skeleton.iter()).position(|joint| joint.parent.is_none());
    if let (Some(body), Some(root)) = (clip.body.clone(), root) {
        let pelvis = DVec3::from_array(offsets[root]);
        if let Some(translations) = clip.set.vector_keys(Channel::Translation, root) {
            let before = body.pelvis.as_dvec3();
            let moved = |key: &Vec3| (key.as_dvec3() - before + pelvis).as_vec3();
            let keys: Vec<Vec3> = translations.keys.iter().map(moved).collect();
            let (times, tangents) = (translations.times.to_vec(), translations.tangents.to_vec());
            clip.set.set_translations(root, &times, &keys, &tangents)?;
        }
        clip.body = Some(Body {
            pelvis: pelvis.as_vec3(),
            ..body
        });
    }
    if lacks_offsets {
        clip.no_world = None;
    }
    for (track, &offset) in offsets.iter().enumerate() {
        let parent = clip.skeleton[track].parent;
        let rest = clip.resting_at(track, parent, DVec3::from_array(offset));
        clip.skeleton[track].rest.translation = rest;
        if parent.is_some()
            && let Some(keys) = clip.set.vector_keys(Channel::Translation, track)
        {
            let times = keys.times.to_vec();
            let keys = vec![rest; times.len()];
            clip.set.set_translations(track, &times, &keys, &[])?;
        }
    }
    Ok(())
}

/// Offsets of joints, in the order of their file.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOffsets {
    /// The name of each joint; empty if the file has none.
    names: Vec<String>,
    /// x, y, z of each joint.
    numbers: Vec<f64>,
}

impl JointOffsets {
    /// Offsets without names, in the order of the joints: x, y, z of each.
    #[must_use]
    pub fn in_order(numbers: Vec<f64>) -> Self {
        Self {
            names: Vec::new(),
            numbers,
        }
    }

    /// Offsets of named joints, in any order.
    #[must_use]
    pub fn named(joints: Vec<(String, [f64; 3])>) -> Self {
        let (names, offsets): (_, Vec<[f64; 3]>) = joints.into_iter().unzip();
        Self {
            names,
            numbers: offsets.into_flattened(),
        }
    }

    /// Reads the offsets of joints: a line with x y z for each, in the order of the tracks; or `name x y z`, in any
    /// order. `#` begins a comment; `-` is standard input.
    ///
    /// # Errors
    /// When the file cannot be opened or is invalid; the first error is returned.
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        Source::read_by(path, true, |name, reader| Self::read(name, reader))
    }

    fn read(input: &str, reader: impl BufRead) -> Result<Self, Diagnostic> {
        let mut lines = Lines::new(input, reader, Limits::default())?;
        let (mut names, mut numbers) = (Vec::new(), Vec::new());
        while let Some(line) = lines.next()? {
            let plain = line.split('#').next().unwrap_or_default().replace(',', " ");
            let parts: Vec<(u64, &str)> = tokens(&plain).collect();
            let mut read = parts.as_slice();
            // The name of a joint may contain blanks, so it may have several parts.
            if let [named @ .., _, _, _] = read
                && let ([(_, first), ..], true) = (named, numbers.len() == 3 * names.len())
                && number::parse(first).is_err()
            {
                let words: Vec<&str> = named.iter().map(|(_, word)| *word).collect();
                names.push(words.join(" "));
                read = &parts[named.len()..];
            }
            for &(column, token) in read {
                let number = number::parse(token);
                let number =
                    number.map_err(|(code, message)| lines.refuse(column, code, message))?;
                numbers.push(number.value);
            }
            if !names.is_empty() && numbers.len() != 3 * names.len() {
                let message =
                    "each line is a joint's name and x y z, as the first line is".to_owned();
                return Err(lines.refuse(1, Code::Offsets, message));
            }
            lines.reuse(line);
        }
        match numbers.is_empty() {
            true => {
                let message = "no offsets; write x y z or `name x y z` of each joint, one a line";
                Err(lines.refuse_whole(Code::Offsets, message.to_owned()))
            }
            false => Ok(Self { names, numbers }),
        }
    }

    /// The number of joints.
    #[must_use]
    pub fn joint_count(&self) -> usize {
        self.numbers.len() / 3
    }

    /// The names of the joints; empty if they have none.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Those of the joints that a clip has, if they have names; otherwise all.
    #[must_use]
    pub fn some_of(&self, clip: &Motion) -> Self {
        let tracks = 0..clip.set.track_count();
        let known: Vec<String> = tracks.map(|track| clip.set.track_name(track)).collect();
        let (offsets, _) = self.numbers.as_chunks::<3>();
        let all = self.names.iter().cloned().zip(offsets.iter().copied());
        let kept: Vec<(String, [f64; 3])> = all.filter(|(name, _)| known.contains(name)).collect();
        match kept.is_empty() {
            true => self.clone(),
            false => Self::named(kept),
        }
    }

    /// The numbers for [`set_offsets`] of a clip. Offsets with names are those of the joints of these names, others are
    /// in the order of the joints.
    ///
    /// # Errors
    /// When the names are not those of the clip.
    pub fn of_clip(&self, clip: &Motion) -> Result<Vec<f64>, OffsetsError> {
        if self.names.is_empty() {
            return Ok(self.numbers.clone());
        }
        let joints = Joints::named(&self.names);
        let order = clip
            .joints()
            .order_of(&joints, ["the clip", "the list of offsets"])?;
        let (offsets, _) = self.numbers.as_chunks::<3>();
        Ok(order.iter().flat_map(|&line| offsets[line]).collect())
    }
}

/// Why the offsets of joints cannot be set.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OffsetsError {
    /// There are not three numbers for each joint.
    #[error("{numbers} numbers of offsets for {joints} joints; each joint needs three, x y z")]
    Numbers {
        /// Number of values that were passed.
        numbers: usize,
        /// Number of joints of the clip.
        joints: usize,
    },
    /// A joint with a parent has translation keys other than its offset, which already determine its position.
    #[error(
        "joint {joint} (`{name}`) is moved by translation keys, and an offset is only for joints that stay at it"
    )]
    Moved {
        /// Index of the first such joint, from 0.
        joint: usize,
        /// Name of that joint.
        name: String,
    },
    /// The names are not those of the clip's joints.
    #[error(transparent)]
    Joints(#[from] JointMatchError),
    /// A translation with the pelvis added is not a valid key.
    #[error(transparent)]
    Track(#[from] TrackError),
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_with_names_are_matched_by_name() {
        let mut clip = Motion::default();
        for (name, parent) in [
            ("hip", None),
            ("left knee", Some(0)),
            ("right knee", Some(0)),
        ] {
            clip.set.push(name, &[0.0], &[Quat::IDENTITY]).unwrap();
            let rest = Transform::default();
            clip.skeleton.push(Joint { parent, rest });
        }
        let read = |text: &str| JointOffsets::read("offsets", text.as_bytes());
        let placed = |text: &str| {
            let mut placed = clip.clone();
            let numbers = read(text).unwrap().of_clip(&placed)?;
            set_offsets(&mut placed, &numbers).map(|()| {
                placed
                    .skeleton
                    .iter()
                    .map(|joint| joint.rest.translation.x)
                    .collect::<Vec<_>>()
            })
        };
        let in_order = vec![0.0, 1.0, -1.0];
        assert_eq!(placed("0 0 0\n1 0 0 # left\n-1 0 0\n").unwrap(), in_order);
        assert_eq!(
            placed("right knee -1 0 0\nhip, 0 0 0\n\nleft knee 1 0 0\n").unwrap(),
            in_order
        );
        let error = placed("hip 0 0 0\nLeftKnee 1 0 0\nright knee 0 0 0").unwrap_err();
        assert_eq!(
            error.to_string(),
            "the clip has a joint `left knee`, the list of offsets has none of that name; `LeftKnee` is near, but only equal names \
             match"
        );
        for (text, line) in [
            ("hip 0 0 0\n1 0 0", 2),
            ("0 0 0\nhip 0 0 0", 2),
            ("hip 0 0", 1),
        ] {
            let location = read(text).unwrap_err().location;
            assert!(
                matches!(location, Some(crate::Location::Text { line: found, .. }) if found == line),
                "{text}: {location:?}"
            );
        }
    }

    /// An axis that is up goes where it is to be, from wherever it was.
    #[test]
    fn up_is_turned_from_the_axis_that_was_up() {
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        for up in axes.into_iter().flat_map(|axis| [axis, -axis]) {
            let space = Some(Space { up, metres: 1.0 });
            for (to, axis) in [(UpAxis::Y, DVec3::Y), (UpAxis::Z, DVec3::Z)] {
                let found = to.rotation_from(space) * up;
                assert!(found.distance(axis) < 1e-15, "{up} to {axis}: {found}");
            }
        }
        assert!((UpAxis::Y.rotation_from(None) * DVec3::Z).distance(DVec3::Y) < 1e-15);
        assert!((UpAxis::Z.rotation_from(None) * DVec3::Y).distance(DVec3::Z) < 1e-15);
    }

    #[test]
    fn roots_are_turned_and_all_translations_scaled() {
        let mut clip = Motion::default();
        for parent in [None, Some(0)] {
            let track = clip.set.track_count();
            clip.set
                .push("", &[0.0], &[Quat::from_rotation_x(0.3)])
                .unwrap();
            clip.set
                .set_translations(track, &[0.0], &[Vec3::Z], &[])
                .unwrap();
            let rest = Transform {
                translation: Vec3::Y,
                ..Transform::default()
            };
            clip.skeleton.push(Joint { parent, rest });
        }
        // z up becomes y up.
        let rotation = UpAxis::Y.rotation();
        assert!(rotation.abs_diff_eq(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2), 2e-16));
        assert_eq!(UpAxis::Z.rotation(), rotation.conjugate());
        let adjusted = adjust(&clip, 0.01, rotation).unwrap();
        let at = |track| {
            adjusted
                .set
                .vector_keys(Channel::Translation, track)
                .unwrap()
                .keys[0]
        };
        assert!(at(0).distance(Vec3::Y * 0.01) < 1e-8);
        assert_eq!(at(1), Vec3::Z * 0.01);
        let root = adjusted.set.track(0).keys[0];
        let expected = Quat::from_rotation_x(0.3 - std::f32::consts::FRAC_PI_2);
        assert!(root.angle_between(expected) < 1e-3);
        assert_eq!(adjusted.set.track(1).keys, clip.set.track(1).keys);
        assert_eq!(adjusted.skeleton[1].rest.translation, Vec3::Y * 0.01);
    }
}
