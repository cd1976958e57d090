// Stores rotations in half precision by the device's conversion, which rounds to nearest, ties to even, and keeps
// subnormal numbers: so only devices that promise both for halves have it.
// Twin: src/twin/f16.rs.

alias Stored = vec4<f16>;

fn store(index: u32, rotation: vec4f) {
    rotations[index] = vec4<f16>(rotation);
}
