// Entry point for cards, frame by frame: neighbours store neighbouring tracks, so that a wave's stores are
// whole lines of memory. An invocation takes a few samples in turn, and looks for an item, and loads its constants, only
// where the one before has ended; neighbours of one item read its constants from one address.
// It is joined with a form (`Segment`, `evaluate`), with the functions that read buffers
// (`segment_at`, `constant_at`, `item_at`, `block_at`), a `distance_from_middle`, and a `finish`, which
// stores what an invocation made of a sample.

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let corner = corner_of(group, groups, lane);
    // It has no samples.
    var item: Item;
    var segment: Segment;
    var row = 0u;
    for (var iteration = 0u; iteration < SAMPLES_EACH; iteration++) {
        let cell = cell_of(corner, iteration);
        if cell.is_inside & !((cell.row == row) & has(item, cell.position)) {
            item = item_at(item_of(cell));
            segment = segment_of(item);
            row = cell.row;
        }
        // Samples that no item has are the host's, or another dispatch's.
        let is_stored = cell.is_inside & has(item, cell.position);
        var rotation: vec4f;
        if is_stored {
            if (item.count & IS_CONSTANT) != 0u {
                rotation = constant_at(item.source);
            } else {
                let distance = distance_from_middle(item.first, cell.position - item.output);
                rotation = evaluate(segment, distance * item.scale + item.offset);
                if (item.count & MAY_BE_TINY) != 0u {
                    rotation = canonical(rotation);
                }
            }
        }
        finish(lane, cell.output, rotation, is_stored);
    }
}

// Whether a position is one of an item's samples.
fn has(item: Item, position: u32) -> bool {
    return position - item.output < (item.count & ~(IS_CONSTANT | MAY_BE_TINY));
}

// The item that a sample belongs to, if it belongs to any.
fn item_of(cell: Cell) -> u32 {
    let block = block_at(cell.block);
    // The items that begin after the block's first position and up to this one.
    return block.first + countOneBits(block.starts << (~cell.position & (BLOCK_SAMPLES - 1u)));
}

// Constants have no segment; the first one exists in any case.
fn segment_of(item: Item) -> Segment {
    return segment_at(select(item.source, 0u, (item.count & IS_CONSTANT) != 0u));
}
