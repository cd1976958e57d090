//! Key intervals side by side, and what the methods make of them: each pass is a
//! plain loop over lanes, compiled for every vector width.
//!
//! A lane is one key interval. Intervals of one track that follow one another are a
//! stretch; on either side of it a lane of context holds the neighbouring interval,
//! so that no pass asks where a track ends. Where there is no neighbour, the method's
//! ends put into the context, or into the handles, what the curve shall do there.

use std::marker::PhantomData;
use std::ops::Range;

use super::cubic::{Cubic, Piece};
use crate::branchless::{self, Algebra, Anywhere, Near, Quaternion, Vector, product, scaled};
use crate::cpu::InLanes;
use crate::method::Basis;
use crate::tracks::Track;

/// Lanes worked out together.
pub(super) const LANES: usize = 64;

/// Room for the lanes, and for passes that look one further and end on whole vectors.
const ROOM: usize = LANES + 8;

/// A number of each interval.
pub(crate) type Lane = [f64; ROOM];

/// Some consecutive intervals of a track in a block.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// The lane of its first interval; the lane before it is context.
    pub(super) lane: usize,
    /// Which intervals of the track.
    pub(super) intervals: Range<usize>,
    /// Intervals of the whole track.
    pub(crate) all: usize,
    /// The track's place in the set.
    pub(super) track: usize,
    /// Its place in the prepared parts.
    pub(super) part: usize,
    /// The constant of its first key; [`NONE`](super::NONE) where the curve does not
    /// meet its keys.
    pub(super) key: u32,
}

impl Stretch {
    /// The lanes of its intervals.
    pub(super) fn lanes(&self) -> Range<usize> {
        self.lane..self.lane + self.intervals.len()
    }

    /// The lane of the track's first interval, where it is among these.
    pub(crate) fn first(&self) -> Option<usize> {
        (self.intervals.start == 0).then_some(self.lane)
    }

    /// The lane of the track's last interval, where it is among these.
    pub(crate) fn last(&self) -> Option<usize> {
        (self.intervals.end == self.all).then_some(self.lane + self.intervals.len() - 1)
    }
}

/// A block of intervals.
pub(crate) struct Intervals {
    /// Keys at both ends, as stored.
    from: [[f32; 4]; ROOM],
    to: [[f32; 4]; ROOM],
    /// Where it starts and ends, and how long it is; seconds.
    pub(super) starts: Lane,
    pub(super) ends: Lane,
    durations: Lane,
    pub(super) count: usize,
    /// Dot products below this turn the second key's sign.
    pub(super) noise: f64,
    /// Inner products of the two keys as stored.
    pub(super) dots: Lane,
    /// `q_i⁻¹ q_{i+1}`, their signs aligned.
    steps: [Lane; 4],
    /// Its logarithm.
    logs: [Lane; 3],
    /// Handles at the key that the interval starts with, towards the interval before
    /// it and towards this one.
    incoming: [Lane; 3],
    outgoing: [Lane; 3],
    /// The sign of the interval's first key after those before it in its track.
    pub(super) signs: Lane,
    /// What the curve starts from, and its three half-rotation vectors.
    pub(super) bases: [Lane; 4],
    pub(super) vectors: [[Lane; 3]; 3],
    /// The sum of the vectors' squares.
    pub(super) energies: Lane,
}

