//! Golden hashes: SHA-256 of the bytes of some hundred results, recorded once in
//! `tests/golden.txt` and the same ever after, on the CPU at every vector width and on
//! every Vulkan device, whichever way its kernels read.
//!
//! Catches any change of a bit that all devices make alike, which tests that compare
//! devices with each other cannot see. `UPDATE_GOLDEN=1 cargo test golden` records them
//! anew, `UPDATE_GOLDEN=new` only those of cases that are not there yet; a change of a hash
//! is a change of the engine's promise and belongs into the changelog.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path as FilePath;

use crate::support::{Random, in_turn, vulkan_engines};
use glam::{DVec3, Quat, Vec3};
use sha2::{Digest, Sha256};
use tumble::{
    Axes, Device, Direction, Encoding, Ends, Engine, EngineOptions, Follow, Frame, Frames,
    Interpolation, Layout, METHODS, Method, Path, PathSpeed, Quantity, Skeleton, Smoothing, Speed,
    Tcb, TrackSet, VectorMethod, VectorWidth, WrapMode, method,
};

// ---------------------------------------------------------------- the sets

/// Unit quaternions made of additions, multiplications, divisions and square roots alone:
/// the same bits on every machine, whatever its sine is.
fn normalised(q: [f64; 4]) -> [f64; 4] {
    let length = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / length)
}

fn random_rotation(random: &mut Random) -> [f64; 4] {
    loop {
        let q = [(); 4].map(|()| random.between(-1.0, 1.0));
        if (0.01..1.0).contains(&q.iter().map(|c| c * c).sum::<f64>()) {
            return normalised(q);
        }
    }
}

/// The rotation moved a little: the step's half-angle is about `size` where that is small.
fn stepped(random: &mut Random, q: [f64; 4], size: f64) -> [f64; 4] {
    let step = random_rotation(random);
    normalised([0, 1, 2, 3].map(|c| q[c] + size * step[c]))
}

fn key(q: [f64; 4], sign: f32) -> Quat {
    Quat::from_array(q.map(|c| sign * c as f32))
}

