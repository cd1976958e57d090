// What kernels read of a clip, as it is stored.

@group(0) @binding(0) var<storage, read> segments: array<Segment>;
@group(0) @binding(1) var<storage, read> constants: array<vec4f>;

fn segment_at(place: u32) -> Segment {
    return segments[place];
}

fn constant_at(place: u32) -> vec4f {
    return constants[place];
}
