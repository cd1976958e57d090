// Writes entries that changed where each belongs.
// Twin: src/twin/crowd_entries.rs.

/// An entry that changed, and which one it is.
struct CrowdChange {
    /// Its index among all, `[instance][layer]`.
    index: u32,
    /// The words of the entry.
    clip_and_weight: u32,
    speed_and_modes: u32,
    start: u32,
    anchor: u32,
}

@group(0) @binding(0) var<storage, read> changes: array<CrowdChange>;
@group(0) @binding(1) var<storage, read_write> all: array<vec4u>;

// `index` is a change.
fn crowd_work(index: u32) {
    let change = changes[index];
    all[change.index] = vec4u(change.clip_and_weight, change.speed_and_modes, change.start, change.anchor);
}
