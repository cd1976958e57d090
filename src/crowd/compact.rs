//! Clips of crowds that are stored compactly. If the keys determine the curve of an interval, only the keys are stored;
//! for other intervals a segment is stored, without the powers that are 0. A key of a rotation takes 16 bytes (slerp)
//! or 20 to about 48 (smooth methods) instead of 48 or 192. The constants of a curve are computed from the keys for
//! each sample, with the operations that prepare segments, so that every bit is the same. Each curve is compared when
//! it is stored.

use bytemuck::Zeroable as _;

use crate::crowd::channel_curve::ChannelCurve;
use crate::curve::options::Ends;
use crate::fit::tangent_weights::{UNKNOWN, WeightRule};
use crate::from_keys::cubics::sample;
use crate::from_keys::kept::alike;
use crate::math::canonical::canonical;
use crate::method::interpolation::Interpolation;
use crate::names::names;
use crate::shader::{
    CrowdChannel, CrowdPosition, CrowdSpan, FORM_ARC, FORM_ARC_KEYS, FORM_CUBIC, FORM_CUBIC_KEYS,
    FORM_LINE, FORM_POLYNOMIAL, KEY_INNER, KEY_UNKNOWN, ON_KEY, POWERS, PolynomialSegment,
    SOURCE_BITS, TICKS, TangentWeights,
};
use crate::simd::lanes::{self, Lanes, MAX_LANES};
use crate::tracks::set::TrackSet;
use crate::tracks::track_keys::TrackKeys;
use crate::twin::Evaluate as _;
use crate::twin::arc_between::arc_between;
use crate::twin::crowd_compact::{
    CubicRows, SOURCE_FLOAT, authored_key, continued_key, line_between,
};
use crate::twin::evaluate_arc::{norm_squared, on_arc};
use crate::twin::small_angle::small_angle_cubic;

/// How a library stores its clips. Poses have the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum CrowdStorage {
    /// As prepared segments, and keys: about 50 bytes for a key of a rotation by slerp, and 190 by smooth methods. Poses
    /// take the least time.
    #[default]
    Segments,
    /// As keys if these determine the curve of an interval, otherwise as shortened segments. A key of a rotation takes
    /// 16 to 20 bytes by slerp, and 20 to 48 by Catmull-Rom and Bessel-Overhauser if the keys of the motion are close.
    /// Poses take longer.
    Compact,
}

names! {
    CrowdStorage, "storage of a crowd's clips",
    Segments => "segments",
    Compact => "compact",
}

/// The largest number of cells of a clip's compact cubics: a source has no bits for the index of a segment after them.
const MAX_CUBIC_CELLS: usize = SOURCE_BITS as usize >> 2;

/// The keys of a track of rotations, from which its curve may follow.
struct KeysOfTrack<'a> {
    times: &'a [f64],
    /// With the signs that continue those before.
    signed: Vec<[f32; 4]>,
    /// The rule for the tangents of cubics, if there is one.
    weights: Option<(WeightRule, Ends)>,
}

impl<'a> KeysOfTrack<'a> {
    fn new(set: &'a TrackSet, track: usize, interpolation: &Interpolation) -> Self {
        let keys = TrackKeys::whole(set, track);
        let mut room = Vec::new();
        let signed = keys.signed(&mut room).to_vec();
        let fast = interpolation.plain().and_then(|smooth| smooth.fast);
        Self {
            times: keys.times,
            signed,
            weights: fast.map(|fast| (fast.weights, interpolation.ends)),
        }
    }

    fn weights_at(&self, index: usize) -> TangentWeights {
        match self.weights {
            Some((rule, ends)) if index < self.times.len() => rule.at_key(ends, self.times, index),
            _ => UNKNOWN,
        }
    }
}

/// The key of a row. There is a row for the start of each span, and one for the end of the last span.
struct RowKey {
    /// The key as cells store it: multiplied by 4 if it was added with the opposite sign.
    stored: [f32; 4],
    weights: TangentWeights,
}

/// Whether a span is constant, without a key at its first tick.
fn is_held(span: &CrowdSpan) -> bool {
    span.start & ON_KEY == 0 && span.scale == 0.0
}

