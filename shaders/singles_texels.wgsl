// What `kernel_singles` reads of its list, as texels of 16 bytes.

@group(0) @binding(2) var singles: texture_1d<u32>;

fn single_at(place: u32) -> Single {
    let two = textureLoad(singles, place / 2u, 0);
    let own = select(two.xy, two.zw, (place & 1u) == 1u);
    return Single(own.x, bitcast<f32>(own.y));
}
