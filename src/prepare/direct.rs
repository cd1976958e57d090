//! Smooth curves straight from keys, in f32: small angles by a series, longer curves by a Hermite
//! fit of the whole or of its halves. Intervals that f32 cannot prepare wait for a block of their
//! own, in f64.

use std::ops::Range;

use bytemuck::Zeroable;

use crate::curve::options::Ends;
use crate::fit::double::curve::INDISTINCT;
use crate::fit::double::fit::{MOST, Samples};
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::single::fit_range::{FEW_POWERS, LONGEST_OF_FEW, LONGEST_WHOLE, WHOLE};
use crate::fit::single::handles::{
    CurveNumbers, FindCurves, FindSteps, HandlesF32, LONGEST_DIRECT, WAITING,
};
use crate::fit::single::hermite_fit::{BetweenKeys, Halves, KeyFit};
use crate::fit::single::small_angle::SmallAngleLanes;
use crate::fit::tangent_weights::KeyWeights;
use crate::method::{FromKeys, Smooth};
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::{Place, Prepared};
use crate::prepare::smooth::CONTEXT;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::spans::NONE;

type Places = [Place; ROOM + WAITING];

/// Places in the lists of lanes.
const SMALL_ANGLE: usize = 0;
const HALVES: usize = 3;
const LEFT_OVER: usize = 4;

/// Prepares the curves of a block straight from keys.
pub(crate) struct Direct {
    weights: KeyWeights,
    small_angle: SmallAngleLanes,
    whole: HandlesF32,
    /// Where the curve of each lane goes; of one that is split, the first half.
    places: Places,
    /// The lanes that were taken, by what becomes of their curves: small-angle cubics, curves
    /// fitted with degree 8, curves fitted with degree 10, curves split at their middle, and those
    /// that f32 cannot prepare.
    lists: [List; 5],
    /// The starts and the keys of the spans that lanes become, which are at most two each.
    starts: [f64; 2 * LANES],
    keys: [u32; 2 * LANES],
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
            small_angle: SmallAngleLanes::zeroed(),
            whole: HandlesF32::new(),
            places: [Place::zeroed(); ROOM + WAITING],
            lists: [List::zeroed(); 5],
            starts: [0.0; 2 * LANES],
            keys: [NONE; 2 * LANES],
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

    /// Takes the curves in some lanes: they become the next spans, two for each that is split at
    /// its middle. `key` is the constant at the start of the first. Nothing branches on how far a
    /// curve turns, which no processor can predict.
    pub(crate) fn take(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        let first = prepared.next_place();
        let mut count = 0;
        for (i, lane) in lanes.enumerate() {
            let squared_extent = self.whole.squared_extents[lane];
            let within = [LONGEST_OF_FEW, LONGEST_WHOLE, LONGEST_DIRECT]
                .map(|longest| usize::from(squared_extent <= longest as f32));
            let is_small = self.small_angle.holds[lane];
            // NaN is within nothing, and left over.
            let list = usize::from(!is_small) * (LEFT_OVER - within.iter().sum::<usize>());
            // Where no f64 is at the middle, another cut is found.
            let (start, end) = (intervals.starts[lane], intervals.ends[lane]);
            let middle = start + (end - start) * 0.5;
            let off = ((middle - start) - (end - middle)).abs();
            let is_cut_off = list == HALVES && off > INDISTINCT * (end - start);
            let list = list + usize::from(is_cut_off);
            self.lists[list].push(lane);
            self.places[lane] = Place {
                span: first.span + count,
                segment: first.segment + count,
            };
            let own = if key == NONE { NONE } else { key + i as u32 };
            let (this, next) = (count % (2 * LANES), (count + 1) % (2 * LANES));
            (self.starts[this], self.keys[this]) = (start, own);
            // The next lane writes over this unless the curve is split.
            (self.starts[next], self.keys[next]) = (middle, NONE);
            count += 1 + usize::from(list == HALVES);
        }
        prepared.push_segments(&self.starts[..count], &self.keys[..count]);
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
        for &lane in self.lists[SMALL_ANGLE].lanes() {
            let segment = self.places[lane as usize].segment;
            let segment = &mut prepared.segments.polynomials[segment];
            self.small_angle.write(lane as usize, segment);
        }
        self.fit_lists(prepared, false);
        if is_exact {
            for &lane in self.lists[LEFT_OVER].lanes() {
                let lane = lane as usize;
                fitting.take(intervals, lane, self.places[lane]);
            }
        } else {
            self.leave(prepared, intervals, stretches, fitting);
        }
        (self.lists[SMALL_ANGLE].count, self.lists[LEFT_OVER].count) = (0, 0);
    }

    /// Fits the listed curves: all, or as many as fill vectors.
    fn fit_lists(&mut self, prepared: &mut Prepared, all: bool) {
        let (numbers, places) = (&mut self.whole.numbers, &mut self.places);
        let [_, few_powers, usual, halves, _] = &mut self.lists;
        fit_list(&FEW_POWERS, few_powers, 0, all, numbers, places, prepared);
        fit_list(&WHOLE, usual, 1, all, numbers, places, prepared);
        fit_list(&Halves, halves, 2, all, numbers, places, prepared);
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
        let mut left_over = self.lists[LEFT_OVER].lanes();
        for stretch in stretches {
            let end = stretch.lanes().end;
            let own = left_over.partition_point(|&lane| (lane as usize) < end);
            let (own, others) = left_over.split_at(own);
            for run in own.chunk_by(|&lane, &next| lane + 1 == next) {
                let lanes = run[0] as usize..run[0] as usize + run.len();
                let new = || Box::new(Rest::new(self.smooth));
                let rest = self.rest.get_or_insert_with(new);
                if rest.intervals.count + lanes.len() + CONTEXT > LANES {
                    rest.flush((self.smooth, self.ends), prepared, fitting);
                }
                rest.push(intervals, stretch, lanes.clone(), &self.places[lanes]);
            }
            left_over = others;
        }
    }

