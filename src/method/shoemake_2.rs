//! Shoemake's approach II, from the lecture.

use crate::fit::exact::shape::DE_CASTELJAU;
use crate::method::shoemake::Bisector;
use crate::method::vector_method::VectorMethod;
use crate::method::{Cost, CurveKind, Method, SmoothCurves, defaults, ends};

/// Approach II of Shoemake's lecture: the handle is at half of the arc from the key to the bisector. At its keys the
/// curve is one and a half times too fast; [`SHOEMAKE_1985`](crate::method::SHOEMAKE_1985) corrects this.
pub const SHOEMAKE_2: Method = Method {
    name: "shoemake-2",
    summary: "historical, for comparison only; its speed at a key is 1.5 times that of a smooth curve",
    formula: "a_i = Bisect(q_i, Bisect(Double(q_{i-1}, q_i), q_{i+1})), b_i = Double(a_i, q_i), de Casteljau",
    source: "Shoemake 1985 as lectured, approach II",
    cost: Cost::new(700.0, 3.1),
    curves: &CURVES,
    ..defaults(VectorMethod::BesselOverhauser)
};

static CURVES: CurveKind = CurveKind::Smooth(SmoothCurves::new(
    &DE_CASTELJAU,
    ends::curves::<Bisector<2>>,
));
