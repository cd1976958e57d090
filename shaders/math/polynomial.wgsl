// A polynomial of degree 10 in each component.
// Twin: src/twin/evaluate_polynomial.rs.

// The coefficients are those of 1, s, s², … s¹⁰. Neighbouring powers are added in pairs (Estrin's
// scheme), which makes short chains of operations instead of one long one. The constant comes
// last: what is added to it is small, and so are the roundings of what is added.
fn polynomial(c: array<vec4f, 11>, s: f32) -> vec4f {
    let z = s * s;
    let zz = z * z;
    let third = c[3] * s + c[2];
    let fifth = c[5] * s + c[4];
    let seventh = c[7] * s + c[6];
    let ninth = c[9] * s + c[8];
    let high = (c[10] * z + ninth) * zz + (seventh * z + fifth);
    return c[0] + (high * zz + (third * z + c[1] * s));
}
