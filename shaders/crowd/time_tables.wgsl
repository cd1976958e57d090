// The times of a clip: its length, and the spans of its time bases.

/// A clip as `crowd_work` reads it.
struct CrowdClip {
    /// Its length in ticks, at least 1.
    period: u32,
    /// Its first time base, and how many it has.
    first_base: u32,
    bases: u32,
}

/// A time base: spans of time that some of a clip's channels share.
struct CrowdBase {
    /// The first span, and how many there are.
    first: u32,
    count: u32,
    /// The largest power of 2 below `count`, where the search starts; 0 for one span.
    step: u32,
}

/// A span of time.
struct CrowdSpan {
    /// The first tick in it, with `ON_KEY` where a key lies at exactly that tick.
    start: u32,
    /// parameter = (tick - whole) × scale + offset
    whole: i32,
    scale: f32,
    offset: f32,
}
