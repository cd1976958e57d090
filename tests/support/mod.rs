//! Code that several test files share: devices, hostile keys, a small generator.
#![allow(dead_code, unreachable_pub)] // each test file uses some of it

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use glam::{DQuat, DVec3, Quat};
use tumble::vulkan::tuning::{Mapping, PrepareArcs, ReadBack, Reads, Transfer, Uploads};
use tumble::{Device, Engine, EngineOptions, SampleTimes, Tcb, TrackSet};

/// Every Vulkan device of this machine, with the validation layer when asked.
/// There must be one in CI; elsewhere its absence is said aloud.
pub fn vulkan_devices() -> Vec<Device> {
    let devices = Device::list().unwrap_or_else(|error| {
        eprintln!("{error}");
        Vec::new()
    });
    assert!(
        !devices.is_empty() || std::env::var_os("CI").is_none(),
        "CI must have a Vulkan device (Debian: mesa-vulkan-drivers)"
    );
    if devices.is_empty() {
        eprintln!("NO VULKAN DEVICE: this test compared nothing");
    }
    devices
}

/// How kernels read their input, and whether an invocation evaluates runs or single samples.
pub const KERNEL_OPTIONS: [(Reads, Mapping); 3] = [
    (Reads::StorageBuffers, Mapping::Runs),
    (Reads::TexelBuffers, Mapping::Runs),
    (Reads::StorageBuffers, Mapping::Samples),
];

/// Where arcs are prepared, with kernels that are used so: each way with some of [`KERNEL_OPTIONS`].
pub fn prepare_arcs(kernel: (Reads, Mapping)) -> PrepareArcs {
    match kernel {
        (Reads::StorageBuffers, Mapping::Runs) => PrepareArcs::OnHost,
        _ => PrepareArcs::OnDevice,
    }
}

/// How uploads reach a device whose results are staged, and how these results are copied back.
pub const STAGED: [(Uploads, ReadBack); 3] = [
    (Uploads::Staged, ReadBack::SameQueue),
    (Uploads::Direct, ReadBack::Overlapped),
    (Uploads::Staged, ReadBack::Overlapped),
];

/// Stages results, in each round by the next of [`STAGED`].
pub fn stage(options: &mut EngineOptions, round: usize) {
    options.transfer = Transfer::Staged;
    (options.uploads, options.read_back) = STAGED[round % STAGED.len()];
}

/// [`KERNEL_OPTIONS`], or the first alone where `TUMBLE_TEST_ONE_WAY` is set: for drivers that are tried beside those of
/// the system.
fn kernel_options() -> &'static [(Reads, Mapping)] {
    match std::env::var_os("TUMBLE_TEST_ONE_WAY") {
        Some(_) => &KERNEL_OPTIONS[..1],
        None => &KERNEL_OPTIONS,
    }
}

/// Every Vulkan device in all of [`KERNEL_OPTIONS`]. Tests share the engines of the same options, because the
/// driver's compiling of kernels takes longest in most of them.
pub fn vulkan_engines(change: impl Fn(&mut EngineOptions)) -> Vec<Engine> {
    static OPEN: Mutex<BTreeMap<String, Engine>> = Mutex::new(BTreeMap::new());
    let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
    let mut engines = Vec::new();
    for (index, device) in vulkan_devices().into_iter().enumerate() {
        for &(reads, mapping) in kernel_options() {
            let mut options = EngineOptions::default();
            (options.reads, options.mapping) = (reads, mapping);
            options.prepare_arcs = prepare_arcs((reads, mapping));
            change(&mut options);
            let new = || Engine::with_options(device.clone(), &options).unwrap();
            let engine = open.entry(format!("{index} {options:?}"));
            engines.push(engine.or_insert_with(new).clone());
        }
    }
    engines
}

/// The engines, from one or more calls of [`vulkan_engines`], that are due in this round: each device with
/// one of [`KERNEL_OPTIONS`], in the next round with the next.
pub fn round_robin(engines: &[Engine], round: usize) -> impl Iterator<Item = &Engine> {
    let is_next =
        move |(index, _): &(usize, &Engine)| is_due(round, *index, kernel_options().len());
    (engines.iter().enumerate().filter(is_next)).map(|(_, engine)| engine)
}

/// Whether the case at an index is tried in this round: the rounds of a test share its cases out, so that
/// all are tried once in so many rounds. With `SOAK` set every round tries all.
pub fn is_due(round: usize, index: usize, rounds: usize) -> bool {
    (round + index).is_multiple_of(rounds) || std::env::var_os("SOAK").is_some()
}

/// Mesa's software driver, by its manifest.
pub fn lavapipe() -> Option<std::path::PathBuf> {
    let manifests = std::fs::read_dir("/usr/share/vulkan/icd.d").ok()?;
    let mut paths = manifests.map(|entry| entry.unwrap().path());
    paths.find(|path| path.to_string_lossy().contains("/lvp_icd"))
}

