// `Segment` of `evaluate_polynomial`, 64 bits at once.

fn segment_at(place: u32) -> Segment {
    let first = 11u * place;
    return Segment(array(
        quad(segments[first]),
        quad(segments[first + 1u]),
        quad(segments[first + 2u]),
        quad(segments[first + 3u]),
        quad(segments[first + 4u]),
        quad(segments[first + 5u]),
        quad(segments[first + 6u]),
        quad(segments[first + 7u]),
        quad(segments[first + 8u]),
        quad(segments[first + 9u]),
        quad(segments[first + 10u]),
    ));
}
