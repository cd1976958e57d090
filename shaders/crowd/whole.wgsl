// Evaluates whole instances, for cards: a workgroup takes a few, and what one step leaves for the next stays in
// the workgroup's memory. The functions of the steps count the instances of the workgroup from 0 on, as if they were
// all. It is joined with these functions and an entry point.

/// The arguments of a dispatch whose workgroups take whole instances.
struct CrowdWholeDispatch {
    /// How many instances are evaluated.
    count: u32,
    /// The first one.
    first_instance: u32,
    /// Joints of the skeleton.
    joints: u32,
    /// Layers of an instance.
    layers: u32,
    /// The most time bases of a clip.
    bases: u32,
    /// The first of the links that say where each level begins and ends.
    first_link: u32,
    /// The clock, ticks: the lower 32 bits.
    clock_low: u32,
    /// The clock's upper bits.
    clock_high: u32,
    /// The cell of the first mask.
    masks: u32,
    /// The cell of the first reference pose.
    references: u32,
    /// Instances of a workgroup. They have `MAX_WHOLE_POSITIONS` time bases and `MAX_WHOLE_JOINTS` joints at most.
    instances: u32,
    /// 2^20 divided by the number of joints, rounded up: by it joints of a workgroup are divided among its instances.
    joint_share: u32,
    /// How many levels are walked; 0 where matrices stay in their parents' frames.
    levels: u32,
    /// 1 where matrices are multiplied by the inverse bind matrices, else 0.
    is_skinning: u32,
    /// 1 where values are stored in half precision, else 0.
    is_half: u32,
}

// Memory of a workgroup: 1 KiB of positions, and where there are matrices 12 KiB of them. Vulkan promises 16.
const MAX_WHOLE_POSITIONS: u32 = 128;
const MAX_WHOLE_JOINTS: u32 = 256;

// Vectors of four numbers that begin where a line of 128 bytes does, in f32.
const LINE_VECTORS: u32 = 8;

var<immediate> dispatch: CrowdWholeDispatch;
// How many entries of the dispatch come before those of the workgroup's instances.
var<private> first_entry: u32;

@group(0) @binding(0) var<storage, read> entries: array<CrowdEntry>;
@group(0) @binding(1) var<storage, read> clips: array<CrowdClip>;
@group(0) @binding(2) var<storage, read> time_bases: array<CrowdBase>;
@group(0) @binding(3) var<storage, read> spans: array<CrowdSpan>;
@group(0) @binding(4) var<storage, read> channels: array<CrowdChannel>;
@group(0) @binding(5) var<storage, read> cells: array<vec4f>;

// The positions of the workgroup's instances.
var<workgroup> found_spans: array<u32, MAX_WHOLE_POSITIONS>;
var<workgroup> found_parameters: array<f32, MAX_WHOLE_POSITIONS>;

fn entry_at(index: u32) -> CrowdEntry {
    return entries[first_entry + index];
}

fn channel_at(index: u32) -> CrowdChannel { return channels[index]; }
fn cell_at(index: u32) -> vec4f { return cells[index]; }

fn position_at(index: u32) -> CrowdPosition {
    return CrowdPosition(found_spans[index], found_parameters[index]);
}

// Begins with the instances of a workgroup, from the `first` of the dispatch on; returns how many they are.
fn instances_from(first: u32) -> u32 {
    first_entry = first * dispatch.layers;
    let rest = dispatch.count - first;
    return select(dispatch.instances, rest, rest < dispatch.instances);
}

// The instance of a joint, of those of all instances of the workgroup.
fn instance_of(index: u32) -> u32 {
    return (index * dispatch.joint_share) >> 20u;
}

// Finds the position in a time base of a layer of the workgroup's instances, as `crowd/times` does.
fn find_position(index: u32) {
    let layer = index / dispatch.bases;
    let base_index = index - layer * dispatch.bases;
    let entry = entry_at(dispatch.first_instance * dispatch.layers + layer);
    let clip = clips[entry.clip_and_weight & 0xffffu];
    if base_index < clip.bases {
        let tick = tick_of(entry, clip.period);
        let base = time_bases[clip.first_base + base_index];
        let found = span_at(base, tick);
        let span = spans[base.first + found];
        let distance = distance_from_middle(i32(tick) - span.whole, 0u);
        let is_key = span.start == (tick | ON_KEY);
        found_spans[index] = found | select(0u, ON_KEY, is_key);
        found_parameters[index] = distance * span.scale + span.offset;
    }
}

// Finds an invocation's part of the positions of so many instances.
fn find_positions(instances: u32, lane: u32) {
    let count = instances * dispatch.layers * dispatch.bases;
    for (var index = lane; index < count; index += CROWD_WORKGROUP) {
        find_position(index);
    }
}

// How many vectors of the line in which a vector is stored come before it. So many invocations are idle, so that
// those after them store whole lines.
fn before_in_line(vector: u32) -> u32 {
    return vector & ((LINE_VECTORS << dispatch.is_half) - 1u);
}

// Stores a vector of the result.
fn finish(vector: u32, value: vec4f) {
    if dispatch.is_half != 0u {
        let half = to_any_half(value);
        halves[vector] = vec2u(half.x | (half.y << 16u), half.z | (half.w << 16u));
    } else {
        values[vector] = value;
    }
}
