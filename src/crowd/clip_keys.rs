//! Curves of motion tables that are stored as keys instead of segments. This is possible if the keys determine the
//! curve: for the arcs of slerp and for straight lines. The constants of the curve are computed again for each sample.
//! A key then takes 16 bytes instead of 48 for rotations (8 if rotations are packed), and 16 instead of 80 for
//! translations. Only the kernels for states of motion read these forms (`shaders/motion/joints.wgsl`, with
//! `shaders/motion/packed.wgsl`).

use glam::Vec4;

use crate::crowd::channel_curve::ChannelCurve;
use crate::math::canonical::canonical;
use crate::math::quaternion::{dot, unit};
use crate::shader::{
    CrowdChannel, CrowdSpan, FORM_ARC, FORM_ARC_KEYS, FORM_CUBIC, FORM_CUBIC_KEYS, FORM_KEYS,
    FORM_LINE, FORM_PACKED, ON_KEY, PACKED_STEP,
};
use crate::twin::arc_between::arc_between;
use crate::twin::crowd_compact::line_between;
use crate::twin::functions::cubic;

/// The largest magnitude of the three smaller components of a quaternion.
const LIMIT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The largest whole number of a packed component, which has 20 bits.
const LARGEST: i32 = (1 << 19) - 1;

const _: () = assert!(PACKED_STEP == (LIMIT / LARGEST as f64) as f32);

/// How keys of rotations are stored in [`MotionTables`](crate::crowd::MotionTables).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum KeyPrecision {
    /// As they are, 16 bytes each. Rotations have the bits of a crowd.
    #[default]
    Exact,
    /// 8 bytes each: the three smaller components in 20 bits. With slerp rotations are within 1e-5 rad of the exact
    /// ones, relative to the parent joint. Other methods are stored exactly.
    Packed,
}

/// Whether a form consists of keys.
#[inline(always)]
pub(crate) fn keeps_keys(form: u32) -> bool {
    matches!(
        form,
        FORM_KEYS | FORM_PACKED | FORM_LINE | FORM_ARC_KEYS | FORM_CUBIC_KEYS
    )
}

/// The form of a curve's keys and the keys, if these determine its constants.
pub(crate) fn keys_of(
    curve: &ChannelCurve,
    precision: KeyPrecision,
) -> Option<(u32, Vec<[f32; 4]>)> {
    match (curve.form, precision) {
        (FORM_ARC, KeyPrecision::Exact) => exact_keys(curve),
        (FORM_ARC, KeyPrecision::Packed) => packed_keys(curve).or_else(|| exact_keys(curve)),
        (FORM_CUBIC, _) => keys_of_lines(curve),
        _ => None,
    }
}

/// The key at the start of each span; in a span that is constant, its value.
fn starts(curve: &ChannelCurve) -> Vec<[f32; 4]> {
    let start =
        |(index, span): (usize, &CrowdSpan)| match span.start & ON_KEY == 0 && span.scale == 0.0 {
            true => curve.constants_at(index)[0],
            false => curve.keys[index],
        };
    curve.spans.iter().enumerate().map(start).collect()
}

/// The keys, if the constants between any two are those of the arc from one to the other, to the bit.
fn exact_keys(curve: &ChannelCurve) -> Option<(u32, Vec<[f32; 4]>)> {
    let keys = starts(curve);
    let is_arc = |index: usize| {
        let (middle, tangent) = arc_between(keys[index], keys[next(index, keys.len())]);
        curve.constants_at(index) == [middle, tangent]
    };
    (0..keys.len()).all(is_arc).then_some((FORM_KEYS, keys))
}

/// Packs a curve of keys.
pub(crate) fn pack_keys(curve: &mut ChannelCurve) {
    curve.form = FORM_PACKED;
    for key in &mut curve.constants {
        *key = packed(*key);
    }
}

/// Packed keys, if each arc begins where the one before ends.
fn packed_keys(curve: &ChannelCurve) -> Option<(u32, Vec<[f32; 4]>)> {
    let mut keys = starts(curve);
    for index in 0..keys.len() {
        let end = next(index, keys.len());
        let [middle, tangent] = *curve.constants_at(index) else {
            return None;
        };
        // Each key gets the sign that is nearer to the key before, as for arcs.
        if dot(keys[index], keys[end]) < 0.0 {
            keys[end] = keys[end].map(|component| -component);
        }
        let (middle_between, tangent_between) = arc_between(keys[index], keys[end]);
        let sign = if dot(middle_between, middle) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let is_near = |(a, b): (&f32, &f32)| (a - b * sign).abs() < 2e-6;
        let middles = middle_between.iter().zip(&middle);
        if !middles
            .chain(tangent_between.iter().zip(&tangent))
            .all(is_near)
        {
            return None;
        }
    }
    Some((FORM_PACKED, keys.into_iter().map(packed).collect()))
}

/// The keys, if the constants between any two are those of the line from one to the other, to the bit.
fn keys_of_lines(curve: &ChannelCurve) -> Option<(u32, Vec<[f32; 4]>)> {
    let keys = starts(curve);
    let is_line = |index: usize| {
        let line = line_between(keys[index], keys[next(index, keys.len())]);
        let constants = curve.constants_at(index);
        constants[..2] == line && constants[2..] == [[0.0; 4]; 2]
    };
    (0..keys.len()).all(is_line).then_some((FORM_LINE, keys))
}

