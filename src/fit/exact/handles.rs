//! Passes over the lanes of a block in vectors of f64: steps, handles, and the curves between them.

use std::marker::PhantomData;
use std::ops::Range;

use crate::curve::formula::Product;
use crate::fit::block::{
    Intervals, LANES, ROW_LEN, RowF64, TrackStretch, at, load, put, squared_extent, store, widened,
};
use crate::math::quaternion::{self, Real, Vector, normalised, product, scaled, sum};
use crate::math::ranges::{Algebra, FullRange, PrincipalRange};
use crate::simd::dispatch::InLanes;
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::time::frame_clock::FrameClock;

/// Computes the steps between keys, and their logarithms.
pub(crate) struct ExactSteps<'a>(pub(crate) &'a mut Intervals);

impl InLanes for ExactSteps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let intervals = &mut *self.0;
        for lane in (0..intervals.padded_count()).step_by(L::COUNT) {
            let (from, to) = (
                units::<L>(&intervals.from, lane),
                units::<L>(&intervals.to, lane),
            );
            let step = quaternion::step(from, to);
            let mut near = PrincipalRange::new();
            let log = near.log(step);
            store(&mut intervals.steps, lane, step);
            store(&mut intervals.logs, lane, log);
            redo(near.doubt, lane..intervals.count, intervals, find_log);
        }
    }
}

/// Calls `again` with `state` for every lane in doubt. `doubt` has a number for each lane of a vector, the first of
/// which is the first of `lanes`; a lane is in doubt if its number is not 0 and not NaN. In most vectors there is
/// none. `again` is a function instead of a closure, because a closure in vector code would be compiled for each
/// width.
#[inline(always)]
pub(crate) fn redo<D: Doubles, S: ?Sized>(
    doubt: D,
    lanes: Range<usize>,
    state: &mut S,
    again: fn(&mut S, usize),
) {
    if !doubt.are_at_most(0.0) {
        let mut doubts = [0.0; MAX_LANES];
        doubt.store(&mut doubts);
        redo_lanes(lanes, &doubts, state, again);
    }
}

/// The rest of [`redo`], which is rarely needed and therefore not inlined into loops over vectors.
#[inline(never)]
fn redo_lanes<S: ?Sized>(
    lanes: Range<usize>,
    doubts: &[f64; MAX_LANES],
    state: &mut S,
    again: fn(&mut S, usize),
) {
    for (lane, &doubt) in lanes.zip(doubts) {
        if doubt != 0.0 {
            again(state, lane);
        }
    }
}

/// Keys in f64, normalised.
#[inline(always)]
fn units<L: Lanes>(keys: &[[f32; 4]; ROW_LEN], lane: usize) -> [L::Doubles; 4] {
    normalised(widened(L::load_rotations(&keys[lane..])))
}

/// Finds the intervals of some lanes that contain a frame.
pub(crate) struct FindFrames<'a> {
    pub(crate) clock: FrameClock,
    pub(crate) intervals: &'a Intervals,
    pub(crate) lanes: Range<usize>,
    pub(crate) has_frame: [bool; LANES],
}

impl InLanes for FindFrames<'_> {
    // The compiler vectorises this loop.
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let Intervals { starts, ends, .. } = self.intervals;
        let (starts, ends) = (&starts[self.lanes.clone()], &ends[self.lanes.clone()]);
        let has_frame = &mut self.has_frame[self.lanes.clone()];
        for j in 0..starts.len().min(ends.len()).min(has_frame.len()) {
            has_frame[j] = self.clock.first_frame(starts[j]) < self.clock.first_frame(ends[j]);
        }
    }
}

/// The data of a key interval, or of the intervals in a vector's lanes, for a [`HandleRule`].
#[derive(Clone, Copy)]
pub(crate) struct KeyInterval<R> {
    /// Seconds.
    pub(crate) duration: R,
    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) step: [R; 4],
    /// Its logarithm, within 1e-12.
    pub(crate) log: [R; 3],
    /// The method's numbers for its first key.
    pub(crate) key: [R; 4],
}

/// The intervals before and after a key.
pub(crate) type BothSides<A> = [KeyInterval<<A as Algebra>::Number>; 2];

/// The handles of a key: half-rotation vectors from the key to its control
/// rotations, `b_i = q_i exp(-incoming)` and `a_i = q_i exp(outgoing)`.
#[derive(Clone, Copy)]
pub(crate) struct HandlePair<R> {
    pub(crate) incoming: [R; 3],
    pub(crate) outgoing: [R; 3],
}

/// A rule that gives the handles of a key from the intervals on both sides of it.
pub(crate) trait HandleRule {
    /// The handles of the key between two intervals. Implementations are `#[inline(always)]` and
    /// have no branches, so that they run in vector lanes.
    fn handles<A: Algebra>(algebra: &mut A, sides: BothSides<A>) -> HandlePair<A::Number>;

