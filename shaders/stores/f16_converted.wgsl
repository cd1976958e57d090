// Stores rotations in half precision by the device's conversion, which rounds to nearest, ties to even, and keeps
// subnormal numbers: so only devices that promise both for halves have it.
// Twin: src/twin/f16.rs.

alias Stored = vec4<f16>;

fn store(index: u32, rotation: vec4f) {
    // The detail is 0, which compilers do not know. Else AMD's would make the last addition and the conversion one
    // instruction, which rounds once (`v_fma_mixlo_f16`).
    let rounded = bitcast<vec4f>(bitcast<vec4u>(rotation) ^ vec4u(dispatch.detail));
    rotations[index] = vec4<f16>(rounded);
}
