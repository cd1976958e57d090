//! Sets and crowds made from a seed with additions, multiplications, divisions and square roots only. They have the
//! same bits on every machine, regardless of its sine function, so that results recorded on one machine apply to all.

use glam::{Affine3A, DVec3, Mat3A, Quat, Vec3};

use tumble::crowd::{CrowdError, CrowdLayer, CrowdLibrary, LayerBlend};
#[cfg(feature = "vulkan")]
use tumble::method::SLERP;
use tumble::{Method, Skeleton, Tcb, TrackSet, VectorMethod, WrapMode};

/// `SplitMix64` (Steele, Lea, Flood 2014).
pub(crate) struct SeededRandom(pub(crate) u64);

impl SeededRandom {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number in [0, 1).
    fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub(crate) fn pick<T: Copy>(&mut self, values: &[T]) -> T {
        values[self.below(values.len())]
    }
}

fn normalised(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / length)
}

pub(crate) fn random_rotation(random: &mut SeededRandom) -> [f64; 4] {
    loop {
        let q = [(); 4].map(|()| random.between(-1.0, 1.0));
        if (0.01..1.0).contains(&q.iter().map(|c| c * c).sum::<f64>()) {
            return normalised(q);
        }
    }
}

/// The rotation after a random step, whose half-angle is about `size` if that is small.
fn stepped(random: &mut SeededRandom, q: [f64; 4], size: f64) -> [f64; 4] {
    let step = random_rotation(random);
    normalised([0, 1, 2, 3].map(|c| q[c] + size * step[c]))
}

fn key(q: [f64; 4], sign: f32) -> Quat {
    Quat::from_array(q.map(|c| sign * c as f32))
}

/// Tracks with separate times; each step's size is drawn from `sizes`. With `has_negated_keys`, every fourth key is
/// negated. Most tracks have velocities, tangents and tension.
pub(crate) fn random_set(
    seed: u64,
    tracks: usize,
    keys: usize,
    sizes: &[f64],
    has_negated_keys: bool,
) -> TrackSet {
    let mut random = SeededRandom(seed);
    let mut set = TrackSet::new();
    for track in 0..tracks {
        let count = match track % 8 {
            0 if tracks > 8 => 1,
            1 if tracks > 8 => 2,
            2 if tracks > 8 => 3,
            _ => keys + track % 3,
        };
        let mut time = random.between(-0.5, 0.5);
        let mut rotation = random_rotation(&mut random);
        let (mut times, mut quats) = (Vec::new(), Vec::new());
        for index in 0..count {
            times.push(time);
            let sign = if has_negated_keys && random.next().is_multiple_of(4) {
                -1.0
            } else {
                1.0
            };
            let mut quat = key(rotation, sign);
            if has_negated_keys && index % 7 == 5 {
                // A component that is far too small to affect the others in f32.
                quat = key(normalised([1e-30, 0.6, rotation[2], rotation[3]]), sign);
            }
            quats.push(quat);
            time += if has_negated_keys {
                random.pick(&[0.04, 0.001, 0.3, 1.0, 0.55])
            } else {
                random.between(0.1, 0.9)
            };
            let size = random.pick(sizes);
            rotation = stepped(&mut random, rotation, size);
        }
        set.push("", &times, &quats).expect("unit keys in order");
    }
    give_data(&mut set, seed);
    set
}

fn give_data(set: &mut TrackSet, seed: u64) {
    let mut random = SeededRandom(seed ^ 0xdada);
    for index in (0..set.track_count()).filter(|index| index % 5 != 3) {
        let keys = set.track(index).keys.len();
        let three = |random: &mut SeededRandom| [(); 3].map(|()| random.between(-1.0, 1.0));
        let velocities: Vec<DVec3> = (0..keys)
            .map(|_| DVec3::from_array(three(&mut random)) * 2.0)
            .collect();
        let four = |random: &mut SeededRandom| {
            Quat::from_array([(); 4].map(|()| random.between(-1.0, 1.0) as f32))
        };
        let tangents: Vec<[Quat; 2]> = (0..keys)
            .map(|_| [four(&mut random), four(&mut random)])
            .collect();
        let tcb: Vec<Tcb> = (0..keys)
            .map(|_| {
                let [tension, continuity, bias] = three(&mut random);
                Tcb {
                    tension,
                    continuity,
                    bias,
                }
            })
            .collect();
        set.set_velocities(index, &velocities)
            .expect("one for each key");
        set.set_tangents(index, &tangents)
            .expect("one for each key");
        set.set_tcb(index, &tcb).expect("one for each key");
    }
}

