// Entry point of the self-test: one expression for each way in which a driver can be inexact.
// The host compares every result with that of the kernel in Rust, bit for bit, before it trusts a device.

/// The inputs of one invocation.
struct Probe {
    a: f32,
    b: f32,
    c: f32,
    n: i32,
}

/// The results of the expressions.
struct Reply {
    contraction: f32,
    reassociation: f32,
    rounding: f32,
    association: f32,
    conversion: f32,
    cancellation: f32,
    sine: f32,
    cosine: f32,
    root: f32,
    arc_tangent: f32,
}

@group(0) @binding(0) var<storage, read> probes: array<Probe>;
@group(0) @binding(1) var<storage, read_write> replies: array<Reply>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3u) {
    let index = invocation.x;
    if index >= arrayLength(&probes) {
        return;
    }
    let probe = probes[index];
    let a = probe.a;
    let b = probe.b;
    let c = probe.c;
    let low = probe.n & 0xfff;
    let sines = sine_cosine(c);
    var reply: Reply;
    // A fused multiply-add would not round the product.
    reply.contraction = a * b + c;
    // A driver that simplifies this sum returns b.
    reply.reassociation = (a + b) - a;
    reply.rounding = a + c;
    reply.association = (a * b) * c;
    reply.conversion = f32(probe.n - low) + f32(low);
    reply.cancellation = (a * c + b) - a * c;
    reply.sine = sines.x;
    reply.cosine = sines.y;
    reply.root = root(a * a + c * c);
    reply.arc_tangent = arc_tangent(a, c);
    replies[index] = reply;
}
