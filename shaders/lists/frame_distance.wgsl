// How far a sample lies from its segment's middle, when samples are frames.

// A whole number of frames from the whole frame nearest to the middle. It is converted in two
// halves, each exact in f32, so that the one rounding is that of the addition.
fn distance_from_middle(first: i32, j: u32) -> f32 {
    let frames = first + i32(j);
    let low = frames & 0xfff;
    return f32(frames - low) + f32(low);
}
