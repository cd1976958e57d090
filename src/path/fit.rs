//! Fitting of samples along paths by the polynomials that the kernels evaluate; spans are divided into two until they
//! fit.

use bytemuck::Zeroable;

use crate::fit::block::{at, load};
use crate::fit::exact::fit::TOLERANCE;
use crate::fit::nodes::{FULL_NODES, NodeSamples, coefficients};
use crate::math::canonical::power_of_two;
use crate::math::quaternion::{Quaternion, Real, dot, round_quat};
use crate::path::lanes::LaneValues;
use crate::path::sample::{END, MIDDLE, PAIRS, START, SampleKind, Sampler, Span, SpanSamples};
use crate::prepare::prepared::Prepared;
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::doubles::Doubles;
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::threads::stop;
use crate::time::spans::SpanSource;

/// The maximum number of times that a span is divided. A part that does not fit even then is shorter than the
/// resolution of time; the value at its middle is used for the whole part.
const MAX_CUTS: u32 = 44;

/// The maximum number of pieces of a span. A corner takes two for each division. More are needed only if rounding
/// leaves a curve without a direction; then the value at each piece's middle is used.
const MAX_PIECES: u32 = 4096;

/// The largest error at the ends of a span, where a polynomial through inner nodes errs most.
const MAX_END_ERROR: f64 = 2.5e-7;

/// The fraction of the latest time that the rounding of times, and of lengths computed from them, may hide.
const TIME_ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Segments and constants that give the values of paths.
pub(crate) struct Fitted {
    /// Pieces of spans in order: the span's index in the list, the start of the piece, and the source of its values.
    pub(crate) pieces: Vec<(u32, f64, SpanSource)>,
    /// The values at the start and at the end of each span of the list.
    pub(crate) ends: Vec<[Quaternion; 2]>,
}

/// A span, or a part of one, that waits to be fitted.
#[derive(Clone, Copy)]
struct PendingSpan {
    span: Span,
    /// The index of the whole span in the list.
    index: u32,
    cuts: u32,
}

/// Fits spans of paths, and adds their segments and constants to `prepared`.
pub(crate) fn fit(prepared: &mut Prepared, spans: &[Span], sampler: &mut Sampler<'_>) -> Fitted {
    let (bodies, kind) = (sampler.bodies, sampler.kind);
    let mut found = Fitted {
        pieces: Vec::with_capacity(2 * spans.len()),
        ends: vec![[[0.0; 4]; 2]; spans.len()],
    };
    let mut counts = vec![1u32; spans.len()];
    let whole = (0..spans.len()).rev().map(|i| PendingSpan {
        span: spans[i],
        index: i as u32,
        cuts: 0,
    });
    let mut waiting: Vec<PendingSpan> = whole.collect();
    prepared.segments.reserve(spans.len());
    let mut block: Vec<PendingSpan> = Vec::with_capacity(MAX_LANES);
    let mut block_spans: Vec<Span> = Vec::with_capacity(MAX_LANES);
    let mut lanes = Box::new(FittedLanes::zeroed());
    // If the work was stopped, the caller notices it after this function has returned.
    while !waiting.is_empty() && !stop::is_stopped() {
        block.clear();
        block.extend(waiting.drain(waiting.len().saturating_sub(MAX_LANES)..));
        block_spans.clear();
        block_spans.extend(block.iter().map(|pending| pending.span));
        let samples = sampler.sample(&block_spans);
        in_lanes(&mut InFit {
            count: block.len(),
            kind,
            samples,
            lanes: &mut lanes,
        });
        for (lane, pending) in block.iter().enumerate() {
            let PendingSpan { span, cuts, .. } = *pending;
            let index = pending.index as usize;
            if cuts == 0 {
                found.ends[index] = [START, END].map(|end| at(&samples[end], lane));
            }
            let width = span.to - span.from;
            let middle = span.from + 0.5 * width;
            let is_finest = cuts == MAX_CUTS
                || counts[index] == MAX_PIECES
                || middle <= span.from
                || middle >= span.to;
            // Times are rounded, and the rounding is relatively larger in short spans.
            let (start, end) = bodies[span.path as usize].timed_path.span();
            let hidden_error = TIME_ROUNDING * start.abs().max(end.abs()) / width;
            let source = if lanes.fits(lane, hidden_error) {
                let segments = &mut prepared.segments.polynomials;
                segments.push(lanes.segments[lane]);
                SpanSource::Segment(segments.len() as u32 - 1)
            } else if is_finest {
                SpanSource::Constant(prepared.constant(round_quat(at(&samples[MIDDLE], lane))))
            } else {
                counts[index] += 1;
                let (mut first, mut second) = (*pending, *pending);
                (first.span.to, second.span.from) = (middle, middle);
                for mut half in [second, first] {
                    half.cuts += 1;
                    waiting.push(half);
                }
                continue;
            };
            found.pieces.push((pending.index, span.from, source));
        }
    }
    (found.pieces).sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    found
}

