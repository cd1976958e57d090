//! Smooth curves directly from keys, in f32: small angles by a series, longer curves by a Hermite fit of the whole
//! curve or of its halves. Intervals that f32 cannot prepare are collected in a separate block, in f64.

use std::ops::Range;

use bytemuck::Zeroable;

use crate::curve::options::Ends;
use crate::fit::block::{CONTEXT, Intervals, LANES, ROW_LEN, TrackStretch};
use crate::fit::exact::fit::INDISTINCT;
use crate::fit::fast::fit_range::{LONGEST_DEGREE_8, LONGEST_WHOLE, WHOLE, WHOLE_DEGREE_8};
use crate::fit::fast::handles::{
    CurveNumbers, FindCurves, FindSteps, HandlesF32, LONGEST_DIRECT, SPARE_LANES,
};
use crate::fit::fast::hermite_fit::{BetweenKeys, Halves, KeyFit};
use crate::fit::fast::small_angle::SmallAngleLanes;
use crate::fit::nodes::NodeSamples;
use crate::fit::tangent_weights::KeyWeights;
use crate::method::{FastCurves, SmoothCurves};
use crate::prepare::fitting::Fitting;
use crate::prepare::prepared::{CurveSlot, Prepared, SPARE_SEGMENTS};
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::time::runs::NONE;

type CurveSlots = [CurveSlot; ROW_LEN + SPARE_LANES];

/// Indices in the lists of lanes.
const SMALL_ANGLE: usize = 0;
const HALVES: usize = 3;
const LEFT_OVER: usize = 4;

/// Prepares the curves of a block straight from keys.
pub(crate) struct FastPreparation {
    weights: KeyWeights,
    small_angle: SmallAngleLanes,
    handles: HandlesF32,
    /// The destination of each lane's curve; for a divided curve that of the first half.
    slots: CurveSlots,
    /// The queued lanes, by the kind of their curves: small-angle cubics, curves fitted with degree 8, curves fitted
    /// with degree 10, curves divided at their middle, and those that f32 cannot prepare.
    lists: [LaneList; 5],
    /// The starts and the keys of the spans of the lanes, at most two spans each.
    starts: [f64; 2 * LANES],
    keys: [u32; 2 * LANES],
    /// Intervals that f32 cannot prepare; allocated for the first one.
    left_over: Option<Box<LeftOver>>,
    /// See [`FastCurves`].
    set_long: fn(&mut HandlesF32, &[usize], &Intervals),
    smooth: SmoothCurves,
    ends: Ends,
}

impl FastPreparation {
    pub(crate) fn new(fast: FastCurves, smooth: SmoothCurves, ends: Ends) -> Self {
        Self {
            weights: KeyWeights::new(fast.weights, ends),
            small_angle: SmallAngleLanes::zeroed(),
            handles: HandlesF32::new(),
            slots: [CurveSlot::zeroed(); ROW_LEN + SPARE_LANES],
            lists: [LaneList::zeroed(); 5],
            starts: [0.0; 2 * LANES],
            keys: [NONE; 2 * LANES],
            left_over: None,
            set_long: fast.set_long,
            smooth,
            ends,
        }
    }

    /// Finds the steps, handles and curves of a block's intervals, and the small-angle cubics.
    pub(crate) fn find_curves(&mut self, intervals: &Intervals, stretches: &[TrackStretch]) {
        in_lanes(&mut FindSteps {
            lanes: &mut self.handles,
            intervals,
        });
        self.weights.compute(intervals, stretches);
        let chords = &self.handles.chords;
        (self.small_angle).find(chords, intervals, &self.weights, stretches);
        in_lanes(&mut FindCurves {
            lanes: &mut self.handles,
            weights: &self.weights,
            intervals,
            known: &self.small_angle.is_valid,
            set_long: self.set_long,
        });
    }

