// Stores some numbers of every sample's states.

// The word of each number in the states of a sample.
@group(0) @binding(0) var<storage, read> picks: array<u32>;
// Words: what is stored is a copy.
@group(0) @binding(1) var<storage, read> states: array<u32>;
@group(0) @binding(2) var<storage, read_write> values: array<u32>;

// `index` is a number of the result. Of each sample there are `dispatch.numbers`; their picks begin at `dispatch.vector`,
// and its states have `dispatch.joints` vectors.
fn motion_work(index: u32) {
    let sample = index / dispatch.numbers;
    let pick = picks[dispatch.vector + (index - sample * dispatch.numbers)];
    values[index] = states[sample * dispatch.joints * 4u + pick];
}
