// Rotations as three angles about axes, degrees. Bernardes, Viollet 2022, Quaternion to
// Euler angles conversion: a direct, general and computationally efficient method.
// Twin: src/cpu/store_euler.rs.

@group(0) @binding(4) var<storage, read_write> rotations: array<f32>;

// What `launch.detail` says beside the three axes, two bits each.
const SYMMETRIC: u32 = 0x40;
const NEGATIVE: u32 = 0x80;
const INTRINSIC: u32 = 0x100;

// Half of the second angle's distance from where the first and the third turn about the
// same axis: nearer, only their sum is known, and the third is 0.
const GIMBAL: f32 = 2.5e-7;

fn wrapped(angle: f32) -> f32 {
    let low = select(angle, (angle + 2.0 * HALF) + 2.0 * HALF_LOW, angle < -HALF);
    return select(low, (low - 2.0 * HALF) - 2.0 * HALF_LOW, low > HALF);
}

fn euler(rotation: vec4f, detail: u32) -> vec3f {
    let symmetric = (detail & SYMMETRIC) != 0u;
    let intrinsic = (detail & INTRINSIC) != 0u;
    let sign = select(1.0, -1.0, (detail & NEGATIVE) != 0u);
    let w = rotation.w;
    let i = rotation[detail & 3u];
    let j = rotation[(detail >> 2u) & 3u];
    let k = rotation[(detail >> 4u) & 3u] * sign;
    let a = clean(select(w - j, w, symmetric));
    let b = clean(select(i + k, i, symmetric));
    let c = clean(select(j + w, j, symmetric));
    let d = clean(select(k - i, k, symmetric));
    let near = root(c * c + d * d);
    let far = root(a * a + b * b);
    let half_sum = arc_tangent(b, a);
    let half_difference = arc_tangent(d, c);
    let closed = near < GIMBAL;
    let open = far < GIMBAL;
    let locked = closed || open;
    let sum = half_sum + half_difference;
    let difference = half_sum - half_difference;
    let opposite = select(-half_difference, half_difference, intrinsic);
    let together = 2.0 * select(opposite, half_sum, closed);
    let third_sign = select(sign, 1.0, symmetric);
    let outer = select(select(difference, sum * third_sign, intrinsic), together, locked);
    let inner = select(select(sum * third_sign, difference, intrinsic), 0.0, locked);
    let first = select(outer, outer * third_sign, locked && intrinsic);
    let whole = 2.0 * arc_tangent(near, far);
    let second = select((whole - QUARTER) - QUARTER_LOW, whole, symmetric);
    return vec3f(
        wrapped(first) * DEGREES,
        wrapped(second) * DEGREES,
        wrapped(inner) * DEGREES,
    );
}

fn store(place: u32, rotation: vec4f) {
    let angles = canonical(vec4f(euler(rotation, launch.detail), 0.0));
    rotations[place * 3u] = angles.x;
    rotations[place * 3u + 1u] = angles.y;
    rotations[place * 3u + 2u] = angles.z;
}
