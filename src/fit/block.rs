//! Blocks of key intervals, and the numbers that methods compute for them. Each pass goes over the
//! lanes in vectors and is compiled for every width.
//!
//! A lane is one key interval. Consecutive intervals of one track are a stretch; the lane on each side of it is
//! context and contains the neighbouring interval, so that passes need not know where a track ends. At the end of a
//! track the context is empty; then the method sets the context or the handles according to the requested `Ends`.

use std::ops::Range;

use crate::curve::formula::{FormulaNumbers, Product};
use crate::math::quaternion::{self, Arithmetic, Quaternion, Real as _, square};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::Lanes;
use crate::time::runs::NONE;
use crate::tracks::set::Track;
use crate::tracks::signs::Signs;

/// The number of lanes in a block.
pub(crate) const LANES: usize = 128;

/// The length of a block's arrays: passes read one lane more, and end at whole vectors.
pub(crate) const ROW_LEN: usize = LANES + 8;

/// One number for each interval.
pub(crate) type RowF64 = [f64; ROW_LEN];

/// The number of lanes of context for a stretch, in addition to those of its intervals.
pub(crate) const CONTEXT: usize = 2;

/// Some consecutive intervals of a track in a block.
#[derive(Debug, Clone)]
pub(crate) struct TrackStretch {
    /// The lane of its first interval. The lane before it is context, unless the interval is its
    /// track's only one.
    pub(crate) lane: usize,
    /// The intervals' indices in the track.
    pub(crate) intervals: Range<usize>,
    /// The number of intervals of the whole track.
    pub(crate) track_intervals: usize,
    /// The start and the end of the whole track in seconds.
    pub(crate) span: (f64, f64),
    /// Its index among the prepared parts.
    pub(crate) part: usize,
    /// The index of its first key among the constants; [`NONE`] if the curve does not pass through
    /// its keys.
    pub(crate) first_key: u32,
    /// The index of its first key among the constants if the track's first and last interval are constant, else
    /// [`NONE`]; it is set even if the curve does not pass through its keys.
    pub(crate) first_still_key: u32,
}

impl TrackStretch {
    /// The lanes of its intervals.
    pub(crate) fn lanes(&self) -> Range<usize> {
        self.lane..self.lane + self.intervals.len()
    }

    /// The index of the constant at the start of its `i`th interval.
    pub(crate) fn key_at(&self, i: usize) -> u32 {
        match self.first_key {
            NONE => NONE,
            first => first + i as u32,
        }
    }

    /// The lane of the track's first interval, if the stretch contains it.
    pub(crate) fn first(&self) -> Option<usize> {
        (self.intervals.start == 0).then_some(self.lane)
    }

    /// The lane of the track's last interval, if the stretch contains it.
    pub(crate) fn last(&self) -> Option<usize> {
        (self.intervals.end == self.track_intervals).then_some(self.lane + self.intervals.len() - 1)
    }
}

/// A block of intervals.
pub(crate) struct Intervals {
    /// The keys at both ends, after sign continuation.
    pub(crate) from: [[f32; 4]; ROW_LEN],
    pub(crate) to: [[f32; 4]; ROW_LEN],
    /// Start, end and duration of each interval, in seconds.
    pub(crate) starts: RowF64,
    pub(crate) ends: RowF64,
    pub(crate) durations: RowF64,
    pub(crate) count: usize,
    /// `q_i⁻¹ q_{i+1}`.
    pub(crate) steps: [RowF64; 4],
    /// Its logarithm.
    pub(crate) logs: [RowF64; 3],
    /// Handles at the first key of the interval: in the interval before it, and in this one.
    pub(crate) incoming: [RowF64; 3],
    pub(crate) outgoing: [RowF64; 3],
    /// The method's numbers for the key at the interval's start, and (one lane further) for the key at its end.
    pub(crate) outward: [RowF64; 4],
    pub(crate) inward: [RowF64; 4],
    /// The numbers that the curve's formula takes.
    pub(crate) numbers: Vec<RowF64>,
    /// The squared extent of each curve: the sum of the squares of its half-rotation vectors.
    pub(crate) squared_extents: RowF64,
}

impl Intervals {
    /// An empty block, for curves whose formula takes `numbers` numbers that differ from curve to curve.
    pub(crate) fn new(numbers: usize) -> Self {
        let lane = [0.0; ROW_LEN];
        let identity = [0.0, 0.0, 0.0, 1.0];
        Self {
            from: [identity; ROW_LEN],
            to: [identity; ROW_LEN],
            starts: lane,
            ends: lane,
            durations: [1.0; ROW_LEN],
            count: 0,
            steps: [lane; 4],
            logs: [lane; 3],
            incoming: [lane; 3],
            outgoing: [lane; 3],
            outward: [lane; 4],
            inward: [lane; 4],
            numbers: vec![lane; numbers],
            squared_extents: lane,
        }
    }

