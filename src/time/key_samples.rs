//! The positions of frames among the keys of a track, for rotations that are computed from keys without segments. The
//! result is kept for the following tracks with the same times.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::shader::{IS_KEY, KeySample};
use crate::time::error::SampleTimesError;
use crate::time::frame_clock::FrameClock;
use crate::time::runs::{IntervalBlock, IntervalBlocks};
use crate::tracks::track_keys::TrackKeys;

/// The key and the parameter of every frame of a window, and the times, clock and window for which they were
/// computed.
pub(crate) struct FramePlan<'a> {
    times: &'a [f64],
    clock: Option<FrameClock>,
    window: Range<usize>,
    samples: Vec<KeySample>,
    /// How often samples were computed.
    number: usize,
    block: IntervalBlock,
}

impl<'a> FramePlan<'a> {
    pub(crate) fn new() -> Self {
        Self {
            times: &[],
            clock: None,
            window: 0..0,
            samples: Vec::new(),
            number: 0,
            block: IntervalBlock::zeroed(),
        }
    }

    /// The samples of a window, and the number of their computation. Samples are computed again, with a new number,
    /// only if times, clock or window differ from those of the last call. Their keys are counted from the first key of
    /// `of`.
    pub(crate) fn samples(
        &mut self,
        of: TrackKeys<'a>,
        clock: FrameClock,
        window: &Range<usize>,
    ) -> Result<(&[KeySample], usize), SampleTimesError> {
        let times = of.times;
        if std::ptr::eq(self.times, times) && self.clock == Some(clock) && self.window == *window {
            return Ok((&self.samples, self.number));
        }
        self.times = &[];
        let last = times.len() - 1;
        let gap_too_long = |(key, frames)| SampleTimesError::GapTooLong {
            track: of.index,
            key: of.first_key + key,
            frames,
        };
        (self.find(&times[..last], times[last], clock, window)).map_err(gap_too_long)?;
        (self.times, self.clock, self.window) = (times, Some(clock), window.clone());
        Ok((&self.samples, self.number))
    }

    /// Finds the samples of a window among intervals with these starts, the last of which ends at `end`. Fails with the
    /// index and the length in frames of an interval with too many frames to count.
    pub(crate) fn find(
        &mut self,
        starts: &[f64],
        end: f64,
        clock: FrameClock,
        window: &Range<usize>,
    ) -> Result<(&[KeySample], usize), (usize, f64)> {
        self.number += 1;
        self.samples.clear();
        self.samples.resize(window.len(), held(0));
        let mut intervals = IntervalBlocks::new(starts, end, clock, window.clone());
        while let Some(filled) = intervals.fill(&mut self.block) {
            let block = &self.block;
            for j in block.occupied {
                let key = filled.start + j;
                if !block.are_near && !block.is_countable(j) {
                    return Err((key, block.frame[j + 1] - block.frame[j]));
                }
                let samples = block.first[j]..block.first[j + 1];
                let (whole, scale, offset) = (block.whole[j], block.scale[j], block.offset[j]);
                let at = |sample: usize| KeySample {
                    key: key as u32,
                    parameter: (sample as f64 - whole) as f32 * scale + offset,
                };
                let range = samples.start - window.start..samples.end - window.start;
                let stored = &mut self.samples[range];
                if let [only] = stored {
                    *only = at(samples.start);
                } else {
                    for (slot, sample) in stored.iter_mut().zip(samples) {
                        *slot = at(sample);
                    }
                }
                if block.is_held[j] == 1 {
                    stored[0] = held(key);
                }
            }
        }
        let end = clock.first_frame(end) as usize;
        if end < window.end {
            self.samples[end.max(window.start) - window.start..].fill(held(starts.len()));
        }
        Ok((&self.samples, self.number))
    }
}

/// A sample at a key.
#[inline(always)]
fn held(key: usize) -> KeySample {
    KeySample {
        key: IS_KEY | key as u32,
        parameter: 0.0,
    }
}
