//! Weights of layers, set at once or faded by the clock.

use tumble::crowd::CrowdFade;

use crate::arguments::{Out, needed};
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{TumbleResult, code};

/// A layer's weight as a function of the clock: `from` before `start`, `to` from `ticks` later on, and between them in
/// equal parts for equal ticks.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct TumbleCrowdFade {
    /// `sizeof(TumbleCrowdFade)`.
    pub size: usize,
    /// The instance, from 0.
    pub instance: usize,
    /// Its layer, from 1: the first has no weight.
    pub layer: usize,
    /// When it starts, ticks of the clock; before now or later.
    pub start: u64,
    /// How many ticks it takes; 0 for a step.
    pub ticks: u64,
    /// The weight before, 0 to 1, kept in units of 2^-15.
    pub from: f32,
    /// The weight after, likewise.
    pub to: f32,
}

/// Sets the weight of a layer above the first, 0 to 1, kept in units of 2^-15. The rest of what it plays goes on, and
/// a fade of it ends.
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

/// Lets the weight of a layer above the first go from what it is now to `weight`, in equal parts for equal ticks of
/// the clock, within `ticks`; 0 is at once. From then on it stays. Another fade of the layer, `tumble_crowd_set` and
/// `tumble_crowd_set_weight` end it.
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

/// Sets the weight of a layer above the first as a function of the clock: as `tumble_crowd_fade`, from any weight and
/// any time. What `tumble_crowd_get_fade` reports, set in another crowd whose clock stands at the same time, gives
/// the same weights at all times.
///
/// # Safety
/// `fade` is such a structure.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set_fade(
    crowd: *mut TumbleCrowd,
    fade: *const TumbleCrowdFade,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let fade = unsafe {
            let size = |pointer: *const TumbleCrowdFade| (&raw const (*pointer).size).cast();
            needed(fade, size, "fade")?
        };
        let set = CrowdFade {
            from: fade.from,
            to: fade.to,
            start: fade.start,
            ticks: fade.ticks,
        };
        Ok((crowd.lock()?.inner).set_fade(fade.instance, fade.layer, set)?)
    })
}

/// The fade that the weight of a layer follows, with its weights as they were rounded; one that has ended too, for
/// the clock may go back. `fade->size`, `fade->instance` and `fade->layer` say which. `fades`: whether there is one;
/// where there is none, the structure stays as it is.
///
/// # Safety
/// `fade` is such a structure, which nothing else uses during the call, and `fades` has room for a truth value.
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
        let requested = unsafe {
            let size = |pointer: *const TumbleCrowdFade| (&raw const (*pointer).size).cast();
            needed(fade.cast_const(), size, "fade")?
        };
        let out = Out::new(fade, "fade")?;
        let found = (crowd.lock()?.inner).get_fade(requested.instance, requested.layer)?;
        // SAFETY: as the caller promises.
        unsafe {
            has_fade.set(found.is_some());
            if let Some(found) = found {
                out.set(TumbleCrowdFade {
                    start: found.start,
                    ticks: found.ticks,
                    from: found.from,
                    to: found.to,
                    ..requested
                });
            }
        }
        Ok(())
    })
}
