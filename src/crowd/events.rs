//! Events: named moments of clips, and when the layers of instances pass them.

use crate::crowd::layer::clip_position;
use crate::shader::{CrowdEntry, RUNS_BACKWARDS, SPEED_MAGNITUDE, WRAP_HOLD, WRAP_LOOP};

/// A moment of a clip, such as a step or the throw of a ball.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct ClipEvent {
    /// The clip's index in the library.
    pub clip: usize,
    /// The tick of the clip, from 0 to its length.
    pub tick: u32,
    /// The name. Several events may have one name.
    pub name: String,
}

/// An event that a layer of an instance passed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PassedEvent {
    /// The clock's time in ticks at which the layer reached the event.
    pub clock: u64,
    /// The instance.
    pub instance: usize,
    /// The layer.
    pub layer: usize,
    /// The event's index in the library.
    pub event: usize,
    /// The weight of the layer now, from 0 to 1.
    pub weight: f32,
}

/// The times at which a layer passes one tick of its clip: once, or once in each round.
///
/// The layer's position counts in 2^-16 ticks and grows linearly with the clock, without wrapping. If the
/// layer plays backwards, position and tick are counted on the reversed axis, so that the position grows then, too.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Passages {
    /// The position at the time 0 of the clock.
    origin: i128,
    /// How far the position moves in a tick of the clock; positive.
    speed: i128,
    /// The first position that is passed, and the distance to the next.
    first: i128,
    round: i128,
    /// How often it is passed.
    pub(crate) count: u64,
}

impl Passages {
    /// The passages of a tick after the first of two times of the clock, up to the second: one sequence, or two if a mirrored
    /// clip runs over the tick in both directions.
    pub(crate) fn of(
        entry: &CrowdEntry,
        period: u32,
        tick: u32,
        [since, clock]: [u64; 2],
    ) -> impl Iterator<Item = Self> {
        let modes = entry.speed_and_modes;
        let (wrap, backwards) = ((modes >> 29) & 3, modes & RUNS_BACKWARDS != 0);
        let speed = i128::from(modes & SPEED_MAGNITUDE);
        let (tick, period) = (i128::from(tick), i128::from(period));
        let (ticks, round) = match wrap {
            WRAP_HOLD => ([Some(tick), None], None),
            WRAP_LOOP => ([Some(tick), None], Some(period)),
            _ => {
                let back = 2 * period - tick;
                let is_end = tick == 0 || tick == period;
                ([Some(tick), (!is_end).then_some(back)], Some(2 * period))
            }
        };
        let position = clip_position(entry, clock, 0);
        // A tick is 2^16 units of the position. Forwards, the position reaches a tick at the first of these units,
        // backwards at the last one.
        let (position, end_of_tick) = match backwards {
            true => (-position, 0xffff),
            false => (position, 0),
        };
        let origin = position - speed * i128::from(clock);
        let before = position - speed * i128::from(clock - since);
        ticks.into_iter().flatten().filter_map(move |tick| {
            let at = match backwards {
                true => -((tick << 16) + end_of_tick),
                false => tick << 16,
            };
            let (first, round, count) = match round {
                None => (at, 1, i128::from(before < at && at <= position)),
                Some(round) => {
                    let round = round << 16;
                    // The crossings are at `at + k * round`: the first one after `before`, and the number of them up to
                    // `position`.
                    let first = at + ((before - at).div_euclid(round) + 1) * round;
                    (first, round, (position - first).div_euclid(round) + 1)
                }
            };
            (count > 0 && speed > 0).then_some(Self {
                origin,
                speed,
                first,
                round,
                count: u64::try_from(count).unwrap_or(u64::MAX),
            })
        })
    }

    /// The time of the clock at which the position is reached for the n-th time, rounded up to a tick.
    pub(crate) fn clock(&self, n: u64) -> u64 {
        let distance = self.first + i128::from(n) * self.round - self.origin;
        let ticks = (distance + self.speed - 1).div_euclid(self.speed);
        u64::try_from(ticks).unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::crowd::layer::CrowdLayer;
    use crate::shader::CrowdClip;
    use crate::time::wrap::WrapMode;

    /// The times at which whole ticks of the position include one that wraps to `tick`, counted one by one.
    fn counted(
        entry: &CrowdEntry,
        wrap: WrapMode,
        period: i128,
        tick: i128,
        [since, clock]: [u64; 2],
    ) -> Vec<u64> {
        let whole = |clock| clip_position(entry, clock, 0) >> 16;
        let is_event = |x: i128| match wrap {
            WrapMode::Hold => x == tick,
            WrapMode::Loop => x.rem_euclid(period) == tick % period,
            _ => {
                let y = x.rem_euclid(2 * period);
                y == tick || 2 * period - y == tick
            }
        };
        let mut found = Vec::new();
        for now in since + 1..=clock {
            let (before, after) = (whole(now - 1), whole(now));
            let reached = match before <= after {
                true => before + 1..=after,
                false => after..=before - 1,
            };
            found.extend(reached.filter(|&x| is_event(x)).map(|_| now));
        }
        found
    }

    proptest! {
        #[test]
        fn events_are_passed_when_whole_ticks_reach_them(
            (period, tick, time) in (1u32..60, 0u32..60, -200i64..200),
            (set, before, passed) in (0u64..2000, 0u64..300, 0u64..300),
            (speed, wrap) in (-5.0f32..5.0, 0usize..3),
        ) {
            let tick = tick % (period + 1);
            let clips = [CrowdClip { period, first_base: 0, bases: 0 }];
            let wrap = [WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror][wrap];
            let layer = CrowdLayer { time, speed, wrap, ..CrowdLayer::new(0) };
            let entry = layer.packed(&clips, 0, set).unwrap();
            let times = [set + before, set + before + passed];
            let mut found: Vec<u64> = Passages::of(&entry, period, tick, times)
                .flat_map(|passages| (0..passages.count).map(move |n| passages.clock(n)))
                .collect();
            found.sort_unstable();
            prop_assert_eq!(found, counted(&entry, wrap, period.into(), tick.into(), times));
        }
    }
}
