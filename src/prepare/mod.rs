//! Keys to segments: the constants that the kernels read, computed in f64 once per
//! clip and rounded once. Independent of frame rate and device, so the CPU and
//! every Vulkan device evaluate the same segments.

mod arcs;
mod clip_data;
mod set;

pub(crate) use arcs::ArcBlock;
pub(crate) use clip_data::{ClipData, PartRef};
pub(crate) use set::Preparation;

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

use glam::{DQuat, DVec3};

use crate::method::curve::Cumulative;
use crate::method::{Curve, Interpolation, Keys};
use crate::numeric::{dot, exp, norm3, product, round_f32, round_quat, unit};
use crate::segment::{ArcSegment, CumulativeSegment, Segments};
use crate::tracks::Track;

/// No constant.
pub(crate) const NONE: u32 = u32::MAX;

/// The polynomials of sine and cosine hold to pi/2; a little is left for the
/// rounding of the parameter.
const REACH: f64 = FRAC_PI_2 * (1.0 - 1e-6);

/// A cubic whose handles reach further is cut into up to this many pieces, each
/// with a middle of its own; beyond that (half-angles of dozens of radians within
/// one interval) its samples are computed on the host in f64, for every device.
const MAX_PIECES: usize = 16;

/// Segments of some tracks, with what is needed to find the segment of a sample.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    pub(crate) segments: Segments,
    /// Rotations that are stored as they are: keys, end values.
    pub(crate) constants: Vec<[f32; 4]>,
    /// Cubics too wild for the kernels.
    pub(crate) exact: Vec<Cumulative>,
    pub(crate) spans: Spans,
    pub(crate) parts: Vec<Part>,
}

/// Stretches of tracks' time, each from its start to the start of the next one.
/// Side by side, because the schedule is worked out for many at a time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans {
    /// Seconds.
    pub(crate) starts: Vec<f64>,
    /// What the kernel's parameter runs over, centred on zero: the arc's angle, or 1.
    pub(crate) extents: Vec<f64>,
    pub(crate) sources: Vec<Source>,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) keys: Vec<u32>,
}

/// What gives the rotations of a span: places in the lists of [`Prepared`].
#[derive(Debug, Clone, Copy)]
pub(crate) enum Source {
    Segment(u32),
    Constant(u32),
    Exact(u32),
}

/// Some consecutive key intervals of one track: all of them, unless the track is
/// so long that its segments are spread over several buffers.
#[derive(Debug, Clone)]
pub(crate) struct Part {
    /// The track's place in the set.
    pub(crate) track: usize,
    pub(crate) spans: Range<usize>,
    /// Where the last span ends, seconds.
    pub(crate) end: f64,
    /// The constant held before the first key; [`NONE`] when another part has it.
    pub(crate) before: u32,
    /// The constant held from the last key on; [`NONE`] when another part has it.
    pub(crate) after: u32,
}

impl Spans {
    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    fn clear(&mut self) {
        self.starts.clear();
        self.extents.clear();
        self.sources.clear();
        self.keys.clear();
    }

    fn reserve(&mut self, more: usize) {
        self.starts.reserve(more);
        self.extents.reserve(more);
        self.sources.reserve(more);
        self.keys.reserve(more);
    }
}

