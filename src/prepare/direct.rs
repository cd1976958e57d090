//! Smooth curves straight from keys, in f32: small angles by a series, longer curves by a Hermite
//! fit of the whole or of its halves. Intervals that f32 cannot prepare wait for a block of their
//! own, in f64.

use std::ops::Range;

use crate::curve::options::Ends;
use crate::fit::double::handles::Steps;
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::single::fit_range::{FEW_POWERS, LONGEST_OF_FEW, LONGEST_WHOLE, WHOLE};
use crate::fit::single::handles::{FindCurves, FindSteps, HandlesF32, LONGEST_DIRECT};
use crate::fit::single::hermite_fit::Halves;
use crate::fit::single::key_weights::KeyWeights;
use crate::fit::single::small_angle::SmallAngleLanes;
use crate::method::{FromKeys, Smooth};
use crate::prepare::fitting::Fitting;
use crate::prepare::lane_lists::{List, fit};
use crate::prepare::prepared::Prepared;
use crate::simd::dispatch::in_lanes;
use crate::time::spans::NONE;

/// If more than one in this many intervals of a block is left over, the whole block is computed in
/// f64: in a block of its own each would bring two neighbours as context.
const MOST_ALONE: usize = 3;

/// The most spans that the lanes of a block become. A power of two, for a cheap modulo.
const SPANS: usize = 2 * LANES;

/// Prepares the curves of a block straight from keys.
pub(crate) struct Direct {
    weights: KeyWeights,
    small_angle: SmallAngleLanes,
    whole: HandlesF32,
    /// The span and the segment that each lane becomes; the first of the two if it is cut.
    spans: [u32; ROOM],
    places: [u32; ROOM],
    /// Lanes that are fitted whole by degree 10.
    usual: List,
    /// Lanes that are fitted with degree 8, and lanes whose curve is split at its middle.
    few_powers: List,
    halves: List,
    /// 1 if a lane becomes two spans, else 0.
    cut: [u32; ROOM],
    /// The start times of new spans, in seconds, and the constants there.
    starts: [f64; SPANS],
    keys: [u32; SPANS],
    /// Lanes that f32 cannot prepare.
    left_over: List,
    /// Intervals that f32 cannot prepare wait here; made for the first one.
    rest: Option<Box<Rest>>,
    /// See [`FromKeys`].
    set_long: fn(&mut HandlesF32, &[usize], &Intervals),
    smooth: Smooth,
    ends: Ends,
}

impl Direct {
    pub(crate) fn new(how: FromKeys, smooth: Smooth, ends: Ends) -> Self {
        Self {
            weights: KeyWeights::new(how.weights, ends),
            small_angle: SmallAngleLanes::new(),
            whole: HandlesF32::new(),
            spans: [0; ROOM],
            places: [0; ROOM],
            usual: List::new(),
            few_powers: List::new(),
            halves: List::new(),
            cut: [0; ROOM],
            starts: [0.0; SPANS],
            keys: [NONE; SPANS],
            left_over: List::new(),
            rest: None,
            set_long: how.set_long,
            smooth,
            ends,
        }
    }

    /// Finds the steps, handles and curves of a block's intervals, and the small-angle cubics.
    pub(crate) fn find_curves(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        in_lanes(&mut FindSteps {
            lanes: &mut self.whole,
            intervals,
        });
        self.weights.bring(intervals, stretches);
        let chords = &self.whole.chords;
        (self.small_angle).find(chords, intervals, &self.weights, stretches);
        in_lanes(&mut FindCurves {
            lanes: &mut self.whole,
            weights: &self.weights,
            intervals,
            known: &self.small_angle.holds,
            set_long: self.set_long,
        });
    }

    /// Takes the curves in some lanes: they become the next spans, the first with the constant
    /// `key` at its start.
    pub(crate) fn take(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        for lane in lanes.clone().filter(|&lane| self.small_angle.holds[lane]) {
            // A negative squared extent puts the lane on no list.
            self.whole.energies[lane] = -1.0;
        }
        self.list(lanes.clone());
        self.begin(prepared, intervals, lanes.clone(), key);
        for lane in lanes.filter(|&lane| self.small_angle.holds[lane]) {
            let place = self.places[lane] as usize;
            self.small_angle
                .write(lane, &mut prepared.segments.polynomials[place]);
        }
    }

