// What `sampled` reads, as it is stored.

@group(0) @binding(0) var<storage, read> keys: array<vec4f>;
@group(0) @binding(2) var<storage, read> samples: array<Sample>;

fn key_at(place: u32) -> vec4f {
    return keys[place];
}

fn sample_at(place: u32) -> Sample {
    return samples[place];
}
