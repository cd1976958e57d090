//! Tumble for JavaScript: the WebAssembly module behind the npm package `tumble`.
//!
//! The interface has six functions and no generated code. A call is a number (`calls`), a header in JSON, and bytes after
//! it; its answer is JSON plus arrays of numbers. JavaScript writes the call to the address from [`tumble_input`], and
//! copies the answer from the module's memory. Poses of samplers come without JSON ([`tumble_pose`]), because programs
//! request thousands per second. `npm/package/core.js` is the caller.

// Tests may use functions whose rounding depends on the system (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
// `no_mangle` counts as unsafe code. The exports need it to have names; there are no unsafe blocks.
#![allow(unsafe_code)]

mod answer;
mod calls;
mod sampling;
#[cfg(test)]
mod tests;

use std::cell::RefCell;

use crate::answer::Answer;
use crate::calls::Calls;

/// The memory that JavaScript and the engine share: the input and the answer of a call.
#[derive(Default)]
struct Border {
    input: Vec<u8>,
    answer: Answer,
    calls: Calls,
}

thread_local! {
    static BORDER: RefCell<Border> = RefCell::new(Border::default());
}

/// Allocates the input of a call, `bytes` long. Returns its address, or 0 if there is not enough memory.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_input(bytes: usize) -> *mut u8 {
    BORDER.with_borrow_mut(|border| {
        border.answer = Answer::default();
        let mut input = Vec::new();
        if input.try_reserve_exact(bytes.max(1)).is_err() {
            return std::ptr::null_mut();
        }
        input.resize(bytes, 0);
        border.input = input;
        border.input.as_mut_ptr()
    })
}

/// Executes the call with this number; the first `header_bytes` of the input are its header. Returns 1, or 0 on error;
/// the answer then contains the error.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_call(call: u32, header_bytes: usize) -> u32 {
    BORDER.with_borrow_mut(|border| {
        let mut header = std::mem::take(&mut border.input);
        let numbers = header.split_off(header_bytes.min(header.len()));
        match border.calls.call(call, &header, numbers) {
            Ok(answer) => {
                border.answer = answer;
                1
            }
            Err(fault) => {
                border.answer = fault.into_answer();
                0
            }
        }
    })
}

/// The value of `track` that selects all tracks.
const EVERY_TRACK: u32 = u32::MAX;

/// Samples a sampler at a time [s]: one track, or all if `track` is 2^32 - 1. Returns the address of the rotations, four
/// f32 each, or 0 on error; the answer then contains the error.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_pose(sampler: usize, track: u32, time: f64) -> *const u8 {
    let track = (track != EVERY_TRACK).then_some(track as usize);
    BORDER.with_borrow_mut(|border| match border.calls.pose(sampler, track, time) {
        Ok(pose) => pose.as_ptr().cast(),
        Err(fault) => {
            border.answer = fault.into_answer();
            std::ptr::null()
        }
    })
}

/// The address of the answer's JSON.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_answer() -> *const u8 {
    BORDER.with_borrow(|border| border.answer.json.as_ptr())
}

/// The length of the answer's JSON, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_answer_bytes() -> usize {
    BORDER.with_borrow(|border| border.answer.json.len())
}

/// The address of array `index` of the answer, or 0 if there is none. The answer's JSON contains its length.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_array(index: usize) -> *const u8 {
    BORDER.with_borrow(|border| {
        let array = border.answer.arrays.get(index);
        array.map_or(std::ptr::null(), |array| array.bytes().as_ptr())
    })
}