/// A cubic that is stored compactly.
struct CompactCubic {
    keys: Vec<[f32; 4]>,
    weights: Vec<[f32; 4]>,
    segments: Vec<(usize, PolynomialSegment)>,
}

/// Replaces the constants of a clip's rotations by their keys, for curves that take less memory in this way. There is a
/// rotation for each track of the set.
pub(crate) fn compact_rotations(
    rotations: &mut [&mut ChannelCurve],
    set: &TrackSet,
    interpolation: &Interpolation,
) {
    let mut cubics = Vec::new();
    let mut cells = 0;
    for (track, curve) in rotations.iter_mut().enumerate() {
        let rows = rows_of(curve, &KeysOfTrack::new(set, track, interpolation));
        match (rows, curve.form) {
            (Some(rows), FORM_ARC) if are_arcs(curve, &rows) => {
                curve.form = FORM_ARC_KEYS;
                curve.constants = rows.into_iter().map(|row| row.stored).collect();
            }
            (Some(rows), FORM_POLYNOMIAL) => {
                if let Some(cubic) = cubic_of(curve, rows) {
                    cells += 3 * cubic.keys.len() + POWERS * cubic.segments.len();
                    cubics.push((track, cubic));
                }
            }
            _ => {}
        }
    }
    if cells > MAX_CUBIC_CELLS {
        return;
    }
    for (track, cubic) in cubics {
        let curve = &mut *rotations[track];
        curve.form = FORM_CUBIC_KEYS;
        (curve.constants, curve.weights, curve.segments) =
            (cubic.keys, cubic.weights, cubic.segments);
    }
}

/// Whether the constants between any two keys are those of the arc from one to the other, to the bit.
fn are_arcs(curve: &ChannelCurve, rows: &[RowKey]) -> bool {
    rows.windows(2).enumerate().all(|(span, ends)| {
        let (middle, tangent) =
            arc_between(continued_key(ends[0].stored), continued_key(ends[1].stored));
        curve.constants_at(span) == [middle, tangent]
    })
}

/// A curve as keys and segments; `None` if it would not be smaller.
fn cubic_of(curve: &ChannelCurve, rows: Vec<RowKey>) -> Option<CompactCubic> {
    let segments = segments_of(curve, &rows);
    let powers = segments.iter().map(|(_, segment)| segment.degree() + 1);
    let cells = 2 * rows.len() + powers.sum::<usize>();
    (cells < POWERS * curve.spans.len()).then(|| CompactCubic {
        weights: rows.iter().map(|row| bytemuck::cast(row.weights)).collect(),
        keys: rows.into_iter().map(|row| row.stored).collect(),
        segments,
    })
}

/// The rows of a curve; `None` if a key has other bits than its track's.
fn rows_of(curve: &ChannelCurve, track: &KeysOfTrack<'_>) -> Option<Vec<RowKey>> {
    let mut rows = Vec::with_capacity(curve.spans.len() + 1);
    // The index of the key behind the last row.
    let mut next = 0;
    for (span, (row, &index)) in curve.spans.iter().zip(&curve.key_indices).enumerate() {
        let index = index as usize;
        let (key, weights) = match track.signed.get(index) {
            Some(&key) => {
                next = if span_is_still(row) { index } else { index + 1 };
                (key, track.weights_at(index))
            }
            // Before the first key, the curve stands still at its first value.
            None if is_held(row) => (curve.constants_at(span)[0], track.weights_at(0)),
            None => (curve.keys[span], UNKNOWN),
        };
        let key = key.map(canonical);
        let authored = curve.keys[span].map(f32::to_bits);
        let is_authored = |stored: &[f32; 4]| authored_key(*stored).map(f32::to_bits) == authored;
        let stored = match row.start & ON_KEY != 0 {
            false => key,
            true => [key, key.map(|component| component * 4.0)]
                .into_iter()
                .find(is_authored)?,
        };
        rows.push(RowKey { stored, weights });
    }
    let end = track.signed.get(next);
    let end = end.map_or([0.0; 4], |key| key.map(canonical));
    rows.push(RowKey {
        stored: end,
        weights: track.weights_at(next),
    });
    Some(rows)
}

/// Whether a span is constant.
fn span_is_still(span: &CrowdSpan) -> bool {
    span.scale == 0.0
}

