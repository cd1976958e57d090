// What `sampled` reads, 64 bits at once. Joined with `wide`.

@group(0) @binding(0) var<storage, read> keys: array<vec2<u64>>;
@group(0) @binding(1) var<storage, read> samples: array<u64>;

fn key_at(place: u32) -> vec4u {
    return quad(keys[place]);
}

fn sample_at(place: u32) -> Sample {
    let pair = samples[place];
    return Sample(low(pair), bitcast<f32>(high(pair)));
}
