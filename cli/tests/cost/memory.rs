//! The memory that reading takes. Counting instructions at the same time takes next to none, because other
//! processes do it.

use std::io::{BufReader, Read};

use glam::Quat;
use tumble::{
    Chunk, Device, Encoding, Engine, EngineOptions, Error, Interpolation, Layout, Request,
    SampleTimes, TrackSet, WrapMode, method,
};
use tumble_formats::Loaded;
use tumble_formats::ReadOptions;
use tumble_formats::dat::read_dat;
use tumble_formats::{Code, Diagnostic};

use crate::{one_at_a_time, peak_of};

const MIB: usize = 1 << 20;

/// Catches a sampler that allocates for a sample, even if it frees the memory at once: between, at and outside the
/// keys, and on curves that are computed in f64.
#[test]
fn a_sampler_allocates_nothing_after_it_was_made() {
    let _one = one_at_a_time();
    let turning = |step: f32| {
        let mut set = TrackSet::new();
        for track in 0..60 {
            let key = |i: i32| Quat::from_rotation_y(step * (i * track) as f32);
            let keys: Vec<Quat> = (0..20).map(key).collect();
            let times: Vec<f64> = (0..20).map(f64::from).collect();
            set.push("", &times, &keys).unwrap();
        }
        set
    };
    let engine = Engine::new(Device::Cpu).unwrap();
    let mut options = EngineOptions::default();
    options.kept_segments = Some(0);
    let keeping_keys = Engine::with_options(Device::Cpu, &options).unwrap();
    let (turning_fast, turning_little) = (turning(0.1), turning(0.003));
    for (engine, set, method, after) in [
        (&engine, &turning_fast, method::SLERP, WrapMode::Loop),
        (&engine, &turning_fast, method::SQUAD, WrapMode::Loop),
        (&engine, &turning_fast, method::C2, WrapMode::Loop),
        (&engine, &turning_fast, method::SLERP, WrapMode::Extrapolate),
        (&engine, &turning_fast, method::SQUAD, WrapMode::Extrapolate),
        (&engine, &turning_fast, method::C2, WrapMode::Extrapolate),
        (
            &keeping_keys,
            &turning_little,
            method::SLERP,
            WrapMode::Hold,
        ),
        (
            &keeping_keys,
            &turning_little,
            method::BESSEL_OVERHAUSER,
            WrapMode::Hold,
        ),
    ] {
        let interpolation = Interpolation::from(method).with_after(after);
        let clip = engine.upload(set, interpolation).unwrap();
        if std::ptr::eq(set, &raw const turning_little) {
            assert!(clip.bytes_per_key() < 100.0, "{method}");
        }
        let mut sampler = clip.sampler().unwrap();
        let mut pose = vec![Quat::IDENTITY; 60];
        let sample_all = || {
            for frame in 0..200 {
                let time = f64::from(frame) * 0.25 - 3.0;
                sampler.pose(time, &mut pose).unwrap();
                sampler.sample(7, -time).unwrap();
            }
        };
        // Another thread's message may come between.
        let peaks = std::iter::repeat_with({
            let mut sample_all = sample_all;
            move || peak_of(&mut sample_all).1
        });
        assert!(peaks.take(5).any(|peak| peak == 0), "{method}, {after}");
    }
}

/// The result of reading, and the most memory that it took in addition to the memory in use before, bytes; for
/// one test at a time.
fn reading(input: impl Read) -> (Result<Loaded, Diagnostic>, usize) {
    let reader = BufReader::with_capacity(1 << 18, input);
    peak_of(|| read_dat("t", reader, &ReadOptions::default()))
}

/// A file that is not stored: its lines are made when they are read.
struct Lines<F> {
    make: F,
    number: usize,
    line: Vec<u8>,
    done: usize,
    total: usize,
}

impl<F: FnMut(usize, &mut Vec<u8>)> Lines<F> {
    fn new(make: F) -> Self {
        let (line, number, done, total) = (Vec::new(), 0, 0, 0);
        Self {
            make,
            number,
            line,
            done,
            total,
        }
    }
}

impl<F: FnMut(usize, &mut Vec<u8>)> Read for Lines<F> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if self.done == self.line.len() {
            self.line.clear();
            (self.make)(self.number, &mut self.line);
            (self.number, self.done) = (self.number + 1, 0);
        }
        let count = out.len().min(self.line.len() - self.done);
        out[..count].copy_from_slice(&self.line[self.done..self.done + count]);
        self.done += count;
        self.total += count;
        Ok(count)
    }
}

