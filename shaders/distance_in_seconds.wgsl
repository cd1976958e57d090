// Where a sample lies, when samples are explicit times: seconds from the segment's
// middle, subtracted in f64 on the host.
fn distance_from_middle(first: i32, j: u32) -> f32 {
    return distance_at(u32(first) + j);
}
