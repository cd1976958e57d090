//! Smooth curves straight from keys, in f32: those that turn little as a series, others by
//! a fit of the whole, of its halves or of its quarters. What is left over waits for a block of
//! its own, in f64.

use std::ops::Range;

use super::Prepared;
use super::far_keys::FarKeys;
use super::fit::{GENTLE, LONGEST_WHOLE};
use super::fitting::{Fitting, polynomials};
use super::gentle_lanes::GentleLanes;
use super::in_parts::{InParts, TakenCurves};
use super::intervals::{Intervals, LANES, ROOM, Stretch};
use super::key_joints::KeyJoints;
use super::key_steps::{FindSteps, KeySteps};
use super::part::{GENTLE_WHOLE, HALVES, LONGEST_HALVED, QUARTERS, WHOLE};
use super::passes::Steps;
use super::whole_fit::{List, Queue};
use super::whole_lanes::{FindCurves, FindHandles, LONGEST_DIRECT, WholeLanes};
use crate::cpu::in_lanes;
use crate::method::{Ends, FromKeys, Path, Smooth};

/// Where more than one interval of so many is left over, all of a block is worked out in
/// f64: alone each would bring two neighbours.
const MOST_ALONE: usize = 3;

/// The curves of a block that come straight from keys.
pub(super) struct Direct {
    steps: KeySteps,
    joints: KeyJoints,
    gentle: GentleLanes,
    whole: WholeLanes,
    /// The spans and the segments that lanes become.
    spans: [u32; ROOM],
    places: [u32; ROOM],
    /// Lanes to fit.
    all_powers: List,
    /// Lanes to fit with few powers, and where they wait: a block has few of them.
    few_powers: List,
    waiting: Queue,
    waiting_places: [u32; ROOM],
    /// Curves that are too long for that, or do not fit.
    halves: InParts<2>,
    quarters: InParts<4>,
    /// Lanes that are left over.
    left_over: List,
    /// Where they wait; made when there is one.
    rest: Option<Box<Rest>>,
    /// See [`FromKeys`].
    find_far: fn(&mut FarKeys),
    smooth: Smooth,
    ends: Ends,
    path: Path,
}

impl Direct {
    pub(super) fn new(how: FromKeys, smooth: Smooth, ends: Ends, path: Path) -> Self {
        Self {
            steps: KeySteps::new(path),
            joints: KeyJoints::new(how.joints, ends),
            gentle: GentleLanes::new(),
            whole: WholeLanes::new(),
            spans: [0; ROOM],
            places: [0; ROOM],
            all_powers: List::new(),
            few_powers: List::new(),
            waiting: Queue::new(),
            waiting_places: [0; ROOM],
            halves: InParts::new(&HALVES, smooth.shape),
            quarters: InParts::new(&QUARTERS, smooth.shape),
            left_over: List::new(),
            rest: None,
            find_far: how.find_far,
            smooth,
            ends,
            path,
        }
    }

    /// Finds the steps between keys; whether it is sure of their signs.
    pub(super) fn find_steps(&mut self, intervals: &Intervals) -> bool {
        in_lanes(&mut FindSteps {
            steps: &mut self.steps,
            intervals,
        });
        !self.steps.are_in_doubt
    }

    /// Sets the signs of the first keys of a stretch, the first of which has this one; that of
    /// the key that it ends with.
    pub(super) fn align(&self, intervals: &mut Intervals, stretch: &Stretch, first: f64) -> f64 {
        let signs = &mut intervals.signs[stretch.lanes()];
        if !self.steps.any_flips {
            signs.fill(first);
            return first;
        }
        let mut next = first;
        for (sign, &flip) in signs.iter_mut().zip(&self.steps.flips[stretch.lanes()]) {
            *sign = next;
            next *= f64::from(flip);
        }
        next
    }

    /// Finds what curves are made of; the signs of the intervals' first keys are known.
    pub(super) fn find_curves(&mut self, intervals: &Intervals, stretches: &[Stretch]) {
        self.joints.bring(intervals, stretches);
        self.gentle.look(&self.steps, stretches);
        if self.gentle.may_hold() {
            (self.gentle).prepare(intervals, &self.steps, &self.joints, stretches);
        }
        self.whole.wanted = self.gentle.holds.map(|is_gentle| !is_gentle);
        in_lanes(&mut FindHandles {
            lanes: &mut self.whole,
            steps: &self.steps,
            joints: &self.joints,
            intervals,
            find_far: self.find_far,
        });
        in_lanes(&mut FindCurves {
            lanes: &mut self.whole,
            steps: &self.steps,
            joints: &self.joints,
            intervals,
        });
    }

