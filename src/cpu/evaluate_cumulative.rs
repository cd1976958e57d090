//! Twin of `shaders/evaluate_cumulative.wgsl`: the same names, the same order.

use super::evaluate::Evaluate;
use super::sine_cosine::sine_cosine;
use crate::segment::CumulativeSegment;

impl Evaluate for CumulativeSegment {
    #[inline(always)]
    fn evaluate(&self, s: f32) -> [f32; 4] {
        let segment = self;
        let angle =
            |j: usize| ((segment.cubic[j] * s + segment.quadratic[j]) * s + segment.linear[j]) * s;
        let first = sine_cosine(angle(0));
        let second = sine_cosine(angle(1));
        let third = sine_cosine(angle(2));
        let cc = second.1 * third.1;
        let cs = second.1 * third.0;
        let sc = second.0 * third.1;
        let ss = second.0 * third.0;
        let terms = &segment.terms;
        std::array::from_fn(|i| {
            let even = terms[0][i] * cc + terms[1][i] * cs + terms[2][i] * sc + terms[3][i] * ss;
            let odd = terms[4][i] * cc + terms[5][i] * cs + terms[6][i] * sc + terms[7][i] * ss;
            even * first.1 + odd * first.0
        })
    }
}
