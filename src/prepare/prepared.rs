//! Prepared tracks: their segments and constants, and the spans of time to which these belong.

use std::collections::TryReserveError;
use std::ops::Range;

use bytemuck::{TransparentWrapper as _, Zeroable};

use crate::fit::block::LANES;
use crate::fit::exact::cut::Cutter;
use crate::fit::exact::fit::IntervalCurve;
use crate::math::quaternion::round_quat;
use crate::memory::OutOfMemoryError;
use crate::method::interpolation::Interpolation;
use crate::prepare::packed::{PackedSegments, pack};
use crate::shader::{ArcSegment, Form, PolynomialSegment};
use crate::time::frames::{Ticks, Timeline};
use crate::time::runs::{NONE, Parameter};
use crate::time::spans::{
    SOURCE_INDEX, SpanSource, Spans, StoredSource, TrackExtension, TrackPart,
};
use crate::time::wrap::Wrap;
use crate::tracks::error::LATEST;
use crate::tracks::signs::SignBits;
use crate::twin::Evaluate as _;

/// Segments of some tracks, with the tables by which the segment of a sample is found.
pub(crate) struct Prepared {
    pub(crate) segments: Segments,
    /// Rotations that are stored without a curve: keys and end values.
    pub(crate) constants: Vec<[f32; 4]>,
    /// Curves that the host evaluates in f64: pieces that no polynomial fits, and the continuation
    /// of tracks outside their keys.
    pub(crate) exact: Vec<IntervalCurve>,
    pub(crate) spans: Spans,
    pub(crate) parts: Vec<TrackPart>,
    /// The wrap modes before the first key and after the last.
    pub(crate) wrap: Wrap,
}

/// Segments after the last one, which lanes without a curve write while others are fitted.
pub(crate) const SPARE_SEGMENTS: usize = 2;

/// The purpose in [`OutOfMemoryError`].
pub(crate) const SEGMENTS: &str = "the segments of a set";

/// The destination of a curve: its span, and the span's segment.
#[derive(Debug, Clone, Copy, Zeroable)]
pub(crate) struct CurveSlot {
    pub(crate) span: usize,
    pub(crate) segment: usize,
}

/// Zero segments, two for each lane of a block. They are copied, which is faster than clearing segments one by one.
static ZEROS: [PolynomialSegment; 2 * LANES] = [PolynomialSegment {
    coefficients: [[0.0; 4]; 11],
}; 2 * LANES];

impl Prepared {
    pub(crate) fn new(interpolation: &Interpolation) -> Self {
        Self {
            segments: Segments::new(interpolation.form()),
            constants: Vec::new(),
            exact: Vec::new(),
            spans: Spans {
                steps: interpolation.steps(),
                ..Spans::default()
            },
            parts: Vec::new(),
            wrap: interpolation.wrap(),
        }
    }

    /// Reserves memory for this number of keys. Otherwise the lists would be copied as they grow, and could take twice
    /// the memory. Lists that are used again grow only by the missing keys, not to twice their length.
    pub(crate) fn reserve(&mut self, keys: usize) -> Result<(), OutOfMemoryError> {
        let bytes = segment_size(self.segments.form) + size_of::<[f32; 4]>();
        let too_many = || OutOfMemoryError::new::<u8>(SEGMENTS, keys.saturating_mul(bytes));
        // Half of the indices that a span has room for: the rest is for curves that are divided.
        if keys > SOURCE_INDEX as usize / 2 {
            return Err(too_many());
        }
        let refused = |_| too_many();
        let segments = keys.saturating_add(SPARE_SEGMENTS);
        self.segments.try_reserve_exact(segments).map_err(refused)?;
        self.constants.try_reserve_exact(keys).map_err(refused)?;
        self.spans.try_reserve_exact(keys).map_err(refused)
    }

    /// Removes the data that only whole tracks need. The curves and their spans remain, in no more memory than they
    /// need.
    pub(crate) fn keep_curves(&mut self) {
        if !(self.spans.sources.iter())
            .any(|source| matches!(source.source(), SpanSource::Constant(_)))
        {
            self.constants = Vec::new();
        }
        (self.spans.keys, self.parts) = (Vec::new(), Vec::new());
        self.spans.starts.shrink_to_fit();
        self.spans.sources.shrink_to_fit();
        self.segments.polynomials.shrink_to_fit();
        self.exact.shrink_to_fit();
    }

    /// Packs its polynomials, if it has any.
    pub(crate) fn pack(&mut self) {
        let Segments {
            polynomials,
            packed,
            ..
        } = &mut self.segments;
        *packed = pack(polynomials, &mut self.spans.sources);
    }

