//! A layer of an instance, and its 16 bytes for the kernels.

use crate::crowd::fade::weight_units;
use crate::crowd_error::{CrowdError, FASTEST, MAX_MASKS};
use crate::names::fields::with_fields;
use crate::names::names;
use crate::shader::{
    CrowdClip, CrowdEntry, RUNS_BACKWARDS, SPEED_MAGNITUDE, START_BIAS, WEIGHT_UNIT, WRAP_HOLD,
    WRAP_LOOP, WRAP_MIRROR,
};
use crate::time::wrap::WrapMode;
use crate::twin::crowd_times::{elapsed, tick_of};

/// The units of a speed of 1.
const SPEED_UNITS: f32 = 65536.0;

/// A clip that an instance plays, and its time, speed, wrap mode and weight.
///
/// A clip's time counts in ticks from its first key
/// ([`CrowdLibrary::ticks_per_second`](crate::crowd::library::CrowdLibrary::ticks_per_second)). Speeds are rounded to
/// multiples of 2^-16 and weights to multiples of 2^-15.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct CrowdLayer {
    /// The clip's index in the library.
    pub clip: usize,
    /// The layer's current time in ticks of the clip. Outside the clip the wrap mode applies.
    pub time: i64,
    /// The speed: ticks of the clip for each tick of the clock, between -128 and 128; negative to play backwards.
    pub speed: f32,
    /// Outside its keys the clip stays at its ends (`Hold`), starts again (`Loop`) or runs back and forth (`Mirror`).
    /// [`WrapMode::Extrapolate`] is refused.
    pub wrap: WrapMode,
    /// The weight with which the layer is blended over the layers below, 0 to 1. The weight of the first layer is
    /// ignored.
    pub weight: f32,
    /// How the clip is combined with the layers below.
    pub blend: LayerBlend,
    /// The index of a mask of the library; `None`: all joints take part.
    pub mask: Option<usize>,
}

/// How a layer of an instance is combined with the layers below.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum LayerBlend {
    /// The result lies between the layers below and the clip, by the weight.
    #[default]
    Over,
    /// The clip's difference from its reference pose is added to the layers below, by the weight.
    Additive,
}

names! {
    LayerBlend, "blend",
    Over => "over",
    Additive => "additive",
}

with_fields! {
    CrowdLayer:
    with_speed(speed: f32),
    with_wrap(wrap: WrapMode),
    with_weight(weight: f32),
    with_blend(blend: LayerBlend),
    with_mask(mask: Option<usize>),
}

impl CrowdLayer {
    /// A layer that plays a clip from its start, at speed 1, in a loop, with a weight of 1.
    #[must_use]
    pub fn new(clip: usize) -> Self {
        Self {
            clip,
            time: 0,
            speed: 1.0,
            wrap: WrapMode::Loop,
            weight: 1.0,
            blend: LayerBlend::Over,
            mask: None,
        }
    }

    /// The same layer at another time in ticks of its clip.
    #[must_use]
    pub fn at(self, time: i64) -> Self {
        Self { time, ..self }
    }

    /// The layer's bytes for the kernels; `clock` is the time of the clock at which the layer's time is `self.time`.
    pub(crate) fn packed(
        &self,
        clips: &[CrowdClip],
        masks: usize,
        clock: u64,
    ) -> Result<CrowdEntry, CrowdError> {
        let missing = |subject, index, count| {
            Err(CrowdError::Missing {
                subject,
                index,
                count,
            })
        };
        let Some(clip) = clips.get(self.clip) else {
            return missing("clip", self.clip, clips.len());
        };
        let mask = match self.mask {
            None => 0,
            Some(mask) if mask < masks.min(MAX_MASKS) => mask as u32 + 1,
            Some(mask) => return missing("mask", mask, masks),
        };
        let weight = weight_units(self.weight)?;
        if self.speed.is_nan() || self.speed.abs() >= FASTEST {
            let speed = self.speed;
            return Err(CrowdError::Speed { speed });
        }
        let wrap = match self.wrap {
            WrapMode::Hold => WRAP_HOLD,
            WrapMode::Loop => WRAP_LOOP,
            WrapMode::Mirror => WRAP_MIRROR,
            wrap @ WrapMode::Extrapolate => return Err(CrowdError::Wrap { wrap }),
        };
        let units = (self.speed.abs() * SPEED_UNITS).round() as u32;
        let units = units.min(SPEED_MAGNITUDE);
        let backwards = self.speed < 0.0;
        let modes = if backwards { RUNS_BACKWARDS } else { 0 }
            | mask << 24
            | wrap << 29
            | u32::from(self.blend == LayerBlend::Additive) << 31;
        // The anchor is up to 255 ticks before the clock. Meanwhile the layer has moved by this much.
        let moved = i64::from(units) * (clock & 0xff) as i64;
        let moved = if backwards { -moved } else { moved } >> 16;
        let mut start = folded(self.time.into(), wrap, clip.period) - moved;
        if wrap != WRAP_HOLD {
            start = folded(start.into(), wrap, clip.period);
        }
        Ok(CrowdEntry {
            clip_and_weight: self.clip as u32 | weight << 16,
            speed_and_modes: units | modes,
            start: (start + i64::from(START_BIAS)) as u32,
            anchor: (clock >> 8) as u32,
        })
    }