/// Tracks that share times `step` seconds apart; every rotation between keys has the size `size`.
pub(crate) fn shared_set(
    seed: u64,
    tracks: usize,
    keys: usize,
    step: f64,
    size: f64,
    negated_every: u64,
) -> TrackSet {
    let mut random = SeededRandom(seed);
    let times: Vec<f64> = (0..keys).map(|k| k as f64 * step).collect();
    let mut all = Vec::with_capacity(tracks * keys);
    for _ in 0..tracks {
        let mut rotation = random_rotation(&mut random);
        for _ in 0..keys {
            let sign = if negated_every > 0 && random.next().is_multiple_of(negated_every) {
                -1.0
            } else {
                1.0
            };
            all.push(key(rotation, sign));
            rotation = stepped(&mut random, rotation, size);
        }
    }
    TrackSet::with_shared_times(&times, &all).expect("unit keys in order")
}

/// The same set `seconds` later.
pub(crate) fn later(set: &TrackSet, seconds: f64) -> TrackSet {
    let mut moved = TrackSet::new();
    for track in set.tracks() {
        let times: Vec<f64> = track.times.iter().map(|time| time + seconds).collect();
        moved.push("", &times, track.keys).expect("still in order");
    }
    give_data(&mut moved, 99);
    moved
}