/// A file of so many bytes costs its keys and times, and a bounded amount more.
/// `LARGE_FILE` is its length in bytes, as 2000000000.
#[test]
#[cfg(target_os = "linux")]
fn a_large_file_is_read_in_bounded_extra_memory() {
    let _one = one_at_a_time();
    use std::io::Write;

    let length = std::env::var("LARGE_FILE").map_or(100_000_000, |text| text.parse().unwrap());
    for boxes in [1, 3, 200] {
        let mut written = 0;
        let mut input = Lines::new(|number, line: &mut Vec<u8>| {
            if number == 0 {
                writeln!(line, "# {boxes} 1").unwrap();
            } else if written < length {
                write!(line, "{:.6}", number as f64 * 0.01).unwrap();
                for _ in 0..boxes {
                    line.extend_from_slice(b" 0.707107 -0.707107 0.000000 0.000000");
                }
                line.push(b'\n');
            }
            written += line.len();
        });
        let started = std::time::Instant::now();
        let before = resident(true);
        let (loaded, _) = reading(&mut input);
        let peak = resident(false) - before;
        let set = loaded.unwrap().clips.remove(0).set;
        let stored = set.key_count() * 16 + set.track(0).times.len() * 8;
        let extra = peak.saturating_sub(stored);
        println!(
            "{boxes} boxes, {} MB: {} MB of keys and times, {} MB more, {:.0} MB/s",
            input.total / 1_000_000,
            stored / 1_000_000,
            extra / 1_000_000,
            input.total as f64 / 1e6 / started.elapsed().as_secs_f64()
        );
        // At most two copies of a block of keys and of a block of times exist at once.
        assert!(extra < 128 * MIB, "{boxes} boxes: {} MiB more", extra / MIB);
    }
}

#[cfg(target_os = "linux")]
/// The most memory that was resident since the last reset, in bytes.
fn resident(begin: bool) -> usize {
    if begin {
        std::fs::write("/proc/self/clear_refs", "5").unwrap();
    }
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:"));
    let kibibytes: usize = line
        .unwrap()
        .split_whitespace()
        .nth(1)
        .unwrap()
        .parse()
        .unwrap();
    kibibytes * 1024
}

/// A set whose segments would take ten times what the engine may use: an uploaded clip, and a stream frame by frame,
/// stay within it. Without a limit both took all of it.
#[test]
fn clips_and_streams_keep_to_the_memory_of_the_engine() {
    let _one = one_at_a_time();
    let (tracks, keys) = (40, 10_000);
    let times: Vec<f64> = (0..keys).map(|key| f64::from(key) * 0.01).collect();
    let mut set = TrackSet::new();
    for track in 0..tracks {
        let key = |&time: &f64| Quat::from_rotation_y((time * 0.8 + f64::from(track)) as f32);
        let keys: Vec<Quat> = times.iter().map(key).collect();
        set.push("", &times, &keys).unwrap();
    }
    let of_keys = set.key_count() * size_of::<Quat>() + times.len() * size_of::<f64>();
    let (frames, layout) = (SampleTimes::fps(50), Layout::FrameMajor);
    let method = method::BESSEL_OVERHAUSER;
    let limit = 8 * MIB;
    for (memory, kept_segments) in [
        (None, Some(u64::MAX)),
        (Some(limit as u64), Some(u64::MAX)),
        (None, Some(0)),
    ] {
        let mut options = EngineOptions::default();
        (options.memory, options.kept_segments) = (memory, kept_segments);
        let engine = Engine::with_options(Device::Cpu, &options).unwrap();
        let (clip, uploading) = peak_of(|| engine.upload(&set, method).unwrap());
        let mut rotations = vec![Quat::IDENTITY; tracks as usize * 100];
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut rotations);
        let ((), evaluating) = peak_of(|| {
            let request = clip.request(&frames).layout(layout);
            request.samples(200..300).evaluate_into(bytes).unwrap();
        });
        drop(clip);
        let (count, streaming) = peak_of(|| {
            let mut count = 0;
            let sink = |chunk: Chunk<'_>| {
                count += chunk.rows.len();
                Ok::<(), Error>(())
            };
            engine
                .request(&set, method, &frames)
                .layout(layout)
                .stream(1 << 14, sink)
                .unwrap();
            count
        });
        assert_eq!(count, 40 * (9999 / 2 + 1));
        println!(
            "{memory:?}: uploading {} KiB, evaluating {} KiB, streaming {} KiB",
            uploading >> 10,
            evaluating >> 10,
            streaming >> 10
        );
        // A part of a set takes the memory that its samples need.
        let (count, of_part) = peak_of(|| {
            let mut count = 0;
            let request = engine.request(&set, method, &frames).layout(layout);
            let request = request.tracks(7..9).samples(1000..1500);
            let sink = |chunk: Chunk<'_>| {
                count += chunk.rows.len();
                Ok::<(), Error>(())
            };
            request.stream(1 << 8, sink).unwrap();
            count
        });
        assert_eq!(count, 2 * 500);
        println!("{memory:?}: streaming a part {} KiB", of_part >> 10);
        assert!(of_part < 2 * MIB, "{of_part}");
        // Polynomials of small angles are packed.
        let segments = set.key_count() * 112;
        match memory {
            None if kept_segments == Some(0) => {
                // Only keys are kept, and the data by which intervals with large rotations are
                // found.
                assert!(uploading <= of_keys + MIB, "{uploading}");
            }
            None => {
                assert!(uploading > segments && streaming > 4 * limit);
                // The memory of segments, keys and spans, and the working memory of the threads.
                let allowed = set.key_count() * (112 + 16 + 16) + 4 * MIB;
                assert!(uploading <= allowed, "{uploading}");
            }
            Some(_) => {
                assert!(uploading <= of_keys + MIB, "{uploading}");
                // Lists grow by doubling, and three chunks are in use at the same time.
                let allowed = 2 * limit + 4 * MIB;
                assert!(evaluating <= allowed, "{evaluating}");
                assert!(streaming <= allowed, "{streaming}");
            }
        }
    }
}

