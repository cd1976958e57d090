// Fewer samples than keys: an invocation for each sample, straight from the keys beside
// it. Joined with a `sampled_*`, which has `between`, and with what reads (`key_at`,
// `sample_at`) and stores.
// Twin: src/cpu/sampled.rs.

// Where a sample lies among the keys of its row.
struct Sample {
    // The key before it; the rotation itself, where this carries HELD.
    key: u32,
    // From there on, as `evaluate` takes it.
    parameter: f32,
}

// Tracks whose samples lie alike among their keys; or all of any tracks as one row.
struct Rows {
    // Samples, and keys, of each row.
    samples: u32,
    keys: u32,
    // How many rows.
    count: u32,
}

const ROWS_WORKGROUP: u32 = 64;
// Rows of one invocation.
const ROWS_EACH: u32 = 4;
const HELD: u32 = 0x80000000;
// In a key's x: those before it turn its sign. No component is as large as 2, which is what
// this bit says of a float.
const TURNED: u32 = 0x40000000;

var<immediate> rows: Rows;

@compute @workgroup_size(ROWS_WORKGROUP)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
    if invocation.x >= rows.samples {
        return;
    }
    let sample = sample_at(invocation.x);
    let is_held = (sample.key & HELD) != 0u;
    let first = sample.key & ~HELD;
    // Behind the last key there is none.
    let next = select(1u, 0u, is_held);
    let known = known_of(first, first + next, sample.parameter);
    let row = invocation.y * ROWS_EACH;
    let count = select(ROWS_EACH, rows.count - row, rows.count < row + ROWS_EACH);
    let keys = rows.keys;
    let samples = rows.samples;
    var key = row * keys + first;
    var place = row * samples + invocation.x;
    for (var j = 0u; j < count; j++) {
        let stored = key_at(key);
        let own = canonical(between(key, signed(stored), key + next, known));
        store(place, select(own, as_given(stored), is_held));
        key += keys;
        place += samples;
    }
}

fn as_given(stored: vec4u) -> vec4f {
    return bitcast<vec4f>(vec4u(stored.x & ~TURNED, stored.yzw));
}

// In the sign that the keys before it give.
fn signed(stored: vec4u) -> vec4f {
    let turned = stored.x & TURNED;
    let sign = turned << 1u;
    return bitcast<vec4f>(stored ^ vec4u(turned | sign, vec3u(sign)));
}

fn signed_at(key: u32) -> vec4f {
    return signed(key_at(key));
}
