//! Rounds of random sets and crowds with extreme inputs, evaluated on a device and on the CPU. A seed determines the
//! rounds; they are the same on every machine.

use std::fmt::Write as _;
use std::mem::discriminant;

use sha2::{Digest, Sha256};

use tumble::crowd::{CrowdError, CrowdOutput, CrowdValues};
use tumble::{
    Axes, Encoding, Ends, Engine, Error, FrameRate, Interpolation, KeySigns, Layout, METHODS,
    Method, Quantity, SampleTimes, ScalarQuantity, Speed, TrackSet, VectorMethod, WrapMode, method,
};

use crate::differences::Differences;
use crate::golden::GoldenError;
use crate::sets::{
    SeededRandom, crowd_layer, crowd_library, later, random_scalars, random_set, shared_set,
};

/// The result of a round.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct RandomRound {
    /// The evaluation, in words.
    pub description: String,
    /// The number of compared values: rotations, velocities, accelerations, or joints of a crowd.
    pub values: u64,
    /// The number of compared bytes.
    pub bytes: u64,
    /// The number of values whose bits differ.
    pub differing: u64,
    /// The index of the first such value in the result.
    pub first_difference: Option<usize>,
    /// The SHA-256 of the CPU's result, which is the same on every machine.
    pub hash: [u8; 32],
}

