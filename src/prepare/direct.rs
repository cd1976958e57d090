//! Smooth curves straight from keys, in f32: those that turn little as a series, others by
//! a fit of the whole or of its halves. What is left over waits for a block of its own, in f64.

use std::ops::Range;

use crate::curve::options::Ends;
use crate::fit::double::handles::Steps;
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::single::fit_part::{FEW_POWERS, LONGEST_OF_FEW, LONGEST_WHOLE, Part, WHOLE};
use crate::fit::single::handles::{FindCurves, FindHandles, LONGEST_DIRECT, WholeLanes};
use crate::fit::single::hermite_fit::Halves;
use crate::fit::single::key_steps::{FindSteps, KeySteps};
use crate::fit::single::key_weights::KeyWeights;
use crate::fit::single::long_tangents::FarKeys;
use crate::fit::single::small_angle::GentleLanes;
use crate::method::{FromKeys, Smooth};
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::Prepared;
use crate::prepare::waiting_curves::{List, WaitingCurves, fit};
use crate::simd::dispatch::in_lanes;
use crate::time::spans::NONE;

/// Where more than one interval of so many is left over, all of a block is worked out in
/// f64: alone each would bring two neighbours.
const MOST_ALONE: usize = 3;

/// As many as the lanes of a block become. A power of two.
const SPANS: usize = 2 * LANES;

/// The curves of a block that come straight from keys.
pub(crate) struct Direct {
    steps: KeySteps,
    weights: KeyWeights,
    gentle: GentleLanes,
    whole: WholeLanes,
    /// The spans and the segments that lanes become, the first where there are two.
    spans: [u32; ROOM],
    places: [u32; ROOM],
    /// Lanes to fit.
    usual: List,
    /// Those that few powers serve, and those to fit in two: of either a block has few.
    few_powers: WaitingCurves<Part<1, 4>, 4>,
    halves: WaitingCurves<Halves, 5>,
    /// Lanes that are fitted in two, or not here.
    long: List,
    /// 1 where a lane becomes two spans.
    cut: [u32; ROOM],
    /// Of spans that begin.
    starts: [f64; SPANS],
    keys: [u32; SPANS],
    /// Lanes that are left over.
    left_over: List,
    /// Where they wait; made when there is one.
    rest: Option<Box<Rest>>,
    /// See [`FromKeys`].
    find_far: fn(&mut FarKeys),
    smooth: Smooth,
    ends: Ends,
}

impl Direct {
    pub(crate) fn new(how: FromKeys, smooth: Smooth, ends: Ends) -> Self {
        Self {
            steps: KeySteps::new(),
            weights: KeyWeights::new(how.weights, ends),
            gentle: GentleLanes::new(),
            whole: WholeLanes::new(),
            spans: [0; ROOM],
            places: [0; ROOM],
            usual: List::new(),
            few_powers: WaitingCurves::new(&FEW_POWERS),
            halves: WaitingCurves::new(&Halves),
            long: List::new(),
            cut: [0; ROOM],
            starts: [0.0; SPANS],
            keys: [NONE; SPANS],
            left_over: List::new(),
            rest: None,
            find_far: how.find_far,
            smooth,
            ends,
        }
    }

    /// Finds what curves are made of.
    pub(crate) fn find_curves(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        in_lanes(&mut FindSteps {
            steps: &mut self.steps,
            intervals,
        });
        self.weights.bring(intervals, stretches);
        self.gentle.look(&self.steps, stretches);
        if self.gentle.may_hold() {
            (self.gentle).prepare(intervals, &self.weights, stretches);
        }
        self.whole.wanted = self.gentle.holds.map(|is_gentle| !is_gentle);
        in_lanes(&mut FindHandles {
            lanes: &mut self.whole,
            steps: &self.steps,
            weights: &self.weights,
            intervals,
            find_far: self.find_far,
        });
        in_lanes(&mut FindCurves {
            lanes: &mut self.whole,
            steps: &self.steps,
            weights: &self.weights,
            intervals,
        });
    }

    /// Takes the curves in some lanes: they become the next spans, the first with this constant
    /// at its start.
    pub(crate) fn take(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        if self.gentle.may_hold() {
            for lane in lanes.clone().filter(|&lane| self.gentle.holds[lane]) {
                // On no list.
                self.whole.energies[lane] = -1.0;
            }
        }
        self.list(lanes.clone());
        self.begin(prepared, intervals, lanes.clone(), key);
        if self.gentle.may_hold() {
            for lane in lanes.filter(|&lane| self.gentle.holds[lane]) {
                let place = self.places[lane] as usize;
                self.gentle
                    .write(lane, &mut prepared.segments.polynomials[place]);
            }
        }
    }

    /// Lists what is to become of lanes.
    fn list(&mut self, lanes: Range<usize>) {
        let energies = &self.whole.energies[lanes.clone()];
        let [few, whole, direct] =
            [LONGEST_OF_FEW, LONGEST_WHOLE, LONGEST_DIRECT].map(|most| most as f32);
        let is_usual = |energy: f32| energy > few && energy <= whole;
        (self.usual).push_where(lanes.clone(), energies, is_usual);
        let takes_few = |energy: f32| energy >= 0.0 && energy <= few;
        (self.few_powers.lanes).push_where(lanes.clone(), energies, takes_few);
        let is_cut = |energy: f32| energy > whole && energy <= direct;
        for (cut, &energy) in self.cut[lanes.clone()].iter_mut().zip(energies) {
            *cut = u32::from(is_cut(energy));
        }
        let is_long = |energy: f32| energy > whole || energy.is_nan();
        (self.long).push_where(lanes.clone(), energies, is_long);
        for lane in self.long.iter() {
            let energy = self.whole.energies[lane];
            if energy <= direct {
                self.halves.lanes.push(lane);
            } else {
                self.left_over.push(lane);
            }
        }
        self.long.clear();
    }

    /// Begins the spans and the segments that lanes become.
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
            // The next one takes the place of the second where this one is not cut.
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

    /// Fits the curves that were taken. What is left over waits, here or in `fitting`;
    /// `is_exact` where the intervals' numbers in f64 are there.
    pub(crate) fn fit(
        &mut self,
        prepared: &mut Prepared,
        intervals: &mut Intervals,
        stretches: &[Stretch],
        is_exact: bool,
        fitting: &mut Fitting,
    ) {
        let (numbers, places) = (&self.whole.numbers, &self.places);
        fit(&WHOLE, &self.usual, numbers, places, prepared);
        self.usual.clear();
        self.few_powers.take(numbers, places, prepared);
        self.halves.take(numbers, places, prepared);
        let are_many = MOST_ALONE * self.left_over.count() > intervals.count;
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

    /// Lets what is left over wait with its neighbours.
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

    /// Has what was left over fitted.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        self.few_powers.finish(prepared);
        self.halves.finish(prepared);
        if let Some(rest) = &mut self.rest {
            rest.flush(prepared, fitting);
        }
    }
}

/// Intervals that are left over, each between its neighbours.
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

    /// Whether there is room for so many that follow one another.
    fn has_room(&self, count: usize) -> bool {
        self.intervals.count + count + 2 <= LANES
    }

    /// Takes some intervals of a stretch, which are to become these spans; there is room.
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

    /// Makes all of them into curves, which then wait for their fit.
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