/// The intervals whose curves the series of small angles does not give, to the bit.
fn segments_of(curve: &ChannelCurve, rows: &[RowKey]) -> Vec<(usize, PolynomialSegment)> {
    let follows = |span: usize, segment: &PolynomialSegment| {
        let [first, last] = [rows[span].weights, rows[span + 1].weights];
        let before = span.checked_sub(usize::from(first.kind == KEY_INNER));
        let after = span + 1 + usize::from(last.kind == KEY_INNER);
        let (Some(before), true) = (before, after < rows.len()) else {
            return false;
        };
        if first.kind == KEY_UNKNOWN || last.kind == KEY_UNKNOWN {
            return false;
        }
        let [before, start, end, after] =
            [before, span, span + 1, after].map(|row| continued_key(rows[row].stored));
        let weights = |of: TangentWeights| (of.before, of.after, of.outgoing, of.kind);
        let found = small_angle_cubic(before, start, end, after, weights(first), weights(last));
        let (powers, rest) = segment.coefficients.split_at(found.powers.len());
        found.is_valid && powers == found.powers && rest.iter().all(|power| *power == [0.0; 4])
    };
    let spans = 0..curve.spans.len();
    let segments = spans.map(|span| {
        let mut segment = PolynomialSegment::zeroed();
        segment
            .coefficients
            .copy_from_slice(curve.constants_at(span));
        (span, segment)
    });
    segments
        .filter(|(span, segment)| !follows(*span, segment))
        .collect()
}

/// Replaces the constants of translations or scales by their keys, if all their curves are straight lines. `last` is the
/// track's last key.
pub(crate) fn compact_vectors(curve: &mut ChannelCurve, last: [f32; 4]) {
    if curve.form != FORM_CUBIC {
        return;
    }
    let spans = curve.spans.iter().enumerate();
    let mut rows: Vec<[f32; 4]> = spans
        .map(|(span, row)| match is_held(row) {
            true => curve.constants_at(span)[0],
            false => curve.keys[span],
        })
        .collect();
    let ends_still = curve.spans.last().is_some_and(span_is_still);
    let end = match rows.last() {
        Some(&held) if ends_still => held,
        _ => last.map(canonical),
    };
    rows.push(end);
    let is_line = |span: usize| {
        let constants = curve.constants_at(span);
        constants[..2] == line_between(rows[span], rows[span + 1])
            && constants[2..] == [[0.0; 4]; 2]
    };
    if (0..curve.spans.len()).all(is_line) {
        (curve.form, curve.constants) = (FORM_LINE, rows);
    }
}

/// Adds a group of cubics with the same spans and weights to the cells. Returns the cell of the first key, and that of the
/// first weights.
pub(crate) fn add_cubics(
    cells: &mut Vec<[f32; 4]>,
    members: &[(usize, &ChannelCurve)],
) -> [usize; 2] {
    let group = cells.len();
    let rows = &members[0].1.weights;
    let of_sources = members.len().div_ceil(4);
    let stride = 1 + of_sources + members.len();
    let mut sources = vec![0u32; rows.len() * of_sources * 4];
    let mut packed: Vec<[f32; 4]> = Vec::new();
    for (member, (_, curve)) in members.iter().enumerate() {
        for (span, segment) in &curve.segments {
            let shortened = match segment.degree() {
                6 => 0,
                8 => 1,
                _ => 2,
            };
            let offset = rows.len() * stride + packed.len();
            sources[span * of_sources * 4 + member] = (offset as u32) << 2 | shortened;
            packed.extend_from_slice(&segment.coefficients[..7 + 2 * shortened as usize]);
        }
    }
    for (row, weights) in rows.iter().enumerate() {
        cells.push(*weights);
        let words = &sources[row * of_sources * 4..][..of_sources * 4];
        let (words, _) = words.as_chunks::<4>();
        let stored = |source| f32::from_bits(SOURCE_FLOAT | source);
        cells.extend(words.iter().map(|words| words.map(stored)));
        cells.extend(members.iter().map(|(_, curve)| curve.constants[row]));
    }
    cells.append(&mut packed);
    [group + 1 + of_sources, group]
}

