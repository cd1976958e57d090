// The entry point that evaluates the matrices of whole instances: in the parents' frames, in the model, or as
// vertices are skinned with. They lie in the workgroup's memory until they are stored, in the order of memory.

@group(0) @binding(6) var<storage, read> links: array<CrowdLink>;
@group(0) @binding(7) var<storage, read> bind: array<vec4f>;
// The same buffer, in one precision or the other.
@group(0) @binding(8) var<storage, read_write> values: array<vec4f>;
@group(0) @binding(9) var<storage, read_write> halves: array<vec2u>;

// The rows of the matrices.
var<workgroup> rows: array<vec4f, 3u * MAX_WHOLE_JOINTS>;

@compute @workgroup_size(CROWD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let first = (group.y * groups.x + group.x) * dispatch.instances;
    if first >= dispatch.count {
        return;
    }
    let instances = instances_from(first);
    find_positions(instances, lane);
    workgroupBarrier();
    let joints = dispatch.joints;
    let matrices = instances * joints;
    for (var matrix = lane; matrix < matrices; matrix += CROWD_WORKGROUP) {
        let instance = instance_of(matrix);
        transform_joint(instance, matrix - instance * joints);
    }
    workgroupBarrier();
    for (var level = 0u; level < dispatch.levels; level++) {
        // Where the level begins, and where it ends.
        let bounds = links[dispatch.first_link + level];
        // Its joints in each instance, up to a power of two.
        let shift = power_from(bounds.parent - bounds.joint);
        let all = instances << shift;
        var index = lane;
        if index < all {
            loop {
                let instance = index >> shift;
                let link = bounds.joint + (index - (instance << shift));
                if link < bounds.parent {
                    walk(instance, links[link]);
                }
                index += CROWD_WORKGROUP;
                continuing {
                    break if index >= all;
                }
            }
        }
        workgroupBarrier();
    }
    let first_vector = 3u * first * joints;
    let count = 3u * matrices;
    // The first invocations are idle once, if the others can so store whole lines: their rows wrap to large numbers.
    let row = lane - before_in_line(first_vector);
    if (dispatch.is_skinning | dispatch.is_half) == 0u {
        if row < count {
            values[first_vector + row] = rows[row];
        }
        for (var next = row + CROWD_WORKGROUP; next < count; next += CROWD_WORKGROUP) {
            values[first_vector + next] = rows[next];
        }
        return;
    }
    if row < count {
        finish(first_vector + row, row_at(row));
    }
    for (var next = row + CROWD_WORKGROUP; next < count; next += CROWD_WORKGROUP) {
        finish(first_vector + next, row_at(next));
    }
}

// The smallest power of two that is not less than a number of joints, as its logarithm.
fn power_from(count: u32) -> u32 {
    var bits = select(count - 1u, 0u, count == 0u);
    bits = bits | (bits >> 1u);
    bits = bits | (bits >> 2u);
    bits = bits | (bits >> 4u);
    return countOneBits(bits);
}

// Evaluates a joint in its parent's frame.
fn transform_joint(instance: u32, joint: u32) {
    let axes = matrix_rows(layered(instance, joint, ROTATION), 0u);
    let moved = layered(instance, joint, TRANSLATION);
    let scale = layered(instance, joint, SCALE);
    let row = (instance * dispatch.joints + joint) * 3u;
    rows[row] = transform_row(axes.first, scale, moved.x);
    rows[row + 1u] = transform_row(axes.second, scale, moved.y);
    rows[row + 2u] = transform_row(axes.third, scale, moved.z);
}

// Makes the matrix of a joint one in the model, where its parent's is one.
fn walk(instance: u32, link: CrowdLink) {
    let above = (instance * dispatch.joints + link.parent) * 3u;
    let row = (instance * dispatch.joints + link.joint) * 3u;
    let first = rows[row];
    let second = rows[row + 1u];
    let third = rows[row + 2u];
    rows[row] = row_product(rows[above], first, second, third);
    rows[row + 1u] = row_product(rows[above + 1u], first, second, third);
    rows[row + 2u] = row_product(rows[above + 2u], first, second, third);
}

// A row as it is stored.
fn row_at(row: u32) -> vec4f {
    if dispatch.is_skinning == 0u {
        return rows[row];
    }
    let matrix = row / 3u;
    let instance = instance_of(matrix);
    let first = (matrix - instance * dispatch.joints) * 3u;
    return row_product(rows[row], bind[first], bind[first + 1u], bind[first + 2u]);
}
