//! Golden hashes: hashes of the bytes of some hundred results, recorded in `golden.txt`. They must never change, on
//! the CPU at every vector width and on every Vulkan device, regardless of how its kernels read and its results are
//! copied. A hash is the first 64 bits of the SHA-256.
//!
//! They detect changes that all devices make in the same way, which a comparison of devices cannot show. The inputs
//! are computed with arithmetic that every machine rounds in the same way. A changed hash breaks the engine's
//! guarantee.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::OnceLock;

use glam::{DVec3, Quat};
use sha2::{Digest, Sha256};

use tumble::crowd::{CrowdError, CrowdOutput, CrowdValues};
use tumble::paths::{Direction, Follow, PathFrame, PathSpeed};
use tumble::{
    Axes, Chunk, Encoding, Ends, Engine, Error, Interpolation, KeySigns, Layout, METHODS, Method,
    Quantity, SampleTimes, ScalarQuantity, Skeleton, Smoothing, Speed, TrackSet, VectorMethod,
    WrapMode, method,
};

use crate::sets::{
    SeededRandom, closed_set, crowd_layer, crowd_library, later, paths_set, random_set,
    scalars_set, shared_set, vectors_set,
};

/// The recorded hashes: a line of a hash and a name for each case.
const RECORDED: &str = include_str!("golden.txt");

/// Why a case could not be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GoldenError {
    /// The error of a set of tracks.
    #[error(transparent)]
    Evaluate(#[from] Error),
    /// The error of a crowd.
    #[error(transparent)]
    Crowd(#[from] CrowdError),
}

/// The result of a case on an engine.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct GoldenResult {
    /// The first 64 bits of the SHA-256 of all bytes, in hexadecimal digits.
    pub hash: String,
    /// The number of bytes.
    pub bytes: u64,
}

/// The cases: each is a set and an evaluation of it.
pub struct Golden {
    sets: BTreeMap<&'static str, TrackSet>,
    cases: Vec<Case>,
}

struct Case {
    name: String,
    set: &'static str,
    evaluation: Evaluation,
}

enum Evaluation {
    /// From keys, in one call.
    Set(Interpolation, SampleTimes, Layout),
    /// From a clip on the device, in an encoding.
    Encoded(Interpolation, SampleTimes, Layout, Encoding),
    /// In chunks.
    Stream(Interpolation, SampleTimes, Layout),
    /// Translations, rotations and scales.
    Transforms(Interpolation, VectorMethod, SampleTimes),
    /// Layers that are blended, mixed and added, and a skeleton.
    Poses,
    /// Scalars, or their velocities or accelerations.
    Scalars(ScalarQuantity, VectorMethod, Interpolation, SampleTimes),
    /// Bodies on paths.
    Follow(Box<Follow>),
    /// Rotations and translations, smoothed.
    Smooth(Smoothing),
    /// Instances of a library's clips, at several times of the clock.
    Crowd(CrowdMix, CrowdOutput),
}

/// The clips of a crowd's instances.
#[derive(Clone, Copy)]
struct CrowdMix {
    name: &'static str,
    methods: &'static [Method],
    joints: usize,
    instances: usize,
    layers: usize,
}

const ARCS: CrowdMix = CrowdMix {
    name: "arcs",
    methods: &[method::SLERP, method::SLERP],
    joints: 21,
    instances: 67,
    layers: 2,
};

const SEVERAL: CrowdMix = CrowdMix {
    name: "several",
    methods: &[
        method::BESSEL_OVERHAUSER,
        method::STEP,
        method::CATMULL_ROM,
        method::SLERP,
    ],
    joints: 33,
    instances: 41,
    layers: 3,
};

/// Steps of the clock in ticks between the evaluations of a crowd. The last step is more than a day.
const CLOCK: [u64; 4] = [0, 11_760, 1 << 33, 61_000_000_000];

impl Default for Golden {
    fn default() -> Self {
        Self::new()
    }
}

/// The shortest path, unless the method prescribes the signs of keys, also of those without tangents.
fn shortest(method: Method) -> Interpolation {
    Interpolation::from(method).with_signs(method.signs.unwrap_or_default())
}

