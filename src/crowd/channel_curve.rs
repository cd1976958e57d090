//! The curve of one channel of a clip, before it is stored in the tables of a library.

use bytemuck::Zeroable as _;

use crate::shader::{
    CrowdSpan, FORM_ARC, FORM_CONSTANT, FORM_CUBIC, FORM_KEYS, FORM_LINE, FORM_PACKED, ON_KEY,
    POWERS,
};
use crate::simd::lanes::{Lanes, MAX_LANES};
use crate::twin::arc_between::arc_between;

/// One channel before it is stored in the tables: its spans, and the constants of each.
#[derive(Default)]
pub(crate) struct ChannelCurve {
    pub(crate) form: u32,
    pub(crate) spans: Vec<CrowdSpan>,
    /// The constants of each span; their number depends on the form.
    pub(crate) constants: Vec<[f32; 4]>,
    /// The key at the start of each span, 0 if there is none. Samples at a tick have its bits if the span says that it
    /// starts there.
    pub(crate) keys: Vec<[f32; 4]>,
}

/// The number of constants of a form in each span.
pub(crate) fn constants_of(form: u32) -> usize {
    match form {
        FORM_CONSTANT | FORM_KEYS | FORM_LINE | FORM_PACKED => 1,
        FORM_ARC => 2,
        FORM_CUBIC => 4,
        _ => POWERS,
    }
}

impl ChannelCurve {
    pub(crate) fn constant(value: [f32; 4]) -> Self {
        Self {
            form: FORM_CONSTANT,
            constants: vec![value],
            ..Self::default()
        }
    }

    /// Adds a span in which the value is constant: the first constant is the value, the others are 0.
    pub(crate) fn push_constant(&mut self, start: u32, value: [f32; 4], key: Option<[f32; 4]>) {
        let span = CrowdSpan {
            start,
            whole: start as i32,
            ..CrowdSpan::zeroed()
        };
        let mut constants = [[0.0; 4]; POWERS];
        constants[0] = value;
        self.push(span, &constants, key);
    }

    /// Adds a span with the first of the constants, as many as the form has.
    pub(crate) fn push(
        &mut self,
        span: CrowdSpan,
        constants: &[[f32; 4]; POWERS],
        key: Option<[f32; 4]>,
    ) {
        self.spans.push(span);
        self.constants
            .extend_from_slice(&constants[..constants_of(self.form)]);
        self.keys.push(key.unwrap_or_default());
    }

    /// Marks the last span: its key lies on its first tick.
    pub(crate) fn mark_on_key(&mut self) {
        if let Some(span) = self.spans.last_mut() {
            span.start |= ON_KEY;
        }
    }

    /// The constants of a span.
    pub(crate) fn constants_at(&self, span: usize) -> &[[f32; 4]] {
        let each = constants_of(self.form);
        &self.constants[span * each..][..each]
    }
}

/// As many arcs between keys as the vector has lanes: their middles and tangents.
#[inline(always)]
fn block_between<L: Lanes>(
    starts: &[[f32; 4]],
    ends: &[[f32; 4]],
    [middles, tangents]: [&mut [[f32; 4]]; 2],
) {
    let (middle, tangent) = arc_between(L::load_rotations(starts), L::load_rotations(ends));
    L::store_rotations(middle, middles);
    L::store_rotations(tangent, tangents);
}

/// For neighbouring joints: the middle and the tangent of each joint's arc between its two keys.
#[inline(always)]
pub(crate) fn arcs_between<L: Lanes>(
    starts: &[[f32; 4]],
    ends: &[[f32; 4]],
    [middles, tangents]: [&mut [[f32; 4]]; 2],
) {
    let whole = middles.len() / L::COUNT * L::COUNT;
    for first in (0..whole).step_by(L::COUNT) {
        let joints = first..first + L::COUNT;
        let found = [&mut middles[joints.clone()], &mut tangents[joints.clone()]];
        block_between::<L>(&starts[joints.clone()], &ends[joints], found);
    }
    let rest = middles.len() - whole;
    if rest > 0 {
        // The unused lanes of the last vector get arcs that are discarded.
        let mut keys = [[[0.0; 4]; MAX_LANES]; 2];
        keys[0][..rest].copy_from_slice(&starts[whole..][..rest]);
        keys[1][..rest].copy_from_slice(&ends[whole..][..rest]);
        let mut found = [[[0.0; 4]; MAX_LANES]; 2];
        let [of_middles, of_tangents] = &mut found;
        let arcs = [&mut of_middles[..L::COUNT], &mut of_tangents[..L::COUNT]];
        block_between::<L>(&keys[0][..L::COUNT], &keys[1][..L::COUNT], arcs);
        middles[whole..].copy_from_slice(&of_middles[..rest]);
        tangents[whole..].copy_from_slice(&of_tangents[..rest]);
    }
}
