// Evaluates the rotations of whole instances, for cards: a subgroup takes a few, with neither memory of a workgroup nor
// barriers. First the lanes of a position in a time base find its span together, then each lane evaluates joints and
// gets their positions from the lanes that found them.

/// The arguments of a dispatch whose subgroups take whole instances.
struct CrowdSubgroupDispatch {
    /// How many instances are evaluated.
    count: u32,
    /// The first one.
    first_instance: u32,
    /// Joints of the skeleton.
    joints: u32,
    /// The clock, ticks: the lower 32 bits.
    clock_low: u32,
    /// The clock's upper bits.
    clock_high: u32,
    /// Instances of a subgroup, as a power of two: they have `MAX_SUBGROUP_JOINTS` joints at most.
    instances_log2: u32,
    /// Positions of its instances, `[time base][instance]`, as a power of two up to `MAX_SUBGROUP_POSITIONS`.
    positions_log2: u32,
    /// A bit for each lane of the first position, of 32.
    position_lanes: u32,
    /// 2^20 divided by the number of joints, rounded up: by it joints of a subgroup are divided among its instances.
    joint_share: u32,
    /// 0: the store has no options.
    detail: u32,
}

// A position has two lanes or more, of at least eight.
const MAX_SUBGROUP_POSITIONS: u32 = 4;
// Products with `joint_share` are below 2^32, and exact enough.
const MAX_SUBGROUP_JOINTS: u32 = 1024;

var<immediate> dispatch: CrowdSubgroupDispatch;

@compute @workgroup_size(CROWD_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(subgroup_id) subgroup: u32,
    @builtin(num_subgroups) subgroups: u32,
    @builtin(subgroup_invocation_id) lane: u32,
) {
    let first = ((group.y * groups.x + group.x) * subgroups + subgroup) << dispatch.instances_log2;
    if first >= dispatch.count {
        return;
    }
    // A device may say that a subgroup has more lanes than run.
    let running = subgroupBallot(true);
    let lanes = countOneBits(running.x) + countOneBits(running.y);
    // A position has every second or fourth lane, or all of them: so many, as a power of two.
    let share_log2 = countOneBits(lanes - 1u) - dispatch.positions_log2;
    let share_end = (lanes - 1u) >> dispatch.positions_log2;
    let within_share = lane >> dispatch.positions_log2;
    let position = lane & ((1u << dispatch.positions_log2) - 1u);
    let of_position = dispatch.position_lanes << position;
    let instance = position & ((1u << dispatch.instances_log2) - 1u);
    // The last subgroup may have fewer instances, of which lanes without one take the last.
    let rest = dispatch.count - first;
    let entry = entry_at(dispatch.first_instance + first + select(instance, rest - 1u, instance >= rest));
    let clip_index = entry.clip_and_weight & 0xffffu;
    let clip = clip_at(clip_index);
    let tick = tick_of(entry, clip.period);
    let base_index = position >> dispatch.instances_log2;
    let base = base_at(clip.first_base + select(0u, base_index, base_index < clip.bases));
    // The last span that does not start after the tick is one of `count` from `found` on. Each lane asks one of them, at
    // equal distances. The very first one counts as begun.
    var found = 0u;
    var count = base.count;
    loop {
        let distance = (count + share_end) >> share_log2;
        let probe = within_share * distance;
        let is_inside = probe < count;
        let start = span_of(base.first + found + select(0u, probe, is_inside)).start & TICKS;
        let begun = subgroupBallot((is_inside & (start <= tick)) | (within_share == 0u));
        let begun_count = countOneBits(begun.x & of_position) + countOneBits(begun.y & of_position);
        let passed = (begun_count - 1u) * distance;
        found += passed;
        count = select(count - passed, distance, count - passed > distance);
        let go_on = is_any(count > 1u);
        continuing {
            break if !go_on;
        }
    }
    let span = span_of(base.first + found);
    let is_key = span.start == (tick | ON_KEY);
    let in_subgroup = Subgroup(
        (clip_index - instance) * dispatch.joints,
        found | select(0u, ON_KEY, is_key),
        distance_from_middle(i32(tick) - span.whole, 0u) * span.scale + span.offset,
    );
    let instances = 1u << dispatch.instances_log2;
    let end = select(instances, rest, rest < instances) * dispatch.joints;
    let output = first * dispatch.joints;
    // All lanes go on as long as any has a joint, because they ask each other. At first all have one. They agree on
    // that without a vote, but by votes compilers see that they do.
    let full_end = end & ~(lanes - 1u);
    var index = lane;
    if is_any(index < full_end) {
        loop {
            store(output + index, rotation_at(in_subgroup, index));
            index += lanes;
            let go_on = is_any(index < full_end);
            continuing {
                break if !go_on;
            }
        }
    }
    if full_end < end {
        let is_inside = index < end;
        let value = rotation_at(in_subgroup, select(0u, index, is_inside));
        if is_inside {
            store(output + index, value);
        }
    }
}

// Whether a condition holds in any lane.
fn is_any(condition: bool) -> bool {
    let votes = subgroupBallot(condition);
    return (votes.x | votes.y) != 0u;
}

// The numbers that a lane found, and what leads to those of others.
struct Subgroup {
    // The first row of its instance's clip, less the joints of the instances before.
    row: u32,
    // Its position.
    span: u32,
    parameter: f32,
}

// The rotation of a joint, of those of all instances of the subgroup.
fn rotation_at(here: Subgroup, index: u32) -> vec4f {
    let instance = (index * dispatch.joint_share) >> 20u;
    let channel = channel_at((subgroupShuffle(here.row, instance) + index) * CHANNELS);
    let source = ((channel.form_and_base & 0xffffffu) << dispatch.instances_log2) + instance;
    let at = CrowdPosition(subgroupShuffle(here.span, source), subgroupShuffle(here.parameter, source));
    return arc_value(channel, at);
}
