// What `sampled` reads and stores, as it is.

@group(0) @binding(0) var<storage, read> keys: array<vec4u>;
@group(0) @binding(1) var<storage, read> samples: array<Sample>;
@group(0) @binding(2) var<storage, read_write> rotations: array<vec4f>;

fn key_at(place: u32) -> vec4u {
    return keys[place];
}

fn sample_at(place: u32) -> Sample {
    return samples[place];
}

fn store(place: u32, rotation: vec4f) {
    rotations[place] = rotation;
}