/// Tracks whose last key repeats the first.
pub(crate) fn closed_set() -> TrackSet {
    let mut set = TrackSet::new();
    for track in random_set(31, 6, 12, &[0.2, 0.7], true).tracks() {
        let mut keys = track.keys.to_vec();
        keys.push(keys[0]);
        let mut times = track.times.to_vec();
        times.push(times[times.len() - 1] + 0.4);
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}

/// Tracks of rotations, most of which have translations and scales.
pub(crate) fn vectors_set() -> TrackSet {
    let mut set = random_set(12, 5, 9, &[0.3, 0.8], false);
    for track in 0..5 {
        let times: Vec<f64> = (0..7)
            .map(|k| f64::from(k) * (0.5 + 0.1 * track as f64))
            .collect();
        let mut random = SeededRandom(track as u64 + 5);
        let mut vector = || Vec3::from_array([(); 3].map(|()| random.between(-3.0, 3.0) as f32));
        let keys: Vec<Vec3> = times.iter().map(|_| vector()).collect();
        let tangents: Vec<[Vec3; 2]> = times.iter().map(|_| [vector(), vector()]).collect();
        if track != 2 {
            set.set_translations(track, &times, &keys, &tangents)
                .expect("a track");
        }
        if track != 3 {
            set.set_scales(track, &times[..4], &keys[..4], &[])
                .expect("a track");
        }
    }
    set
}

/// Scalars, some of which share their key times, and some of which have tangents.
pub(crate) fn scalars_set() -> TrackSet {
    let mut set = TrackSet::new();
    let mut random = SeededRandom(29);
    for scalar in 0..17 {
        let times: Vec<f64> = (0..2 + scalar / 4)
            .map(|k| f64::from(k) * (0.7 + 0.1 * f64::from(scalar / 5)))
            .collect();
        let mut number = || random.between(-3.0, 3.0) as f32;
        let keys: Vec<f32> = times.iter().map(|_| number()).collect();
        let tangents: Vec<[f32; 2]> = times.iter().map(|_| [number(), number()]).collect();
        let count = if scalar % 6 == 5 { 0 } else { tangents.len() };
        set.push_scalar("", &times, &keys, &tangents[..count])
            .expect("numbers in order");
    }
    set
}

/// Scalars of many sizes, some of which share their key times, and some of which have tangents, one key or equal keys.
pub(crate) fn random_scalars(random: &mut SeededRandom, scalars: usize) -> TrackSet {
    let mut set = TrackSet::new();
    let mut times: Vec<f64> = Vec::new();
    for scalar in 0..scalars {
        if scalar == 0 || random.below(3) == 0 {
            let mut time = random.between(-2.0, 2.0);
            times.clear();
            for _ in 0..1 + random.below(24) {
                times.push(time);
                time += random.pick(&[0.001, 0.02, 0.4, 3.0]) * random.between(0.5, 1.5);
            }
        }
        let size = random.pick(&[0.0, 1e-6, 1.0, 3.0, 1e4]);
        let mut number = || random.between(-size, size) as f32;
        let keys: Vec<f32> = times.iter().map(|_| number()).collect();
        let tangents: Vec<[f32; 2]> = times.iter().map(|_| [number(), number()]).collect();
        let count = if scalar % 2 == 1 { 0 } else { tangents.len() };
        set.push_scalar("", &times, &keys, &tangents[..count])
            .expect("numbers in order");
    }
    set
}

/// Random walks of points, some of which stand still for a time.
pub(crate) fn paths_set() -> TrackSet {
    let mut random = SeededRandom(14);
    let mut set = TrackSet::new();
    for track in 0..9 {
        let (mut position, mut time) = (Vec3::ZERO, 0.0);
        let (mut times, mut points) = (Vec::new(), Vec::new());
        for point in 0..3 + track {
            times.push(time);
            points.push(position);
            time += random.between(0.3, 1.5);
            let step = Vec3::from_array([(); 3].map(|()| random.between(-3.0, 4.0) as f32));
            position += if (track + point) % 7 == 5 {
                Vec3::ZERO
            } else {
                step
            };
        }
        set.push_path("", &times, &points, &[])
            .expect("points in order");
    }
    set
}

/// A point whose coordinates are at most `reach` in magnitude.
fn point(random: &mut SeededRandom, reach: f64) -> Vec3 {
    Vec3::from_array([(); 3].map(|()| random.between(-reach, reach) as f32))
}

/// A skeleton in which the parent of each joint is a random one before it; some joints are roots.
fn skeleton(random: &mut SeededRandom, joints: usize) -> Skeleton {
    let parent = |joint: usize, random: &mut SeededRandom| match random.below(8) {
        0 => None,
        _ => (joint > 0).then(|| random.below(joint)),
    };
    let parents = (0..joints).map(|joint| parent(joint, random)).collect();
    let offsets = (0..joints).map(|_| point(random, 1.0)).collect();
    Skeleton::new(parents, offsets).expect("parents come before their children")
}

/// Keys as in games: many joints have the same times, some fewer keys, some a single value; a few have translations
/// and scales.
fn joints_set(random: &mut SeededRandom, joints: usize, keys: usize) -> TrackSet {
    let mut shared = Vec::new();
    let mut time = random.between(-1.0, 2.0);
    for _ in 0..keys {
        shared.push(time);
        time += random.pick(&[0.1, 0.1, 0.1, 0.0625, 0.7]);
    }
    let mut set = TrackSet::new();
    for joint in 0..joints {
        let times: Vec<f64> = match random.below(5) {
            0 => shared.iter().step_by(3).copied().collect(),
            1 => shared.iter().map(|time| time + 0.033).collect(),
            2 => vec![shared[0]],
            _ => shared.clone(),
        };
        let mut rotation = random_rotation(random);
        let mut rotations = Vec::new();
        for _ in &times {
            rotations.push(key(rotation, 1.0));
            let size = random.between(0.0, 0.5);
            rotation = stepped(random, rotation, size);
        }
        (set.push("", &times, &rotations)).expect("unit keys in order");
        if joint.is_multiple_of(3) {
            let keys: Vec<Vec3> = shared.iter().map(|_| point(random, 2.0)).collect();
            (set.set_translations(joint, &shared, &keys, &[])).expect("a track");
        }
        if joint % 4 == 1 {
            let keys = shared.iter().map(|_| Vec3::ONE + point(random, 0.5));
            let keys: Vec<Vec3> = keys.collect();
            (set.set_scales(joint, &shared, &keys, &[])).expect("a track");
        }
    }
    set
}

/// A library of a clip for each method, with masks, a reference pose and inverse bind matrices.
pub(crate) fn crowd_library(
    random: &mut SeededRandom,
    joints: usize,
    methods: &[Method],
) -> Result<CrowdLibrary, CrowdError> {
    let mut library = CrowdLibrary::new(&skeleton(random, joints))?;
    for (index, &method) in methods.iter().enumerate() {
        // If a curve rotates too fast for a crowd, its clip is refused, and nothing of it stays in the library.
        while library.clip_count() == index {
            let set = joints_set(random, joints, 2 + 3 * index);
            match library.push(&set, method, VectorMethod::CatmullRom) {
                Ok(_) | Err(CrowdError::TooWild { .. }) => {}
                Err(error) => return Err(error),
            }
        }
    }
    for mask in 0..2 {
        let weight = |joint| match (joint + mask) % 3 {
            0 => 0.0,
            1 => 1.0,
            _ => random.unit() as f32,
        };
        let weights: Vec<f32> = (0..joints).map(weight).collect();
        library.push_mask(&weights)?;
    }
    library.set_reference(0, methods.len() - 1, 5000)?;
    let bind = |_| {
        let columns = [(); 3].map(|()| point(random, 1.0).into());
        let [x, y, z] = columns;
        Affine3A {
            matrix3: Mat3A::from_cols(x, y, z),
            translation: point(random, 2.0).into(),
        }
    };
    let bind: Vec<Affine3A> = (0..joints).map(bind).collect();
    library.set_inverse_bind(&bind)?;
    Ok(library)
}

/// A library as games have them: eight clips of two seconds, with a key every thirtieth of a second.
#[cfg(feature = "vulkan")]
pub(crate) fn typical_library(
    random: &mut SeededRandom,
    joints: usize,
) -> Result<CrowdLibrary, CrowdError> {
    let mut library = CrowdLibrary::new(&skeleton(random, joints))?;
    for _ in 0..8 {
        let set = shared_set(random.next(), joints, 61, 1.0 / 30.0, 0.05, 0);
        library.push(&set, SLERP, VectorMethod::CatmullRom)?;
    }
    Ok(library)
}

/// A layer that plays a clip of [`typical_library`], from anywhere in it.
#[cfg(feature = "vulkan")]
pub(crate) fn typical_layer(random: &mut SeededRandom, library: &CrowdLibrary) -> CrowdLayer {
    CrowdLayer::new(random.below(library.clip_count()))
        .at(random.between(0.0, 1e6) as i64)
        .with_speed(random.pick(&[0.9, 1.0, 1.0, 1.1]))
}

/// A random layer of an instance.
pub(crate) fn crowd_layer(random: &mut SeededRandom, library: &CrowdLibrary) -> CrowdLayer {
    // The order of these calls must not change: the recorded crowds draw their numbers in this order.
    CrowdLayer::new(random.below(library.clip_count()))
        .at(random.between(-3e6, 3e6) as i64)
        .with_speed(random.pick(&[0.0, 1.0, 1.0, -1.0, 0.37, -2.25, 100.0]))
        .with_wrap(random.pick(&[WrapMode::Hold, WrapMode::Loop, WrapMode::Mirror]))
        .with_weight(random.pick(&[0.0, 1.0, 0.25, 0.7]))
        .with_blend(match random.next().is_multiple_of(2) {
            true => LayerBlend::Additive,
            false => LayerBlend::Over,
        })
        .with_mask(random.pick(&[None, Some(0), Some(1)]))
}