impl Prepared {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            segments: Segments::new(interpolation.method.form),
            constants: Vec::new(),
            exact: Vec::new(),
            spans: Spans::default(),
            parts: Vec::new(),
        }
    }

    /// Forgets everything and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.segments.clear();
        self.constants.clear();
        self.exact.clear();
        self.spans.clear();
        self.parts.clear();
    }

    /// Prepares some intervals of a track, the `index`th of its set.
    fn push(
        &mut self,
        track: Track,
        index: usize,
        keys: &Keys,
        intervals: Range<usize>,
        interpolation: &Interpolation,
    ) {
        let all = 0..keys.intervals();
        let first_span = self.spans.len();
        let first_key = self.constants.len() as u32;
        self.segments.reserve(intervals.len());
        self.spans.reserve(intervals.len());
        let stored = |i: usize| track.keys[i].to_array();

        // A curve that does not pass through its keys has end values of its own.
        let interpolates = interpolation.method.interpolates;
        if interpolates || all.is_empty() {
            self.constants
                .extend((intervals.start..=intervals.end).map(stored));
        }
        let key = |i: usize| {
            if interpolates {
                first_key + (i - intervals.start) as u32
            } else {
                NONE
            }
        };

        let (mut first, mut last) = (None, None);
        let mut i = intervals.start;
        let mut push_curve = |curve| {
            let times = track.times[i]..track.times[i + 1];
            if !interpolates {
                let held = keys.rotations[i];
                let first_value = || end_value(&curve, held, 0.0);
                first.get_or_insert_with(first_value);
                last = Some(end_value(&curve, held, 1.0));
            }
            match curve {
                Curve::Arc { from, to } => self.push_arc(times.start, from, to, key(i)),
                Curve::Cumulative(cubic) => self.push_cubic(times, &cubic, key(i)),
                Curve::Hold => {
                    let constant = if interpolates {
                        key(i)
                    } else {
                        self.constant(stored(i))
                    };
                    self.push_span(times.start, 0.0, Source::Constant(constant), NONE);
                }
            }
            i += 1;
        };
        if !intervals.is_empty() {
            (interpolation.method.curves)(keys, intervals.clone(), &mut push_curve);
        }

        let (before, after) = match (interpolates || all.is_empty(), first, last) {
            (true, ..) => (
                first_key,
                first_key + (intervals.end - intervals.start) as u32,
            ),
            (false, Some(first), Some(last)) => {
                let frozen = matches!(keys.ends, crate::Ends::Frozen);
                let last = if frozen {
                    keys.rotations[intervals.end]
                } else {
                    last
                };
                (
                    self.constant(round_quat(first)),
                    self.constant(round_quat(last)),
                )
            }
            _ => (NONE, NONE),
        };
        self.parts.push(Part {
            track: index,
            spans: first_span..self.spans.len(),
            end: track.times[intervals.end],
            before: if intervals.start == all.start {
                before
            } else {
                NONE
            },
            after: if intervals.end == all.end {
                after
            } else {
                NONE
            },
        });
    }

    /// Moves all of `other` behind its own.
    pub(crate) fn append(&mut self, other: Self) {
        let constants = self.constants.len() as u32;
        let segments = self.segments.len() as u32;
        let exact = self.exact.len() as u32;
        let spans = self.spans.len();
        let shift = |constant: u32| {
            if constant == NONE {
                NONE
            } else {
                constant + constants
            }
        };
        let own = &mut self.spans;
        own.starts.extend(other.spans.starts);
        own.extents.extend(other.spans.extents);
        own.sources
            .extend(other.spans.sources.iter().map(|source| match source {
                Source::Segment(i) => Source::Segment(i + segments),
                Source::Constant(i) => Source::Constant(i + constants),
                Source::Exact(i) => Source::Exact(i + exact),
            }));
        own.keys.extend(other.spans.keys.into_iter().map(shift));
        self.parts.extend(other.parts.into_iter().map(|part| Part {
            spans: part.spans.start + spans..part.spans.end + spans,
            before: shift(part.before),
            after: shift(part.after),
            ..part
        }));
        self.segments.append(other.segments);
        self.constants.extend(other.constants);
        self.exact.extend(other.exact);
    }

    fn constant(&mut self, value: [f32; 4]) -> u32 {
        self.constants.push(value);
        self.constants.len() as u32 - 1
    }

    fn push_span(&mut self, start: f64, extent: f64, source: Source, key: u32) {
        self.spans.starts.push(start);
        self.spans.extents.push(extent);
        self.spans.sources.push(source);
        self.spans.keys.push(key);
    }

    fn push_arc(&mut self, start: f64, from: DQuat, to: DQuat, key: u32) {
        let (sum, difference) = (to + from, to - from);
        let chord = dot(difference, difference).sqrt();
        // atan2, not acos: 9 % wrong at 0.001 rad in f32, and worse below.
        let angle = 2.0 * libm::atan2(chord, dot(sum, sum).sqrt());
        // Equal keys have no plane; with an angle of 0 any partner will do.
        let partner = if chord == 0.0 {
            [0.0; 4]
        } else {
            round_quat(difference * (1.0 / chord))
        };
        let Segments::Arc(segments) = &mut self.segments else {
            unreachable!("the method's form")
        };
        segments.push(ArcSegment {
            middle: round_quat(unit(sum)),
            partner,
        });
        let source = Source::Segment(segments.len() as u32 - 1);
        self.push_span(start, angle, source, key);
    }

    fn push_cubic(&mut self, times: Range<f64>, cubic: &Cumulative, key: u32) {
        let mut pieces = 1;
        while (0..pieces).any(|piece| cubic.reach(piece, pieces) > REACH) {
            pieces *= 2;
            if pieces > MAX_PIECES {
                self.exact.push(*cubic);
                let source = Source::Exact(self.exact.len() as u32 - 1);
                return self.push_span(times.start, 1.0, source, key);
            }
        }
        for piece in 0..pieces {
            let Segments::Cumulative(segments) = &mut self.segments else {
                unreachable!("the method's form")
            };
            segments.push(cumulative_segment(cubic, piece, pieces));
            let source = Source::Segment(segments.len() as u32 - 1);
            let start = times.start + (times.end - times.start) * (piece as f64 / pieces as f64);
            self.push_span(start, 1.0, source, if piece == 0 { key } else { NONE });
        }
    }
}