/// Tracks with times of their own, each step's size drawn from `sizes`, every fourth sign
/// turned where `turned`, and with velocities, tangents and tension for most tracks.
fn random_set(seed: u64, tracks: usize, keys: usize, sizes: &[f64], turned: bool) -> TrackSet {
    let mut random = Random(seed);
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
        for place in 0..count {
            times.push(time);
            let sign = if turned && random.next().is_multiple_of(4) {
                -1.0
            } else {
                1.0
            };
            let mut own = key(rotation, sign);
            if turned && place % 7 == 5 {
                // A component far below what f32 resolves beside the others.
                own = key(normalised([1e-30, 0.6, rotation[2], rotation[3]]), sign);
            }
            quats.push(own);
            time += if turned {
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
    let mut random = Random(seed ^ 0xdada);
    for index in (0..set.track_count()).filter(|index| index % 5 != 3) {
        let keys = set.track(index).keys.len();
        let three = |random: &mut Random| [(); 3].map(|()| random.between(-1.0, 1.0));
        let velocities: Vec<DVec3> = (0..keys)
            .map(|_| DVec3::from_array(three(&mut random)) * 2.0)
            .collect();
        let four = |random: &mut Random| {
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

/// Tracks that share times `step` apart; each key's step has that size.
fn shared_set(
    seed: u64,
    tracks: usize,
    keys: usize,
    step: f64,
    size: f64,
    turned: u64,
) -> TrackSet {
    let mut random = Random(seed);
    let times: Vec<f64> = (0..keys).map(|k| k as f64 * step).collect();
    let mut all = Vec::with_capacity(tracks * keys);
    for _ in 0..tracks {
        let mut rotation = random_rotation(&mut random);
        for _ in 0..keys {
            let sign = if turned > 0 && random.next().is_multiple_of(turned) {
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
fn later(set: &TrackSet, seconds: f64) -> TrackSet {
    let mut moved = TrackSet::new();
    for track in set.tracks() {
        let times: Vec<f64> = track.times.iter().map(|time| time + seconds).collect();
        moved.push("", &times, track.keys).expect("still in order");
    }
    give_data(&mut moved, 99);
    moved
}

/// Tracks whose last key repeats the first.
fn closed_set() -> TrackSet {
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

// ---------------------------------------------------------------- the cases

enum What {
    /// From keys, in one go.
    Set(Interpolation, Frames, Layout),
    /// From a clip that stays on the device, encoded.
    Encoded(Interpolation, Frames, Layout, Encoding),
    /// In chunks.
    Stream(Interpolation, Frames, Layout),
    /// Translations, rotations and scales.
    Transforms(Interpolation, VectorMethod, Frames),
    /// Layers blended, mixed and added, and walked down a skeleton.
    Poses,
    /// Bodies on paths.
    Follow(Box<Follow>),
    /// Rotations and translations, smoothed.
    Smooth(Smoothing),
}

struct Case {
    name: String,
    set: &'static str,
    what: What,
}

struct Cases {
    sets: BTreeMap<&'static str, TrackSet>,
    cases: Vec<Case>,
}

/// Walks of points, some of which stand still for a while.
fn paths() -> TrackSet {
    let mut random = Random(14);
    let mut set = TrackSet::new();
    for track in 0..9 {
        let (mut place, mut time) = (Vec3::ZERO, 0.0);
        let (mut times, mut points) = (Vec::new(), Vec::new());
        for point in 0..3 + track {
            times.push(time);
            points.push(place);
            time += random.between(0.3, 1.5);
            let step = Vec3::from_array([(); 3].map(|()| random.between(-3.0, 4.0) as f32));
            place += if (track + point) % 7 == 5 {
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

fn shortest(method: Method) -> Interpolation {
    Interpolation::from(method)
}

impl Cases {
    fn add(&mut self, set: &'static str, name: &str, what: What) {
        assert!(self.sets.contains_key(set), "{set}");
        let name = format!("{set} {name}");
        assert!(self.cases.iter().all(|case| case.name != name), "{name}");
        self.cases.push(Case { name, set, what });
    }

    fn rows(
        &mut self,
        set: &'static str,
        name: &str,
        interpolation: Interpolation,
        frames: &Frames,
    ) {
        self.add(
            set,
            name,
            What::Set(interpolation, frames.clone(), Layout::TrackMajor),
        );
    }

    fn all() -> Self {
        let mut with_vectors = random_set(12, 5, 9, &[0.3, 0.8], false);
        for track in 0..5 {
            let times: Vec<f64> = (0..7)
                .map(|k| f64::from(k) * (0.5 + 0.1 * track as f64))
                .collect();
            let mut random = Random(track as u64 + 5);
            let mut vector =
                || Vec3::from_array([(); 3].map(|()| random.between(-3.0, 3.0) as f32));
            let keys: Vec<Vec3> = times.iter().map(|_| vector()).collect();
            let tangents: Vec<[Vec3; 2]> = times.iter().map(|_| [vector(), vector()]).collect();
            if track != 2 {
                with_vectors
                    .set_translations(track, &times, &keys, &tangents)
                    .expect("a track");
            }
            if track != 3 {
                with_vectors
                    .set_scales(track, &times[..4], &keys[..4], &[])
                    .expect("a track");
            }
        }
        let uneven = random_set(2, 7, 26, &[0.05, 0.3, 0.9], false);
        let sets = BTreeMap::from([
            ("even", shared_set(1, 5, 26, 0.4, 0.6, 0)),
            (
                "hostile",
                random_set(3, 48, 20, &[0.0, 1e-7, 1e-4, 0.02, 0.4, 2.0, 9.0], true),
            ),
            ("dense", shared_set(4, 6, 2500, 0.01, 0.02, 0)),
            ("dense turned", shared_set(5, 6, 2500, 0.01, 0.03, 3)),
            ("dense wild", shared_set(6, 5, 1500, 0.01, 0.4, 5)),
            ("crowd", shared_set(7, 700, 2, 1.0, 0.5, 4)),
            ("long", shared_set(8, 1, 40_000, 0.02, 0.25, 3)),
            ("day", later(&uneven, 86_400.0)),
            ("closed", closed_set()),
            ("vectors", with_vectors),
            ("paths", paths()),
            ("uneven", uneven),
        ]);
        let mut cases = Self {
            sets,
            cases: Vec::new(),
        };
        cases.methods();
        cases.outputs();
        cases.options();
        cases.routes();
        cases.add("uneven", "poses", What::Poses);
        cases.paths();
        cases.smoothing();
        cases
    }

    /// Every kind of path, direction, frame and speed.
    fn paths(&mut self) {
        let eased = PathSpeed::Eased {
            start: 0.2,
            end: 0.3,
        };
        for method in VectorMethod::ALL {
            let follow = Follow {
                method,
                ..Follow::default()
            };
            self.add(
                "paths",
                &format!("{method}"),
                What::Follow(Box::new(follow)),
            );
        }
        let c2 = || Follow {
            method: VectorMethod::C2,
            ..Follow::default()
        };
        let point = Direction::Point(DVec3::new(9.0, 8.0, -7.0));
        let others = [
            (
                "constant",
                Follow {
                    speed: PathSpeed::Constant,
                    ..c2()
                },
            ),
            (
                "eased ahead",
                Follow {
                    speed: eased,
                    direction: Direction::Ahead(0.7),
                    ..c2()
                },
            ),
            (
                "fixed at",
                Follow {
                    frame: Frame::Fixed,
                    direction: point,
                    ..c2()
                },
            ),
            (
                "frenet",
                Follow {
                    frame: Frame::Frenet,
                    ..c2()
                },
            ),
        ];
        for (name, follow) in others {
            self.add("paths", name, What::Follow(Box::new(follow)));
        }
    }

    /// Every kernel.
    fn smoothing(&mut self) {
        for name in [
            "linear",
            "cubic",
            "box:2.25",
            "tent:3",
            "gaussian:2",
            "savitzky-golay:4:3",
        ] {
            let kernel = name.parse().expect("a kernel");
            let smoothing = Smoothing {
                passes: 2,
                ..Smoothing::new(kernel)
            };
            self.add(
                "vectors",
                &format!("{name} smoothed"),
                What::Smooth(smoothing),
            );
        }
    }

    /// Every method, on every kind of keys, and its derivatives.
    fn methods(&mut self) {
        let frames = Frames::fps(60).between(-1.0, 9.0);
        for method in METHODS {
            for set in ["even", "uneven", "hostile"] {
                self.rows(set, method.name, shortest(method), &frames);
            }
            let film =
                Frames::rate("24000/1001".parse().expect("a rate")).between(86_399.0, 86_409.0);
            self.rows("day", method.name, shortest(method), &film);
            for (name, quantity) in [
                ("velocity body", Quantity::Velocity(Axes::Body)),
                ("acceleration world", Quantity::Acceleration(Axes::Parent)),
            ] {
                let interpolation = Interpolation {
                    quantity,
                    ..shortest(method)
                };
                self.rows(
                    "uneven",
                    &format!("{method} {name}"),
                    interpolation,
                    &frames,
                );
            }
        }
    }

    /// Every encoding in both layouts, and results in chunks.
    fn outputs(&mut self) {
        let frames = Frames::fps(30);
        for encoding in Encoding::KINDS {
            for (name, layout) in [("rows", Layout::TrackMajor), ("frames", Layout::FrameMajor)] {
                for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
                    let what = What::Encoded(shortest(method), frames.clone(), layout, encoding);
                    self.add("hostile", &format!("{method} {encoding:?} {name}"), what);
                }
            }
        }
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            for method in [method::STEP, method::SLERP, method::C2] {
                let what = What::Set(shortest(method), frames.clone(), layout);
                self.add("hostile", &format!("{method} {layout:?}"), what);
                let what = What::Stream(shortest(method), frames.clone(), layout);
                self.add("uneven", &format!("{method} {layout:?} stream"), what);
            }
        }
        for vectors in VectorMethod::ALL {
            let what = What::Transforms(shortest(method::SLERP), vectors, frames.clone());
            self.add("vectors", &format!("{vectors} transforms"), what);
        }
    }

    /// Ends, paths, speeds, and what lies outside the keys.
    fn options(&mut self) {
        let frames = Frames::fps(50).between(-7.0, 21.0);
        let times = Frames::at(
            (0..500)
                .map(|k| f64::from(k * 317 % 500) * 0.06 - 8.0)
                .collect(),
        );
        let clamped = Ends::Clamped {
            start: DVec3::new(1.0, -2.0, 0.5),
            end: DVec3::new(0.0, 0.25, -1.0),
        };
        for (name, ends) in [
            ("natural", Ends::Natural),
            ("clamped", clamped),
            ("secant", Ends::Secant),
            ("frozen", Ends::Frozen),
        ] {
            for method in [
                method::BESSEL_OVERHAUSER,
                method::B_SPLINE,
                method::C2,
                method::SQUAD,
            ] {
                let interpolation = Interpolation {
                    ends,
                    ..shortest(method)
                };
                self.rows(
                    "hostile",
                    &format!("{method} {name}"),
                    interpolation,
                    &frames,
                );
            }
        }
        for method in [
            method::SLERP,
            method::CATMULL_ROM,
            method::B_SPLINE,
            method::C2,
            method::SHOEMAKE_1985,
        ] {
            let interpolation = Interpolation {
                ends: Ends::Loop,
                ..shortest(method)
            };
            self.rows(
                "closed",
                &format!("{method} loop ends"),
                interpolation,
                &frames,
            );
        }
        for method in [
            method::NLERP,
            method::SLERP,
            method::BESSEL_OVERHAUSER,
            method::C2,
        ] {
            let interpolation = Interpolation {
                path: Path::AsAuthored,
                ..shortest(method)
            };
            self.rows(
                "uneven",
                &format!("{method} as authored"),
                interpolation,
                &frames,
            );
            let few = Frames::fps(19).between(1.0, 9.0);
            self.rows(
                "dense turned",
                &format!("{method} as authored"),
                interpolation,
                &few,
            );
        }
        for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::SQUAD] {
            let interpolation = Interpolation {
                speed: Speed::Constant,
                ..shortest(method)
            };
            self.rows(
                "uneven",
                &format!("{method} constant speed"),
                interpolation,
                &frames,
            );
        }
        let sides = [
            WrapMode::Hold,
            WrapMode::Loop,
            WrapMode::Mirror,
            WrapMode::Extrapolate,
        ];
        for method in [
            method::STEP,
            method::SLERP,
            method::BESSEL_OVERHAUSER,
            method::B_SPLINE,
        ] {
            for (i, &before) in sides.iter().enumerate() {
                let after = sides[(i + 1) % 4];
                let interpolation = Interpolation {
                    before,
                    after,
                    ..shortest(method)
                };
                let name = format!("{method} {before:?} {after:?}");
                self.rows("uneven", &name, interpolation, &frames);
                self.rows("uneven", &format!("{name} times"), interpolation, &times);
            }
        }
        let looped = Interpolation {
            after: WrapMode::Loop,
            ..shortest(method::SLERP)
        };
        let tomorrow = Frames::fps(60).between(86_400.0, 86_403.0);
        self.rows("uneven", "slerp Loop tomorrow", looped, &tomorrow);
        let velocity = Interpolation {
            quantity: Quantity::Velocity(Axes::Parent),
            ..looped
        };
        self.rows("closed", "slerp velocity Loop", velocity, &frames);
    }

    /// Every route from keys to results: by segments, straight from keys, by single samples,
    /// a long track piece by piece.
    fn routes(&mut self) {
        let methods = [
            method::STEP,
            method::SLERP,
            method::CATMULL_ROM,
            method::BESSEL_OVERHAUSER,
            method::SQUAD,
            method::B_SPLINE,
            method::C2,
        ];
        let mut random = Random(77);
        let mut draw = |count: usize, end: f64| -> Vec<f64> {
            (0..count).map(|_| random.between(-0.5, end)).collect()
        };
        let shared = Frames::at(draw(300, 30.0));
        let few = Frames::at(draw(2, 1.2));
        let each = Frames::at_each(draw(700, 1.2));
        let each_dense = Frames::at_each(draw(12, 25.0));
        for method in methods {
            let own = shortest(method);
            for set in ["dense", "dense turned", "dense wild"] {
                self.rows(set, &format!("{method} 30 fps"), own, &Frames::fps(30));
                self.rows(
                    set,
                    &format!("{method} 211 fps"),
                    own,
                    &Frames::fps(211).between(1.0, 4.0),
                );
                self.rows(set, &format!("{method} times"), own, &shared);
            }
            self.rows(
                "dense",
                &format!("{method} times of each"),
                own,
                &each_dense,
            );
            self.rows("crowd", &format!("{method} 60 fps"), own, &Frames::fps(60));
            self.rows(
                "crowd",
                &format!("{method} one frame"),
                own,
                &Frames::fps(1).between(0.3, 0.3),
            );
            self.rows("crowd", &format!("{method} few times"), own, &few);
            self.rows("crowd", &format!("{method} a time of each"), own, &each);
            let what = What::Set(own, few.clone(), Layout::FrameMajor);
            self.add("crowd", &format!("{method} few times, frames"), what);
            self.rows("long", &format!("{method} 7 fps"), own, &Frames::fps(7));
            self.rows("long", &format!("{method} 120 fps"), own, &Frames::fps(120));
        }
    }
}

// ---------------------------------------------------------------- evaluation

fn hash_of<T: bytemuck::Pod>(parts: &[&[T]]) -> String {
    let mut hash = Sha256::new();
    for part in parts {
        hash.update(bytemuck::cast_slice::<T, u8>(part));
    }
    let mut digits = String::new();
    for byte in &hash.finalize()[..8] {
        write!(digits, "{byte:02x}").expect("memory takes everything");
    }
    digits
}

fn evaluated(engine: &Engine, set: &TrackSet, what: &What) -> String {
    match what {
        What::Set(interpolation, frames, layout) => {
            if interpolation.quantity == Quantity::Rotation {
                let found = engine
                    .evaluate_as(set, *interpolation, frames, *layout)
                    .unwrap();
                hash_of(&[found.as_quats()])
            } else {
                let found = engine.rates(set, *interpolation, frames, *layout).unwrap();
                hash_of(&[found.as_slice()])
            }
        }
        What::Encoded(interpolation, frames, layout, encoding) => {
            let clip = engine.upload(set, *interpolation).unwrap();
            let found = clip.evaluate_encoded(frames, *layout, *encoding).unwrap();
            hash_of(&[&found])
        }
        What::Stream(interpolation, frames, layout) => {
            let clip = engine.upload(set, *interpolation).unwrap();
            let mut all = Vec::new();
            let take = |chunk: tumble::Chunk<'_>| -> Result<(), tumble::Error> {
                all.extend_from_slice(bytemuck::cast_slice::<Quat, u32>(
                    chunk.rotations().unwrap(),
                ));
                Ok(())
            };
            clip.stream(frames, *layout, 777, take).unwrap();
            hash_of(&[&all])
        }
        What::Transforms(interpolation, vectors, frames) => {
            let layout = Layout::TrackMajor;
            let found = engine
                .transforms(set, *interpolation, *vectors, frames, layout)
                .unwrap();
            let translations: &[f32] = bytemuck::cast_slice(found.translations.as_slice());
            let rotations: &[f32] = bytemuck::cast_slice(found.rotations.as_quats());
            let scales: &[f32] = bytemuck::cast_slice(found.scales.as_slice());
            hash_of(&[translations, rotations, scales])
        }
        What::Follow(follow) => {
            let frames = Frames::fps(30);
            let found = engine
                .follow(set, follow, &frames, Layout::TrackMajor)
                .unwrap();
            hash_of(&[
                bytemuck::cast_slice::<_, f32>(found.positions.as_slice()),
                bytemuck::cast_slice(found.rotations.as_quats()),
            ])
        }
        What::Smooth(smoothing) => {
            let (frames, layout) = (Frames::fps(30), Layout::TrackMajor);
            let linear = VectorMethod::Linear;
            let found = engine
                .transforms(set, method::SLERP, linear, &frames, layout)
                .unwrap();
            let turned = engine.smooth(&found.rotations, smoothing).unwrap();
            let moved = engine
                .smooth_vectors(&found.translations, smoothing)
                .unwrap();
            hash_of(&[
                bytemuck::cast_slice::<_, f32>(turned.as_quats()),
                bytemuck::cast_slice(moved.as_slice()),
            ])
        }
        What::Poses => {
            let frames = Frames::fps(30);
            let one = engine.evaluate(set, method::SLERP, &frames).unwrap();
            let two = engine.evaluate(set, method::C2, &frames).unwrap();
            let three = engine.evaluate(set, method::B_SPLINE, &frames).unwrap();
            let blended = engine
                .blend(&[(&one, 0.5), (&two, 0.3), (&three, 0.2)])
                .unwrap();
            let mixed = engine.mix(&one, &three, 0.3).unwrap();
            let reference: Vec<Quat> = set.tracks().map(|track| track.keys[0]).collect();
            let added = engine.add(&blended, &mixed, &reference, 0.7).unwrap();
            let world = engine
                .world(&added, &Skeleton::chain(set.track_count(), 3.0).unwrap())
                .unwrap();
            hash_of(&[
                bytemuck::cast_slice(blended.as_quats()),
                bytemuck::cast_slice(mixed.as_quats()),
                bytemuck::cast_slice(added.as_quats()),
                world.as_slice(),
            ])
        }
    }
}

/// The CPU at every vector width.
fn every_width() -> Vec<Engine> {
    let at = |width| {
        let mut options = EngineOptions::default();
        options.vector_width = Some(width);
        Engine::with_options(Device::Cpu, &options).unwrap()
    };
    VectorWidth::available().into_iter().map(at).collect()
}

#[test]
fn results_have_the_recorded_hashes() {
    let Cases { sets, cases } = Cases::all();
    let path = FilePath::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden.txt");
    if let Some(update) = std::env::var_os("UPDATE_GOLDEN") {
        let engine = Engine::new(Device::Cpu).unwrap();
        let before = match update == "new" {
            true => std::fs::read_to_string(&path).unwrap(),
            false => String::new(),
        };
        let mut recorded = String::new();
        for case in &cases {
            let mut lines = before.lines().filter_map(|line| line.split_once(' '));
            let known = lines.find(|(_, name)| *name == case.name);
            let evaluate = || evaluated(&engine, &sets[case.set], &case.what);
            let hash = known.map_or_else(evaluate, |(hash, _)| hash.to_owned());
            writeln!(recorded, "{hash} {}", case.name).expect("memory takes everything");
        }
        std::fs::write(&path, recorded).unwrap();
    }
    let recorded = std::fs::read_to_string(&path).unwrap();
    let recorded: BTreeMap<&str, &str> = (recorded.lines())
        .filter_map(|line| line.split_once(' '))
        .map(|(hash, name)| (name, hash))
        .collect();
    assert_eq!(
        recorded.len(),
        cases.len(),
        "tests/golden.txt has other cases"
    );
    let mut wrong = Vec::new();
    let (widths, vulkan) = (every_width(), vulkan_engines(|_| {}));
    let mut compared = 0;
    for (round, case) in cases.iter().enumerate() {
        // A method has six cases: of the next one each is read in the next way.
        for engine in widths.iter().chain(in_turn(&vulkan, round + round / 6)) {
            let found = evaluated(engine, &sets[case.set], &case.what);
            compared += 1;
            if recorded.get(case.name.as_str()) != Some(&found.as_str()) {
                wrong.push(format!("{}: {found} on {engine:?}", case.name));
            }
        }
    }
    assert!(
        wrong.is_empty(),
        "{} of {compared}:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    println!(
        "{} results have their recorded hashes, {compared} times",
        cases.len()
    );
}