impl Intervals {
    pub(super) fn new(noise: f64) -> Self {
        let lane = [0.0; ROOM];
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            from: [identity; ROOM],
            to: [identity; ROOM],
            starts: lane,
            ends: lane,
            durations: [1.0; ROOM],
            count: 0,
            noise,
            dots: lane,
            steps: [lane; 4],
            logs: [lane; 3],
            incoming: [lane; 3],
            outgoing: [lane; 3],
            signs: [1.0; ROOM],
            bases: [lane; 4],
            vectors: [[lane; 3]; 3],
            energies: lane,
        }
    }

    /// Adds interval `i` of a track; the block is not full.
    pub(super) fn push(&mut self, track: Track, i: usize) {
        let lane = self.count;
        self.from[lane] = track.keys[i].to_array();
        self.to[lane] = track.keys[i + 1].to_array();
        self.starts[lane] = track.times[i];
        self.ends[lane] = track.times[i + 1];
        self.durations[lane] = track.times[i + 1] - track.times[i];
        self.count += 1;
    }

    /// Adds a lane for a neighbour that there is not.
    pub(super) fn push_nothing(&mut self) {
        let lane = self.count;
        let identity = [0.0, 0.0, 0.0, 1.0];
        (self.from[lane], self.to[lane]) = (identity, identity);
        self.durations[lane] = 1.0;
        self.count += 1;
    }

    pub(crate) fn duration(&self, lane: usize) -> f64 {
        self.durations[lane]
    }

    pub(crate) fn log(&self, lane: usize) -> Vector {
        at(&self.logs, lane)
    }

    pub(crate) fn set_log(&mut self, lane: usize, log: Vector) {
        put(&mut self.logs, lane, log);
    }

    pub(crate) fn step(&self, lane: usize) -> Quaternion {
        at(&self.steps, lane)
    }

    pub(crate) fn incoming(&self, lane: usize) -> Vector {
        at(&self.incoming, lane)
    }

    pub(crate) fn set_incoming(&mut self, lane: usize, handle: Vector) {
        put(&mut self.incoming, lane, handle);
    }

    pub(crate) fn outgoing(&self, lane: usize) -> Vector {
        at(&self.outgoing, lane)
    }

    pub(crate) fn set_outgoing(&mut self, lane: usize, handle: Vector) {
        put(&mut self.outgoing, lane, handle);
    }

    /// The curve of an interval.
    pub(super) fn cubic(&self, lane: usize, basis: &'static Basis) -> Cubic {
        Cubic {
            base: at(&self.bases, lane),
            vectors: self.vectors.each_ref().map(|vector| at(vector, lane)),
            basis,
            piece: Piece::WHOLE,
        }
    }

    /// The keys at both ends of an interval, as stored.
    pub(super) fn keys(&self, lane: usize) -> [[f32; 4]; 2] {
        [self.from[lane], self.to[lane]]
    }

    /// Lanes to work out: whole vectors of them.
    fn whole(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }
}

#[inline(always)]
fn at<const N: usize>(lanes: &[Lane; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|i| lanes[i][lane])
}

#[inline(always)]
fn put<const N: usize>(lanes: &mut [Lane; N], lane: usize, value: [f64; N]) {
    for (lanes, value) in lanes.iter_mut().zip(value) {
        lanes[lane] = value;
    }
}

/// Steps between keys, and their logarithms.
pub(super) struct Steps<'a>(pub(super) &'a mut Intervals);

impl InLanes for Steps<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let lane = [0.0; ROOM];
        // Outputs are arrays of its own, here and in every pass: the compiler must
        // see that they do not overlap what is read.
        let (mut dots, mut steps, mut logs) = (lane, [lane; 4], [lane; 3]);
        let mut holds = lane;
        let Intervals { from, to, .. } = &*self.0;
        let noise = self.0.noise;
        for j in 0..self.0.whole() {
            let [x, y, z, w] = branchless::step(branchless::unit(from[j]), branchless::unit(to[j]));
            let flip = if w < noise { -1.0 } else { 1.0 };
            let step = [x * flip, y * flip, z * flip, w * flip];
            let mut near = Near::new();
            dots[j] = w;
            put(&mut steps, j, step);
            put(&mut logs, j, near.log(step));
            holds[j] = near.holds;
        }
        for j in (0..self.0.count).filter(|&j| holds[j] == 0.0) {
            put(&mut logs, j, branchless::log(at(&steps, j)));
        }
        (self.0.dots, self.0.steps, self.0.logs) = (dots, steps, logs);
    }
}

/// A key interval as the rules for handles see it.
#[derive(Clone, Copy)]
pub(crate) struct Interval {
    /// Seconds.
    pub(crate) duration: f64,
    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) step: Quaternion,
    /// Its logarithm, within 1e-12.
    pub(crate) log: Vector,
}

/// The handles of a key: half-rotation vectors from the key to its control
/// rotations, `b_i = q_i exp(-incoming)` and `a_i = q_i exp(outgoing)`.
#[derive(Clone, Copy)]
pub(crate) struct Handles {
    pub(crate) incoming: Vector,
    pub(crate) outgoing: Vector,
}

/// A rule that gives the handles of a key from the intervals on both sides of it.
pub(crate) trait HandleRule {
    /// `#[inline(always)]`, and without branches.
    fn handles(algebra: &mut impl Algebra, before: Interval, after: Interval) -> Handles;
}

/// The handles of every key that an interval starts with, or ends with.
pub(crate) struct KeyHandles<'a, R> {
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) rule: PhantomData<R>,
}

