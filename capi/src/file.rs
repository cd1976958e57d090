//! Motion files.

use std::ffi::{CStr, CString, OsStr, c_char};
use std::path::Path;

use tumble_formats::motion::Motion;
use tumble_formats::sample::ChannelMethods;
use tumble_formats::{Format, ReadOptions};

use crate::arguments::Out;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code, guarded};
use crate::set::TumbleSet;

/// A motion file that was read: its clips, and messages about it. Any number of threads may use it at the same time.
pub struct TumbleFile {
    pub(crate) clips: Vec<Clip>,
    messages: Vec<CString>,
}

/// A clip of a file, with its names as C strings.
pub(crate) struct Clip {
    pub(crate) motion: Motion,
    name: CString,
    /// For each track, the name of the method by which the file interpolates its rotations.
    methods: Vec<CString>,
}

impl Object for TumbleFile {
    const NAME: &'static str = "file";
}

/// The text as a C string, without the zero bytes inside.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "")).unwrap_or_default()
}

/// Reads a motion file: glTF and GLB, BVH, FBX, NPZ and NPY, pickles, Parquet, Arrow, CSV, JSON of robots, TUM, `EuRoC`,
/// KITTI, MCAP or `.dat`.
///
/// The format is recognised by the first bytes of the file, otherwise by the extension of its name. `path` is UTF-8;
/// on Unix it may have any bytes. If some clips of the file are invalid, the others are read, and the messages of the
/// file say why (`tumble_file_message`). The caller frees the file with `tumble_file_free`.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if the file cannot be read; the message says why and where.
///
/// # Safety
/// `path` must be a text that ends with a zero byte, and `file` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_file_load(
    path: *const c_char,
    file: *mut *mut TumbleFile,
) -> TumbleResult {
    code(|| {
        let out = Out::new(file, "file")?;
        if path.is_null() {
            let message = "`path` is null";
            return Err(Failure::new(TumbleResult::InvalidPointer, message));
        }
        // SAFETY: as the caller promises.
        let path = system_path(unsafe { CStr::from_ptr(path) })?;
        let loaded = Format::open_detected(Path::new(path), &ReadOptions::default())?;
        let clips = loaded.clips.into_iter().map(|motion| {
            let methods = ChannelMethods::AUTHORED.methods(&motion);
            let methods = methods.map(|method| c_text(method.name)).collect();
            Clip {
                name: c_text(motion.name.as_deref().unwrap_or_default()),
                methods,
                motion,
            }
        });
        let clips = clips.collect();
        let messages = loaded.refused.iter().chain(&loaded.warnings);
        let messages = messages
            .map(|diagnostic| c_text(&diagnostic.to_string()))
            .collect();
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleFile { clips, messages })) };
        Ok(())
    })
}

#[cfg(unix)]
fn system_path(path: &CStr) -> Result<&OsStr, Failure> {
    use std::os::unix::ffi::OsStrExt;
    Ok(OsStr::from_bytes(path.to_bytes()))
}

#[cfg(not(unix))]
fn system_path(path: &CStr) -> Result<&OsStr, Failure> {
    let text = path.to_str().map(OsStr::new);
    text.map_err(|_| Failure::argument("`path` is not UTF-8"))
}

/// Returns the number of clips that could be read; 0 if the handle is invalid. Other functions take the index of a
/// clip among these, counted from 0.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_clip_count(file: *const TumbleFile) -> usize {
    guarded(|| Ok(handle::get(file)?.clips.len())).unwrap_or(0)
}

impl TumbleFile {
    pub(crate) fn clip(&self, index: usize) -> Result<&Clip, Failure> {
        let count = self.clips.len();
        self.clips.get(index).ok_or_else(|| {
            let message = format!("there is no clip {index}; the file has {count}");
            Failure::new(TumbleResult::OutOfRange, message)
        })
    }
}

/// Returns the name of a clip, empty if it has none: UTF-8, valid until the file is freed; null if there is no such
/// clip.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_clip_name(file: *const TumbleFile, clip: usize) -> *const c_char {
    let name = guarded(|| Ok(handle::get(file)?.clip(clip)?.name.as_ptr()));
    name.unwrap_or(std::ptr::null())
}