/// Runs round `number` of a seed: three of four rounds are sets, the fourth is a crowd.
///
/// Both engines evaluate it, and every bit is compared. If both refuse a combination with the same kind of error,
/// nothing is compared, and the description says so.
///
/// # Errors
/// When the device fails, or refuses a request that the CPU accepts.
pub fn round(
    device: &Engine,
    cpu: &Engine,
    seed: u64,
    number: u64,
) -> Result<RandomRound, GoldenError> {
    // Mixed, so that neighbouring seeds and rounds give unrelated sequences.
    let mut random =
        SeededRandom(seed.rotate_left(32) ^ number.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    random.next();
    match number % 4 {
        3 => crowd_round(device, cpu, &mut random),
        _ => set_round(device, cpu, &mut random),
    }
}

/// Scalars of a set, and so many samples of each by every method and quantity: 2^20 values and a few.
const SCALARS: usize = 64;
const SCALAR_SAMPLES: usize = 781;

/// Compares scalars of a seed by every method, as values, velocities and accelerations: keys at common and at separate
/// times, with tangents and without, held, repeated, mirrored and extrapolated outside, at rates and at listed times.
///
/// # Errors
/// When the device fails, or refuses a request that the CPU accepts.
pub fn scalars_round(device: &Engine, cpu: &Engine, seed: u64) -> Result<RandomRound, GoldenError> {
    let mut random = SeededRandom(seed.rotate_left(32) ^ 0x7363_616c_6172_7321);
    random.next();
    let [mut found, mut expected] = [Vec::new(), Vec::new()];
    for method in VectorMethod::ALL {
        for quantity in ScalarQuantity::ALL {
            let set = random_scalars(&mut random, SCALARS);
            let mut interpolation = Interpolation::from(match method {
                VectorMethod::C2 => method::C2,
                VectorMethod::BSpline => method::B_SPLINE,
                _ => method::SLERP,
            });
            interpolation.before = random.pick(&SIDES);
            interpolation.after = random.pick(&SIDES);
            if interpolation.method.uses_neighbours {
                interpolation.ends = random.pick(&[Ends::Natural, Ends::Secant, Ends::Frozen]);
            }
            let (start, end) = set.time_span().unwrap_or_default();
            let (low, high) = (start - 1.0, end + 1.0);
            let times = (0..SCALAR_SAMPLES).map(|index| match index % 2 {
                0 => random.between(low, high),
                _ => low + (high - low) * index as f64 / SCALAR_SAMPLES as f64,
            });
            let frames = SampleTimes::at(times.collect());
            let layout = random.pick(&[Layout::TrackMajor, Layout::FrameMajor]);
            let evaluate = |engine: &Engine| -> Result<Vec<u8>, Error> {
                let found =
                    engine.scalars(&set, quantity, method, interpolation, &frames, layout)?;
                Ok(bytemuck::cast_slice(found.as_slice()).to_vec())
            };
            found.extend(evaluate(device)?);
            expected.extend(evaluate(cpu)?);
        }
    }
    let description = format!("{SCALARS} scalars by every method and quantity");
    Ok(compared(description, &found, &expected, size_of::<f32>()))
}

/// Compares two results of values of `size` bytes each.
fn compared(description: String, found: &[u8], expected: &[u8], size: usize) -> RandomRound {
    let differences = Differences::of(found, expected, size);
    RandomRound {
        description,
        values: (expected.len() / size) as u64,
        bytes: expected.len() as u64,
        differing: differences.count,
        first_difference: differences.first,
        hash: Sha256::digest(expected).into(),
    }
}

/// The result of a request on both engines, or the kind of error with which both refuse it. Each engine reports the
/// error that one of its threads meets first.
fn both<E: std::fmt::Display>(
    mut evaluate: impl FnMut(&Engine) -> Result<Vec<u8>, E>,
    [device, cpu]: [&Engine; 2],
) -> Result<Result<[Vec<u8>; 2], String>, E> {
    let expected = evaluate(cpu);
    let found = evaluate(device);
    match (found, expected) {
        (Ok(found), Ok(expected)) => Ok(Ok([found, expected])),
        (Err(found), Err(expected)) if discriminant(&found) == discriminant(&expected) => {
            Ok(Err(expected.to_string()))
        }
        (Err(error), _) | (_, Err(error)) => Err(error),
    }
}

fn refused(mut description: String, reason: &str) -> RandomRound {
    let _ = write!(description, "; refused: {reason}");
    compared(description, &[], &[], 1)
}

/// A set round: a set and the requests for it.
fn set_round(
    device: &Engine,
    cpu: &Engine,
    random: &mut SeededRandom,
) -> Result<RandomRound, GoldenError> {
    let mut interpolation = interpolation(random);
    let (kind, set) = set(random);
    // If no polynomial fits a curve, the host evaluates each sample in f64. For such sets this would take seconds.
    if !matches!(kind, "gentle" | "hour 24") {
        interpolation.speed = Speed::AsKeyed;
    }
    let frames = frames(random, &set);
    let layout = random.pick(&[Layout::TrackMajor, Layout::FrameMajor]);
    let is_rotation = interpolation.quantity == Quantity::Rotation;
    let encoding = match is_rotation && random.below(2) == 0 {
        true => random.pick(&Encoding::ALL),
        false => Encoding::F32,
    };
    let encoding = if encoding.stores_rotations() {
        encoding
    } else {
        Encoding::F32
    };
    let keeps = random.below(2) == 0;
    let mut description = format!(
        "{kind}, {} tracks, {} as {encoding}, {layout:?}",
        set.track_count(),
        interpolation.method
    );
    let _ = write!(
        description,
        ", {:?}, {:?}, {:?} to {:?}, {:?}, {:?}",
        interpolation.ends,
        interpolation.signs,
        interpolation.before,
        interpolation.after,
        interpolation.speed,
        interpolation.quantity,
    );
    let evaluate = |engine: &Engine| -> Result<Vec<u8>, Error> {
        if encoding != Encoding::F32 {
            let clip = engine.upload(&set, interpolation)?;
            return clip
                .request(&frames)
                .layout(layout)
                .encoding(encoding)
                .evaluate_bytes();
        }
        // A kept clip and an evaluation of the set take different routes.
        let bytes = match (is_rotation, keeps) {
            (true, true) => {
                let clip = engine.upload(&set, interpolation)?;
                bytemuck::cast_slice(clip.request(&frames).layout(layout).evaluate()?.as_quats())
                    .to_vec()
            }
            (true, false) => {
                let found = engine
                    .request(&set, interpolation, &frames)
                    .layout(layout)
                    .evaluate()?;
                bytemuck::cast_slice(found.as_quats()).to_vec()
            }
            (false, _) => {
                let found = engine.rates(&set, interpolation, &frames, layout)?;
                bytemuck::cast_slice(found.as_slice()).to_vec()
            }
        };
        Ok(bytes)
    };
    Ok(match both(evaluate, [device, cpu])? {
        Ok([found, expected]) => compared(description, &found, &expected, encoding.bytes()),
        Err(reason) => refused(description, &reason),
    })
}

/// The motions before the first key and after the last.
const SIDES: [WrapMode; 4] = [
    WrapMode::Hold,
    WrapMode::Loop,
    WrapMode::Mirror,
    WrapMode::Extrapolate,
];

fn interpolation(random: &mut SeededRandom) -> Interpolation {
    let is_default = |random: &mut SeededRandom| random.below(3) > 0;
    let mut interpolation = Interpolation::from(random.pick(&METHODS));
    if !is_default(random) {
        interpolation.ends = random.pick(&[Ends::Natural, Ends::Secant, Ends::Frozen]);
    }
    if !is_default(random) {
        interpolation.signs = KeySigns::AsAuthored;
    }
    if !is_default(random) {
        interpolation.before = random.pick(&SIDES);
        interpolation.after = random.pick(&SIDES);
    }
    if random.below(12) == 0 {
        interpolation.speed = Speed::Constant;
    }
    if random.below(5) == 0 {
        let axes = random.pick(&[Axes::Body, Axes::Parent]);
        interpolation.quantity =
            random.pick(&[Quantity::Velocity(axes), Quantity::Acceleration(axes)]);
    }
    interpolation
}

/// A random set: zero and very small steps, steps of 180° and more, with intervals from milliseconds to seconds;
/// dense keys; a single key; or times on the second day.
fn set(random: &mut SeededRandom) -> (&'static str, TrackSet) {
    let seed = random.next();
    let every = [0.0, 1e-7, 1e-4, 0.02, 0.4, 2.0, 9.0];
    match random.below(8) {
        0..3 => {
            let (tracks, keys) = (1 + random.below(200), 2 + random.below(40));
            ("hostile", random_set(seed, tracks, keys, &every, true))
        }
        3 => {
            let (tracks, keys) = (1 + random.below(64), 2 + random.below(60));
            (
                "gentle",
                random_set(seed, tracks, keys, &[0.05, 0.3, 0.9], false),
            )
        }
        4 => {
            let keys = 200 + random.below(3000);
            let size = random.pick(&[0.003, 0.02, 0.1, 0.4]);
            let signs = random.pick(&[0, 3, 5]);
            (
                "dense",
                shared_set(seed, 1 + random.below(12), keys, 0.01, size, signs),
            )
        }
        5 => {
            let tracks = 200 + random.below(3000);
            (
                "wide",
                shared_set(seed, tracks, 2 + random.below(3), 1.0, 0.5, 4),
            )
        }
        6 => {
            let keys = 10_000 + random.below(30_000);
            ("long", shared_set(seed, 1, keys, 0.02, 0.25, 3))
        }
        _ => {
            let set = random_set(seed, 1 + random.below(40), 12, &[0.05, 0.3, 0.9], false);
            ("hour 24", later(&set, 86_400.0))
        }
    }
}

/// Sample times of a length with which a round takes milliseconds on a card, and at most about a tenth of a second on
/// two cores.
fn frames(random: &mut SeededRandom, set: &TrackSet) -> SampleTimes {
    let (start, end) = set.time_span().unwrap_or_default();
    let tracks = set.track_count().max(1);
    let samples = (random.pick(&[10_000, 100_000, 400_000]) / tracks).max(1);
    let (low, high) = (start - 0.3, end + 0.3);
    // At this rate, the whole set has `samples` samples. At a usual rate, only a part of the time is sampled.
    let filling = (samples as f64 / (high - low)).clamp(1.0, 50_000.0) as u32;
    match random.below(6) {
        0 => {
            let times = (0..samples.min(2_000)).map(|_| random.between(low, high));
            SampleTimes::at(times.collect())
        }
        1 => {
            let each = samples.min(40);
            let times = (0..tracks * each).map(|_| random.between(low, high));
            SampleTimes::at_each(times.collect())
        }
        2 => {
            let rate = FrameRate::new(24_000, 1001).expect("a rate of films");
            let last = low + (samples as f64 / 24.0).min(high - low);
            SampleTimes::rate(rate).between(low, last)
        }
        3 => {
            let rate = random.pick(&[7, 24, 30, 60, 120, 211]);
            let last = low + (samples as f64 / f64::from(rate)).min(high - low);
            SampleTimes::fps(rate).between(low, last)
        }
        _ => SampleTimes::fps(filling).between(low, high),
    }
}

fn crowd_round(
    device: &Engine,
    cpu: &Engine,
    random: &mut SeededRandom,
) -> Result<RandomRound, GoldenError> {
    const MIXES: [&[Method]; 3] = [
        &[method::SLERP],
        &[method::SLERP, method::STEP],
        &[
            method::BESSEL_OVERHAUSER,
            method::SLERP,
            method::CATMULL_ROM,
        ],
    ];
    let methods = random.pick(&MIXES);
    let (joints, layers) = (1 + random.below(70), 1 + random.below(4));
    let instances = 1 + random.below(20_000 / joints);
    let values = random.pick(&[
        CrowdValues::Rotations,
        CrowdValues::Local,
        CrowdValues::Model,
        CrowdValues::Skinning,
    ]);
    let is_half = random.below(3) == 0;
    let output = match is_half {
        true => CrowdOutput::half(values),
        false => CrowdOutput::from(values),
    };
    let library = crowd_library(random, joints, methods)?;
    let plays: Vec<_> = (0..instances * layers)
        .map(|_| crowd_layer(random, &library))
        .collect();
    let clock = random.pick(&[0, 11_760, 1 << 33, 61_000_000_000]) + random.next() % 1_000_000;
    let bits = if is_half { 16 } else { 32 };
    let description = format!(
        "crowd, {instances} instances of {joints} joints, {} clips in {layers} layers, {values:?} in {bits} bits",
        methods.len(),
    );
    let evaluate = |engine: &Engine| -> Result<Vec<u8>, CrowdError> {
        let mut crowd = engine.crowd(&library, instances, layers)?;
        for (index, &plays) in plays.iter().enumerate() {
            crowd.set(index / layers, index % layers, plays)?;
        }
        crowd.advance_ticks(clock)?;
        let vectors = crowd.output_len(output);
        if is_half {
            let mut found = vec![[0u16; 4]; vectors];
            crowd.evaluate_half_into(values, &mut found)?;
            return Ok(bytemuck::cast_slice(&found).to_vec());
        }
        let mut found = vec![[0f32; 4]; vectors];
        crowd.evaluate_into(values, &mut found)?;
        Ok(bytemuck::cast_slice(&found).to_vec())
    };
    Ok(match both(evaluate, [device, cpu])? {
        Ok([found, expected]) => compared(description, &found, &expected, output.bytes()),
        Err(reason) => refused(description, &reason),
    })
}

#[cfg(test)]
mod tests {
    use tumble::Device;

    use super::*;

    /// Each engine reports the first track that one of its threads refuses; a set that only one refuses is an error.
    #[test]
    fn both_may_refuse_in_other_words() {
        let cpu = Engine::new(Device::Cpu).expect("threads");
        let lengths =
            [(1, 2), (3, 4)].map(|(length, needed)| Error::OutputLength { length, needed });
        let mut words = lengths.into_iter();
        let refuse = |_: &Engine| Err(words.next().expect("asked twice"));
        assert!(matches!(both(refuse, [&cpu, &cpu]), Ok(Err(_))));
        let mut kinds = [Error::NotRates, Error::NotRotations].into_iter();
        let refuse = |_: &Engine| Err(kinds.next().expect("asked twice"));
        assert!(both(refuse, [&cpu, &cpu]).is_err());
        let mut is_first = true;
        let one = |_: &Engine| match std::mem::take(&mut is_first) {
            true => Err(Error::NotRates),
            false => Ok(Vec::new()),
        };
        assert!(both(one, [&cpu, &cpu]).is_err());
    }
}
