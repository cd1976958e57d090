// Layers of rotations, weighted and normalised: each with the sign that is nearer to the
// first layer's.
// Twin: src/cpu/pose_blend.rs.

@group(0) @binding(0) var<storage, read> layers: array<vec4f>;
@group(0) @binding(1) var<storage, read> weights: array<f32>;
@group(0) @binding(2) var<storage, read> unused: array<f32>;
@group(0) @binding(3) var<storage, read_write> blended: array<vec4f>;

// Sums shorter than the root of this have no direction: 2^-40.
const LEAST: f32 = 9.094947017729282e-13;

// `detail`: how many layers; one lies behind the other, `count` values each.
fn pose(place: u32) {
    let first = layers[place];
    var sum = first * weights[0];
    for (var layer = 1u; layer < launch.detail; layer++) {
        let next = layers[layer * launch.count + place];
        let near = select(next, -next, inner(first, next) < 0.0);
        sum = sum + near * weights[layer];
    }
    let short = inner(sum, sum) < LEAST;
    blended[place] = canonical(select(normalised(sum), first, short));
}
