// How far a sample lies from its segment's middle, when samples are explicit times: all are listed.

fn near_distance(first: i32, j: u32) -> f32 {
    return distance_from_middle(first, j);
}
