//! Fits what is sampled along paths by the polynomials that the kernels evaluate, cut in two until
//! they do.

use bytemuck::Zeroable;

use crate::fit::double::fit::{self, MOST, TOLERANCE, coefficients};
use crate::fit::double::intervals::{at, load};
use crate::fit::nodes::FULL_NODES;
use crate::math::canonical::{power_of_two, round_quat};
use crate::math::quaternion::{Quaternion, Real, dot};
use crate::path::lanes::Row;
use crate::path::sample::{END, Kind, MIDDLE, PAIRS, START, Sampler, Samples, Span};
use crate::prepare::prepared::Prepared;
use crate::shader::{POWERS, PolynomialSegment};
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::{Doubles, Lanes, canonical};
use crate::threads::stop;
use crate::time::spans::Source;

/// How often a span is cut in two: what then does not fit is shorter than the resolution of time,
/// and its middle stands for it.
const MOST_CUTS: u32 = 44;

/// The most pieces of a span. A corner takes two for each cut; more are asked for only where rounding
/// leaves a curve no direction at all, and then the middle of each stands for it.
const MOST_PIECES: u32 = 4096;

/// The largest error at the ends of a span, where a polynomial through inner nodes errs most.
const LARGEST: f64 = 2.5e-7;

/// The part of the latest time that the rounding of times, and of lengths made of them, may hide.
const UNKNOWN: f64 = 64.0 * f64::EPSILON;

/// What gives the values of paths.
pub(crate) struct Fitted {
    /// Pieces of spans in order: the span's place in the list, when the piece starts, and what gives
    /// its values.
    pub(crate) pieces: Vec<(u32, f64, Source)>,
    /// The values at the start and at the end of each span of the list.
    pub(crate) ends: Vec<[Quaternion; 2]>,
}

/// A span, or a part of one, that waits to be fitted.
#[derive(Clone, Copy)]
struct Waiting {
    span: Span,
    /// The place of the whole span in the list.
    own: u32,
    cuts: u32,
}

/// Fits spans of paths, and adds their segments and constants to what is prepared.
pub(crate) fn fit(prepared: &mut Prepared, spans: &[Span], sampler: &mut Sampler<'_>) -> Fitted {
    let (paths, kind) = (sampler.paths, sampler.kind);
    let mut found = Fitted {
        pieces: Vec::with_capacity(2 * spans.len()),
        ends: vec![[[0.0; 4]; 2]; spans.len()],
    };
    let mut counts = vec![1u32; spans.len()];
    let whole = (0..spans.len()).rev().map(|own| Waiting {
        span: spans[own],
        own: own as u32,
        cuts: 0,
    });
    let mut waiting: Vec<Waiting> = whole.collect();
    prepared.segments.reserve(spans.len());
    let mut block: Vec<Waiting> = Vec::with_capacity(MOST);
    let mut own_spans: Vec<Span> = Vec::with_capacity(MOST);
    let mut lanes = Box::new(FittedLanes::zeroed());
    // Whoever prepares paths looks again when this is done.
    while !waiting.is_empty() && !stop::is_stopped() {
        block.clear();
        block.extend(waiting.drain(waiting.len().saturating_sub(MOST)..));
        own_spans.clear();
        own_spans.extend(block.iter().map(|own| own.span));
        let samples = sampler.sample(&own_spans);
        in_lanes(&mut InFit {
            count: block.len(),
            kind,
            samples,
            own: &mut lanes,
        });
        for (lane, own) in block.iter().enumerate() {
            let Waiting { span, cuts, .. } = *own;
            let place = own.own as usize;
            if cuts == 0 {
                found.ends[place] = [START, END].map(|end| at(&samples[end], lane));
            }
            let width = span.to - span.from;
            let middle = span.from + 0.5 * width;
            let is_finest = cuts == MOST_CUTS
                || counts[place] == MOST_PIECES
                || middle <= span.from
                || middle >= span.to;
            // A time is known within its own rounding, which is more of a shorter span.
            let (start, end) = paths[span.path as usize].route.span();
            let known = UNKNOWN * start.abs().max(end.abs()) / width;
            let source = if lanes.fits(lane, known) {
                let segments = &mut prepared.segments.polynomials;
                segments.push(lanes.segments[lane]);
                Source::Segment(segments.len() as u32 - 1)
            } else if is_finest {
                Source::Constant(prepared.constant(round_quat(at(&samples[MIDDLE], lane))))
            } else {
                counts[place] += 1;
                let (mut first, mut second) = (*own, *own);
                (first.span.to, second.span.from) = (middle, middle);
                for mut half in [second, first] {
                    half.cuts += 1;
                    waiting.push(half);
                }
                continue;
            };
            found.pieces.push((own.own, span.from, source));
        }
    }
    (found.pieces).sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    found
}