/// The key at the end of a span. The last span is constant: its key is at both ends.
#[inline(always)]
pub(super) fn next(index: usize, count: usize) -> usize {
    (index + 1).min(count - 1)
}

/// A rotation in 64 bits, the first two numbers of a cell: three components, which of the four is left out, and the
/// sign.
fn packed(key: [f32; 4]) -> [f32; 4] {
    let unit = unit(key);
    let largest = (1..4).fold(0, |largest, c| match unit[c].abs() > unit[largest].abs() {
        true => c,
        false => largest,
    });
    let sign = if unit[largest] < 0.0 { -1.0 } else { 1.0 };
    let field = |behind: usize| {
        let component = unit[(largest + behind) % 4] * sign;
        let whole = (component / LIMIT * f64::from(LARGEST)).round() as i32;
        u64::from(whole.clamp(-LARGEST, LARGEST) as u32 & 0xf_ffff)
    };
    let bits = field(1)
        | field(2) << 20
        | field(3) << 40
        | (largest as u64) << 60
        | u64::from(sign < 0.0) << 62;
    [
        f32::from_bits(bits as u32),
        f32::from_bits((bits >> 32) as u32),
        0.0,
        0.0,
    ]
}

/// The rotation that [`packed`] stored.
#[inline(always)]
pub(crate) fn unpacked([low, high]: [u32; 2]) -> [f32; 4] {
    let field = |bits: u32| ((bits << 12) as i32 >> 12) as f32 * PACKED_STEP;
    let (a, b, c) = (field(low), field(low >> 20 | high << 12), field(high >> 8));
    let square = a * a + b * b + c * c;
    let d = (1.0 - square).max(0.0).sqrt();
    let negative = if high >> 30 & 1 == 1 { -1.0 } else { 1.0 };
    // Selected without branches: which component is the largest cannot be predicted.
    let largest = high >> 28 & 3;
    let pick = |of: [f32; 4]| {
        let low = if largest & 1 == 0 { of[0] } else { of[1] };
        let high = if largest & 1 == 0 { of[2] } else { of[3] };
        canonical(if largest & 2 == 0 { low } else { high } * negative)
    };
    [
        pick([d, c, b, a]),
        pick([a, d, c, b]),
        pick([b, a, d, c]),
        pick([c, b, a, d]),
    ]
}

/// Moves packed keys together, from the cell `first` on, where they were laid out one a cell. Returns the first one's
/// index in halves of cells.
pub(crate) fn pack(cells: &mut Vec<[f32; 4]>, first: usize) -> usize {
    let count = cells.len() - first;
    for index in 0..count {
        let [low, high, ..] = cells[first + index];
        let half = index % 2 * 2;
        cells[first + index / 2][half..half + 2].copy_from_slice(&[low, high]);
    }
    cells.truncate(first + count.div_ceil(2));
    first * 2
}

/// The keys of neighbouring channels of one time base.
#[derive(Clone, Copy)]
pub(crate) struct KeyRows<'a> {
    cells: &'a [[f32; 4]],
    form: u32,
    first: usize,
    /// Keys from one row to the next.
    stride: usize,
    /// Rows of the time base.
    rows: usize,
}

impl<'a> KeyRows<'a> {
    /// The rows of the channels from `channel` on, in a time base with `rows` spans.
    #[inline(always)]
    pub(crate) fn new(cells: &'a [[f32; 4]], channel: &CrowdChannel, rows: usize) -> Self {
        Self {
            cells,
            form: channel.form_and_base >> 24,
            first: channel.first as usize,
            stride: channel.count as usize,
            rows,
        }
    }

    /// The keys at the start of a span.
    #[inline(always)]
    pub(crate) fn copy(&self, span: u32, output: &mut [[f32; 4]]) {
        let first = self.first + span as usize * self.stride;
        if self.form == FORM_PACKED {
            let halves: &[[u32; 2]] = bytemuck::cast_slice(self.cells);
            for (key, &half) in output.iter_mut().zip(&halves[first..]) {
                *key = unpacked(half);
            }
        } else {
            output.copy_from_slice(&self.cells[first..first + output.len()]);
        }
    }

    /// The arc in a span, of the first of the channels: its middle and its tangent.
    #[inline(always)]
    pub(crate) fn arc(&self, span: u32) -> [[f32; 4]; 2] {
        let mut keys = [[[0.0; 4]]; 2];
        let ends = [span, next(span as usize, self.rows) as u32];
        for (key, span) in keys.iter_mut().zip(ends) {
            self.copy(span, key);
        }
        let [[start], [end]] = keys;
        let (middle, tangent) = arc_between(start, end);
        [middle, tangent]
    }

    /// The line in a span: its middle and its rise.
    #[inline(always)]
    pub(crate) fn line(&self, span: u32) -> [[f32; 4]; 2] {
        let key = |span: usize| self.cells[self.first + span * self.stride];
        let span = span as usize;
        line_between(key(span), key(next(span, self.rows)))
    }

    /// The point at a parameter of a span's line.
    #[inline(always)]
    pub(crate) fn point(&self, span: u32, parameter: f32) -> [f32; 4] {
        let [middle, rise] = self.line(span).map(Vec4::from_array);
        let point = cubic(middle, rise, Vec4::ZERO, Vec4::ZERO, Vec4::splat(parameter));
        point.to_array().map(canonical)
    }
}
