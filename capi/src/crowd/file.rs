//! Libraries of clips from motion files, whose joints are matched by name.

use std::collections::HashMap;
use std::ffi::c_char;

use glam::Vec3;
use tumble::{Channel, Method, TrackSet, VectorMethod, method};
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;

use crate::arguments::Out;
use crate::crowd::library::{LibraryJoint, TumbleCrowdLibrary, vector_method};
use crate::file::{TumbleFile, c_text};
use crate::handle;
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code};

fn refused(message: String) -> Failure {
    Failure::new(TumbleResult::InvalidInput, message)
}

/// The name of a track, without zero bytes, as joints of libraries have it.
fn name_of(motion: &Motion, track: usize) -> String {
    motion.set.track_name(track).replace('\0', "")
}

/// The indices of a clip's tracks by name; an error if two tracks have the same name.
fn tracks_by_name(motion: &Motion, clip: usize) -> Result<HashMap<String, usize>, Failure> {
    let mut tracks = HashMap::new();
    for track in 0..motion.set.track_count() {
        let name = name_of(motion, track);
        if tracks.insert(name.clone(), track).is_some() {
            return Err(refused(format!(
                "clip {clip} has two joints `{name}`; give them names of their own"
            )));
        }
    }
    Ok(tracks)
}

/// The joints of all clips of a file, those of the first clip first.
fn joints(file: &TumbleFile) -> Result<Vec<LibraryJoint>, Failure> {
    let mut joints: Vec<LibraryJoint> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for (clip, entry) in file.clips.iter().enumerate() {
        let motion = &entry.motion;
        tracks_by_name(motion, clip)?;
        let names = (0..motion.set.track_count()).map(|track| name_of(motion, track));
        let names: Vec<String> = names.collect();
        let before = joints.len();
        for (track, name) in names.iter().enumerate() {
            known.entry(name.clone()).or_insert_with(|| {
                joints.push(LibraryJoint {
                    name: c_text(name),
                    parent: None,
                    rest: motion
                        .skeleton
                        .get(track)
                        .map(|joint| joint.rest)
                        .unwrap_or_default(),
                });
                joints.len() - 1
            });
        }
        for (track, name) in names.iter().enumerate() {
            let parent = motion.skeleton.get(track).and_then(|joint| joint.parent);
            let parent = parent
                .and_then(|parent| names.get(parent))
                .map(|name| known[name]);
            let joint = known[name];
            if joint >= before {
                joints[joint].parent = parent;
            } else if joints[joint].parent != parent {
                return Err(refused(format!(
                    "`{name}` has another parent in clip {clip} than in the clips before; make a library for each skeleton"
                )));
            }
        }
    }
    Ok(joints)
}

/// Creates an empty library for the skeleton of a file. `tumble_crowd_library_push_clip` adds clips to it.
///
/// Its joints are those of all clips of the file, matched by name, with their parents and rest positions; the joints
/// of the first clip come first. All of them are roots if the file has no hierarchy. `ticks_per_second` is as in
/// `tumble_crowd_library_new`. The caller frees the library with `tumble_crowd_library_free`.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if a clip has two joints of the same name, or a joint has another parent in another
/// clip.
///
/// # Safety
/// `library` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_of_file(
    file: *const TumbleFile,
    ticks_per_second: u32,
    library: *mut *mut TumbleCrowdLibrary,
) -> TumbleResult {
    code(|| {
        let out = Out::new(library, "library")?;
        let file = handle::get(file)?;
        let made = TumbleCrowdLibrary::new(joints(&file)?, ticks_per_second)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(made)) };
        Ok(())
    })
}

