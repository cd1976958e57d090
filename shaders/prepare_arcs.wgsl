// Entry point: an invocation prepares the arc of one key interval, where the evaluating kernels read it.
// It is joined with the functions that read buffers (`key_at`, `interval_at`).
// Twin: src/prepare/arcs.rs.

/// The arguments of one dispatch that prepares arcs.
struct ArcsDispatch {
    /// How many there are.
    count: u32,
}

const PREPARE_WORKGROUP: u32 = 64;

// Of an interval: the index of the key that it begins with; the next key ends it.
const KEY_OF_INTERVAL: u32 = 0x3fffffff;

// Set in an interval: the key that it begins with counts with the other sign than it is stored with.
const START_NEGATED: u32 = 0x40000000;

// The same of the key that ends it.
const END_NEGATED: u32 = 0x80000000;

// Half an arc: its middle, or its tangent.
alias Stored = vec4f;

var<immediate> dispatch: ArcsDispatch;

@compute @workgroup_size(PREPARE_WORKGROUP)
fn main(
    @builtin(global_invocation_id) invocation: vec3u,
    @builtin(num_workgroups) groups: vec3u,
) {
    let index = invocation.y * (groups.x * PREPARE_WORKGROUP) + invocation.x;
    if index >= dispatch.count {
        return;
    }
    let interval = interval_at(index);
    let key = interval & KEY_OF_INTERVAL;
    let start = key_at(key) ^ vec4u((interval & START_NEGATED) << 1u);
    let end = key_at(key + 1u) ^ vec4u(interval & END_NEGATED);
    let arc = arc_between(bitcast<vec4f>(start), bitcast<vec4f>(end));
    rotations[2u * index] = arc.middle;
    rotations[2u * index + 1u] = arc.tangent;
}
