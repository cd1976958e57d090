//! Chebyshev nodes, and what leads from values at them to coefficients of powers.

/// Chebyshev nodes on one side of the middle, which is one more.
pub(super) struct Nodes<const PAIRS: usize> {
    /// In the order in which Newton's polynomials take them: chosen for what f32 rounds.
    pub(super) at: [f32; PAIRS],
    pub(super) squares: [f32; PAIRS],
    /// `1/(2s²)` and `1/(2s)`: from the sum of the differences at `-s` and `s`, and from what
    /// they differ by, to polynomials in s².
    pub(super) even: [f32; PAIRS],
    pub(super) odd: [f32; PAIRS],
    /// `quotients[l][k]` is 1 / (sₖ² - sₖ₋ₗ²).
    pub(super) quotients: [[f32; PAIRS]; PAIRS],
}

/// Nodes of degree 7.
pub(super) const GENTLE_NODES: Nodes<3> = Nodes::new([0.39091575, 0.21694186, 0.48746395]);

/// Nodes of degree 11.
pub(super) const FULL_NODES: Nodes<5> =
    Nodes::new([0.45481598, 0.49491072, 0.14086628, 0.27032042, 0.3778748]);

impl<const PAIRS: usize> Nodes<PAIRS> {
    const fn new(at: [f32; PAIRS]) -> Self {
        let mut nodes = Self {
            at,
            squares: [0.0; PAIRS],
            even: [0.0; PAIRS],
            odd: [0.0; PAIRS],
            quotients: [[0.0; PAIRS]; PAIRS],
        };
        let mut k = 0;
        while k < PAIRS {
            let s = at[k] as f64;
            nodes.squares[k] = (s * s) as f32;
            nodes.even[k] = (0.5 / (s * s)) as f32;
            nodes.odd[k] = (0.5 / s) as f32;
            let mut l = 1;
            while l <= k {
                let other = at[k - l] as f64;
                nodes.quotients[l][k] = (1.0 / (s * s - other * other)) as f32;
                l += 1;
            }
            k += 1;
        }
        nodes
    }
}
