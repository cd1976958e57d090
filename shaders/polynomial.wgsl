// By the coefficients of 1, s, s², … s¹⁰. Neighbouring powers in pairs (Estrin's scheme): short
// chains of operations instead of a long one. The middle comes last: what is added to it is
// small, and so are its roundings.
// Twin: src/cpu/evaluate_polynomial.rs.

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
