// The squared length of a quaternion, for kernels without `forms/evaluate_arc`, which has the same function.
// Twin: src/twin/evaluate_arc.rs.


fn norm_squared(q: vec4f) -> f32 {
    return q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
}
