//! Twin of `shaders/crowd/ticks.wgsl`, `shaders/crowd/span_search.wgsl`, `shaders/crowd/times.wgsl` and
//! `shaders/crowd/entry.wgsl`: the same results, by whole numbers of 64 bits, where the shaders have words of 32.

use crate::shader::{
    CrowdBase, CrowdClip, CrowdEntry, CrowdPosition, CrowdSpan, ON_KEY, RUNS_BACKWARDS,
    SPEED_MAGNITUDE, START_BIAS, TICKS, WRAP_HOLD, WRAP_LOOP,
};

/// Bits of the time since an anchor, in ticks.
pub(crate) const ELAPSED_BITS: u32 = 40;

/// A number of ticks in units of 2^-16.
#[inline(always)]
pub(crate) fn in_parts(ticks: u32) -> u64 {
    u64::from(ticks) << 16
}

/// x modulo q, for x below 2^63 and q from 1 on.
#[inline(always)]
pub(crate) fn wide_remainder(x: u64, q: u64) -> u64 {
    // Usually less than a period has passed. The comparison avoids a division, which takes longer than the rest.
    if x < q { x } else { x % q }
}

/// Ticks of the clock since an entry's anchor.
#[inline(always)]
pub(crate) fn elapsed(entry: &CrowdEntry, clock: u64) -> u64 {
    clock.wrapping_sub(u64::from(entry.anchor) << 8) & ((1 << ELAPSED_BITS) - 1)
}

/// The tick of the clip at which a layer is evaluated, from 0 to `period`.
#[inline(always)]
pub(crate) fn tick_of(entry: &CrowdEntry, period: u32, clock: u64) -> u32 {
    let modes = entry.speed_and_modes;
    let backwards = modes & RUNS_BACKWARDS != 0;
    let wrap = (modes >> 29) & 3;
    let speed = u64::from(modes & SPEED_MAGNITUDE);
    let moved = speed.wrapping_mul(elapsed(entry, clock));
    let zero = in_parts(START_BIAS);
    let end = in_parts(period.wrapping_add(START_BIAS));
    let mut now = in_parts(entry.start);
    if wrap == WRAP_HOLD {
        now = match backwards {
            true if now < moved.wrapping_add(zero) => zero,
            true => now.wrapping_sub(moved),
            false => now.wrapping_add(moved),
        };
        now = if now < zero { zero } else { now };
        now = if end < now { end } else { now };
    } else {
        let whole = in_parts(period << (wrap - WRAP_LOOP));
        let along = wide_remainder(moved, whole);
        let on = now + if backwards { whole - along } else { along };
        let into = wide_remainder(on.wrapping_sub(zero), whole);
        now = into + zero;
        if end < now {
            now = in_parts(period << 1) + zero - into;
        }
    }
    ((now - zero) >> 16) as u32
}

/// The last span of a time base that does not start after a tick.
#[inline(always)]
pub(crate) fn span_at(base: &CrowdBase, spans: &[CrowdSpan], tick: u32) -> u32 {
    let mut found = 0;
    let mut step = base.step;
    while step != 0 {
        let next = found + step;
        let inside = next < base.count;
        let start = spans[(base.first + if inside { next } else { 0 }) as usize].start & TICKS;
        if inside & (tick >= start) {
            found = next;
        }
        step >>= 1;
    }
    found
}

/// The position of a layer in one of its clip's time bases.
#[inline(always)]
pub(crate) fn position_at(base: &CrowdBase, spans: &[CrowdSpan], tick: u32) -> CrowdPosition {
    let index = span_at(base, spans, tick);
    let span = &spans[(base.first + index) as usize];
    // An integer converts with one rounding, like the shader's sum of two exact halves.
    let distance = (tick as i32).wrapping_sub(span.whole) as f32;
    let is_key = span.start == tick | ON_KEY;
    CrowdPosition {
        span: index | if is_key { ON_KEY } else { 0 },
        parameter: distance * span.scale + span.offset,
    }
}

/// The position of a layer in every time base of its clip.
#[inline(always)]
pub(crate) fn base_positions(
    entry: &CrowdEntry,
    clock: u64,
    clips: &[CrowdClip],
    bases: &[CrowdBase],
    spans: &[CrowdSpan],
    output: &mut [CrowdPosition],
) {
    let clip = &clips[(entry.clip_and_weight & 0xffff) as usize];
    let tick = tick_of(entry, clip.period, clock);
    let clip_bases = &bases[clip.first_base as usize..][..clip.bases as usize];
    for (base, position) in clip_bases.iter().zip(output) {
        *position = position_at(base, spans, tick);
    }
}
