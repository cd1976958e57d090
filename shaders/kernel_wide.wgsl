// What `kernel` reads, 64 bits at once. Joined with `wide` and a form's `segment_at`.

@group(0) @binding(0) var<storage, read> segments: array<vec2<u64>>;
@group(0) @binding(1) var<storage, read> constants: array<vec2<u64>>;
@group(0) @binding(2) var<storage, read> items: array<array<u64, 3>>;

fn constant_at(place: u32) -> vec4f {
    return quad_f32(constants[place]);
}

fn item_at(place: u32) -> Item {
    let pairs = items[place];
    return Item(
        low(pairs[0]),
        high(pairs[0]),
        low(pairs[1]),
        bitcast<i32>(high(pairs[1])),
        bitcast<f32>(low(pairs[2])),
        bitcast<f32>(high(pairs[2])),
    );
}
