//! Evaluation of samples directly from keys, with the operations of preparing and evaluating segments, and therefore
//! with the same bits. Frames of tracks with many keys have a lane for each interval between two keys
//! ([`intervals`](crate::from_keys::intervals)); others a lane for each sample. Twin: `shaders/from_keys.wgsl`.

use std::ops::Range;

use crate::fit::tangent_weights::TrackWeights;
use crate::from_keys::KeyCurve;
use crate::from_keys::arcs::{OutputIter, TwoKeyBlock};
use crate::from_keys::cubics::CubicBlock;
use crate::from_keys::intervals::{IntervalPlan, evaluate_intervals};
use crate::method::interpolation::Interpolation;
use crate::prepare::error::SetError;
use crate::prepare::preparation::Batch;
use crate::shader::{Form, IS_KEY, KeySample, TangentWeights};
use crate::simd::dispatch::VectorWidth;
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
    intervals: IntervalPlan,
    /// A track's keys with their signs for the shortest path, if any sign is changed.
    signed: Vec<[f32; 4]>,
    /// The rows of the batch whose samples are in blocks, and those with samples that are not resolved.
    in_blocks: Vec<usize>,
    unresolved: Vec<usize>,
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
            intervals: IntervalPlan::new(curve),
            signed: Vec::new(),
            in_blocks: Vec::new(),
            unresolved: Vec::new(),
        }
    }

    /// Evaluates the samples of a batch that are in `window`, `[track][sample]`. Returns the tracks that may have
    /// unresolved samples: their indices in the batch, ascending.
    pub(crate) fn evaluate(
        &mut self,
        set: &'a TrackSet,
        batch: &Batch,
        timeline: &Timeline,
        window: &Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<&[usize], SetError> {
        self.in_blocks.clear();
        self.unresolved.clear();
        let mut are_blocks_resolved = true;
        let mut output = output.iter_mut();
        for (row_index, (index, intervals)) in batch.intervals(set).enumerate() {
            let whole = TrackKeys::whole(set, index);
            self.interpolation.check_track(whole.keys, index)?;
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let clock = FrameClock::new(*rate, *start, false);
                    let keys = whole.around(&intervals, self.curve.beside());
                    let (samples, plan) = self.plan.samples(keys, clock, window)?;
                    let weights = self.block.weights(keys);
                    self.intervals.find(plan, samples, weights);
                    if self.intervals.is_short() {
                        self.in_blocks.push(row_index);
                        self.block.push(keys, samples.iter().copied(), &mut output);
                        continue;
                    }
                    are_blocks_resolved &= self.block.flush(&mut output);
                    let left = std::mem::take(&mut output).into_slice();
                    let (row, left) = left.split_at_mut(samples.len());
                    output = left.iter_mut();
                    let width = VectorWidth::widest();
                    let (keys, signed) = (keys.authored(), keys.signed(&mut self.signed));
                    if !evaluate_intervals(width, &self.intervals, keys, signed, row) {
                        self.unresolved.push(row_index);
                    }
                }
                Ticks::Times { times, stride } => {
                    self.in_blocks.push(row_index);
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
        are_blocks_resolved &= self.block.flush(&mut output);
        if !are_blocks_resolved {
            self.unresolved.append(&mut self.in_blocks);
            self.unresolved.sort_unstable();
        }
        Ok(&self.unresolved)
    }
}

impl<'a> SampleBlock<'a> {
    /// The tangent weights of these keys, if there are any.
    fn weights(&mut self, keys: TrackKeys<'a>) -> &[TangentWeights] {
        match self {
            SampleBlock::TwoKeys(_) => &[],
            SampleBlock::Cubics(_, weights) => {
                weights.weights_of(keys.times, keys.first_key, keys.track_key_count)
            }
        }
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
                !std::mem::take(&mut block.has_unresolved)
            }
        }
    }
}
