//! Evaluates samples straight from keys, one in each lane, by the operations that preparing and
//! evaluating segments would do, so with the same bits.
//! Twin: `shaders/from_keys.wgsl`.

use std::ops::Range;

use crate::fit::tangent_weights::TrackWeights;
use crate::from_keys::KeyCurve;
use crate::from_keys::arcs::{ArcRun, LANES, TwoKeyBlock};
use crate::from_keys::cubics::CubicBlock;
use crate::method::interpolation::Interpolation;
use crate::prepare::batch::Batch;
use crate::prepare::error::SetError;
use crate::shader::{Form, IS_KEY, KEY_INNER, KeySample, TangentWeights};
use crate::simd::dispatch::in_lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::key_samples::FramePlan;
use crate::time::times::key_sample;
use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;
use crate::tracks::track_keys::TrackKeys;

/// Evaluates tracks from their keys, and keeps its scratch from one to the next.
pub(crate) struct KeyEvaluator<'a> {
    interpolation: &'a Interpolation,
    curve: KeyCurve,
    block: Block<'a>,
    plan: FramePlan<'a>,
}

enum Block<'a> {
    TwoKeys(Box<TwoKeyBlock>),
    Cubics(Box<CubicBlock>, TrackWeights<'a>),
}

impl<'a> KeyEvaluator<'a> {
    pub(crate) fn new(interpolation: &'a Interpolation, curve: KeyCurve) -> Self {
        let block = match curve {
            KeyCurve::Arcs => Block::TwoKeys(Box::new(TwoKeyBlock::new(Form::Arc))),
            KeyCurve::TwoKeys => Block::TwoKeys(Box::new(TwoKeyBlock::new(Form::Polynomial))),
            KeyCurve::Cubics(weights) => {
                let weights = TrackWeights::new(weights, interpolation.ends);
                Block::Cubics(bytemuck::zeroed_box(), weights)
            }
        };
        Self {
            interpolation,
            curve,
            block,
            plan: FramePlan::new(),
        }
    }

    /// Evaluates the samples of a batch that lie in `window`, `[track][sample]`; returns whether
    /// all of them are resolved.
    pub(crate) fn evaluate(
        &mut self,
        set: &'a TrackSet,
        batch: &Batch,
        timeline: &Timeline,
        window: &Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<bool, SetError> {
        let mut output = output.iter_mut();
        for (index, own) in batch.intervals(set) {
            let whole = TrackKeys::whole(set, index);
            self.interpolation.check_track(whole.keys, index)?;
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let clock = FrameClock::new(*rate, *start, false);
                    let keys = whole.around(&own, self.curve.beside());
                    let samples = self.plan.samples(keys, clock, window)?;
                    let left = self.block.whole_vectors(keys, samples, &mut output);
                    self.block.push(keys, left.iter().copied(), &mut output);
                }
                Ticks::Times { times, stride } => {
                    let own = &times[index * stride..][..timeline.len()];
                    let mut near = 0;
                    let samples = own.iter().map(|&time| {
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

impl<'a> Block<'a> {
    /// Evaluates whole vectors of samples between keys of one sign straight into the output, if they
    /// lie on arcs. Returns the samples that are left.
    fn whole_vectors<'s>(
        &mut self,
        keys: TrackKeys<'_>,
        samples: &'s [KeySample],
        output: &mut Output<'_>,
    ) -> &'s [KeySample] {
        let Block::TwoKeys(block) = self else {
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
        output: &mut Output<'_>,
    ) {
        let signed = SignedKeys::new(keys);
        match self {
            Block::TwoKeys(block) => {
                for sample in samples {
                    block.push(signed, sample, output);
                }
            }
            Block::Cubics(block, weights) => {
                let weights = weights.of(keys.times, keys.first_key, keys.all);
                for sample in samples {
                    block.push(signed, weights, sample, output);
                }
            }
        }
    }

    /// Evaluates the samples that wait; returns whether all since the last call are resolved.
    fn flush(&mut self, output: &mut Output<'_>) -> bool {
        match self {
            Block::TwoKeys(block) => {
                block.flush(output);
                true
            }
            Block::Cubics(block, _) => {
                block.flush(output);
                std::mem::take(&mut block.unresolved) == 0
            }
        }
    }
}

/// Keys of a track with their continued signs; `signs` is `None` where no key is turned.
#[derive(Clone, Copy)]
struct SignedKeys<'a> {
    as_given: &'a [[f32; 4]],
    signs: Option<Signs<'a>>,
}

impl<'a> SignedKeys<'a> {
    fn new(keys: TrackKeys<'a>) -> Self {
        Self {
            as_given: bytemuck::cast_slice(keys.keys),
            signs: Some(keys.signs).filter(|signs| signs.any()),
        }
    }

    #[inline(always)]
    fn get(self, key: usize) -> [f32; 4] {
        let as_given = self.as_given[key];
        match self.signs {
            None => as_given,
            Some(signs) => {
                let sign = signs.sign(key);
                as_given.map(|component| component * sign)
            }
        }
    }
}

/// The rotations that are still to be written.
type Output<'a> = std::slice::IterMut<'a, [f32; 4]>;

impl TwoKeyBlock {
    /// Adds a sample, and evaluates the block when it is full.
    #[inline(always)]
    fn push(&mut self, keys: SignedKeys<'_>, sample: KeySample, output: &mut Output<'_>) {
        let lane = self.count;
        let key = (sample.key & !IS_KEY) as usize;
        if sample.key & IS_KEY == 0 {
            self.from[lane] = keys.get(key);
            self.to[lane] = keys.get(key + 1);
        } else {
            // The arc from a key to itself is that key.
            self.from[lane] = keys.as_given[key];
            self.to[lane] = self.from[lane];
        }
        self.parameters[lane] = sample.parameter;
        self.count += 1;
        if self.count == LANES {
            self.flush(output);
        }
    }

    fn flush(&mut self, output: &mut Output<'_>) {
        in_lanes(self);
        // `zip` takes from the output second: first, it would lose a place when rotations end.
        for (&rotation, place) in self.rotations[..self.count].iter().zip(output) {
            *place = rotation;
        }
        self.count = 0;
    }
}

impl CubicBlock {
    /// As [`TwoKeyBlock::push`], with the tangent weights of the keys.
    #[inline(always)]
    fn push(
        &mut self,
        keys: SignedKeys<'_>,
        weights: &[TangentWeights],
        sample: KeySample,
        output: &mut Output<'_>,
    ) {
        let lane = self.count;
        let key = (sample.key & !IS_KEY) as usize;
        if sample.key & IS_KEY == 0 {
            let (first, last) = (weights[key], weights[key + 1]);
            let before = key - usize::from(first.kind == KEY_INNER);
            let after = key + 1 + usize::from(last.kind == KEY_INNER);
            self.weights[0][lane] = first;
            self.weights[1][lane] = last;
            for (place, key) in [before, key, key + 1, after].into_iter().enumerate() {
                self.keys[place][lane] = keys.get(key);
            }
            self.held[lane] = 0.0;
        } else {
            self.keys[1][lane] = keys.as_given[key];
            self.held[lane] = 1.0;
        }
        self.parameters[lane] = sample.parameter;
        self.count += 1;
        if self.count == LANES {
            self.flush(output);
        }
    }

    fn flush(&mut self, output: &mut Output<'_>) {
        // Unused lanes are evaluated too; marked as held, they do not count as unresolved.
        self.held[self.count..].fill(1.0);
        in_lanes(self);
        for (&rotation, place) in self.rotations[..self.count].iter().zip(output) {
            *place = rotation;
        }
        self.count = 0;
    }
}