    /// Whether curves are in cumulative form, not by their control rotations.
    const IS_CUMULATIVE: bool = false;

    /// The fraction of an interval's logarithm that the sum of its two handles is at constant velocity.
    const HANDLE_SHARE: f64 = 2.0 / 3.0;

    /// The handle of the first or of the last key of a track, from the logarithm of its interval's
    /// step and from the handle of the interval's inner key.
    fn end(log: Vector, other: Vector, handle: EndHandle) -> Vector {
        match handle {
            EndHandle::Velocity(vector) => scaled(vector, 1.0 / 3.0),
            // The tangent of a parabola changes at a constant rate.
            EndHandle::Parabolic => {
                let handle = sum(scaled(log, Self::HANDLE_SHARE), scaled(other, -1.0));
                if !Self::IS_CUMULATIVE && is_opposite(handle) {
                    log
                } else {
                    handle
                }
            }
            // No acceleration: the control rotation lies halfway to the other one.
            EndHandle::Natural(rest) => scaled(rest, 0.5),
        }
    }
}

/// Whether a handle ends at the key's quaternion with the other sign. No arc to it is distinguished, so the
/// construction by arcs defines no curve. This happens for the parabola through rotations by 180° there and back.
fn is_opposite(handle: Vector) -> bool {
    let square: f64 = handle.iter().map(|part| part * part).sum();
    (square - std::f64::consts::PI * std::f64::consts::PI).abs() < 1e-5
}

/// The condition for the handle of a track's first or last key.
#[derive(Clone, Copy)]
pub(crate) enum EndHandle {
    /// The velocity would rotate by this half-rotation vector within the interval.
    Velocity(Vector),
    /// The curve continues the parabola through the last three keys.
    Parabolic,
    /// The acceleration is 0. The value is the logarithm of the step without the inner key's handle.
    Natural(Vector),
}

/// Computes the handles of every key at the start or the end of an interval.
pub(crate) struct KeyHandles<'a, R> {
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) stretches: &'a [TrackStretch],
    pub(crate) rule: PhantomData<R>,
}

impl<R: HandleRule> InLanes for KeyHandles<'_, R> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        for lane in (0..self.intervals.padded_count()).step_by(L::COUNT) {
            let mut near = PrincipalRange::<L::Doubles>::new();
            find_handles::<R, _>(self.intervals, &mut near, lane + 1);
            redo(near.doubt, lane + 1..self.intervals.count, self, Self::find);
        }
    }
}

impl<R: HandleRule> KeyHandles<'_, R> {
    /// Computes the handles of one key over the full range.
    fn find(&mut self, lane: usize) {
        // A lane between two stretches is not a key: its intervals belong to different tracks.
        let mut stretches = self.stretches.iter().map(TrackStretch::lanes);
        if stretches.any(|lanes| (lanes.start..=lanes.end).contains(&lane)) {
            find_handles::<R, _>(self.intervals, &mut FullRange, lane);
        }
    }
}

/// Computes the logarithm of one step over the full range.
fn find_log(intervals: &mut Intervals, lane: usize) {
    let log = quaternion::log(at(&intervals.steps, lane));
    put(&mut intervals.logs, lane, log);
}

#[inline(always)]
fn interval<D: Doubles>(intervals: &Intervals, lane: usize) -> KeyInterval<D> {
    KeyInterval {
        duration: D::load(&intervals.durations[lane..]),
        step: load(&intervals.steps, lane),
        log: load(&intervals.logs, lane),
        key: load(&intervals.outward, lane),
    }
}

/// Computes the handles of the keys at the start of the intervals from `lane` on.
#[inline(always)]
fn find_handles<R: HandleRule, A: Algebra<Number: Doubles>>(
    intervals: &mut Intervals,
    algebra: &mut A,
    lane: usize,
) {
    let sides = [interval(intervals, lane - 1), interval(intervals, lane)];
    let handles = R::handles(algebra, sides);
    store(&mut intervals.incoming, lane, handles.incoming);
    store(&mut intervals.outgoing, lane, handles.outgoing);
}

/// Curves from keys and handles: `w₁ = out`, `w₃ = in` of the next key, and
/// `w₂ = log(a⁻¹ b)` with `a = q_i exp(w₁)`, `b = q_{i+1} exp(-w₃)`.
pub(crate) struct BetweenHandles<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenHandles<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let intervals = &mut *self.0;
        for lane in (0..intervals.padded_count()).step_by(L::COUNT) {
            let base = units::<L>(&intervals.from, lane);
            store_base(intervals, lane, base);
            let mut near = PrincipalRange::<L::Doubles>::new();
            find_vectors(intervals, &mut near, lane);
            redo(
                near.doubt,
                lane..intervals.count,
                intervals,
                find_full_vectors,
            );
        }
    }
}