    /// Adds some intervals of a track, with these signs of its keys; the block must have room for them.
    pub(crate) fn push(&mut self, track: Track, signs: Signs<'_>, intervals: Range<usize>) {
        let lanes = self.count..self.count + intervals.len();
        let Range { start, end } = intervals;
        let keys: &[[f32; 4]] = bytemuck::cast_slice(track.keys);
        signs.copy(keys, start..end, &mut self.from[lanes.clone()]);
        signs.copy(keys, start + 1..end + 1, &mut self.to[lanes.clone()]);
        let (starts, ends) = (&track.times[start..end], &track.times[start + 1..=end]);
        self.starts[lanes.clone()].copy_from_slice(starts);
        self.ends[lanes.clone()].copy_from_slice(ends);
        let durations = self.durations[lanes.clone()].iter_mut();
        for (duration, (start, end)) in durations.zip(starts.iter().zip(ends)) {
            *duration = end - start;
        }
        self.count = lanes.end;
    }

    /// Adds the keys and durations in some lanes of another block; this one must have room for
    /// them.
    pub(crate) fn push_from(&mut self, other: &Self, lanes: Range<usize>) {
        let added = self.count..self.count + lanes.len();
        self.from[added.clone()].copy_from_slice(&other.from[lanes.clone()]);
        self.to[added.clone()].copy_from_slice(&other.to[lanes.clone()]);
        self.durations[added.clone()].copy_from_slice(&other.durations[lanes]);
        self.count = added.end;
    }

    /// Adds an empty lane of context, where a track ends and has no neighbour.
    pub(crate) fn push_nothing(&mut self) {
        let lane = self.count;
        let identity = [0.0, 0.0, 0.0, 1.0];
        (self.from[lane], self.to[lane]) = (identity, identity);
        self.durations[lane] = 1.0;
        self.count += 1;
    }

    /// The change of the parameter per second.
    pub(crate) fn rate(&self, lane: usize) -> f64 {
        quaternion::ratio(1.0, self.durations[lane])
    }

    /// The key that the interval starts with.
    #[inline(always)]
    pub(crate) fn key(&self, lane: usize) -> Quaternion {
        quaternion::unit(self.from[lane])
    }

    /// The key that the interval ends with: the first key times the step.
    pub(crate) fn end_key(&self, lane: usize) -> Quaternion {
        quaternion::product(self.key(lane), at(&self.steps, lane))
    }

    /// Sets the numbers of the interval's curve.
    pub(crate) fn set_curve(&mut self, lane: usize, numbers: impl Into<FormulaNumbers>) {
        for (row, number) in self.numbers.iter_mut().zip(numbers.into()) {
            row[lane] = number;
        }
    }

    /// Sets the basis functions of an interval's [`Product`].
    pub(crate) fn set_basis(&mut self, lane: usize, basis: [[f64; 4]; 3]) {
        let rows = self.numbers[Product::BASIS..].iter_mut();
        for (row, number) in rows.zip(basis.into_iter().flatten()) {
            row[lane] = number;
        }
    }

    /// The number of lanes to compute, rounded up to vectors of eight. A wider vector writes past
    /// them, for which there is [`ROW_LEN`].
    #[inline(always)]
    pub(crate) fn padded_count(&self) -> usize {
        self.count.next_multiple_of(8).min(LANES)
    }

    /// As [`Intervals::padded_count`], for vectors of up to 16 f32.
    #[inline(always)]
    pub(crate) fn padded_count_f32(&self) -> usize {
        self.count.next_multiple_of(16).min(LANES)
    }
}

#[inline(always)]
pub(crate) fn at<const N: usize, const WIDTH: usize>(
    lanes: &[[f64; WIDTH]; N],
    lane: usize,
) -> [f64; N] {
    std::array::from_fn(|i| lanes[i][lane])
}

#[inline(always)]
pub(crate) fn put<const N: usize, const WIDTH: usize>(
    lanes: &mut [[f64; WIDTH]; N],
    lane: usize,
    value: [f64; N],
) {
    for (lanes, value) in lanes.iter_mut().zip(value) {
        lanes[lane] = value;
    }
}

/// The squared extent: the sum of the vectors' squares.
#[inline(always)]
pub(crate) fn squared_extent<N: Arithmetic>([a, b, c]: [[N; 3]; 3]) -> N {
    square(a) + square(b) + square(c)
}

/// The numbers of a vector's lanes from `lane` on.
#[inline(always)]
pub(crate) fn load<D: Doubles, const N: usize, const WIDTH: usize>(
    lanes: &[[f64; WIDTH]; N],
    lane: usize,
) -> [D; N] {
    // A loop: closures are not always inlined.
    let mut vectors = [D::all(0.0); N];
    for c in 0..N {
        vectors[c] = D::load(&lanes[c][lane..]);
    }
    vectors
}

#[inline(always)]
pub(crate) fn rounded<L: Lanes, const N: usize>(numbers: [L::Doubles; N]) -> [L; N] {
    let mut result = [L::all(0.0); N];
    for c in 0..N {
        result[c] = L::rounded(numbers[c]);
    }
    result
}

#[inline(always)]
pub(crate) fn widened<L: Lanes, const N: usize>(numbers: [L; N]) -> [L::Doubles; N] {
    let mut result = [L::Doubles::all(0.0); N];
    for c in 0..N {
        result[c] = numbers[c].widened();
    }
    result
}

/// Stores numbers to the lanes from `lane` on.
#[inline(always)]
pub(crate) fn store<D: Doubles, const N: usize, const WIDTH: usize>(
    lanes: &mut [[f64; WIDTH]; N],
    lane: usize,
    vectors: [D; N],
) {
    for c in 0..N {
        vectors[c].store(&mut lanes[c][lane..]);
    }
}
