// Entry point: an invocation evaluates one sample of some tracks straight from the keys beside it,
// for sets with fewer samples than keys; no segment is prepared.
// It is joined with a file of `from_keys/` (`hoisted`, which computes once what all rows
// share, and `rotation_between`), with the functions that read buffers (`key_at`, `sample_at`) and
// a `store`.

/// Where a sample lies among the keys of its row.
struct KeySample {
    /// The index of the key before it; with `IS_KEY` that of the key which the sample is.
    key: u32,
    /// From -1/2 at that key to 1/2 at the next.
    parameter: f32,
}

/// The rows of a dispatch. Tracks with the same key times are a row each and share one list of
/// samples; other tracks together are one row.
struct RowShape {
    /// Samples of each row.
    samples: u32,
    /// Keys of each row.
    keys: u32,
    /// How many rows.
    count: u32,
    /// Rows that an invocation takes: up to `ROWS_PER_INVOCATION`, or one where `line` is not 0.
    each: u32,
    /// Rows begin anywhere in a line of the result's memory. Where that matters, the number of
    /// rotations of a line, less one: the first of so many neighbours then stores where a line
    /// begins.
    line: u32,
}

const FROM_KEYS_WORKGROUP: u32 = 64;
const ROWS_PER_INVOCATION: u32 = 4;

// Set in a sample's `key`.
const IS_KEY: u32 = 0x80000000;

// Set in a key's x: sign continuation over the track turns the key's sign. The bit is free, for
// it makes a float at least 2, and no component of a rotation is that large.
const SIGN_NEGATED: u32 = 0x40000000;

var<immediate> rows: RowShape;

@compute @workgroup_size(FROM_KEYS_WORKGROUP)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
    let row = invocation.y * rows.each;
    // An index before the row wraps to a large number.
    let sample_index = invocation.x - ((row * rows.samples) & rows.line);
    if sample_index >= rows.samples {
        return;
    }
    let sample = sample_at(sample_index);
    let is_key = (sample.key & IS_KEY) != 0u;
    let first = sample.key & ~IS_KEY;
    // A sample that is a key has that key as its neighbour: the last key has no next one.
    let next = select(1u, 0u, is_key);
    let all_rows = hoisted(first, first + next, sample.parameter);
    let is_last = rows.count < row + rows.each;
    let count = select(rows.each, rows.count - row, is_last);
    let keys = rows.keys;
    let samples = rows.samples;
    var key = row * keys + first;
    var output_index = row * samples + sample_index;
    for (var j = 0u; j < count; j++) {
        let stored = key_at(key);
        let interpolated = canonical(rotation_between(key, continued(stored), key + next, all_rows));
        store(output_index, select(interpolated, as_stored(stored), is_key));
        key += keys;
        output_index += samples;
    }
}

// A key with its stored sign.
fn as_stored(stored: vec4u) -> vec4f {
    return bitcast<vec4f>(vec4u(stored.x & ~SIGN_NEGATED, stored.yzw));
}

// A key with the sign that continues the keys before it.
fn continued(stored: vec4u) -> vec4f {
    let negation = stored.x & SIGN_NEGATED;
    let sign = negation << 1u;
    return bitcast<vec4f>(stored ^ vec4u(negation | sign, vec3u(sign)));
}

fn continued_key_at(key: u32) -> vec4f {
    return continued(key_at(key));
}
