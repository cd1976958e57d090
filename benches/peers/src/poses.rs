//! Measures one pose for each call, as in a game: 60 joints of ten seconds of motion at 30 Hz, at times that follow
//! each other by a 60th of a second, and at times in any order.

use std::hint::black_box;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{KeyPrecision, MotionBuilder, MotionStates};
use tumble::{Device, Engine, EngineOptions, Method, Skeleton, TrackSet, VectorMethod, method};
use ultraviolet::{Bivec3x8, Rotor3x8, Slerp, f32x8};

use crate::bevy;

const TRACKS: usize = 60;
const CALLS: usize = 10_000;
/// The calls that are timed together: less than the time after which a busy machine runs another program, so that the
/// median is that of calls without interruption.
const TIMED: usize = 100;
const ROUNDS: usize = 3;
const KEYS: usize = 300;
const RATE: f64 = 30.0;
/// All times are whole numbers of these, in a second.
const TICKS: u32 = 705_600;
/// The calls whose poses are compared with the reference.
const CHECKED: usize = 2000;

/// Up to 4 degrees a step.
fn motion() -> TrackSet {
    let mut random = fastrand::Rng::with_seed(6);
    let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
    let times: Vec<f64> = (0..KEYS).map(|key| key as f64 / RATE).collect();
    let mut set = TrackSet::new();
    for _ in 0..TRACKS {
        let mut rotation = DQuat::IDENTITY;
        let mut key = || {
            let axis = DVec3::from_array([(); 3].map(|()| between(-1.0, 1.0)));
            let step = DQuat::from_axis_angle(axis.normalize_or(DVec3::X), between(0.0, 0.07));
            rotation = (rotation * step).normalize();
            rotation.as_quat()
        };
        let keys: Vec<Quat> = times.iter().map(|_| key()).collect();
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}

/// Between keys, a 60th of a second after the last; half of the calls are in another interval than the call before.
fn next_times() -> Vec<f64> {
    let tick = |call: usize| (call % (2 * KEYS - 4)) as u32 * (TICKS / 60) + TICKS / 200;
    (0..CALLS).map(|call| seconds(tick(call))).collect()
}

fn any_times() -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(7);
    let end = (KEYS as u32 - 1) * (TICKS / RATE as u32);
    (0..CALLS).map(|_| seconds(random.u32(0..end))).collect()
}

fn seconds(tick: u32) -> f64 {
    f64::from(tick) / f64::from(TICKS)
}

/// The numbers of tracks, keys and calls, and the rate; the times of the calls in f64, first those that go on; the
/// keys in f32, `[track][key]`.
pub fn packed() -> Vec<u8> {
    let mut bytes = Vec::new();
    for count in [TRACKS, KEYS, CALLS] {
        bytes.extend_from_slice(&(count as u32).to_le_bytes());
    }
    bytes.extend_from_slice(&RATE.to_le_bytes());
    bytes.extend_from_slice(bytemuck::cast_slice(&next_times()));
    bytes.extend_from_slice(bytemuck::cast_slice(&any_times()));
    let set = motion();
    (0..TRACKS).for_each(|track| {
        bytes.extend_from_slice(bytemuck::cast_slice(set.track(track).keys));
    });
    bytes
}

/// The interval of a time, and how much of it is over.
fn interval_at(time: f64) -> (usize, f64) {
    let key = (time * RATE).floor().min(KEYS as f64 - 2.0);
    (key as usize, time * RATE - key)
}

/// Slerp in f64, without a threshold.
fn reference(keys: &[Quat], time: f64) -> DQuat {
    let (key, part) = interval_at(time);
    let [from, to] = [keys[key], keys[key + 1]].map(|key| key.as_dquat().normalize());
    let step = from.conjugate() * if from.dot(to) < 0.0 { -to } else { to };
    let half = step.xyz().length().atan2(step.w);
    let vector = step.xyz().normalize_or(DVec3::X) * (half * part).sin();
    from * DQuat::from_xyzw(vector.x, vector.y, vector.z, (half * part).cos())
}

/// The angle of the rotation between two, exact for small ones.
fn angle_between(a: DQuat, b: DQuat) -> f64 {
    let step = a.conjugate() * b;
    2.0 * step.xyz().length().atan2(step.w.abs())
}

struct Contestant {
    name: &'static str,
    work: &'static str,
    times: &'static [f64],
    /// The memory of the keys in the form that it evaluates.
    bytes_per_key: f64,
    /// The largest difference from the reference, in radians, if its curve is that of the reference.
    error: Option<f64>,
    /// Fills the poses of some times, one after the other.
    fill: Box<dyn FnMut(&[f64], &mut [Quat])>,
}

