//! The curve of one channel of a clip, before it is stored in the tables of a library.

use std::sync::Arc;

use crate::shader::{
    CrowdSpan, FORM_ARC, FORM_CONSTANT, FORM_CUBIC, FORM_CUBIC_KEYS, FORM_KEYS, FORM_LINE,
    FORM_PACKED, POWERS, PolynomialSegment,
};
use crate::time::runs::NONE;

/// One channel before it is stored in the tables: its spans, and the constants of each.
#[derive(Default)]
pub(crate) struct ChannelCurve {
    pub(crate) form: u32,
    /// Curves with the same key times share them.
    pub(crate) spans: Arc<Vec<CrowdSpan>>,
    /// The constants of each span; their number depends on the form.
    pub(crate) constants: Vec<[f32; 4]>,
    /// The key at the start of each span, 0 if there is none. Samples at a tick have its bits if the span says that it
    /// starts there.
    pub(crate) keys: Vec<[f32; 4]>,
    /// The index in its track of each span's key; [`NONE`] if there is none.
    pub(crate) key_indices: Vec<u32>,
    /// Cubics that are stored compactly: the weights of the tangent at each key, and the intervals that are segments, each
    /// with its span. `constants` are the keys.
    pub(crate) weights: Vec<[f32; 4]>,
    pub(crate) segments: Vec<(usize, PolynomialSegment)>,
}

/// The key at the start of a span.
#[derive(Clone, Copy)]
pub(crate) struct SpanKey {
    pub(crate) value: [f32; 4],
    /// Its index in the track; [`NONE`] for a value that is held before the first key.
    pub(crate) index: u32,
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

    /// Adds a span with its constants, as many as the form has.
    pub(crate) fn push(&mut self, span: CrowdSpan, constants: &[[f32; 4]], key: Option<SpanKey>) {
        Arc::make_mut(&mut self.spans).push(span);
        self.constants.extend_from_slice(constants);
        self.keys.push(key.map_or([0.0; 4], |key| key.value));
        self.key_indices.push(key.map_or(NONE, |key| key.index));
    }

    /// The most cells that its constants and keys take in the tables. A compact cubic has a key in a row, and parts of the
    /// row's weights and sources; the others are in the rows for further channels.
    pub(crate) fn cell_bound(&self) -> usize {
        match self.form {
            FORM_CUBIC_KEYS => 3 * self.constants.len() + POWERS * self.segments.len(),
            _ => self.constants.len() + self.keys.len(),
        }
    }

    /// The constants of a span.
    pub(crate) fn constants_at(&self, span: usize) -> &[[f32; 4]] {
        let each = constants_of(self.form);
        &self.constants[span * each..][..each]
    }
}
