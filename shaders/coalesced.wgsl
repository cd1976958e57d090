// Entry point for cards: neighbours store neighbours, so that a wave's stores are whole lines of
// memory. An invocation takes a few samples in turn, and loads the constants of an item again only
// where the next one lies in another; neighbours of one item read its constants from one address.
// It is joined with a form (`Segment`, `evaluate`), with the functions that read buffers
// (`segment_at`, `constant_at`, `item_at`, `block_at`), a `distance_from_middle` and a `store`.

@compute @workgroup_size(WORKGROUP)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let corner = corner_of(group, groups, lane);
    var cell = cell_of(corner, 0u);
    // There always is a first item.
    var own = 0u;
    if cell.is_inside {
        own = item_of(cell);
    }
    var item = item_at(own);
    var segment = segment_of(item);
    for (var turn = 1u; turn <= SAMPLES_EACH; turn++) {
        let j = cell.position - item.output;
        // Samples that no item has are the host's, or another dispatch's.
        let is_own = j < (item.count & ~(IS_CONSTANT | MAY_BE_TINY));
        if cell.is_inside & is_own {
            var rotation: vec4f;
            if (item.count & IS_CONSTANT) != 0u {
                rotation = constant_at(item.source);
            } else {
                let distance = distance_from_middle(item.first, j);
                rotation = evaluate(segment, distance * item.scale + item.offset);
                if (item.count & MAY_BE_TINY) != 0u {
                    rotation = canonical(rotation);
                }
            }
            store(cell.place, rotation);
        }
        if turn == SAMPLES_EACH {
            return;
        }
        cell = cell_of(corner, turn);
        if cell.is_inside {
            let found = item_of(cell);
            if found != own {
                own = found;
                item = item_at(found);
                segment = segment_of(item);
            }
        }
    }
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
