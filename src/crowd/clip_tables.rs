//! A clip of a library: the curves of its joints as tables of constants that kernels read.

use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::sync::Arc;

use bytemuck::Zeroable as _;
use glam::Vec3;

use crate::crowd::channel_curve::{ChannelCurve, SpanKey, constants_of};
use crate::crowd::clip_keys::{KeyPrecision, keeps_keys, keys_of, pack, pack_keys};
use crate::crowd::compact::{CrowdStorage, add_cubics, compact_rotations, compact_vectors};
use crate::crowd_error::{CrowdError, MAX_TICKS};
use crate::curve::options::{KeySigns, Quantity, Speed};
use crate::machine::crowd::ChannelForms;
use crate::math::canonical::round_f32;
use crate::memory::reserved;
use crate::method::interpolation::Interpolation;
use crate::method::vector_method::{ScalarQuantity, VectorMethod};
use crate::prepare::arcs::arc_at;
use crate::prepare::clip_data::{ClipData, PrepareRequest};
use crate::prepare::preparation::Batch;
use crate::prepare::prepared::Prepared;
use crate::prepare::vectors::VectorRequest;
use crate::shader::{
    CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdPosition, CrowdSpan, END_NEGATED, FORM_ARC,
    FORM_CONSTANT, FORM_CUBIC, FORM_CUBIC_KEYS, FORM_KEYS, FORM_PACKED, FORM_POLYNOMIAL, Form,
    KEY_OF_INTERVAL, ON_KEY, POWERS, SCALE, START_NEGATED,
};
use crate::simd::lanes::{Lanes, MAX_LANES, canonical};
use crate::time::frame_clock::{FrameClock, FrameStart, TrackCopy, in_frames};
use crate::time::frame_rate::FrameRate;
use crate::time::runs::NONE;
use crate::time::spans::SpanSource;
use crate::time::wrap::WrapMode;
use crate::tracks::set::TrackSet;
use crate::tracks::set::vectors::Channel;
use crate::twin::arc_between::arc_between;
use crate::twin::crowd_compact::{constants_of_keys, is_compact, whole_form};
use crate::twin::crowd_layers::sampled;
use crate::twin::crowd_times::position_at;
use crate::twin::evaluate_arc::{norm_squared, on_arc};

/// The limit of a table's entries, which are counted in 32 bits; some are left free.
pub(crate) const MAX_ENTRIES: usize = 1 << 31;

/// The tables of all clips.
#[derive(Debug, Clone, Default)]
pub(crate) struct ClipTables {
    pub(crate) clips: Vec<CrowdClip>,
    pub(crate) bases: Vec<CrowdBase>,
    pub(crate) spans: Vec<CrowdSpan>,
    /// `[clip][joint]`, each with a rotation, a translation and a scale.
    pub(crate) channels: Vec<CrowdChannel>,
    /// Constants of segments, and keys.
    pub(crate) cells: Vec<[f32; 4]>,
    /// Ranges of consecutive joints whose rotations have one form and one time base and are adjacent in memory,
    /// `runs[clip]`.
    pub(crate) runs: Vec<Vec<Range<u32>>>,
    pub(crate) storage: ClipStorage,
    /// The keys of the rotations, translations and scales of all clips.
    pub(crate) key_count: usize,
}

/// How the curves of clips are stored.
#[derive(Debug, Clone, Copy)]
pub(crate) enum ClipStorage {
    /// For crowds.
    Crowd(CrowdStorage),
    /// For motion tables, whose kernels read other keys: those of arcs and lines, where they are enough.
    Motion(KeyPrecision),
}

impl Default for ClipStorage {
    fn default() -> Self {
        Self::Crowd(CrowdStorage::Segments)
    }
}

/// The source of a span's values.
#[derive(Clone, Copy)]
enum SpanValues<'a> {
    /// A segment of a group, by its index.
    Segment(&'a Prepared, u32),
    /// The same value everywhere.
    Constant([f32; 4]),
}

