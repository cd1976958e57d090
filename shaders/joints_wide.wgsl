// What `sampled_cubics` reads of a row's keys, 64 bits at once. Joined with `wide`.

@group(0) @binding(3) var<storage, read> joints: array<vec2<u64>>;

fn joint_at(place: u32) -> Joint {
    let all = quad_f32(joints[place]);
    return Joint(all.x, all.y, all.z, all.w);
}
