//! Integrals by Gauss-Legendre quadrature.

/// Points and weights of Gauss-Legendre quadrature on [-1, 1], exact for polynomials of degree 9.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// The integral of a function by one quadrature.
pub(crate) fn gauss(function: &impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let weighted = |&(at, weight): &(f64, f64)| weight * function(middle + half * at);
    half * GAUSS.iter().map(weighted).sum::<f64>()
}

/// The integral of a function. The interval is halved, at most a number of times, while the sum of both halves
/// differs from the whole. `differ` gets the whole and the sum.
pub(crate) fn integral(
    function: &impl Fn(f64) -> f64,
    from: f64,
    to: f64,
    halvings: u32,
    differ: &impl Fn(f64, f64) -> bool,
) -> f64 {
    let whole = gauss(function, from, to);
    refined(function, from, to, whole, halvings, differ)
}

fn refined(
    function: &impl Fn(f64) -> f64,
    from: f64,
    to: f64,
    whole: f64,
    halvings: u32,
    differ: &impl Fn(f64, f64) -> bool,
) -> f64 {
    let middle = 0.5 * (from + to);
    let [first, second] = [(from, middle), (middle, to)].map(|(a, b)| gauss(function, a, b));
    let sum = first + second;
    if halvings == 0 || !differ(whole, sum) {
        return sum;
    }
    refined(function, from, middle, first, halvings - 1, differ)
        + refined(function, middle, to, second, halvings - 1, differ)
}