/// Calls `push` for each span of a track that has a tick, as for evaluation at frames: a frame is a tick, and the clip has
/// `period` of them from its start. It gets the span, its values, and the key at its start if there is one.
fn each_span<'d>(
    data: &'d ClipData,
    track: usize,
    (rate, start, period): (FrameRate, FrameStart, u32),
    mut push: impl FnMut(CrowdSpan, SpanValues<'d>, Option<SpanKey>),
) -> Result<(), CrowdError> {
    let whole = TrackCopy::of_track(0..0);
    let last_tick = f64::from(period);
    let mut is_first = true;
    for part_ref in data.parts_in(track, &whole) {
        let (prepared, part) = (part_ref.prepared, part_ref.part);
        let frames = FrameClock::new(rate, start, prepared.spans.steps);
        let constant = |index: u32| prepared.constants[index as usize];
        let starts = &prepared.spans.starts[part.spans.clone()];
        let begin = frames.boundary(*starts.first().unwrap_or(&part.end));
        if part.before != NONE && begin.first > 0.0 {
            push(still(0), SpanValues::Constant(constant(part.before)), None);
            is_first = false;
        }
        let mut key_index = part.first_key;
        let ends = starts.iter().skip(1).chain([&part.end]);
        let mut from = begin;
        for (index, &end) in part.spans.clone().zip(ends) {
            let start = from;
            let to = frames.boundary(end);
            from = to;
            let key = prepared.spans.keys[index];
            // An interval that was cut has several spans. Only the first one has the interval's key.
            let number = key_index;
            key_index += u32::from(key != NONE);
            if start.first >= to.first || start.first > last_tick {
                continue; // no tick lies in it
            }
            let first = start.first as u32;
            let is_on_key = key != NONE && start.first == start.frame;
            let key = (key != NONE).then(|| SpanKey {
                value: constant(key),
                index: number,
            });
            let (span, values) = match prepared.spans.source(index) {
                SpanSource::Segment(index) => {
                    let along = in_frames(start.frame, to.frame, 1.0);
                    let span = CrowdSpan {
                        start: first,
                        whole: along.whole as i32,
                        scale: along.scale,
                        offset: along.offset,
                    };
                    (span, SpanValues::Segment(prepared, index))
                }
                SpanSource::Constant(index) => {
                    (still(first), SpanValues::Constant(constant(index)))
                }
                SpanSource::Exact(_) => {
                    return Err(CrowdError::TooWild {
                        track,
                        seconds: prepared.spans.starts[index],
                    });
                }
            };
            push(marked(span, is_on_key), values, key);
            is_first = false;
        }
        let end = frames.boundary(part.end);
        if part.after != NONE && (end.first <= last_tick || is_first) {
            let at_end = part.extension.as_ref().map(|extension| extension.at_end);
            let key = at_end.filter(|&key| key != NONE);
            let first = end.first.min(last_tick) as u32;
            let span = still(if is_first { 0 } else { first });
            let is_on_key = key.is_some() && end.first == end.frame;
            let value = SpanValues::Constant(constant(part.after));
            let span_key = SpanKey {
                value: key.map_or([0.0; 4], constant),
                index: key_index,
            };
            push(marked(span, is_on_key), value, Some(span_key));
            is_first = false;
        }
    }
    Ok(())
}

/// A span in which the value is constant.
fn still(start: u32) -> CrowdSpan {
    CrowdSpan {
        start,
        whole: start as i32,
        ..CrowdSpan::zeroed()
    }
}

/// A span with the mark that its key lies on its first tick, if it does.
fn marked(span: CrowdSpan, is_on_key: bool) -> CrowdSpan {
    CrowdSpan {
        start: span.start | if is_on_key { ON_KEY } else { 0 },
        ..span
    }
}

