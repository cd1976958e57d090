//! When a body is where on its path, and where it is when.

use std::ops::Range;

use crate::path::options::PathSpeed;
use crate::path::route::Route;

impl Route {
    /// When the path starts and ends.
    pub(crate) fn span(&self) -> (f64, f64) {
        (self.times[0], self.times[self.times.len() - 1])
    }

    /// The key times between which an interval lies.
    pub(crate) fn keys_of(&self, interval: usize) -> [f64; 2] {
        [self.times[interval], self.times[interval + 1]]
    }

    /// Whether a body is where its speed says, and not where its keys do.
    pub(crate) fn is_retimed(&self) -> bool {
        self.speed != PathSpeed::Keys && self.lengths.total() > 0.0
    }

    /// Whether a body stands on its path, of which it may turn all the same.
    pub(crate) fn stands(&self) -> bool {
        self.speed != PathSpeed::Keys && !self.is_retimed()
    }

    /// The time of a place in an interval.
    pub(crate) fn time(&self, interval: usize, t: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return if t == 1.0 { to } else { from + (to - from) * t };
        }
        let (start, end) = self.span();
        let part = self.lengths.at(interval, t) / self.lengths.total();
        start + (end - start) * self.speed.moment(part.min(1.0))
    }

    /// The parameter of an interval at a time in it.
    pub(crate) fn parameter(&self, interval: usize, time: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return ((time - from) / (to - from)).clamp(0.0, 1.0);
        }
        self.lengths.parameter(interval, self.length(time))
    }

    /// The interval and its parameter at a time.
    pub(crate) fn place(&self, time: f64) -> (usize, f64) {
        let interval = if self.speed == PathSpeed::Keys {
            let last = self.curves.len() - 1;
            let after = self.times.partition_point(|&key| key <= time);
            after.saturating_sub(1).min(last)
        } else {
            self.lengths.interval(self.length(time))
        };
        (interval, self.parameter(interval, time))
    }

    /// The change of time with an interval's parameter where its curve has this speed.
    pub(crate) fn pace(&self, interval: usize, t: f64, speed: f64) -> f64 {
        if self.speed == PathSpeed::Keys {
            let [from, to] = self.keys_of(interval);
            return to - from;
        }
        let (start, end) = self.span();
        let total = self.lengths.total();
        let rate = match self.speed {
            PathSpeed::Eased { start, end } => {
                let x = self.speed.moment(self.lengths.at(interval, t) / total);
                eased_speed(start, end, x)
            }
            _ => 1.0,
        };
        speed * (end - start) / (total * rate).max(1e-300)
    }

    /// The times at which the speed is not smooth, inside of a range.
    pub(crate) fn joints(&self, times: Range<f64>) -> impl Iterator<Item = f64> + use<> {
        let (from, to) = self.span();
        let parts = match self.speed {
            PathSpeed::Eased { start, end } => [start, 1.0 - end],
            _ => [0.0; 2],
        };
        let joints = parts.map(|part| from + (to - from) * part).into_iter();
        joints.filter(move |&time| time > times.start && time < times.end)
    }

    /// The length covered at a time.
    fn length(&self, time: f64) -> f64 {
        let (start, end) = self.span();
        let x = ((time - start) / (end - start)).clamp(0.0, 1.0);
        self.lengths.total()
            * match self.speed {
                PathSpeed::Eased { start, end } => eased(start, end, x),
                _ => x,
            }
    }
}

impl PathSpeed {
    /// The part of the time at which a part of the length is covered.
    fn moment(self, part: f64) -> f64 {
        let Self::Eased { start, end } = self else {
            return part;
        };
        let top = 2.0 / (2.0 - start - end);
        // In the middle the speed is constant.
        let x = part / top + 0.5 * start;
        if x >= start && x <= 1.0 - end {
            return x;
        }
        let (mut low, mut high) = match x < start {
            true => (0.0, start),
            false => (1.0 - end, 1.0),
        };
        // Half of 2^-64 of the time is below the resolution of f64.
        for _ in 0..64 {
            let middle = 0.5 * (low + high);
            if eased(start, end, middle) < part {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

/// The part of the length covered at the part `x` of the time: the speed grows as smoothstep over
/// the part `a` of the time, and falls so over the part `b`.
fn eased(a: f64, b: f64, x: f64) -> f64 {
    let top = 2.0 / (2.0 - a - b);
    let rise = |part: f64, x: f64| {
        let y = x / part;
        top * part * (y * y * y * (1.0 - 0.5 * y))
    };
    if x < a {
        rise(a, x)
    } else if x > 1.0 - b {
        1.0 - rise(b, 1.0 - x)
    } else {
        top * (x - 0.5 * a)
    }
}

/// The derivative of [`eased`].
fn eased_speed(a: f64, b: f64, x: f64) -> f64 {
    let smooth = |y: f64| y * y * (3.0 - 2.0 * y);
    let top = 2.0 / (2.0 - a - b);
    if x < a {
        top * smooth(x / a)
    } else if x > 1.0 - b {
        top * smooth((1.0 - x) / b)
    } else {
        top
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eased_speed_and_back() {
        let speed = PathSpeed::Eased {
            start: 0.2,
            end: 0.3,
        };
        let expected = [
            (0.1, 0.025),
            (0.2, 2.0 / 15.0),
            (0.5, 8.0 / 15.0),
            (0.7, 0.8),
            (0.9, 0.987654321),
        ];
        for (x, s) in expected {
            assert!((eased(0.2, 0.3, x) - s).abs() < 1e-9);
            assert!((speed.moment(eased(0.2, 0.3, x)) - x).abs() < 1e-12);
            let slope = (eased(0.2, 0.3, x + 1e-6) - eased(0.2, 0.3, x - 1e-6)) / 2e-6;
            assert!((eased_speed(0.2, 0.3, x) - slope).abs() < 1e-6);
        }
    }
}
