//! Smooth curves straight from keys, in f32: small angles by a series, longer curves by a Hermite
//! fit of the whole or of its halves. Intervals that f32 cannot prepare wait for a block of their
//! own, in f64.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::curve::options::Ends;
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::single::fit_range::{FEW_POWERS, LONGEST_OF_FEW, LONGEST_WHOLE, WHOLE};
use crate::fit::single::handles::{FindCurves, FindHandles, HandlesF32, LONGEST_DIRECT};
use crate::fit::single::hermite_fit::Halves;
use crate::fit::single::key_steps::{FindSteps, KeySteps};
use crate::fit::single::key_weights::KeyWeights;
use crate::fit::single::long_tangents::LongTangents;
use crate::fit::single::small_angle::SmallAngleLanes;
use crate::method::{FromKeys, Smooth};
use crate::prepare::fitting::Fitting;
use crate::prepare::lane_lists::{List, fit};
use crate::prepare::prepared::Prepared;
use crate::prepare::smooth::CONTEXT;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::in_lanes;
use crate::time::spans::NONE;

/// Prepares the curves of a block straight from keys.
pub(crate) struct Direct {
    steps: KeySteps,
    weights: KeyWeights,
    small_angle: SmallAngleLanes,
    whole: HandlesF32,
    /// The span and the segment that each lane becomes; the first of the two if it is cut.
    spans: [usize; ROOM],
    places: [usize; ROOM],
    /// Lanes that are fitted whole by degree 10.
    usual: List,
    /// Lanes that are fitted with degree 8, and lanes whose curve is split at its middle.
    few_powers: List,
    halves: List,
    /// Lanes that f32 cannot prepare.
    left_over: List,
    /// Intervals that f32 cannot prepare wait here; made for the first one.
    rest: Option<Box<Rest>>,
    /// See [`FromKeys`].
    find_long: fn(&mut LongTangents),
    smooth: Smooth,
    ends: Ends,
}

impl Direct {
    pub(crate) fn new(how: FromKeys, smooth: Smooth, ends: Ends) -> Self {
        Self {
            steps: KeySteps::new(),
            weights: KeyWeights::new(how.weights, ends),
            small_angle: SmallAngleLanes::new(),
            whole: HandlesF32::new(),
            spans: [0; ROOM],
            places: [0; ROOM],
            usual: List::new(),
            few_powers: List::new(),
            halves: List::new(),
            left_over: List::new(),
            rest: None,
            find_long: how.find_long,
            smooth,
            ends,
        }
    }

    /// Finds the steps, handles and curves of a block's intervals, and the small-angle cubics.
    pub(crate) fn find_curves(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        in_lanes(&mut FindSteps {
            steps: &mut self.steps,
            intervals,
        });
        self.weights.bring(intervals, stretches);
        self.small_angle.look(&self.steps, stretches);
        (self.small_angle).prepare(intervals, &self.weights, stretches);
        self.whole.wanted = self.small_angle.holds.map(|is_small_angle| !is_small_angle);
        in_lanes(&mut FindHandles {
            lanes: &mut self.whole,
            steps: &self.steps,
            weights: &self.weights,
            intervals,
            find_long: self.find_long,
        });
        in_lanes(&mut FindCurves {
            lanes: &mut self.whole,
            steps: &self.steps,
            weights: &self.weights,
            intervals,
        });
    }

    /// Takes the curve in a lane: it becomes the next span, with the constant `key` at its start,
    /// or the next two if it is split at its middle.
    #[inline]
    pub(crate) fn take(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lane: usize,
        key: u32,
    ) {
        let start = intervals.starts[lane];
        let (span, place) = prepared.push_segment(start, PolynomialSegment::zeroed(), key);
        (self.spans[lane], self.places[lane]) = (span, place);
        if self.small_angle.holds[lane] {
            let segment = &mut prepared.segments.polynomials[place];
            self.small_angle.write(lane, segment);
            return;
        }
        let squared_extent = self.whole.energies[lane];
        let list = if squared_extent <= LONGEST_OF_FEW as f32 {
            &mut self.few_powers
        } else if squared_extent <= LONGEST_WHOLE as f32 {
            &mut self.usual
        } else if squared_extent <= LONGEST_DIRECT as f32 {
            let middle = start + (intervals.ends[lane] - start) * 0.5;
            prepared.push_segment(middle, PolynomialSegment::zeroed(), NONE);
            &mut self.halves
        } else {
            // NaN comes here too.
            &mut self.left_over
        };
        list.push(lane);
    }

