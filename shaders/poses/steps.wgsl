// Steps from each value to the next one: differences of vectors, and of rotations the half-rotation
// vectors log(q⁻¹ q₊), with the nearer sign.
// Twin: src/twin/pose_steps.rs.

@group(0) @binding(0) var<storage, read> values: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> steps: array<vec4f>;

// The half-rotation vector between two rotations. The vector part of q⁻¹ (q₊ - q) is that of q⁻¹ q₊,
// and small steps lose nothing in it.
fn rotation_step(from_value: vec4f, to_value: vec4f) -> vec4f {
    let near = select(to_value, -to_value, dot4(from_value, to_value) < 0.0);
    let inverse = vec4f(-from_value.x, -from_value.y, -from_value.z, from_value.w);
    let half_step = flushed4(product(inverse, near - from_value));
    let square = half_step.x * half_step.x + half_step.y * half_step.y + half_step.z * half_step.z;
    let sine = root(square);
    let half = arc_tangent(sine, dot4(from_value, near));
    let scale = select(half * reciprocal_root(square), 0.0, square == 0.0);
    return vec4f(half_step.x * scale, half_step.y * scale, half_step.z * scale, 0.0);
}

// `dispatch.detail` is 1 for rotations, 0 for vectors.
fn pose(index: u32) {
    let value = values[index];
    let next = values[index + 1u];
    if dispatch.detail == 1u {
        steps[index] = canonical(rotation_step(value, next));
    } else {
        steps[index] = canonical(next - value);
    }
}