    /// The layer that an entry describes, at the clock's time `to` instead of `clock`; `to` may be earlier.
    pub(crate) fn moved(entry: &CrowdEntry, clips: &[CrowdClip], clock: u64, to: u64) -> Self {
        let modes = entry.speed_and_modes;
        let units = modes & SPEED_MAGNITUDE;
        let backwards = modes & RUNS_BACKWARDS != 0;
        let clip = (entry.clip_and_weight & 0xffff) as usize;
        let (wrap, period) = ((modes >> 29) & 3, clips[clip].period);
        let later = clip_position(entry, clock, i128::from(to) - i128::from(clock));
        let ticks = later >> 16;
        let speed = units as f32 / SPEED_UNITS;
        Self {
            clip,
            time: folded(ticks, wrap, period),
            speed: if backwards { -speed } else { speed },
            wrap: match wrap {
                WRAP_HOLD => WrapMode::Hold,
                WRAP_LOOP => WrapMode::Loop,
                _ => WrapMode::Mirror,
            },
            weight: (entry.clip_and_weight >> 16) as f32 * WEIGHT_UNIT,
            blend: LayerBlend::ALL[(modes >> 31) as usize],
            mask: (((modes >> 24) & 0x1f) as usize).checked_sub(1),
        }
    }
}

/// The position of an entry: its time in the clip before wrapping, in units of 2^-16 ticks. It is that of `ticks` ticks after
/// the time `clock`, which is not before the entry's anchor; negative ticks are before it.
pub(crate) fn clip_position(entry: &CrowdEntry, clock: u64, ticks: i128) -> i128 {
    let modes = entry.speed_and_modes;
    let units = i128::from(modes & SPEED_MAGNITUDE);
    let is_backwards = modes & RUNS_BACKWARDS != 0;
    let start = i128::from(entry.start) - i128::from(START_BIAS);
    let moved = units * (i128::from(elapsed(entry, clock)) + ticks);
    (start << 16) + if is_backwards { -moved } else { moved }
}

impl CrowdEntry {
    /// Whether a mask says which joints take part.
    pub(crate) fn has_mask(&self) -> bool {
        (self.speed_and_modes >> 24) & 0x1f != 0
    }

    /// Whether the layers below have no influence: all joints have the clip's rotations, bit for bit.
    pub(crate) fn hides_lower_layers(&self) -> bool {
        let is_whole = (self.clip_and_weight >> 16) as f32 * WEIGHT_UNIT == 1.0;
        let is_additive = self.speed_and_modes >> 31 != 0;
        is_whole && !is_additive && !self.has_mask()
    }
}

/// The tick of its clip at which an entry is evaluated.
pub(crate) fn tick(entry: &CrowdEntry, clips: &[CrowdClip], clock: u64) -> u32 {
    let clip = &clips[(entry.clip_and_weight & 0xffff) as usize];
    tick_of(entry, clip.period, clock)
}

/// A time after wrapping: from 0 to the period, or for mirrored clips from 0 to two periods.
fn folded(time: i128, wrap: u32, period: u32) -> i64 {
    let period = i128::from(period);
    let folded = match wrap {
        WRAP_HOLD => time.clamp(0, period),
        WRAP_LOOP => time.rem_euclid(period),
        _ => time.rem_euclid(2 * period),
    };
    folded as i64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The integers of the kernels agree with whole numbers that never wrap, for days.
        #[test]
        fn ticks_are_those_of_the_formula(
            (period, time) in (1u32..1 << 31, any::<i64>()),
            (clock, passed) in (0u64..1 << 50, 0u64..1 << 39),
            (speed, wrap) in (-127.9f32..127.9, 0usize..3),
        ) {
            let period = period.min(crate::crowd_error::MAX_TICKS);
            let clips = [CrowdClip { period, first_base: 0, bases: 0 }];
            let wrap = [WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror][wrap];
            let layer = CrowdLayer { time: time >> 2, speed, wrap, ..CrowdLayer::new(0) };
            let entry = layer.packed(&clips, 0, clock).unwrap();
            let now = clock + passed;
            let along = CrowdLayer::moved(&entry, &clips, now, now);
            prop_assert!((along.speed - speed).abs() <= 1.0 / SPEED_UNITS);
            let found = tick(&entry, &clips, now);
            let expected = match along.time > i64::from(period) {
                true => 2 * i64::from(period) - along.time,
                false => along.time,
            };
            // A mirrored time between two ticks is rounded down, also while the clip plays backwards.
            let back = i64::from(wrap == WrapMode::Mirror && along.time >= i64::from(period));
            let off = expected - i64::from(found);
            prop_assert!((0..=back).contains(&off), "{found}, {along:?}");
        }

        /// A layer that was just set is at the time that was asked for.
        #[test]
        fn what_is_set_is_where_it_says(
            (period, time, clock) in (1u32..1 << 30, 0i64..1 << 30, 0u64..1 << 50),
            speed in -127.9f32..127.9,
        ) {
            let clips = [CrowdClip { period, first_base: 0, bases: 0 }];
            let time = time % i64::from(period);
            for wrap in [WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror] {
                let layer = CrowdLayer { time, speed, wrap, ..CrowdLayer::new(0) };
                let entry = layer.packed(&clips, 0, clock).unwrap();
                prop_assert_eq!(i64::from(tick(&entry, &clips, clock)), time);
            }
        }
    }
}
