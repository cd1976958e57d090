// Rotations in their parents' frames to rotations and positions in the world's, from the
// roots down: R = R_parent q, p = p_parent + R_parent offset.
// Twin: src/cpu/pose_world.rs.

struct Link {
    // Where its parent hangs, seen from the parent's own frame.
    offset: vec3f,
    // Its place among the tracks, and its parent's, or ROOT.
    track: u32,
    parent: u32,
}

const ROOT: u32 = 0xffffffff;

// [frame][track]
@group(0) @binding(0) var<storage, read> local: array<vec4f>;
// Parents before their children.
@group(0) @binding(1) var<storage, read> links: array<Link>;
@group(0) @binding(2) var<storage, read> unused: array<f32>;
// [frame][track]: the rotation, then the position.
@group(0) @binding(3) var<storage, read_write> world: array<vec4f>;

// `place`: the frame; `detail`: how many tracks.
fn pose(place: u32) {
    let tracks = launch.detail;
    let first = place * tracks;
    for (var i = 0u; i < tracks; i++) {
        let link = links[i];
        let own = local[first + link.track];
        var rotation = own;
        var position = link.offset;
        if link.parent != ROOT {
            let parent = 2u * (first + link.parent);
            let above = world[parent];
            rotation = normalised(product(above, own));
            position = world[parent + 1u].xyz + rotated(above, link.offset);
        }
        let there = 2u * (first + link.track);
        world[there] = canonical(rotation);
        world[there + 1u] = canonical(vec4f(position, 0.0));
    }
}
