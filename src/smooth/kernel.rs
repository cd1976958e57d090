//! Smoothing kernels: symmetric weights of neighbouring samples, whose sum is 1.

use std::fmt;
use std::str::FromStr;

use crate::names::fields::with_fields;
use crate::names::names;

/// Options for smoothing samples ([`Engine::smooth`](crate::engine::Engine::smooth)).
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Smoothing {
    /// The weights.
    pub kernel: SmoothingKernel,
    /// The assumed values before the first and after the last sample.
    pub ends: SmoothingEnds,
    /// The number of times that the kernel is applied.
    pub passes: u32,
}

with_fields! {
    Smoothing:
    with_kernel(kernel: SmoothingKernel),
    with_ends(ends: SmoothingEnds),
    with_passes(passes: u32),
}

/// The weights of a sample and its neighbours. Each weight is the integral of a function over the neighbour's cell,
/// from half a sample before the neighbour to half a sample after it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SmoothingKernel {
    /// ¼, ½, ¼.
    Linear,
    /// (-1, 4, 6, 4, -1)/12: cubics stay unchanged. The second sample from each end is smoothed by the cubic through
    /// four samples. With fewer than four samples this kernel is [`SmoothingKernel::Linear`].
    Cubic,
    /// Equal weights up to this many samples on each side.
    Box(f64),
    /// Weights that decrease linearly to 0 at this many samples on each side.
    Tent(f64),
    /// A Gaussian with this standard deviation in samples, cut off at four standard deviations.
    Gaussian(f64),
    /// The polynomial of this order that is fitted by least squares to the samples within the radius (Savitzky and
    /// Golay 1964).
    SavitzkyGolay {
        /// The number of samples on each side.
        radius: usize,
        /// The order of the polynomial, at most twice the radius.
        order: usize,
    },
}

/// The assumed values before the first and after the last sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[non_exhaustive]
pub enum SmoothingEnds {
    /// The steps are mirrored, so that the first and the last sample stay unchanged.
    #[default]
    Keep,
    /// As [`SmoothingEnds::Keep`], but each end sample is replaced by the value of the parabola through the next
    /// three samples. Only for [`SmoothingKernel::Cubic`].
    Parabolic,
    /// The samples are periodic: the last repeats the first.
    Loop,
}

names! {
    SmoothingEnds, "kind of ends",
    Keep => "keep",
    Parabolic => "parabolic",
    Loop => "loop",
}

/// Why samples cannot be smoothed as requested.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SmoothingError {
    /// A width is not positive, or too large.
    #[error("a kernel cannot be {width} samples wide; give a width above 0 and up to 250000")]
    Width {
        /// The width.
        width: f64,
    },
    /// The polynomial's order is more than twice the radius, or too high for f64.
    #[error("a polynomial of order {order} through {radius} samples to either side has no unique least-squares fit; give an order of at most {}", 2 * radius)]
    Order {
        /// The number of samples on each side.
        radius: usize,
        /// The order.
        order: usize,
    },
    /// The frequency of a low-pass filter is not between 0 and half the sample rate.
    #[error(
        "a low-pass at {hz} Hz has no effect on samples at {rate} Hz, which contain no frequencies above {} Hz; give a lower frequency above 0",
        0.5 * rate
    )]
    Frequency {
        /// The frequency in Hz.
        hz: f64,
        /// The number of samples per second.
        rate: f64,
    },
    /// There are too many passes.
    #[error("{passes} passes are too many; give at most {MAX_PASSES}, or a wider kernel")]
    Passes {
        /// The number of passes.
        passes: u32,
    },
    /// [`SmoothingEnds::Parabolic`] is requested for a kernel other than the cubic one.
    #[error("parabolic ends apply only to the cubic kernel; choose other ends")]
    Ends,
    /// No kernel has this name.
    #[error(
        "unknown kernel `{name}`: choose linear, cubic, box:S, tent:S, gaussian:S or savitzky-golay:RADIUS:ORDER"
    )]
    Unknown {
        /// The name.
        name: String,
    },
}

/// The largest radius of a kernel, samples.
const MAX_RADIUS: usize = 1_000_000;

/// The maximum number of passes; more would take very long.
const MAX_PASSES: u32 = 10_000;