/// All contestants one after another, after a round that does not count; a line of JSON for each, with the time of all
/// calls by the median.
pub fn race() {
    let mut contestants = contestants();
    let mut pose = [Quat::IDENTITY; TRACKS];
    let mut found = vec![Vec::new(); contestants.len()];
    for round in 0..=ROUNDS {
        for (contestant, found) in contestants.iter_mut().zip(&mut found) {
            for times in contestant.times.chunks_exact(TIMED) {
                let started = Instant::now();
                (contestant.fill)(times, &mut pose);
                if round > 0 {
                    found.push(started.elapsed());
                }
            }
        }
    }
    for (contestant, mut found) in contestants.iter().zip(found) {
        found.sort();
        let median: Duration = found[found.len() / 2];
        let error = contestant.error.map(|error| format!("{error:.1e}"));
        println!(
            "{{\"name\": {:?}, \"work\": {:?}, \"threads\": \"1\", \"bytes_per_key\": {:.1}, \"error\": {}, \"ms\": {}}}",
            contestant.name,
            contestant.work,
            contestant.bytes_per_key,
            error.as_deref().unwrap_or("null"),
            1e3 * median.as_secs_f64() * (CALLS / TIMED) as f64,
        );
    }
}

/// The motion, and the times of all calls.
#[derive(Clone, Copy)]
struct Poses {
    set: &'static TrackSet,
    next: &'static [f64],
    any: &'static [f64],
}

