// Entry point for cards, as `alone.wgsl`, for values of several parts: invocations that stored each its own
// would write a little of many lines at a time. So those of a run put theirs together in memory of the
// workgroup, and store the parts in the order in which they lie. It is joined with a store that has `parts`.

// The values of an iteration, and of the one before, which neighbours may still read: so one barrier an iteration is enough.
var<workgroup> tile: array<Stored, 2u * SPREAD_WORKGROUP * PARTS>;

@compute @workgroup_size(SPREAD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) invocation: u32,
) {
    let lanes = 1u << dispatch.lanes_log2;
    let workgroup = group.y * groups.x + group.x;
    let first_index = workgroup * (SPREAD_WORKGROUP >> dispatch.lanes_log2);
    if first_index >= dispatch.item_count {
        return;
    }
    // All invocations take as many iterations, because they wait for each other.
    let iterations = item_at(dispatch.first_item + first_index).iterations;
    let index = first_index + (invocation >> dispatch.lanes_log2);
    // It has no samples.
    var item: SpreadRun;
    if index < dispatch.item_count {
        item = item_at(dispatch.first_item + index);
    }
    // Constants have no segment; the first one exists in any case.
    let location = location_of(item, group.z);
    let segment = segment_at(select(location.x, 0u, (item.count & IS_CONSTANT) != 0u));
    let constant = constant_of(segment);
    let count = sample_count(item);
    let first = location.y;
    let idle = first & dispatch.line_mask;
    let lane = invocation & (lanes - 1u);
    // Where a lane's parts lie among those of all lanes that have a sample.
    let lane_part = (lane & ~(LINE - 1u)) * PARTS + (lane & (LINE - 1u));
    // The lanes of an iteration that stores whole lines; none has so many if the run has fewer lanes than a line.
    let line_lanes = select(0u, lanes, lanes >= LINE);
    // The samples of an iteration: the first iteration begins where the line of the first sample does.
    var begin = 0u;
    var end = lanes - idle;
    var iteration = 0u;
    loop {
        // Where the lanes put their values.
        let values = ((iteration & 1u) * SPREAD_WORKGROUP + invocation - lane) * PARTS;
        let j = end - lanes + lane;
        if j < count {
            var rotation: vec4f;
            if (item.count < NEEDS_CARE) & ((j != 0u) | (item.key == NO_KEY)) {
                rotation = evaluate_near(item, segment, constant, j);
            } else {
                rotation = sample_of(item, segment, j, group.z);
            }
            var all = parts(rotation);
            for (var part = 0u; part < PARTS; part++) {
                tile[values + lane * PARTS + part] = all[part];
            }
        }
        workgroupBarrier();
        if (end - begin == line_lanes) & (end <= count) {
            // Every lane has a sample, so each stores as many parts: no part is asked whether it is one.
            let found = values + lane_part;
            let stored = (first + begin) * PARTS + lane_part;
            for (var part = 0u; part < PARTS; part++) {
                rotations[stored + part * LINE] = tile[found + part * LINE];
            }
        } else {
            // From the number of a part in the run to its location.
            let shift = values + (lanes - end) * PARTS;
            let parts_end = select(end, count, count < end) * PARTS;
            for (var part = begin * PARTS + lane; part < parts_end; part += lanes) {
                rotations[first * PARTS + part] = tile[shift + part];
            }
        }
        begin = end;
        end += lanes;
        iteration += 1u;
        continuing {
            break if iteration >= iterations;
        }
    }
}