/// The curve of one track, with the constants of each span.
fn curve(
    data: &ClipData,
    track: usize,
    form: u32,
    clock: (FrameRate, FrameStart, u32),
) -> Result<ChannelCurve, CrowdError> {
    let mut curve = ChannelCurve {
        form,
        ..ChannelCurve::default()
    };
    each_span(data, track, clock, |span, values, key| match values {
        SpanValues::Constant(value) => {
            let mut constants = [[0.0; 4]; POWERS];
            constants[0] = value;
            curve.push(span, &constants[..constants_of(form)], key);
        }
        SpanValues::Segment(prepared, index) if form == FORM_ARC => {
            let arc = arc_at(prepared, index);
            curve.push(span, &[arc.middle, arc.tangent], key);
        }
        // The constants are ordered by power.
        SpanValues::Segment(prepared, index) => {
            let segment = &prepared.segments.polynomials[index as usize];
            curve.push(span, &segment.coefficients[..constants_of(form)], key);
        }
    })?;
    let is_still = curve.spans.len() == 1 && curve.spans[0].scale == 0.0;
    Ok(match curve.constants.first() {
        Some(&value) if is_still && curve.spans[0].start & ON_KEY == 0 => {
            ChannelCurve::constant(value)
        }
        _ => curve,
    })
}

/// A curve as its keys, if these determine it.
fn of_keys(curve: ChannelCurve, precision: KeyPrecision) -> ChannelCurve {
    match keys_of(&curve, precision) {
        Some((form, constants)) => ChannelCurve {
            form,
            constants,
            ..curve
        },
        None => curve,
    }
}

/// The curve of the only track, whose arcs are listed, stored as the track's keys. `None` if the keys do not determine
/// the curve: an arc is not the one between the stored keys, or the next arc does not begin where it ends.
fn curve_of_keys(
    data: &ClipData,
    clock: (FrameRate, FrameStart, u32),
) -> Result<Option<ChannelCurve>, CrowdError> {
    let are_listed = |group: &Prepared| group.segments.are_arcs_listed;
    if !data.groups.iter().all(are_listed) {
        return Ok(None);
    }
    let whole = TrackCopy::of_track(0..0);
    let parts = data.parts_in(0, &whole);
    let room = parts.map(|it| it.part.spans.len() + 2).sum();
    let (mut spans, mut constants) = (Vec::with_capacity(room), Vec::with_capacity(room));
    let mut are_keys = true;
    // The key at the end of the span before.
    let mut end: Option<[f32; 4]> = None;
    each_span(data, 0, clock, |span, values, key| {
        let value = match values {
            SpanValues::Constant(value) if span.start & ON_KEY == 0 => value,
            _ => key.map_or([0.0; 4], |key| key.value),
        };
        let is_same =
            |key: [f32; 4], other: [f32; 4]| key.map(f32::to_bits) == other.map(f32::to_bits);
        are_keys &= end.is_none_or(|end| is_same(end, value));
        end = Some(match values {
            SpanValues::Constant(constant) => {
                let (middle, tangent) = arc_between(value, value);
                are_keys &= [middle, tangent] == [constant, [0.0; 4]];
                value
            }
            SpanValues::Segment(prepared, index) => {
                let interval = prepared.segments.intervals[index as usize];
                let key = (interval & KEY_OF_INTERVAL) as usize;
                let is_as_stored = interval & (START_NEGATED | END_NEGATED) == 0;
                are_keys &= is_as_stored && is_same(prepared.constants[key], value);
                prepared.constants[key + 1]
            }
        });
        spans.push(span);
        constants.push(value);
    })?;
    let is_still = spans.len() < 2;
    Ok((are_keys && !is_still).then(|| ChannelCurve {
        form: FORM_KEYS,
        spans: Arc::new(spans),
        constants,
        ..ChannelCurve::default()
    }))
}

