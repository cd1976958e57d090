//! Arc lengths of a curve, for constant speed.

use crate::reference::segment::Segment;

/// The number of panels of each segment; each is integrated by Gauss quadrature with three points.
const PANELS: usize = 256;

/// Lengths of curves in radians.
pub(crate) struct CurveLengths {
    /// The arc length at the end of every panel of every segment.
    lengths: Vec<f64>,
}

impl CurveLengths {
    pub(crate) fn new(segments: &[Segment]) -> Self {
        let mut lengths = vec![0.0];
        for segment in segments {
            for panel in 0..PANELS {
                let [from, to] = [panel, panel + 1].map(|panel| panel as f64 / PANELS as f64);
                let before = lengths[lengths.len() - 1];
                lengths.push(before + arc_length(segment, from, to));
            }
        }
        Self { lengths }
    }

    pub(crate) fn total(&self) -> f64 {
        self.lengths[self.lengths.len() - 1]
    }

    /// The segment and its parameter at which the curve has covered a fraction, 0 to 1, of its length.
    pub(crate) fn locate(&self, segments: &[Segment], part: f64) -> (usize, f64) {
        let target = part * self.total();
        let panels = self.lengths.len() - 1;
        let after = self.lengths.partition_point(|&length| length <= target);
        let panel = after.saturating_sub(1).min(panels - 1);
        let segment = panel / PANELS;
        let from = (panel % PANELS) as f64 / PANELS as f64;
        let rest = target - self.lengths[panel];
        let is_before = |t: f64| arc_length(&segments[segment], from, t) < rest;
        (
            segment,
            bisected(from, from + 1.0 / PANELS as f64, is_before),
        )
    }
}

fn arc_length(segment: &Segment, from: f64, to: f64) -> f64 {
    gauss(|t| segment.velocity(t).length(), from, to)
}

/// Gauss' quadrature with three points.
pub(crate) fn gauss(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    let (middle, half) = ((from + to) / 2.0, (to - from) / 2.0);
    let node = 0.6f64.sqrt();
    half * (5.0 * f(middle - half * node) + 8.0 * f(middle) + 5.0 * f(middle + half * node)) / 9.0
}

/// The end of the subinterval in which `is_before` is true.
pub(crate) fn bisected(mut low: f64, mut high: f64, is_before: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if is_before(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low + high) / 2.0
}
