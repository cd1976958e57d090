//! Arcs with fewer samples than keys: a sample to a lane, straight from the two keys
//! beside it. No segment is kept, and none is made where no sample falls. The same
//! operations as by way of segments, and so the same bits.

use std::ops::Range;

use glam::Quat;

use super::dispatch::in_lanes;
use super::sample_lanes::{LANES, SampleBlock, Turns};
use crate::clock::{Ticks, Timeline};
use crate::engine::Error;
use crate::frame_clock::FrameClock;
use crate::method::Interpolation;
use crate::plan::{FramePlan, Stretch, time_sample};
use crate::prepare::flip;
use crate::segment::Sample;
use crate::segment::shader::HELD;
use crate::tracks::TrackSet;

/// Evaluates tracks; what it needs for that is kept.
pub(super) struct SampledArcs<'a> {
    interpolation: &'a Interpolation,
    block: Box<SampleBlock>,
    plan: FramePlan<'a>,
    /// The sign of the track's first key.
    sign: f32,
    /// For each interval, the sign of its first key, where any of them differ.
    signs: Vec<f32>,
}

impl<'a> SampledArcs<'a> {
    pub(super) fn new(interpolation: &'a Interpolation) -> Self {
        Self {
            interpolation,
            block: Box::new(SampleBlock::new(interpolation.form())),
            plan: FramePlan::new(),
            sign: 1.0,
            signs: Vec::new(),
        }
    }

    /// Every sample of some tracks, `[track][sample]`.
    pub(super) fn tracks(
        &mut self,
        set: &'a TrackSet,
        tracks: Range<usize>,
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let samples = timeline.len();
        let mut output = output.iter_mut();
        for index in tracks {
            let (times, keys) = set.times_and_keys(index);
            self.interpolation.ends.check(keys, index)?;
            let stretch = Stretch {
                times,
                keys,
                index,
                first_key: 0,
            };
            self.align(stretch, 1.0);
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let latest = times[times.len() - 1];
                    let clock = FrameClock::new(*rate, *start, latest);
                    self.frames(stretch, clock, &(0..samples), &mut output)?;
                }
                Ticks::Times {
                    times: asked,
                    stride,
                } => {
                    let own = &asked[index * stride..][..samples];
                    self.times(stretch, own, &mut output);
                }
            }
        }
        self.block.flush(&mut output);
        Ok(())
    }

    /// The samples of some intervals of a track, `window`, whose first key counts with
    /// `sign`.
    pub(super) fn stretch(
        &mut self,
        stretch: Stretch<'a>,
        sign: f32,
        clock: FrameClock,
        window: &Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<(), Error> {
        let mut output = output.iter_mut();
        self.align(stretch, sign);
        self.frames(stretch, clock, window, &mut output)?;
        self.block.flush(&mut output);
        Ok(())
    }

    /// The sign of every interval's first key, where the first one's is given; what it
    /// is behind the last.
    pub(super) fn align(&mut self, stretch: Stretch<'_>, mut sign: f32) -> f32 {
        let keys: &[[f32; 4]] = bytemuck::cast_slice(stretch.keys);
        self.signs.clear();
        self.sign = sign;
        if keys.len() == 2 && stretch.first_key == 0 {
            // The second key's sign is nobody's first.
            return sign;
        }
        let mut turns = Turns { keys, any: false };
        in_lanes(&mut turns);
        if turns.any {
            self.signs.reserve(keys.len());
            for pair in keys.windows(2) {
                self.signs.push(sign);
                sign *= flip(pair[0], pair[1]);
            }
        }
        sign
    }

    /// The samples in `window` of a stretch's intervals, and of what lies beside the
    /// track where it ends, one behind the other.
    fn frames(
        &mut self,
        stretch: Stretch<'a>,
        clock: FrameClock,
        window: &Range<usize>,
        output: &mut Output<'_>,
    ) -> Result<(), Error> {
        let samples = self.plan.samples(stretch, clock, window)?;
        let signs = Signs {
            all: self.sign,
            each: &self.signs,
        };
        for &sample in samples {
            self.block.push(stretch.keys, sample, &signs, output);
        }
        Ok(())
    }

    fn times(&mut self, stretch: Stretch<'_>, times: &[f64], output: &mut Output<'_>) {
        let signs = Signs {
            all: self.sign,
            each: &self.signs,
        };
        let mut near = 0;
        for &time in times {
            let sample = time_sample(stretch.times, time, near);
            near = (sample.key & !HELD) as usize;
            self.block.push(stretch.keys, sample, &signs, output);
        }
    }
}

/// The signs of intervals' first keys.
struct Signs<'a> {
    all: f32,
    /// Where any of them differ.
    each: &'a [f32],
}

/// What is still to be written.
type Output<'a> = std::slice::IterMut<'a, [f32; 4]>;

impl SampleBlock {
    /// Adds a sample, and works the block out when it is full.
    #[inline(always)]
    fn push(&mut self, keys: &[Quat], sample: Sample, signs: &Signs<'_>, output: &mut Output<'_>) {
        let lane = self.count;
        let key = (sample.key & !HELD) as usize;
        if sample.key & HELD == 0 {
            self.from[lane] = keys[key].to_array();
            self.to[lane] = keys[key + 1].to_array();
            self.signs[lane] = signs.each.get(key).copied().unwrap_or(signs.all);
        } else {
            // Between a key and itself lies that key, as it is stored.
            self.from[lane] = keys[key].to_array();
            self.to[lane] = self.from[lane];
            self.signs[lane] = 1.0;
        }
        self.parameters[lane] = sample.parameter;
        self.count += 1;
        if self.count == LANES {
            self.flush(output);
        }
    }

    fn flush(&mut self, output: &mut Output<'_>) {
        in_lanes(self);
        // The output second, or one of it would be taken and not written.
        for (&rotation, place) in self.rotations[..self.count].iter().zip(output) {
            *place = rotation;
        }
        self.count = 0;
    }
}
