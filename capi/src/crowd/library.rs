//! Libraries of clips for one skeleton.

use std::ffi::{CString, c_char};
use std::sync::{OnceLock, RwLock, RwLockReadGuard, RwLockWriteGuard};

use tumble::VectorMethod;
use tumble::crowd::{CrowdLibrary, CrowdStorage};
use tumble_formats::motion::{Joint, Transform};
use tumble_formats::skeleton::ClipSkeleton;

use crate::arguments::{Out, list, list_mut, product, text};
use crate::file::c_text;
use crate::handle::{self, Object};
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code, guarded};
use crate::set::TumbleSet;
use crate::skeleton::joints;

/// A library: the clips, masks and inverse bind matrices of one skeleton, prepared for crowds. Any number of threads
/// may use it at the same time.
pub struct TumbleCrowdLibrary {
    inner: RwLock<CrowdLibrary>,
    pub(crate) skeleton: ClipSkeleton,
    /// The names of the joints; unset until the library knows them. They stay where they are, because C reads them.
    names: OnceLock<Vec<CString>>,
}

impl Object for TumbleCrowdLibrary {
    const NAME: &'static str = "crowd library";
}

impl TumbleCrowdLibrary {
    /// An empty library; 0 ticks mean the default.
    pub(crate) fn new(joints: ClipSkeleton, ticks_per_second: u32) -> Result<Self, Failure> {
        let skeleton = joints.of_engine()?;
        let library = match ticks_per_second {
            0 => CrowdLibrary::new(&skeleton)?,
            ticks => CrowdLibrary::with_ticks(&skeleton, ticks)?,
        };
        Ok(Self {
            inner: RwLock::new(library),
            skeleton: joints,
            names: OnceLock::new(),
        })
    }

    /// The names of the joints; `None` until the skeleton or the first clip determines them.
    fn names(&self) -> Result<Option<&[CString]>, Failure> {
        if self.names.get().is_none()
            && let names @ [_, ..] = self.read()?.joint_names()
        {
            let names = names.iter().map(|name| c_text(name)).collect();
            self.names.get_or_init(|| names);
        }
        Ok(self.names.get().map(Vec::as_slice))
    }

    pub(crate) fn read(&self) -> Result<RwLockReadGuard<'_, CrowdLibrary>, Failure> {
        handle::locked::<Self, _>(self.inner.read())
    }

    pub(crate) fn write(&self) -> Result<RwLockWriteGuard<'_, CrowdLibrary>, Failure> {
        handle::locked::<Self, _>(self.inner.write())
    }
}

/// Creates an empty library for a skeleton of `joint_count` joints.
///
/// `parents` are the indices of the joints' parents, -1 for a root; parents may come after their children. `offsets`
/// are three numbers `x y z` for each joint: the position in the parent's frame, for clips without translations of the
/// joint. Null: all are 0. `ticks_per_second` is the number of ticks in a second, 0 for 705 600. A clip has up to
/// 2147221504 ticks, which are 50 minutes by default. The arrays are copied. The caller frees the library with
/// `tumble_crowd_library_free`.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if a parent is negative but not -1, or there are too many ticks in a second.
/// - `TUMBLE_RESULT_INVALID_INPUT` if there are no joints, a parent does not exist, the parents form a cycle, or an
///   offset is not finite.
///
/// # Safety
/// `parents` must have `joint_count` numbers; `offsets` must be null or have 3 × `joint_count`; and `library` must
/// point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_new(
    parents: *const i32,
    offsets: *const f32,
    joint_count: usize,
    ticks_per_second: u32,
    library: *mut *mut TumbleCrowdLibrary,
) -> TumbleResult {
    code(|| {
        let out = Out::new(library, "library")?;
        // SAFETY: as the caller promises.
        let joints = unsafe { joints(parents, offsets, joint_count)? };
        let joint = |(parent, translation)| {
            let rest = Transform {
                translation,
                ..Transform::default()
            };
            Joint { parent, rest }
        };
        let joints = ClipSkeleton::unnamed(joints.into_iter().map(joint).collect());
        let made = TumbleCrowdLibrary::new(joints, ticks_per_second)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(made)) };
        Ok(())
    })
}

/// The method for translations and scales with this name; `other` if `name` is null.
///
/// # Safety
/// `name` must be null or a text that ends with a zero byte.
pub(crate) unsafe fn vector_method(
    name: *const c_char,
    other: impl FnOnce() -> Result<VectorMethod, Failure>,
) -> Result<VectorMethod, Failure> {
    // SAFETY: as the caller promises.
    match unsafe { text(name, "vectors")? } {
        None => other(),
        Some(name) => {
            let method = name.parse::<VectorMethod>();
            method.map_err(|error| Failure::argument(error.to_string()))
        }
    }
}

