// The tick of its clip at which a layer is, and the span there, by integers alone.
// Twin: src/twin/crowd_times.rs.

// Added to every start, so that none is negative.
const START_BIAS: u32 = 0x20000;
const SPEED_MAGNITUDE: u32 = 0x7fffff;
const RUNS_BACKWARDS: u32 = 0x800000;
const WRAP_HOLD: u32 = 0;
const WRAP_LOOP: u32 = 1;
const WRAP_MIRROR: u32 = 2;

// Whole numbers of 64 bits: the lower word, the upper word.
fn wide_less(a: vec2u, b: vec2u) -> bool {
    return select(a.x < b.x, a.y < b.y, a.y != b.y);
}

fn wide_sum(a: vec2u, b: vec2u) -> vec2u {
    let low = a.x + b.x;
    return vec2u(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn wide_difference(a: vec2u, b: vec2u) -> vec2u {
    return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

// The product of two numbers of 32 bits.
fn wide_product(a: u32, b: u32) -> vec2u {
    let al = a & 0xffffu;
    let ah = a >> 16u;
    let bl = b & 0xffffu;
    let bh = b >> 16u;
    let low = al * bl;
    let left = ah * bl;
    let right = al * bh;
    let middle = (low >> 16u) + (left & 0xffffu) + (right & 0xffffu);
    let high = ah * bh + (left >> 16u) + (right >> 16u) + (middle >> 16u);
    return vec2u((low & 0xffffu) | (middle << 16u), high);
}

// x modulo q, for x below 2^63 and q from 1 on: multiples of q by powers of 2 are taken away.
fn wide_remainder(x: vec2u, q: vec2u) -> vec2u {
    var rest = x;
    var multiple = q;
    while !wide_less(rest, multiple) & (multiple.y < 0x40000000u) {
        multiple = vec2u(multiple.x << 1u, (multiple.y << 1u) | (multiple.x >> 31u));
    }
    while !wide_less(multiple, q) {
        if !wide_less(rest, multiple) {
            rest = wide_difference(rest, multiple);
        }
        multiple = vec2u((multiple.x >> 1u) | (multiple.y << 31u), multiple.y >> 1u);
    }
    return rest;
}

// A number of ticks in units of 2^-16.
fn in_parts(ticks: u32) -> vec2u {
    return vec2u(ticks << 16u, ticks >> 16u);
}

// The tick of the clip at which a layer stands, from 0 to `period`.
fn tick_of(entry: CrowdEntry, period: u32) -> u32 {
    let modes = entry.speed_and_modes;
    let backwards = (modes & RUNS_BACKWARDS) != 0u;
    let wrap = (modes >> 29u) & 3u;
    let clock = vec2u(dispatch.clock_low, dispatch.clock_high);
    let elapsed = wide_difference(clock, vec2u(entry.anchor << 8u, entry.anchor >> 24u));
    let speed = modes & SPEED_MAGNITUDE;
    let low = wide_product(speed, elapsed.x);
    let moved = vec2u(low.x, low.y + speed * (elapsed.y & 0xffu));
    let zero = in_parts(START_BIAS);
    let end = in_parts(period + START_BIAS);
    var now = in_parts(entry.start);
    if wrap == WRAP_HOLD {
        if backwards {
            let held = wide_less(now, wide_sum(moved, zero));
            now = select(wide_difference(now, moved), zero, held);
        } else {
            now = wide_sum(now, moved);
        }
        let early = wide_less(now, zero);
        now = select(now, zero, early);
        let late = wide_less(end, now);
        now = select(now, end, late);
    } else {
        // One period forwards, or one there and back.
        let whole = in_parts(period << (wrap - WRAP_LOOP));
        let along = wide_remainder(moved, whole);
        let on = wide_sum(now, select(along, wide_difference(whole, along), backwards));
        let into = wide_remainder(wide_difference(on, zero), whole);
        now = wide_sum(into, zero);
        if wide_less(end, now) {
            now = wide_difference(wide_sum(in_parts(period << 1u), zero), into);
        }
    }
    let found = wide_difference(now, zero);
    return (found.x >> 16u) | (found.y << 16u);
}

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
