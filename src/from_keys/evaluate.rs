//! Evaluation of samples directly from keys, one in each lane, with the operations of preparing and evaluating
//! segments, and therefore with the same bits. Twin: `shaders/from_keys.wgsl`.

use std::ops::Range;

use crate::fit::tangent_weights::TrackWeights;
use crate::from_keys::KeyCurve;
use crate::from_keys::arcs::{ArcRun, OutputIter, TwoKeyBlock};
use crate::from_keys::cubics::CubicBlock;
use crate::method::interpolation::Interpolation;
use crate::prepare::error::SetError;
use crate::prepare::preparation::Batch;
use crate::shader::{Form, IS_KEY, KeySample};
use crate::simd::dispatch::in_lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::key_samples::FramePlan;
use crate::time::times::key_sample;
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::{SignedKeys, TrackKeys};

/// Evaluates tracks from their keys, and keeps its scratch from one to the next.
pub(crate) struct KeyEvaluator<'a> {
    interpolation: &'a Interpolation,
    curve: KeyCurve,
    block: SampleBlock<'a>,
    plan: FramePlan<'a>,
}

enum SampleBlock<'a> {
    TwoKeys(Box<TwoKeyBlock>),
    Cubics(Box<CubicBlock>, TrackWeights<'a>),
}

impl<'a> KeyEvaluator<'a> {
    pub(crate) fn new(interpolation: &'a Interpolation, curve: KeyCurve) -> Self {
        let block = match curve {
            KeyCurve::Arcs => SampleBlock::TwoKeys(Box::new(TwoKeyBlock::new(Form::Arc))),
            KeyCurve::TwoKeys => SampleBlock::TwoKeys(Box::new(TwoKeyBlock::new(Form::Polynomial))),
            KeyCurve::Cubics(weights) => {
                let weights = TrackWeights::new(weights, interpolation.ends);
                SampleBlock::Cubics(bytemuck::zeroed_box(), weights)
            }
        };
        Self {
            interpolation,
            curve,
            block,
            plan: FramePlan::new(),
        }
    }

    /// Evaluates the samples of a batch that are in `window`, `[track][sample]`; returns whether all of them are
    /// resolved.
    pub(crate) fn evaluate(
        &mut self,
        set: &'a TrackSet,
        batch: &Batch,
        timeline: &Timeline,
        window: &Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<bool, SetError> {
        let mut output = output.iter_mut();
        for (index, intervals) in batch.intervals(set) {
            let whole = TrackKeys::whole(set, index);
            self.interpolation.check_track(whole.keys, index)?;
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let clock = FrameClock::new(*rate, *start, false);
                    let keys = whole.around(&intervals, self.curve.beside());
                    let samples = self.plan.samples(keys, clock, window)?;
                    let left = self.block.whole_vectors(keys, samples, &mut output);
                    self.block.push(keys, left.iter().copied(), &mut output);
                }
                Ticks::Times { times, stride } => {
                    let track_times = &times[index * stride..][window.clone()];
                    let mut near = 0;
                    let samples = track_times.iter().map(|&time| {
                        let sample = key_sample(whole.times, time, near);
                        near = (sample.key & !IS_KEY) as usize;
                        sample
                    });
                    self.block.push(whole, samples, &mut output);
                }
            }
        }
        Ok(self.block.flush(&mut output))
    }
}

impl<'a> SampleBlock<'a> {
    /// Evaluates whole vectors of samples between keys of one sign directly into the output, if they are on arcs.
    /// Returns the remaining samples.
    fn whole_vectors<'s>(
        &mut self,
        keys: TrackKeys<'_>,
        samples: &'s [KeySample],
        output: &mut OutputIter<'_>,
    ) -> &'s [KeySample] {
        let SampleBlock::TwoKeys(block) = self else {
            return samples;
        };
        let (false, Some(sign)) = (block.are_polynomials, keys.signs.shared()) else {
            return samples;
        };
        block.flush(output);
        let left = std::mem::take(output).into_slice();
        let mut run = ArcRun {
            samples,
            keys: bytemuck::cast_slice(keys.keys),
            sign,
            output: &mut *left,
            done: 0,
        };
        in_lanes(&mut run);
        let done = run.done;
        *output = left[done..].iter_mut();
        &samples[done..]
    }

    /// Adds samples between these keys.
    fn push(
        &mut self,
        keys: TrackKeys<'a>,
        samples: impl Iterator<Item = KeySample>,
        output: &mut OutputIter<'_>,
    ) {
        let signed = SignedKeys::new(keys);
        match self {
            SampleBlock::TwoKeys(block) => {
                for sample in samples {
                    block.push(signed, sample, output);
                }
            }
            SampleBlock::Cubics(block, weights) => {
                let weights = weights.weights_of(keys.times, keys.first_key, keys.track_key_count);
                for sample in samples {
                    block.push(signed, weights, sample, output);
                }
            }
        }
    }

    /// Evaluates the collected samples; returns whether all since the last call are resolved.
    fn flush(&mut self, output: &mut OutputIter<'_>) -> bool {
        match self {
            SampleBlock::TwoKeys(block) => {
                block.flush(output);
                true
            }
            SampleBlock::Cubics(block, _) => {
                block.flush(output);
                std::mem::take(&mut block.unresolved) == 0
            }
        }
    }
}
