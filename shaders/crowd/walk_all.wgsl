// Walks all levels of the skeleton, for cards: a workgroup takes an instance, whose matrices lie in its own memory
// meanwhile, and are read and stored by whole lines.
// Twin: src/twin/crowd_matrices.rs.

// Joints of a skeleton, at most: 6 KiB of a workgroup's memory, of which Vulkan promises 16.
const MAX_WALKED: u32 = 128;

// The rows of the matrices.
var<workgroup> rows: array<vec4f, 3u * MAX_WALKED>;

@compute @workgroup_size(CROWD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let instance = group.y * groups.x + group.x;
    if instance >= dispatch.count {
        return;
    }
    let count = dispatch.joints * 3u;
    for (var row = lane; row < count; row += CROWD_WORKGROUP) {
        rows[row] = matrices[instance * count + row];
    }
    workgroupBarrier();
    for (var level = 0u; level < dispatch.layers; level++) {
        // Where the level begins, and where it ends.
        let bounds = links[dispatch.first_link + level];
        for (var link = bounds.joint + lane; link < bounds.parent; link += CROWD_WORKGROUP) {
            let parent = links[link].parent * 3u;
            let joint = links[link].joint * 3u;
            let first = rows[joint];
            let second = rows[joint + 1u];
            let third = rows[joint + 2u];
            rows[joint] = row_product(rows[parent], first, second, third);
            rows[joint + 1u] = row_product(rows[parent + 1u], first, second, third);
            rows[joint + 2u] = row_product(rows[parent + 2u], first, second, third);
        }
        workgroupBarrier();
    }
    for (var row = lane; row < count; row += CROWD_WORKGROUP) {
        matrices[instance * count + row] = rows[row];
    }
}
