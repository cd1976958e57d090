//! Smooth curves straight from keys, in f32: small angles by a series, longer curves by a Hermite
//! fit of the whole or of its halves. Intervals that f32 cannot prepare wait for a block of their
//! own, in f64.

use std::ops::Range;

use bytemuck::Zeroable as _;

use crate::curve::options::Ends;
use crate::fit::double::fit::{MOST, Samples};
use crate::fit::double::intervals::{Intervals, LANES, ROOM, Stretch};
use crate::fit::single::fit_range::{FEW_POWERS, LONGEST_OF_FEW, LONGEST_WHOLE, WHOLE};
use crate::fit::single::handles::{
    CurveNumbers, FindCurves, FindSteps, HandlesF32, LONGEST_DIRECT,
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

/// Prepares the curves of a block straight from keys.
pub(crate) struct Direct {
    weights: KeyWeights,
    small_angle: SmallAngleLanes,
    whole: HandlesF32,
    /// Where the curve of each lane goes; of one that is split, the first half.
    places: [Place; ROOM],
    /// Lanes that are fitted whole by degree 10.
    usual: Vec<u32>,
    /// Lanes that are fitted with degree 8, and lanes whose curve is split at its middle.
    few_powers: Vec<u32>,
    halves: Vec<u32>,
    /// Lanes that f32 cannot prepare.
    left_over: Vec<u32>,
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
            places: [Place::zeroed(); ROOM],
            usual: Vec::new(),
            few_powers: Vec::new(),
            halves: Vec::new(),
            left_over: Vec::new(),
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
        let place = prepared.push_segment(start, PolynomialSegment::zeroed(), key);
        self.places[lane] = place;
        if self.small_angle.holds[lane] {
            let segment = &mut prepared.segments.polynomials[place.segment];
            self.small_angle.write(lane, segment);
            return;
        }
        let squared_extent = self.whole.squared_extents[lane];
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
        list.push(lane as u32);
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
            for &lane in &self.left_over {
                let lane = lane as usize;
                fitting.take(intervals, lane, self.places[lane]);
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
        let mut left_over = &self.left_over[..];
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
                rest.push(intervals, stretch, lanes.clone(), &self.places[lanes]);
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

/// Fits the curves in the listed lanes into the segments at their places, and empties the list.
fn fit<const PAIRS: usize>(
    how: &impl KeyFit<PAIRS>,
    lanes: &mut Vec<u32>,
    curves: &CurveNumbers,
    places: &[Place; ROOM],
    prepared: &mut Prepared,
) {
    if lanes.is_empty() {
        return;
    }
    let count = lanes.len();
    lanes.resize(count.next_multiple_of(MOST), 0);
    let segments = &mut prepared.segments.polynomials;
    let all = segments.len();
    // The lanes of the last vector that have no curve write to two extra segments.
    segments.extend([PolynomialSegment::zeroed(); 2]);
    in_lanes(&mut Fit::<_, PAIRS> {
        how,
        lanes,
        count,
        curves,
        places,
        segments,
    });
    segments.truncate(all);
    lanes.clear();
}

struct Fit<'a, F, const PAIRS: usize> {
    how: &'a F,
    /// The listed lanes, and others up to whole vectors.
    lanes: &'a [u32],
    count: usize,
    curves: &'a CurveNumbers,
    places: &'a [Place; ROOM],
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
    smooth: Smooth,
    ends: Ends,
}

impl Rest {
    fn new(smooth: Smooth, ends: Ends) -> Self {
        Self {
            intervals: Intervals::new(smooth.shape.own),
            stretches: Vec::new(),
            places: Vec::new(),
            smooth,
            ends,
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
    fn flush(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        let (intervals, stretches) = (&mut self.intervals, &mut self.stretches);
        self.smooth.find_curves(intervals, stretches, self.ends);
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
