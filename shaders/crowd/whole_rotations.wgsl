// The entry point that evaluates the rotations of whole instances.

// The same buffer, in one precision or the other.
@group(0) @binding(6) var<storage, read_write> values: array<vec4f>;
@group(0) @binding(7) var<storage, read_write> halves: array<vec2u>;

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
    let first_vector = first * joints;
    let idle = before_in_line(first_vector);
    let end = idle + instances * joints;
    for (var next = lane; next < end; next += CROWD_WORKGROUP) {
        if next >= idle {
            let index = next - idle;
            let instance = instance_of(index);
            finish(first_vector + index, layered(instance, index - instance * joints, ROTATION));
        }
    }
}