/// Creates a set with the rotations, translations and scales of all tracks of a clip. The set is a copy: it does not
/// need the file, and the caller frees it with `tumble_set_free`.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
///
/// # Safety
/// `set` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_file_clip_set(
    file: *const TumbleFile,
    clip: usize,
    set: *mut *mut TumbleSet,
) -> TumbleResult {
    code(|| {
        let out = Out::new(set, "set")?;
        let tracks = handle::get(file)?.clip(clip)?.motion.set.clone();
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(TumbleSet::new(tracks))) };
        Ok(())
    })
}

/// Returns the name of the method by which the file interpolates the rotations of a track, for
/// `TumbleInterpolation.method`: UTF-8, valid until the file is freed; null if there is no such clip or track.
///
/// For LINEAR in glTF it is "slerp". A track for which the file names no method has the most frequent method of the
/// clip's other tracks, or "bessel-overhauser" if the file names none at all.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_track_method(
    file: *const TumbleFile,
    clip: usize,
    track: usize,
) -> *const c_char {
    let name = guarded(|| {
        let file = handle::get(file)?;
        let methods = &file.clip(clip)?.methods;
        let count = methods.len();
        methods.get(track).map(|name| name.as_ptr()).ok_or_else(|| {
            let message = format!("there is no track {track}; the clip has {count}");
            Failure::new(TumbleResult::OutOfRange, message)
        })
    });
    name.unwrap_or(std::ptr::null())
}

/// Returns the whole number of seconds that was subtracted from all times of a clip, usually 0. Add it to the set's
/// times to get those of the file. It is not 0 if, for example, the file's times count from 1970: f64 is not accurate
/// enough for these.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
///
/// # Safety
/// `seconds` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_file_clip_time_offset(
    file: *const TumbleFile,
    clip: usize,
    seconds: *mut i64,
) -> TumbleResult {
    code(|| {
        let out = Out::new(seconds, "seconds")?;
        let offset = handle::get(file)?.clip(clip)?.motion.time_offset;
        // SAFETY: as the caller promises.
        unsafe { out.set(offset) };
        Ok(())
    })
}

/// Returns the position `x y z` that was subtracted from the translations of a track of a clip, usually 0 0 0. It is
/// not 0 for large coordinates, such as those of maps, for which f32 is not accurate enough. Add it, in doubles, to
/// translations that are evaluated.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip or track.
///
/// # Safety
/// `origin` must point to memory for three numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_file_clip_origin(
    file: *const TumbleFile,
    clip: usize,
    track: usize,
    origin: *mut f64,
) -> TumbleResult {
    code(|| {
        let out = Out::new(origin.cast::<[f64; 3]>(), "origin")?;
        let file = handle::get(file)?;
        let motion = &file.clip(clip)?.motion;
        let count = motion.set.track_count();
        if track >= count {
            let message = format!("there is no track {track}; the clip has {count}");
            return Err(Failure::new(TumbleResult::OutOfRange, message));
        }
        // SAFETY: as the caller promises.
        unsafe { out.set(motion.origin(track).to_array()) };
        Ok(())
    })
}

/// Returns the number of messages about the file: first why clips could not be read, then warnings. It is 0 if the
/// handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_message_count(file: *const TumbleFile) -> usize {
    guarded(|| Ok(handle::get(file)?.messages.len())).unwrap_or(0)
}

/// Returns the message `index`, counted from 0: UTF-8, valid until the file is freed; null if there is no such
/// message.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_message(file: *const TumbleFile, index: usize) -> *const c_char {
    let message = guarded(|| {
        let file = handle::get(file)?;
        let count = file.messages.len();
        let found = file.messages.get(index).map(|message| message.as_ptr());
        found.ok_or_else(|| {
            let message = format!("there is no message {index}; the file has {count}");
            Failure::new(TumbleResult::OutOfRange, message)
        })
    });
    message.unwrap_or(std::ptr::null())
}

/// Frees a file. Sets and libraries that were made from it stay valid. Does nothing if `file` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_free(file: *mut TumbleFile) -> TumbleResult {
    code(|| handle::free(file))
}
