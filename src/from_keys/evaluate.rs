//! Twin of `shaders/sampled.wgsl`. Fewer samples than keys: a sample to a lane, straight
//! from the keys beside it. No segment is kept, and none is made where no sample falls. The
//! same operations as by way of segments, and so the same bits. Cubics that turn too much
//! for it stay 0.

use std::ops::Range;

use crate::engine::Error;
use crate::from_keys::arcs::{ArcRun, LANES, SampleBlock};
use crate::from_keys::cubics::CubicBlock;
use crate::method::interpolation::{Interpolation, Path};
use crate::prepare::tangent_weights::{TrackWeights, WeightRule};
use crate::shader::Form;
use crate::shader::{IS_KEY, KEY_INNER, LONGEST_STEP};
use crate::shader::{KeySample, TangentWeights};
use crate::simd::dispatch::in_lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::key_samples::{FramePlan, Stretch, TimePlan};
use crate::time::wrap::Sides;
use crate::tracks::set::TrackSet;
use crate::tracks::signs::Signs;

/// What samples are made of, straight from keys.
#[derive(Clone, Copy)]
pub(crate) enum Straight {
    /// Arcs between two keys.
    Arcs,
    /// Two keys alone by a smooth method.
    Pairs,
    /// Cubics by four keys.
    Cubics(WeightRule),
}

/// What every sample is made of where it is worked out straight from its keys: where there
/// are fewer samples than keys, and nothing but arcs between these, or cubics most of which
/// turn little.
pub(crate) fn straight(
    set: &TrackSet,
    interpolation: &Interpolation,
    timeline: &Timeline,
) -> Option<Straight> {
    let few = timeline.len() * set.track_count() < set.key_count();
    // As authored an arc may be of more than half a turn, and is then two segments.
    let arcs_are_short = interpolation.path == Path::Shortest || set.arcs_are_short();
    if !few || !arcs_are_short || interpolation.sides() != Sides::default() {
        return None;
    }
    match interpolation.form() {
        Form::Arc => Some(Straight::Arcs),
        Form::Polynomial if set.longest() <= 2 => {
            interpolation.is_steady_alone().then_some(Straight::Pairs)
        }
        Form::Polynomial => {
            let weights = interpolation.small_angle_weights()?;
            turns_little(set).then_some(Straight::Cubics(weights))
        }
    }
}

/// Whether two thirds of some keys looked at are near those before them: with fewer, to
/// prepare all of them takes no longer. Nothing but time depends on it.
fn turns_little(set: &TrackSet) -> bool {
    const LOOKS: usize = 64;
    let (mut near, mut looks) = (0, 0);
    for look in 0..LOOKS {
        let (_, keys) = set.times_and_keys(look * set.track_count() / LOOKS);
        let place = keys.len() * look / LOOKS;
        if let [from, to, ..] = keys[place..] {
            looks += 1;
            near += usize::from(1.0 - from.dot(to).abs() <= 0.5 * LONGEST_STEP);
        }
    }
    3 * near > 2 * looks
}

/// Evaluates tracks; what it needs for that is kept.
pub(crate) struct Sampled<'a> {
    interpolation: &'a Interpolation,
    block: Block<'a>,
    plan: FramePlan<'a>,
    time_plan: TimePlan,
}

enum Block<'a> {
    ByTwo(Box<SampleBlock>),
    ByFour(Box<CubicBlock>, TrackWeights<'a>),
}

impl<'a> Sampled<'a> {
    pub(crate) fn new(interpolation: &'a Interpolation, straight: Straight) -> Self {
        let block = match straight {
            Straight::Arcs => Block::ByTwo(Box::new(SampleBlock::new(Form::Arc))),
            Straight::Pairs => Block::ByTwo(Box::new(SampleBlock::new(Form::Polynomial))),
            Straight::Cubics(weights) => {
                let weights = TrackWeights::new(weights, interpolation.ends);
                Block::ByFour(Box::new(CubicBlock::new()), weights)
            }
        };
        Self {
            interpolation,
            block,
            plan: FramePlan::new(),
            time_plan: TimePlan::new(),
        }
    }

