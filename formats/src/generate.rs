//! Generated keyframes like those of a linked pendulum: smooth, deterministic, for any number of boxes and keys.
//!
//! Each box swings relative to its parent about an axis that drifts. The angle is a sum of slow sines with random
//! frequencies and phases. The same seed makes the same file on every machine.

use std::f64::consts::TAU;
use std::io::{self, Write};

use glam::{DQuat, DVec3};

use tumble::TrackSet;

use crate::dat::{MAX_BOXES, read_dat};
use crate::format::ReadOptions;

/// How key times are spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum KeySpacing {
    /// At equal intervals.
    #[default]
    Uniform,
    /// At random intervals, from 1/4 to 7/4 of the mean.
    Random,
}

/// A request for generated keyframes.
#[derive(Debug, Clone, PartialEq)]
pub struct Generate {
    /// Number of boxes, 1 to 65 536.
    pub box_count: usize,
    /// Number of keys, at least 1.
    pub key_count: usize,
    /// Time from the first key to the last, in seconds.
    pub seconds: f64,
    /// The spacing of key times.
    pub spacing: KeySpacing,
    /// The length of each box.
    pub length: f64,
    /// The seed of the motion.
    pub seed: u64,
}

impl Default for Generate {
    fn default() -> Self {
        Self {
            box_count: 4,
            key_count: 26,
            seconds: 20.0,
            spacing: KeySpacing::Uniform,
            length: 3.0,
            seed: 1,
        }
    }
}

/// Why keyframes cannot be generated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GenerateError {
    /// The number of boxes is out of range.
    #[error("{boxes} boxes; there may be 1 to {MAX_BOXES}")]
    Boxes {
        /// Requested number of boxes.
        boxes: usize,
    },
    /// The number of keys is 0.
    #[error("0 keys; there is at least one")]
    Keys,
    /// The length of the boxes is not positive and finite.
    #[error("a box length of {length}; lengths are positive and finite")]
    Length {
        /// Requested length.
        length: f64,
    },
    /// The time is not finite or exceeds 1e12 s, or it is too short for key times of six decimals to increase.
    #[error(
        "{keys} keys in {seconds} s; times have six decimals and must increase, so allow at least 4e-6 s a key"
    )]
    Seconds {
        /// Requested number of keys.
        keys: usize,
        /// Requested time, in seconds.
        seconds: f64,
    },
}

impl Generate {
    /// Checks the request.
    ///
    /// # Errors
    /// When the request is out of range.
    pub fn check(&self) -> Result<(), GenerateError> {
        let &Self {
            box_count: boxes,
            key_count: keys,
            seconds,
            length,
            ..
        } = self;
        if !(1..=MAX_BOXES).contains(&boxes) {
            return Err(GenerateError::Boxes { boxes });
        }
        if keys == 0 {
            return Err(GenerateError::Keys);
        }
        if !length.is_finite() || length <= 0.0 {
            return Err(GenerateError::Length { length });
        }
        let mean = seconds / keys.saturating_sub(1).max(1) as f64;
        if !seconds.is_finite() || keys > 1 && mean < 4e-6 || seconds > 1e12 {
            return Err(GenerateError::Seconds { keys, seconds });
        }
        Ok(())
    }

    /// Writes a `.dat` file line by line; the memory does not depend on the number of keys.
    ///
    /// # Errors
    /// When writing fails, or (`InvalidInput`) when the request does not pass [`Generate::check`].
    pub fn write(&self, writer: &mut impl Write) -> io::Result<()> {
        self.check()
            .map_err(|error| io::Error::new(io::ErrorKind::InvalidInput, error))?;
        let mut random = Random(self.seed);
        let pendulums: Vec<Pendulum> = (0..self.box_count)
            .map(|_| Pendulum::new(&mut random))
            .collect();
        writeln!(writer, "# {} {:.6}", self.box_count, self.length)?;
        let mut clock = KeyTimes::new(self, Random(random.next()));
        for key in 0..self.key_count {
            let time = clock.time(key);
            write!(writer, "{time:.6}")?;
            for pendulum in &pendulums {
                let q = pendulum.rotation(time);
                write!(writer, " {:.6e} {:.6e} {:.6e} {:.6e}", q.w, q.x, q.y, q.z)?;
            }
            writeln!(writer)?;
        }
        Ok(())
    }

    /// The set of tracks that reading the written file makes.
    ///
    /// # Errors
    /// When the request does not pass [`Generate::check`].
    ///
    /// # Panics
    /// Never: writing to memory does not fail, and a test reads generated files.
    pub fn track_set(&self) -> Result<TrackSet, GenerateError> {
        self.check()?;
        let mut file = Vec::new();
        self.write(&mut file).expect("memory takes everything");
        let loaded = read_dat("generated", &*file, &ReadOptions::default());
        Ok(loaded
            .expect("what is generated can be read")
            .clips
            .remove(0)
            .set)
    }
}

/// Key times without a list of them. The sum of random steps is known only after the last one, so that they are
/// generated twice.
struct KeyTimes {
    seconds: f64,
    keys: usize,
    spacing: KeySpacing,
    random: Random,
    total: f64,
    passed: f64,
}