/// The tracks of a clip in the order of a library's joints. Joints that the clip does not have are at rest in the
/// library's pose; channels that it has no keys for are at rest in the pose of the clip's file.
fn matched(
    library: &TumbleCrowdLibrary,
    motion: &Motion,
    clip: usize,
) -> Result<TrackSet, Failure> {
    if motion.is_world {
        return Err(refused(format!(
            "the rotations of clip {clip} are relative to the world; joints of crowds turn relative to their parents"
        )));
    }
    if let Some(reason) = &motion.no_world {
        return Err(refused(format!("clip {clip}: {reason}")));
    }
    let mut by_name = tracks_by_name(motion, clip)?;
    let mut set = motion.set.clone();
    let start = set.time_span().map_or(0.0, |(first, _)| first);
    let mut order = Vec::with_capacity(library.joints.len());
    for joint in &library.joints {
        let name = joint.name.to_string_lossy();
        let (track, moved, scale) = match by_name.remove(&*name) {
            Some(track) => {
                let rest = |channel| motion.rest(channel, track);
                (track, rest(Channel::Translation), rest(Channel::Scale))
            }
            None => {
                set.push(name.as_ref(), &[start], &[joint.rest.rotation])?;
                let rest = joint.rest;
                (set.track_count() - 1, rest.translation, rest.scale)
            }
        };
        let is_keyed = |channel| set.vector_keys(channel, track).is_some();
        let (has_moved, has_scale) = (is_keyed(Channel::Translation), is_keyed(Channel::Scale));
        if !has_moved && moved != joint.rest.translation {
            set.set_translations(track, &[start], &[moved], &[])?;
        }
        if !has_scale && scale != Vec3::ONE {
            set.set_scales(track, &[start], &[scale], &[])?;
        }
        order.push(track);
    }
    if let Some(name) = by_name.into_keys().min() {
        return Err(refused(format!(
            "clip {clip} has a joint `{name}`, the library has none of that name"
        )));
    }
    Ok(set.select(order)?)
}

/// The method by which the file interpolates all rotations that change; an error if there are several.
fn authored_method(motion: &Motion, clip: usize) -> Result<Method, Failure> {
    let moves = |&track: &usize| {
        let keys = motion
            .set
            .get(track)
            .map(|track| track.keys)
            .unwrap_or_default();
        keys.iter().any(|key| *key != keys[0])
    };
    let groups = ChannelMethods::AUTHORED.groups_of(motion);
    let mut moving = groups.iter().filter(|(_, tracks)| tracks.iter().any(moves));
    match (moving.next(), moving.next()) {
        (None, _) => Ok(method::SLERP),
        (Some((method, _)), None) => Ok(*method),
        (Some((first, _)), Some((second, _))) => Err(refused(format!(
            "clip {clip} has rotations by {} and by {}; give one interpolation for all",
            first.name, second.name
        ))),
    }
}

fn authored_vector_method(motion: &Motion, clip: usize) -> Result<VectorMethod, Failure> {
    let found = ChannelMethods::AUTHORED.vector_method_of(motion);
    found.ok_or_else(|| {
        refused(format!(
            "clip {clip} has translations and scales by several methods; give one for all as `vectors`"
        ))
    })
}

/// Adds a clip of a file to a library. Tracks are matched to joints by name; the file may be another one than that of
/// `tumble_crowd_library_of_file`.
///
/// Joints that the clip does not have stay at rest. The clip must not have joints that the library does not have.
/// `clip_of_file` is the index of the clip in the file, counted from 0. `interpolation` and `vectors` are as in
/// `tumble_crowd_library_push`, but null stands for the methods of the file, which must be one method for all
/// rotations, and one for all translations and scales. `clip` receives the clip's index in the library, counted from
/// 0; it may be null.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip; `TUMBLE_RESULT_INVALID_INPUT` if its joints or methods do
/// not fit, or its rotations are relative to the world; otherwise as `tumble_crowd_library_push`.
///
/// # Safety
/// `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
/// zero byte; `vectors` must be null or a text that ends with a zero byte; and `clip` must be null or point to memory
/// for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_push_clip(
    library: *mut TumbleCrowdLibrary,
    file: *const TumbleFile,
    clip_of_file: usize,
    interpolation: *const TumbleInterpolation,
    vectors: *const c_char,
    clip: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::optional(clip, "clip")?;
        let (library, file) = (handle::get(library)?, handle::get(file)?);
        let motion = &file.clip(clip_of_file)?.motion;
        // SAFETY: as the caller promises.
        let (interpolation, vectors) = unsafe {
            (
                TumbleInterpolation::read_or(interpolation, || {
                    authored_method(motion, clip_of_file)
                })?,
                vector_method(vectors, || authored_vector_method(motion, clip_of_file))?,
            )
        };
        let set = matched(&library, motion, clip_of_file)?;
        let number = library.write()?.push(&set, interpolation, vectors)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(number) };
        Ok(())
    })
}
