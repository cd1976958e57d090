//! Crowds, and what their instances play.

use std::sync::{Mutex, MutexGuard};

use tumble::crowd::{Crowd, CrowdLayer};

use crate::arguments::{Out, list, needed};
use crate::crowd::layer::TumbleCrowdLayer;
use crate::crowd::library::TumbleCrowdLibrary;
use crate::engine::TumbleEngine;
use crate::handle::{self, Object};
use crate::result::{Failure, TumbleResult, code};

/// Many instances of a library's skeleton, each of which plays clips at a separate time and speed. Threads
/// that use the same crowd at once wait for each other.
pub struct TumbleCrowd {
    state: Mutex<State>,
    /// Whether its engine is on the application's Vulkan device.
    pub(crate) is_on_application_device: bool,
}

pub(crate) struct State {
    pub(crate) inner: Crowd,
    /// Memory for what is set, kept from call to call.
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

/// Creates a crowd of 1 to 1 000 000 instances with 1 to 4 layers each. All of them stand still at the start of
/// the library's first clip until they are set. The library is copied, to the device too: what is
/// pushed to it later is not in this crowd.
///
/// # Safety
/// `crowd` has room for a handle.
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

/// Sets what layers of instances play from now on: 16 bytes each that reach the device with the next
/// evaluation. Of two for the same layer the later one counts. If one is refused, none is set.
///
/// # Safety
/// `layers` has `count` such structures.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_set(
    crowd: *mut TumbleCrowd,
    layers: *const TumbleCrowdLayer,
    count: usize,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let layers = unsafe { list(layers, count, "layers")? };
        let mut state = crowd.lock()?;
        let State { inner, changes } = &mut *state;
        changes.clear();
        for (index, layer) in layers.iter().enumerate() {
            changes.push(layer.change(index)?);
        }
        Ok(inner.set_all(changes)?)
    })
}

/// What a layer of an instance plays, and where it stands now; speed and weight are as they were rounded.
/// `layer->size`, `layer->instance` and `layer->layer` say which, the rest is written.
///
/// # Safety
/// `layer` is such a structure, which nothing else uses during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_get(
    crowd: *const TumbleCrowd,
    layer: *mut TumbleCrowdLayer,
) -> TumbleResult {
    code(|| {
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let requested = unsafe {
            let size = |pointer: *const TumbleCrowdLayer| (&raw const (*pointer).size).cast();
            needed(layer.cast_const(), size, "layer")?
        };
        let out = Out::new(layer, "layer")?;
        let plays = crowd
            .lock()?
            .inner
            .get(requested.instance, requested.layer)?;
        // SAFETY: as the caller promises.
        unsafe {
            out.set(TumbleCrowdLayer::new(
                requested.instance,
                requested.layer,
                plays,
            ));
        }
        Ok(())
    })
}

/// The tick of its clip at which a layer of an instance is evaluated now, from 0 to the clip's length.
///
/// # Safety
/// `tick` has room for a number.
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

/// Advances the clock of all instances by the ticks nearest to a number of seconds. Where the sum must not
/// drift, as in a film at 30000/1001 frames a second, `tumble_crowd_set_clock` to each frame's ticks.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_advance(crowd: *mut TumbleCrowd, seconds: f64) -> TumbleResult {
    code(|| Ok(handle::get(crowd)?.lock()?.inner.advance(seconds)?))
}

/// Sets the clock, ticks below 2^52; all instances move with it, forwards or backwards.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_set_clock(crowd: *mut TumbleCrowd, ticks: u64) -> TumbleResult {
    code(|| Ok(handle::get(crowd)?.lock()?.inner.set_clock(ticks)?))
}

/// The clock, ticks.
///
/// # Safety
/// `ticks` has room for a number.
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

/// Frees a crowd, after waiting for what was submitted; its targets stay. Null is allowed.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_crowd_free(crowd: *mut TumbleCrowd) -> TumbleResult {
    code(|| handle::free(crowd))
}