impl Golden {
    /// Makes the sets and names the cases. The sets take about ten megabytes.
    #[must_use]
    pub fn new() -> Self {
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
            ("vectors", vectors_set()),
            ("scalars", scalars_set()),
            ("paths", paths_set()),
            ("uneven", uneven),
        ]);
        let mut golden = Self {
            sets,
            cases: Vec::new(),
        };
        golden.methods();
        golden.outputs();
        golden.options();
        golden.routes();
        golden.add("uneven", "poses", Evaluation::Poses);
        golden.paths();
        golden.smoothing();
        golden.crowds();
        golden
    }

    fn add(&mut self, set: &'static str, name: &str, evaluation: Evaluation) {
        assert!(self.sets.contains_key(set), "{set}");
        let name = format!("{set} {name}");
        assert!(self.cases.iter().all(|case| case.name != name), "{name}");
        self.cases.push(Case {
            name,
            set,
            evaluation,
        });
    }

    fn rows(
        &mut self,
        set: &'static str,
        name: &str,
        interpolation: Interpolation,
        frames: &SampleTimes,
    ) {
        self.add(
            set,
            name,
            Evaluation::Set(interpolation, frames.clone(), Layout::TrackMajor),
        );
    }

    /// Cases for every kind of path, direction, frame and speed.
    fn paths(&mut self) {
        let eased = PathSpeed::Eased {
            start: 0.2,
            end: 0.3,
        };
        for method in VectorMethod::ALL {
            let follow = Follow::default().with_method(method);
            self.add(
                "paths",
                &format!("{method}"),
                Evaluation::Follow(Box::new(follow)),
            );
        }
        let c2 = || Follow::default().with_method(VectorMethod::C2);
        let point = Direction::Point(DVec3::new(9.0, 8.0, -7.0));
        let others = [
            ("constant", c2().with_speed(PathSpeed::Constant)),
            (
                "eased ahead",
                c2().with_speed(eased).with_direction(Direction::Ahead(0.7)),
            ),
            (
                "fixed at",
                c2().with_frame(PathFrame::Fixed).with_direction(point),
            ),
            ("frenet", c2().with_frame(PathFrame::Frenet)),
        ];
        for (name, follow) in others {
            self.add("paths", name, Evaluation::Follow(Box::new(follow)));
        }
    }

    /// Cases for every smoothing kernel.
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
            let smoothing = Smoothing::new(kernel).with_passes(2);
            self.add(
                "vectors",
                &format!("{name} smoothed"),
                Evaluation::Smooth(smoothing),
            );
        }
    }

    /// Cases for every method with every kind of keys, and for its derivatives.
    fn methods(&mut self) {
        let frames = SampleTimes::fps(60).between(-1.0, 9.0);
        for method in METHODS {
            for set in ["even", "uneven", "hostile"] {
                self.rows(set, method.name, shortest(method), &frames);
            }
            let film = SampleTimes::rate("24000/1001".parse().expect("a rate"))
                .between(86_399.0, 86_409.0);
            self.rows("day", method.name, shortest(method), &film);
            for (name, quantity) in [
                ("velocity body", Quantity::Velocity(Axes::Body)),
                ("acceleration world", Quantity::Acceleration(Axes::Parent)),
            ] {
                let interpolation = shortest(method).with_quantity(quantity);
                self.rows(
                    "uneven",
                    &format!("{method} {name}"),
                    interpolation,
                    &frames,
                );
            }
        }
    }

    /// Cases for every encoding in both layouts, and for results in chunks.
    fn outputs(&mut self) {
        let frames = SampleTimes::fps(30);
        for encoding in Encoding::ALL {
            for (name, layout) in [("rows", Layout::TrackMajor), ("frames", Layout::FrameMajor)] {
                for method in [method::SLERP, method::BESSEL_OVERHAUSER] {
                    let evaluation =
                        Evaluation::Encoded(shortest(method), frames.clone(), layout, encoding);
                    self.add(
                        "hostile",
                        &format!("{method} {encoding:?} {name}"),
                        evaluation,
                    );
                }
            }
        }
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            for method in [method::STEP, method::SLERP, method::C2] {
                let evaluation = Evaluation::Set(shortest(method), frames.clone(), layout);
                self.add("hostile", &format!("{method} {layout:?}"), evaluation);
                let evaluation = Evaluation::Stream(shortest(method), frames.clone(), layout);
                self.add("uneven", &format!("{method} {layout:?} stream"), evaluation);
            }
        }
        for vectors in VectorMethod::ALL {
            let evaluation =
                Evaluation::Transforms(shortest(method::SLERP), vectors, frames.clone());
            self.add("vectors", &format!("{vectors} transforms"), evaluation);
        }
        self.scalars();
    }

    /// Cases for every method and quantity of scalars, with changing wrap modes.
    fn scalars(&mut self) {
        let frames = SampleTimes::fps(30).between(-9.0, 19.0);
        let modes = WrapMode::ALL;
        for (i, how) in VectorMethod::ALL.into_iter().enumerate() {
            for (j, quantity) in ScalarQuantity::ALL.into_iter().enumerate() {
                let interpolation = shortest(method::SLERP)
                    .with_before(modes[(i + j) % modes.len()])
                    .with_after(modes[(i + 2 * j + 1) % modes.len()]);
                let evaluation = Evaluation::Scalars(quantity, how, interpolation, frames.clone());
                self.add("scalars", &format!("{how} {quantity}"), evaluation);
            }
        }
    }

    /// Cases for ends, key signs, speeds, and wrap modes.
    fn options(&mut self) {
        let frames = SampleTimes::fps(50).between(-7.0, 21.0);
        let times = SampleTimes::at(
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
                let interpolation = shortest(method).with_ends(ends);
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
            let interpolation = shortest(method).with_ends(Ends::Loop);
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
            let interpolation = shortest(method).with_signs(KeySigns::AsAuthored);
            self.rows(
                "uneven",
                &format!("{method} as authored"),
                interpolation,
                &frames,
            );
            let sparse = SampleTimes::fps(19).between(1.0, 9.0);
            self.rows(
                "dense turned",
                &format!("{method} as authored"),
                interpolation,
                &sparse,
            );
        }
        for method in [method::SLERP, method::BESSEL_OVERHAUSER, method::SQUAD] {
            let interpolation = shortest(method).with_speed(Speed::Constant);
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
                let interpolation = shortest(method).with_before(before).with_after(after);
                let name = format!("{method} {before:?} {after:?}");
                self.rows("uneven", &name, interpolation, &frames);
                self.rows("uneven", &format!("{name} times"), interpolation, &times);
            }
        }
        let looped = shortest(method::SLERP).with_after(WrapMode::Loop);
        let tomorrow = SampleTimes::fps(60).between(86_400.0, 86_403.0);
        self.rows("uneven", "slerp Loop tomorrow", looped, &tomorrow);
        let velocity = looped.with_quantity(Quantity::Velocity(Axes::Parent));
        self.rows("closed", "slerp velocity Loop", velocity, &frames);
    }

    /// Cases for every route from keys to results: by segments, directly from keys, by single samples, and piece by
    /// piece for a long track.
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
        let mut random = SeededRandom(77);
        let mut draw = |count: usize, end: f64| -> Vec<f64> {
            (0..count).map(|_| random.between(-0.5, end)).collect()
        };
        let shared = SampleTimes::at(draw(300, 30.0));
        let sparse = SampleTimes::at(draw(2, 1.2));
        let each = SampleTimes::at_each(draw(700, 1.2));
        let each_dense = SampleTimes::at_each(draw(12, 25.0));
        for method in methods {
            let shortest = shortest(method);
            for set in ["dense", "dense turned", "dense wild"] {
                self.rows(
                    set,
                    &format!("{method} 30 fps"),
                    shortest,
                    &SampleTimes::fps(30),
                );
                self.rows(
                    set,
                    &format!("{method} 211 fps"),
                    shortest,
                    &SampleTimes::fps(211).between(1.0, 4.0),
                );
                self.rows(set, &format!("{method} times"), shortest, &shared);
            }
            self.rows(
                "dense",
                &format!("{method} times of each"),
                shortest,
                &each_dense,
            );
            self.rows(
                "crowd",
                &format!("{method} 60 fps"),
                shortest,
                &SampleTimes::fps(60),
            );
            self.rows(
                "crowd",
                &format!("{method} one frame"),
                shortest,
                &SampleTimes::fps(1).between(0.3, 0.3),
            );
            self.rows("crowd", &format!("{method} few times"), shortest, &sparse);
            self.rows(
                "crowd",
                &format!("{method} a time of each"),
                shortest,
                &each,
            );
            let evaluation = Evaluation::Set(shortest, sparse.clone(), Layout::FrameMajor);
            self.add("crowd", &format!("{method} few times, frames"), evaluation);
            self.rows(
                "long",
                &format!("{method} 7 fps"),
                shortest,
                &SampleTimes::fps(7),
            );
            self.rows(
                "long",
                &format!("{method} 120 fps"),
                shortest,
                &SampleTimes::fps(120),
            );
        }
    }

    /// Cases for every kind of a crowd's results, in both precisions: arcs only in two layers, and several methods in
    /// three.
    fn crowds(&mut self) {
        use CrowdValues::{Local, Model, Rotations, Skinning};
        for mix in [ARCS, SEVERAL] {
            for values in [Rotations, Local, Model, Skinning] {
                let outputs = [CrowdOutput::from(values), CrowdOutput::half(values)];
                for output in outputs {
                    let bits = if output.is_half { 16 } else { 32 };
                    self.cases.push(Case {
                        name: format!("crowds {} {values:?} {bits} bits", mix.name),
                        set: "even", // not used
                        evaluation: Evaluation::Crowd(mix, output),
                    });
                }
            }
        }
    }

    /// Number of cases.
    #[must_use]
    pub fn case_count(&self) -> usize {
        self.cases.len()
    }

    /// A case's name.
    ///
    /// # Panics
    /// When there is no such case.
    #[must_use]
    pub fn name(&self, case: usize) -> &str {
        &self.cases[case].name
    }

    /// The recorded hash of the case with this name.
    #[must_use]
    pub fn recorded(name: &str) -> Option<&'static str> {
        static TABLE: OnceLock<BTreeMap<&str, &str>> = OnceLock::new();
        let table = TABLE.get_or_init(|| {
            let lines = RECORDED.lines().filter_map(|line| line.split_once(' '));
            lines.map(|(hash, name)| (name, hash)).collect()
        });
        table.get(name).copied()
    }

    /// The recorded hashes as text: a line with a hash and a name for each case.
    #[must_use]
    pub fn table() -> &'static str {
        RECORDED
    }

    /// Number of recorded hashes.
    #[must_use]
    pub fn recorded_count() -> usize {
        RECORDED.lines().count()
    }

    /// Evaluates a case on an engine.
    ///
    /// # Errors
    /// As the engine's functions.
    ///
    /// # Panics
    /// When there is no such case.
    pub fn evaluate(&self, case: usize, engine: &Engine) -> Result<GoldenResult, GoldenError> {
        let Case {
            set, evaluation, ..
        } = &self.cases[case];
        let mut hash = Hash::default();
        evaluation.run(engine, &self.sets[set], &mut hash)?;
        Ok(hash.result())
    }
}

