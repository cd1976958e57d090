// What `sampled` reads, as it is stored.

@group(0) @binding(0) var<storage, read> keys: array<vec4u>;
@group(0) @binding(1) var<storage, read> samples: array<Sample>;

fn key_at(place: u32) -> vec4u {
    return keys[place];
}

fn sample_at(place: u32) -> Sample {
    return samples[place];
}
