//! Events: named moments of clips, and when the layers of instances pass them.

use crate::crowd::layer::clip_position;
use crate::crowd::library::CrowdLibrary;
use crate::crowd::player::Crowd;
use crate::crowd_error::CrowdError;
use crate::memory::reserved;
use crate::shader::{
    CrowdEntry, RUNS_BACKWARDS, SPEED_MAGNITUDE, WEIGHT_UNIT, WRAP_HOLD, WRAP_LOOP,
};

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
    /// The time of the clock at which the layer reached the event, ticks.
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

impl CrowdLibrary {
    /// Adds an event to a clip and returns the event's index. Crowds that exist already do not have it.
    ///
    /// # Errors
    /// When there is no such clip, or the tick is after its end.
    pub fn push_event(
        &mut self,
        clip: usize,
        tick: u32,
        name: impl Into<String>,
    ) -> Result<usize, CrowdError> {
        let count = self.clip_count();
        let Some(ticks) = self.ticks(clip) else {
            return Err(CrowdError::Missing {
                subject: "clip",
                index: clip,
                count,
            });
        };
        if tick > ticks {
            return Err(CrowdError::EventTick { tick, ticks });
        }
        let name = name.into();
        self.events.push(ClipEvent { clip, tick, name });
        Ok(self.events.len() - 1)
    }

    /// The events of all clips, in the order in which they were added.
    #[must_use]
    pub fn events(&self) -> &[ClipEvent] {
        &self.events
    }
}

impl Crowd {
    /// The events that the layers of all instances passed after the time `since` of the clock, up to its current time:
    /// in the order of the times at which they were passed, then of instances, layers and events.
    ///
    /// A layer passes an event when its time in the clip reaches the event's tick, in either direction, and in a loop once in
    /// each round. Times are whole ticks, so that one large step passes the same events as many small ones. What counts is the
    /// clips that the layers play now: call it after the clock moved, and before layers are set to other clips.
    /// Layers with weight 0 pass events, too; look at [`PassedEvent::weight`].
    ///
    /// ```
    /// use tumble::crowd::{CrowdLayer, CrowdLibrary};
    /// use tumble::glam::{Quat, Vec3};
    /// use tumble::{Device, Engine, Skeleton, TrackSet, VectorMethod, method};
    /// # let mut walk = TrackSet::new();
    /// # walk.push("hip", &[0.0, 1.0], &[Quat::IDENTITY, Quat::from_rotation_y(1.0)])?;
    /// # let skeleton = Skeleton::new(vec![None], vec![Vec3::ZERO])?;
    /// let mut library = CrowdLibrary::new(&skeleton)?;
    /// let walk = library.push(&walk, method::SLERP, VectorMethod::Linear)?;
    /// let step = library.push_event(walk, 352_800, "left foot down")?; // half a second after the clip's start
    ///
    /// let mut crowd = Engine::new(Device::Cpu)?.crowd(&library, 2, 1)?;
    /// crowd.set(1, 0, CrowdLayer::new(walk))?;
    /// let before = crowd.clock();
    /// crowd.advance(3.0)?;
    /// let passed = crowd.passed_events(before)?;
    /// assert_eq!(passed.len(), 3); // instance 0 stands still
    /// assert_eq!((passed[0].instance, passed[0].event, passed[0].clock), (1, step, 352_800));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When `since` is later than the clock, or there is not enough memory for the list.
    pub fn passed_events(&self, since: u64) -> Result<Vec<PassedEvent>, CrowdError> {
        let clock = self.clock();
        if since > clock {
            return Err(CrowdError::EventsSince { since, clock });
        }
        let library = self.library();
        // The events of each clip, with their indices.
        let mut of_clip = vec![Vec::new(); library.clip_count()];
        for (index, event) in library.events.iter().enumerate() {
            of_clip[event.clip].push((index, event.tick));
        }
        let passages = || {
            let entries = self.instances.entries.iter().enumerate();
            entries.flat_map(|(index, entry)| {
                let clip = (entry.clip_and_weight & 0xffff) as usize;
                let period = library.tables.clips[clip].period;
                let events = of_clip[clip].iter();
                events.flat_map(move |&(event, tick)| {
                    let all = Passages::of(entry, period, tick, [since, clock]);
                    all.map(move |passages| (index, event, passages))
                })
            })
        };
        let count: u64 = passages().map(|(.., passages)| passages.count).sum();
        let mut passed = reserved(usize::try_from(count).unwrap_or(usize::MAX), "events")?;
        for (index, event, passages) in passages() {
            let weight = (self.instances.entries[index].clip_and_weight >> 16) as f32 * WEIGHT_UNIT;
            passed.extend((0..passages.count).map(|round| PassedEvent {
                clock: passages.clock(round),
                instance: index / self.layer_count(),
                layer: index % self.layer_count(),
                event,
                weight,
            }));
        }
        passed.sort_by_key(|event| (event.clock, event.instance, event.layer, event.event));
        Ok(passed)
    }
}

/// The times at which a layer passes one tick of its clip: once, or once in each round.
///
/// The layer's position counts in 2^-16 ticks and grows linearly with the clock, without wrapping. Backwards, position and
/// tick are those of the mirrored axis, so that it grows, too.
#[derive(Debug, Clone, Copy)]
struct Passages {
    /// The position at the time 0 of the clock.
    origin: i128,
    /// How far the position moves in a tick of the clock; positive.
    speed: i128,
    /// The first position that is passed, and the distance to the next.
    first: i128,
    round: i128,
    count: u64,
}

impl Passages {
    /// The passages of a tick after the first of two times of the clock, up to the second: one sequence, or two if a mirrored
    /// clip runs over the tick in both directions.
    fn of(
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
                let is_turn = tick == 0 || tick == period;
                ([Some(tick), (!is_turn).then_some(back)], Some(2 * period))
            }
        };
        let position = clip_position(entry, clock);
        // Whole ticks: forwards the position reaches a tick at its beginning, and backwards at its end.
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
                    // The first of at + k round that is greater than `before`, and how many are up to `position`.
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
    fn clock(&self, n: u64) -> u64 {
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
        let whole = |clock| clip_position(entry, clock) >> 16;
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
