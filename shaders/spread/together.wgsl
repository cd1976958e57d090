// Entry point for cards, as `alone.wgsl`, for values of several parts: invocations that stored each its own
// would write a little of many lines at a time. So those of a run put theirs together in memory of the
// workgroup, and store the parts in the order in which they lie. It is joined with a store that has `parts`.

// The values of an iteration, and of the one before, which neighbours may still read: so one barrier an iteration is enough.
var<workgroup> tile: array<Stored, 2u * SPREAD_WORKGROUP * PARTS>;

@compute @workgroup_size(SPREAD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) invocation: u32,
) {
    let all = dispatch;
    let lanes = 1u << all.lanes_log2;
    let first_index = group.x * (SPREAD_WORKGROUP >> all.lanes_log2);
    if first_index >= all.item_count {
        return;
    }
    // All invocations take as many iterations, because they wait for each other.
    let iterations = item_at(all.first_item + first_index).iterations;
    let index = first_index + (invocation >> all.lanes_log2);
    // It has no samples.
    var item: SpreadRun;
    if index < all.item_count {
        item = item_at(all.first_item + index);
    }
    let first_repetition = group.z * all.layer_repetitions;
    let repetition = first_repetition + (invocation & all.track_mask);
    let is_there = repetition < all.repetitions;
    let location = location_of(item, repetition);
    // Constants have no segment; the first one exists in any case.
    let has_segment = is_there & ((item.count & IS_CONSTANT) == 0u);
    let segment = segment_at(select(0u, location.x, has_segment));
    let constant = constant_of(segment);
    let count = sample_count(item);
    // The number of them that this lane has: none behind the last track.
    let lane_count = select(0u, count, is_there);
    let tracks = all.repetitions - first_repetition;
    let used_lanes = select(lanes, tracks, (all.track_mask != 0u) & (tracks < lanes));
    let lane = invocation & (lanes - 1u);
    // Where the values of the run's lanes begin.
    let run_values = (invocation - lane) * PARTS;
    // Where a lane's parts lie among those of all lanes that have a sample.
    let lane_part = (lane & ~(LINE - 1u)) * PARTS + (lane & (LINE - 1u));
    // Where the first sample of the first lane is stored.
    let first = location.y - (invocation & all.track_mask) * all.outputs;
    let first_part = first * PARTS + lane_part;
    let stride = all.stride * PARTS;
    // The iterations that store whole lines have a sample in every lane: their first lane has one of so many.
    let fills_lines = (lanes >= LINE) & (used_lanes == lanes) & (count > all.sample_mask);
    let filling = select(0u, count - all.sample_mask, fills_lines);
    let sample_lane = invocation & all.sample_mask;
    // The sample of the first lane. The first iteration begins where the line of the first sample does, and what lies
    // before that sample wraps to a large number.
    var first_j = 0u - (first & all.line_mask);
    var iteration = 0u;
    loop {
        // The size of workgroups is a factor of its own, because `tumble lab` chooses another.
        let values = (iteration & 1u) * SPREAD_WORKGROUP * PARTS + run_values;
        let j = first_j + sample_lane;
        if j < lane_count {
            var rotation: vec4f;
            if (item.count < NEEDS_CARE) & ((j != 0u) | (item.key == NO_KEY)) {
                rotation = evaluate_near(item, segment, constant, item.first + i32(j));
            } else {
                rotation = sample_of(item, segment, j, repetition);
            }
            var all_parts = parts(rotation);
            for (var part = 0u; part < PARTS; part++) {
                tile[values + lane * PARTS + part] = all_parts[part];
            }
        }
        workgroupBarrier();
        if first_j < filling {
            // Every lane has a sample, so each stores as many parts: no part is asked whether it is one.
            let found = values + lane_part;
            let stored = first_part + first_j * stride;
            for (var part = 0u; part < PARTS; part++) {
                rotations[stored + part * LINE] = tile[found + part * LINE];
            }
        } else {
            let first_lane = select(0u, 0u - first_j, i32(first_j) < 0);
            let last_j = first_j + all.sample_mask;
            var end_lane = used_lanes;
            if last_j >= count {
                let missing = select(last_j + 1u - count, lanes, all.track_mask != 0u);
                end_lane -= select(missing, end_lane, missing > end_lane);
            }
            let stored = first * PARTS + first_j * stride;
            for (var part = first_lane * PARTS + lane; part < end_lane * PARTS; part += lanes) {
                rotations[stored + part] = tile[values + part];
            }
        }
        first_j += all.step;
        iteration += 1u;
        continuing {
            break if iteration >= iterations;
        }
    }
}
