// Puts the layers of an instance together, for one channel of a joint.
// Twin: src/twin/crowd_layers.rs.

// 2^-15.
const WEIGHT_UNIT: f32 = 0.000030517578125;
const UNMOVED: vec4f = vec4f(0.0, 0.0, 0.0, 1.0);

// Turns a base on by what a layer differs from its reference: base (reference⁻¹ layer)^weight.
fn rotation_added(base: vec4f, layer: vec4f, reference: vec4f, weight: f32) -> vec4f {
    let inverse = vec4f(-reference.x, -reference.y, -reference.z, reference.w);
    let weighted = slerp(UNMOVED, product(inverse, layer), weight);
    return canonical(normalised(product(base, weighted)));
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
            return rotation_added(below, layer, reference, weight);
        }
        return canonical(over(below, layer, weight));
    }
    if !is_additive {
        return canonical(select(below + (layer - below) * weight, layer, weight == 1.0));
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
    var value = layer_value(first, entry_at(all), joint, kind);
    for (var layer = 1u; layer < dispatch.layers; layer++) {
        let entry = entry_at(all + layer);
        let weight = entry.clip_and_weight >> 16u;
        if weight != 0u {
            let modes = entry.speed_and_modes;
            let mask = dispatch.masks + ((modes >> 24u) & 0x1fu) * dispatch.joints + joint;
            let joint_weight = f32(i32(weight)) * WEIGHT_UNIT * cell_at(mask).x;
            let clip = entry.clip_and_weight & 0xffffu;
            let reference = dispatch.references + (clip * dispatch.joints + joint) * CHANNELS + kind;
            let next = layer_value(first + layer, entry, joint, kind);
            value = laid_over(kind, (modes >> 31u) != 0u, value, next, cell_at(reference), joint_weight);
        }
    }
    return value;
}
