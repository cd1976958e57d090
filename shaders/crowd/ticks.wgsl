// The tick of its clip at which a layer is, by integers alone.
// Twin: src/twin/crowd_times.rs.

// Added to every start, so that none is negative.
const START_BIAS: u32 = 0x20000;
const SPEED_MAGNITUDE: u32 = 0x7fffff;
const RUNS_BACKWARDS: u32 = 0x800000;
const WRAP_HOLD: u32 = 0;
const WRAP_LOOP: u32 = 1;
const WRAP_MIRROR: u32 = 2;

// Whole numbers of 64 bits: the lower word, the upper word.
fn wide_difference(a: vec2u, b: vec2u) -> vec2u {
    return vec2u(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

// How high a layer has moved: whole ticks, below 2^48, and 1 if it is a part of a tick more.
struct CrowdMove {
    ticks: vec2u,
    part: u32,
}

// The product of a speed, below 2^23 in units of 2^-16, and a time, below 2^40.
fn move_of(speed: u32, time: vec2u) -> CrowdMove {
    let speed_low = speed & 0xffffu;
    let speed_high = speed >> 16u;
    let time_low = time.x & 0xffffu;
    let time_high = time.x >> 16u;
    let parts = speed_low * time_low;
    let first = (parts >> 16u) + speed_high * time_low;
    let second = speed_low * time_high;
    // In units of 2^16 ticks.
    let high = speed_high * time_high + speed * time.y;
    let near = first + second;
    let low = near + (high << 16u);
    let carried = select(0u, 1u, near < first) + select(0u, 1u, low < near);
    return CrowdMove(vec2u(low, (high >> 16u) + carried), select(0u, 1u, (parts & 0xffffu) != 0u));
}

// x modulo q, for q from 1 on.
fn remainder(x: u32, q: u32) -> u32 {
    return x - (x / q) * q;
}

// x modulo q, for x below 2^48 and q from 1 to 2^31.
fn tick_remainder(x: vec2u, q: u32) -> u32 {
    if x.y == 0u {
        return remainder(x.x, q);
    }
    // At least an hour and a half of the clock. The lower word is brought down by digits, of as many bits as fit beside
    // a remainder.
    var digit = 16u;
    while ((q - 1u) >> (32u - digit)) != 0u {
        digit = digit >> 1u;
    }
    var rest = remainder(x.y, q);
    var low = x.x;
    for (var left = 32u; left != 0u; left -= digit) {
        rest = remainder((rest << digit) | (low >> (32u - digit)), q);
        low = low << digit;
    }
    return rest;
}

// The tick at which a layer stands that does not go on behind an end of its clip. It has moved by `ticks` and, if
// `part` is 1, a part of one more.
fn held_tick(start: u32, ticks: vec2u, part: u32, backwards: bool, period: u32) -> u32 {
    let end = period + START_BIAS;
    let later = start + ticks.x;
    let earlier = start - ticks.x - part;
    // Where it is beyond what 32 bits can say.
    let is_outside = (ticks.y != 0u) | select(later < start, start <= ticks.x, backwards);
    let moved = select(later, earlier, backwards);
    let tick = select(moved, select(end, 0u, backwards), is_outside);
    return select(select(tick, end, tick > end), START_BIAS, tick < START_BIAS) - START_BIAS;
}

// The tick of the clip at which a layer stands, from 0 to `period`.
fn tick_of(entry: CrowdEntry, period: u32) -> u32 {
    let modes = entry.speed_and_modes;
    let backwards = (modes & RUNS_BACKWARDS) != 0u;
    let wrap = (modes >> 29u) & 3u;
    let clock = vec2u(dispatch.clock_low, dispatch.clock_high);
    let elapsed = wide_difference(clock, vec2u(entry.anchor << 8u, entry.anchor >> 24u));
    let moved = move_of(modes & SPEED_MAGNITUDE, vec2u(elapsed.x, elapsed.y & 0xffu));
    let ticks = moved.ticks;
    let part = moved.part;
    if wrap == WRAP_HOLD {
        return held_tick(entry.start, ticks, part, backwards, period);
    }
    // One period forwards, or one there and back, of which the division has half.
    let doubled = wrap - WRAP_LOOP;
    let whole = period << doubled;
    let half = vec2u((ticks.x >> doubled) | ((ticks.y & doubled) << 31u), ticks.y >> doubled);
    let along = (tick_remainder(half, period) << doubled) | (ticks.x & doubled);
    let first = entry.start - START_BIAS;
    let start = select(first, 0u, first == whole);
    let forwards = select(along, whole - along - part, backwards);
    // Without a sum that 32 bits may not hold.
    let room = whole - forwards;
    let into = select(start + forwards, start - room, start >= room);
    // Behind the end it comes back.
    return select(into, whole - into - part, into + part > period);
}
