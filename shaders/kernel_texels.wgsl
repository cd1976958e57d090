// What kernels read of a clip, as texels of 16 bytes. Joined with a form's `segment_at`.

@group(0) @binding(0) var segments: texture_1d<u32>;
@group(0) @binding(1) var constants: texture_1d<u32>;

fn constant_at(place: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(constants, place, 0));
}
