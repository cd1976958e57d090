// What `sampled_cubics` reads of a row's keys, as texels of 16 bytes.

@group(0) @binding(3) var joints: texture_1d<u32>;

fn joint_at(place: u32) -> Joint {
    let all = bitcast<vec4f>(textureLoad(joints, place, 0));
    return Joint(all.x, all.y, all.z, all.w);
}