/// The curve of a track as its keys, if it has the times of the track before, whose curve consists of all of its keys. The
/// spans are then the same.
fn keys_at_same_times(
    set: &TrackSet,
    (before, curve): (usize, &ChannelCurve),
    track: usize,
) -> Option<ChannelCurve> {
    let (times, keys) = set.times_and_keys(track);
    let keys: &[[f32; 4]] = bytemuck::cast_slice(keys);
    let (last, arcs) = curve.spans.split_last()?;
    let is_whole = matches!(curve.form, FORM_KEYS | FORM_PACKED)
        && curve.spans.len() == keys.len()
        && last.scale == 0.0
        && arcs.iter().all(|span| span.scale != 0.0);
    let end = *keys.last()?;
    let is_same = std::ptr::eq(times, set.times_and_keys(before).0)
        && !set.signs(track).between(0..keys.len()).any()
        && arc_between(end, end) == (end, [0.0; 4]);
    (is_whole && is_same).then(|| ChannelCurve {
        form: FORM_KEYS,
        spans: Arc::clone(&curve.spans),
        constants: keys.to_vec(),
        ..ChannelCurve::default()
    })
}

impl ClipTables {
    /// Adds a clip. `offsets` are the translations of joints without translation keys.
    pub(crate) fn push(
        &mut self,
        set: &TrackSet,
        mut interpolation: Interpolation,
        vectors: VectorMethod,
        ticks_per_second: u32,
        offsets: &[Vec3],
    ) -> Result<(), CrowdError> {
        if interpolation.quantity != Quantity::Rotation {
            return Err(CrowdError::NotRotations);
        }
        // The wrap mode is a property of the instances.
        (interpolation.before, interpolation.after) = (WrapMode::Hold, WrapMode::Hold);
        let joints = offsets.len();
        let (start, end) = set.time_span().unwrap_or((0.0, 0.0));
        let rate = FrameRate::whole(ticks_per_second);
        let ticks = rate.frames_in(end - start).round();
        if ticks.is_nan() || ticks > f64::from(MAX_TICKS) {
            return Err(CrowdError::TooLong {
                seconds: end - start,
                ticks_per_second,
            });
        }
        let period = (ticks as u32).max(1);
        let clock = (rate, FrameStart::new(start), period);
        let form = match interpolation.form() {
            Form::Arc => FORM_ARC,
            Form::Polynomial => FORM_POLYNOMIAL,
        };
        let of_vectors = VectorRequest {
            quantity: ScalarQuantity::Value,
            method: vectors,
            interpolation: &interpolation,
            group_bytes: None,
            only_for: None,
        };
        let translations = ClipData::of_vectors(set, Channel::Translation, &of_vectors)?;
        let scales = ClipData::of_vectors(set, Channel::Scale, &of_vectors)?;
        let mut curves = reserved(joints * CHANNELS as usize, "a clip of a crowd")?;
        let rotations = self.rotation_curves(set, interpolation, form, clock)?;
        for ((joint, offset), rotations) in offsets.iter().enumerate().zip(rotations) {
            curves.push(rotations);
            curves.push(match set.vectors(Channel::Translation, joint) {
                Some(_) => curve(&translations, joint, FORM_CUBIC, clock)?,
                None => ChannelCurve::constant([offset.x, offset.y, offset.z, 0.0]),
            });
            curves.push(curve(&scales, joint, FORM_CUBIC, clock)?);
        }
        match self.storage {
            ClipStorage::Crowd(CrowdStorage::Segments) => {}
            ClipStorage::Crowd(CrowdStorage::Compact) => compact(&mut curves, set, &interpolation),
            ClipStorage::Motion(precision) => {
                // Rotations have been stored as keys already.
                let curves = curves.iter_mut().enumerate();
                for (_, curve) in curves.filter(|(index, _)| index % CHANNELS as usize != 0) {
                    if let Some((form, keys)) = keys_of(curve, precision) {
                        (curve.form, curve.constants) = (form, keys);
                    }
                }
            }
        }
        // Every curve has constants and keys; it may also have its own spans.
        let more: usize = curves.iter().map(ChannelCurve::cell_bound).sum();
        let spans: usize = curves.iter().map(|curve| curve.spans.len()).sum();
        if curves.len() >= 1 << 24 {
            return Err(CrowdError::TooLarge);
        }
        self.check_room([more, spans + 1, curves.len()])?;
        self.add(period, &curves);
        let of_vectors = [Channel::Translation, Channel::Scale].map(|channel| {
            let tracks = (0..joints).filter_map(|joint| set.vectors(channel, joint));
            tracks.map(|track| track.keys.len()).sum::<usize>()
        });
        self.key_count += set.key_count() + of_vectors.iter().sum::<usize>();
        Ok(())
    }