/// Polynomials through the samples of a block of spans.
#[derive(Zeroable)]
struct FittedLanes {
    segments: [PolynomialSegment; MOST],
    /// The powers of two near the largest values.
    units: [f32; MOST],
    /// Estimates of twice the truncation error, in units.
    tails: [f32; MOST],
    /// The errors at the ends.
    errors: Row,
    /// 1 where rotations turn too far for one polynomial, else 0.
    are_far: Row,
}

impl FittedLanes {
    /// Whether the polynomial of a lane is near its curve, of which this error cannot be known.
    fn fits(&self, lane: usize, known: f64) -> bool {
        self.are_far[lane] == 0.0
            && f64::from(self.tails[lane]) <= f64::from(TOLERANCE) + known
            && self.errors[lane] <= (LARGEST + known) * f64::from(self.units[lane])
    }
}

/// Fits a block of spans.
struct InFit<'a> {
    count: usize,
    kind: Kind,
    samples: &'a Samples,
    own: &'a mut FittedLanes,
}

impl InLanes for InFit<'_> {
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        let [zero, one] = [L::Doubles::all(0.0), L::Doubles::all(1.0)];
        self.own.units = [1.0; MOST];
        // The segment of each lane.
        let places: [usize; MOST] = std::array::from_fn(|lane| lane);
        for lane in (0..self.count).step_by(L::COUNT) {
            let middle = load::<L::Doubles, 4, _>(&self.samples[MIDDLE], lane);
            let mut values = [[zero; 4]; 2 * PAIRS];
            let mut is_far = zero;
            let mut largest = zero;
            for (value, samples) in values.iter_mut().zip(self.samples) {
                *value = load::<L::Doubles, 4, _>(samples, lane);
                if self.kind == Kind::Vector {
                    for c in 0..4 {
                        largest = magnitude(value[c]).larger(largest);
                    }
                    continue;
                }
                // Of both signs the one nearer to the middle.
                let cosine = dot(*value, middle);
                is_far = L::Doubles::all(FAR).up_to(magnitude(cosine), is_far, one);
                let sign = cosine.up_to(zero, -one, one);
                for c in 0..4 {
                    value[c] = value[c] * sign;
                }
            }
            is_far.store(&mut self.own.are_far[lane..]);
            let mut scales = [1.0; MOST];
            if self.kind == Kind::Vector {
                for c in 0..4 {
                    largest = magnitude(middle[c]).larger(largest);
                }
                largest.store(&mut scales);
                for (scale, unit) in scales.iter_mut().zip(&mut self.own.units[lane..]) {
                    let own = power_of_two(*scale);
                    // The inverse of a power of two is exact.
                    (*scale, *unit) = (1.0 / own, own as f32);
                }
            }
            let scale = L::Doubles::load(&scales);
            let mut numbers = fit::Samples::<L, PAIRS>::all(L::all(0.0));
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
            tails.store(&mut self.own.tails[lane..lane + L::COUNT]);
            let unit = L::load(&self.own.units[lane..]);
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
                    let own = L::Doubles::all(f64::MAX);
                    farthest = magnitude(found).up_to(own, farthest, one);
                }
                if self.kind == Kind::Rotation {
                    off = off.smaller(off_negated);
                }
                let infinite = L::Doubles::all(f64::INFINITY);
                error = farthest.up_to(zero, off, infinite).larger(error);
            }
            error.store(&mut self.own.errors[lane..]);
            let places = &places[lane..lane + L::COUNT];
            L::store_powers(&powers, &mut self.own.segments, places);
        }
    }
}

/// The cosine of half the largest turn from the middle that one polynomial may fit, and a bit more.
const FAR: f64 = 0.5f64.next_up();

#[inline(always)]
fn magnitude<R: Real>(number: R) -> R {
    number.larger(-number)
}
