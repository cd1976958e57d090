//! The workloads that are measured: sets of keys and their sample times, the same in every
//! run.

use fastrand::Rng;
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::{SampleTimes, TrackSet};

/// A set, and the samples to evaluate.
pub(crate) struct Workload {
    pub(crate) set: TrackSet,
    pub(crate) frames: SampleTimes,
    /// The time of each sample in seconds; with `per_track`, the time of the only sample of each track.
    pub(crate) times: Vec<f64>,
    pub(crate) per_track: bool,
}

/// The workloads that there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum WorkloadKind {
    /// 4096 tracks of 26 uneven keys, 1200 frames
    Sparse,
    /// 4096 tracks of 300 keys at 30 Hz that turn little, as those of motion capture, 598 frames
    Motion,
    /// One time a call, of 1, 60 and 1000 tracks of such keys: requests and a sampler
    Poses,
    /// 4096 tracks of 2400 keys at 120 Hz, 1200 frames between them
    Dense,
    /// 4 tracks of 26 keys, 500 frames: the time of one call
    Small,
    /// 1 000 000 tracks of 2 keys, one sample each
    Crowd,
    /// 10 000 characters of 60 joints, each at its own time of one of 8 clips with 61 keys: rotations and model matrices
    Characters,
    /// 1 track of 10 000 000 keys at 120 Hz, 60 frames a second
    Long,
    /// 100 000 paths of 6 points, 60 frames
    Follow,
    /// 64 tracks of 1 000 000 samples, smoothed
    Smooth,
    /// 8 GiB of rotations, written to a file in chunks
    Stream,
    /// 3000 clips of 22 joints and 240 frames in each motion format: read, resampled to 60 fps
    Files,
}

/// Frames per second, in every workload.
pub(crate) const RATE: f64 = 60.0;

impl WorkloadKind {
    /// Makes the workload with one `shrink`th of its tracks, or of its keys where
    /// there is one track; none for characters, for files, for smoothing and for single poses.
    pub(crate) fn workload(self, shrink: usize) -> Option<Workload> {
        let scaled = |count: usize| (count / shrink).max(1);
        Some(match self {
            Self::Sparse => frames(uneven(scaled(4096), 26, 1200.0 / RATE), 0.0, 1200),
            Self::Motion => {
                let count = 2 * MOTION_KEYS - 2;
                frames(motion(scaled(4096), MOTION_KEYS), 0.0, count)
            }
            Self::Small => frames(uneven(4, 26, 500.0 / RATE), 0.0, 500),
            // Halfway between keys. At the keys, nothing would be evaluated.
            Self::Dense => frames(even(scaled(4096), 2400), 1.0 / 240.0, 1199),
            Self::Long => {
                let keys = scaled(10_000_000).max(4);
                frames(even(1, keys), 1.0 / 240.0, keys / 2 - 1)
            }
            Self::Stream => {
                let count = scaled(1 << 17);
                frames(uneven(4096, 26, count as f64 / RATE), 0.0, count)
            }
            Self::Crowd => crowd(scaled(1_000_000)),
            Self::Follow => paths(scaled(100_000)),
            Self::Characters | Self::Files | Self::Smooth | Self::Poses => return None,
        })
    }
}

fn frames(set: TrackSet, start: f64, count: usize) -> Workload {
    let end = start + (count - 1) as f64 / RATE;
    Workload {
        set,
        frames: SampleTimes::fps(RATE as u32).between(start, end),
        times: (0..count).map(|k| start + k as f64 / RATE).collect(),
        per_track: false,
    }
}

/// Keys at steps of 1/4 to 7/4 of the mean, each up to a radian from the last.
fn uneven(tracks: usize, keys: usize, seconds: f64) -> TrackSet {
    let mut random = Rng::with_seed(1);
    let mut set = TrackSet::new();
    for _ in 0..tracks {
        let mut times = vec![0.0];
        for key in 1..keys {
            times.push(times[key - 1] + between(&mut random, 0.25, 1.75));
        }
        let scale = seconds / times[keys - 1];
        times.iter_mut().for_each(|time| *time *= scale);
        push(&mut set, &times, walk(&mut random, keys, 1.0));
    }
    set
}

/// Keys at 120 Hz, as motion capture gives them: up to 3 degrees a step.
fn even(tracks: usize, keys: usize) -> TrackSet {
    walks(2, tracks, keys, 120.0, 0.05)
}

/// Keys of a track of motion: ten seconds.
pub(crate) const MOTION_KEYS: usize = 300;

/// Keys at 30 Hz, as motion capture is stored: up to 4 degrees a step.
pub(crate) fn motion(tracks: usize, keys: usize) -> TrackSet {
    walks(6, tracks, keys, 30.0, 0.07)
}

/// Keys at a rate, each up to `step` radians from the one before.
fn walks(seed: u64, tracks: usize, keys: usize, rate: f64, step: f64) -> TrackSet {
    let mut random = Rng::with_seed(seed);
    let mut set = TrackSet::new();
    let times: Vec<f64> = (0..keys).map(|k| k as f64 / rate).collect();
    for _ in 0..tracks {
        push(&mut set, &times, walk(&mut random, keys, step));
    }
    set
}

/// Two poses and one moment for each track.
fn crowd(tracks: usize) -> Workload {
    let mut random = Rng::with_seed(3);
    let mut set = TrackSet::new();
    for _ in 0..tracks {
        push(&mut set, &[0.0, 1.0], walk(&mut random, 2, 1.0));
    }
    let times: Vec<f64> = (0..tracks)
        .map(|_| between(&mut random, 0.0, 1.0))
        .collect();
    Workload {
        set,
        frames: SampleTimes::at_each(times.clone()),
        times,
        per_track: true,
    }
}

/// Samples of each path.
const PATH_SAMPLES: usize = 60;

/// Paths of six points, a second apart.
fn paths(tracks: usize) -> Workload {
    let mut random = Rng::with_seed(4);
    let mut set = TrackSet::new();
    let times: Vec<f64> = (0..6).map(f64::from).collect();
    for _ in 0..tracks {
        let (mut position, mut direction) = (DVec3::ZERO, DVec3::X);
        let mut next = || {
            let aside = DVec3::from_array([(); 3].map(|()| random.f64() - 0.5));
            direction = (direction + aside).normalize_or(DVec3::X);
            position += direction;
            position.as_vec3()
        };
        let points: Vec<Vec3> = times.iter().map(|_| next()).collect();
        set.push_path("", &times, &points, &[])
            .expect("points in order");
    }
    let times = (0..PATH_SAMPLES).map(|k| k as f64 / 12.0).collect();
    Workload {
        set,
        frames: SampleTimes::fps(12).between(0.0, (PATH_SAMPLES - 1) as f64 / 12.0),
        times,
        per_track: false,
    }
}

fn push(set: &mut TrackSet, times: &[f64], keys: Vec<Quat>) {
    set.push("", times, &keys).expect("unit keys in order");
}

/// Rotations, each up to `step` radians from the one before.
pub(crate) fn walk(random: &mut Rng, keys: usize, step: f64) -> Vec<Quat> {
    let mut rotation = DQuat::IDENTITY;
    let mut next = || {
        let axis = DVec3::from_array([(); 3].map(|()| between(random, -1.0, 1.0)));
        let angle = between(random, 0.0, step);
        rotation *= DQuat::from_axis_angle(axis.normalize_or(DVec3::X), angle);
        rotation = rotation.normalize();
        rotation.as_quat()
    };
    (0..keys).map(|_| next()).collect()
}

fn between(random: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * random.f64()
}