/// The maximum order of Savitzky and Golay's polynomials for which f64 is accurate enough.
const MAX_ORDER: usize = 20;

impl Smoothing {
    /// Smoothing in one pass, with unchanged ends.
    #[must_use]
    pub fn new(kernel: SmoothingKernel) -> Self {
        Self {
            kernel,
            ends: SmoothingEnds::Keep,
            passes: 1,
        }
    }

    /// Refuses invalid options.
    ///
    /// # Errors
    /// The first error that is found.
    pub fn check(&self) -> Result<(), SmoothingError> {
        self.step_weights(usize::MAX).map(drop)
    }

    /// The weights `b_m` of the steps: `b_m = a_{m+1} + … + a_r` for the weights `a` of samples.
    pub(crate) fn step_weights(&self, samples: usize) -> Result<Vec<f32>, SmoothingError> {
        if self.ends == SmoothingEnds::Parabolic && self.kernel != SmoothingKernel::Cubic {
            return Err(SmoothingError::Ends);
        }
        if self.passes > MAX_PASSES {
            let passes = self.passes;
            return Err(SmoothingError::Passes { passes });
        }
        let kernel = match self.kernel {
            SmoothingKernel::Cubic if samples < 4 => SmoothingKernel::Linear,
            kernel => kernel,
        };
        let weights = kernel.weights()?;
        let mut sum = 0.0;
        let mut steps: Vec<f32> = weights[1..]
            .iter()
            .rev()
            .map(|weight| {
                sum += weight;
                sum as f32
            })
            .collect();
        steps.reverse();
        Ok(steps)
    }
}

impl SmoothingKernel {
    /// The Gaussian that halves the power of motion at the frequency `hz`, for samples at the rate `rate`, both in
    /// Hz. Its spectrum, exp(-(2π f σ)²/2), is 1/√2 at this frequency and ¼ at twice the frequency.
    ///
    /// # Errors
    /// When the frequency is not between 0 and half the rate, or the Gaussian is too wide.
    pub fn low_pass(hz: f64, rate: f64) -> Result<Self, SmoothingError> {
        if !(hz > 0.0 && hz < 0.5 * rate && rate.is_finite()) {
            return Err(SmoothingError::Frequency { hz, rate });
        }
        let deviation = rate * std::f64::consts::LN_2.sqrt() / (std::f64::consts::TAU * hz);
        let kernel = Self::Gaussian(deviation);
        Smoothing::new(kernel).check()?;
        Ok(kernel)
    }

    /// The weights of a sample and of each neighbour on one side.
    pub(crate) fn weights(self) -> Result<Vec<f64>, SmoothingError> {
        let checked = |width: f64| match width > 0.0 && width <= MAX_RADIUS as f64 / 4.0 {
            true => Ok(width),
            false => Err(SmoothingError::Width { width }),
        };
        let reach = match self {
            Self::Linear => return Ok(vec![0.5, 0.25]),
            Self::Cubic => return Ok([6.0, 4.0, -1.0].map(|a| a / 12.0).to_vec()),
            Self::SavitzkyGolay { radius, order } => return savitzky_golay(radius, order),
            Self::Box(half) | Self::Tent(half) => checked(half)?,
            Self::Gaussian(deviation) => 4.0 * checked(deviation)?,
        };
        let last = ((reach + 0.5).ceil() as usize).saturating_sub(1);
        let cell = |i: usize| self.mass(i as f64 - 0.5, i as f64 + 0.5);
        let mut weights: Vec<f64> = (0..=last).map(cell).collect();
        let sum = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
        for weight in &mut weights {
            *weight /= sum;
        }
        Ok(weights)
    }

    /// The integral of the kernel's function between two positions.
    fn mass(self, from: f64, to: f64) -> f64 {
        let up_to = |x: f64| match self {
            Self::Tent(half) => {
                let y = (x / half).clamp(-1.0, 1.0);
                y - 0.5 * y * y.abs()
            }
            Self::Gaussian(deviation) => {
                let y = (x / deviation).clamp(-4.0, 4.0);
                libm::erf(y * std::f64::consts::FRAC_1_SQRT_2)
            }
            Self::Box(half) => (x / half).clamp(-1.0, 1.0),
            _ => 0.0,
        };
        up_to(to) - up_to(from)
    }
}

