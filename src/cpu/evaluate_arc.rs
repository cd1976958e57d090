//! Twin of `shaders/evaluate_arc.wgsl`: the same names, the same order.

use super::evaluate::Evaluate;
use super::sine_cosine::sine_cosine;
use crate::segment::ArcSegment;

impl Evaluate for ArcSegment {
    #[inline(always)]
    fn evaluate(&self, angle: f32) -> [f32; 4] {
        let segment = self;
        let turn = sine_cosine(angle);
        std::array::from_fn(|i| segment.middle[i] * turn.1 + segment.partner[i] * turn.0)
    }
}