/// Sets how clips are stored that are added from now on: "segments" (also if `storage` is null) or "compact".
///
/// Poses have the same bits. Compact clips take a third to a sixth of the memory where keys are close, and poses take
/// longer. `tumble_crowd_library_bytes_per_key` returns how much memory clips take.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_ARGUMENT` if the name is unknown.
///
/// # Safety
/// `storage` must be null or a text that ends with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_set_storage(
    library: *mut TumbleCrowdLibrary,
    storage: *const c_char,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        // SAFETY: as the caller promises.
        let storage = match unsafe { text(storage, "storage")? } {
            None => CrowdStorage::default(),
            Some(name) => {
                let storage = name.parse::<CrowdStorage>();
                storage.map_err(|error| Failure::argument(error.to_string()))?
            }
        };
        library.write()?.set_storage(storage);
        Ok(())
    })
}

/// Returns the bytes of the clips divided by the number of their keys (of rotations, translations and scales), on the CPU
/// and on devices; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_bytes_per_key(library: *const TumbleCrowdLibrary) -> f64 {
    guarded(|| Ok(handle::get(library)?.read()?.bytes_per_key())).unwrap_or(0.0)
}

/// Adds a clip to a library.
///
/// `set` has one track for each joint, of the same name, in any order. The joints have the names of the file of
/// `tumble_crowd_library_of_file`, else those of the first set, whose tracks are then in the order of the joints. Sets
/// without names are matched by index. Rotations are interpolated by `interpolation`, or by the defaults if it is
/// null. Translations and scales are interpolated by the method `vectors`: "step", "linear", "catmull-rom",
/// "bessel-overhauser", "gltf-cubic", "c2" or "b-spline"; null: "linear". Joints without translations stay at their
/// offsets. `before` and `after` of `interpolation` are ignored, because each layer of an instance has its wrap mode.
/// The reference pose of the clip, for additive layers, is its pose at its start
/// (`tumble_crowd_library_set_reference`). `clip` receives the clip's index, counted from 0; it may be null.
///
/// # Errors
/// - `TUMBLE_RESULT_INVALID_INPUT` if the set does not have exactly one track for each joint, a track has the name of no joint, a
///   track cannot be interpolated as requested, the quantity is not the rotation, a curve rotates so fast that no
///   polynomial fits it, the clip is too long, or the library is full.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if a name is unknown.
///
/// After any error the library is unchanged.
///
/// # Safety
/// `interpolation` must be null or point to a `TumbleInterpolation` whose `method` is null or a text that ends with a
/// zero byte; `vectors` must be null or a text that ends with a zero byte; and `clip` must be null or point to memory
/// for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_push(
    library: *mut TumbleCrowdLibrary,
    set: *const TumbleSet,
    interpolation: *const TumbleInterpolation,
    vectors: *const c_char,
    clip: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::optional(clip, "clip")?;
        let (library, set) = (handle::get(library)?, handle::get(set)?);
        // SAFETY: as the caller promises.
        let (interpolation, vectors) = unsafe {
            let interpolation = TumbleInterpolation::read(interpolation)?;
            (
                interpolation,
                vector_method(vectors, || Ok(VectorMethod::Linear))?,
            )
        };
        let number = library.write()?.push(&set.read(), interpolation, vectors)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(number) };
        Ok(())
    })
}

/// Adds a mask: a weight from 0 to 1 for each joint, by which the weights of layers are multiplied.
///
/// `joint_count` must be the library's number of joints. A library has up to 31 masks. `mask` receives the number of
/// the mask for `TumbleCrowdLayer.mask`, counted from 1; it may be null.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if the number of weights is not that of joints, a weight is outside 0 to 1, or the
/// library has 31 masks already.
///
/// # Safety
/// `weights` must have `joint_count` numbers, and `mask` must be null or point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_push_mask(
    library: *mut TumbleCrowdLibrary,
    weights: *const f32,
    joint_count: usize,
    mask: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::optional(mask, "mask")?;
        let library = handle::get(library)?;
        // SAFETY: as the caller promises.
        let weights = unsafe { list(weights, joint_count, "weights")? };
        let number = library.write()?.push_mask(weights)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(number + 1) };
        Ok(())
    })
}