    /// Puts lanes on the list of the fit for their squared extent.
    fn list(&mut self, lanes: Range<usize>) {
        let energies = &self.whole.energies[lanes.clone()];
        let [few, whole, direct] =
            [LONGEST_OF_FEW, LONGEST_WHOLE, LONGEST_DIRECT].map(|most| most as f32);
        let is_usual = |squared_extent: f32| squared_extent > few && squared_extent <= whole;
        (self.usual).push_where(lanes.clone(), energies, is_usual);
        let takes_few = |squared_extent: f32| squared_extent >= 0.0 && squared_extent <= few;
        (self.few_powers).push_where(lanes.clone(), energies, takes_few);
        let is_cut = |squared_extent: f32| squared_extent > whole && squared_extent <= direct;
        for (cut, &squared_extent) in self.cut[lanes.clone()].iter_mut().zip(energies) {
            *cut = u32::from(is_cut(squared_extent));
        }
        (self.halves).push_where(lanes.clone(), energies, is_cut);
        let is_left = |squared_extent: f32| squared_extent > direct || squared_extent.is_nan();
        (self.left_over).push_where(lanes, energies, is_left);
    }

    /// Adds the spans and the segments that lanes become.
    fn begin(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        let first_place = prepared.segments.polynomials.len() as u32;
        let first_span = prepared.spans.sources.len() as u32;
        let mut next = 0;
        for (i, lane) in lanes.clone().enumerate() {
            self.spans[lane] = first_span + next as u32;
            self.places[lane] = first_place + next as u32;
            let (start, end) = (intervals.starts[lane], intervals.ends[lane]);
            let own = if key == NONE { NONE } else { key + i as u32 };
            // Both halves are always written; the next lane overwrites the second if it is not cut.
            let second = (next + 1) % SPANS;
            (self.starts[next % SPANS], self.keys[next % SPANS]) = (start, own);
            (self.starts[second], self.keys[second]) = (start + (end - start) * 0.5, NONE);
            next += 1 + self.cut[lane] as usize;
        }
        let spans = &mut prepared.spans;
        spans.starts.extend_from_slice(&self.starts[..next]);
        spans.keys.extend_from_slice(&self.keys[..next]);
        prepared.new_segments(next);
    }

    /// Fits the curves that were taken. Those left over wait, here or in `fitting`. `is_exact` says
    /// that the f64 numbers of the intervals are computed already.
    pub(crate) fn fit(
        &mut self,
        prepared: &mut Prepared,
        intervals: &mut Intervals,
        stretches: &[Stretch],
        is_exact: bool,
        fitting: &mut Fitting,
    ) {
        let (numbers, places) = (&self.whole.numbers, &self.places);
        fit(&WHOLE, &mut self.usual, numbers, places, prepared);
        fit(&FEW_POWERS, &mut self.few_powers, numbers, places, prepared);
        fit(&Halves, &mut self.halves, numbers, places, prepared);
        let are_many = MOST_ALONE * self.left_over.count > intervals.count;
        if are_many && !is_exact {
            in_lanes(&mut Steps(intervals));
            (self.smooth.curves)(intervals, stretches, self.ends);
        }
        if are_many || is_exact {
            for lane in self.left_over.iter() {
                fitting.queue(prepared, intervals, lane, self.spans[lane] as usize);
            }
        } else {
            self.leave(prepared, intervals, stretches, fitting);
        }
        self.left_over.clear();
    }

    /// Moves intervals that are left over to `rest`, with their neighbours as context.
    fn leave(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        stretches: &[Stretch],
        fitting: &mut Fitting,
    ) {
        let mut left_over = self.left_over.iter().peekable();
        for stretch in stretches {
            let end = stretch.lanes().end;
            while let Some(first) = left_over.next_if(|&lane| lane < end) {
                let mut lanes = first..first + 1;
                while lanes.end < end && left_over.next_if_eq(&lanes.end).is_some() {
                    lanes.end += 1;
                }
                let new = || Box::new(Rest::new(self.smooth, self.ends));
                let rest = self.rest.get_or_insert_with(new);
                if !rest.has_room(lanes.len()) {
                    rest.flush(prepared, fitting);
                }
                rest.push(intervals, stretch, lanes.clone(), &self.spans[lanes]);
            }
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
    spans: Vec<u32>,
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

    /// Whether there is room for `count` consecutive intervals and their context.
    fn has_room(&self, count: usize) -> bool {
        self.intervals.count + count + 2 <= LANES
    }

    /// Takes some intervals of a stretch, which become these spans; there must be room for them.
    fn push(
        &mut self,
        intervals: &Intervals,
        stretch: &Stretch,
        lanes: Range<usize>,
        spans: &[u32],
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
        if self.spans.is_empty() {
            return;
        }
        in_lanes(&mut Steps(&mut self.intervals));
        (self.smooth.curves)(&mut self.intervals, &self.stretches, self.ends);
        let lanes = self.stretches.iter().flat_map(Stretch::lanes);
        for (lane, &span) in lanes.zip(&self.spans) {
            fitting.queue(prepared, &self.intervals, lane, span as usize);
        }
        fitting.bring(prepared, &self.intervals);
        self.intervals.clear();
        self.stretches.clear();
        self.spans.clear();
    }
}
