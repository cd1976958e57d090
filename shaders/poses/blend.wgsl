// Blends layers of rotations: their weighted sum, normalised, each with the sign that is nearer
// to the first layer's.
// Twin: src/twin/pose_blend.rs.

@group(0) @binding(0) var<storage, read> layers: array<vec4f>;
@group(0) @binding(1) var<storage, read> weights: array<f32>;
@group(0) @binding(2) var<storage, read_write> blended: array<vec4f>;

// 2^-40: a sum whose squared length is below it has no direction, and the first layer is taken.
const LEAST_SQUARED_SUM: f32 = 9.094947017729282e-13;

// `dispatch.detail` is the number of layers, which lie one after another.
fn pose(index: u32) {
    let first = layers[index];
    var sum = first * weights[0];
    for (var layer = 1u; layer < dispatch.detail; layer++) {
        let next = layers[layer * dispatch.count + index];
        let near = select(next, -next, dot4(first, next) < 0.0);
        sum = sum + near * weights[layer];
    }
    let short = dot4(sum, sum) < LEAST_SQUARED_SUM;
    blended[index] = canonical(select(normalised(sum), first, short));
}
