//! Crowds, the layers of their instances, and the clock.

use std::sync::{Mutex, MutexGuard};

use tumble::crowd::{Crowd, CrowdLayer};

use crate::arguments::{Out, needed, sized_list};
use crate::crowd::layer::TumbleCrowdLayer;
use crate::crowd::library::TumbleCrowdLibrary;
use crate::engine::TumbleEngine;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};

/// A crowd: many instances of a library's skeleton, each of which plays clips at its time and speed. Calls of several
/// threads on the same crowd run one after another.
pub struct TumbleCrowd {
    state: Mutex<State>,
    /// Whether its engine is on the application's Vulkan device.
    pub(crate) is_on_application_device: bool,
}

pub(crate) struct State {
    pub(crate) inner: Crowd,
    /// Memory for the changes of a call, reused by the next one.
    changes: Vec<(usize, usize, CrowdLayer)>,
}

impl Object for TumbleCrowd {
    const NAME: &'static str = "crowd";
}

impl TumbleCrowd {
    pub(crate) fn lock(&self) -> Result<MutexGuard<'_, State>, Failure> {
        handle::locked::<Self, _>(self.state.lock())
    }
}

/// Creates a crowd of 1 to 1 000 000 instances with 1 to 4 layers each, on an engine's device.
///
/// All instances stand still at the start of the library's first clip until `tumble_crowd_set` changes them; the
/// layers above the first have weight 0. The clock starts at 0. The library is copied, also to the device: later
/// changes of it do not reach the crowd. The engine and the library may be freed before the crowd. The caller frees
/// the crowd with `tumble_crowd_free`.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_STATE` if the library has no clips.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the number of instances or layers is out of range.
/// - `TUMBLE_RESULT_OUT_OF_MEMORY` or `TUMBLE_RESULT_DEVICE` if there is not enough memory or the device fails.
///
/// # Safety
/// `crowd` must point to memory for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_new(
    engine: *const TumbleEngine,
    library: *const TumbleCrowdLibrary,
    instances: usize,
    layers: usize,
    crowd: *mut *mut TumbleCrowd,
) -> TumbleResult {
    code(|| {
        let out = Out::new(crowd, "crowd")?;
        let (engine, library) = (handle::get(engine)?, handle::get(library)?);
        let library = library.read()?;
        let inner = engine.inner.crowd(&library, instances, layers)?;
        let changes = Vec::new();
        let made = TumbleCrowd {
            state: Mutex::new(State { inner, changes }),
            is_on_application_device: engine.is_on_application_device,
        };
        // SAFETY: as the caller promises.
        unsafe { out.set(handle::give(made)) };
        Ok(())
    })
}

/// Sets the clips that layers of instances play from now on. `layers` is an array of `count` changes.
///
/// A fade of a layer that is set ends. If two changes are for one layer, the later one counts. The changes, at most
/// 20 bytes each, reach the device with the next evaluation.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance, layer, clip or mask.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if another member is invalid.
///
/// The message has the index of the first change that is refused. After any error nothing changes.
///
/// # Safety
/// `layers` must have `count` structures.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set(
    crowd: *mut TumbleCrowd,
    layers: *const TumbleCrowdLayer,
    count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let layers = unsafe { sized_list(layers, count, "layers")? };
        let mut state = crowd.lock()?;
        let State { inner, changes } = &mut *state;
        changes.clear();
        for (index, layer) in layers.enumerate() {
            changes.push(layer?.change(index)?);
        }
        Ok(inner.set_all(changes)?)
    })
}

/// Returns the clip that a layer of an instance plays, with its current time and its rounded speed and weight.
///
/// The caller sets `layer->size`, `layer->instance` and `layer->layer`; the call writes the other members.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
///
/// # Safety
/// `layer` must point to a `TumbleCrowdLayer`, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_get(
    crowd: *const TumbleCrowd,
    layer: *mut TumbleCrowdLayer,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let requested = unsafe { needed(layer.cast_const(), "layer")? };
        let out = Out::new(layer, "layer")?;
        let plays = crowd
            .lock()?
            .inner
            .get(requested.instance, requested.layer)?;
        // SAFETY: as the caller promises.
        unsafe {
            let found = TumbleCrowdLayer {
                size: requested.size,
                ..TumbleCrowdLayer::new(requested.instance, requested.layer, plays)
            };
            out.set_sized(&found, requested.size);
        }
        Ok(())
    })
}

/// Returns the tick of its clip at which a layer of an instance is evaluated now, from 0 to the clip's length.
///
/// # Errors
/// `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such instance or layer.
///
/// # Safety
/// `tick` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_tick(
    crowd: *const TumbleCrowd,
    instance: usize,
    layer: usize,
    tick: *mut u32,
) -> TumbleResult {
    code(|| {
        let out = Out::new(tick, "tick")?;
        let found = handle::get(crowd)?.lock()?.inner.tick(instance, layer)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(found) };
        Ok(())
    })
}

/// Moves the clock of all instances forward by `seconds`, rounded to ticks.
///
/// The rounding errors of many steps add up. If the clock must follow frames exactly, as in a film at 30000/1001
/// frames a second, use `tumble_crowd_set_clock` with each frame's time.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_ARGUMENT` if `seconds` is negative or not finite, or the clock would reach 2^52 ticks.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_advance(crowd: *mut TumbleCrowd, seconds: f64) -> TumbleResult {
    code(|| Ok(handle::get(crowd)?.lock()?.inner.advance(seconds)?))
}

/// Sets the clock's time in ticks, forwards or backwards. All instances follow.
///
/// # Errors
/// `TUMBLE_RESULT_INVALID_ARGUMENT` if `ticks` is 2^52 or more.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_set_clock(crowd: *mut TumbleCrowd, ticks: u64) -> TumbleResult {
    code(|| Ok(handle::get(crowd)?.lock()?.inner.set_clock(ticks)?))
}

/// Returns the clock's time in ticks.
///
/// # Safety
/// `ticks` must point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_clock(
    crowd: *const TumbleCrowd,
    ticks: *mut u64,
) -> TumbleResult {
    code(|| {
        let out = Out::new(ticks, "ticks")?;
        let clock = handle::get(crowd)?.lock()?.inner.clock();
        // SAFETY: as the caller promises.
        unsafe { out.set(clock) };
        Ok(())
    })
}

/// Frees a crowd, after waiting for a submitted evaluation. Its targets stay valid until they are freed. Does nothing
/// if `crowd` is null.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_free(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| handle::free(crowd))
}
