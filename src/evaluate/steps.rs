//! For tests: the steps that engines took, recorded as they are taken.

use std::sync::Mutex;

use crate::machine::Machine;
use crate::machine::plan::Rows;
use crate::threads::lock;

/// A step of an evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Step {
    /// Rows of samples on a route.
    Rows(Rows),
    /// Rows that are copied into frames.
    Transposed,
    /// Segments that are prepared together.
    Piece,
}

/// The steps of all engines, each with the address of the engine's machine, because tests run at the same time.
static NOTES: Mutex<Vec<(usize, Step)>> = Mutex::new(Vec::new());

fn address_of(machine: &dyn Machine) -> usize {
    std::ptr::from_ref(machine).cast::<()>().addr()
}

pub(crate) fn take_note(machine: &dyn Machine, step: Step) {
    lock(&NOTES).push((address_of(machine), step));
}

/// Returns the steps of an engine since the last call.
pub(crate) fn of(machine: &dyn Machine) -> Vec<Step> {
    let address = address_of(machine);
    let mut notes = lock(&NOTES);
    let steps = notes.iter().filter(|(of, _)| *of == address);
    let steps = steps.map(|(_, step)| *step).collect();
    notes.retain(|(of, _)| *of != address);
    steps
}
