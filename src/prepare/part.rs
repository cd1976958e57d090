//! Parts of curves that are fitted by one polynomial each, and what their basis functions do
//! there.

use super::fit::TOLERANCE;
use super::nodes::{END_NODES, FULL_NODES, GENTLE_NODES, Nodes};

/// A part of curves' parameter, and the nodes at which they are sampled there: all of them,
/// or all but the ends, where keys and handles say what the curve does.
pub(super) struct Part<const SAMPLED: usize, const PAIRS: usize> {
    pub(super) nodes: &'static Nodes<PAIRS>,
    /// The basis functions at its middle.
    pub(super) weights: [f32; 3],
    /// What they gain from there on, up to `-s` and to `s` at each node `s` that is sampled.
    pub(super) gains: [[[Gain; 2]; 3]; SAMPLED],
    /// See [`TOLERANCE`].
    pub(super) tolerance: f32,
    /// Of all, not of less: there the second gains as much after the middle as before.
    pub(super) is_whole: bool,
}

/// Always near enough.
pub(super) const GENTLE_WHOLE: Part<3, 3> = Part {
    tolerance: f32::INFINITY,
    ..Part::new(&GENTLE_NODES, 0.5, 1.0)
};
pub(super) const WHOLE: Part<3, 5> = Part::new(&END_NODES, 0.5, 1.0);
pub(super) const HALVES: [Part<5, 5>; 2] = [
    Part::new(&FULL_NODES, 0.25, 0.5),
    Part::new(&FULL_NODES, 0.75, 0.5),
];
pub(super) const QUARTERS: [Part<5, 5>; 4] = [
    Part::new(&FULL_NODES, 0.125, 0.25),
    Part::new(&FULL_NODES, 0.375, 0.25),
    Part::new(&FULL_NODES, 0.625, 0.25),
    Part::new(&FULL_NODES, 0.875, 0.25),
];

/// Above this hardly any curve is fitted in halves.
pub(super) const LONGEST_HALVED: f64 = 0.6;

impl<const SAMPLED: usize, const PAIRS: usize> Part<SAMPLED, PAIRS> {
    const fn new(nodes: &'static Nodes<PAIRS>, middle: f64, width: f64) -> Self {
        let (m, n) = (middle, 1.0 - middle);
        let mut part = Self {
            nodes,
            weights: [
                (1.0 - n * n * n) as f32,
                ((3.0 - 2.0 * m) * m * m) as f32,
                (m * m * m) as f32,
            ],
            gains: [[[Gain::new(0.0); 2]; 3]; SAMPLED],
            tolerance: TOLERANCE,
            is_whole: width == 1.0,
        };
        let mut k = 0;
        while k < SAMPLED {
            let s = nodes.at[k] as f64 * width;
            let (before, after) = (gains(m, -s), gains(m, s));
            let mut j = 0;
            while j < 3 {
                part.gains[k][j] = [before[j], after[j]];
                j += 1;
            }
            k += 1;
        }
        part
    }
}

/// What the basis functions have at `m + d` more than at `m`.
const fn gains(m: f64, d: f64) -> [Gain; 3] {
    let n = 1.0 - m;
    [
        Gain::new(((d - 3.0 * n) * d + 3.0 * n * n) * d),
        Gain::new(((3.0 - 6.0 * m - 2.0 * d) * d + 6.0 * m * n) * d),
        Gain::new(((d + 3.0 * m) * d + 3.0 * m * m) * d),
    ]
}

/// What a basis function gains.
#[derive(Clone, Copy)]
pub(super) struct Gain {
    pub(super) gain: f32,
    pub(super) squared: f32,
}

impl Gain {
    const fn new(gain: f64) -> Self {
        let gain = gain as f32;
        Self {
            gain,
            squared: gain * gain,
        }
    }
}