    /// The curves of the rotations of all joints: their keys where they are enough.
    fn rotation_curves(
        &self,
        set: &TrackSet,
        interpolation: Interpolation,
        form: u32,
        clock: (FrameRate, FrameStart, u32),
    ) -> Result<Vec<ChannelCurve>, CrowdError> {
        let joints = 0..set.track_count();
        // If the tables can store keys, the arcs between them are not computed.
        let are_from_keys = form == FORM_ARC
            && interpolation.signs == KeySigns::Shortest
            && interpolation.speed == Speed::AsKeyed;
        let precision = match self.storage {
            ClipStorage::Motion(precision) => Some(precision),
            ClipStorage::Crowd(_) => None,
        };
        let Some(precision) = precision.filter(|_| are_from_keys) else {
            let data = ClipData::new(set, interpolation, PrepareRequest::all(set))?;
            let curves = joints.map(|joint| {
                let curve = curve(&data, joint, form, clock)?;
                Ok(match precision {
                    Some(precision) => of_keys(curve, precision),
                    None => curve,
                })
            });
            return curves.collect();
        };
        let mut curves: Vec<ChannelCurve> = Vec::with_capacity(joints.len());
        for joint in joints {
            let before = joint.checked_sub(1).map(|before| (before, &curves[before]));
            let shared = before.and_then(|before| keys_at_same_times(set, before, joint));
            let mut curve = match shared {
                Some(curve) => curve,
                None => {
                    let request = PrepareRequest {
                        batch: Batch::Tracks(joint..joint + 1),
                        lists_arcs: true,
                        ..PrepareRequest::all(set)
                    };
                    let data = ClipData::new(set, interpolation, request)?;
                    match curve_of_keys(&data, clock)? {
                        Some(curve) => curve,
                        None => of_keys(curve(&data, 0, form, clock)?, precision),
                    }
                }
            };
            if curve.form == FORM_KEYS && precision == KeyPrecision::Packed {
                pack_keys(&mut curve);
            }
            curves.push(curve);
        }
        Ok(curves)
    }

    /// Refuses more cells, spans and channels than the tables can have.
    fn check_room(&self, [cells, spans, channels]: [usize; 3]) -> Result<(), CrowdError> {
        let counts = [
            self.cells.len() + cells,
            self.spans.len() + spans,
            self.channels.len() + channels,
        ];
        match counts.iter().any(|&count| count > MAX_ENTRIES) {
            true => Err(CrowdError::TooLarge),
            false => Ok(()),
        }
    }

    /// Adds the clips of other tables.
    pub(crate) fn append(&mut self, other: Self) -> Result<(), CrowdError> {
        self.check_room([other.cells.len(), other.spans.len(), other.channels.len()])?;
        let (cells, spans, bases) = (self.cells.len(), self.spans.len(), self.bases.len());
        self.cells.extend(other.cells);
        self.spans.extend(other.spans);
        self.bases
            .extend(other.bases.into_iter().map(|base| CrowdBase {
                first: base.first + spans as u32,
                ..base
            }));
        self.channels
            .extend(other.channels.into_iter().map(|channel| {
                let moved = match channel.form_and_base >> 24 {
                    FORM_PACKED => cells * 2,
                    _ => cells,
                };
                CrowdChannel {
                    first: channel.first + moved as u32,
                    keys: channel.keys + moved as u32,
                    ..channel
                }
            }));
        self.clips
            .extend(other.clips.into_iter().map(|clip| CrowdClip {
                first_base: clip.first_base + bases as u32,
                ..clip
            }));
        self.runs.extend(other.runs);
        self.key_count += other.key_count;
        Ok(())
    }

