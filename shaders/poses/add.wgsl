// Adds a layer of rotations to a base: base (reference⁻¹ layer)^weight.
// Twin: src/twin/pose_add.rs.

@group(0) @binding(0) var<storage, read> base: array<vec4f>;
@group(0) @binding(1) var<storage, read> layer: array<vec4f>;
// A reference for each value of the layer, and after the last one the weight.
@group(0) @binding(2) var<storage, read> reference: array<vec4f>;
@group(0) @binding(3) var<storage, read_write> added: array<vec4f>;

const IDENTITY: vec4f = vec4f(0.0, 0.0, 0.0, 1.0);

fn pose(index: u32) {
    let reference_pose = reference[index];
    let inverse = vec4f(-reference_pose.x, -reference_pose.y, -reference_pose.z, reference_pose.w);
    let weighted = slerp(IDENTITY, product(inverse, layer[index]), reference[dispatch.count].x);
    added[index] = canonical(normalised(product(base[index], weighted)));
}
