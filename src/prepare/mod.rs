//! Keys to segments: the constants that the kernels read, computed once per clip; arcs in
//! f32 as a kernel could, curves in f64 and rounded once, those that turn moderately and know
//! their four keys mostly in f32. Independent of frame rate and
//! device, so the CPU and every Vulkan device evaluate the same segments.

pub(crate) mod arcs;
pub(crate) mod batch;
pub(crate) mod both_sides;
pub(crate) mod clip_data;
pub(crate) mod constant_velocity;
pub(crate) mod double;
pub(crate) mod error;
pub(crate) mod motion;
pub(crate) mod nodes;
pub(crate) mod preparation;
pub(crate) mod single;
pub(crate) mod steps;
pub(crate) mod tangent_weights;
pub(crate) mod vectors;

use crate::prepare::double::curve::Curve;
use std::ops::Range;

use crate::curve::segment::Segments;
use crate::method::interpolation::Interpolation;
use crate::time::frames::{FramesError, Timeline};
use crate::time::wrap::{Cycle, Sides};
use crate::tracks::set::Track;

/// No constant.
pub(crate) const NONE: u32 = u32::MAX;

/// Segments of some tracks, with what is needed to find the segment of a sample.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    pub(crate) segments: Segments,
    /// Rotations that are stored as they are: keys, end values.
    pub(crate) constants: Vec<[f32; 4]>,
    /// Curves too wild for the kernels.
    pub(crate) exact: Vec<Curve>,
    pub(crate) spans: Spans,
    pub(crate) parts: Vec<Part>,
    /// What lies outside the keys.
    pub(crate) sides: Sides,
}

/// Stretches of tracks' time, each from its start to the start of the next one.
/// Side by side, because the schedule is worked out for many at a time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans {
    /// Seconds.
    pub(crate) starts: Vec<f64>,
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
    pub(crate) track: u32,
    /// The first of its keys, in the track.
    pub(crate) first_key: u32,
    pub(crate) spans: Range<usize>,
    /// Where the last span ends, seconds.
    pub(crate) end: f64,
    /// The constant held before the first key; [`NONE`] when another part has it.
    pub(crate) before: u32,
    /// The constant held from the last key on; [`NONE`] when another part has it.
    pub(crate) after: u32,
    /// What else is at its ends, where that is more than two constants. Apart: a crowd has
    /// a million parts.
    pub(crate) beyond: Option<Box<Beyond>>,
}

/// What lies at a track's ends and outside its keys.
#[derive(Debug, Clone)]
pub(crate) struct Beyond {
    /// The constant at exactly the last key; [`NONE`] where it is what is held after it.
    pub(crate) at_end: u32,
    /// The exact curves that go on before the first key and behind the last, their
    /// parameter seconds from there; [`NONE`] where constants are held.
    pub(crate) from_before: u32,
    pub(crate) from_after: u32,
    /// When the whole track starts and ends, seconds.
    pub(crate) span: (f64, f64),
}

impl Beyond {
    pub(crate) fn new(times: &[f64]) -> Self {
        Self {
            at_end: NONE,
            from_before: NONE,
            from_after: NONE,
            span: (times[0], times[times.len() - 1]),
        }
    }
}

impl Part {
    /// What is at its ends, to be filled in.
    fn beyond(&mut self, times: (f64, f64)) -> &mut Beyond {
        let new = || Box::new(Beyond::new(&[times.0, times.1]));
        self.beyond.get_or_insert_with(new)
    }
}

impl Spans {
    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    /// Begins spans at these times, the first at this constant and the others at those behind
    /// it; their sources are to come.
    #[inline]
    fn begin(&mut self, starts: &[f64], key: u32) {
        self.starts.extend_from_slice(starts);
        match key {
            NONE => self.keys.resize(self.keys.len() + starts.len(), NONE),
            first => self.keys.extend(first..first + starts.len() as u32),
        }
    }

    /// Adds some of other spans.
    fn extend(&mut self, other: &Self, range: Range<usize>) {
        self.starts.extend_from_slice(&other.starts[range.clone()]);
        self.sources
            .extend_from_slice(&other.sources[range.clone()]);
        self.keys.extend_from_slice(&other.keys[range]);
    }

