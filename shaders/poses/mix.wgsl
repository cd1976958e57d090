// Mixes two layers of rotations by slerp.
// Twin: src/twin/pose_mix.rs.

@group(0) @binding(0) var<storage, read> from_layer: array<vec4f>;
@group(0) @binding(1) var<storage, read> to_layer: array<vec4f>;
@group(0) @binding(2) var<storage, read> weights: array<f32>;
@group(0) @binding(3) var<storage, read_write> mixed: array<vec4f>;

fn pose(index: u32) {
    mixed[index] = canonical(over(from_layer[index], to_layer[index], weights[0]));
}
