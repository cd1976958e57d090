//! Stages of poses on the host, between which an application may change matrices.

use tumble::crowd::{CrowdError, CrowdLibrary};

use crate::arguments::list_mut;
use crate::crowd::library::TumbleCrowdLibrary;
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// Converts matrices of `TUMBLE_CROWD_VALUES_LOCAL` to those of `TUMBLE_CROWD_VALUES_MODEL`, in place, with the bits of
/// a crowd that evaluates `TUMBLE_CROWD_VALUES_MODEL` directly.
///
/// Before, the application may change the local matrices, for example by inverse kinematics. `poses` are 12 numbers for
/// each joint of each instance, in the order of results, of any number of instances; `count` is the number of floats.
/// Several threads may convert a part each. `tumble_crowd_stage_target_new` is the same on a device.
///
/// # Errors
/// `TUMBLE_RESULT_WRONG_SIZE` if `count` is not a whole number of instances: 12 × the library's joints each.
///
/// # Safety
/// `poses` must have `count` floats, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_local_to_model(
    library: *const TumbleCrowdLibrary,
    poses: *mut f32,
    count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    unsafe { convert(library, poses, count, CrowdLibrary::local_to_model) }
}

/// Converts matrices of `TUMBLE_CROWD_VALUES_MODEL` to those of `TUMBLE_CROWD_VALUES_SKINNING`, in place, as
/// `tumble_crowd_library_local_to_model`.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `count` is not a whole number of instances.
/// - `TUMBLE_RESULT_WRONG_STATE` if the library has no inverse bind matrices.
///
/// # Safety
/// As for `tumble_crowd_library_local_to_model`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_model_to_skinning(
    library: *const TumbleCrowdLibrary,
    poses: *mut f32,
    count: usize,
) -> TumbleResult {
    // SAFETY: as the caller promises.
    unsafe { convert(library, poses, count, CrowdLibrary::model_to_skinning) }
}

/// Calls the stage `convert` with the caller's matrices.
///
/// # Safety
/// As for `tumble_crowd_library_local_to_model`.
unsafe fn convert(
    library: *const TumbleCrowdLibrary,
    poses: *mut f32,
    count: usize,
    convert: impl FnOnce(&CrowdLibrary, &mut [[f32; 4]]) -> Result<(), CrowdError>,
) -> TumbleResult {
    code(|| {
        let library = handle::get(library)?;
        let library = library.read()?;
        let each = 12 * library.joint_count();
        if !count.is_multiple_of(each) {
            let message = format!(
                "`count` is {count}, which is no multiple of {each}: 12 numbers for each joint of an instance"
            );
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        // SAFETY: as the caller promises.
        let poses = unsafe { list_mut(poses, count, "poses")? };
        Ok(convert(&library, poses.as_chunks_mut().0)?)
    })
}
