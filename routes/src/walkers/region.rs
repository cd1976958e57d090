//! The distances walked and the delays at which two bodies on straight stretches touch.

use glam::{DVec2, DVec3, Vec2Swizzles};

/// Distances that differ by less than this from the sum of the radii, relatively, are equal to it: bodies may touch.
const TOUCH: f64 = 1e-12;

/// The obstacle that one stretch of another body is for one stretch of a route: all (s, w) at which the distance of
/// the bodies is below `reach`. This is a convex region.
#[derive(Debug, Clone)]
pub(super) struct Region {
    /// The distance of the bodies is the length of `offset + along * s + by_delay * w`.
    offset: DVec3,
    along: DVec3,
    by_delay: DVec3,
    reach: f64,
    /// Start and end of the other body's stretch, in seconds.
    from: f64,
    to: f64,
    /// Seconds for each unit of distance.
    slowness: f64,
    /// Start and end of the route's stretch.
    pub(super) start: f64,
    pub(super) end: f64,
}

/// A body on a straight stretch: its position at a parameter, and the derivative by it.
#[derive(Debug, Clone, Copy)]
pub(super) struct StraightMotion {
    pub(super) from: f64,
    pub(super) to: f64,
    /// Position at parameter 0.
    pub(super) origin: DVec3,
    pub(super) rate: DVec3,
}

impl StraightMotion {
    pub(super) fn between((from, one): (f64, DVec3), (to, other): (f64, DVec3)) -> Self {
        let rate = (other - one) / (to - from);
        let rate = if rate.is_finite() { rate } else { DVec3::ZERO };
        Self {
            from,
            to,
            origin: one - from * rate,
            rate,
        }
    }

    pub(super) fn standing(from: f64, to: f64, at: DVec3) -> Self {
        Self {
            from,
            to,
            origin: at,
            rate: DVec3::ZERO,
        }
    }
}

impl Region {
    /// The region of a stretch of the route, which is walked at the speed 1 / `slowness`, and a stretch of another
    /// body.
    pub(super) fn new(
        segment: StraightMotion,
        other: StraightMotion,
        slowness: f64,
        reach: f64,
    ) -> Self {
        Self {
            offset: segment.origin - other.origin,
            along: segment.rate - slowness * other.rate,
            by_delay: -other.rate,
            reach: reach * (1.0 - TOUCH),
            from: other.from,
            to: other.to,
            slowness,
            start: segment.from,
            end: segment.to,
        }
    }

    /// The smallest and the largest s and w of the region between two distances on the route; `None` if it is empty
    /// there.
    ///
    /// On a convex region, a linear function has its extremes where the boundary is perpendicular to its gradient, or
    /// at a corner: of the curve with the lines that bound it, or of two of these lines.
    pub(super) fn extent(&self, start: f64, end: f64) -> Option<(DVec2, DVec2)> {
        let (start, end) = (start.max(self.start), end.min(self.end));
        if start > end {
            return None;
        }
        let slack = TOUCH * (self.reach + self.offset.length() + self.along.length() * end.abs());
        let mut found: Option<(DVec2, DVec2)> = None;
        let mut include = |point: DVec2| {
            let time = point.y + self.slowness * point.x;
            let is_within = point.is_finite()
                && point.x >= start - TOUCH * (1.0 + start.abs())
                && point.x <= end + TOUCH * (1.0 + end.abs())
                && time >= self.from - TOUCH * (1.0 + self.from.abs())
                && (self.to == f64::INFINITY || time <= self.to + TOUCH * (1.0 + self.to.abs()))
                && self.distance(point) <= self.reach + slack;
            if is_within {
                let (low, high) = found.get_or_insert((point, point));
                (*low, *high) = (low.min(point), high.max(point));
            }
        };
        let (a, b, c) = (self.along, self.by_delay, self.offset);
        // At these points the boundary has an extreme: one partial derivative is 0.
        for (main, other, swap) in [(a, b, false), (b, a, true)] {
            if main.length_squared() > 0.0 {
                // main coordinate = p + q * other coordinate
                let p = -main.dot(c) / main.length_squared();
                let q = -main.dot(other) / main.length_squared();
                for value in self.roots(c + p * main, other + q * main) {
                    let point = DVec2::new(p + q * value, value);
                    include(if swap { point.yx() } else { point });
                }
            }
        }
        // The boundary also has corners at the bounds of the route and of time, where w = time - slowness * s.
        let times = [self.from, self.to]
            .into_iter()
            .filter(|time| time.is_finite());
        for s in [start, end] {
            for w in self.roots(c + s * a, b) {
                include(DVec2::new(s, w));
            }
            for time in times.clone() {
                include(DVec2::new(s, time - self.slowness * s));
            }
        }
        for time in times {
            for s in self.roots(c + time * b, a - self.slowness * b) {
                include(DVec2::new(s, time - self.slowness * s));
            }
        }
        // A body that stays forever blocks all delays from some delay on.
        let (low, mut high) = found?;
        if self.to == f64::INFINITY {
            high.y = f64::INFINITY;
        }
        Some((low, high))
    }

    /// Distance between the centres of both bodies.
    fn distance(&self, at: DVec2) -> f64 {
        (self.offset + at.x * self.along + at.y * self.by_delay).length()
    }

    /// The x at which `offset + x * rate` has the length `reach`.
    fn roots(&self, offset: DVec3, rate: DVec3) -> Vec<f64> {
        let square = rate.length_squared();
        if square == 0.0 {
            return Vec::new();
        }
        let middle = -offset.dot(rate) / square;
        let nearest = (offset + middle * rate).length();
        let rest = (self.reach - nearest) * (self.reach + nearest);
        if rest < 0.0 {
            return Vec::new();
        }
        let half = (rest / square).sqrt();
        vec![middle - half, middle + half]
    }
}