    /// Takes the curves in some lanes: each becomes the source of the next span.
    pub(super) fn take(&mut self, prepared: &mut Prepared, lanes: Range<usize>) {
        let (first_span, first_place) = prepared.new_segments(lanes.len());
        for (i, own) in self.spans[lanes.clone()].iter_mut().enumerate() {
            *own = (first_span + i) as u32;
        }
        for (i, own) in self.places[lanes.clone()].iter_mut().enumerate() {
            *own = (first_place + i) as u32;
        }
        if self.gentle.may_hold() {
            for lane in lanes.clone().filter(|&lane| self.gentle.holds[lane]) {
                let place = self.places[lane] as usize;
                self.gentle.write(lane, &mut polynomials(prepared)[place]);
                // On no list.
                self.whole.energies[lane] = -1.0;
            }
        }
        let energies = &self.whole.energies[lanes.clone()];
        let [short, whole, halved, direct] =
            [GENTLE, LONGEST_WHOLE, LONGEST_HALVED, LONGEST_DIRECT].map(|most| most as f32);
        let is_usual = |energy: f32| energy > short && energy <= whole;
        (self.all_powers).push_where(lanes.clone(), energies, is_usual);
        for (lane, &energy) in lanes.zip(energies) {
            if is_usual(energy) {
                continue;
            }
            if energy <= short {
                self.few_powers.push_if(energy >= 0.0, lane);
            } else if energy <= halved {
                self.halves.lanes.push(lane);
            } else if energy <= direct {
                self.quarters.lanes.push(lane);
            } else {
                self.left_over.push(lane);
            }
        }
    }

    /// Fits the curves that were taken. What is left over waits, here or in `fitting`;
    /// `is_exact` where the intervals' numbers in f64 are there.
    pub(super) fn fit(
        &mut self,
        prepared: &mut Prepared,
        intervals: &mut Intervals,
        stretches: &[Stretch],
        is_exact: bool,
        fitting: &mut Fitting,
    ) {
        self.fit_all_powers(prepared);
        self.wait(prepared);
        self.cut(prepared, intervals, fitting);
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
                let new = || Box::new(Rest::new(self.path, self.smooth, self.ends));
                let rest = self.rest.get_or_insert_with(new);
                if !rest.has_room(lanes.len()) {
                    rest.flush(prepared, fitting);
                }
                rest.push(intervals, stretch, lanes.clone(), &self.spans[lanes]);
            }
        }
    }

    /// Has what was left over fitted.
    pub(super) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        self.fit_few_powers(prepared);
        self.halves.finish(prepared, fitting);
        self.quarters.finish(prepared, fitting);
        if let Some(rest) = &mut self.rest {
            rest.flush(prepared, fitting);
        }
    }

    fn fit_all_powers(&mut self, prepared: &mut Prepared) {
        let segments = polynomials(prepared);
        let (whole, places) = (&self.whole.numbers, &self.places);
        (self.all_powers).fit(&WHOLE, whole, places, segments, &mut self.halves.lanes);
        self.all_powers.clear();
    }

    /// Lets curves that few powers serve wait.
    fn wait(&mut self, prepared: &mut Prepared) {
        while let Some(lane) = self.few_powers.pop() {
            let own = self.waiting.push(&self.whole.numbers, lane);
            self.waiting_places[own] = self.places[lane];
            if self.waiting.is_full() {
                self.fit_few_powers(prepared);
            }
        }
    }

    fn fit_few_powers(&mut self, prepared: &mut Prepared) {
        let (segments, places) = (polynomials(prepared), &self.waiting_places);
        (self.waiting).fit(&GENTLE_WHOLE, places, segments, &mut self.halves.lanes);
        self.waiting.clear();
    }

    /// Lets the longer curves wait, to be fitted in parts.
    fn cut(&mut self, prepared: &mut Prepared, intervals: &Intervals, fitting: &mut Fitting) {
        let curves = TakenCurves {
            numbers: &self.whole.numbers,
            durations: &intervals.durations,
            spans: &self.spans,
            places: &self.places,
        };
        self.halves.take(&curves, prepared, fitting);
        self.quarters.take(&curves, prepared, fitting);
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
    fn new(path: Path, smooth: Smooth, ends: Ends) -> Self {
        Self {
            intervals: Intervals::new(path.flips_below(), smooth.shape.own),
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
