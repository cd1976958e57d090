//! Libraries of clips from motion files, whose joints are matched by name.

use std::borrow::Cow;
use std::ffi::c_char;

use tumble::{Method, TrackSet, VectorMethod};
use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::skeleton::{ClipSkeleton, OffsetSource};

use crate::arguments::Out;
use crate::crowd::library::{TumbleCrowdLibrary, vector_method};
use crate::file::TumbleFile;
use crate::handle;
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code};

fn refused(message: String) -> Failure {
    Failure::new(TumbleResult::InvalidInput, message)
}

/// The joints of all clips of a file, those of the first clip first.
fn joints(file: &TumbleFile) -> Result<ClipSkeleton, Failure> {
    let mut joints = ClipSkeleton::default();
    for (clip, entry) in file.clips.iter().enumerate() {
        let names = ["the clips before", &format!("clip {clip}")];
        let added = joints.extend(&entry.motion, names);
        added.map_err(|error| refused(format!("{error}; make a library for each skeleton")))?;
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
fn matched<'a>(
    library: &TumbleCrowdLibrary,
    motion: &'a Motion,
    clip: usize,
) -> Result<Cow<'a, TrackSet>, Failure> {
    let name = format!("clip {clip}");
    if let Some(reason) = &motion.no_world {
        return Err(refused(format!("{name}: {reason}")));
    }
    // A library that was made of arrays has no names of joints until its first set gives them.
    let joints = match library.read()?.joint_names() {
        names if !names.is_empty() && !library.skeleton.is_named() => {
            Cow::Owned(library.skeleton.clone().with_names(names))
        }
        _ => Cow::Borrowed(&library.skeleton),
    };
    let matched = joints.some_pairs(motion, ["the library", &name]);
    let matched = matched.map_err(|error| refused(error.to_string()))?;
    let tracks = joints.tracks(motion, &matched, OffsetSource::Clip, &name);
    tracks.map_err(|error| refused(error.to_string()))
}

/// The method by which the file interpolates all rotations that change; an error if there are several.
fn authored_method(motion: &Motion, clip: usize) -> Result<Method, Failure> {
    let found = ChannelMethods::AUTHORED.moving_method_of(motion);
    found.map_err(|[first, second]| {
        refused(format!(
            "clip {clip} has rotations by {first} and by {second}; give one interpolation for all"
        ))
    })
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
/// `tumble_crowd_library_of_file`. A joint must have the same parent in the clip as in the library.
///
/// Joints that the clip does not have stay at rest. The clip must not have joints that the library does not have.
/// `clip_of_file` is the index of the clip in the file, counted from 0. `interpolation` and `vectors` are as in
/// `tumble_crowd_library_push`, but null stands for the methods of the file. All rotations of the file must then
/// have one method, and all translations and scales must have one. `clip` receives the clip's index in the library,
/// counted from 0; it may be null.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
/// - `TUMBLE_RESULT_INVALID_INPUT` if the joints or methods of the clip do not fit, or its rotations are relative to
///   the world.
/// - Otherwise as `tumble_crowd_library_push`.
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