impl<R: HandleRule> InLanes for KeyHandles<'_, R> {
    #[inline(always)]
    fn run(&mut self) {
        let lane = [0.0; ROOM];
        let (mut incoming, mut outgoing) = ([lane; 3], [lane; 3]);
        let mut holds = lane;
        let all = &*self.intervals;
        let interval = |j: usize| Interval {
            duration: all.durations[j],
            step: at(&all.steps, j),
            log: at(&all.logs, j),
        };
        for j in 0..all.whole() {
            let mut near = Near::new();
            let handles = R::handles(&mut near, interval(j), interval(j + 1));
            put(&mut incoming, j + 1, handles.incoming);
            put(&mut outgoing, j + 1, handles.outgoing);
            holds[j + 1] = near.holds;
        }
        for j in (1..all.count).filter(|&j| holds[j] == 0.0) {
            let handles = R::handles(&mut Anywhere, interval(j - 1), interval(j));
            put(&mut incoming, j, handles.incoming);
            put(&mut outgoing, j, handles.outgoing);
        }
        (self.intervals.incoming, self.intervals.outgoing) = (incoming, outgoing);
    }
}

/// Curves from keys and handles: `w₁ = out`, `w₃ = in` of the next key, and
/// `w₂ = log(a⁻¹ b)` with `a = q_i exp(w₁)`, `b = q_{i+1} exp(-w₃)`.
pub(crate) struct BetweenHandles<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenHandles<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let lane = [0.0; ROOM];
        let (mut bases, mut middles, mut lasts) = ([lane; 4], [lane; 3], [lane; 3]);
        let (mut energies, mut holds) = (lane, lane);
        let all = &*self.0;
        for j in 0..all.whole() {
            let (first, last) = (at(&all.outgoing, j), at(&all.incoming, j + 1));
            let mut near = Near::new();
            let middle = between(&mut near, first, at(&all.steps, j), last);
            put(&mut middles, j, middle);
            put(&mut lasts, j, last);
            put(&mut bases, j, signed_key(all, j));
            energies[j] = energy([first, middle, last]);
            holds[j] = near.holds;
        }
        for j in (0..all.count).filter(|&j| holds[j] == 0.0) {
            let (first, last) = (at(&all.outgoing, j), at(&all.incoming, j + 1));
            let middle = between(&mut Anywhere, first, at(&all.steps, j), last);
            put(&mut middles, j, middle);
            energies[j] = energy([first, middle, last]);
        }
        let vectors = [all.outgoing, middles, lasts];
        (self.0.bases, self.0.vectors, self.0.energies) = (bases, vectors, energies);
    }
}

/// `log(a⁻¹ b)`.
#[inline(always)]
fn between(
    algebra: &mut impl Algebra,
    outgoing: Vector,
    step: Quaternion,
    incoming: Vector,
) -> Vector {
    let from_a = product(algebra.exp(scaled(outgoing, -1.0)), step);
    let middle = product(from_a, algebra.exp(scaled(incoming, -1.0)));
    algebra.log(middle)
}

/// The sum of the vectors' squares.
#[inline(always)]
fn energy(vectors: [Vector; 3]) -> f64 {
    let square = |[x, y, z]: Vector| x * x + y * y + z * z;
    square(vectors[0]) + square(vectors[1]) + square(vectors[2])
}

/// Curves near keys: each interval's own logarithm between its neighbours', from the
/// key before it.
pub(crate) struct BetweenNeighbours<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenNeighbours<'_> {
    #[inline(always)]
    fn run(&mut self) {
        let lane = [0.0; ROOM];
        let (mut bases, mut vectors) = ([lane; 4], [[lane; 3]; 3]);
        let (mut energies, mut holds) = (lane, lane);
        let all = &*self.0;
        for j in 0..all.whole() {
            let before: Vector = at(&all.logs, j);
            let own: Vector = at(&all.logs, j + 1);
            let after: Vector = at(&all.logs, j + 2);
            put(&mut vectors[0], j + 1, before);
            put(&mut vectors[1], j + 1, own);
            put(&mut vectors[2], j + 1, after);
            energies[j + 1] = energy([before, own, after]);
            let mut near = Near::new();
            let back = near.exp(scaled(before, -1.0));
            put(&mut bases, j + 1, product(signed_key(all, j + 1), back));
            holds[j + 1] = near.holds;
        }
        for j in (1..all.count).filter(|&j| holds[j] == 0.0) {
            let back = branchless::exp(scaled(at(&all.logs, j - 1), -1.0));
            put(&mut bases, j, product(signed_key(all, j), back));
        }
        (self.0.bases, self.0.vectors, self.0.energies) = (bases, vectors, energies);
    }
}

/// The key that interval `j` starts with, in the sign that the keys before it give.
#[inline(always)]
fn signed_key(all: &Intervals, j: usize) -> Quaternion {
    let [x, y, z, w] = branchless::unit(all.from[j]);
    let sign = all.signs[j];
    [x * sign, y * sign, z * sign, w * sign]
}
