// Stores rotations as axis and angle: a unit vector, and degrees from 0 to 360. The axis of the
// identity is x.
// Twin: src/twin/axis_angle.rs.
// Needs: math/arc_tangent.

alias Stored = vec4f;

fn axis_angle(rotation: vec4f) -> vec4f {
    let x = flushed(rotation.x);
    let y = flushed(rotation.y);
    let z = flushed(rotation.z);
    let square = x * x + y * y + z * z;
    let scale = reciprocal_root(square);
    let angle = arc_tangent(root(square), flushed(rotation.w)) * (2.0 * DEGREES);
    let axis_and_angle = vec4f(x * scale, y * scale, z * scale, angle);
    return select(axis_and_angle, vec4f(1.0, 0.0, 0.0, angle), square == 0.0);
}

fn store(index: u32, rotation: vec4f) {
    rotations[index] = canonical(axis_angle(rotation));
}