/// Computes the vectors of the curves between handles, from `lane` on.
#[inline(always)]
fn find_vectors<A: Algebra<Number: Doubles>>(
    intervals: &mut Intervals,
    algebra: &mut A,
    lane: usize,
) {
    let first = load(&intervals.outgoing, lane);
    let last = load(&intervals.incoming, lane + 1);
    let back = A::Number::all(-1.0);
    let from_a = product(
        algebra.exp(scaled(first, back)),
        load(&intervals.steps, lane),
    );
    let middle = product(from_a, algebra.exp(scaled(last, back)));
    let vectors = [first, algebra.log(middle), last];
    store_vectors(intervals, lane, vectors);
}

/// Computes the vectors of one curve over the full range.
fn find_full_vectors(intervals: &mut Intervals, lane: usize) {
    find_vectors(intervals, &mut FullRange, lane);
}

/// Stores the bases of [`Product`] from `lane` on.
#[inline(always)]
fn store_base<D: Doubles>(intervals: &mut Intervals, lane: usize, base: [D; 4]) {
    let numbers: &mut [RowF64; 4] = intervals.numbers.first_chunk_mut().expect("a base");
    store(numbers, lane, base);
}

/// Stores the vectors of [`Product`], and the squared extents, from `lane` on.
#[inline(always)]
fn store_vectors<D: Doubles>(intervals: &mut Intervals, lane: usize, vectors: [[D; 3]; 3]) {
    let numbers = intervals.numbers[Product::VECTORS..].first_chunk_mut();
    let numbers: &mut [RowF64; 9] = numbers.expect("three vectors");
    let [a, b, c] = vectors;
    let components = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]];
    store(numbers, lane, components);
    squared_extent(vectors).store(&mut intervals.squared_extents[lane..]);
}

/// Control rotations from keys and handles: `q0`, `a = q0 exp(out)`, `b = q1 exp(-in)`,
/// `q1`.
pub(crate) struct ControlRotations<'a>(pub(crate) &'a mut Intervals);

impl InLanes for ControlRotations<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // Moved out of `self`, so that the compiler knows that input and output do not overlap, and vectorises the
        // loop.
        let mut numbers = std::mem::take(&mut self.0.numbers);
        let mut squared_extents = self.0.squared_extents;
        let controls = numbers.first_chunk_mut().expect("four rotations");
        control_lanes(self.0, controls, &mut squared_extents);
        (self.0.numbers, self.0.squared_extents) = (numbers, squared_extents);
    }
}

#[inline(always)]
fn control_lanes(intervals: &Intervals, controls: &mut [RowF64; 16], squared_extents: &mut RowF64) {
    for j in 0..intervals.padded_count() {
        let (first, last) = (at(&intervals.outgoing, j), at(&intervals.incoming, j + 1));
        let start = intervals.key(j);
        let end = product(start, at(&intervals.steps, j));
        let a = product(start, quaternion::exp(first));
        let b = product(end, quaternion::exp(scaled(last, -1.0)));
        for (index, control) in [start, a, b, end].into_iter().enumerate() {
            for c in 0..4 {
                controls[4 * index + c][j] = control[c];
            }
        }
        squared_extents[j] = squared_extent([first, at(&intervals.logs, j), last]);
    }
}

/// Curves that pass near their keys: the logarithms of the interval before, of the interval itself
/// and of the one after it are the vectors, and the key before the interval is the base.
pub(crate) struct BetweenNeighbours<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenNeighbours<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let intervals = &mut *self.0;
        for lane in (0..intervals.padded_count()).step_by(L::COUNT) {
            let mut near = PrincipalRange::<L::Doubles>::new();
            let start = units::<L>(&intervals.from, lane + 1);
            find_base(intervals, &mut near, lane + 1, start);
            let (before, after) = (load(&intervals.logs, lane), load(&intervals.logs, lane + 2));
            let log = load::<L::Doubles, _, _>(&intervals.logs, lane + 1);
            store_vectors(intervals, lane + 1, [before, log, after]);
            redo(
                near.doubt,
                lane + 1..intervals.count,
                intervals,
                find_full_base,
            );
        }
    }
}

/// Computes the keys before the intervals from `lane` on, which start with the keys `start`.
#[inline(always)]
fn find_base<A: Algebra<Number: Doubles>>(
    intervals: &mut Intervals,
    algebra: &mut A,
    lane: usize,
    start: [A::Number; 4],
) {
    let before = scaled(load(&intervals.logs, lane - 1), A::Number::all(-1.0));
    store_base(intervals, lane, product(start, algebra.exp(before)));
}

/// Computes the key before one interval over the full range.
fn find_full_base(intervals: &mut Intervals, lane: usize) {
    let start = intervals.key(lane);
    find_base(intervals, &mut FullRange, lane, start);
}
