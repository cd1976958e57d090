//! Passes over the lanes of a block: plain loops, compiled for every vector width.
//!
//! Outputs are arguments of a loop's own function: so the compiler knows that they do not
//! overlap what is read.
// Loops over lanes index many arrays at once.
#![allow(clippy::needless_range_loop)]

use std::marker::PhantomData;

use super::intervals::{Intervals, LANES, Lane, ROOM, aligned, at, energy, put};
use crate::branchless::{self, Algebra, Anywhere, Near, Quaternion, Vector, product, scaled, sum};
use crate::cpu::{InLanes, Lanes};
use crate::formula::Product;
use crate::frame_clock::FrameClock;

/// Steps between keys, and their logarithms.
pub(super) struct Steps<'a>(pub(super) &'a mut Intervals);

impl InLanes for Steps<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let (whole, noise) = (self.0.whole(), self.0.noise);
        let Intervals {
            from,
            to,
            dots,
            steps,
            logs,
            holds,
            count,
            ..
        } = &mut *self.0;
        step_lanes(whole, (from, to), noise, dots, steps, logs, holds);
        for j in (0..*count).filter(|&j| holds[j] == 0.0) {
            put(logs, j, branchless::log(at(steps, j)));
        }
    }
}

#[inline(always)]
fn step_lanes(
    count: usize,
    (from, to): (&[[f32; 4]; ROOM], &[[f32; 4]; ROOM]),
    noise: f64,
    dots: &mut Lane,
    steps: &mut [Lane; 4],
    logs: &mut [Lane; 3],
    holds: &mut Lane,
) {
    for j in 0..count {
        let (from, to) = (branchless::unit(from[j]), branchless::unit(to[j]));
        let [x, y, z, w] = branchless::step(from, to);
        let flip = if w < noise { -1.0 } else { 1.0 };
        let step = [x * flip, y * flip, z * flip, w * flip];
        let mut near = Near::new();
        let log = near.log(step);
        dots[j] = w;
        // Written out: with a loop over the components this one is not vectorised.
        [steps[0][j], steps[1][j], steps[2][j], steps[3][j]] = step;
        [logs[0][j], logs[1][j], logs[2][j]] = log;
        holds[j] = near.holds;
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
    fn end(EndInterval { log, other }: EndInterval, handle: EndHandle) -> Vector {
        match handle {
            EndHandle::Turn(turn) => scaled(turn, 1.0 / 3.0),
            // The tangents of a parabola change evenly.
            EndHandle::Parabolic => sum(scaled(log, 2.0 / 3.0), scaled(other, -1.0)),
            // No acceleration: the control rotation lies half way to the other one.
            EndHandle::Natural(rest) => scaled(rest, 0.5),
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
}

/// What the handle of an end's key shall do.
#[derive(Clone, Copy)]
pub(crate) enum EndHandle {
    /// Give the velocity that makes this half-rotation vector within the interval.
    Turn(Vector),
    /// Continue the parabola through the last three keys.
    Parabolic,
    /// Give no acceleration; the logarithm of the step without the inner key's handle.
    Natural(Vector),
}

/// The handles of every key that an interval starts with, or ends with.
pub(crate) struct KeyHandles<'a, R> {
    pub(crate) intervals: &'a mut Intervals,
    pub(crate) rule: PhantomData<R>,
}

impl<R: HandleRule> InLanes for KeyHandles<'_, R> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let whole = self.intervals.whole();
        let Intervals {
            durations,
            steps,
            logs,
            outward,
            incoming,
            outgoing,
            holds,
            count,
            ..
        } = &mut *self.intervals;
        let interval = |j: usize| Interval {
            duration: durations[j],
            step: at(steps, j),
            log: at(logs, j),
            key: at(outward, j),
        };
        handle_lanes::<R>(whole, interval, incoming, outgoing, holds);
        for j in (1..*count).filter(|&j| holds[j] == 0.0) {
            let handles = R::handles(&mut Anywhere, interval(j - 1), interval(j));
            put(incoming, j, handles.incoming);
            put(outgoing, j, handles.outgoing);
        }
    }
}

#[inline(always)]
fn handle_lanes<R: HandleRule>(
    count: usize,
    interval: impl Fn(usize) -> Interval,
    incoming: &mut [Lane; 3],
    outgoing: &mut [Lane; 3],
    holds: &mut Lane,
) {
    for j in 0..count {
        let mut near = Near::new();
        let handles = R::handles(&mut near, interval(j), interval(j + 1));
        put(incoming, j + 1, handles.incoming);
        put(outgoing, j + 1, handles.outgoing);
        holds[j + 1] = near.holds;
    }
}