/// `SplitMix64` (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[(self.next() % values.len() as u64) as usize]
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let v = DVec3::from_array(std::array::from_fn(|_| self.between(-1.0, 1.0)));
            if (0.01..1.0).contains(&v.length_squared()) {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> DQuat {
        let angle = self.between(0.0, std::f64::consts::TAU);
        DQuat::from_axis_angle(self.direction(), angle)
    }
}

/// A difficult set: steps from 1e-7 rad to pi, components of 1e-30, gaps of one frame and of a thousand seconds, one
/// and two keys, tracks that start and end at different times.
pub fn hostile_set(seed: u64, tracks: usize) -> TrackSet {
    let mut random = Random(seed);
    let mut set = TrackSet::new();
    for track in 0..tracks {
        let keys = match track % 16 {
            0 => 1,
            1 => 2,
            2 => 3,
            _ => 4 + (random.next() % 28) as usize,
        };
        let mut time = random.between(-1.0, 1.0);
        let mut rotation = random.rotation();
        let (mut times, mut quats) = (Vec::new(), Vec::new());
        for _ in 0..keys {
            times.push(time);
            quats.push(hostile_key(&mut random, rotation));
            time += match random.next() % 64 {
                0..4 => 1.0 / 25.0,
                4..8 => 1e-5,
                8 => 1000.0,
                _ => random.between(0.05, 2.0),
            };
            let angle = match random.next() % 32 {
                0 => std::f64::consts::PI,
                _ => {
                    random.pick(&[0.0, 1e-7, 1e-4, 0.03, 0.5, 1.0, 2.0, 3.0])
                        * random.between(0.7, 1.04)
                }
            };
            rotation = (rotation * DQuat::from_axis_angle(random.direction(), angle)).normalize();
        }
        set.push("", &times, &quats)
            .expect("unit keys at increasing times");
    }
    give_key_data(&mut set, seed);
    set
}

/// Velocities, tangents, tension, continuity and bias for the keys of most tracks.
pub fn give_key_data(set: &mut TrackSet, seed: u64) {
    let mut random = Random(seed ^ 0xdada);
    for index in (0..set.track_count()).filter(|index| index % 7 != 3) {
        let keys = set.track(index).keys.to_vec();
        let velocities: Vec<_> = (keys.iter())
            .map(|_| random.direction() * random.between(0.0, 2.0))
            .collect();
        let tangent = |key: Quat, velocity: DVec3| {
            let [x, y, z] = (velocity * 0.5).to_array();
            (key.as_dquat() * DQuat::from_xyzw(x, y, z, 0.0)).as_quat()
        };
        let tangents: Vec<_> = (keys.iter().zip(&velocities))
            .map(|(&key, &velocity)| [tangent(key, velocity), tangent(key, velocity * 0.7)])
            .collect();
        let tcb: Vec<_> = (keys.iter())
            .map(|_| Tcb {
                tension: random.between(-1.0, 1.0),
                continuity: random.between(-1.0, 1.0),
                bias: random.between(-1.0, 1.0),
            })
            .collect();
        set.set_velocities(index, &velocities).unwrap();
        set.set_tangents(index, &tangents).unwrap();
        set.set_tcb(index, &tcb).unwrap();
    }
}

fn hostile_key(random: &mut Random, rotation: DQuat) -> Quat {
    let mut components = rotation.to_array();
    match random.next() % 32 {
        0 => components[0] = 1e-30,
        1 => components = [0.0, 0.0, 0.0, 1.0],
        2 => components = [1.0, 0.0, 0.0, 0.0],
        3 => components = [1e-30, 0.0, 0.6, 0.8],
        _ => {}
    }
    let key = DQuat::from_array(components).normalize();
    let sign = if random.next().is_multiple_of(4) {
        -1.0
    } else {
        1.0
    };
    Quat::from_array(key.to_array().map(|c| (sign * c) as f32))
}

/// The first rotation whose bits differ.
pub fn first_difference(a: &[Quat], b: &[Quat]) -> Option<usize> {
    assert_eq!(a.len(), b.len());
    let bits = |q: &Quat| q.to_array().map(f32::to_bits);
    a.iter().zip(b).position(|(a, b)| bits(a) != bits(b))
}

/// Tracks of keys near each other, 100 a second, all at the same times; each key with the
/// other sign with that probability. And 91 frames a second, from the first key to the last.
pub fn dense_set(tracks: usize, keys: usize, negated: f64) -> (TrackSet, SampleTimes) {
    let mut random = Random(9);
    let times: Vec<f64> = (0..keys).map(|k| k as f64 * 0.01).collect();
    let mut all = Vec::new();
    for _ in 0..tracks {
        let mut rotation = random.rotation();
        for _ in 0..keys {
            let step = DQuat::from_axis_angle(random.direction(), random.between(0.0, 0.05));
            let sign = if random.unit() < negated { -1.0 } else { 1.0 };
            rotation = (rotation * step).normalize() * sign;
            all.push(rotation.as_quat());
        }
    }
    let set = TrackSet::with_shared_times(&times, &all).expect("unit keys in order");
    let end = times.last().copied().unwrap_or(0.0);
    (set, SampleTimes::fps(91).between(0.0, end))
}