/// Sets evaluated without a limit: in batches, whatever a value is stored as and whichever samples it is of, and in
/// pieces of 256 MiB where batches cannot be. Each of these once prepared all segments at once.
#[test]
fn no_request_prepares_all_segments_at_once() {
    let _one = one_at_a_time();
    let engine = Engine::new(Device::Cpu).unwrap();
    let set_of = |tracks: usize, keys: usize| {
        let times: Vec<f64> = (0..keys).map(|key| key as f64 * 0.01).collect();
        let key = |key: usize| Quat::from_rotation_y((key % 511) as f32 * 0.01);
        let keys = (0..tracks * keys).map(key).collect();
        TrackSet::from_shared_times(times, keys).unwrap()
    };
    let peak = |request: &Request<'_>| {
        let (count, each) = request.size().unwrap();
        let mut output = vec![0_u64; (count * each).div_ceil(8)];
        let output = &mut bytemuck::cast_slice_mut::<_, u8>(&mut output)[..count * each];
        peak_of(|| request.evaluate_into(output).unwrap()).1
    };

    let (set, method) = (set_of(100, 3000), method::BESSEL_OVERHAUSER);
    let (segments, limit) = (set.key_count() * 176, 8 * MIB);
    assert!(segments > 6 * limit);
    let frames = SampleTimes::fps(120);
    let request = engine.request(&set, method, &frames);
    let encodings = Encoding::ALL
        .into_iter()
        .map(|it| request.clone().encoding(it));
    let parts = [0..1200, 300..3400].map(|samples| request.clone().samples(samples));
    for request in encodings.chain(parts) {
        let peak = peak(&request);
        assert!(peak < limit, "{}: {peak}", request.explain().unwrap());
    }

    let (set, limit) = (set_of(3000, 1500), 256 * MIB);
    let segments = set.key_count() * 208;
    assert!(segments > 3 * limit);
    let frames = SampleTimes::fps(25);
    let mut looped = Interpolation::from(method);
    looped.after = WrapMode::Loop;
    let requests = [
        engine
            .request(&set, method, &frames)
            .layout(Layout::FrameMajor),
        engine.request(&set, looped, &frames),
    ];
    for request in requests {
        let peak = peak(&request);
        let explained = request.explain().unwrap();
        // A piece uses the memory of the piece before it, and at most two copies of it exist at
        // once.
        assert!(peak > limit / 4 && peak < 2 * limit, "{explained}: {peak}");
    }
}

/// Refusing a file costs no more memory than the bytes read of it and 64 MiB, whatever the file claims.
#[test]
fn a_refusal_costs_no_more_than_was_read() {
    let _one = one_at_a_time();
    let wide = |number: usize, line: &mut Vec<u8>| match number {
        0 => line.extend_from_slice(b"# 65536 1\n"),
        1..4 => {
            line.push(b'0' + number as u8);
            for _ in 0..65_536 - usize::from(number == 3) {
                line.extend_from_slice(b" 1 0 0 0");
            }
            line.push(b'\n');
        }
        _ => {}
    };
    let repeated = |start: &'static str, piece: &'static str| {
        move |number: usize, line: &mut Vec<u8>| {
            let text = if number == 0 { start } else { piece };
            line.extend_from_slice(text.as_bytes());
        }
    };
    type Make = Box<dyn FnMut(usize, &mut Vec<u8>)>;
    let cases: [(Code, Make); 6] = [
        (
            Code::Columns,
            Box::new(repeated("# 65536 1\n", "0 1 0 0 0\n")),
        ),
        (Code::Columns, Box::new(wide)),
        (
            Code::LineTooLong,
            Box::new(repeated("# 1 1\n", "0 0 0 0 0 0 0 0")),
        ),
        (
            Code::LineTooLong,
            Box::new(repeated("", "7777777777777777")),
        ),
        (
            Code::Boxes,
            Box::new(repeated("# 99999999999999999999 1\n", "0\n")),
        ),
        (
            Code::LineTooLong,
            Box::new(repeated("# 1 1\n0 ", "1111111111111111")),
        ),
    ];
    for (code, make) in cases {
        let mut input = Lines::new(make);
        let (loaded, peak) = reading(&mut input);
        assert_eq!(loaded.unwrap_err().code, code);
        let read = input.total;
        assert!(
            peak <= 64 * MIB + read,
            "{code}: {} KiB for {} KiB",
            peak / 1024,
            read / 1024
        );
    }
}
