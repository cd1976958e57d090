//! Where in time the segments of prepared tracks lie.

use std::collections::TryReserveError;
use std::ops::Range;

use crate::time::frames::FramesError;

/// In the place of an index: there is nothing.
pub(crate) const NONE: u32 = u32::MAX;

/// Spans of tracks' time, each from its start to the start of the next one. Each field has a list
/// of its own, because many spans are met with the samples at once, in vector lanes.
#[derive(Debug, Clone, Default)]
pub(crate) struct Spans {
    /// Seconds.
    pub(crate) starts: Vec<f64>,
    pub(crate) sources: Vec<Source>,
    /// The constant to store at exactly the start, or [`NONE`].
    pub(crate) keys: Vec<u32>,
    /// Whether keys are held until the next one.
    pub(crate) steps: bool,
}

/// What gives the rotations of a span: indices in the lists of `Prepared`.
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
    /// The index of its first key in the track.
    pub(crate) first_key: u32,
    pub(crate) spans: Range<usize>,
    /// Where the last span ends, seconds.
    pub(crate) end: f64,
    /// The constant held before the first key; [`NONE`] when another part has it.
    pub(crate) before: u32,
    /// The constant held from the last key on; [`NONE`] when another part has it.
    pub(crate) after: u32,
    /// What its ends need beyond these two constants, which is rare. Boxed, because a crowd has a
    /// million parts.
    pub(crate) beyond: Option<Box<Beyond>>,
}

/// What lies at a track's ends and outside its keys.
#[derive(Debug, Clone)]
pub(crate) struct Beyond {
    /// The constant at exactly the last key; [`NONE`] if the one held after it serves there too.
    pub(crate) at_end: u32,
    /// The curves, evaluated in f64, that extrapolate before the first key and after the last.
    /// Their parameter is seconds from that key; [`NONE`] where constants are held.
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
    /// The constant at exactly the last key, and the curves that extrapolate before the first key
    /// and after the last; [`NONE`] for what there is not.
    #[inline]
    pub(crate) fn at_ends(&self) -> [u32; 3] {
        (self.beyond.as_ref()).map_or([NONE; 3], |beyond| {
            [beyond.at_end, beyond.from_before, beyond.from_after]
        })
    }

    /// Whether its track starts with it, and whether it ends with it; `begin` is when its first span
    /// starts. Both for a track without [`Beyond`], which has one part or is not repeated.
    pub(crate) fn is_at_ends(&self, begin: f64) -> [bool; 2] {
        let span = self.beyond.as_ref().map(|beyond| beyond.span);
        span.map_or([true; 2], |(first, last)| {
            [begin <= first, self.end >= last]
        })
    }

    /// Its [`Beyond`], which is created if it has none. `times` are when the whole track starts and
    /// ends, seconds.
    pub(crate) fn beyond(&mut self, times: (f64, f64)) -> &mut Beyond {
        let new = || Box::new(Beyond::new(&[times.0, times.1]));
        self.beyond.get_or_insert_with(new)
    }
}

impl Spans {
    pub(crate) fn len(&self) -> usize {
        self.starts.len()
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        self.starts.reserve(count);
        self.sources.reserve(count);
        self.keys.reserve(count);
    }

    pub(crate) fn try_reserve(&mut self, count: usize) -> Result<(), TryReserveError> {
        self.starts.try_reserve(count)?;
        self.sources.try_reserve(count)?;
        self.keys.try_reserve(count)
    }

    pub(crate) fn clear(&mut self) {
        self.starts.clear();
        self.sources.clear();
        self.keys.clear();
    }

    /// Adds a range of others.
    pub(crate) fn extend_from(&mut self, others: &Self, range: Range<usize>) {
        self.starts.extend_from_slice(&others.starts[range.clone()]);
        self.sources
            .extend_from_slice(&others.sources[range.clone()]);
        self.keys.extend_from_slice(&others.keys[range]);
    }

    /// The error for a part's span with too many frames to count, with the keys around it.
    #[cold]
    pub(crate) fn gap_too_long(&self, part: &Part, span: usize, rate: f64) -> FramesError {
        let (starts, keys) = (&self.starts, &self.keys);
        // An interval may be cut into several spans, and only the first of them starts at a key.
        // Curves that do not meet their keys do not show it: there each span counts as an interval.
        let meets_keys = keys[part.spans.clone()].iter().any(|&key| key != NONE);
        let is_at_key = |&span: &usize| {
            let stands = matches!(self.sources[span], Source::Constant(_));
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
}
