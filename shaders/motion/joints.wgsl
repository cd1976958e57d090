// Evaluates a joint of a sample: its rotation and position in its parent's frame, and how fast they change.
// Twin: src/crowd/states.rs.

// The forms of channels that consist of keys: rotations on arcs, the same with packed keys, two in a cell, of which
// the first is counted in halves of cells, and translations on straight lines.
const FORM_KEYS: u32 = 16;
const FORM_PACKED: u32 = 17;
const FORM_LINE: u32 = 18;

/// A clip and the tick at which it is sampled.
struct MotionSample {
    clip: u32,
    tick: u32,
}

@group(0) @binding(0) var<storage, read> samples: array<MotionSample>;
@group(0) @binding(1) var<storage, read> clips: array<CrowdClip>;
@group(0) @binding(2) var<storage, read> time_bases: array<CrowdBase>;
@group(0) @binding(3) var<storage, read> spans: array<CrowdSpan>;
@group(0) @binding(4) var<storage, read> channels: array<CrowdChannel>;
// Words, for packed keys are no numbers.
@group(0) @binding(5) var<storage, read> cells: array<vec4u>;
// [sample][joint][vector]
@group(0) @binding(6) var<storage, read_write> states: array<vec4f>;

fn cell_at(index: u32) -> vec4f {
    return bitcast<vec4f>(cells[index]);
}

// The position of a tick in a time base.
fn position_in(base: CrowdBase, tick: u32) -> CrowdPosition {
    let index = span_at(base, tick);
    let span = spans[base.first + index];
    let is_key = span.start == (tick | ON_KEY);
    return CrowdPosition(index | select(0u, ON_KEY, is_key), parameter_in(span, tick));
}

fn parameter_in(span: CrowdSpan, tick: u32) -> f32 {
    return distance_from_middle(i32(tick) - span.whole, 0u) * span.scale + span.offset;
}

// The span along which a channel moves, the parameter in it and the parameter's rate per second.
struct MotionSpan {
    index: u32,
    parameter: f32,
    rate: f32,
}

// At the last key it is the span that ends there.
fn moving_span(base: CrowdBase, tick: u32, index: u32) -> MotionSpan {
    let span = spans[base.first + index];
    let is_end = (span.scale == 0.0) & ((span.start & TICKS) == tick) & (index > 0u);
    let moving = index - select(0u, 1u, is_end);
    let along = spans[base.first + moving];
    return MotionSpan(moving, parameter_in(along, tick), along.scale * dispatch.ticks_per_second);
}

// The key at the start of a span, of a channel that consists of keys.
fn key_of(channel: CrowdChannel, span: u32) -> vec4f {
    let index = channel.first + span * channel.count;
    if (channel.form_and_base >> 24u) == FORM_PACKED {
        let words = cells[index >> 1u];
        return unpacked(select(words.xy, words.zw, (index & 1u) == 1u));
    }
    return cell_at(index);
}

// The key at the end of a span. The last span is constant: its key is at both ends.
fn key_after(channel: CrowdChannel, base: CrowdBase, span: u32) -> vec4f {
    return key_of(channel, select(span + 1u, span, span + 1u == base.count));
}

// The value of a curve of so many coefficients, or its derivative by its parameter.
fn value_and_slope(channel: CrowdChannel, along: MotionSpan, coefficients: u32) -> ValueAndSlope {
    let first = channel.first + along.index * channel.count * coefficients;
    var cell = first + (coefficients - 1u) * channel.count;
    var slope = cell_at(cell);
    cell -= channel.count;
    var value = slope * along.parameter + cell_at(cell);
    for (var power = coefficients - 2u; power != 0u; power--) {
        slope = slope * along.parameter + value;
        cell -= channel.count;
        value = value * along.parameter + cell_at(cell);
    }
    return ValueAndSlope(value, slope);
}

struct ValueAndSlope {
    value: vec4f,
    slope: vec4f,
}

