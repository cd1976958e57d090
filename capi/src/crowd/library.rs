//! Libraries of clips for one skeleton.

use std::ffi::{CString, c_char};
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

use glam::{Affine3A, Mat3A, Vec3, Vec3A};
use tumble::crowd::CrowdLibrary;
use tumble::{Skeleton, VectorMethod};
use tumble_formats::motion::Transform;

use crate::arguments::{Out, list, list_mut, product, text};
use crate::handle::{self, Object};
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code, guarded};
use crate::set::TumbleSet;

/// Clips of one skeleton, prepared for crowds. Any number of threads may use it at once.
pub struct TumbleCrowdLibrary {
    inner: RwLock<CrowdLibrary>,
    pub(crate) joints: Vec<LibraryJoint>,
}

/// A joint, and where it is where no clip moves it.
#[derive(Debug, Clone, Default)]
pub(crate) struct LibraryJoint {
    /// Empty in libraries that were made of arrays.
    pub(crate) name: CString,
    pub(crate) parent: Option<usize>,
    pub(crate) rest: Transform,
}

impl Object for TumbleCrowdLibrary {
    const NAME: &'static str = "crowd library";
}

impl TumbleCrowdLibrary {
    /// An empty library; 0 ticks stand for the default.
    pub(crate) fn new(joints: Vec<LibraryJoint>, ticks_per_second: u32) -> Result<Self, Failure> {
        let parents = joints.iter().map(|joint| joint.parent).collect();
        let offsets = joints.iter().map(|joint| joint.rest.translation).collect();
        let skeleton = Skeleton::new(parents, offsets)?;
        let library = match ticks_per_second {
            0 => CrowdLibrary::new(&skeleton)?,
            ticks => CrowdLibrary::with_ticks(&skeleton, ticks)?,
        };
        let inner = RwLock::new(library);
        Ok(Self { inner, joints })
    }

    pub(crate) fn read(&self) -> Result<RwLockReadGuard<'_, CrowdLibrary>, Failure> {
        handle::locked::<Self, _>(self.inner.read())
    }

    pub(crate) fn write(&self) -> Result<RwLockWriteGuard<'_, CrowdLibrary>, Failure> {
        handle::locked::<Self, _>(self.inner.write())
    }
}

/// Creates an empty library for a skeleton that is given by arrays. `parents` has the index of each joint's parent, -1 for a
/// root; parents may come after their children. `offsets` has three numbers for each joint: where it
/// is in its parent's frame if a clip has no translations for it; null: at the parent.
/// `ticks_per_second`: the unit of all times, 0 for 705 600, which allows clips of 50 minutes.
///
/// # Safety
/// `parents` has `joint_count` numbers, `offsets` is null or has three times as many, and `library` has
/// room for a handle.
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
        let numbers = if offsets.is_null() {
            0
        } else {
            product::<f32>(joint_count, 3, "offsets")?
        };
        // SAFETY: as the caller promises.
        let (parents, offsets) = unsafe {
            (
                list(parents, joint_count, "parents")?,
                list(offsets, numbers, "offsets")?,
            )
        };
        let (offsets, _) = offsets.as_chunks::<3>();
        let joint = |(joint, &parent): (usize, &i32)| {
            let mut library_joint = LibraryJoint {
                parent: usize::try_from(parent).ok(),
                ..LibraryJoint::default()
            };
            if library_joint.parent.is_none() && parent != -1 {
                let message = format!("`parents[{joint}]` is {parent}; that of a root is -1");
                return Err(Failure::argument(message));
            }
            if let Some(&offset) = offsets.get(joint) {
                library_joint.rest.translation = Vec3::from_array(offset);
            }
            Ok(library_joint)
        };
        let joints = parents.iter().enumerate().map(joint);
        let made = TumbleCrowdLibrary::new(joints.collect::<Result<_, _>>()?, ticks_per_second)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(made)) };
        Ok(())
    })
}

/// The method for translations and scales that a name says.
///
/// # Safety
/// `name` is null or text that ends with a zero.
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