impl KeyTimes {
    fn new(generate: &Generate, random: Random) -> Self {
        let &Generate {
            seconds,
            key_count: keys,
            spacing: steps,
            ..
        } = generate;
        let mut rehearsal = Random(random.0);
        let total = (1..keys).map(|_| random_step(&mut rehearsal)).sum();
        Self {
            seconds,
            keys,
            spacing: steps,
            random,
            total,
            passed: 0.0,
        }
    }

    fn time(&mut self, key: usize) -> f64 {
        let last = self.keys.saturating_sub(1).max(1);
        match self.spacing {
            KeySpacing::Uniform => self.seconds * key as f64 / last as f64,
            KeySpacing::Random if key == 0 => 0.0,
            KeySpacing::Random if key == last => self.seconds,
            KeySpacing::Random => {
                self.passed += random_step(&mut self.random);
                self.seconds * self.passed / self.total
            }
        }
    }
}

fn random_step(random: &mut Random) -> f64 {
    random.between(0.25, 1.75)
}

/// One box's motion.
struct Pendulum {
    rest: DVec3,
    axis: DVec3,
    drift: DVec3,
    drift_rate: f64,
    /// Amplitude (radians), angular frequency (radians per second), phase.
    swings: [[f64; 3]; 3],
}

impl Pendulum {
    fn new(random: &mut Random) -> Self {
        let mut swing = |amplitude: f64, slowest: f64| {
            [
                amplitude * random.between(0.6, 1.0),
                TAU / slowest * random.between(1.0, 1.6),
                random.between(0.0, TAU),
            ]
        };
        let swings = [swing(1.1, 7.0), swing(0.5, 4.5), swing(0.2, 3.0)];
        Self {
            swings,
            rest: random.vector() * 0.6,
            axis: random.vector(),
            drift: random.vector() * 0.7,
            drift_rate: TAU / random.between(15.0, 40.0),
        }
    }

    fn rotation(&self, time: f64) -> DQuat {
        let angle: f64 = self
            .swings
            .iter()
            .map(|[amplitude, frequency, phase]| amplitude * libm::sin(frequency * time + phase))
            .sum();
        let axis = self.axis + self.drift * libm::sin(self.drift_rate * time);
        let axis = axis / axis.length().max(0.1);
        rotation(self.rest) * rotation(axis * (angle / 2.0))
    }
}

/// `SplitMix64` (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// A vector of length near 1.
    fn vector(&mut self) -> DVec3 {
        let mut component = || self.between(-1.0, 1.0);
        let v = DVec3::new(component(), component(), component());
        v / v.length().max(0.3)
    }
}

/// The rotation of a half-rotation vector: the same bits on every machine.
fn rotation(half: DVec3) -> DQuat {
    let angle = half.length();
    let (sine, cosine) = libm::sincos(angle);
    let v = half * if angle > 1e-9 { sine / angle } else { 1.0 };
    DQuat::from_xyzw(v.x, v.y, v.z, cosine)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_bytes_and_another_another() {
        let bytes = |seed| {
            let mut file = Vec::new();
            Generate {
                seed,
                ..Generate::default()
            }
            .write(&mut file)
            .unwrap();
            file
        };
        assert_eq!(bytes(1), bytes(1));
        assert_ne!(bytes(1), bytes(2));
    }

    #[test]
    fn times_are_exact_at_both_ends_and_increase() {
        for steps in [KeySpacing::Uniform, KeySpacing::Random] {
            for keys in [1, 2, 26, 1000] {
                let set = Generate {
                    spacing: steps,
                    key_count: keys,
                    ..Generate::default()
                }
                .track_set()
                .unwrap();
                let times = set.track(0).times;
                assert_eq!(times.len(), keys);
                assert_eq!(times[0], 0.0);
                if keys > 1 {
                    assert_eq!(times[keys - 1], 20.0);
                }
            }
        }
    }

    /// Neighbouring keys of the sample sets turn by sizeable, not wild, angles.
    #[test]
    fn the_motion_is_smooth_and_lively() {
        let set = Generate {
            box_count: 40,
            ..Generate::default()
        }
        .track_set()
        .unwrap();
        let mut largest = 0.0f64;
        for track in set.tracks() {
            for pair in track.keys.windows(2) {
                let [from, to] = [pair[0], pair[1]].map(glam::Quat::as_dquat);
                let step_rotation = from.conjugate() * to;
                largest = largest.max(2.0 * step_rotation.w.abs().min(1.0).acos());
            }
        }
        assert!((1.0..2.6).contains(&largest), "{largest} rad");
    }

    #[test]
    fn impossible_requests_are_refused() {
        let check = |change: fn(&mut Generate)| {
            let mut generate = Generate::default();
            change(&mut generate);
            generate.check()
        };
        assert!(check(|g| g.box_count = 0).is_err());
        assert!(check(|g| g.box_count = 70_000).is_err());
        assert!(check(|g| g.key_count = 0).is_err());
        assert!(check(|g| g.seconds = -1.0).is_err());
        assert!(check(|g| g.seconds = f64::NAN).is_err());
        assert!(check(|g| g.key_count = 10_000_000).is_err());
        assert!(check(|g| g.length = 0.0).is_err());
    }
}