    /// Queues the curves in some lanes: they become the next spans, two for each that is divided at its middle. `key`
    /// is the constant at the start of the first. There is no branch on the angle of a curve, which processors cannot
    /// predict.
    pub(crate) fn queue(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        lanes: Range<usize>,
        key: u32,
    ) {
        let first = prepared.next_slot();
        let mut count = 0;
        for (i, lane) in lanes.enumerate() {
            let squared_extent = self.handles.squared_extents[lane];
            let within = [LONGEST_DEGREE_8, LONGEST_WHOLE, LONGEST_DIRECT]
                .map(|longest| usize::from(squared_extent <= longest as f32));
            let is_small = self.small_angle.is_valid[lane];
            // NaN fails all comparisons, so its list is LEFT_OVER.
            let list = usize::from(!is_small) * (LEFT_OVER - within.iter().sum::<usize>());
            // If no f64 is exactly at the middle, the interval is divided elsewhere.
            let (start, end) = (intervals.starts[lane], intervals.ends[lane]);
            let middle = start + (end - start) * 0.5;
            let off = ((middle - start) - (end - middle)).abs();
            let is_cut_off = list == HALVES && off > INDISTINCT * (end - start);
            let list = list + usize::from(is_cut_off);
            self.lists[list].push(lane);
            self.slots[lane] = CurveSlot {
                span: first.span + count,
                segment: first.segment + count,
            };
            let this_key = if key == NONE { NONE } else { key + i as u32 };
            let (this, next) = (count % (2 * LANES), (count + 1) % (2 * LANES));
            (self.starts[this], self.keys[this]) = (start, this_key);
            // The next lane writes over this unless the curve is split.
            (self.starts[next], self.keys[next]) = (middle, NONE);
            count += 1 + usize::from(list == HALVES);
        }
        prepared.push_segments(&self.starts[..count], &self.keys[..count]);
    }

    /// Fits the queued curves. Those that f32 cannot prepare are collected here or in `fitting`. `is_exact`: the f64
    /// numbers of the intervals are computed already.
    pub(crate) fn fit(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        stretches: &[TrackStretch],
        is_exact: bool,
        fitting: &mut Fitting,
    ) {
        for &lane in self.lists[SMALL_ANGLE].lanes() {
            let segment = self.slots[lane as usize].segment;
            let segment = &mut prepared.segments.polynomials[segment];
            self.small_angle.write(lane as usize, segment);
        }
        self.fit_lists(prepared, false);
        if is_exact {
            for &lane in self.lists[LEFT_OVER].lanes() {
                let lane = lane as usize;
                fitting.queue(intervals, lane, self.slots[lane]);
            }
        } else {
            self.leave(prepared, intervals, stretches, fitting);
        }
        (self.lists[SMALL_ANGLE].count, self.lists[LEFT_OVER].count) = (0, 0);
    }

    /// Fits the listed curves: all, or as many as fill vectors.
    fn fit_lists(&mut self, prepared: &mut Prepared, all: bool) {
        let (numbers, slots) = (&mut self.handles.numbers, &mut self.slots);
        let [_, degree_8, degree_10, halves, _] = &mut self.lists;
        fit_list(&WHOLE_DEGREE_8, degree_8, 0, all, numbers, slots, prepared);
        fit_list(&WHOLE, degree_10, 1, all, numbers, slots, prepared);
        fit_list(&Halves, halves, 2, all, numbers, slots, prepared);
    }

    /// Moves intervals that f32 cannot prepare to `rest`; each run of them has its neighbours as context.
    fn leave(
        &mut self,
        prepared: &mut Prepared,
        intervals: &Intervals,
        stretches: &[TrackStretch],
        fitting: &mut Fitting,
    ) {
        let mut left_over = self.lists[LEFT_OVER].lanes();
        for stretch in stretches {
            let end = stretch.lanes().end;
            let count = left_over.partition_point(|&lane| (lane as usize) < end);
            let (in_stretch, others) = left_over.split_at(count);
            for run in in_stretch.chunk_by(|&lane, &next| lane + 1 == next) {
                let lanes = run[0] as usize..run[0] as usize + run.len();
                let new = || Box::new(LeftOver::new(self.smooth));
                let rest = self.left_over.get_or_insert_with(new);
                if rest.intervals.count + lanes.len() + CONTEXT > LANES {
                    rest.flush((self.smooth, self.ends), prepared, fitting);
                }
                rest.push(intervals, stretch, lanes.clone(), &self.slots[lanes]);
            }
            left_over = others;
        }
    }

    /// Fits the remaining curves, and passes those that f32 cannot prepare to `fitting`.
    pub(crate) fn finish(&mut self, prepared: &mut Prepared, fitting: &mut Fitting) {
        self.fit_lists(prepared, true);
        if let Some(rest) = &mut self.left_over {
            rest.flush((self.smooth, self.ends), prepared, fitting);
        }
    }
}

/// Some lanes of a block.
#[derive(Clone, Copy, Zeroable)]
struct LaneList {
    count: usize,
    /// The lanes; entries after `count` are arbitrary.
    all: [u32; 2 * LANES],
}

impl LaneList {
    fn push(&mut self, lane: usize) {
        self.all[self.count % (2 * LANES)] = lane as u32;
        self.count += 1;
    }