/// The weights of the samples for the fitted polynomial's value at the middle, from polynomials that are orthogonal
/// over the samples (Gram), by their recurrence.
fn savitzky_golay(radius: usize, order: usize) -> Result<Vec<f64>, SmoothingError> {
    if order > 2 * radius || order > MAX_ORDER {
        return Err(SmoothingError::Order { radius, order });
    }
    if radius > MAX_RADIUS {
        return Err(SmoothingError::Width {
            width: radius as f64,
        });
    }
    let positions: Vec<f64> = (0..=2 * radius).map(|i| i as f64 - radius as f64).collect();
    let scale = (radius as f64).max(1.0);
    let mut weights = vec![0.0; 2 * radius + 1];
    let mut before = vec![0.0; positions.len()];
    let mut current = vec![1.0; positions.len()];
    let mut norm_before = 1.0;
    for degree in 0..=order {
        let norm: f64 = current.iter().map(|value| value * value).sum();
        let at_middle = current[radius];
        for (weight, value) in weights.iter_mut().zip(&current) {
            *weight += at_middle * value / norm;
        }
        let back = if degree == 0 { 0.0 } else { norm / norm_before };
        let next = |i: usize| positions[i] / scale * current[i] - back * before[i];
        let next: Vec<f64> = (0..current.len()).map(next).collect();
        before = std::mem::replace(&mut current, next);
        norm_before = norm;
    }
    Ok(weights.split_off(radius))
}

impl FromStr for SmoothingKernel {
    type Err = SmoothingError;

    fn from_str(name: &str) -> Result<Self, SmoothingError> {
        let unknown = || SmoothingError::Unknown {
            name: name.to_owned(),
        };
        let parts: Vec<&str> = name.split(':').collect();
        let number = |text: &str| text.parse::<f64>().map_err(|_| unknown());
        let whole = |text: &str| text.parse::<usize>().map_err(|_| unknown());
        match parts[..] {
            ["linear"] => Ok(Self::Linear),
            ["cubic"] => Ok(Self::Cubic),
            ["box", half] => Ok(Self::Box(number(half)?)),
            ["tent", half] => Ok(Self::Tent(number(half)?)),
            ["gaussian", deviation] => Ok(Self::Gaussian(number(deviation)?)),
            ["savitzky-golay", radius, order] => Ok(Self::SavitzkyGolay {
                radius: whole(radius)?,
                order: whole(order)?,
            }),
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for SmoothingKernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Linear => f.write_str("linear"),
            Self::Cubic => f.write_str("cubic"),
            Self::Box(half) => write!(f, "box:{half}"),
            Self::Tent(half) => write!(f, "tent:{half}"),
            Self::Gaussian(deviation) => write!(f, "gaussian:{deviation}"),
            Self::SavitzkyGolay { radius, order } => write!(f, "savitzky-golay:{radius}:{order}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn assert_weights(name: &str, expected: &[f64]) {
        let weights = name.parse::<SmoothingKernel>().unwrap().weights().unwrap();
        assert_eq!(weights.len(), expected.len(), "{weights:?}");
        for (found, expected) in weights.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{weights:?}");
        }
    }

    #[test]
    fn weights_are_integrals_over_cells() {
        assert_weights("tent:1", &[0.75, 0.125]);
        assert_weights("tent:2", &[7.0 / 16.0, 0.25, 1.0 / 32.0]);
        assert_weights("box:2.25", &[2.0 / 9.0, 2.0 / 9.0, 1.0 / 6.0]);
        assert_weights(
            "savitzky-golay:2:2",
            &[17.0 / 35.0, 12.0 / 35.0, -3.0 / 35.0],
        );
    }

    #[test]
    fn kernels_that_mean_nothing_are_refused() {
        let refused = |name: &str| {
            let kernel: SmoothingKernel = name.parse().unwrap();
            kernel.weights().unwrap_err()
        };
        for name in ["box:0", "tent:-1", "gaussian:NaN", "gaussian:inf"] {
            assert!(
                matches!(refused(name), SmoothingError::Width { .. }),
                "{name}"
            );
        }
        assert!(matches!(
            refused("savitzky-golay:2:5"),
            SmoothingError::Order { .. }
        ));
        assert!("median:3".parse::<SmoothingKernel>().is_err());
    }
}
