// How far a sample lies from its segment's middle, when samples are explicit times.

// Seconds from the middle, which the host subtracted in f64.
fn distance_from_middle(first: i32, j: u32) -> f32 {
    return distance_at(u32(first) + j);
}