    fn reserve(&mut self, count: usize) {
        self.starts.reserve(count);
        self.sources.reserve(count);
        self.keys.reserve(count);
    }

    fn clear(&mut self) {
        self.starts.clear();
        self.sources.clear();
        self.keys.clear();
    }
}

impl Prepared {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            segments: Segments::new(interpolation.form()),
            constants: Vec::new(),
            exact: Vec::new(),
            spans: Spans::default(),
            parts: Vec::new(),
            sides: interpolation.sides(),
        }
    }

    /// Makes room for so many keys: to grow into it would copy it all over again.
    fn reserve(&mut self, keys: usize) {
        self.segments.reserve(keys);
        self.constants.reserve(keys);
        self.spans.reserve(keys);
    }

    /// Forgets everything and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.segments.clear();
        self.constants.clear();
        self.exact.clear();
        self.spans.clear();
        self.parts.clear();
    }

    /// Moves all of `other` behind its own.
    pub(crate) fn append(&mut self, other: Self) {
        let constants = self.constants.len() as u32;
        let segments = self.segments.len() as u32;
        let exact = self.exact.len() as u32;
        let spans = self.spans.len();
        let place = |own: u32, before: u32| match own {
            NONE => NONE,
            _ => own + before,
        };
        let shift = |constant: u32| place(constant, constants);
        let own = &mut self.spans;
        own.starts.extend(other.spans.starts);
        own.sources
            .extend(other.spans.sources.iter().map(|&source| match source {
                Source::Segment(i) => Source::Segment(i + segments),
                Source::Constant(i) => Source::Constant(shift(i)),
                Source::Exact(i) => Source::Exact(i + exact),
            }));
        own.keys.extend(other.spans.keys.into_iter().map(shift));
        self.parts.extend(other.parts.into_iter().map(|part| Part {
            spans: part.spans.start + spans..part.spans.end + spans,
            before: shift(part.before),
            after: shift(part.after),
            beyond: part.beyond.map(|beyond| {
                Box::new(Beyond {
                    at_end: shift(beyond.at_end),
                    from_before: place(beyond.from_before, exact),
                    from_after: place(beyond.from_after, exact),
                    ..*beyond
                })
            }),
            ..part
        }));
        self.segments.append(other.segments);
        self.constants.extend(other.constants);
        self.exact.extend(other.exact);
    }

    /// Frames of one of a part's spans cannot be counted: between which keys.
    #[cold]
    pub(crate) fn gap_too_long(&self, part: &Part, span: usize, rate: f64) -> FramesError {
        let Spans {
            starts,
            sources,
            keys,
        } = &self.spans;
        // What was cut starts at a key only with its first span; where curves do not meet
        // their keys that cannot be told.
        let meets_keys = keys[part.spans.clone()].iter().any(|&key| key != NONE);
        let is_at_key = |&span: &usize| {
            let stands = matches!(sources[span], Source::Constant(_));
            keys[span] != NONE || stands || !meets_keys
        };
        let until = part.spans.start..=span;
        let behind = until.clone().skip(1).filter(is_at_key).count();
        let from = until.rev().find(is_at_key).unwrap_or(span);
        let to = (span + 1..part.spans.end).find(is_at_key);
        FramesError::GapTooLong {
            track: part.track as usize,
            key: part.first_key as usize + behind,
            frames: (to.map_or(part.end, |to| starts[to]) - starts[from]) * rate,
        }
    }

    /// The copies of a part's track among some samples.
    pub(crate) fn cycles(
        &self,
        part: &Part,
        timeline: &Timeline,
        samples: Range<usize>,
    ) -> impl Iterator<Item = Cycle> {
        let span = part.beyond.as_ref().map(|beyond| beyond.span);
        self.sides.cycles(span, timeline, samples)
    }

    /// What a part needs from the start, where copies of its track are asked for.
    fn copies(&self, track: Track) -> Option<Box<Beyond>> {
        let new = || Box::new(Beyond::new(track.times));
        self.sides.repeats().then(new)
    }

    fn constant(&mut self, value: [f32; 4]) -> u32 {
        self.constants.push(value);
        self.constants.len() as u32 - 1
    }

    fn push_span(&mut self, start: f64, source: Source, key: u32) {
        self.spans.starts.push(start);
        self.spans.sources.push(source);
        self.spans.keys.push(key);
    }
}
