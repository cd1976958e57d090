// Evaluates one channel of a joint in one layer of an instance, where clips are stored compactly: as the keys of curves
// that these determine, and as segments without the powers that are 0.
// Twin: src/twin/crowd_compact.rs.

// Further forms of channels, behind those of motion tables: keys of straight lines, keys of arcs, and keys of cubics, of
// which some intervals are segments.
const FORM_LINE: u32 = 18;
const FORM_ARC_KEYS: u32 = 19;
const FORM_CUBIC_KEYS: u32 = 20;

// Keys of rotations have the sign that continues the keys before them. Where the authored sign is the other, a key is
// stored four times as long, which is exact; its square is above this limit.
const LONGEST_KEY: f32 = 4.0;

// The index of a segment is stored with the bits of a float from 2^23 on, whose lowest bits these are: no device changes
// such a number when it reads it.
const SOURCE_BITS: u32 = 0x7fffff;

// The `kind`th channel of a joint in one layer; `layer` counts within the window.
fn layer_value(layer: u32, entry: CrowdEntry, joint: u32, kind: u32) -> vec4f {
    let clip = entry.clip_and_weight & 0xffffu;
    let channel = channel_at((clip * dispatch.joints + joint) * CHANNELS + kind);
    let at = position_at(layer * dispatch.bases + (channel.form_and_base & 0xffffffu));
    let form = channel.form_and_base >> 24u;
    if form == FORM_CUBIC_KEYS {
        return cubic_of_keys(channel, at);
    }
    if form == FORM_ARC_KEYS {
        return arc_of_keys(channel, at);
    }
    if form == FORM_LINE {
        return line_of_keys(channel, at);
    }
    return sampled(channel, at);
}

fn continued_key(stored: vec4f) -> vec4f {
    return select(stored, stored * 0.25, norm_squared(stored) > LONGEST_KEY);
}

fn authored_key(stored: vec4f) -> vec4f {
    return canonical(select(stored, stored * -0.25, norm_squared(stored) > LONGEST_KEY));
}

// Halves are added, so that no sum is too large.
fn line_of_keys(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let key = channel.first + (at.span & TICKS) * channel.count;
    let start = cell_at(key);
    if (at.span & ON_KEY) != 0u {
        return start;
    }
    let end = cell_at(key + channel.count);
    let middle = canonical(start * 0.5 + end * 0.5);
    return canonical(canonical(end - start) * at.parameter + middle);
}

fn arc_of_keys(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let key = channel.first + (at.span & TICKS) * channel.count;
    let start = cell_at(key);
    if (at.span & ON_KEY) != 0u {
        return authored_key(start);
    }
    let end = cell_at(key + channel.count);
    return canonical(evaluate(arc_between(continued_key(start), continued_key(end)), at.parameter));
}

// The group of a channel has a row for each key: a cell with the weights of its tangent, cells with the sources of the
// intervals after the keys, one word for each channel, and the keys. `channel.keys` is the cell of the first weights.
fn cubic_of_keys(channel: CrowdChannel, at: CrowdPosition) -> vec4f {
    let before_keys = 1u + ((channel.count + 3u) >> 2u);
    let stride = channel.count + before_keys;
    let along = (at.span & TICKS) * stride;
    let key = channel.first + along;
    let start = cell_at(key);
    if (at.span & ON_KEY) != 0u {
        return authored_key(start);
    }
    let row = channel.keys + along;
    let member = channel.first - channel.keys - before_keys;
    let source = source_of(bitcast<vec4u>(cell_at(row + 1u + (member >> 2u))), member & 3u);
    if source != 0u {
        return segment_of(channel.keys, source, at.parameter);
    }
    let first = weights_in(cell_at(row));
    let last = weights_in(cell_at(row + stride));
    let before = select(key, key - stride, first.kind == KEY_INNER);
    let next = key + stride;
    let after = select(next, next + stride, last.kind == KEY_INNER);
    let curve = small_angle_cubic(
        continued_key(cell_at(before)),
        continued_key(start),
        continued_key(cell_at(next)),
        continued_key(cell_at(after)),
        first,
        last,
    );
    // As `polynomial`, whose powers above the sixth are 0.
    let c = curve.powers;
    let s = at.parameter;
    let z = s * s;
    let third = c[3] * s + c[2];
    let high = c[6] * z + (c[5] * s + c[4]);
    let gain = high * (z * z) + (third * z + c[1] * s);
    return canonical(c[0] + gain);
}

fn weights_in(cell: vec4f) -> TangentWeights {
    return TangentWeights(cell.x, cell.y, cell.z, cell.w);
}

// One of the four words of a cell.
fn source_of(words: vec4u, member: u32) -> u32 {
    let is_odd = (member & 1u) != 0u;
    let low = select(words.x, words.y, is_odd);
    let high = select(words.z, words.w, is_odd);
    return select(low, high, member >= 2u) & SOURCE_BITS;
}

// A segment. The source says how many cells it is behind the first of its group; the lowest two bits are 0, 1 or 2 for
// a polynomial of degree 6, 8 or 10.
fn segment_of(group: u32, source: u32, s: f32) -> vec4f {
    let first = group + (source >> 2u);
    let powers = 7u + (source & 3u) * 2u;
    var coefficients: array<vec4f, 11>;
    for (var power = 0u; power < 11u; power++) {
        // The first cell is 0.
        coefficients[power] = cell_at(select(0u, first + power, power < powers));
    }
    return canonical(polynomial(coefficients, s));
}
