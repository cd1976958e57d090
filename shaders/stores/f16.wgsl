// Stores rotations in half precision, rounded to nearest, ties to even.
// Twin: src/twin/f16.rs.
// Needs: math/half.

alias Stored = vec2u;

fn store(index: u32, rotation: vec4f) {
    let half = to_half(rotation);
    rotations[index] = vec2u(half.x | (half.y << 16u), half.z | (half.w << 16u));
}
