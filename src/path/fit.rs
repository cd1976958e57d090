//! Fits what is sampled along a path by the polynomials that the kernels evaluate, cut in two until
//! they do.

use bytemuck::Zeroable;

use crate::fit::double::fit::{MOST, Samples, TOLERANCE, interpolate};
use crate::fit::nodes::FULL_NODES;
use crate::math::canonical::{canonical, round_quat};
use crate::path::lanes::Row;
use crate::prepare::prepared::Prepared;
use crate::shader::PolynomialSegment;
use crate::simd::dispatch::{InLanes, in_lanes};
use crate::simd::lanes::Lanes;
use crate::time::spans::{NONE, Source};

/// Pairs of nodes.
const PAIRS: usize = 5;

/// The places of a span's samples: its nodes, pair by pair, then its middle and its ends.
const MIDDLE: usize = 2 * PAIRS;
const START: usize = MIDDLE + 1;
const END: usize = MIDDLE + 2;

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

/// What is sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Unit quaternions of either sign.
    Rotation,
    /// Vectors of any length.
    Vector,
}

/// A part of a path's time, from one time to another, on one stretch.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub(crate) stretch: usize,
    pub(crate) from: f64,
    pub(crate) to: f64,
}

/// Gives the values on a stretch at some times: a row for each component.
pub(crate) type Sample<'a> = dyn Fn(usize, &Row) -> [Row; 4] + 'a;

/// The value on a stretch at one time.
pub(crate) fn value_at(sample: &Sample<'_>, stretch: usize, time: f64) -> [f64; 4] {
    sample(stretch, &[time; MOST]).map(|row| row[0])
}

/// Fits spans of a path, given in order, and adds them to what is prepared.
pub(crate) fn fit(prepared: &mut Prepared, spans: &[Span], kind: Kind, sample: &Sample<'_>) {
    let whole = spans.iter().enumerate().rev();
    let mut waiting: Vec<(Span, u32, usize)> = whole.map(|(i, &span)| (span, 0, i)).collect();
    let mut pieces = vec![1u32; spans.len()];
    let ends = [spans.first(), spans.last()].into_iter().flatten();
    let latest = ends.fold(0.0f64, |latest, span| {
        latest.max(span.from.abs()).max(span.to.abs())
    });
    let mut done: Vec<(f64, Source)> = Vec::with_capacity(spans.len());
    while !waiting.is_empty() {
        let block = waiting.split_off(waiting.len().saturating_sub(MOST));
        let segments = &mut prepared.segments.polynomials;
        let mut fitted = Fitted::new(kind, &block, sample, segments);
        in_lanes(&mut fitted);
        let Fitted {
            tails,
            samples,
            units,
            places,
            ..
        } = fitted;
        for (lane, &(span, cuts, own)) in block.iter().enumerate() {
            let segment = &mut segments[places[lane]];
            for own in &mut segment.coefficients {
                *own = own.map(|c| canonical(c * units[lane]));
            }
            let middle = span.from + 0.5 * (span.to - span.from);
            let is_finest = cuts == MOST_CUTS
                || pieces[own] == MOST_PIECES
                || middle <= span.from
                || middle >= span.to;
            // A time is known within its own rounding, which is more of a shorter span.
            let known = UNKNOWN * latest / (span.to - span.from);
            let is_smooth =
                samples.is_smooth[lane] && f64::from(tails[lane]) <= f64::from(TOLERANCE) + known;
            if is_smooth
                && ends_fit(
                    kind,
                    segment,
                    samples.ends[lane],
                    (LARGEST + known) * f64::from(units[lane]),
                )
            {
                done.push((span.from, Source::Segment(places[lane] as u32)));
            } else if is_finest {
                let value = round_quat(value_at(sample, span.stretch, middle));
                *segment = PolynomialSegment::zeroed();
                prepared.constants.push(value);
                done.push((
                    span.from,
                    Source::Constant(prepared.constants.len() as u32 - 1),
                ));
            } else {
                *segment = PolynomialSegment::zeroed();
                pieces[own] += 1;
                waiting.push((
                    Span {
                        from: middle,
                        ..span
                    },
                    cuts + 1,
                    own,
                ));
                waiting.push((Span { to: middle, ..span }, cuts + 1, own));
            }
        }
    }
    done.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (start, source) in done {
        prepared.push_span(start, source, NONE);
    }
}

/// Samples of curves in lanes, and what is made of them.
struct Fitted<'a> {
    count: usize,
    samples: Lane,
    units: [f32; MOST],
    places: [usize; MOST],
    tails: [f32; MOST],
    segments: &'a mut Vec<PolynomialSegment>,
}

struct Lane {
    numbers: Samples<[f32; MOST], PAIRS>,
    is_smooth: [bool; MOST],
    /// The values at the start and the end of each span.
    ends: [[[f64; 4]; 2]; MOST],
}