    /// Fits the curves that were taken. Those left over wait, here or in `fitting`. `is_exact` says
    /// that the f64 numbers of the intervals are computed already.
    pub(crate) fn fit(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        stretches: &[Stretch],
        is_exact: bool,
        fitting: &mut Fitting,
    ) {
        let (numbers, places) = (&self.whole.numbers, &self.places);
        fit(&WHOLE, &mut self.usual, numbers, places, prepared);
        fit(&FEW_POWERS, &mut self.few_powers, numbers, places, prepared);
        fit(&Halves, &mut self.halves, numbers, places, prepared);
        if is_exact {
            for &lane in self.left_over.lanes() {
                let lane = lane as usize;
                fitting.take(prepared, intervals, lane, self.spans[lane]);
            }
        } else {
            self.leave(prepared, intervals, stretches, fitting);
        }
        self.left_over.clear();
    }

    /// Moves intervals that are left over to `rest`, each run of them between its neighbours as
    /// context.
    fn leave(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        stretches: &[Stretch],
        fitting: &mut Fitting,
    ) {
        let mut left_over = self.left_over.lanes();
        for stretch in stretches {
            let end = stretch.lanes().end;
            let own = left_over.partition_point(|&lane| (lane as usize) < end);
            let (own, others) = left_over.split_at(own);
            for run in own.chunk_by(|&lane, &next| lane + 1 == next) {
                let lanes = run[0] as usize..run[0] as usize + run.len();
                let new = || Box::new(Rest::new(self.smooth, self.ends));
                let rest = self.rest.get_or_insert_with(new);
                if rest.intervals.count + lanes.len() + CONTEXT > LANES {
                    rest.flush(prepared, fitting);
                }
                rest.push(intervals, stretch, lanes.clone(), &self.spans[lanes]);
            }
            left_over = others;
        }
    }

    /// Fits the curves that still wait, and hands those left over to `fitting`.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        if let Some(rest) = &mut self.rest {
            rest.flush(prepared, fitting);
        }
    }
}

/// Intervals that are left over, each run of them between its neighbours as context.
struct Rest {
    intervals: Intervals,
    stretches: Vec<Stretch>,
    spans: Vec<usize>,
    smooth: Smooth,
    ends: Ends,
}

impl Rest {
    fn new(smooth: Smooth, ends: Ends) -> Self {
        Self {
            intervals: Intervals::new(smooth.shape.own),
            stretches: Vec::new(),
            spans: Vec::new(),
            smooth,
            ends,
        }
    }

    /// Takes some intervals of a stretch, which become these spans; there must be room for them.
    fn push(
        &mut self,
        intervals: &Intervals,
        stretch: &Stretch,
        lanes: Range<usize>,
        spans: &[usize],
    ) {
        let first = stretch.intervals.start + (lanes.start - stretch.lane);
        self.stretches.push(Stretch {
            lane: self.intervals.count + 1,
            intervals: first..first + lanes.len(),
            ..stretch.clone()
        });
        if stretch.all == 1 {
            self.intervals.push_nothing();
            self.intervals.push_from(intervals, lanes);
            self.intervals.push_nothing();
        } else {
            let context = lanes.start - 1..lanes.end + 1;
            self.intervals.push_from(intervals, context);
        }
        self.spans.extend(spans);
    }

    /// Computes the curves of all intervals in f64, and queues them to be fitted.
    fn flush(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        let (intervals, stretches) = (&mut self.intervals, &mut self.stretches);
        self.smooth.find_curves(intervals, stretches, self.ends);
        let lanes = stretches.iter().flat_map(Stretch::lanes);
        for (lane, &span) in lanes.zip(&self.spans) {
            fitting.take(prepared, intervals, lane, span);
        }
        fitting.bring(prepared, intervals);
        intervals.clear();
        stretches.clear();
        self.spans.clear();
    }
}
