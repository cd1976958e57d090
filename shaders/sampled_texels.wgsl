// What `sampled` reads, as texels of 16 bytes, and stores by `wide`.

@group(0) @binding(0) var keys: texture_1d<u32>;
@group(0) @binding(1) var samples: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> rotations: array<vec2<u64>>;

fn key_at(place: u32) -> vec4u {
    return textureLoad(keys, place, 0);
}

fn sample_at(place: u32) -> Sample {
    let two = textureLoad(samples, place / 2u, 0);
    let own = select(two.xy, two.zw, (place & 1u) == 1u);
    return Sample(own.x, bitcast<f32>(own.y));
}

fn store(place: u32, rotation: vec4f) {
    rotations[place] = wide(rotation);
}
