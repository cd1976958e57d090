// Quaternion algebra, x y z w, in a fixed order of operations.
// Twin: src/twin/quaternion.rs.

// The Hamilton product a b.
fn product(a: vec4f, b: vec4f) -> vec4f {
    return vec4f(
        a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
        a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
        a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
    );
}

fn dot4(a: vec4f, b: vec4f) -> f32 {
    return a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w;
}

// q v q*, for a unit quaternion.
fn rotated(q: vec4f, v: vec3f) -> vec3f {
    let once = vec3f(
        q.y * v.z - q.z * v.y,
        q.z * v.x - q.x * v.z,
        q.x * v.y - q.y * v.x,
    );
    let twice = once + once;
    let again = vec3f(
        q.y * twice.z - q.z * twice.y,
        q.z * twice.x - q.x * twice.z,
        q.x * twice.y - q.y * twice.x,
    );
    return v + twice * q.w + again;
}

// q / |q| for |q| well away from 0.
fn normalised(q: vec4f) -> vec4f {
    return q * reciprocal_root(dot4(q, q));
}

// Slerp about the middle of the arc, the shorter way, for t from 0 to 1.
fn slerp(a: vec4f, b: vec4f, t: f32) -> vec4f {
    let near = select(b, -b, dot4(a, b) < 0.0);
    let sum = a + near;
    let difference = flushed4(near - a);
    let square = dot4(difference, difference);
    let whole = dot4(sum, sum);
    // Half of the angle between them in R⁴; `sines` is for the angle from the middle of the arc.
    let half = arc_tangent(root(square), root(whole));
    let sines = sine_cosine((t + t - 1.0) * half);
    let partner = difference * select(reciprocal_root(square), 0.0, square == 0.0);
    return sum * reciprocal_root(whole) * sines.y + partner * sines.x;
}

// Slerp whose ends are the bits of a and b themselves.
fn over(a: vec4f, b: vec4f, t: f32) -> vec4f {
    return select(select(slerp(a, b, t), b, t == 1.0), a, t == 0.0);
}

fn flushed4(q: vec4f) -> vec4f {
    return vec4f(flushed(q.x), flushed(q.y), flushed(q.z), flushed(q.w));
}
