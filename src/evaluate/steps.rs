//! For tests: what engines did, noted where they do it.

use std::sync::Mutex;

use crate::evaluate::Backend;
use crate::evaluate::plan::Route;
use crate::threads::lock;

/// A step of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    /// Rows of samples on a route.
    Rows(Route),
    /// Rows that are copied into frames.
    Transposed,
    /// Segments that are prepared together.
    Piece,
}

/// Tests run at the same time: the notes of each engine are its own, by the address of its device.
static NOTES: Mutex<Vec<(usize, Step)>> = Mutex::new(Vec::new());

pub(crate) fn take_note(backend: &Backend, step: Step) {
    lock(&NOTES).push((std::ptr::from_ref(backend).addr(), step));
}

/// Returns the steps of an engine since the last call.
pub(crate) fn of(backend: &Backend) -> Vec<Step> {
    let address = std::ptr::from_ref(backend).addr();
    let mut notes = lock(&NOTES);
    let steps = notes.iter().filter(|(of, _)| *of == address);
    let steps = steps.map(|(_, step)| *step).collect();
    notes.retain(|(of, _)| *of != address);
    steps
}
