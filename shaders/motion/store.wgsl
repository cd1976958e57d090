// Stores a vector of every joint's state, or the first numbers of it.

// Words: what is stored is a copy.
@group(0) @binding(0) var<storage, read> states: array<u32>;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;

// `index` is a number of the result.
fn motion_work(index: u32) {
    let joint = index / dispatch.numbers;
    let vector = joint * STATE_VECTORS + dispatch.vector;
    values[index] = states[vector * 4u + (index - joint * dispatch.numbers)];
}
