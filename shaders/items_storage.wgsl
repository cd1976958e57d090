// What `kernel` reads of its work list, as it is stored.

@group(0) @binding(2) var<storage, read> items: array<Item>;
@group(0) @binding(3) var<storage, read> distances: array<f32>;

fn item_at(place: u32) -> Item {
    return items[place];
}

fn distance_at(place: u32) -> f32 {
    return distances[place];
}
