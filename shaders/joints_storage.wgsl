// What `sampled_cubics` reads of a row's keys, as it is stored.

@group(0) @binding(3) var<storage, read> joints: array<Joint>;

fn joint_at(place: u32) -> Joint {
    return joints[place];
}