    /// Stores the curves of a clip in the tables.
    fn add(&mut self, period: u32, curves: &[ChannelCurve]) {
        let first_base = self.bases.len();
        if self.cells.is_empty() {
            self.cells.push([0.0; 4]); // kernels use the first cell as 0
        }
        let mut known: HashMap<Vec<u8>, u32> = HashMap::new();
        let mut last: Option<(&Arc<Vec<CrowdSpan>>, u32)> = None;
        // Channels with the same kind, form and time base are stored next to each other.
        let mut sides = BTreeMap::<_, Vec<(usize, &ChannelCurve)>>::new();
        // Compact cubics share a list of weights, too.
        let mut lists: Vec<&[[f32; 4]]> = Vec::new();
        for (index, curve) in curves.iter().enumerate() {
            let mut base = 0;
            if curve.form != FORM_CONSTANT {
                let bytes: &[u8] = bytemuck::cast_slice(curve.spans.as_slice());
                let are_same = |spans: &Arc<Vec<CrowdSpan>>| {
                    Arc::ptr_eq(spans, &curve.spans)
                        || bytes == bytemuck::cast_slice::<_, u8>(spans.as_slice())
                };
                base = match last {
                    // Usually all curves of a clip have the same spans, so they are stored once.
                    Some((spans, base)) if are_same(spans) => base,
                    _ => *known.entry(bytes.to_vec()).or_insert_with(|| {
                        self.push_base(&curve.spans);
                        (self.bases.len() - 1 - first_base) as u32
                    }),
                };
                last = Some((&curve.spans, base));
            }
            let is_same = |list: &&[[f32; 4]]| bytes_of(list) == bytes_of(curve.weights.as_slice());
            let list = lists.iter().position(is_same).unwrap_or_else(|| {
                lists.push(&curve.weights);
                lists.len() - 1
            });
            let side = (index as u32 % CHANNELS, curve.form, base, list);
            sides.entry(side).or_default().push((index, curve));
        }
        if self.bases.len() == first_base {
            // Every entry needs a time base, so a clip without spans gets an empty one.
            self.push_base(&[CrowdSpan::zeroed()]);
        }
        let first_channel = self.channels.len();
        let none = CrowdChannel::zeroed();
        self.channels.resize(first_channel + curves.len(), none);
        for ((_, form, base, _), members) in sides {
            if form == FORM_CUBIC_KEYS {
                let [first, group] = add_cubics(&mut self.cells, &members);
                let count = members.len() as u32;
                for (slot, (index, _)) in members.into_iter().enumerate() {
                    self.channels[first_channel + index] = CrowdChannel {
                        first: (first + slot) as u32,
                        count,
                        form_and_base: form << 24 | base,
                        keys: group as u32,
                    };
                }
                continue;
            }
            let mut lay_out = |column: fn(&ChannelCurve) -> &[[f32; 4]]| {
                let first = self.cells.len();
                let columns: Vec<_> = members.iter().map(|(_, curve)| column(curve)).collect();
                self.cells.reserve(columns.len() * columns[0].len());
                for row in 0..columns[0].len() {
                    self.cells.extend(columns.iter().map(|column| column[row]));
                }
                first
            };
            let mut first = lay_out(|curve| &curve.constants);
            let mut spans = members[0].1.spans.iter();
            let keys = match spans.any(|span| span.start & ON_KEY != 0) && !keeps_keys(form) {
                true => lay_out(|curve| &curve.keys),
                false => first,
            };
            if form == FORM_PACKED {
                first = pack(&mut self.cells, first);
            }
            let count = match form {
                FORM_CONSTANT => 0,
                _ => members.len() as u32,
            };
            for (slot, (index, _)) in members.into_iter().enumerate() {
                self.channels[first_channel + index] = CrowdChannel {
                    first: (first + slot) as u32,
                    count,
                    form_and_base: form << 24 | base,
                    keys: (keys + slot) as u32,
                };
            }
        }
        self.clips.push(CrowdClip {
            period,
            first_base: first_base as u32,
            bases: (self.bases.len() - first_base) as u32,
        });
        self.runs.push(runs_of(&self.channels[first_channel..]));
    }