    /// Fits the curves that still wait, and hands those left over to `fitting`.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        self.fit_lists(prepared, true);
        if let Some(rest) = &mut self.rest {
            rest.flush((self.smooth, self.ends), prepared, fitting);
        }
    }
}

/// Some lanes of a block.
#[derive(Clone, Copy, Zeroable)]
struct List {
    count: usize,
    /// Those after `count` are any lanes.
    all: [u32; 2 * LANES],
}

impl List {
    fn push(&mut self, lane: usize) {
        self.all[self.count % (2 * LANES)] = lane as u32;
        self.count += 1;
    }

    fn lanes(&self) -> &[u32] {
        &self.all[..self.count]
    }
}

/// Fits the curves in the listed lanes into the segments at their places, all or as many as fill
/// vectors. The others wait, in the `waiting`th row of the lanes for that.
fn fit_list<const PAIRS: usize>(
    how: &impl KeyFit<PAIRS>,
    list: &mut List,
    waiting: usize,
    all: bool,
    curves: &mut CurveNumbers,
    places: &mut Places,
    prepared: &mut Prepared,
) {
    let left = if all { 0 } else { list.count % MOST };
    let count = list.count - left;
    if count > 0 {
        let segments = &mut prepared.segments.polynomials;
        let len = segments.len();
        // The lanes of the last vector that have no curve write to two extra segments.
        segments.extend([PolynomialSegment::zeroed(); 2]);
        in_lanes(&mut Fit::<_, PAIRS> {
            how,
            lanes: &list.all,
            count,
            curves,
            places,
            segments,
        });
        segments.truncate(len);
    }
    for i in 0..left {
        let (from, to) = (list.all[count + i] as usize, ROOM + waiting * MOST + i);
        for numbers in &mut *curves {
            numbers[to] = numbers[from];
        }
        places[to] = places[from];
        list.all[i] = to as u32;
    }
    list.count = left;
}

struct Fit<'a, F, const PAIRS: usize> {
    how: &'a F,
    /// The lanes to fit, and any lanes up to whole vectors.
    lanes: &'a [u32],
    count: usize,
    curves: &'a CurveNumbers,
    places: &'a Places,
    /// All segments, and two extra ones at the end.
    segments: &'a mut [PolynomialSegment],
}

impl<F: KeyFit<PAIRS>, const PAIRS: usize> InLanes for Fit<'_, F, PAIRS> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // Made outside the loop, so that they are cleared only once.
        let mut samples = Samples::<L, PAIRS>::all(L::all(0.0));
        for i in (0..self.count).step_by(L::COUNT) {
            let lanes = &self.lanes[i..i + L::COUNT];
            let own = &lanes[..L::COUNT.min(self.count - i)];
            let [starts, firsts, seconds, thirds, ends] = self.curves;
            let start = L::gather_rotations(starts, lanes);
            let [x1, y1, z1, _] = L::gather_rotations(firsts, lanes);
            let [x2, y2, z2, _] = L::gather_rotations(seconds, lanes);
            let [x3, y3, z3, _] = L::gather_rotations(thirds, lanes);
            let curves = BetweenKeys {
                start,
                vectors: [[x1, y1, z1], [x2, y2, z2], [x3, y3, z3]],
                end: L::gather_rotations(ends, lanes),
            };
            let mut places = [self.segments.len() - 2; MOST];
            for (place, &lane) in places.iter_mut().zip(own) {
                *place = self.places[lane as usize].segment;
            }
            self.how.fit(&mut samples, &curves, &places, self.segments);
        }
    }
}

/// Intervals that are left over, each run of them between its neighbours as context.
struct Rest {
    intervals: Intervals,
    stretches: Vec<Stretch>,
    places: Vec<Place>,
}

impl Rest {
    fn new(smooth: Smooth) -> Self {
        Self {
            intervals: Intervals::new(smooth.shape.own),
            stretches: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Takes some intervals of a stretch, whose curves go to these places; there must be room for them.
    fn push(
        &mut self,
        intervals: &Intervals,
        stretch: &Stretch,
        lanes: Range<usize>,
        places: &[Place],
    ) {
        let first = stretch.intervals.start + (lanes.start - stretch.lane);
        // The only interval of a track has no neighbours.
        let beside = usize::from(stretch.all > 1);
        self.stretches.push(Stretch {
            lane: self.intervals.count + beside,
            intervals: first..first + lanes.len(),
            ..stretch.clone()
        });
        let lanes = lanes.start - beside..lanes.end + beside;
        self.intervals.push_from(intervals, lanes);
        self.places.extend(places);
    }

    /// Computes the curves of all intervals in f64, and queues them to be fitted.
    fn flush(
        &mut self,
        (smooth, ends): (Smooth, Ends),
        prepared: &mut Prepared,
        fitting: &mut Fitting,
    ) {
        let (intervals, stretches) = (&mut self.intervals, &mut self.stretches);
        smooth.find_curves(intervals, stretches, ends);
        let lanes = stretches.iter().flat_map(Stretch::lanes);
        for (lane, &place) in lanes.zip(&self.places) {
            fitting.take(intervals, lane, place);
        }
        fitting.bring(prepared, intervals);
        intervals.count = 0;
        stretches.clear();
        self.places.clear();
    }
}
