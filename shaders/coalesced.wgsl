// Entry point for cards: an invocation evaluates one sample, and neighbours store neighbours, so
// that a wave's stores are whole lines of memory. Neighbours of one item read its constants from
// one address. The build joins it with a form (`Segment`, `evaluate`), with the functions that
// read buffers (`segment_at`, `constant_at`, `item_at`, `block_at`), a `distance_from_middle` and
// a `store`.

@compute @workgroup_size(GRID_WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let cell = cell_of(group, groups, lane);
    if !cell.is_inside {
        return;
    }
    let block = block_at(cell.block);
    // The items that begin after the block's first position and up to this one.
    let begun = countOneBits(block.starts << (~cell.position & (BLOCK_SAMPLES - 1u)));
    let item = item_at(block.first + begun);
    let j = cell.position - item.output;
    // Samples that no item has are the host's, or another dispatch's.
    if j >= (item.count & ~(IS_CONSTANT | MAY_BE_TINY)) {
        return;
    }
    var rotation: vec4f;
    if (item.count & IS_CONSTANT) != 0u {
        rotation = constant_at(item.source);
    } else {
        let parameter = distance_from_middle(item.first, j) * item.scale + item.offset;
        rotation = evaluate(segment_at(item.source), parameter);
        if (item.count & MAY_BE_TINY) != 0u {
            rotation = canonical(rotation);
        }
    }
    store(cell.place, rotation);
}
