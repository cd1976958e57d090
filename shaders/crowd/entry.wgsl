// Structs that the kernels over a crowd share: the entries of layers, and where in a clip each stands.
// Twin: src/twin/crowd_times.rs.

/// The clip that one layer of an instance plays, and since when: all that the host writes when it changes.
struct CrowdEntry {
    /// The clip, 16 bits, and above it the weight in units of 2^-15; 0 leaves the layer out.
    clip_and_weight: u32,
    /// The speed in units of 2^-16: its magnitude, 23 bits, and whether it runs backwards, 1 bit.
    /// Above them the mask, 5 bits, the wrap mode, 2 bits, and whether the layer is additive, 1 bit.
    speed_and_modes: u32,
    /// The clip's own time in ticks, plus `START_BIAS`, when the clock stood at the anchor.
    start: u32,
    /// The anchor: ticks of the clock without the lowest 8 bits.
    anchor: u32,
}

/// Where a layer stands in one time base of its clip.
struct CrowdPosition {
    /// The span; with the bit `ON_KEY` exactly at its first key.
    span: u32,
    /// The parameter in the span, about -1/2 to 1/2.
    parameter: f32,
}

/// Where one channel (the rotation, the translation or the scale) of a joint lies in a clip.
struct CrowdChannel {
    /// The cell of its first constant in the first span.
    first: u32,
    /// How many channels lie beside each other: the next constant is `count` cells on. 0 for a channel
    /// that is constant.
    count: u32,
    /// The form, 8 bits, above the index of its time base in the clip, 24 bits.
    form_and_base: u32,
    /// The cell of its first key.
    keys: u32,
}

// Channels of a joint: the rotation, the translation and the scale.
const CHANNELS: u32 = 3;

// Set in a span's start, and in a position: there is a key.
const ON_KEY: u32 = 0x80000000;
const TICKS: u32 = 0x7fffffff;
