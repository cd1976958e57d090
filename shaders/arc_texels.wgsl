// `Segment` of `evaluate_arc` as texels.

fn segment_at(place: u32) -> Segment {
    let first = 2u * place;
    return Segment(
        bitcast<vec4f>(textureLoad(segments, first, 0)),
        bitcast<vec4f>(textureLoad(segments, first + 1u, 0)),
    );
}
