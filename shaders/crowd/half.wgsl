// Rounds values to half precision.
// Twin: src/twin/crowd_matrices.rs.

fn crowd_work(index: u32) {
    let half = to_any_half(values[index]);
    halves[index] = vec2u(half.x | (half.y << 16u), half.z | (half.w << 16u));
}
