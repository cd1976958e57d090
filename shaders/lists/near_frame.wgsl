// How far a sample lies from its segment's middle, when samples are frames and near it.

// A whole number of frames below 2^24, which is exact in f32.
fn near_distance(at: i32) -> f32 {
    return f32(at);
}
