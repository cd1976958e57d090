//! The speed of a body on its path: by its keys, constant, or eased in and out.

/// The speed of a body on its path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub enum PathSpeed {
    /// According to the key times.
    #[default]
    Keys,
    /// Constant from the first key time to the last.
    Constant,
    /// From rest to rest: the speed increases (as smoothstep) at the start, decreases at the end, and is constant
    /// between.
    Eased {
        /// The fraction of the time in which the speed increases.
        start: f64,
        /// The fraction of the time in which the speed decreases. The sum of both is at most 1.
        end: f64,
    },
}

impl PathSpeed {
    /// The fraction of the time at which a fraction of the length is covered.
    pub(crate) fn moment(self, part: f64) -> f64 {
        let Self::Eased { start, end } = self else {
            return part;
        };
        let top = 2.0 / (2.0 - start - end);
        // In the middle part, the speed is constant.
        let x = part / top + 0.5 * start;
        if x >= start && x <= 1.0 - end {
            return x;
        }
        let (mut low, mut high) = match x < start {
            true => (0.0, start),
            false => (1.0 - end, 1.0),
        };
        // After 64 steps the interval is 2^-64 of the time, which is below the resolution of f64.
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

/// The fraction of the length that is covered at the fraction `x` of the time. The speed increases as smoothstep over
/// the fraction `a` of the time, and decreases over the fraction `b`.
pub(crate) fn eased(a: f64, b: f64, x: f64) -> f64 {
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
pub(crate) fn eased_speed(a: f64, b: f64, x: f64) -> f64 {
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