fn end_value(curve: &Curve, held: DQuat, t: f64) -> DQuat {
    match curve {
        Curve::Arc { from, to } => {
            if t < 0.5 {
                *from
            } else {
                *to
            }
        }
        Curve::Cumulative(cubic) => unit(cubic.rotation(t)),
        Curve::Hold => held,
    }
}

/// The `piece`th of `pieces` equal parts of a cubic, about its middle: there all
/// three angles are zero, and the rotations reached are folded into the terms.
fn cumulative_segment(cubic: &Cumulative, piece: usize, pieces: usize) -> CumulativeSegment {
    let width = 1.0 / pieces as f64;
    let middle = (piece as f64 + 0.5) * width;
    let mut terms = [unit(cubic.base); 8];
    let mut powers = [[0.0; 4]; 3];
    for (j, &vector) in cubic.vectors.iter().enumerate() {
        let angle = norm3(vector);
        let axis = if angle == 0.0 {
            DVec3::ZERO
        } else {
            vector / angle
        };
        let axis = DQuat::from_xyzw(axis.x, axis.y, axis.z, 0.0);
        let reached = exp(vector * cubic.weight(j, middle));
        // Each rotation doubles the terms: with its cosine, and with its sine.
        for i in (0..1 << j).rev() {
            let cosine = product(terms[i], reached);
            (terms[2 * i], terms[2 * i + 1]) = (cosine, product(cosine, axis));
        }
        // B_j(middle + s width) - B_j(middle), in powers of s.
        let [_, c1, c2, c3] = cubic.basis[j];
        let slope = (3.0 * c3 * middle + 2.0 * c2) * middle + c1;
        powers[0][j] = angle * slope * width;
        powers[1][j] = angle * (3.0 * c3 * middle + c2) * width * width;
        powers[2][j] = angle * c3 * width * width * width;
    }
    let [linear, quadratic, cubic] = powers.map(|power| power.map(round_f32));
    CumulativeSegment {
        terms: terms.map(round_quat),
        linear,
        quadratic,
        cubic,
    }
}
