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

/// A motion file that was read: its clips, and messages about them.
pub struct TumbleFile {
    pub(crate) clips: Vec<Clip>,
    messages: Vec<CString>,
}

/// A clip, with its names as text for C.
pub(crate) struct Clip {
    pub(crate) motion: Motion,
    name: CString,
    /// Of each track, the name of the method by which the file interpolates its rotation.
    methods: Vec<CString>,
}

impl Object for TumbleFile {
    const NAME: &'static str = "file";
}

/// Text for C, which has no zeros inside.
pub(crate) fn c_text(text: &str) -> CString {
    CString::new(text.replace('\0', "")).unwrap_or_default()
}

/// Reads a motion file of any format: glTF and GLB, BVH, NPZ and NPY, Parquet, Arrow, CSV, TUM,
/// `.dat`, known by its first bytes and its name. `path` is UTF-8; on Unix any bytes.
///
/// # Safety
/// `path` is text that ends with a zero, and `file` has room for a handle.
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
            let mut methods = vec![CString::default(); motion.set.track_count()];
            for (method, tracks) in ChannelMethods::AUTHORED.groups_of(&motion) {
                for track in tracks {
                    methods[track] = c_text(method.name);
                }
            }
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

/// The number of clips that could be read; 0 for an invalid handle.
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

/// The name of a clip, empty where it has none: UTF-8, valid until the file is freed; null where there
/// is no such clip.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_clip_name(file: *const TumbleFile, clip: usize) -> *const c_char {
    let name = guarded(|| Ok(handle::get(file)?.clip(clip)?.name.as_ptr()));
    name.unwrap_or(std::ptr::null())
}

/// A clip's tracks of rotations, with the translations and scales that crowds use, as a set of the
/// caller's own, to be freed.
///
/// # Safety
/// `set` has room for a handle.
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

/// The name of the method by which the file interpolates the rotations of a track, as
/// `TumbleInterpolation.method` takes it ("slerp" for LINEAR in glTF, "bessel-overhauser" where the file
/// says nothing): valid until the file is freed; null where there is no such track.
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

/// Whole seconds that were taken from all times of a clip, so that clocks which count from 1970 lose
/// no digits; mostly 0.
///
/// # Safety
/// `seconds` has room for a number.
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

/// What was subtracted from the translations of a track of a clip, so that f32 is accurate enough for positions
/// such as those of maps: add it to what is made of them, in doubles. Mostly 0, 0, 0.
///
/// # Safety
/// `origin` has room for three numbers.
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

/// How many messages there are about the file: warnings, and why clips could not be read; 0 for an
/// invalid handle.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_message_count(file: *const TumbleFile) -> usize {
    guarded(|| Ok(handle::get(file)?.messages.len())).unwrap_or(0)
}

/// A message about the file: UTF-8, valid until the file is freed; null where there is none.
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

/// Frees a file; sets that were made of it stay. Null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_file_free(file: *mut TumbleFile) -> TumbleResult {
    code(|| handle::free(file))
}
