//! Rows of kept clips with few samples between keys, for example keys at 30 Hz that are evaluated at 60 frames a
//! second. Finding the interval and the parameter of each sample takes longer than evaluating it. Therefore this is
//! done once for all consecutive tracks with the same key times. Arcs are computed again from their keys, with a lane
//! for each interval, because reading their segments from memory would take longer.

use std::ops::Range;

use crate::cpu::evaluate::SAMPLES_ONE_BY_ONE;
use crate::cpu::segment_list::SegmentList;
use crate::from_keys::KeyCurve;
use crate::from_keys::intervals::{IntervalPlan, MIN_LANES, evaluate_intervals};
use crate::prepare::clip_data::{ClipData, PartRef};
use crate::shader::Form;
use crate::simd::dispatch::{InLanesInto, VectorWidth, in_lanes_into};
use crate::simd::lanes::Lanes;
use crate::time::frame_clock::FrameClock;
use crate::time::frames::{Ticks, Timeline};
use crate::time::key_samples::FramePlan;
use crate::time::runs::NONE;
use crate::time::spans::{SpanSource, StoredSource};

/// The mean number of samples of an arc from which its run is evaluated in vectors of its own.
const SAMPLES_OF_AN_ARC: usize = 8;

/// Evaluates rows of some samples of a clip.
pub(crate) struct ShortRuns<'a> {
    clip: &'a ClipData,
    clock: FrameClock,
    samples: Range<usize>,
    width: VectorWidth,
    /// The number in [`ClipData::time_classes`] of the tracks for which `plan` is: other tracks with the same number
    /// use it, too.
    class: u32,
    frames: FramePlan<'static>,
    plan: IntervalPlan,
}

impl<'a> ShortRuns<'a> {
    /// `None` if a clip's runs are long at this timeline, or its tracks repeat.
    pub(crate) fn new(
        clip: &'a ClipData,
        timeline: &Timeline,
        samples: &Range<usize>,
        width: VectorWidth,
    ) -> Option<Self> {
        if cfg!(smallest) {
            return None;
        }
        let &Ticks::Frames { rate, start } = &timeline.ticks else {
            return None;
        };
        let limit = match clip.interpolation.form() {
            Form::Arc => SAMPLES_OF_AN_ARC,
            // Polynomials are evaluated one sample at a time, as in runs.
            Form::Polynomial => SAMPLES_ONE_BY_ONE,
        };
        let is_short = samples.len() > SAMPLES_ONE_BY_ONE
            && !clip.interpolation.wrap().repeats()
            && clip.samples_of_a_run(timeline) < limit;
        is_short.then(|| Self {
            clip,
            clock: FrameClock::new(rate, start, false),
            samples: samples.clone(),
            width,
            class: NONE,
            frames: FramePlan::new(),
            plan: IntervalPlan::new(KeyCurve::Arcs),
        })
    }

    /// Evaluates the samples of a track; returns false if the track must be evaluated by the general path.
    pub(crate) fn row(&mut self, track: usize, output: &mut [[f32; 4]]) -> bool {
        let class = self.clip.time_classes()[track];
        let Some(PartRef { prepared, part }) = self.clip.only_part(track) else {
            return false;
        };
        let is_short = part.spans.len() < MIN_LANES;
        if cfg!(smallest) || class == NONE || is_short || output.len() != self.samples.len() {
            return false;
        }
        if class != self.class {
            let starts = &prepared.spans.starts[part.spans.clone()];
            let found = (self.frames).find(starts, part.end, self.clock, &self.samples);
            // On an error, the caller evaluates the row by the general path, which reports an interval with too many frames.
            let Ok((samples, number)) = found else {
                return false;
            };
            self.plan.find(number, samples, &[]);
            self.class = class;
        }
        if self.plan.is_short() {
            return false;
        }
        let (segments, keys) = (&prepared.segments, prepared.keys_of(part));
        match segments.form {
            Form::Arc => {
                evaluate_intervals(self.width, &self.plan, keys, keys, output);
            }
            Form::Polynomial => {
                self.plan.store_keys(keys, output);
                let work = Polynomials {
                    plan: &self.plan,
                    sources: &prepared.spans.sources[part.spans.clone()],
                };
                match segments.packed() {
                    Some(packed) => in_lanes_into(self.width, &work, packed, output),
                    None => in_lanes_into(self.width, &work, &segments.polynomials[..], output),
                }
            }
        }
        true
    }
}

/// Evaluates samples of polynomials one by one, all of a segment in succession.
struct Polynomials<'a> {
    plan: &'a IntervalPlan,
    /// The source of each interval.
    sources: &'a [StoredSource],
}

impl<I: SegmentList + ?Sized> InLanesInto<I, [[f32; 4]]> for Polynomials<'_> {
    type Outcome = ();

    #[inline(always)]
    fn run<L: Lanes>(&self, segments: &I, output: &mut [[f32; 4]]) {
        for lanes in self.plan.vectors() {
            for (lane, (interval, samples)) in lanes.intervals().enumerate() {
                let SpanSource::Segment(index) = self.sources[interval].source() else {
                    continue; // regular parts have segments alone
                };
                let parameters = self.plan.parameters_of(lanes, lane);
                segments.values_at(index, parameters, &mut output[samples]);
            }
        }
    }
}