/// Adds a clip: a track for each joint, in their order, the rotations by `interpolation` and the
/// translations and scales by `vectors`: "step", "linear", "catmull-rom", "bessel-overhauser",
/// "gltf-cubic", "c2" or "b-spline"; null is "linear". Joints without translations hang at their
/// offsets. Instances say what happens outside the keys, so `before` and `after` do not count. The
/// clip's reference pose, for additive layers, is its pose at its start. If anything is refused, the
/// library is as it was.
///
/// # Safety
/// `interpolation` is null (the defaults) or such a structure, `vectors` null or text that ends with a
/// zero, and `clip`, where the clip's number goes, null or room for one.
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

/// Adds a mask, a weight from 0 to 1 for each joint, which layers' weights are multiplied with. There
/// can be 31. `mask` gets its number, from 1, as `TumbleCrowdLayer.mask` takes it.
///
/// # Safety
/// `weights` has `joint_count` numbers, and `mask` is null or has room for a number.
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

/// Sets the inverse bind matrix of every joint: the inverse of its model matrix in the bind pose,
/// three rows of four numbers each, for column vectors, the last column the translation, as results are.
/// (A matrix of 16 numbers in columns, as glTF has them, has `m[0] m[4] m[8] m[12]` in its first row.)
///
/// # Safety
/// `matrices` has 12 × `joint_count` numbers.
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
        let matrix = |rows: &[[f32; 4]; 3]| {
            let column = |i: usize| Vec3A::from_array(rows.map(|row| row[i]));
            Affine3A {
                matrix3: Mat3A::from_cols(column(0), column(1), column(2)),
                translation: column(3),
            }
        };
        let matrices: Vec<Affine3A> = matrices.iter().map(matrix).collect();
        Ok(library.write()?.set_inverse_bind(&matrices)?)
    })
}

/// Makes the pose of the clip `from` at a tick, held at its ends, the reference pose of `clip`: what
/// additive layers of it differ from.
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

/// The number of joints; 0 for an invalid handle.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_joint_count(library: *const TumbleCrowdLibrary) -> usize {
    guarded(|| Ok(handle::get(library)?.joints.len())).unwrap_or(0)
}

/// The number of clips; 0 for an invalid handle.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_clip_count(library: *const TumbleCrowdLibrary) -> usize {
    guarded(|| Ok(handle::get(library)?.read()?.clip_count())).unwrap_or(0)
}

/// Ticks of a second; 0 for an invalid handle.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_ticks_per_second(library: *const TumbleCrowdLibrary) -> u32 {
    guarded(|| Ok(handle::get(library)?.read()?.ticks_per_second())).unwrap_or(0)
}

/// The length of a clip, ticks: from the first key of any channel to the last, at least 1. 0 if there
/// is no such clip.
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

/// The name of a joint, empty in libraries that were made of arrays: UTF-8, valid until the library is
/// freed; null where there is no such joint.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_joint_name(
    library: *const TumbleCrowdLibrary,
    joint: usize,
) -> *const c_char {
    let name = guarded(|| {
        let library = handle::get(library)?;
        let count = library.joints.len();
        let found = library.joints.get(joint).map(|joint| joint.name.as_ptr());
        found.ok_or_else(|| {
            let message = format!("there is no joint {joint}; the library has {count}");
            Failure::new(TumbleResult::OutOfRange, message)
        })
    });
    name.unwrap_or(std::ptr::null())
}

/// The index of each joint's parent, -1 for a root: `joint_count` numbers, exactly as many as there are
/// joints.
///
/// # Safety
/// `parents` has room for `joint_count` numbers, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_parents(
    library: *const TumbleCrowdLibrary,
    parents: *mut i32,
    joint_count: usize,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        let joints = library.joints.len();
        if joint_count != joints {
            let message =
                format!("`joint_count` is {joint_count}; the library has {joints} joints");
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        // SAFETY: as the caller promises.
        let parents = unsafe { list_mut(parents, joint_count, "parents")? };
        for (parent, joint) in parents.iter_mut().zip(&library.joints) {
            // Indices of skeletons made of arrays have 31 bits, and files have no more joints.
            *parent = joint.parent.map_or(-1, |parent| parent as i32);
        }
        Ok(())
    })
}

/// Frees a library; crowds that were made of it stay. Null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_library_free(library: *mut TumbleCrowdLibrary) -> TumbleResult {
    code(|| handle::free(library))
}