/// A hash of all bytes that are added.
#[derive(Default)]
struct Hash {
    sha: Sha256,
    bytes: u64,
}

impl Hash {
    fn add<T: bytemuck::NoUninit>(&mut self, values: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(values);
        self.sha.update(bytes);
        self.bytes += bytes.len() as u64;
    }

    fn result(self) -> GoldenResult {
        let mut hash = String::new();
        for byte in &self.sha.finalize()[..8] {
            write!(hash, "{byte:02x}").expect("memory takes everything");
        }
        GoldenResult {
            hash,
            bytes: self.bytes,
        }
    }
}

impl Evaluation {
    fn run(&self, engine: &Engine, set: &TrackSet, hash: &mut Hash) -> Result<(), GoldenError> {
        let rows = Layout::TrackMajor;
        match self {
            Self::Set(interpolation, frames, layout) => {
                if interpolation.quantity == Quantity::Rotation {
                    let found = engine
                        .request(set, *interpolation, frames)
                        .layout(*layout)
                        .evaluate()?;
                    hash.add(found.as_quats());
                } else {
                    let found = engine.rates(set, *interpolation, frames, *layout)?;
                    hash.add(found.as_slice());
                }
            }
            Self::Encoded(interpolation, frames, layout, encoding) => {
                let clip = engine.upload(set, *interpolation)?;
                hash.add(
                    &clip
                        .request(frames)
                        .layout(*layout)
                        .encoding(*encoding)
                        .evaluate_bytes()?,
                );
            }
            Self::Stream(interpolation, frames, layout) => {
                let clip = engine.upload(set, *interpolation)?;
                let add = |chunk: Chunk<'_>| -> Result<(), Error> {
                    hash.add(chunk.rotations().unwrap_or_default());
                    Ok(())
                };
                clip.request(frames).layout(*layout).stream(777, add)?;
            }
            Self::Transforms(interpolation, vectors, frames) => {
                let found = engine.transforms(set, *interpolation, *vectors, frames, rows)?;
                hash.add(found.translations.as_slice());
                hash.add(found.rotations.as_quats());
                hash.add(found.scales.as_slice());
            }
            Self::Scalars(quantity, how, interpolation, frames) => {
                let found = engine.scalars(set, *quantity, *how, *interpolation, frames, rows)?;
                hash.add(found.as_slice());
            }
            Self::Follow(follow) => {
                let found = engine.follow(set, follow, &SampleTimes::fps(30), rows)?;
                hash.add(found.positions.as_slice());
                hash.add(found.rotations.as_quats());
            }
            Self::Smooth(smoothing) => {
                let linear = VectorMethod::Linear;
                let found =
                    engine.transforms(set, method::SLERP, linear, &SampleTimes::fps(30), rows)?;
                hash.add(engine.smooth(&found.rotations, smoothing)?.as_quats());
                hash.add(
                    engine
                        .smooth_vectors(&found.translations, smoothing)?
                        .as_slice(),
                );
            }
            Self::Poses => {
                let frames = SampleTimes::fps(30);
                let one = engine.evaluate(set, method::SLERP, &frames)?;
                let two = engine.evaluate(set, method::C2, &frames)?;
                let three = engine.evaluate(set, method::B_SPLINE, &frames)?;
                let blended = engine.blend(&[(&one, 0.5), (&two, 0.3), (&three, 0.2)])?;
                let mixed = engine.mix(&one, &three, 0.3)?;
                let reference: Vec<Quat> = set.tracks().map(|track| track.keys[0]).collect();
                let added = engine.add(&blended, &mixed, &reference, 0.7)?;
                let skeleton = Skeleton::chain(set.track_count(), 3.0).map_err(Error::from)?;
                let world = engine.world(&added, &skeleton)?;
                hash.add(blended.as_quats());
                hash.add(mixed.as_quats());
                hash.add(added.as_quats());
                hash.add(world.as_slice());
            }
            Self::Crowd(mix, output) => mix.run(engine, *output, hash)?,
        }
        Ok(())
    }
}

impl CrowdMix {
    fn run(self, engine: &Engine, output: CrowdOutput, hash: &mut Hash) -> Result<(), CrowdError> {
        let mut random = SeededRandom(41);
        let library = crowd_library(&mut random, self.joints, self.methods)?;
        let mut crowd = engine.crowd(&library, self.instances, self.layers)?;
        for (step, ticks) in CLOCK.into_iter().enumerate() {
            for index in 0..self.instances * self.layers {
                if step == 0 || random.below(5) == 0 {
                    let plays = crowd_layer(&mut random, &library);
                    crowd.set(index / self.layers, index % self.layers, plays)?;
                }
            }
            crowd.advance_ticks(ticks)?;
            let vectors = crowd.output_len(output);
            if output.is_half {
                let mut found = vec![[0u16; 4]; vectors];
                crowd.evaluate_half_into(output.values, &mut found)?;
                hash.add(&found);
            } else {
                let mut found = vec![[0f32; 4]; vectors];
                crowd.evaluate_into(output.values, &mut found)?;
                hash.add(&found);
            }
        }
        Ok(())
    }
}
