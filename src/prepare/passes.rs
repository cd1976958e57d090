//! Passes over the lanes of a block: plain loops, compiled for every vector width.
//!
//! Outputs are arrays of a pass's own: the compiler must see that they do not overlap
//! what is read.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use std::marker::PhantomData;

use super::intervals::{Intervals, LANES, Lane, ROOM, at, energy, put};
use crate::branchless::{self, Algebra, Anywhere, Near, Quaternion, Vector, product, scaled, sum};
use crate::cpu::{InLanes, Lanes};
use crate::formula::Product;
use crate::frame_clock::FrameClock;

/// Steps between keys, and their logarithms.
pub(super) struct Steps<'a>(pub(super) &'a mut Intervals);

impl InLanes for Steps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
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

/// Whether intervals hold a frame.
pub(super) struct FramesHeld<'a> {
    pub(super) clock: FrameClock,
    pub(super) intervals: &'a Intervals,
    pub(super) held: [bool; LANES],
}

impl InLanes for FramesHeld<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (mut from, mut to) = ([0.0; LANES], [0.0; LANES]);
        let Intervals { starts, ends, .. } = self.intervals;
        for j in 0..LANES {
            from[j] = self.clock.first_frame(starts[j]);
            to[j] = self.clock.first_frame(ends[j]);
        }
        let mut held = [true; LANES];
        for j in 0..LANES {
            held[j] = from[j] < to[j];
        }
        self.held = held;
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
    /// Numbers that the method has for its first key.
    pub(crate) key: [f64; 4],
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

    /// The handle of the first or of the last key of a track.
    fn end(EndInterval { log, other, rest }: EndInterval, handle: EndHandle) -> Vector {
        match handle {
            EndHandle::Turn(turn) => scaled(turn, 1.0 / 3.0),
            // The tangents of a parabola change evenly.
            EndHandle::Parabolic => sum(scaled(log, 2.0 / 3.0), scaled(other, -1.0)),
            // No acceleration: the control rotation lies half way to the other one.
            EndHandle::Natural => scaled(rest, 0.5),
        }
    }
}

/// The interval at an end of a track.
#[derive(Clone, Copy)]
pub(crate) struct EndInterval {
    /// The logarithm of its step.
    pub(crate) log: Vector,
    /// The handle of its inner key.
    pub(crate) other: Vector,
    /// The logarithm of the step without that handle.
    pub(crate) rest: Vector,
}

/// What the handle of an end's key shall do.
#[derive(Clone, Copy)]
pub(crate) enum EndHandle {
    /// Give the velocity that makes this half-rotation vector within the interval.
    Turn(Vector),
    /// Continue the parabola through the last three keys.
    Parabolic,
    /// Give no acceleration.
    Natural,
}

/// The handles of every key that an interval starts with, or ends with.
pub(crate) struct KeyHandles<'a, R> {
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) rule: PhantomData<R>,
}

impl<R: HandleRule> InLanes for KeyHandles<'_, R> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let lane = [0.0; ROOM];
        let (mut incoming, mut outgoing) = ([lane; 3], [lane; 3]);
        let mut holds = lane;
        let all = &*self.intervals;
        let interval = |j: usize| Interval {
            duration: all.durations[j],
            step: at(&all.steps, j),
            log: at(&all.logs, j),
            key: at(&all.outward, j),
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
    fn run<L: Lanes>(&mut self) {
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
            put(&mut bases, j, all.key(j));
            energies[j] = energy([first, middle, last]);
            holds[j] = near.holds;
        }
        for j in (0..all.count).filter(|&j| holds[j] == 0.0) {
            let (first, last) = (at(&all.outgoing, j), at(&all.incoming, j + 1));
            let middle = between(&mut Anywhere, first, at(&all.steps, j), last);
            put(&mut middles, j, middle);
            energies[j] = energy([first, middle, last]);
        }
        let firsts = all.outgoing;
        self.0.put_product(&bases, [&firsts, &middles, &lasts]);
        self.0.energies = energies;
    }
}

impl Intervals {
    /// Bases and vectors of [`Product`].
    #[inline(always)]
    fn put_product(&mut self, bases: &[Lane; 4], vectors: [&[Lane; 3]; 3]) {
        self.numbers[..4].copy_from_slice(bases);
        for (j, vector) in vectors.into_iter().enumerate() {
            let place = Product::VECTORS + 3 * j;
            self.numbers[place..place + 3].copy_from_slice(vector);
        }
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

/// Control rotations from keys and handles: `q0`, `a = q0 exp(out)`, `b = q1 exp(-in)`,
/// `q1`, in the signs that the steps between them give.
pub(crate) struct ControlRotations<'a>(pub(crate) &'a mut Intervals);

impl InLanes for ControlRotations<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let lane = [0.0; ROOM];
        let mut controls = [[lane; 4]; 4];
        let mut energies = lane;
        let all = &*self.0;
        for j in 0..all.whole() {
            let (first, last) = (at(&all.outgoing, j), at(&all.incoming, j + 1));
            let start = all.key(j);
            let end = product(start, at(&all.steps, j));
            put(&mut controls[0], j, start);
            put(&mut controls[1], j, product(start, branchless::exp(first)));
            let back = branchless::exp(scaled(last, -1.0));
            put(&mut controls[2], j, product(end, back));
            put(&mut controls[3], j, end);
            energies[j] = energy([first, at(&all.logs, j), last]);
        }
        self.0.numbers[..16].copy_from_slice(controls.as_flattened());
        self.0.energies = energies;
    }
}

/// Curves near keys: each interval's own logarithm between its neighbours', from the
/// key before it.
pub(crate) struct BetweenNeighbours<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenNeighbours<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
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
            put(&mut bases, j + 1, product(all.key(j + 1), back));
            holds[j + 1] = near.holds;
        }
        for j in (1..all.count).filter(|&j| holds[j] == 0.0) {
            let back = branchless::exp(scaled(at(&all.logs, j - 1), -1.0));
            put(&mut bases, j, product(all.key(j), back));
        }
        self.0.put_product(&bases, vectors.each_ref());
        self.0.energies = energies;
    }
}
