// What `kernel_singles` reads of its list, as it is stored.

@group(0) @binding(2) var<storage, read> singles: array<Single>;

fn single_at(place: u32) -> Single {
    return singles[place];
}
