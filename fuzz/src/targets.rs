//! The targets of fuzzing, and the assertions about every outcome. Each target takes bytes and returns a
//! signature of the outcome: inputs with a new signature are worth keeping.

use std::hash::{DefaultHasher, Hash, Hasher};

use clap::Parser;
use glam::Quat;
use tumble::{
    Device, Encoding, Engine, FrameRate, Interpolation, KeySigns, Layout, MAX_FRAMES, METHODS,
    SampleTimes, Speed, TrackSet, WrapMode,
};
use tumble_exact::{FloatControls, exact, float_controls, inexact, without_decorations};
use tumble_formats::csv::CsvWriter;
use tumble_formats::npy::NpyWriter;
use tumble_formats::quaternion::ComponentOrder;
use tumble_formats::{Diagnostic, Location};

#[path = "formats.rs"]
pub(crate) mod formats;

#[path = "robots.rs"]
pub(crate) mod robots;

#[path = "surfaces.rs"]
pub(crate) mod surfaces;

fn signature(of: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    of.hash(&mut hasher);
    hasher.finish()
}

/// The error's kind without its numbers.
fn kind(error: &impl std::fmt::Debug) -> String {
    let text = format!("{error:?}");
    text.chars().take_while(|c| c.is_alphanumeric()).collect()
}

fn bits(set: &TrackSet) -> Vec<(Vec<u64>, Vec<[u32; 4]>)> {
    set.tracks()
        .map(|track| {
            let times = track.times.iter().map(|time| time.to_bits()).collect();
            let keys = track
                .keys
                .iter()
                .map(|key| key.to_array().map(f32::to_bits));
            (times, keys.collect())
        })
        .collect()
}

/// Values from bytes, wild ones among them.
struct ByteReader<'a>(&'a [u8]);

impl ByteReader<'_> {
    fn byte(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else {
            return 0;
        };
        self.0 = rest;
        first
    }

    fn word(&mut self) -> u64 {
        (0..8).fold(0, |word, _| word << 8 | u64::from(self.byte()))
    }

    fn float(&mut self) -> f64 {
        match self.byte() {
            0..160 => f64::from(self.byte() as i8) / 16.0,
            160..220 => f64::from(self.word() as i32) / 1e6,
            220..250 => f64::from_bits(self.word()),
            250 => f64::NAN,
            251 => f64::INFINITY,
            252 => -f64::INFINITY,
            253 => f64::MAX,
            254 => f64::MIN_POSITIVE / 8.0,
            _ => -0.0,
        }
    }
}

/// An error or warning about text has a line and column within it.
fn location_is_inside(bytes: &[u8], said: &Diagnostic) {
    // A CR at the very end ends a line, too.
    let ends = bytes.iter().filter(|&&byte| byte == b'\n').count();
    let lines = (ends + usize::from(bytes.ends_with(b"\r"))) as u64;
    if let Some(Location::Text { line, column }) = said.location {
        assert!(1 <= line && line <= lines + 1, "line {line} of {lines}");
        assert!(1 <= column && column <= bytes.len() as u64 + 1);
    }
}

