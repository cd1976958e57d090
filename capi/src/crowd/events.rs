//! Events: named moments of clips, and when the instances of a crowd pass them.

use std::ffi::c_char;

use tumble::crowd::PassedEvent;

use crate::arguments::{Number, Out, list_mut, text};
use crate::crowd::library::TumbleCrowdLibrary;
use crate::crowd::player::TumbleCrowd;
use crate::handle;
use crate::result::{Failure, TumbleResult, code};

/// An event that a layer of an instance passed. This structure has no `size`, because calls write arrays of it; it will
/// not change.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TumblePassedEvent {
    /// The clock's time in ticks at which the layer reached the event.
    pub clock: u64,
    /// The index of the instance, from 0.
    pub instance: usize,
    /// The index of the layer in the instance, from 0.
    pub layer: usize,
    /// The event's index in the library, from 0.
    pub event: usize,
    /// The weight of the layer now, 0 to 1.
    pub weight: f32,
}

impl Number for TumblePassedEvent {}

impl From<PassedEvent> for TumblePassedEvent {
    fn from(passed: PassedEvent) -> Self {
        Self {
            clock: passed.clock,
            instance: passed.instance,
            layer: passed.layer,
            event: passed.event,
            weight: passed.weight,
        }
    }
}

/// Adds an event to a clip of a library: a moment such as a step or the throw of a ball, `tick` ticks after the
/// clip's start, up to its length. Crowds that were made before do not have the event.
///
/// `name` may be null: then the event has none. Several events may have one name. `event` receives the event's index; it
/// may be null.
///
/// # Errors
/// - `TUMBLE_RESULT_OUT_OF_RANGE` if there is no such clip.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if the tick is after the clip's end, or the name is not UTF-8.
///
/// # Safety
/// `name` must be null or a text that ends with a zero byte, and `event` null or point to memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_library_push_event(
    library: *mut TumbleCrowdLibrary,
    clip: usize,
    tick: u32,
    name: *const c_char,
    event: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::optional(event, "event")?;
        let library = handle::get(library)?;
        // SAFETY: as the caller promises.
        let name = unsafe { text(name, "name")? }.unwrap_or_default();
        let index = library.write()?.push_event(clip, tick, name)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(index) };
        Ok(())
    })
}

/// Returns the events that the layers of all instances passed after the time `since` of the clock, up to its current
/// time: in the order of the times at which they were passed, then of instances, layers and events.
///
/// `events` has memory for `capacity` events, and `count` receives the number of events. If there are more events than
/// `capacity`, only `count` is written, and the call returns `TUMBLE_RESULT_WRONG_SIZE`: call again with more memory.
/// With `capacity` 0, `events` may be null.
///
/// A layer passes an event when its time in the clip reaches the event's tick, in either direction, and in a loop once in
/// each round. Times are whole ticks, so that one large step passes the same events as many small ones. The clips that
/// the layers play now count, so call this after the clock was moved and before layers get other clips. Layers with
/// weight 0 pass events, too.
///
/// # Errors
/// - `TUMBLE_RESULT_WRONG_SIZE` if there are more events than `capacity`.
/// - `TUMBLE_RESULT_INVALID_ARGUMENT` if `since` is later than the clock.
/// - `TUMBLE_RESULT_OUT_OF_MEMORY` if there is not enough memory for the list.
///
/// # Safety
/// `events` must have memory for `capacity` structures, and `count` must point to memory for a number; nothing else may
/// use them during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn tumble_crowd_passed_events(
    crowd: *const TumbleCrowd,
    since: u64,
    events: *mut TumblePassedEvent,
    capacity: usize,
    count: *mut usize,
) -> TumbleResult {
    code(|| {
        let out = Out::new(count, "count")?;
        let crowd = handle::get(crowd)?;
        // SAFETY: as the caller promises.
        let memory = unsafe { list_mut(events, capacity, "events")? };
        let passed = crowd.lock()?.inner.passed_events(since)?;
        // SAFETY: as the caller promises.
        unsafe { out.set(passed.len()) };
        if passed.len() > capacity {
            let message = format!(
                "{} events were passed, but `capacity` is {capacity}",
                passed.len()
            );
            return Err(Failure::new(TumbleResult::WrongSize, message));
        }
        for (event, passed) in memory.iter_mut().zip(passed) {
            *event = passed.into();
        }
        Ok(())
    })
}
