// Values of one part: eight neighbours store a line of them as they are.

fn finish(lane: u32, index: u32, rotation: vec4f, is_stored: bool) {
    if is_stored {
        store(index, rotation);
    }
}