    /// Bytes of its lists.
    pub(crate) fn bytes(&self) -> usize {
        let Segments {
            arcs,
            intervals,
            polynomials,
            packed,
            ..
        } = &self.segments;
        let Spans {
            starts,
            sources,
            keys,
            ..
        } = &self.spans;
        size_of_val(&arcs[..])
            + size_of_val(&intervals[..])
            + size_of_val(&polynomials[..])
            + size_of_val(&packed[..])
            + size_of_val(&self.constants[..])
            + size_of_val(&self.exact[..])
            + size_of_val(&starts[..])
            + size_of_val(&sources[..])
            + size_of_val(&keys[..])
            + size_of_val(&self.parts[..])
    }

    /// Removes everything and keeps the memory.
    pub(crate) fn clear(&mut self) {
        self.segments.arcs.clear();
        self.segments.intervals.clear();
        self.segments.polynomials.clear();
        self.segments.packed.clear();
        self.constants.clear();
        self.exact.clear();
        self.spans.clear();
        self.parts.clear();
    }

    /// Merges all groups, of which none is packed, into the first, with memory reserved for all at once; `None` if there are no groups.
    pub(crate) fn together(groups: Vec<Self>) -> Option<Self> {
        let total = |count: fn(&Self) -> usize| groups.iter().skip(1).map(count).sum();
        let [segments, constants, exact, spans, parts]: [usize; 5] = [
            total(|group| group.segments.len()),
            total(|group| group.constants.len()),
            total(|group| group.exact.len()),
            total(|group| group.spans.starts.len()),
            total(|group| group.parts.len()),
        ];
        let mut groups = groups.into_iter();
        let mut first = groups.next()?;
        first.segments.reserve_exact(segments);
        first.constants.reserve_exact(constants);
        first.exact.reserve_exact(exact);
        first.spans.reserve_exact(spans);
        first.parts.reserve_exact(parts);
        for group in groups {
            first.append(group);
        }
        Some(first)
    }

    /// Appends all of `other`.
    fn append(&mut self, other: Self) {
        let constants = self.constants.len() as u32;
        let segments = self.segments.len() as u32;
        let exact = self.exact.len() as u32;
        let spans = self.spans.len();
        let shifted = |index: u32, before: u32| match index {
            NONE => NONE,
            _ => index + before,
        };
        let shift = |constant: u32| shifted(constant, constants);
        let target = &mut self.spans;
        target.starts.extend(other.spans.starts);
        target
            .sources
            .extend(other.spans.sources.iter().map(|stored| {
                StoredSource::from(match stored.source() {
                    SpanSource::Segment(i) => SpanSource::Segment(i + segments),
                    SpanSource::Constant(i) => SpanSource::Constant(shift(i)),
                    SpanSource::Exact(i) => SpanSource::Exact(i + exact),
                })
            }));
        target.keys.extend(other.spans.keys.into_iter().map(shift));
        self.parts
            .extend(other.parts.into_iter().map(|part| TrackPart {
                spans: part.spans.start + spans..part.spans.end + spans,
                before: shift(part.before),
                after: shift(part.after),
                extension: part.extension.map(|extension| {
                    Box::new(TrackExtension {
                        at_end: shift(extension.at_end),
                        from_before: shifted(extension.from_before, exact),
                        from_after: shifted(extension.from_after, exact),
                        ..*extension
                    })
                }),
                ..part
            }));
        self.segments.arcs.extend(other.segments.arcs);
        // The index cannot overflow, because a device's buffer has fewer keys.
        let intervals = other.segments.intervals.into_iter();
        (self.segments.intervals).extend(intervals.map(|interval| interval + constants));
        let polynomials = other.segments.polynomials;
        self.segments.polynomials.extend(polynomials);
        self.constants.extend(other.constants);
        self.exact.extend(other.exact);
    }

    /// Whether a part has one segment for each interval, passes through its keys, which are constants in order, and is
    /// held outside them: then samples are found by the interval's index alone.
    pub(crate) fn is_regular(&self, part: &TrackPart) -> bool {
        let sources = &self.spans.sources[part.spans.clone()];
        let keys = &self.spans.keys[part.spans.clone()];
        let are_segments =
            (sources.iter()).all(|stored| matches!(stored.source(), SpanSource::Segment(_)));
        let are_keys = keys.iter().zip(part.before..).all(|(&key, at)| key == at);
        let last = part.before.checked_add(part.spans.len() as u32);
        part.extension.is_none()
            && !part.spans.is_empty()
            && !self.spans.steps
            && are_segments
            && are_keys
            && last == Some(part.after)
    }

