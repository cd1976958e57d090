// What `kernel` reads of its work list, as texels of 16 bytes.

@group(0) @binding(2) var items: texture_1d<u32>;
@group(0) @binding(3) var distances: texture_1d<u32>;

// An item is a texel and a half.
fn item_at(place: u32) -> Item {
    let texel = (3u * place) / 2u;
    let first = textureLoad(items, texel, 0);
    let second = textureLoad(items, texel + 1u, 0);
    let is_odd = (place & 1u) == 1u;
    let head = select(first, vec4u(first.zw, second.xy), is_odd);
    let tail = select(second.xy, second.zw, is_odd);
    return Item(
        head.x,
        head.y,
        head.z,
        bitcast<i32>(head.w),
        bitcast<f32>(tail.x),
        bitcast<f32>(tail.y),
    );
}

fn distance_at(place: u32) -> f32 {
    let four = textureLoad(distances, place / 4u, 0);
    let two = select(four.xy, four.zw, (place & 2u) == 2u);
    return bitcast<f32>(select(two.x, two.y, (place & 1u) == 1u));
}
