//! Weights of layers: set at once, or changed by the clock.

use tumble::crowd::CrowdFade;

use crate::arguments::{Out, SizedStructure, needed};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{TumbleResult, code};

/// A fade: a layer's weight that changes linearly with the clock. The weight is `from` until the tick `start`,
/// reaches `to` after `ticks` ticks, and then stays.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleCrowdFade {
    /// `sizeof(TumbleCrowdFade)`.
    pub size: usize,
    /// The index of the instance, from 0.
    pub instance: usize,
    /// The index of the layer in the instance, from 1: layer 0 has no weight.
    pub layer: usize,
    /// The clock's time in ticks at which the fade starts; in the past or in the future.
    pub start: u64,
    /// The duration of the fade in ticks; with 0 the weight changes at once.
    pub ticks: u64,
    /// The weight before the fade, 0 to 1, rounded to a multiple of 2^-15.
    pub from: f32,
    /// The weight after the fade, 0 to 1, rounded to a multiple of 2^-15.
    pub to: f32,
}

// SAFETY: `repr(C)`, the size is the first member, and zero bits are valid numbers.
unsafe impl SizedStructure for TumbleCrowdFade {
    const FIRST_SIZE: usize = size_of::<Self>();
}

/// Sets the weight of a layer above layer 0: 0 to 1, rounded to a multiple of 2^-15. The layer's clip, time and speed
/// stay, and its fade ends.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.
///
/// After any error nothing changes.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_set_weight(
    crowd: *mut TumbleCrowd,
    instance: usize,
    layer: usize,
    weight: f32,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        Ok(crowd.lock()?.inner.set_weight(instance, layer, weight)?)
    })
}

/// Fades the weight of a layer above layer 0 from its current value to `weight`, linearly within `ticks` of the
/// clock. With 0 ticks it changes at once.
///
/// Afterwards the weight stays. `tumble_crowd_set`, `tumble_crowd_set_weight` and another fade of the layer end the
/// fade.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.
///
/// After any error nothing changes.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_fade(
    crowd: *mut TumbleCrowd,
    instance: usize,
    layer: usize,
    weight: f32,
    ticks: u64,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        Ok(crowd.lock()?.inner.fade(instance, layer, weight, ticks)?)
    })
}

/// Sets the weight of a layer above layer 0 as a function of the clock. Unlike that of `tumble_crowd_fade`, this fade
/// starts at any weight and at any time, past or future.
///
/// The fade that `tumble_crowd_get_fade` returns, set in another crowd at the same time of the clock, gives the same
/// weights at all times.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the layer is layer 0, or a weight is outside 0 to 1.
///
/// After any error nothing changes.
///
/// # Safety
/// `fade` must point to a `TumbleCrowdFade`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set_fade(
    crowd: *mut TumbleCrowd,
    fade: *const TumbleCrowdFade,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let fade = unsafe { needed(fade, "fade")? };
        let set = CrowdFade::new(fade.from, fade.to)
            .with_start(fade.start)
            .with_ticks(fade.ticks);
        Ok((crowd.lock()?.inner).set_fade(fade.instance, fade.layer, set)?)
    })
}

/// Returns the fade of a layer's weight, with its rounded weights; also a fade that has ended, because the clock may
/// go back.
///
/// The caller sets `fade->size`, `fade->instance` and `fade->layer`. `fades` receives whether the layer has a fade.
/// If it has, the call writes the other members of `fade`; otherwise `fade` is unchanged.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
///
/// # Safety
/// `fade` must point to a `TumbleCrowdFade`, which nothing else uses during the call, and `fades` must point to
/// memory for a `bool`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_get_fade(
    crowd: *const TumbleCrowd,
    fade: *mut TumbleCrowdFade,
    fades: *mut bool,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        let has_fade = Out::new(fades, "fades")?;
        // SAFETY: as the caller promises.
        let requested = unsafe { needed(fade.cast_const(), "fade")? };
        let out = Out::new(fade, "fade")?;
        let found = (crowd.lock()?.inner).get_fade(requested.instance, requested.layer)?;
        // SAFETY: as the caller promises.
        unsafe {
            has_fade.set(found.is_some());
            if let Some(found) = found {
                let found = TumbleCrowdFade {
                    start: found.start,
                    ticks: found.ticks,
                    from: found.from,
                    to: found.to,
                    ..requested
                };
                out.set_sized(&found, requested.size);
            }
        }
        Ok(())
    })
}