    /// The keys of a regular part, as they were added.
    pub(crate) fn keys_of(&self, part: &TrackPart) -> &[[f32; 4]] {
        &self.constants[part.before as usize..=part.after as usize]
    }

    /// Whether the keys of a regular part keep their signs on the shortest path.
    pub(crate) fn has_signs_kept(&self, part: &TrackPart) -> bool {
        SignBits::are_kept(self.keys_of(part))
    }

    /// The value of a sample by the `index`th curve of `exact`, evaluated in f64.
    pub(crate) fn exact(
        &self,
        index: u32,
        parameter: Parameter,
        timeline: &Timeline,
        track: usize,
        sample: usize,
    ) -> [f32; 4] {
        let at = match &timeline.ticks {
            Ticks::Frames { .. } => sample as f64,
            Ticks::Times { .. } => {
                return self.exact_at_time(index, parameter, timeline.time_at(track, sample));
            }
        };
        round_quat(self.exact[index as usize].value(parameter.at(at)))
    }

    /// The value at an explicit time by the `index`th curve of `exact`, evaluated in f64.
    pub(crate) fn exact_at_time(&self, index: u32, parameter: Parameter, time: f64) -> [f32; 4] {
        // At times beyond those allowed for keys, a curve's powers would overflow.
        let at = time.clamp(-LATEST, LATEST);
        round_quat(self.exact[index as usize].value(parameter.at(at)))
    }

    /// Adds a part: these intervals of a track with keys at these times, the track `index` of its set, with these
    /// spans. The values held before and after the keys are constants; they are used only if the intervals reach the
    /// first or the last key.
    pub(crate) fn push_part(
        &mut self,
        index: usize,
        times: &[f64],
        intervals: &Range<usize>,
        spans: Range<usize>,
        [before, after]: [u32; 2],
    ) {
        let is_last = intervals.end + 1 == times.len();
        let new_extension = || Box::new(TrackExtension::new(times));
        self.parts.push(TrackPart {
            track: index as u32,
            first_key: intervals.start as u32,
            spans,
            end: times[intervals.end],
            before: if intervals.start == 0 { before } else { NONE },
            after: if is_last { after } else { NONE },
            extension: self.wrap.repeats().then(new_extension),
        });
    }

    pub(crate) fn constant(&mut self, value: [f32; 4]) -> u32 {
        self.constants.push(value);
        self.constants.len() as u32 - 1
    }

    /// Adds a span with a new segment.
    #[inline]
    pub(crate) fn push_segment(
        &mut self,
        start: f64,
        segment: PolynomialSegment,
        key: u32,
    ) -> CurveSlot {
        let slot = self.next_slot();
        self.segments.polynomials.push(segment);
        self.push_span(start, SpanSource::Segment(slot.segment as u32), key);
        slot
    }

    /// The slot of the next span with a new segment.
    pub(crate) fn next_slot(&self) -> CurveSlot {
        CurveSlot {
            span: self.spans.len(),
            segment: self.segments.polynomials.len(),
        }
    }

    /// Adds spans with these starts and keys, each with a new segment of zeros.
    pub(crate) fn push_segments(&mut self, starts: &[f64], keys: &[u32]) {
        let segments = &mut self.segments.polynomials;
        let indices = segments.len()..segments.len() + starts.len();
        segments.extend_from_slice(&ZEROS[..starts.len()]);
        let sources = indices.map(|index| StoredSource::from(SpanSource::Segment(index as u32)));
        self.spans.sources.extend(sources);
        self.spans.starts.extend_from_slice(starts);
        self.spans.keys.extend_from_slice(keys);
    }

    pub(crate) fn push_span(&mut self, start: f64, source: SpanSource, key: u32) {
        self.spans.starts.push(start);
        self.spans.sources.push(source.into());
        self.spans.keys.push(key);
    }