/// The rotations of neighbouring joints that are stored compactly, from `channel` on.
#[inline(always)]
pub(crate) fn rotations<L: Lanes>(
    cells: &[[f32; 4]],
    channel: &CrowdChannel,
    position: CrowdPosition,
    values: &mut [[f32; 4]],
) {
    let span = position.span & TICKS;
    let cubic =
        (channel.form_and_base >> 24 == FORM_CUBIC_KEYS).then(|| CubicRows::of(cells, channel));
    let key = match &cubic {
        Some((rows, member)) => rows.key(span as usize, *member),
        None => (channel.first + span * channel.count) as usize,
    };
    if position.span & ON_KEY != 0 {
        for (value, &stored) in values.iter_mut().zip(&cells[key..]) {
            *value = authored_key(stored);
        }
    } else if let Some((rows, member)) = cubic {
        cubics::<L>(
            cells,
            (rows, span as usize, member),
            position.parameter,
            values,
        );
    } else {
        let next = key + channel.count as usize;
        for (first, values) in (0..).step_by(L::COUNT).zip(values.chunks_mut(L::COUNT)) {
            let start = continued_key(load::<L>(cells, key + first));
            let end = continued_key(load::<L>(cells, next + first));
            let (middle, tangent) = arc_between(start, end);
            let square = norm_squared(tangent);
            let found = on_arc(middle, tangent, square, L::all(position.parameter));
            store(lanes::canonical(found), values);
        }
    }
}

