// Kernels as a renderer may have them: the textbook's slerp by the device's own acos and sin, matrices of rotations as
// three rows of four, and rotations in 16 bits. Each reads binding 0 and writes binding 1.

@group(0) @binding(0) var<storage, read> input: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> rotations: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> rows: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> packed: array<vec2<u32>>;

// From no rotation to that of a track, over 201 frames; all frames of the first track, then of the second.
@compute @workgroup_size(64)
fn slerp(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&rotations) {
        return;
    }
    let t = f32(id.x % 201u) / 200.0;
    let start = vec4<f32>(0.0, 0.0, 0.0, 1.0);
    var end = input[id.x / 201u];
    var cosine = dot(start, end);
    if cosine < 0.0 {
        end = -end;
        cosine = -cosine;
    }
    let angle = acos(min(cosine, 1.0));
    let sine = sin(angle);
    if sine < 1e-4 {
        rotations[id.x] = normalize(mix(start, end, t));
        return;
    }
    rotations[id.x] = (sin((1.0 - t) * angle) * start + sin(t * angle) * end) / sine;
}

@compute @workgroup_size(64)
fn matrices(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&input) {
        return;
    }
    let q = input[id.x];
    let d = 2.0 * q.xyz;
    let s = q.xyz * d;
    rows[3u * id.x] = vec4<f32>(1.0 - (s.y + s.z), q.x * d.y - q.w * d.z, q.x * d.z + q.w * d.y, 0.0);
    rows[3u * id.x + 1u] = vec4<f32>(q.x * d.y + q.w * d.z, 1.0 - (s.x + s.z), q.y * d.z - q.w * d.x, 0.0);
    rows[3u * id.x + 2u] = vec4<f32>(q.x * d.z - q.w * d.y, q.y * d.z + q.w * d.x, 1.0 - (s.x + s.y), 0.0);
}

@compute @workgroup_size(64)
fn halves(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= arrayLength(&input) {
        return;
    }
    let q = input[id.x];
    packed[id.x] = vec2<u32>(pack2x16float(q.xy), pack2x16float(q.zw));
}
