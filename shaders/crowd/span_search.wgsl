// The span of a time base at a tick.
// Twin: src/twin/crowd_times.rs.

// The last span of a time base that does not start after a tick.
fn span_at(base: CrowdBase, tick: u32) -> u32 {
    var found = 0u;
    for (var step = base.step; step != 0u; step = step >> 1u) {
        let next = found + step;
        let inside = next < base.count;
        let start = spans[base.first + select(0u, next, inside)].start & TICKS;
        found = select(found, next, inside & (tick >= start));
    }
    return found;
}