impl Poses {
    /// A contestant for either kind of times. `pose` makes the function that fills a pose.
    fn contestants<P: FnMut(f64, &mut [Quat]) + 'static>(
        self,
        name: &'static str,
        curve: Curve,
        bytes_per_key: f64,
        pose: impl Fn() -> P,
    ) -> [Contestant; 2] {
        let works = match curve {
            Curve::Slerp => ["one pose, slerp, next time", "one pose, slerp, any time"],
            Curve::Smooth => ["one pose, smooth, next time", "one pose, smooth, any time"],
        };
        let contestant = |work, times: &'static [f64]| {
            let mut fill = pose();
            let error = (curve == Curve::Slerp).then(|| self.largest_error(times, &mut fill));
            Contestant {
                name,
                work,
                times,
                bytes_per_key,
                error,
                fill: Box::new(move |times, output| {
                    for &time in times {
                        fill(time, output);
                        black_box(&mut *output);
                    }
                }),
            }
        };
        let [next, any] = works;
        [contestant(next, self.next), contestant(any, self.any)]
    }

    fn largest_error(self, times: &[f64], mut fill: impl FnMut(f64, &mut [Quat])) -> f64 {
        let mut pose = [Quat::IDENTITY; TRACKS];
        let mut largest = 0.0f64;
        for &time in &times[..CHECKED] {
            fill(time, &mut pose);
            for (track, value) in pose.iter().enumerate() {
                let reference = reference(self.set.track(track).keys, time);
                largest = largest.max(angle_between(value.as_dquat().normalize(), reference));
            }
        }
        largest
    }

    fn sampler(
        self,
        name: &'static str,
        curve: Curve,
        method: Method,
        kept_segments: u64,
    ) -> [Contestant; 2] {
        let mut options = EngineOptions::default();
        options.kept_segments = Some(kept_segments);
        let engine = Engine::with_options(Device::Cpu, &options).expect("a CPU");
        let clip = engine.upload(self.set, method).expect("good keys");
        self.contestants(name, curve, clip.bytes_per_key(), || {
            let mut sampler = clip.sampler().expect("memory");
            move |time, output: &mut [Quat]| sampler.pose(time, output).expect("what fits")
        })
    }

    /// The tables of learning: keys as they are, or in 64 bits.
    fn tables(self, name: &'static str, precision: KeyPrecision) -> [Contestant; 2] {
        let skeleton = Skeleton::new(vec![None; TRACKS], vec![Vec3::ZERO; TRACKS]);
        let skeleton = skeleton.expect("joints without parents");
        let mut builder = MotionBuilder::new(&skeleton, TICKS, precision).expect("joints");
        (builder.push(self.set, method::SLERP, VectorMethod::Linear)).expect("good keys");
        let (tables, spans, cells) = builder.finish();
        let bytes = size_of_val(&spans[..]) + size_of_val(&cells[..]);
        let bytes_per_key = bytes as f64 / (TRACKS * KEYS) as f64;
        let engine = Engine::with_options(Device::Cpu, &EngineOptions::default());
        let engine = engine.expect("a CPU");
        self.contestants(name, Curve::Slerp, bytes_per_key, || {
            let (tables, engine) = (tables.clone(), engine.clone());
            let (spans, cells) = (spans.clone(), cells.clone());
            move |time, output: &mut [Quat]| {
                let tick = (time * f64::from(TICKS)).round() as u32;
                let states = MotionStates {
                    rotations: bytemuck::cast_slice_mut(output),
                    ..MotionStates::default()
                };
                let done = tables.sample_into(&engine, (&spans, &cells), &[(0, tick)], states);
                done.expect("what fits");
            }
        })
    }

    fn glam(self) -> [Contestant; 2] {
        let keys: Vec<&[Quat]> = (0..TRACKS)
            .map(|track| self.set.track(track).keys)
            .collect();
        self.contestants("glam Quat::slerp, by hand", Curve::Slerp, 16.0, || {
            let keys = keys.clone();
            move |time, output: &mut [Quat]| {
                let (key, part) = interval_at(time);
                for (value, keys) in output.iter_mut().zip(&keys) {
                    *value = keys[key].slerp(keys[key + 1], part as f32);
                }
            }
        })
    }

    /// A pose of each key, eight tracks side by side.
    fn ultraviolet(self) -> [Contestant; 2] {
        let eights = TRACKS.div_ceil(8);
        let rotors: Vec<Rotor3x8> = (0..KEYS)
            .flat_map(|key| (0..eights).map(move |eight| (key, eight)))
            .map(|(key, eight)| {
                let of = |component: usize| {
                    let lane = |lane: usize| {
                        let track = (8 * eight + lane).min(TRACKS - 1);
                        self.set.track(track).keys[key].to_array()[component]
                    };
                    f32x8::new(std::array::from_fn(lane))
                };
                Rotor3x8::new(of(3), Bivec3x8::new(-of(2), of(1), -of(0)))
            })
            .collect();
        let name = "ultraviolet Rotor3x8::slerp, keys side by side";
        let bytes_per_key = size_of_val(&rotors[..]) as f64 / (TRACKS * KEYS) as f64;
        self.contestants(name, Curve::Slerp, bytes_per_key, || {
            let rotors = rotors.clone();
            move |time, output: &mut [Quat]| {
                let (key, part) = interval_at(time);
                let (from, to) = rotors[key * eights..][..2 * eights].split_at(eights);
                for (eight, values) in output.chunks_mut(8).enumerate() {
                    let q = from[eight].slerp(to[eight], f32x8::splat(part as f32));
                    let [x, y, z, w] = q.into_quaternion_array().map(f32x8::to_array);
                    for (j, value) in values.iter_mut().enumerate() {
                        *value = Quat::from_xyzw(x[j], y[j], z[j], w[j]);
                    }
                }
            }
        })
    }

    /// Keys and times in f32.
    fn bevy(self) -> [Contestant; 2] {
        let bytes_per_key = 20.0;
        self.contestants(
            "Bevy UnevenSampleAutoCurve",
            Curve::Slerp,
            bytes_per_key,
            || {
                let curves = bevy::arcs(self.set);
                move |time, output: &mut [Quat]| bevy::pose(&curves, time as f32, output)
            },
        )
    }

    /// The same with two tangents for each key.
    #[cfg(feature = "bevy")]
    fn bevy_smooth(self) -> [Contestant; 2] {
        let bytes_per_key = 52.0;
        self.contestants(
            "Bevy CubicRotationCurve",
            Curve::Smooth,
            bytes_per_key,
            || {
                let curves = bevy::hermite(self.set);
                move |time, output: &mut [Quat]| bevy::pose(&curves, time as f32, output)
            },
        )
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Curve {
    /// As the reference.
    Slerp,
    /// Every library has another.
    Smooth,
}

fn contestants() -> Vec<Contestant> {
    let poses = Poses {
        set: Box::leak(Box::new(motion())),
        next: next_times().leak(),
        any: any_times().leak(),
    };
    let (segments, keys) = ("Tumble Sampler, segments kept", "Tumble Sampler, keys kept");
    let smooth = method::BESSEL_OVERHAUSER;
    let contestants = [
        poses.sampler(segments, Curve::Slerp, method::SLERP, u64::MAX),
        poses.sampler(keys, Curve::Slerp, method::SLERP, 0),
        poses.tables("Tumble MotionTables, exact keys", KeyPrecision::Exact),
        poses.tables("Tumble MotionTables, packed keys", KeyPrecision::Packed),
        poses.glam(),
        poses.ultraviolet(),
        poses.bevy(),
        poses.sampler(segments, Curve::Smooth, smooth, u64::MAX),
        poses.sampler(keys, Curve::Smooth, smooth, 0),
        #[cfg(feature = "bevy")]
        poses.bevy_smooth(),
    ];
    contestants.into_iter().flatten().collect()
}
