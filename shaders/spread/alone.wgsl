// Entry point for cards: neighbours evaluate one run together, and store neighbouring samples, or neighbouring tracks, so
// that a wave's stores are whole lines of memory. The run is found once, and nothing is looked for between samples.
// Of values of one part each invocation stores its own. It is joined with a form (`Segment`, `evaluate`), with
// the functions that read buffers (`segment_at`, `constant_at`, `item_at`), with `distance_from_middle` and
// `near_distance`, and with a `store`.

@compute @workgroup_size(SPREAD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) invocation: u32,
) {
    let all = dispatch;
    let index = (group.x * SPREAD_WORKGROUP + invocation) >> all.lanes_log2;
    let repetition = group.z * all.layer_repetitions + (invocation & all.track_mask);
    if (index >= all.item_count) | (repetition >= all.repetitions) {
        return;
    }
    let item = item_at(all.first_item + index);
    let location = location_of(item, repetition);
    let first = location.y;
    // The first iteration begins where the line of the first sample does. What lies before that sample wraps to a
    // large number.
    let idle = first & all.line_mask;
    let first_j = (invocation & all.sample_mask) - idle;
    if item.count >= NEEDS_CARE {
        store_with_care(item, location, first_j, repetition);
        return;
    }
    // No bits are set in it.
    let count = item.count;
    let segment = segment_at(location.x);
    let constant = constant_of(segment);
    // The run's `first` for a sample.
    let first_at = item.first + i32(first_j);
    if first_j < count {
        if (first_j == 0u) & (item.key != NO_KEY) {
            store(first, constant_at(location.z));
        } else {
            store(first + first_j, evaluate_near(item, segment, constant, first_at));
        }
    }
    // A sample is stored `stride` times its `at` behind this.
    let base = first - u32(item.first) * all.stride;
    let step = i32(all.step);
    let end = item.first + i32(count);
    var at = first_at + step;
    // The iterations behind the first one in which every lane has a sample, two at a time.
    let full = (count + idle) >> all.step_log2;
    let pairs_end = at + i32(((full - 1u) & ~1u) << all.step_log2);
    if at < pairs_end {
        loop {
            store(base + u32(at) * all.stride, evaluate_near(item, segment, constant, at));
            at += step;
            store(base + u32(at) * all.stride, evaluate_near(item, segment, constant, at));
            at += step;
            continuing {
                break if at >= pairs_end;
            }
        }
        at = pairs_end;
    }
    if at < end {
        loop {
            store(base + u32(at) * all.stride, evaluate_near(item, segment, constant, at));
            at += step;
            continuing {
                break if at >= end;
            }
        }
    }
}

// A constant, or a run whose samples are not all simple, which is rare.
fn store_with_care(item: SpreadRun, location: vec3u, first_j: u32, repetition: u32) {
    let count = sample_count(item);
    let first = location.y;
    let stride = dispatch.stride;
    let step = dispatch.step;
    var j = first_j;
    if (item.count & IS_CONSTANT) != 0u {
        let constant = constant_of_run(item.source, repetition);
        if j < count {
            store(first + j * stride, constant);
        }
        for (j += step; j < count; j += step) {
            store(first + j * stride, constant);
        }
        return;
    }
    let segment = segment_at(location.x);
    if j < count {
        store(first + j * stride, sample_of(item, segment, j, repetition));
    }
    for (j += step; j < count; j += step) {
        store(first + j * stride, sample_of(item, segment, j, repetition));
    }
}
