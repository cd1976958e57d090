// `Segment` of `evaluate_polynomial`, 64 bits at once.

fn segment_at(place: u32) -> Segment {
    let first = 11u * place;
    return Segment(array(
        quad_f32(segments[first]),
        quad_f32(segments[first + 1u]),
        quad_f32(segments[first + 2u]),
        quad_f32(segments[first + 3u]),
        quad_f32(segments[first + 4u]),
        quad_f32(segments[first + 5u]),
        quad_f32(segments[first + 6u]),
        quad_f32(segments[first + 7u]),
        quad_f32(segments[first + 8u]),
        quad_f32(segments[first + 9u]),
        quad_f32(segments[first + 10u]),
    ));
}