    fn push_base(&mut self, spans: &[CrowdSpan]) {
        self.bases.push(CrowdBase {
            first: self.spans.len() as u32,
            count: spans.len() as u32,
            step: match spans.len() {
                ..2 => 0,
                count => 1 << (count - 1).ilog2(),
            },
        });
        self.spans.extend_from_slice(spans);
    }

    /// The forms of the channels.
    pub(crate) fn forms(&self) -> ChannelForms {
        let form = |channel: &CrowdChannel| channel.form_and_base >> 24;
        let mut rotations = self.channels.iter().step_by(CHANNELS as usize).map(form);
        if self.channels.iter().map(form).any(is_compact) {
            ChannelForms::Compact
        } else if rotations.all(|form| form == FORM_ARC || form == FORM_CONSTANT) {
            ChannelForms::Arcs
        } else {
            ChannelForms::Segments
        }
    }

    /// Bytes of the tables.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&*self.clips)
            + size_of_val(&*self.bases)
            + size_of_val(&*self.spans)
            + size_of_val(&*self.channels)
            + size_of_val(&*self.cells)
    }

    /// The same clips without the compact forms of crowds. Motion tables keep their keys, some of which are lines, too.
    pub(crate) fn with_segments(self) -> Self {
        let is_of_crowd = matches!(self.storage, ClipStorage::Crowd(_));
        if !is_of_crowd || self.forms() != ChannelForms::Compact {
            return self;
        }
        let mut whole = Self {
            key_count: self.key_count,
            ..Self::default()
        };
        let each = self.channels.len() / self.clips.len().max(1);
        for (clip, channels) in self.clips.iter().zip(self.channels.chunks(each.max(1))) {
            let bases = &self.bases[clip.first_base as usize..];
            let curves = channels.iter().map(|channel| {
                let base = &bases[(channel.form_and_base & 0x00ff_ffff) as usize];
                let spans = &self.spans[base.first as usize..][..base.count as usize];
                self.curve_of(channel, spans)
            });
            whole.add(clip.period, &curves.collect::<Vec<_>>());
        }
        whole
    }

    /// The curve of a channel with these spans, as it was before it was stored.
    fn curve_of(&self, channel: &CrowdChannel, spans: &[CrowdSpan]) -> ChannelCurve {
        let form = channel.form_and_base >> 24;
        let (first, count) = (channel.first as usize, channel.count as usize);
        if form == FORM_CONSTANT {
            return ChannelCurve::constant(self.cells[first]);
        }
        let has_keys = spans.iter().any(|span| span.start & ON_KEY != 0);
        let mut curve = ChannelCurve {
            form: whole_form(form),
            spans: Arc::new(spans.to_vec()),
            ..ChannelCurve::default()
        };
        for row in 0..spans.len() {
            let on_key = CrowdPosition {
                span: row as u32 | ON_KEY,
                parameter: 0.0,
            };
            let key = match has_keys {
                true => sampled(&self.cells, channel, on_key),
                false => [0.0; 4],
            };
            curve.keys.push(key);
            if is_compact(form) {
                curve
                    .constants
                    .extend(constants_of_keys(&self.cells, channel, row));
                continue;
            }
            let powers = constants_of(form);
            let cells = (0..powers).map(|power| first + (row * powers + power) * count);
            curve.constants.extend(cells.map(|cell| self.cells[cell]));
        }
        curve
    }

    /// Every channel of a clip at a tick, `[joint][kind]`, in the form of reference poses: scales are stored as their
    /// reciprocals, where 0 counts as 1.
    pub(crate) fn reference(
        &self,
        joints: usize,
        clip: usize,
        tick: u32,
    ) -> impl Iterator<Item = [f32; 4]> {
        let clip_entry = &self.clips[clip];
        let tick = tick.min(clip_entry.period);
        let bases = &self.bases[clip_entry.first_base as usize..][..clip_entry.bases as usize];
        let positions: Vec<_> = (bases.iter())
            .map(|base| position_at(base, &self.spans, tick))
            .collect();
        let each = joints * CHANNELS as usize;
        let channels = &self.channels[clip * each..][..each];
        (0..).zip(channels).map(move |(index, channel)| {
            let position = positions[(channel.form_and_base & 0x00ff_ffff) as usize];
            let value = sampled(&self.cells, channel, position);
            match index % CHANNELS {
                SCALE => value.map(|scale| match scale == 0.0 {
                    true => 1.0,
                    false => round_f32(1.0 / f64::from(scale)),
                }),
                _ => value,
            }
        })
    }
}

