// `Segment` of `evaluate_polynomial` as texels.

fn segment_at(place: u32) -> Segment {
    let first = 11u * place;
    return Segment(array(
        coefficient_at(first),
        coefficient_at(first + 1u),
        coefficient_at(first + 2u),
        coefficient_at(first + 3u),
        coefficient_at(first + 4u),
        coefficient_at(first + 5u),
        coefficient_at(first + 6u),
        coefficient_at(first + 7u),
        coefficient_at(first + 8u),
        coefficient_at(first + 9u),
        coefficient_at(first + 10u),
    ));
}

fn coefficient_at(texel: u32) -> vec4f {
    return bitcast<vec4f>(textureLoad(segments, texel, 0));
}
