// Entry point for cards: neighbours evaluate one run together, and store neighbouring samples, so that a
// wave's stores are whole lines of memory. The run is found once, and nothing is looked for between samples.
// Of values of one part each invocation stores its own. It is joined with a form (`Segment`, `evaluate`), with
// the functions that read buffers (`segment_at`, `constant_at`, `item_at`), with `distance_from_middle` and
// `near_distance`, and with a `store`.

@compute @workgroup_size(SPREAD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) invocation: u32,
) {
    let lanes_log2 = dispatch.lanes_log2;
    let lanes = 1u << lanes_log2;
    let workgroup = group.y * groups.x + group.x;
    let index = (workgroup * SPREAD_WORKGROUP + invocation) >> lanes_log2;
    if index >= dispatch.item_count {
        return;
    }
    let item = item_at(dispatch.first_item + index);
    let location = location_of(item, group.z);
    let first = location.y;
    // The first iteration begins where the line of the first sample does. What lies before that sample wraps to a
    // large number.
    let idle = first & dispatch.line_mask;
    let first_j = (invocation & (lanes - 1u)) - idle;
    if item.count >= NEEDS_CARE {
        store_with_care(item, location, first_j, lanes, group.z);
        return;
    }
    // No bits are set in it.
    let count = item.count;
    let segment = segment_at(location.x);
    let constant = constant_of(segment);
    if first_j < count {
        var rotation = evaluate_near(item, segment, constant, first_j);
        if (first_j == 0u) & (item.key != NO_KEY) {
            rotation = constant_at(location.z);
        }
        store(first + first_j, rotation);
    }
    var j = first_j + lanes;
    // Iterations behind the first one in which every lane has a sample, two at a time. One more is counted: the first
    // iteration with another, or none of either.
    var pairs = (((count + idle) >> lanes_log2) + 1u) >> 1u;
    if pairs > 1u {
        loop {
            store(first + j, evaluate_near(item, segment, constant, j));
            j += lanes;
            store(first + j, evaluate_near(item, segment, constant, j));
            j += lanes;
            pairs -= 1u;
            continuing {
                break if pairs <= 1u;
            }
        }
    }
    if j < count {
        loop {
            store(first + j, evaluate_near(item, segment, constant, j));
            j += lanes;
            continuing {
                break if j >= count;
            }
        }
    }
}

// A constant, or a run whose samples are not all simple, which is rare.
fn store_with_care(
    item: SpreadRun,
    location: vec3u,
    first_j: u32,
    lanes: u32,
    repetition: u32,
) {
    let count = sample_count(item);
    let first = location.y;
    var j = first_j;
    if (item.count & IS_CONSTANT) != 0u {
        let constant = constant_of_run(item.source, repetition);
        if j < count {
            store(first + j, constant);
        }
        for (j += lanes; j < count; j += lanes) {
            store(first + j, constant);
        }
        return;
    }
    let segment = segment_at(location.x);
    if j < count {
        store(first + j, sample_of(item, segment, j, repetition));
    }
    for (j += lanes; j < count; j += lanes) {
        store(first + j, sample_of(item, segment, j, repetition));
    }
}
