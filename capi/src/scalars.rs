//! Scalars of sets: numbers over time in addition to the tracks, such as the angles of a robot's joints.

use std::ffi::c_char;
use std::sync::PoisonError;

use tumble::ScalarQuantity;

use crate::arguments::{list, list_mut, option, product, text};
use crate::engine::TumbleEngine;
use crate::handle;
use crate::interpolation::TumbleInterpolation;
use crate::result::{Failure, TumbleResult, code, guarded};
use crate::samples::{TumbleSamples, layout};
use crate::set::TumbleSet;

/// The quantity evaluated of scalars.
#[repr(u32)]
#[derive(Debug, Clone, Copy)]
pub enum TumbleScalarQuantity {
    /// The number itself.
    Value = 0,
    /// Its derivative, per second: that of the curve, not a difference of samples.
    Velocity = 1,
    /// Its second derivative, per second squared.
    Acceleration = 2,
}

/// Appends a scalar to a set: a number that changes over time, such as the angle of a hinge or a weight, with
/// `key_count` keys, at least one. A set may have scalars without tracks.
///
/// `name` is the scalar's name in UTF-8. `times` are the key times in seconds, strictly increasing, and `keys` a number
/// for each. `tangents` are for the method "gltf-cubic" and may be null: two numbers for each time, the incoming
/// tangent and the outgoing one, in units per second. Arrays and name are copied.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_INPUT` if there are no keys, the times are not finite and strictly increasing, or a number
/// is not finite or exceeds 1e30 in magnitude. After any error the set is unchanged.
///
/// # Safety
/// `name` must be a text that ends with a zero byte; `times` and `keys` must have `key_count` numbers; `tangents` must
/// be null or have 2 × `key_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_set_push_scalar(
    set: *mut TumbleSet,
    name: *const c_char,
    times: *const f64,
    keys: *const f32,
    tangents: *const f32,
    key_count: usize,
) -> TumbleResult {
    code(|| {
        let set = handle::get(set)?;
        let of_tangents = match tangents.is_null() {
            true => 0,
            false => product::<f32>(key_count, 2, "tangents")?,
        };
        // SAFETY: as the caller promises.
        let (name, times, keys, tangents) = unsafe {
            (
                text(name, "name")?,
                list(times, key_count, "times")?,
                list(keys, key_count, "keys")?,
                list(tangents, of_tangents, "tangents")?,
            )
        };
        let name = name.ok_or_else(|| Failure::argument("`name` is null".to_owned()))?;
        let (tangents, _) = tangents.as_chunks::<2>();
        let mut tracks = set.inner.write().unwrap_or_else(PoisonError::into_inner);
        tracks.push_scalar(name, times, keys, tangents)?;
        Ok(())
    })
}

/// Returns the number of scalars; 0 if the handle is invalid.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_set_scalar_count(set: *const TumbleSet) -> usize {
    guarded(|| Ok(handle::get(set)?.read().scalar_count())).unwrap_or(0)
}

/// Evaluates the scalars of a set, or how fast they change, into the caller's memory, and waits for the result.
///
/// `interpolation` may be null for the defaults. The method of `interpolation` determines how scalars are interpolated,
/// as it does for translations (docs/methods.md): "slerp" along lines, "bessel-overhauser" with continuous velocities.
/// The ends and wraps of `interpolation` apply; its quantity is ignored. `quantity` is a `TumbleScalarQuantity`,
/// `layout` a `TumbleLayout`. `output` receives a float for each sample of each scalar. `output_count` is the number of
/// floats, exactly scalars × samples (`tumble_set_scalar_count`, `tumble_set_sample_count`).
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if `output_count` is another number.
/// - Otherwise as `tumble_evaluate`.
///
/// On an error nothing is written.
///
/// # Safety
/// As `tumble_evaluate`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_scalars_evaluate(
    engine: *const TumbleEngine,
    set: *const TumbleSet,
    interpolation: *const TumbleInterpolation,
    samples: *const TumbleSamples,
    quantity: u32,
    layout: u32,
    output: *mut f32,
    output_count: usize,
) -> TumbleResult {
    code(|| {
        let (engine, set) = (handle::get(engine)?, handle::get(set)?);
        // SAFETY: as the caller promises.
        let (how, frames) = unsafe {
            let how = TumbleInterpolation::read(interpolation)?;
            (how, TumbleSamples::read(samples)?)
        };
        let quantity = option(quantity, &ScalarQuantity::ALL, "quantity")?;
        let layout = self::layout(layout)?;
        let set = set.read();
        let timeline = frames.resolve(set.scalar_count(), set.time_span())?;
        let (scalars, samples) = (set.scalar_count(), timeline.len());
        if output_count as u128 != scalars as u128 * samples as u128 {
            let message = format!(
                "`output_count` is {output_count}; the result has {scalars} scalars × {samples} samples"
            );
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        // SAFETY: as the caller promises.
        let output = unsafe { list_mut(output, output_count, "output")? };
        let method = how.method.scalar_method();
        let found = (engine.inner).scalars(&set, quantity, method, how, &frames, layout)?;
        output.copy_from_slice(found.as_slice());
        Ok(())
    })
}