impl<'a> Fitted<'a> {
    fn new(
        kind: Kind,
        block: &[(Span, u32, usize)],
        sample: &Sample<'_>,
        segments: &'a mut Vec<PolynomialSegment>,
    ) -> Self {
        let first = segments.len();
        segments.resize(first + block.len(), PolynomialSegment::zeroed());
        let mut own = Self {
            count: block.len(),
            samples: Lane {
                numbers: Samples::all([0.0; MOST]),
                is_smooth: [true; MOST],
                ends: [[[0.0; 4]; 2]; MOST],
            },
            units: [1.0; MOST],
            places: std::array::from_fn(|lane| first + lane.min(block.len())),
            tails: [0.0; MOST],
            segments,
        };
        for (lane, (span, ..)) in block.iter().enumerate() {
            own.sample(kind, lane, *span, sample);
        }
        own
    }

    /// Samples a span in a unit near its largest value, a power of two.
    fn sample(&mut self, kind: Kind, lane: usize, span: Span, sample: &Sample<'_>) {
        let (from, width) = (span.from, span.to - span.from);
        let mut times = [span.to; MOST];
        times[START] = span.from;
        times[MIDDLE] = from + width * 0.5;
        for (k, node) in FULL_NODES.at.iter().enumerate() {
            for (side, s) in [-f64::from(*node), f64::from(*node)]
                .into_iter()
                .enumerate()
            {
                times[2 * k + side] = from + width * (0.5 + s);
            }
        }
        let rows = sample(span.stretch, &times);
        let value = |place: usize| rows.map(|row| row[place]);
        let between = value(MIDDLE);
        let mut is_smooth = true;
        let mut near = |value: [f64; 4]| {
            if kind == Kind::Vector {
                return value;
            }
            let cosine: f64 = value.iter().zip(between).map(|(a, b)| a * b).sum();
            is_smooth &= cosine.abs() > 0.5;
            if cosine < 0.0 {
                value.map(|c| -c)
            } else {
                value
            }
        };
        let pairs: [[[f64; 4]; 2]; PAIRS] =
            std::array::from_fn(|k| [2 * k, 2 * k + 1].map(|place| near(value(place))));
        let unit = match kind {
            Kind::Rotation => 1.0,
            Kind::Vector => {
                let all = pairs.as_flattened().as_flattened().iter().chain(&between);
                let largest = all.fold(0.0f64, |largest, c| largest.max(c.abs()));
                if largest > 1e-30 {
                    f64::from_bits(largest.to_bits() & (0x7ff << 52))
                } else {
                    1.0
                }
            }
        };
        // The unit is a power of two: its inverse is exact.
        let scale = 1.0 / unit;
        let Samples { middle, even, odd } = &mut self.samples.numbers;
        for c in 0..4 {
            middle[c][lane] = (between[c] * scale) as f32;
            for (k, [before, after]) in pairs.iter().enumerate() {
                let rise = (after[c] - between[c]) * scale;
                let fall = (before[c] - between[c]) * scale;
                even[k][c][lane] = (rise + fall) as f32;
                odd[k][c][lane] = (rise - fall) as f32;
            }
        }
        self.samples.is_smooth[lane] = is_smooth;
        self.samples.ends[lane] = [START, END].map(value);
        self.units[lane] = unit as f32;
    }
}

impl InLanes for Fitted<'_> {
    #[inline(always)]
    fn run<L: Lanes>(&mut self) {
        // The lanes of the last vector that have no curve write to one more segment.
        self.segments.push(PolynomialSegment::zeroed());
        for lane in (0..self.count).step_by(L::COUNT) {
            let mut places = [0; MOST];
            places[..L::COUNT].copy_from_slice(&self.places[lane..lane + L::COUNT]);
            let samples = self.samples.numbers.at::<L>(lane);
            let tails = interpolate(false, &FULL_NODES, &samples, &places, self.segments);
            tails.store(&mut self.tails[lane..lane + L::COUNT]);
        }
        self.segments.pop();
    }
}

/// Whether a polynomial is near the curve's values at both ends of its span.
fn ends_fit(kind: Kind, segment: &PolynomialSegment, ends: [[f64; 4]; 2], largest: f64) -> bool {
    [-0.5, 0.5].into_iter().zip(ends).all(|(s, expected)| {
        let found: [f64; 4] = std::array::from_fn(|c| {
            let powers = segment.coefficients.iter().rev();
            powers.fold(0.0, |sum, power| sum * s + f64::from(power[c]))
        });
        let off = |sign: f64| {
            let each = found
                .iter()
                .zip(expected)
                .map(|(a, b)| (a - sign * b).abs());
            each.fold(0.0f64, f64::max)
        };
        let least = if kind == Kind::Rotation {
            off(1.0).min(off(-1.0))
        } else {
            off(1.0)
        };
        least <= largest && found.iter().all(|c| c.is_finite())
    })
}