/// Polynomials through the samples of a block of spans.
#[derive(Zeroable)]
struct FittedLanes {
    segments: [PolynomialSegment; MAX_LANES],
    /// The powers of two near the largest values.
    units: [f32; MAX_LANES],
    /// Estimates of twice the truncation error, in units.
    tails: [f32; MAX_LANES],
    /// The errors at the ends.
    errors: LaneValues,
    /// 1 where rotations are too long for one polynomial, else 0.
    are_too_long: LaneValues,
}

impl FittedLanes {
    /// Whether the polynomial of a lane is near to its curve, with this error allowed for the rounding of times.
    fn fits(&self, lane: usize, hidden_error: f64) -> bool {
        self.are_too_long[lane] == 0.0
            && f64::from(self.tails[lane]) <= f64::from(TOLERANCE) + hidden_error
            && self.errors[lane] <= (MAX_END_ERROR + hidden_error) * f64::from(self.units[lane])
    }
}

/// Fits a block of spans.
struct InFit<'a> {
    count: usize,
    kind: SampleKind,
    samples: &'a SpanSamples,
    lanes: &'a mut FittedLanes,
}

impl InLanes for InFit<'_> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one] = [L::Doubles::all(0.0), L::Doubles::all(1.0)];
        self.lanes.units = [1.0; MAX_LANES];
        // The segment of each lane has the lane's number.
        let segment_indices: [usize; MAX_LANES] = std::array::from_fn(|lane| lane);
        for lane in (0..self.count).step_by(L::COUNT) {
            let middle = load::<L::Doubles, 4, _>(&self.samples[MIDDLE], lane);
            let mut values = [[zero; 4]; 2 * PAIRS];
            let mut is_too_long = zero;
            let mut largest = zero;
            for (value, samples) in values.iter_mut().zip(self.samples) {
                *value = load::<L::Doubles, 4, _>(samples, lane);
                if self.kind == SampleKind::Vector {
                    for c in 0..4 {
                        largest = magnitude(value[c]).larger(largest);
                    }
                    continue;
                }
                // Choose the sign that is nearer to the middle.
                let cosine = dot(*value, middle);
                is_too_long = L::Doubles::all(MIN_HALF_ANGLE_COSINE).up_to(
                    magnitude(cosine),
                    is_too_long,
                    one,
                );
                let sign = cosine.up_to(zero, -one, one);
                for c in 0..4 {
                    value[c] = value[c] * sign;
                }
            }
            is_too_long.store(&mut self.lanes.are_too_long[lane..]);
            let mut scales = [1.0; MAX_LANES];
            if self.kind == SampleKind::Vector {
                for c in 0..4 {
                    largest = magnitude(middle[c]).larger(largest);
                }
                largest.store(&mut scales);
                for (scale, unit) in scales.iter_mut().zip(&mut self.lanes.units[lane..]) {
                    let rounded = power_of_two(*scale);
                    // The inverse of a power of two is exact.
                    (*scale, *unit) = (1.0 / rounded, rounded as f32);
                }
            }
            let scale = L::Doubles::load(&scales);
            let mut numbers = NodeSamples::<L, PAIRS>::all(L::all(0.0));
            for c in 0..4 {
                numbers.middle[c] = L::rounded(middle[c] * scale);
                for k in 0..PAIRS {
                    let forward = (values[2 * k + 1][c] - middle[c]) * scale;
                    let backward = (values[2 * k][c] - middle[c]) * scale;
                    numbers.even[k][c] = L::rounded(forward + backward);
                    numbers.odd[k][c] = L::rounded(forward - backward);
                }
            }
            let mut powers = [[L::all(0.0); 4]; POWERS];
            let tails = coefficients(false, &FULL_NODES, &numbers, &mut powers);
            tails.store(&mut self.lanes.tails[lane..lane + L::COUNT]);
            let unit = L::load(&self.lanes.units[lane..]);
            for power in &mut powers {
                for c in 0..4 {
                    power[c] = power[c] * unit;
                }
                *power = canonical(*power);
            }
            let mut error = zero;
            for (s, end) in [(-0.5, START), (0.5, END)] {
                let expected = load::<L::Doubles, 4, _>(&self.samples[end], lane);
                let (mut off, mut off_negated, mut farthest) = (zero, zero, zero);
                for c in 0..4 {
                    let mut found = zero;
                    for power in powers.iter().rev() {
                        found = found * L::Doubles::all(s) + power[c].widened();
                    }
                    off = magnitude(found - expected[c]).larger(off);
                    off_negated = magnitude(found + expected[c]).larger(off_negated);
                    let limit = L::Doubles::all(f64::MAX);
                    farthest = magnitude(found).up_to(limit, farthest, one);
                }
                if self.kind == SampleKind::Rotation {
                    off = off.smaller(off_negated);
                }
                let infinite = L::Doubles::all(f64::INFINITY);
                error = farthest.up_to(zero, off, infinite).larger(error);
            }
            error.store(&mut self.lanes.errors[lane..]);
            let indices = &segment_indices[lane..lane + L::COUNT];
            L::store_powers(&powers, &mut self.lanes.segments, indices);
        }
    }
}

/// The cosine of half the largest angle from the middle that one polynomial may fit, and a bit more.
const MIN_HALF_ANGLE_COSINE: f64 = 0.5f64.next_up();

#[inline(always)]
fn magnitude<R: Real>(number: R) -> R {
    number.larger(-number)
}
