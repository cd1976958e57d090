// Rotations as axis and angle: a unit vector, and degrees from 0 to 360. Without a turn
// the axis is x.
// Twin: src/cpu/store_axis_angle.rs.

@group(0) @binding(4) var<storage, read_write> rotations: array<vec4f>;

fn axis_angle(rotation: vec4f) -> vec4f {
    let x = clean(rotation.x);
    let y = clean(rotation.y);
    let z = clean(rotation.z);
    let square = x * x + y * y + z * z;
    let scale = reciprocal_root(square);
    let angle = arc_tangent(root(square), clean(rotation.w)) * (2.0 * DEGREES);
    let turned = vec4f(x * scale, y * scale, z * scale, angle);
    return select(turned, vec4f(1.0, 0.0, 0.0, angle), square == 0.0);
}

fn store(place: u32, rotation: vec4f) {
    rotations[place] = canonical(axis_angle(rotation));
}
