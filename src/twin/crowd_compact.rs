//! Twin of `shaders/crowd/compact.wgsl`: the channels of clips that are stored compactly.

use glam::Vec4;

use crate::math::canonical::{canonical, round_f32};
use crate::shader::{
    ArcSegment, CrowdChannel, CrowdPosition, FORM_ARC, FORM_ARC_KEYS, FORM_CUBIC, FORM_CUBIC_KEYS,
    FORM_LINE, FORM_POLYNOMIAL, KEY_INNER, LONGEST_KEY, ON_KEY, POWERS, PolynomialSegment,
    SOURCE_BITS, TICKS, TangentWeights,
};
use crate::simd::lanes::Choice;
use crate::twin::Evaluate as _;
use crate::twin::arc_between::arc_between;
use crate::twin::evaluate_arc::norm_squared;
use crate::twin::functions::cubic;
use crate::twin::small_angle::{SmallAngleCubic, small_angle_cubic};

/// The bits of 2^23 as an f32. The source `s` of an interval is stored as the f32 2^23 + s, whose lowest bits are `s`.
pub(crate) const SOURCE_FLOAT: u32 = 0x4b00_0000;

/// Whether a form consists of the keys of a clip that is stored compactly.
#[inline(always)]
pub(crate) fn is_compact(form: u32) -> bool {
    matches!(form, FORM_LINE | FORM_ARC_KEYS | FORM_CUBIC_KEYS)
}

/// A key with the sign that continues the keys before it.
#[inline(always)]
pub(crate) fn continued_key<N: Choice>(stored: [N; 4]) -> [N; 4] {
    scaled_where_long(stored, N::all(0.25))
}

/// A key as it was added.
#[inline(always)]
pub(crate) fn authored_key(stored: [f32; 4]) -> [f32; 4] {
    scaled_where_long(stored, -0.25).map(canonical)
}

#[inline(always)]
fn scaled_where_long<N: Choice>(stored: [N; 4], factor: N) -> [N; 4] {
    let is_short = norm_squared(stored).at_most(N::all(LONGEST_KEY));
    // Written out without a closure, because closures are not always inlined.
    [
        N::choose(is_short, stored[0], stored[0] * factor),
        N::choose(is_short, stored[1], stored[1] * factor),
        N::choose(is_short, stored[2], stored[2] * factor),
        N::choose(is_short, stored[3], stored[3] * factor),
    ]
}

/// The rows of a group of cubics: neighbouring channels with one time base and one list of tangent weights.
#[derive(Clone, Copy)]
pub(crate) struct CubicRows<'a> {
    cells: &'a [[f32; 4]],
    /// The first cell.
    group: usize,
    /// The cells of a row before its keys.
    before_keys: usize,
    /// Cells from one row to the next.
    stride: usize,
}

impl<'a> CubicRows<'a> {
    /// The rows of a channel's group, and the index of the channel in it.
    #[inline(always)]
    pub(crate) fn of(cells: &'a [[f32; 4]], channel: &CrowdChannel) -> (Self, usize) {
        let count = channel.count as usize;
        let rows = Self::new(cells, channel.keys as usize, count);
        let member = channel.first as usize - rows.group - rows.before_keys;
        (rows, member)
    }

    /// The rows of a group of `count` channels.
    #[inline(always)]
    pub(crate) fn new(cells: &'a [[f32; 4]], group: usize, count: usize) -> Self {
        let before_keys = 1 + count.div_ceil(4);
        Self {
            cells,
            group,
            before_keys,
            stride: before_keys + count,
        }
    }

    /// The first cell of a row.
    #[inline(always)]
    fn row(&self, row: usize) -> usize {
        self.group + row * self.stride
    }

    /// The cell of a channel's key in a row.
    #[inline(always)]
    pub(crate) fn key(&self, row: usize, member: usize) -> usize {
        self.row(row) + self.before_keys + member
    }

    /// The weights of a row's keys.
    #[inline(always)]
    pub(crate) fn weights(&self, row: usize) -> TangentWeights {
        bytemuck::cast(self.cells[self.row(row)])
    }

    /// The rows of four keys of an interval (before it, at its start, at its end and after it), and the weights of the
    /// two keys at its start and its end.
    #[inline(always)]
    pub(crate) fn around(&self, row: usize) -> ([usize; 4], [TangentWeights; 2]) {
        let weights = [self.weights(row), self.weights(row + 1)];
        let before = row - usize::from(weights[0].kind == KEY_INNER);
        let after = row + 1 + usize::from(weights[1].kind == KEY_INNER);
        ([before, row, row + 1, after], weights)
    }