/// Cubics of neighbouring joints, from the index `member` of a group on, in the interval behind a row.
#[inline(always)]
fn cubics<L: Lanes>(
    cells: &[[f32; 4]],
    (rows, row, member): (CubicRows<'_>, usize, usize),
    parameter: f32,
    values: &mut [[f32; 4]],
) {
    let ([before, start, end, after], [first, last]) = rows.around(row);
    let are_known = first.kind != KEY_UNKNOWN && last.kind != KEY_UNKNOWN;
    for (member, values) in (member..)
        .step_by(L::COUNT)
        .zip(values.chunks_mut(L::COUNT))
    {
        if are_known {
            let curve = small_angle_cubic(
                continued_key(load::<L>(cells, rows.key(before, member))),
                continued_key(load::<L>(cells, rows.key(start, member))),
                continued_key(load::<L>(cells, rows.key(end, member))),
                continued_key(load::<L>(cells, rows.key(after, member))),
                alike::<L>(first).into(),
                alike::<L>(last).into(),
            );
            store(sample(&curve, L::all(parameter)), values);
        }
        for (member, value) in (member..).zip(values) {
            let source = rows.source(row, member);
            if source != 0 {
                *value = rows.segment(source).value_at(parameter);
            }
        }
    }
}

/// The keys in as many cells as a vector has lanes, from `first` on; lanes behind the last cell have zeros.
#[inline(always)]
fn load<L: Lanes>(cells: &[[f32; 4]], first: usize) -> [L; 4] {
    let rest = &cells[first..];
    if rest.len() >= L::COUNT {
        return L::load_rotations(rest);
    }
    let mut end = [[0.0; 4]; MAX_LANES];
    end[..rest.len()].copy_from_slice(rest);
    L::load_rotations(&end)
}

/// Stores the rotations of as many lanes as there are values.
#[inline(always)]
fn store<L: Lanes>(components: [L; 4], values: &mut [[f32; 4]]) {
    let found = L::rotations(components);
    values.copy_from_slice(&found.as_ref()[..values.len()]);
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;
    use glam::{Quat, Vec3};

    use super::*;
    use crate::crowd::clip_tables::{ClipStorage, ClipTables};
    use crate::method::METHODS;
    use crate::method::vector_method::VectorMethod;
    use crate::shader::CHANNELS;
    use crate::twin::crowd_layers::sampled;
    use crate::twin::crowd_times::position_at;

    const JOINTS: usize = 10;
    const TICKS: u32 = 120;

    /// Motion with close keys and a few far ones, whose signs change. Most joints have keys at the same times; some begin
    /// later, some have few keys, and some have translations on lines.
    fn motion(random: &mut Rng) -> TrackSet {
        let mut set = TrackSet::new();
        for joint in 0..JOINTS {
            let (first, count) = [(0, 40), (0, 40), (3, 30), (0, 2), (0, 1)][joint * 7 % 10 / 2];
            let times: Vec<f64> = (first..first + count)
                .map(|key| f64::from(key) / 30.0)
                .collect();
            let mut rotation = Quat::IDENTITY;
            let mut keys = Vec::new();
            for _ in &times {
                let mut part = || random.f32() - 0.5;
                let axis = Vec3::new(part(), part(), part()).normalize_or(Vec3::Y);
                let angle = [0.02, 0.03, 0.04, 0.05, 0.05, 0.3, 1.2][random.usize(..7)];
                rotation = (rotation * Quat::from_axis_angle(axis, angle)).normalize();
                let sign = if random.u32(..9) == 0 { -1.0 } else { 1.0 };
                keys.push(rotation * sign);
            }
            set.push("", &times, &keys).unwrap();
            if joint % 2 == 0 {
                let keys: Vec<Vec3> = times.iter().map(|_| Vec3::splat(random.f32())).collect();
                set.set_translations(joint, &times, &keys, &[]).unwrap();
            }
        }
        set
    }

    /// Catches a key of another row, a lost sign, weights of another key, a segment in another place, and a curve that is
    /// not compared to the bit.
    #[test]
    fn compact_clips_have_the_values_of_whole_ones() {
        let mut random = Rng::with_seed(12);
        let mut forms = [0; 32];
        let (mut long_keys, mut sources) = (0, [0; 3]);
        for method in METHODS {
            let set = motion(&mut random);
            let [whole, compact] = [CrowdStorage::Segments, CrowdStorage::Compact].map(|storage| {
                let mut tables = ClipTables {
                    storage: ClipStorage::Crowd(storage),
                    ..ClipTables::default()
                };
                let vectors = VectorMethod::Linear;
                let offsets = [Vec3::ONE; JOINTS];
                let pushed = tables.push(&set, method.into(), vectors, TICKS, &offsets);
                pushed.map(|()| tables)
            });
            let (Ok(whole), Ok(compact)) = (whole, compact) else {
                continue; // it rotates too fast for a crowd
            };
            assert!(compact.bytes() <= whole.bytes(), "{method}");
            for channel in &compact.channels {
                let form = channel.form_and_base >> 24;
                forms[form as usize] += 1;
                if form == FORM_CUBIC_KEYS {
                    let (rows, member) = CubicRows::of(&compact.cells, channel);
                    let base = compact.bases[(channel.form_and_base & 0x00ff_ffff) as usize];
                    for row in 0..base.count as usize {
                        let source = rows.source(row, member);
                        if source != 0 {
                            sources[(source & 3) as usize] += 1;
                        }
                        let key = compact.cells[rows.key(row, member)];
                        long_keys += usize::from(norm_squared(key) > 4.0);
                    }
                }
            }
            let again = compact.clone().with_segments();
            for tick in 0..=whole.clips[0].period {
                for (index, channel) in whole.channels.iter().enumerate() {
                    let value_in = |tables: &ClipTables| {
                        let channel = &tables.channels[index];
                        let base = &tables.bases[(channel.form_and_base & 0x00ff_ffff) as usize];
                        let position = position_at(base, &tables.spans, tick);
                        sampled(&tables.cells, channel, position).map(f32::to_bits)
                    };
                    let expected = value_in(&whole);
                    let kind = index as u32 % CHANNELS;
                    let label = format!("{method}, tick {tick}, channel {index} ({kind})");
                    assert_eq!(value_in(&compact), expected, "{label}");
                    assert_eq!(value_in(&again), expected, "{label}, whole again");
                    let (form, of_again) = (channel.form_and_base >> 24, again.channels[index]);
                    assert_eq!(of_again.form_and_base >> 24, form, "{label}");
                }
            }
        }
        for form in [FORM_LINE, FORM_ARC_KEYS, FORM_CUBIC_KEYS] {
            assert!(forms[form as usize] > 3, "{form}: {forms:?}");
        }
        assert!(long_keys > 20, "{long_keys}");
        assert!(sources.iter().all(|&count| count > 5), "{sources:?}");
    }
}
