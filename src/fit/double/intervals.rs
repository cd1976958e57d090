//! Key intervals side by side, and what the methods make of them: each pass goes over
//! the lanes in vectors, compiled for every width.
//!
//! A lane is one key interval. Intervals of one track that follow one another are a
//! stretch; on either side of it a lane of context holds the neighbouring interval,
//! so that no pass asks where a track ends. Where there is no neighbour, the method's
//! ends put into the context, or into the handles, what the curve shall do there.

use std::ops::Range;

use crate::curve::options::Quantity;
use crate::fit::double::curve::{Curve, Piece};
use crate::fit::double::shape::Shape;
use crate::math::quaternion::{self, Arithmetic, Quaternion, Vector, square};
use crate::simd::lanes::{Doubles, Lanes};
use crate::time::spans::NONE;
use crate::tracks::set::Track;
use crate::tracks::signs::Signs;

/// Lanes worked out together.
pub(crate) const LANES: usize = 128;

/// Room for the lanes, and for passes that look one further and end on whole vectors.
pub(crate) const ROOM: usize = LANES + 8;

/// A number of each interval.
pub(crate) type Lane = [f64; ROOM];

/// Some consecutive intervals of a track in a block.
#[derive(Debug, Clone)]
pub(crate) struct Stretch {
    /// The lane of its first interval; the lane before it is context.
    pub(crate) lane: usize,
    /// Which intervals of the track.
    pub(crate) intervals: Range<usize>,
    /// Intervals of the whole track.
    pub(crate) all: usize,
    /// When the whole track starts and ends, seconds.
    pub(crate) span: (f64, f64),
    /// Its place in the prepared parts.
    pub(crate) part: usize,
    /// The constant of its first key; [`NONE`] where the curve does not
    /// meet its keys.
    pub(crate) key: u32,
    /// The same where curves stand still at their ends, whether they meet their keys or not.
    pub(crate) still: u32,
}

impl Stretch {
    /// The lanes of its intervals.
    pub(crate) fn lanes(&self) -> Range<usize> {
        self.lane..self.lane + self.intervals.len()
    }

    /// The constant at the start of its `i`th interval.
    pub(crate) fn key_at(&self, i: usize) -> u32 {
        match self.key {
            NONE => NONE,
            first => first + i as u32,
        }
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
    /// Keys at both ends, in the signs that they count with.
    pub(crate) from: [[f32; 4]; ROOM],
    pub(crate) to: [[f32; 4]; ROOM],
    /// Where it starts and ends, and how long it is; seconds.
    pub(crate) starts: Lane,
    pub(crate) ends: Lane,
    pub(crate) durations: Lane,
    pub(crate) count: usize,
    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) steps: [Lane; 4],
    /// Its logarithm.
    pub(crate) logs: [Lane; 3],
    /// Handles at the key that the interval starts with, towards the interval before
    /// it and towards this one.
    pub(crate) incoming: [Lane; 3],
    pub(crate) outgoing: [Lane; 3],
    /// Numbers that the method has for the interval: of the key that it starts with, and
    /// one lane further of the key that it ends with.
    pub(crate) outward: [Lane; 4],
    pub(crate) inward: [Lane; 4],
    /// What the formula takes.
    pub(crate) numbers: Vec<Lane>,
    /// How far the curve goes: the sum of the squares of its half-rotation vectors.
    pub(crate) energies: Lane,
}