/// The writers of results: their files read back bit for bit.
pub(crate) fn outputs(bytes: &[u8]) -> u64 {
    let mut numbers = ByteReader(bytes);
    let (tracks, frames) = (1 + numbers.byte() as usize % 5, numbers.byte() as usize % 9);
    let kind = numbers.byte();
    let count = if kind % 16 == 15 {
        numbers.byte() as usize
    } else {
        tracks * frames
    };
    let quats: Vec<Quat> = (0..count)
        .map(|_| {
            let [x, y, z, w] = std::array::from_fn(|_| numbers.float() as f32);
            Quat::from_xyzw(x, y, z, w)
        })
        .collect();
    let order = match kind & 1 {
        0 => ComponentOrder::Xyzw,
        _ => ComponentOrder::Wxyz,
    };
    let (rows, columns) = match kind {
        255 => (numbers.word() as usize, numbers.word() as usize),
        _ => (tracks, frames),
    };
    let mut file = Vec::new();
    let written =
        NpyWriter::new(&mut file, rows, columns, order, Encoding::F32).and_then(|mut writer| {
            writer.write(&quats)?;
            writer.finish().map(drop)
        });
    if kind != 255 {
        assert_eq!(written.is_ok(), count == tracks * frames, "{written:?}");
    }
    if written.is_ok() && kind != 255 {
        let npy = npyz::NpyFile::new(&*file).expect("an NPY file");
        assert_eq!(npy.shape(), [tracks as u64, frames as u64, 4]);
        let read: Vec<f32> = npy.into_vec().expect("of f32");
        let expected = quats.iter().flat_map(|q| match order {
            ComponentOrder::Xyzw => [q.x, q.y, q.z, q.w],
            ComponentOrder::Wxyz => [q.w, q.x, q.y, q.z],
        });
        assert!(
            read.iter()
                .map(|f| f.to_bits())
                .eq(expected.map(f32::to_bits))
        );
    }

    let mut set = TrackSet::new();
    for _ in 0..tracks {
        let name: String = (0..numbers.byte() % 4)
            .map(|_| char::from(numbers.byte()))
            .collect();
        set.push(name, &[0.0], &[Quat::IDENTITY]).expect("a key");
    }
    let times: Vec<f64> = (0..frames).map(|frame| frame as f64 / 7.0).collect();
    let timeline = SampleTimes::at(times)
        .resolve(tracks, None)
        .expect("a few times");
    let mut text = Vec::new();
    let written = CsvWriter::new(
        &mut text,
        &set,
        (&timeline, 0),
        ComponentOrder::Wxyz,
        Encoding::F32,
    )
    .and_then(|mut writer| {
        writer.write(&quats)?;
        writer.finish()
    });
    assert_eq!(written.is_ok(), count == tracks * frames, "{written:?}");
    if written.is_ok() {
        let mut reader = csv::Reader::from_reader(&*text);
        let read: Vec<f32> = reader
            .records()
            .flat_map(|row| {
                let row = row.expect("a row");
                row.iter()
                    .skip(2)
                    .map(|field| field.parse().expect("a number"))
                    .collect::<Vec<f32>>()
            })
            .collect();
        let expected: Vec<f32> = quats.iter().flat_map(|q| [q.w, q.x, q.y, q.z]).collect();
        assert_eq!(read.len(), expected.len());
        for (read, expected) in read.iter().zip(expected) {
            let same = read.to_bits() == expected.to_bits() || read.is_nan() && expected.is_nan();
            assert!(same, "{read} is not {expected}");
        }
    }
    signature((kind % 16, tracks, frames, written.is_ok()))
}

/// The command line: any words are an error or a command, never a panic.
pub(crate) fn arguments(bytes: &[u8]) -> u64 {
    let text = String::from_utf8_lossy(bytes);
    let words = std::iter::once("tumble").chain(text.split('\n'));
    match tumble_cli::Arguments::try_parse_from(words) {
        Ok(parsed) => signature(
            format!("{parsed:?}")
                .split_once(' ')
                .map(|s| s.0.to_owned()),
        ),
        Err(error) => {
            let message = error.to_string();
            assert!(!message.is_empty());
            let argument = message.lines().next().unwrap_or_default();
            signature((format!("{:?}", error.kind()), argument.len() % 64))
        }
    }
}

/// Frame rates and frames: the count is right, times lie in order and within the range.
pub(crate) fn frames(bytes: &[u8]) -> u64 {
    let mut numbers = ByteReader(bytes);
    let rate = match numbers.byte() % 3 {
        0 => FrameRate::new(numbers.word(), numbers.word()),
        1 => FrameRate::new(1 + u64::from(numbers.byte()) * 250, 1001),
        _ => {
            let length = numbers.byte() as usize % 12;
            let text = numbers.0.get(..length).unwrap_or_default();
            String::from_utf8_lossy(text).parse()
        }
    };
    let Ok(rate) = rate else {
        return signature("no rate");
    };
    assert!(rate.per_second() >= 0.0);
    let shown = rate.to_string().parse::<FrameRate>();
    assert!(shown.is_err() || shown == Ok(rate), "{rate}");
    let span = (numbers.float(), numbers.float());
    let (start, end) = (numbers.float(), numbers.float());
    let tracks = numbers.word() as usize >> (numbers.byte() % 64);
    let mut requests = vec![
        SampleTimes::rate(rate),
        SampleTimes::rate(rate).between(start, end),
        SampleTimes::at(vec![start, end, span.0]),
    ];
    requests.push(SampleTimes::at_each(vec![start; numbers.byte() as usize]));
    let mut outcomes = Vec::new();
    for frames in requests {
        match frames.resolve(tracks, Some(span)) {
            Ok(timeline) => {
                assert!(timeline.len() as u64 <= MAX_FRAMES);
                let last = timeline.len().saturating_sub(1);
                for sample in [0, 1, last / 2, last] {
                    if sample < timeline.len() && tracks > 0 {
                        assert!(timeline.time(0, sample).is_some_and(f64::is_finite));
                        assert!(
                            timeline
                                .time(tracks - 1, sample)
                                .is_some_and(f64::is_finite)
                        );
                    }
                }
                outcomes.push(timeline.len().min(4).to_string());
            }
            Err(error) => outcomes.push(kind(&error)),
        }
    }
    signature(outcomes)
}