    /// The source of an interval; 0 if its curve follows from keys.
    #[inline(always)]
    pub(crate) fn source(&self, row: usize, member: usize) -> u32 {
        let cell = self.cells[self.row(row) + 1 + member / 4];
        cell[member % 4].to_bits() & SOURCE_BITS
    }

    /// The segment of a source that is not 0.
    #[inline(always)]
    pub(crate) fn segment(&self, source: u32) -> PolynomialSegment {
        let first = self.group + (source >> 2) as usize;
        let powers = 7 + 2 * (source & 3) as usize;
        let mut coefficients = [[0.0; 4]; POWERS];
        let (found, _) = coefficients.split_at_mut(powers);
        found.copy_from_slice(&self.cells[first..first + powers]);
        PolynomialSegment { coefficients }
    }

    /// The curve of an interval as a whole segment.
    #[inline(always)]
    pub(crate) fn whole(&self, row: usize, member: usize) -> PolynomialSegment {
        match self.source(row, member) {
            0 => {
                let mut coefficients = [[0.0; 4]; POWERS];
                coefficients[..7].copy_from_slice(&self.curve(row, member).powers);
                PolynomialSegment { coefficients }
            }
            source => self.segment(source),
        }
    }

    /// The curve of an interval that follows from keys.
    #[inline(always)]
    fn curve(&self, row: usize, member: usize) -> SmallAngleCubic<f32> {
        let (rows, [first, last]) = self.around(row);
        let [before, start, end, after] =
            rows.map(|row| continued_key(self.cells[self.key(row, member)]));
        let weights = |of: TangentWeights| (of.before, of.after, of.outgoing, of.kind);
        small_angle_cubic(before, start, end, after, weights(first), weights(last))
    }
}

/// The middle of a line, and its rise.
#[inline(always)]
pub(crate) fn line_between(from: [f32; 4], to: [f32; 4]) -> [[f32; 4]; 2] {
    let [from, to] = [from, to].map(|key| key.map(f64::from));
    [
        std::array::from_fn(|c| round_f32((from[c] + to[c]) * 0.5)),
        std::array::from_fn(|c| round_f32(to[c] - from[c])),
    ]
}

/// The form of a channel whose constants are those that its keys determine.
pub(crate) fn whole_form(form: u32) -> u32 {
    match form {
        FORM_LINE => FORM_CUBIC,
        FORM_ARC_KEYS => FORM_ARC,
        FORM_CUBIC_KEYS => FORM_POLYNOMIAL,
        whole => whole,
    }
}

/// The constants of a span of a channel that consists of keys, as [`whole_form`] has them.
pub(crate) fn constants_of_keys(
    cells: &[[f32; 4]],
    channel: &CrowdChannel,
    span: usize,
) -> Vec<[f32; 4]> {
    let form = channel.form_and_base >> 24;
    if form == FORM_CUBIC_KEYS {
        let (rows, member) = CubicRows::of(cells, channel);
        return rows.whole(span, member).coefficients.to_vec();
    }
    let first = channel.first as usize + span * channel.count as usize;
    let keys = [cells[first], cells[first + channel.count as usize]];
    if form == FORM_LINE {
        let [middle, rise] = line_between(keys[0], keys[1]);
        return vec![middle, rise, [0.0; 4], [0.0; 4]];
    }
    let [start, end] = keys.map(continued_key);
    let (middle, tangent) = arc_between(start, end);
    vec![middle, tangent]
}

/// The value of a channel that consists of keys, at a position of its time base.
#[inline(always)]
pub(crate) fn value_of_keys(
    cells: &[[f32; 4]],
    channel: &CrowdChannel,
    position: CrowdPosition,
) -> [f32; 4] {
    let span = position.span & TICKS;
    let s = position.parameter;
    let is_on_key = position.span & ON_KEY != 0;
    match channel.form_and_base >> 24 {
        FORM_CUBIC_KEYS => {
            let (rows, member) = CubicRows::of(cells, channel);
            let row = span as usize;
            if is_on_key {
                return authored_key(cells[rows.key(row, member)]);
            }
            rows.whole(row, member).value_at(s)
        }
        form => {
            let first = (channel.first + span * channel.count) as usize;
            let start = cells[first];
            let end = || cells[first + channel.count as usize];
            match (form, is_on_key) {
                (FORM_LINE, true) => start,
                (FORM_LINE, false) => {
                    let line = line_between(start, end());
                    let [middle, rise] = line.map(Vec4::from_array);
                    let point = cubic(middle, rise, Vec4::ZERO, Vec4::ZERO, Vec4::splat(s));
                    point.to_array().map(canonical)
                }
                (_, true) => authored_key(start),
                (_, false) => {
                    let (middle, tangent) = arc_between(continued_key(start), continued_key(end()));
                    ArcSegment { middle, tangent }.value_at(s)
                }
            }
        }
    }
}
