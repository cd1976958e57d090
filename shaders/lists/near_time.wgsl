// How far a sample lies from its segment's middle, when samples are explicit times: all are listed.

fn near_distance(at: i32) -> f32 {
    return distance_from_middle(at, 0u);
}