/// Sets from slices: refused whole, or evaluated to unit rotations by every method, the
/// same ones however the samples are asked for.
pub(crate) fn tracks(bytes: &[u8]) -> u64 {
    let mut numbers = ByteReader(bytes);
    let method = METHODS[numbers.byte() as usize % METHODS.len()];
    let choice = numbers.byte();
    let mut set = TrackSet::new();
    let mut outcomes = vec![method.name.to_owned()];
    while numbers.0.len() > 20 && set.track_count() < 4 {
        let before = bits(&set);
        let count = numbers.byte() as usize % 9;
        let mut time = 0.0;
        let mut times = Vec::new();
        let mut keys = Vec::new();
        for _ in 0..count {
            time += match numbers.byte() {
                0..240 => f64::from(numbers.byte()) / 64.0 + 1e-9,
                240..248 => 10f64.powi(-i32::from(numbers.byte())),
                _ => numbers.float(),
            };
            times.push(time);
            let wild = numbers.byte() > 250;
            let [x, y, z, w] = std::array::from_fn(|_| numbers.float() as f32);
            let key = Quat::from_xyzw(x, y, z, w);
            keys.push(if wild { key } else { sane(key) });
        }
        if let Err(error) = set.push("", &times, &keys) {
            assert_eq!(bits(&set), before, "a refused track has changed the set");
            outcomes.push(kind(&error));
        }
    }
    let mut interpolation = Interpolation::from(method);
    if choice & 1 != 0 && method.signs.is_none() {
        interpolation.signs = KeySigns::AsAuthored;
    }
    if choice >= 250 {
        // Constant speed is slow, so only some inputs have it.
        interpolation.speed = Speed::Constant;
    }
    let outside = [
        WrapMode::Hold,
        WrapMode::Loop,
        WrapMode::Mirror,
        WrapMode::Extrapolate,
    ];
    interpolation.before = outside[(choice >> 2) as usize % 4];
    interpolation.after = outside[(choice >> 4) as usize % 4];
    let engine = Engine::new(Device::Cpu).expect("the CPU");
    let (first, last) = set.time_span().unwrap_or((0.0, 0.0));
    let length = (last - first).max(1e-3);
    let at = |part: f64| first + length * part;
    let mut times: Vec<f64> = (-3..13).map(|i| at(f64::from(i) / 8.0)).collect();
    times[0] = numbers.float();
    times[15] = at(numbers.float());
    let frames = SampleTimes::at(times);
    match engine.evaluate(&set, interpolation, &frames) {
        Ok(rotations) => {
            for (index, q) in rotations.as_quats().iter().enumerate() {
                let norm = q.as_dquat().length();
                assert!(
                    (norm - 1.0).abs() < 1e-5,
                    "{method}, {index}: {q} of norm {norm}"
                );
            }
            let clip = engine
                .upload(&set, interpolation)
                .expect("it was evaluated");
            let other = clip
                .request(&frames)
                .layout(Layout::FrameMajor)
                .evaluate()
                .expect("as before");
            for track in 0..set.track_count() {
                for sample in 0..16 {
                    let [a, b] = [&rotations, &other].map(|all| {
                        all.get(track, sample)
                            .map(|q| q.to_array().map(f32::to_bits))
                    });
                    assert_eq!(a, b, "{method}, track {track}, sample {sample}");
                }
            }
        }
        Err(error) => outcomes.push(kind(&error)),
    }
    signature((outcomes, choice, set.track_count(), set.key_count().min(4)))
}

/// The unit quaternion nearest to four numbers, if there is one.
fn sane(key: Quat) -> Quat {
    let length = key.as_dquat().length();
    if length.is_finite() && length > 1e-6 {
        (key.as_dquat() * (1.0 / length)).as_quat()
    } else {
        Quat::IDENTITY
    }
}

/// The exactness pass on any words: a second pass over an accepted module changes nothing, and the pass can be
/// undone.
pub(crate) fn spirv(bytes: &[u8]) -> u64 {
    let module: Vec<u32> = bytes
        .chunks_exact(4)
        .map(|c| u32::from_le_bytes([c[0], c[1], c[2], c[3]]))
        .collect();
    let controls = FloatControls::default()
        .with_preserve_signed_zero_inf_nan(true)
        .with_round_to_nearest_even(true);
    let _ = float_controls(&module, controls);
    let bare = without_decorations(&module);
    match exact(&module) {
        Ok(passed) => {
            assert_eq!(exact(&passed).as_ref(), Ok(&passed));
            assert_eq!(inexact(&passed), Ok(Vec::new()));
            assert!(without_decorations(&passed).is_ok());
            signature((true, bare.is_ok(), passed.len().min(64)))
        }
        Err(error) => {
            let text = error.to_string();
            let words: String = text.chars().filter(|c| !c.is_ascii_digit()).collect();
            signature((false, bare.is_ok(), words))
        }
    }
}
