//! The ranges of a curve that one polynomial fits, and constants of the basis functions there: values and derivatives
//! at the middle, and their differences (gains) from the middle to each node.

use crate::fit::nodes::{DEGREE_8_END_NODES, END_NODES, HALF_END_NODES, Nodes};

/// The squared extents (sums of the three half-rotation vectors' squares) up to which [`WHOLE_DEGREE_8`] and
/// [`WHOLE`] fit curves with a truncation error of at most 7e-8 in a component. For every longer curve that is
/// computed directly from keys, a fit in two halves has a smaller error.
pub(crate) const LONGEST_DEGREE_8: f64 = 0.01;
pub(crate) const LONGEST_WHOLE: f64 = 0.16;

/// A range of the parameter, relative to the start of the curve or backwards from its end, and the nodes at which
/// curves are sampled there. Values and derivatives at the range's ends and at its middle need no sampling.
pub(crate) struct FitRange<const SAMPLED: usize, const PAIRS: usize> {
    pub(crate) nodes: &'static Nodes<PAIRS>,
    pub(crate) middle: BasisValues,
    /// Half of the basis functions' second derivatives at the middle.
    pub(crate) bends: [f32; 3],
    /// The differences of the basis functions at `-s` and at `s` from the middle, for each node
    /// `s` that is sampled.
    pub(crate) gains: [[[f32; 3]; 2]; SAMPLED],
    /// The factor from a half-rotation vector at a key to the derivative there, by the range's
    /// parameter.
    pub(crate) slope: f32,
}

/// The whole curve by degree 8; the others use degree 10.
pub(crate) const WHOLE_DEGREE_8: FitRange<1, 4> = FitRange::new(&DEGREE_8_END_NODES, 0.5, 1.0);
pub(crate) const WHOLE: FitRange<2, 5> = FitRange::new(&END_NODES, 0.5, 1.0);
pub(crate) const HALF: FitRange<2, 5> = FitRange::new(&HALF_END_NODES, 0.25, 0.5);
/// The second half, sampled backwards from the end of the curve.
pub(crate) const LAST_HALF: FitRange<2, 5> = HALF.backward();
/// The parameter at which both halves meet.
pub(crate) const SEAM: BasisValues = BasisValues::new(0.5, 0.5);

/// The basis functions at one value of the parameter, and their derivatives by a range's parameter.
pub(crate) struct BasisValues {
    pub(crate) weights: [f32; 3],
    pub(crate) rates: [f32; 3],
}

impl BasisValues {
    /// At `m` of the whole parameter, for a range that is `width` of the whole.
    const fn new(m: f64, width: f64) -> Self {
        let n = 1.0 - m;
        Self {
            weights: [
                (1.0 - n * n * n) as f32,
                ((3.0 - 2.0 * m) * m * m) as f32,
                (m * m * m) as f32,
            ],
            rates: [
                (3.0 * n * n * width) as f32,
                (6.0 * m * n * width) as f32,
                (3.0 * m * m * width) as f32,
            ],
        }
    }
}

impl<const SAMPLED: usize, const PAIRS: usize> FitRange<SAMPLED, PAIRS> {
    const fn new(nodes: &'static Nodes<PAIRS>, middle: f64, width: f64) -> Self {
        let (m, square) = (middle, width * width);
        let mut range = Self {
            nodes,
            middle: BasisValues::new(middle, width),
            bends: [
                (-3.0 * (1.0 - m) * square) as f32,
                ((3.0 - 6.0 * m) * square) as f32,
                (3.0 * m * square) as f32,
            ],
            gains: [[[0.0; 3]; 2]; SAMPLED],
            slope: (3.0 * width) as f32,
        };
        let mut k = 0;
        while k < SAMPLED {
            // The first node is the middle, which is not sampled.
            let s = nodes.at[k + 1] as f64 * width;
            range.gains[k] = [gains(m, -s), gains(m, s)];
            k += 1;
        }
        range
    }
}

impl FitRange<2, 5> {
    /// The range for a parameter that runs backwards. The three basis functions are exchanged, because `1 - Bᵢ(1 - t)
    /// = B₄₋ᵢ(t)`.
    const fn backward(mut self) -> Self {
        self.middle.weights = backward(self.middle.weights);
        self.middle.rates = backward(self.middle.rates);
        self.bends = backward(self.bends);
        let [[a, b], [c, d]] = self.gains;
        self.gains = [[backward(a), backward(b)], [backward(c), backward(d)]];
        self
    }
}

const fn backward<N: Copy>([first, second, third]: [N; 3]) -> [N; 3] {
    [third, second, first]
}

/// The differences `Bᵢ(m + d) - Bᵢ(m)` of the three basis functions.
const fn gains(m: f64, d: f64) -> [f32; 3] {
    let n = 1.0 - m;
    [
        (((d - 3.0 * n) * d + 3.0 * n * n) * d) as f32,
        (((3.0 - 6.0 * m - 2.0 * d) * d + 6.0 * m * n) * d) as f32,
        (((d + 3.0 * m) * d + 3.0 * m * m) * d) as f32,
    ]
}