    fn lanes(&self) -> &[u32] {
        &self.all[..self.count]
    }
}

/// Fits the curves in the listed lanes into the segments of their slots, all or as many as fill vectors. Curves that
/// do not fill a vector move to spare lanes, which start with the row `spare` of [`MAX_LANES`], and are fitted with
/// the next block.
fn fit_list<const PAIRS: usize>(
    key_fit: &impl KeyFit<PAIRS>,
    list: &mut LaneList,
    spare: usize,
    all: bool,
    curves: &mut CurveNumbers,
    slots: &mut CurveSlots,
    prepared: &mut Prepared,
) {
    let left = if all { 0 } else { list.count % MAX_LANES };
    let count = list.count - left;
    if count > 0 {
        let segments = &mut prepared.segments.polynomials;
        let len = segments.len();
        // The lanes of the last vector that have no curve write to two extra segments.
        segments.extend([PolynomialSegment::zeroed(); SPARE_SEGMENTS]);
        in_lanes(&mut ListFit::<_, PAIRS> {
            key_fit,
            lanes: &list.all,
            count,
            curves,
            slots,
            segments,
        });
        segments.truncate(len);
    }
    for i in 0..left {
        let (from, to) = (
            list.all[count + i] as usize,
            ROW_LEN + spare * MAX_LANES + i,
        );
        for numbers in &mut *curves {
            numbers[to] = numbers[from];
        }
        slots[to] = slots[from];
        list.all[i] = to as u32;
    }
    list.count = left;
}

struct ListFit<'a, F, const PAIRS: usize> {
    key_fit: &'a F,
    /// The lanes to fit, followed by arbitrary lanes up to whole vectors.
    lanes: &'a [u32],
    count: usize,
    curves: &'a CurveNumbers,
    slots: &'a CurveSlots,
    /// All segments, and two extra ones at the end.
    segments: &'a mut [PolynomialSegment],
}

impl<F: KeyFit<PAIRS>, const PAIRS: usize> InLanes for ListFit<'_, F, PAIRS> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // Made outside the loop, so that they are cleared only once.
        let mut samples = NodeSamples::<L, PAIRS>::all(L::all(0.0));
        for i in (0..self.count).step_by(L::COUNT) {
            let lanes = &self.lanes[i..i + L::COUNT];
            let used = &lanes[..L::COUNT.min(self.count - i)];
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
            let mut indices = [self.segments.len() - 2; MAX_LANES];
            for (index, &lane) in indices.iter_mut().zip(used) {
                *index = self.slots[lane as usize].segment;
            }
            self.key_fit
                .fit(&mut samples, &curves, &indices, self.segments);
        }
    }
}

/// Intervals that f32 cannot prepare; each run of them has its neighbours as context.
struct LeftOver {
    intervals: Intervals,
    stretches: Vec<TrackStretch>,
    slots: Vec<CurveSlot>,
}

impl LeftOver {
    fn new(smooth: SmoothCurves) -> Self {
        Self {
            intervals: Intervals::new(smooth.shape.per_curve),
            stretches: Vec::new(),
            slots: Vec::new(),
        }
    }

    /// Adds some intervals of a stretch, with these slots for their curves; there must be room for them.
    fn push(
        &mut self,
        intervals: &Intervals,
        stretch: &TrackStretch,
        lanes: Range<usize>,
        slots: &[CurveSlot],
    ) {
        let first = stretch.intervals.start + (lanes.start - stretch.lane);
        // If a track has only one interval, there is no neighbouring interval in the lane before.
        let beside = usize::from(stretch.track_intervals > 1);
        self.stretches.push(TrackStretch {
            lane: self.intervals.count + beside,
            intervals: first..first + lanes.len(),
            ..stretch.clone()
        });
        let lanes = lanes.start - beside..lanes.end + beside;
        self.intervals.push_from(intervals, lanes);
        self.slots.extend(slots);
    }

    /// Computes the curves of all intervals in f64, and queues them to be fitted.
    fn flush(
        &mut self,
        (smooth, ends): (SmoothCurves, Ends),
        prepared: &mut Prepared,
        fitting: &mut Fitting,
    ) {
        let (intervals, stretches) = (&mut self.intervals, &mut self.stretches);
        smooth.find_curves(intervals, stretches, ends);
        let lanes = stretches.iter().flat_map(TrackStretch::lanes);
        for (lane, &slot) in lanes.zip(&self.slots) {
            fitting.queue(intervals, lane, slot);
        }
        fitting.copy_queued(prepared, intervals);
        intervals.count = 0;
        stretches.clear();
        self.slots.clear();
    }
}
