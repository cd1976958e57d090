// Evaluates the layers of an instance and puts them together, for one joint.
// Twin: src/twin/crowd_layers.rs.

/// Where one channel (the rotation, the translation or the scale) of a joint lies in a clip.
struct CrowdChannel {
    /// The cell of its first constant in the first span.
    first: u32,
    /// How many channels lie beside each other: the next constant is `count` cells on.
    count: u32,
    /// The form, 8 bits, above the place of its time base in the clip, 24 bits.
    form_and_base: u32,
    /// The cell of its first key.
    keys: u32,
}

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
const CHANNELS: u32 = 3;

// 2^-15.
const WEIGHT_UNIT: f32 = 0.000030517578125;
const UNMOVED: vec4f = vec4f(0.0, 0.0, 0.0, 1.0);

// A cubic about the middle of its span.
fn cubic(c0: vec4f, c1: vec4f, c2: vec4f, c3: vec4f, s: f32) -> vec4f {
    let z = s * s;
    return c0 + ((c3 * s + c2) * z + c1 * s);
}

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

// Turns a base on by what a layer differs from its reference: base (reference⁻¹ layer)^weight.
fn turn_added(base: vec4f, layer: vec4f, reference: vec4f, weight: f32) -> vec4f {
    let inverse = vec4f(-reference.x, -reference.y, -reference.z, reference.w);
    let turn = slerp(UNMOVED, product(inverse, layer), weight);
    return canonical(normalised(product(base, turn)));
}

// A rotation, a translation or a scale under the next layer. For scales `reference` holds reciprocals.
fn laid_over(
    kind: u32,
    is_additive: bool,
    below: vec4f,
    layer: vec4f,
    reference: vec4f,
    weight: f32,
) -> vec4f {
    if kind == ROTATION {
        if is_additive {
            return turn_added(below, layer, reference, weight);
        }
        return canonical(slerp(below, layer, weight));
    }
    if !is_additive {
        return canonical(below + (layer - below) * weight);
    }
    if kind == TRANSLATION {
        return canonical(below + (layer - reference) * weight);
    }
    return canonical(below + below * ((layer * reference - 1.0) * weight));
}

// The `kind`th channel of a joint, with all layers; `instance` counts within the window.
fn layered(instance: u32, joint: u32, kind: u32) -> vec4f {
    let first = instance * dispatch.layers;
    let all = (dispatch.first_instance + instance) * dispatch.layers;
    var value = layer_value(first, entries[all], joint, kind);
    for (var layer = 1u; layer < dispatch.layers; layer++) {
        let entry = entries[all + layer];
        let weight = entry.clip_and_weight >> 16u;
        if weight != 0u {
            let modes = entry.speed_and_modes;
            let mask = dispatch.masks + ((modes >> 24u) & 0x1fu) * dispatch.joints + joint;
            let own = f32(i32(weight)) * WEIGHT_UNIT * cells[mask].x;
            let clip = entry.clip_and_weight & 0xffffu;
            let reference = dispatch.references + (clip * dispatch.joints + joint) * CHANNELS + kind;
            let next = layer_value(first + layer, entry, joint, kind);
            value = laid_over(kind, (modes >> 31u) != 0u, value, next, cells[reference], own);
        }
    }
    return value;
}
