// What `kernel` reads, as it is stored.

@group(0) @binding(0) var<storage, read> segments: array<Segment>;
@group(0) @binding(1) var<storage, read> constants: array<vec4f>;
@group(0) @binding(2) var<storage, read> items: array<Item>;
@group(0) @binding(3) var<storage, read> distances: array<f32>;

fn segment_at(place: u32) -> Segment {
    return segments[place];
}

fn constant_at(place: u32) -> vec4f {
    return constants[place];
}

fn item_at(place: u32) -> Item {
    return items[place];
}

fn distance_at(place: u32) -> f32 {
    return distances[place];
}