/// Sets the inverse bind matrix of every joint: the inverse of the joint's model matrix in the bind pose.
///
/// `matrices` are 12 numbers for each joint, as in results: three rows of four, for column vectors; the last column
/// is the translation. (The 16 numbers `m` of a glTF matrix are in columns: its first row is `m[0] m[4] m[8] m[12]`.)
/// `joint_count` must be the library's number of joints.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if there is not one matrix for each joint, or a number is not finite.
///
/// # Safety
/// `matrices` must have 12 × `joint_count` numbers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_set_inverse_bind(
    library: *mut TumbleCrowdLibrary,
    matrices: *const f32,
    joint_count: usize,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        let numbers = product::<f32>(joint_count, 12, "matrices")?;
        // SAFETY: as the caller promises.
        let rows = unsafe { list(matrices, numbers, "matrices")? };
        let (rows, _) = rows.as_chunks::<4>();
        let (matrices, _) = rows.as_chunks::<3>();
        Ok(library.write()?.set_inverse_bind(matrices)?)
    })
}

/// Sets the reference pose of `clip`, from which its additive layers differ: the pose of the clip `from` at `tick`; for
/// ticks after the end of `from`, its last pose.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if one of the two clips does not exist.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_set_reference(
    library: *mut TumbleCrowdLibrary,
    clip: usize,
    from: usize,
    tick: u32,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        Ok(library.write()?.set_reference(clip, from, tick)?)
    })
}

/// Returns the number of joints; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_joint_count(library: *const TumbleCrowdLibrary) -> usize {
    guarded(|| Ok(handle::get(library)?.skeleton.joints().len())).unwrap_or(0)
}

/// Returns the number of clips; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_clip_count(library: *const TumbleCrowdLibrary) -> usize {
    guarded(|| Ok(handle::get(library)?.read()?.clip_count())).unwrap_or(0)
}

/// Returns the number of ticks in a second; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_ticks_per_second(library: *const TumbleCrowdLibrary) -> u32 {
    guarded(|| Ok(handle::get(library)?.read()?.ticks_per_second())).unwrap_or(0)
}

/// Returns the length of a clip in ticks: from its first key (of a rotation, translation or scale) to its last, and
/// at least 1; 0 if there is no such clip.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_clip_ticks(
    library: *const TumbleCrowdLibrary,
    clip: usize,
) -> u32 {
    let ticks = guarded(|| {
        let library = handle::get(library)?;
        let library = library.read()?;
        let (ticks, count) = (library.ticks(clip), library.clip_count());
        ticks.ok_or_else(|| {
            let message = format!("there is no clip {clip}; the library has {count}");
            Failure::new(TumbleResult::OutOfRange, message)
        })
    });
    ticks.unwrap_or(0)
}

/// Returns the name of a joint: UTF-8, valid until the library is freed; null if there is no such joint.
///
/// In a library of `tumble_crowd_library_new` names are empty until the first set is added, whose names the joints then
/// have. A joint without a name is `box1`, `box2` … by its index.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_joint_name(
    library: *const TumbleCrowdLibrary,
    joint: usize,
) -> *const c_char {
    let name = guarded(|| {
        let library = handle::get(library)?;
        let count = library.skeleton.joints().len();
        if joint >= count {
            let message = format!("there is no joint {joint}; the library has {count}");
            return Err(Failure::new(TumbleResult::OutOfRange, message));
        }
        let name = library.names()?.and_then(|names| names.get(joint));
        Ok(name.map_or(c"", CString::as_c_str).as_ptr())
    });
    name.unwrap_or(std::ptr::null())
}

/// Copies the indices of the joints' parents into `parents`, -1 for a root. `joint_count` must be the number of
/// joints.
///
/// # Errors
/// `TUMBLE_RESULT_WRONG_SIZE` if `joint_count` is another number.
///
/// # Safety
/// `parents` must have memory for `joint_count` numbers, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_parents(
    library: *const TumbleCrowdLibrary,
    parents: *mut i32,
    joint_count: usize,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        let joints = library.skeleton.joints().len();
        if joint_count != joints {
            let message =
                format!("`joint_count` is {joint_count}; the library has {joints} joints");
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        // SAFETY: as the caller promises.
        let parents = unsafe { list_mut(parents, joint_count, "parents")? };
        for (parent, joint) in parents.iter_mut().zip(library.skeleton.joints()) {
            // Indices of skeletons made of arrays have 31 bits, and files have no more joints.
            *parent = joint.parent.map_or(-1, |parent| parent as i32);
        }
        Ok(())
    })
}

/// Frees a library. Crowds that were made from it stay valid. Does nothing if `library` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_free(library: *mut TumbleCrowdLibrary) -> TumbleResult {
    code(|| handle::free(library))
}
