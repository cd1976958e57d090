// Stores rotations as three angles about axes, in degrees. Formula: Bernardes, Viollet 2022,
// Quaternion to Euler angles conversion: a direct, general and computationally efficient method.
// Twin: src/twin/euler.rs.
// Needs: math/arc_tangent.

alias Stored = f32;

const PARTS: u32 = 3;

// Bits of `dispatch.detail`; the lower six name the three axes, two bits each.
const SYMMETRIC: u32 = 0x40; // the first axis comes twice, as in ZXZ
const NEGATIVE: u32 = 0x80; // the axes are an odd permutation of x y z
const INTRINSIC: u32 = 0x100; // about the turned axes, not the fixed ones

// Gimbal lock: half of the second angle is nearer than this to where the first and the third
// angle turn about the same axis. There only their sum is known, and the third is 0.
const GIMBAL: f32 = 2.5e-7;

// An angle brought into -pi to pi.

fn wrapped(angle: f32) -> f32 {
    let low = select(angle, (angle + 2.0 * PI) + 2.0 * PI_LOW, angle < -PI);
    return select(low, (low - 2.0 * PI) - 2.0 * PI_LOW, low > PI);
}

fn euler(rotation: vec4f, detail: u32) -> vec3f {
    let symmetric = (detail & SYMMETRIC) != 0u;
    let intrinsic = (detail & INTRINSIC) != 0u;
    let sign = select(1.0, -1.0, (detail & NEGATIVE) != 0u);
    let w = rotation.w;
    let i = rotation[detail & 3u];
    let j = rotation[(detail >> 2u) & 3u];
    let k = rotation[(detail >> 4u) & 3u] * sign;
    let a = flushed(select(w - j, w, symmetric));
    let b = flushed(select(i + k, i, symmetric));
    let c = flushed(select(j + w, j, symmetric));
    let d = flushed(select(k - i, k, symmetric));
    let sine = root(c * c + d * d);
    let cosine = root(a * a + b * b);
    let half_sum = arc_tangent(b, a);
    let half_difference = arc_tangent(d, c);
    let closed = sine < GIMBAL;
    let open = cosine < GIMBAL;
    let locked = closed || open;
    let sum = half_sum + half_difference;
    let difference = half_sum - half_difference;
    let opposite = select(-half_difference, half_difference, intrinsic);
    let together = 2.0 * select(opposite, half_sum, closed);
    let third_sign = select(sign, 1.0, symmetric);
    let outer = select(select(difference, sum * third_sign, intrinsic), together, locked);
    let inner = select(select(sum * third_sign, difference, intrinsic), 0.0, locked);
    let first = select(outer, outer * third_sign, locked && intrinsic);
    // From 0 to pi, so the second angle needs no other turn.
    let whole = 2.0 * acute_arc_tangent(sine, cosine);
    let second = select((whole - HALF_PI) - HALF_PI_LOW, whole, symmetric);
    return vec3f(
        wrapped(first) * DEGREES,
        second * DEGREES,
        wrapped(inner) * DEGREES,
    );
}

fn parts(rotation: vec4f) -> array<Stored, PARTS> {
    let angles = canonical(vec4f(euler(rotation, dispatch.detail), 0.0));
    return array<Stored, PARTS>(angles.x, angles.y, angles.z);
}

fn store(index: u32, rotation: vec4f) {
    var all = parts(rotation);
    for (var part = 0u; part < PARTS; part++) {
        rotations[index * PARTS + part] = all[part];
    }
}
