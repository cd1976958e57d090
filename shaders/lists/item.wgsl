// Work items, which the host lists.

/// Consecutive samples of one track that lie in one segment, or hold one constant.
struct Item {
    /// The segment's index; the constant's, when `count` carries `IS_CONSTANT`.
    source: u32,
    /// Where the first sample is stored, counted from where the dispatch's first is; in a grid, the
    /// first sample's position.
    output: u32,
    /// Number of samples, with the bit `IS_CONSTANT` if they are a constant. Where an invocation
    /// evaluates an item they are at most `ITEM_SAMPLES`; in a grid there are as many as there are,
    /// and the bit `MAY_BE_TINY` may be set.
    count: u32,
    /// For frames, the first sample's distance from the segment's middle; for explicit times, the
    /// index of its distance in the list of distances.
    first: i32,
    /// parameter = distance * scale + offset
    scale: f32,
    offset: f32,
}