impl Intervals {
    /// For curves that take so many numbers of their own.
    pub(crate) fn new(numbers: usize) -> Self {
        let lane = [0.0; ROOM];
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            from: [identity; ROOM],
            to: [identity; ROOM],
            starts: lane,
            ends: lane,
            durations: [1.0; ROOM],
            count: 0,
            steps: [lane; 4],
            logs: [lane; 3],
            incoming: [lane; 3],
            outgoing: [lane; 3],
            outward: [lane; 4],
            inward: [lane; 4],
            numbers: vec![lane; numbers],
            energies: lane,
        }
    }

    /// Adds some intervals of a track, whose keys count with these signs; the block has room for
    /// them.
    pub(crate) fn push(&mut self, track: Track, signs: Signs<'_>, intervals: Range<usize>) {
        let lanes = self.count..self.count + intervals.len();
        let Range { start, end } = intervals;
        let keys: &[[f32; 4]] = bytemuck::cast_slice(track.keys);
        let (from, to) = (start..end, start + 1..end + 1);
        let own = [&from, &to].map(|keys| signs.between(keys.clone()));
        own[0].copy(&keys[from], &mut self.from[lanes.clone()]);
        own[1].copy(&keys[to], &mut self.to[lanes.clone()]);
        let (starts, ends) = (&track.times[start..end], &track.times[start + 1..=end]);
        self.starts[lanes.clone()].copy_from_slice(starts);
        self.ends[lanes.clone()].copy_from_slice(ends);
        let durations = self.durations[lanes.clone()].iter_mut();
        for (duration, (start, end)) in durations.zip(starts.iter().zip(ends)) {
            *duration = end - start;
        }
        self.count = lanes.end;
    }

    /// Adds some lanes of other intervals, as they were pushed; there is room for them.
    pub(crate) fn push_from(&mut self, other: &Self, lanes: Range<usize>) {
        let own = self.count..self.count + lanes.len();
        self.from[own.clone()].copy_from_slice(&other.from[lanes.clone()]);
        self.to[own.clone()].copy_from_slice(&other.to[lanes.clone()]);
        self.durations[own.clone()].copy_from_slice(&other.durations[lanes]);
        self.count = own.end;
    }

    /// Gives a lane's keys the other sign where `sign` is -1.
    pub(crate) fn turn(&mut self, lane: usize, sign: f32) {
        for key in [&mut self.from[lane], &mut self.to[lane]] {
            *key = key.map(|component| component * sign);
        }
    }

    /// Sets the method's own numbers of the keys that an interval starts and ends with.
    pub(crate) fn set_given(&mut self, lane: usize, outward: [f64; 4], inward: [f64; 4]) {
        put(&mut self.outward, lane, outward);
        put(&mut self.inward, lane + 1, inward);
    }

    /// Adds a lane for a neighbour that there is not.
    pub(crate) fn push_nothing(&mut self) {
        let lane = self.count;
        let identity = [0.0, 0.0, 0.0, 1.0];
        (self.from[lane], self.to[lane]) = (identity, identity);
        self.durations[lane] = 1.0;
        self.count += 1;
    }

    /// Forgets them.
    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    pub(crate) fn duration(&self, lane: usize) -> f64 {
        self.durations[lane]
    }

    /// How fast the parameter runs, per second.
    pub(crate) fn rate(&self, lane: usize) -> f64 {
        quaternion::ratio(1.0, self.durations[lane])
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

    /// Numbers of the key that the interval starts with.
    pub(crate) fn outward(&self, lane: usize) -> [f64; 4] {
        at(&self.outward, lane)
    }

    /// Numbers of the key that the interval before `lane` ends with.
    pub(crate) fn inward(&self, lane: usize) -> [f64; 4] {
        at(&self.inward, lane)
    }

    /// The key that the interval starts with.
    #[inline(always)]
    pub(crate) fn key(&self, lane: usize) -> Quaternion {
        quaternion::unit(self.from[lane])
    }

    /// The key that the interval ends with, by the step to it.
    pub(crate) fn end_key(&self, lane: usize) -> Quaternion {
        quaternion::product(self.key(lane), self.step(lane))
    }

    /// Gives the interval numbers of its curve, from a place on.
    pub(crate) fn set_numbers(&mut self, lane: usize, place: usize, numbers: &[f64]) {
        for (lanes, &number) in self.numbers[place..].iter_mut().zip(numbers) {
            lanes[lane] = number;
        }
    }

    /// How far the curve goes.
    pub(crate) fn set_energy(&mut self, lane: usize, vectors: [Vector; 3]) {
        self.energies[lane] = energy(vectors);
    }

    /// The curve of an interval.
    pub(crate) fn curve(&self, lane: usize, shape: &'static Shape, quantity: Quantity) -> Curve {
        Curve {
            shape,
            numbers: shape.with(|i| self.numbers[i][lane]),
            piece: Piece::WHOLE,
            quantity,
            rate: self.rate(lane),
            pace: None,
        }
    }

    /// The keys at both ends of an interval.
    pub(crate) fn keys(&self, lane: usize) -> [[f32; 4]; 2] {
        [self.from[lane], self.to[lane]]
    }

    /// Lanes to work out: whole vectors of eight. Wider ones go on behind them, where there
    /// is [`ROOM`].
    #[inline(always)]
    pub(crate) fn whole(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// As [`Intervals::whole`], in f32.
    #[inline(always)]
    pub(crate) fn whole32(&self) -> usize {
        self.count.next_multiple_of(16).min(LANES)
    }
}

#[inline(always)]
pub(crate) fn at<const N: usize>(lanes: &[Lane; N], lane: usize) -> [f64; N] {
    std::array::from_fn(|i| lanes[i][lane])
}

#[inline(always)]
pub(crate) fn put<const N: usize>(lanes: &mut [Lane; N], lane: usize, value: [f64; N]) {
    for (lanes, value) in lanes.iter_mut().zip(value) {
        lanes[lane] = value;
    }
}

/// The sum of the vectors' squares.
#[inline(always)]
pub(crate) fn energy<N: Arithmetic>([a, b, c]: [[N; 3]; 3]) -> N {
    square(a) + square(b) + square(c)
}

/// Numbers of the lanes from `lane` on.
#[inline(always)]
pub(crate) fn load<L: Lanes>(numbers: &[f64], lane: usize) -> L::Doubles {
    L::Doubles::load(&numbers[lane..])
}

// Written out: closures are not always inlined.
#[inline(always)]
pub(crate) fn load3<L: Lanes, const WIDTH: usize>(
    [x, y, z]: &[[f64; WIDTH]; 3],
    lane: usize,
) -> [L::Doubles; 3] {
    [load::<L>(x, lane), load::<L>(y, lane), load::<L>(z, lane)]
}

#[inline(always)]
pub(crate) fn load4<L: Lanes, const WIDTH: usize>(
    [x, y, z, w]: &[[f64; WIDTH]; 4],
    lane: usize,
) -> [L::Doubles; 4] {
    [
        load::<L>(x, lane),
        load::<L>(y, lane),
        load::<L>(z, lane),
        load::<L>(w, lane),
    ]
}

#[inline(always)]
pub(crate) fn rounded<L: Lanes>([x, y, z, w]: [L::Doubles; 4]) -> [L; 4] {
    [L::rounded(x), L::rounded(y), L::rounded(z), L::rounded(w)]
}

/// Stores numbers to the lanes from `lane` on.
#[inline(always)]
pub(crate) fn store<D: Doubles, const N: usize>(lanes: &mut [Lane; N], lane: usize, own: [D; N]) {
    for c in 0..N {
        own[c].store(&mut lanes[c][lane..]);
    }
}
