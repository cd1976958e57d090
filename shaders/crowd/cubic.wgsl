// The curves of translations and scales.
// Twin: src/twin/crowd_layers.rs.

// A cubic about the middle of its span.
fn cubic(c0: vec4f, c1: vec4f, c2: vec4f, c3: vec4f, s: f32) -> vec4f {
    let z = s * s;
    return c0 + ((c3 * s + c2) * z + c1 * s);
}