/// Curves from keys and handles: `w₁ = out`, `w₃ = in` of the next key, and
/// `w₂ = log(a⁻¹ b)` with `a = q_i exp(w₁)`, `b = q_{i+1} exp(-w₃)`.
pub(crate) struct BetweenHandles<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenHandles<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let whole = self.0.whole();
        let Intervals {
            from,
            signs,
            steps,
            incoming,
            outgoing,
            numbers,
            energies,
            holds,
            count,
            ..
        } = &mut *self.0;
        let key = |j: usize| aligned(from[j], signs[j]);
        let handles = |j: usize| (at(outgoing, j), at(steps, j), at(incoming, j + 1));
        let (bases, vectors) = product_numbers(numbers);
        between_lanes(whole, key, handles, bases, vectors, energies, holds);
        for j in (0..*count).filter(|&j| holds[j] == 0.0) {
            let (first, step, last) = handles(j);
            let middle = between(&mut Anywhere, first, step, last);
            put_vectors(vectors, j, [first, middle, last]);
            energies[j] = energy([first, middle, last]);
        }
    }
}

#[inline(always)]
fn between_lanes(
    count: usize,
    key: impl Fn(usize) -> Quaternion,
    handles: impl Fn(usize) -> (Vector, Quaternion, Vector),
    bases: &mut [Lane; 4],
    vectors: &mut [Lane; 9],
    energies: &mut Lane,
    holds: &mut Lane,
) {
    for j in 0..count {
        let (first, step, last) = handles(j);
        let mut near = Near::new();
        let middle = between(&mut near, first, step, last);
        put(bases, j, key(j));
        put_vectors(vectors, j, [first, middle, last]);
        energies[j] = energy([first, middle, last]);
        holds[j] = near.holds;
    }
}

/// Bases and vectors of [`Product`].
#[inline(always)]
fn product_numbers(numbers: &mut [Lane]) -> (&mut [Lane; 4], &mut [Lane; 9]) {
    let (bases, others) = numbers.split_at_mut(Product::VECTORS);
    let vectors = &mut others[..Product::BASIS - Product::VECTORS];
    (
        bases.try_into().expect("a quaternion"),
        vectors.try_into().expect("three vectors"),
    )
}

#[inline(always)]
fn put_vectors(lanes: &mut [Lane; 9], lane: usize, [a, b, c]: [Vector; 3]) {
    let all = [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]];
    put(lanes, lane, all);
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
        let whole = self.0.whole();
        let Intervals {
            from,
            signs,
            steps,
            logs,
            incoming,
            outgoing,
            numbers,
            energies,
            ..
        } = &mut *self.0;
        let key = |j: usize| aligned(from[j], signs[j]);
        let handles = |j: usize| (at(outgoing, j), at(steps, j), at(incoming, j + 1));
        let log = |j: usize| at(logs, j);
        let controls = (&mut numbers[..16]).try_into().expect("four rotations");
        control_lanes(whole, key, handles, log, controls, energies);
    }
}

#[inline(always)]
fn control_lanes(
    count: usize,
    key: impl Fn(usize) -> Quaternion,
    handles: impl Fn(usize) -> (Vector, Quaternion, Vector),
    log: impl Fn(usize) -> Vector,
    controls: &mut [Lane; 16],
    energies: &mut Lane,
) {
    for j in 0..count {
        let (first, step, last) = handles(j);
        let start = key(j);
        let end = product(start, step);
        let a = product(start, branchless::exp(first));
        let b = product(end, branchless::exp(scaled(last, -1.0)));
        for (place, control) in [start, a, b, end].into_iter().enumerate() {
            for c in 0..4 {
                controls[4 * place + c][j] = control[c];
            }
        }
        energies[j] = energy([first, log(j), last]);
    }
}

/// Curves near keys: each interval's own logarithm between its neighbours', from the
/// key before it.
pub(crate) struct BetweenNeighbours<'a>(pub(crate) &'a mut Intervals);

impl InLanes for BetweenNeighbours<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let whole = self.0.whole();
        let Intervals {
            from,
            signs,
            logs,
            numbers,
            energies,
            holds,
            count,
            ..
        } = &mut *self.0;
        let key = |j: usize| aligned(from[j], signs[j]);
        let log = |j: usize| at(logs, j);
        let (bases, vectors) = product_numbers(numbers);
        neighbour_lanes(whole, key, log, bases, vectors, energies, holds);
        for j in (1..*count).filter(|&j| holds[j] == 0.0) {
            let back = branchless::exp(scaled(log(j - 1), -1.0));
            put(bases, j, product(key(j), back));
        }
    }
}

#[inline(always)]
fn neighbour_lanes(
    count: usize,
    key: impl Fn(usize) -> Quaternion,
    log: impl Fn(usize) -> Vector,
    bases: &mut [Lane; 4],
    vectors: &mut [Lane; 9],
    energies: &mut Lane,
    holds: &mut Lane,
) {
    for j in 0..count {
        let (before, own, after) = (log(j), log(j + 1), log(j + 2));
        put_vectors(vectors, j + 1, [before, own, after]);
        energies[j + 1] = energy([before, own, after]);
        let mut near = Near::new();
        let back = near.exp(scaled(before, -1.0));
        put(bases, j + 1, product(key(j + 1), back));
        holds[j + 1] = near.holds;
    }
}
