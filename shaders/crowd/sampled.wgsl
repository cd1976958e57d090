// Evaluates one channel of a joint in one layer of an instance.
// Twin: src/twin/crowd_layers.rs.

@group(0) @binding(0) var<storage, read> entries: array<CrowdEntry>;
@group(0) @binding(1) var<storage, read> channels: array<CrowdChannel>;
// Constants of segments, keys, masks and reference poses.
@group(0) @binding(2) var<storage, read> cells: array<vec4f>;
@group(0) @binding(3) var<storage, read> places: array<CrowdPlace>;

// The forms of channels: one constant; an arc's middle and tangent; the four coefficients of a cubic.
// Else it is the eleven coefficients of a polynomial.
const FORM_CONSTANT: u32 = 0;
const FORM_ARC: u32 = 1;
const FORM_CUBIC: u32 = 2;
const FORM_POLYNOMIAL: u32 = 3;

const ROTATION: u32 = 0;
const TRANSLATION: u32 = 1;
const SCALE: u32 = 2;

// A channel where its time base stands.
fn sampled(channel: CrowdChannel, place: CrowdPlace) -> vec4f {
    let form = channel.form_and_base >> 24u;
    let span = place.span & TICKS;
    let count = channel.count;
    let s = place.parameter;
    if form == FORM_CONSTANT {
        return cells[channel.first];
    }
    if (place.span & ON_KEY) != 0u {
        return cells[channel.keys + span * count];
    }
    if form == FORM_ARC {
        let first = channel.first + span * count * 2u;
        return canonical(evaluate(Segment(cells[first], cells[first + count]), s));
    }
    if form == FORM_CUBIC {
        let first = channel.first + span * count * 4u;
        let second = first + count;
        let third = second + count;
        return canonical(cubic(cells[first], cells[second], cells[third], cells[third + count], s));
    }
    var coefficients: array<vec4f, 11>;
    var next = channel.first + span * count * 11u;
    for (var power = 0u; power < 11u; power++) {
        coefficients[power] = cells[next];
        next = next + count;
    }
    return canonical(polynomial(coefficients, s));
}

// The `kind`th channel of a joint in one layer; `layer` counts within the window.
fn layer_value(layer: u32, entry: CrowdEntry, joint: u32, kind: u32) -> vec4f {
    let clip = entry.clip_and_weight & 0xffffu;
    let channel = channels[(clip * dispatch.joints + joint) * CHANNELS + kind];
    return sampled(channel, places[layer * dispatch.bases + (channel.form_and_base & 0xffffffu)]);
}
