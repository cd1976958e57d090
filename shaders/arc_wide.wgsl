// `Segment` of `evaluate_arc`, 64 bits at once.

fn segment_at(place: u32) -> Segment {
    return Segment(quad_f32(segments[2u * place]), quad_f32(segments[2u * place + 1u]));
}
