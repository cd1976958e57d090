// Fewer samples than keys: an invocation for each sample, straight from the keys beside
// it. Joined with a `sampled_*`, which has `between`, and with what reads (`key_at`,
// `sample_at`).
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

@group(0) @binding(2) var<storage, read_write> rotations: array<vec4f>;

var<immediate> rows: Rows;

@compute @workgroup_size(ROWS_WORKGROUP)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
    if invocation.x >= rows.samples {
        return;
    }
    let sample = sample_at(invocation.x);
    let known = known_of(sample);
    let row = invocation.y * ROWS_EACH;
    let count = select(ROWS_EACH, rows.count - row, rows.count < row + ROWS_EACH);
    let keys = rows.keys;
    let samples = rows.samples;
    var key = row * keys + (sample.key & ~HELD);
    var place = row * samples + invocation.x;
    for (var j = 0u; j < count; j++) {
        if (sample.key & HELD) != 0u {
            let stored = key_at(key) & vec4u(~TURNED, vec3u(~0u));
            rotations[place] = bitcast<vec4f>(stored);
        } else {
            rotations[place] = canonical(between(key, known));
        }
        key += keys;
        place += samples;
    }
}

fn signed(key: u32) -> vec4f {
    let stored = key_at(key);
    let turned = stored.x & TURNED;
    let sign = turned << 1u;
    return bitcast<vec4f>(stored ^ vec4u(turned | sign, vec3u(sign)));
}
