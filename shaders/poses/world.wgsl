// Walks a skeleton from the roots down: rotations in their parents' frames become rotations and
// positions in the world, R = R_parent q and p = p_parent + R_parent offset.
// Twin: src/twin/pose_world.rs.

/// Where a track stands in a skeleton.
struct Link {
    /// Its offset in its parent's frame; that of a root in the world.
    offset: vec3f,
    /// Its index among the tracks.
    track: u32,
    /// Its parent's index, or ROOT.
    parent: u32,
}

const ROOT: u32 = 0xffffffff;

// [frame][track]
@group(0) @binding(0) var<storage, read> local: array<vec4f>;
// Parents before their children.
@group(0) @binding(1) var<storage, read> links: array<Link>;
// [frame][track]: the rotation, then the position.
@group(0) @binding(2) var<storage, read_write> world: array<vec4f>;

// `sample` is the frame, `dispatch.detail` the number of tracks.
fn pose(sample: u32) {
    let tracks = dispatch.detail;
    let first = sample * tracks;
    for (var i = 0u; i < tracks; i++) {
        let link = links[i];
        let in_parent = local[first + link.track];
        var rotation = in_parent;
        var position = link.offset;
        if link.parent != ROOT {
            let parent = 2u * (first + link.parent);
            let above = world[parent];
            rotation = normalised(product(above, in_parent));
            position = world[parent + 1u].xyz + rotated(above, link.offset);
        }
        let there = 2u * (first + link.track);
        world[there] = canonical(rotation);
        world[there + 1u] = canonical(vec4f(position, 0.0));
    }
}