    /// Replaces the spans of divided curves by those of their parts.
    pub(crate) fn replace_cut_spans(&mut self, cutter: &Cutter) {
        let mut cut = &cutter.subcurves[..];
        if cut.is_empty() {
            return;
        }
        let uncut = std::mem::take(&mut self.spans);
        self.spans.reserve(uncut.len() + cut.len());
        for part in 0..self.parts.len() {
            let (spans, first_span) = (self.parts[part].spans.clone(), self.spans.len());
            let mut next = spans.start;
            loop {
                let first_cut = cut.first().map_or(spans.end, |first| first.span);
                let span = first_cut.min(spans.end);
                self.spans.extend_from(&uncut, next..span);
                if span == spans.end {
                    break;
                }
                next = span + 1;
                let (start, key) = (uncut.starts[span], uncut.keys[span]);
                let end = if next < spans.end {
                    uncut.starts[next]
                } else {
                    self.parts[part].end
                };
                let count = cut.partition_point(|subcurve| subcurve.span <= span);
                let (pieces, others) = cut.split_at(count);
                for subcurve in pieces {
                    let (from, _) = subcurve.piece.extent();
                    let key = if from == 0.0 { key } else { NONE };
                    let source = match subcurve.segment {
                        Some(segment) => SpanSource::Segment(segment as u32),
                        None => {
                            self.exact.push(cutter.curve(subcurve));
                            SpanSource::Exact(self.exact.len() as u32 - 1)
                        }
                    };
                    self.push_span(subcurve.piece.begins(start, end - start), source, key);
                }
                cut = others;
            }
            self.parts[part].spans = first_span..self.spans.len();
        }
    }
}

/// The segments of one group. All have one form and are in the list of this form; the other lists are empty.
#[derive(Debug, Clone)]
pub(crate) struct Segments {
    pub(crate) form: Form,
    /// Whether arcs are not computed, but listed in `intervals` for a device to compute.
    pub(crate) are_arcs_listed: bool,
    pub(crate) arcs: Vec<ArcSegment>,
    /// The interval of each arc as the device reads it: the index of the constant that is the key before it, with
    /// [`START_NEGATED`](crate::shader::START_NEGATED) and [`END_NEGATED`](crate::shader::END_NEGATED).
    pub(crate) intervals: Vec<u32>,
    pub(crate) polynomials: Vec<PolynomialSegment>,
    /// The rows of polynomials that are packed ([`Prepared::pack`]).
    pub(crate) packed: Vec<[f32; 4]>,
}

impl Segments {
    pub(crate) fn new(form: Form) -> Self {
        Self {
            form,
            are_arcs_listed: false,
            arcs: Vec::new(),
            intervals: Vec::new(),
            polynomials: Vec::new(),
            packed: Vec::new(),
        }
    }

    /// The number of segments that are not packed.
    pub(crate) fn len(&self) -> usize {
        self.arcs.len() + self.intervals.len() + self.polynomials.len()
    }

    /// The polynomials, if they are packed; clips in pages of `tumble view` never are.
    #[inline(always)]
    pub(crate) fn packed(&self) -> Option<&PackedSegments> {
        let is_packed = !cfg!(smallest) && !self.packed.is_empty();
        is_packed.then(|| PackedSegments::wrap_ref(&self.packed))
    }

    /// The value of a polynomial at a parameter.
    #[inline(always)]
    pub(crate) fn polynomial_at(&self, index: u32, parameter: f32) -> [f32; 4] {
        match self.packed() {
            Some(packed) => packed.value_at(index, parameter),
            None => self.polynomials[index as usize].value_at(parameter),
        }
    }

    pub(crate) fn reserve(&mut self, count: usize) {
        match self.form {
            Form::Arc if self.are_arcs_listed => self.intervals.reserve(count),
            Form::Arc => self.arcs.reserve(count),
            Form::Polynomial => self.polynomials.reserve(count),
        }
    }

    fn reserve_exact(&mut self, count: usize) {
        match self.form {
            Form::Arc if self.are_arcs_listed => self.intervals.reserve_exact(count),
            Form::Arc => self.arcs.reserve_exact(count),
            Form::Polynomial => self.polynomials.reserve_exact(count),
        }
    }

    pub(crate) fn try_reserve_exact(&mut self, count: usize) -> Result<(), TryReserveError> {
        match self.form {
            Form::Arc if self.are_arcs_listed => self.intervals.try_reserve_exact(count),
            Form::Arc => self.arcs.try_reserve_exact(count),
            Form::Polynomial => self.polynomials.try_reserve_exact(count),
        }
    }

    /// Bytes that they take where kernels read them.
    pub(crate) fn bytes_on_device(&self) -> usize {
        self.len() * segment_size(self.form)
    }

    /// The computed segments, as bytes.
    #[cfg_attr(not(feature = "vulkan"), allow(dead_code))]
    pub(crate) fn as_bytes(&self) -> &[u8] {
        match self.form {
            Form::Arc => bytemuck::cast_slice(&self.arcs),
            Form::Polynomial => bytemuck::cast_slice(&self.polynomials),
        }
    }
}

/// Bytes of one segment of a form.
pub(crate) fn segment_size(form: Form) -> usize {
    match form {
        Form::Arc => size_of::<ArcSegment>(),
        Form::Polynomial => size_of::<PolynomialSegment>(),
    }
}