/// Stores curves as their keys where these determine them.
fn compact(curves: &mut [ChannelCurve], set: &TrackSet, interpolation: &Interpolation) {
    let (joints, _) = curves.as_chunks_mut::<{ CHANNELS as usize }>();
    let mut rotations: Vec<_> = joints.iter_mut().map(|[rotation, ..]| rotation).collect();
    compact_rotations(&mut rotations, set, interpolation);
    for (joint, [_, moved, scale]) in joints.iter_mut().enumerate() {
        for (curve, channel) in [(moved, Channel::Translation), (scale, Channel::Scale)] {
            let keys = set.vectors(channel, joint).map(|track| &*track.keys);
            if let Some(last) = keys.and_then(<[Vec3]>::last) {
                compact_vectors(curve, [last.x, last.y, last.z, 0.0]);
            }
        }
    }
}

fn bytes_of(list: &[[f32; 4]]) -> &[u8] {
    bytemuck::cast_slice(list)
}

/// The runs of rotations among the channels of a clip.
pub(super) fn runs_of(channels: &[CrowdChannel]) -> Vec<Range<u32>> {
    let rotations: Vec<_> = channels.iter().step_by(CHANNELS as usize).collect();
    let mut end = 0;
    rotations
        .chunk_by(|before, next| {
            before.form_and_base == next.form_and_base
                && before.first + 1 == next.first
                && before.count == next.count
        })
        .map(|run| {
            let first = end;
            end += run.len() as u32;
            first..end
        })
        .collect()
}

/// As many arcs as the vector has lanes, at one parameter. This is a function because a closure's body would not be
/// compiled for the vector width.
#[inline(always)]
fn arc_block<L: Lanes>(
    middles: &[[f32; 4]],
    tangents: &[[f32; 4]],
    parameter: f32,
) -> L::Rotations {
    let (middle, tangent) = (L::load_rotations(middles), L::load_rotations(tangents));
    let square = norm_squared(tangent);
    L::rotations(canonical(on_arc(
        middle,
        tangent,
        square,
        L::all(parameter),
    )))
}

/// Evaluates arcs of neighbouring joints at one parameter.
#[inline(always)]
pub(crate) fn arcs<L: Lanes>(
    middles: &[[f32; 4]],
    tangents: &[[f32; 4]],
    parameter: f32,
    output: &mut [[f32; 4]],
) {
    let whole = output.len() / L::COUNT * L::COUNT;
    for first in (0..whole).step_by(L::COUNT) {
        let joints = first..first + L::COUNT;
        let found = arc_block::<L>(
            &middles[joints.clone()],
            &tangents[joints.clone()],
            parameter,
        );
        output[joints].copy_from_slice(found.as_ref());
    }
    let rest = output.len() - whole;
    if rest > 0 {
        // The unused lanes of the last vector get arcs that are discarded.
        let mut ends = [[[0.0; 4]; MAX_LANES]; 2];
        ends[0][..rest].copy_from_slice(&middles[whole..]);
        ends[1][..rest].copy_from_slice(&tangents[whole..]);
        let found = arc_block::<L>(&ends[0][..L::COUNT], &ends[1][..L::COUNT], parameter);
        output[whole..].copy_from_slice(&found.as_ref()[..rest]);
    }
}