    /// Every sample of some tracks, `[track][sample]`; whether any was left out.
    pub(crate) fn tracks(
        &mut self,
        set: &'a TrackSet,
        tracks: Range<usize>,
        timeline: &Timeline,
        output: &mut [[f32; 4]],
    ) -> Result<bool, Error> {
        let samples = timeline.len();
        let mut output = output.iter_mut();
        for index in tracks {
            let stretch = Stretch::whole(set, index);
            self.interpolation.ends.check(stretch.keys, index)?;
            match &timeline.ticks {
                Ticks::Frames { rate, start } => {
                    let latest = stretch.times[stretch.times.len() - 1];
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
        Ok(self.block.flush(&mut output))
    }

    /// The samples of some intervals of a track, `window`; whether any was left out.
    pub(crate) fn stretch(
        &mut self,
        stretch: Stretch<'a>,
        clock: FrameClock,
        window: &Range<usize>,
        output: &mut [[f32; 4]],
    ) -> Result<bool, Error> {
        let mut output = output.iter_mut();
        self.frames(stretch, clock, window, &mut output)?;
        Ok(self.block.flush(&mut output))
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
        match &mut self.block {
            Block::ByTwo(block) => {
                let mut samples = samples;
                if block.form == Form::Arc
                    && let Some(sign) = stretch.signs.shared()
                {
                    block.flush(output);
                    let left = std::mem::take(output).into_slice();
                    let mut run = ArcRun {
                        samples,
                        keys: bytemuck::cast_slice(stretch.keys),
                        sign,
                        output: &mut *left,
                        done: 0,
                    };
                    in_lanes(&mut run);
                    let done = run.done;
                    samples = &samples[done..];
                    *output = left[done..].iter_mut();
                }
                let keys = SignedKeys::new(stretch);
                for &sample in samples {
                    block.push(keys, sample, output);
                }
            }
            Block::ByFour(block, weights) => {
                let keys = CubicKeys::new(stretch, weights);
                for &sample in samples {
                    block.push(keys, sample, output);
                }
            }
        }
        Ok(())
    }

    fn times(&mut self, stretch: Stretch<'a>, times: &[f64], output: &mut Output<'_>) {
        let (mut near, plan) = (0, &mut self.time_plan);
        let mut next = |time: f64| {
            let sample = plan.sample(stretch.times, time, near);
            near = (sample.key & !IS_KEY) as usize;
            sample
        };
        match &mut self.block {
            Block::ByTwo(block) => {
                let keys = SignedKeys::new(stretch);
                for &time in times {
                    block.push(keys, next(time), output);
                }
            }
            Block::ByFour(block, weights) => {
                let keys = CubicKeys::new(stretch, weights);
                for &time in times {
                    block.push(keys, next(time), output);
                }
            }
        }
    }
}

impl Block<'_> {
    /// Works out what waits; whether anything was left out since the last time.
    fn flush(&mut self, output: &mut Output<'_>) -> bool {
        match self {
            Block::ByTwo(block) => {
                block.flush(output);
                false
            }
            Block::ByFour(block, _) => {
                block.flush(output);
                std::mem::take(&mut block.wild) > 0
            }
        }
    }
}

/// Keys of a track with the signs that they count with, where any is turned.
#[derive(Clone, Copy)]
struct SignedKeys<'a> {
    as_given: &'a [[f32; 4]],
    signs: Option<Signs<'a>>,
}

impl<'a> SignedKeys<'a> {
    fn new(stretch: Stretch<'a>) -> Self {
        Self {
            as_given: bytemuck::cast_slice(stretch.keys),
            signs: Some(stretch.signs).filter(|signs| signs.any()),
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

/// The keys of a track, and their weights.
#[derive(Clone, Copy)]
struct CubicKeys<'a> {
    keys: SignedKeys<'a>,
    weights: &'a [TangentWeights],
}

impl<'a> CubicKeys<'a> {
    fn new<'t: 'a>(stretch: Stretch<'t>, weights: &'a mut TrackWeights<'t>) -> Self {
        Self {
            keys: SignedKeys::new(stretch),
            weights: weights.of(stretch.times, stretch.first_key, stretch.all),
        }
    }
}

/// What is still to be written.
type Output<'a> = std::slice::IterMut<'a, [f32; 4]>;

impl SampleBlock {
    /// Adds a sample, and works the block out when it is full.
    #[inline(always)]
    fn push(&mut self, keys: SignedKeys<'_>, sample: KeySample, output: &mut Output<'_>) {
        let lane = self.count;
        let key = (sample.key & !IS_KEY) as usize;
        if sample.key & IS_KEY == 0 {
            self.from[lane] = keys.get(key);
            self.to[lane] = keys.get(key + 1);
        } else {
            // Between a key and itself lies that key.
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
        // The output second, or one of it would be taken and not written.
        for (&rotation, place) in self.rotations[..self.count].iter().zip(output) {
            *place = rotation;
        }
        self.count = 0;
    }
}

impl CubicBlock {
    /// As [`SampleBlock::push`].
    #[inline(always)]
    fn push(&mut self, from: CubicKeys<'_>, sample: KeySample, output: &mut Output<'_>) {
        let lane = self.count;
        let CubicKeys { keys, weights } = from;
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
        // Lanes behind the last are worked out too.
        self.held[self.count..].fill(1.0);
        in_lanes(self);
        for (&rotation, place) in self.rotations[..self.count].iter().zip(output) {
            *place = rotation;
        }
        self.count = 0;
    }
}
