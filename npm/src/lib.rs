//! Tumble for JavaScript: the WebAssembly module behind the npm package `tumble`.
//!
//! A call is a number (`calls`), a header in JSON and bytes behind it; its answer is JSON and arrays of
//! numbers. JavaScript writes the call where [`tumble_input`] says, and copies the answer from where it lies. Only the
//! poses of samplers, of which programs want many, come without JSON ([`tumble_pose`]):
//! six functions and no generated code. `npm/package/core.js` is the other side.

// Tests may use what systems round differently (clippy.toml).
#![cfg_attr(test, allow(clippy::disallowed_methods))]
// Names that JavaScript finds; there is no block of unsafe code.
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

/// Makes room for a call of so many bytes. Its address; 0 where there is not so much memory.
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

/// Makes the call of that number; the first bytes of the input are its header. 1 where it was done, 0 where the
/// answer says why not.
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

/// The track that stands for all of them.
const EVERY_TRACK: u32 = u32::MAX;

/// Where the rotations of a sampler at a time lie, four f32 each: of one track, or of every one if `track` is
/// 2^32 - 1. 0 where the answer says why there are none.
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

/// Where the answer's JSON lies.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_answer() -> *const u8 {
    BORDER.with_borrow(|border| border.answer.json.as_ptr())
}

/// How many bytes it has.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_answer_bytes() -> usize {
    BORDER.with_borrow(|border| border.answer.json.len())
}

/// Where an array of the answer lies, of which its JSON says how long it is; 0 for none.
#[unsafe(no_mangle)]
pub extern "C" fn tumble_array(index: usize) -> *const u8 {
    BORDER.with_borrow(|border| {
        let array = border.answer.arrays.get(index);
        array.map_or(std::ptr::null(), |array| array.bytes().as_ptr())
    })
}