fn motion_work(index: u32) {
    let sample_index = index / dispatch.joints;
    let joint = index - sample_index * dispatch.joints;
    let sample = samples[dispatch.first_sample + sample_index];
    let clip = clips[sample.clip];
    let tick = select(sample.tick, clip.period, sample.tick > clip.period);
    let first = (sample.clip * dispatch.joints + joint) * CHANNELS;
    let state = index * STATE_VECTORS;
    rotate(channels[first + ROTATION], clip, tick, state);
    move_joint(channels[first + TRANSLATION], clip, tick, state);
}

// Stores the rotation and the angular velocity about the parent's axes.
fn rotate(channel: CrowdChannel, clip: CrowdClip, tick: u32, state: u32) {
    let base = time_bases[clip.first_base + (channel.form_and_base & 0xffffffu)];
    let form = channel.form_and_base >> 24u;
    let position = position_in(base, tick);
    let span = position.span & TICKS;
    let is_key = (position.span & ON_KEY) != 0u;
    let along = moving_span(base, tick, span);
    let moves = dispatch.moves != 0u;
    var rotation: vec4f;
    var curve: ValueAndSlope;
    if (form == FORM_KEYS) | (form == FORM_PACKED) {
        var arc: ArcSegment;
        if moves | !is_key {
            arc = arc_between(key_of(channel, along.index), key_after(channel, base, along.index));
        }
        if is_key | (along.index != span) {
            rotation = key_of(channel, span);
        } else {
            rotation = canonical(evaluate(arc, position.parameter));
        }
        curve = ValueAndSlope(arc.middle, arc.tangent);
    } else {
        rotation = sampled(channel, position);
        if moves & (form == FORM_ARC) {
            // The angular velocity of an arc is the same everywhere.
            let first = channel.first + along.index * channel.count * 2u;
            curve = ValueAndSlope(cell_at(first), cell_at(first + channel.count));
        } else if moves & (form != FORM_CONSTANT) {
            curve = value_and_slope(channel, along, 11u);
        }
    }
    states[state + LOCAL_ROTATION] = rotation;
    states[state + WORLD_ROTATION] = rotation;
    if moves {
        var velocity = vec4f(0.0);
        if form != FORM_CONSTANT {
            let inverse = vec4f(-curve.value.xyz, curve.value.w);
            velocity = canonical3(product(curve.slope, inverse).xyz * (2.0 * along.rate));
        }
        states[state + ANGULAR_VELOCITY] = velocity;
    }
}

// Stores the position and the velocity in the parent's frame.
fn move_joint(channel: CrowdChannel, clip: CrowdClip, tick: u32, state: u32) {
    let base = time_bases[clip.first_base + (channel.form_and_base & 0xffffffu)];
    let form = channel.form_and_base >> 24u;
    let position = position_in(base, tick);
    let span = position.span & TICKS;
    let along = moving_span(base, tick, span);
    var value: vec4f;
    if form == FORM_LINE {
        value = key_of(channel, span);
        if (position.span & ON_KEY) == 0u {
            let line = line_between(value, key_after(channel, base, span));
            value = canonical(line.slope * position.parameter + line.value);
        }
    } else {
        value = sampled(channel, position);
    }
    states[state + POSITION] = vec4f(value.xyz, 0.0);
    if dispatch.moves != 0u {
        var velocity = vec4f(0.0);
        if form == FORM_LINE {
            let line = line_between(key_of(channel, along.index), key_after(channel, base, along.index));
            velocity = canonical3(line.slope.xyz * along.rate);
        } else if form != FORM_CONSTANT {
            let curve = value_and_slope(channel, along, 4u);
            velocity = canonical3(curve.slope.xyz * along.rate);
        }
        states[state + VELOCITY] = velocity;
    }
}

// The middle of a line, and its rise. Halves are added, so that no sum is too large.
fn line_between(start: vec4f, end: vec4f) -> ValueAndSlope {
    return ValueAndSlope(canonical(start * 0.5 + end * 0.5), canonical(end - start));
}
