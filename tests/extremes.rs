//! No public function panics, whatever its arguments are: every call with extreme numbers, lengths and
//! indices gives a result or an error. The few that may panic say so and have a twin that does not
//! ([`TrackSet::track`] and [`TrackSet::get`]).

use std::ops::Range;

use glam::{Affine3A, DVec3, Quat, Vec3};
use proptest::prelude::*;
use tumble::paths::{Direction, Follow, PathFrame, PathSpeed, Twist};
use tumble::{
    Axes, Channel, Encoding, Ends, Engine, Error, EulerSequence, FrameRate, Interpolation,
    KeySigns, Layout, METHODS, OutputBuffer, Quantity, Rotations, SampleTimes, Skeleton, Smoothing,
    SmoothingEnds, SmoothingKernel, Speed, Tcb, TrackSet, VectorMethod, Vectors, WrapMode,
};

use crate::support::{Random, vulkan_devices};

const NUMBERS: [f64; 22] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.5,
    1e-5,
    0.999_999_9,
    1.000_000_1,
    3.5,
    -7.25,
    1e4,
    86_400.0,
    1e9,
    -1e9,
    1e300,
    -1e300,
    f64::MIN_POSITIVE,
    5e-324,
    f64::MAX,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

const COUNTS: [usize; 9] = [
    0,
    1,
    2,
    3,
    5,
    if usize::BITS == 64 {
        (1_u64 << 40) as usize
    } else {
        1 << 16
    },
    usize::MAX / 16,
    usize::MAX - 1,
    usize::MAX,
];

/// Values of all kinds, ordinary ones more often; otherwise nothing would ever be evaluated.
struct Generator(Random);

impl Generator {
    fn number(&mut self) -> f64 {
        match self.0.next() % 3 {
            0 => self.0.pick(&NUMBERS),
            _ => self.0.between(-3.0, 3.0),
        }
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    fn small(&mut self) -> Vec3 {
        match self.0.next() % 8 {
            0 => self.vector().as_vec3(),
            _ => self.0.direction().as_vec3(),
        }
    }

    fn count(&mut self) -> usize {
        self.0.pick(&COUNTS)
    }

    fn wild(&mut self, one_in: u64) -> bool {
        self.0.next().is_multiple_of(one_in)
    }

    fn range(&mut self, below: usize) -> Range<usize> {
        match self.wild(3) {
            true => self.count()..self.count(),
            false => 0..self.0.next() as usize % (below + 1),
        }
    }

    fn times(&mut self, limit: u64) -> Vec<f64> {
        let count = self.0.next() % (limit + 1);
        let mut times: Vec<f64> = (0..count).map(|_| self.0.between(-2.0, 2.0)).collect();
        if self.wild(4) {
            times.iter_mut().for_each(|time| *time = self.number());
        }
        if !self.wild(8) {
            times.sort_by(f64::total_cmp);
        }
        if !self.wild(8) {
            times.dedup();
        }
        times
    }

    fn quat(&mut self) -> Quat {
        match self.0.next() % 24 {
            0 => Quat::from_array(std::array::from_fn(|_| self.number() as f32)),
            1 => Quat::from_array([0.0; 4]),
            2 => self.0.rotation().as_quat() * (1.0 + self.number() as f32 * 0.05),
            _ => self.0.rotation().as_quat(),
        }
    }

    fn set(&mut self) -> TrackSet {
        let mut set = TrackSet::new();
        for _ in 0..self.0.next() % 4 {
            let times = self.times(6);
            let more = usize::from(self.wild(16));
            let keys: Vec<Quat> = (0..times.len() + more).map(|_| self.quat()).collect();
            let _ = set.push("", &times, &keys);
        }
        for _ in 0..self.0.next() % 5 {
            let track = self.index(&set);
            let keys = set.get(track).map_or(1, |track| track.keys.len());
            let keys = keys + usize::from(self.wild(16));
            let times = set
                .get(track)
                .map_or(Vec::new(), |track| track.times.to_vec());
            let times = if self.wild(2) { self.times(6) } else { times };
            let points: Vec<Vec3> = times.iter().map(|_| self.small()).collect();
            let _ = match self.0.next() % 6 {
                0 => {
                    let all: Vec<DVec3> = (0..keys).map(|_| self.vector()).collect();
                    set.set_velocities(track, &all)
                }
                1 => {
                    let all: Vec<_> = (0..keys).map(|_| [self.quat(), self.quat()]).collect();
                    set.set_tangents(track, &all)
                }
                2 => {
                    let all: Vec<Tcb> = (0..keys).map(|_| self.tcb()).collect();
                    set.set_tcb(track, &all)
                }
                3 => {
                    let tangents: Vec<_> = points.iter().map(|&point| [point, -point]).collect();
                    let some = if self.wild(2) { &tangents[..] } else { &[] };
                    set.set_translations(track, &times, &points, some)
                }
                4 => set.set_scales(track, &times, &points, &[]),
                _ => {
                    let ups: Vec<Option<Vec3>> =
                        points.iter().map(|_| Some(self.small())).collect();
                    set.push_path("way", &times, &points, &ups).map(drop)
                }
            };
        }
        set
    }

    fn index(&mut self, set: &TrackSet) -> usize {
        match self.wild(6) {
            true => self.count(),
            false => self.0.next() as usize % set.track_count().max(1),
        }
    }

    fn tcb(&mut self) -> Tcb {
        Tcb {
            tension: self.number(),
            continuity: self.number(),
            bias: self.number(),
        }
    }

    fn ends(&mut self) -> Ends {
        let clamped = Ends::Clamped {
            start: self.vector(),
            end: self.vector(),
        };
        let plain = [
            Ends::Parabolic,
            Ends::Natural,
            Ends::Secant,
            Ends::Loop,
            Ends::Frozen,
        ];
        match self.wild(4) {
            true => clamped,
            false => self.0.pick(&plain),
        }
    }

    fn interpolation(&mut self) -> Interpolation {
        let method = METHODS[self.0.next() as usize % METHODS.len()];
        let mut interpolation = Interpolation::from(method);
        if self.wild(2) {
            let wraps = [
                WrapMode::Hold,
                WrapMode::Loop,
                WrapMode::Mirror,
                WrapMode::Extrapolate,
            ];
            interpolation.signs = self.0.pick(&[KeySigns::Shortest, KeySigns::AsAuthored]);
            interpolation.ends = self.ends();
            interpolation.tcb = self.tcb();
            interpolation.speed = self.0.pick(&[Speed::AsKeyed, Speed::Constant]);
            interpolation.before = self.0.pick(&wraps);
            interpolation.after = self.0.pick(&wraps);
            let axes = self.0.pick(&[Axes::Body, Axes::Parent]);
            interpolation.quantity = self.0.pick(&[
                Quantity::Rotation,
                Quantity::Rotation,
                Quantity::Velocity(axes),
                Quantity::Acceleration(axes),
            ]);
        }
        interpolation
    }

    fn frames(&mut self) -> SampleTimes {
        let sparse = SampleTimes::fps(self.0.pick(&[1, 2, 7]));
        match self.0.next() % 8 {
            0 => SampleTimes::fps(self.0.pick(&[0, 60, 4_000_000_000, u32::MAX])),
            1 => SampleTimes::at(self.times(8)),
            2 => SampleTimes::at_each(self.times(8)),
            3 => sparse.between(self.number(), self.number()),
            4 => sparse.spanning((self.number(), self.number())),
            5 => SampleTimes::at(self.times(3)).between(self.number(), self.number()),
            6 => {
                let parts = [0, 1, 2, 1001, u64::MAX - 1, u64::MAX];
                let rate = FrameRate::new(self.0.pick(&parts), self.0.pick(&parts));
                rate.map_or(sparse, SampleTimes::rate)
            }
            _ => sparse,
        }
    }

    fn layout(&mut self) -> Layout {
        self.0.pick(&[Layout::TrackMajor, Layout::FrameMajor])
    }

    fn rotations(&mut self) -> Rotations {
        let count = self.0.next() as usize % 13;
        let all: Vec<Quat> = (0..count).map(|_| self.quat()).collect();
        let tracks = if self.wild(4) {
            self.count()
        } else {
            self.0.pick(&[1, 2, 3])
        };
        let layout = self.layout();
        let whole = &all[..count - count.checked_rem(tracks).unwrap_or(0)];
        Rotations::of(if self.wild(4) { &all } else { whole }, tracks, layout)
            .unwrap_or_else(|_| Rotations::of(&[Quat::IDENTITY; 6], 2, layout).unwrap())
    }

    fn skeleton(&mut self) -> Skeleton {
        let joints = self.0.next() as usize % 5;
        let parent = |generate: &mut Self, joint: usize| match generate.0.next() % 8 {
            0 => Some(generate.count()),
            1 => Some(joint),
            2 => None,
            _ => joint.checked_sub(1),
        };
        let parents = (0..joints).map(|joint| parent(self, joint)).collect();
        let offsets = (0..joints + usize::from(self.wild(12)))
            .map(|_| self.small())
            .collect();
        Skeleton::new(parents, offsets).unwrap_or_else(|_| Skeleton::chain(2, 1.0).unwrap())
    }

    fn follow(&mut self, set: &TrackSet) -> Follow {
        let axes = ["x", "-x", "y", "-y", "z", "-z", "+z"];
        Follow::default()
            .with_method(self.0.pick(&VectorMethod::ALL))
            .with_ends(self.ends())
            .with_direction(match self.0.next() % 4 {
                0 => Direction::Ahead(self.number()),
                1 => Direction::Point(self.vector()),
                2 => Direction::Track(self.index(set)),
                _ => Direction::Tangent,
            })
            .with_frame(
                self.0
                    .pick(&[PathFrame::Minimal, PathFrame::Fixed, PathFrame::Frenet]),
            )
            .with_up(self.vector())
            .with_twist(self.0.pick(&[Twist::Spread, Twist::Free]))
            .with_speed(match self.0.next() % 3 {
                0 => PathSpeed::Eased {
                    start: self.number(),
                    end: self.number(),
                },
                1 => PathSpeed::Constant,
                _ => PathSpeed::Keys,
            })
            .with_axes([0, 1].map(|_| self.0.pick(&axes).parse().unwrap()))
    }

    fn smoothing(&mut self) -> Smoothing {
        let kernel = match self.0.next() % 7 {
            0 => SmoothingKernel::Linear,
            1 => SmoothingKernel::Cubic,
            2 => SmoothingKernel::Box(self.number()),
            3 => SmoothingKernel::Tent(self.number()),
            4 => SmoothingKernel::Gaussian(self.number()),
            _ => SmoothingKernel::SavitzkyGolay {
                radius: self.count(),
                order: self.count(),
            },
        };
        let mut smoothing = Smoothing::new(kernel);
        smoothing.passes = self.0.pick(&[0, 1, 2, 3]);
        smoothing.ends = self.0.pick(&[
            SmoothingEnds::Keep,
            SmoothingEnds::Parabolic,
            SmoothingEnds::Loop,
        ]);
        smoothing
    }
}

/// Calls the methods by which a set is read and selected from, with any arguments.
fn ask(generate: &mut Generator, set: &TrackSet) {
    let index = generate.count();
    let _ = (
        set.get(index).is_some(),
        set.track_name(index),
        set.time_span(),
    );
    for channel in [Channel::Translation, Channel::Scale] {
        let _ = set.vector_keys(channel, index).is_some();
    }
    let list: Vec<usize> = (0..generate.0.next() % 3)
        .map(|_| generate.index(set))
        .collect();
    let selected = set.select(list.iter().copied());
    assert_eq!(
        selected.is_ok(),
        list.iter().all(|&track| track < set.track_count())
    );
    let shared: Vec<Quat> = (0..generate.0.next() % 7)
        .map(|_| generate.quat())
        .collect();
    let times = generate.times(3);
    let _ = TrackSet::with_shared_times(&times, &shared).is_ok();
    let _ = TrackSet::from_shared_times(times, shared).is_ok();
}

/// Evaluates a set by every function that evaluates.
fn evaluate(generate: &mut Generator, engine: &Engine, set: &TrackSet) {
    let (interpolation, frames) = (generate.interpolation(), generate.frames());
    let layout = generate.layout();
    let (tracks, limit) = (set.track_count(), 1 << 12);
    let resolved = frames.resolve(tracks, set.time_span());
    let count = resolved
        .as_ref()
        .map_or(0, |timeline| tracks.saturating_mul(timeline.len()));
    if let Ok(timeline) = &resolved {
        let _ = timeline.time(generate.count(), generate.count());
        let _ = timeline.times(generate.count()).len();
    }
    let _ = frames
        .resolve(
            generate.count(),
            Some((generate.number(), generate.number())),
        )
        .is_ok();
    let _ = engine
        .explain_route(set, interpolation, &frames, layout)
        .is_ok();
    // A large result that fits takes too long here and is tested elsewhere; one that does not fit is refused below.
    if (limit as u64..1 << 32).contains(&(count as u64)) {
        return;
    }
    if let Ok(result) = engine
        .request(set, interpolation, &frames)
        .layout(layout)
        .evaluate()
    {
        assert_eq!(result.as_quats().len(), count);
        let (track, sample) = (generate.count(), generate.count());
        let is_there = track < tracks && sample < result.sample_count();
        assert_eq!(result.get(track, sample).is_some(), is_there);
    } else {
        let _ = engine.evaluate(set, interpolation, &frames).is_err();
    }
    let _ = engine.rates(set, interpolation, &frames, layout).is_ok();
    let room = if generate.wild(4) {
        generate.0.next() as usize % 9
    } else {
        count.min(limit)
    };
    let mut output = OutputBuffer::new(room).unwrap();
    let _ = engine
        .evaluate_into(set, interpolation, &frames, layout, &mut output[..])
        .is_ok();
    let kinds = Encoding::ALL;
    let encoding = kinds[generate.0.next() as usize % kinds.len()];
    let mut bytes = vec![0; room.saturating_mul(encoding.bytes())];
    let range = generate.range(tracks);
    let _ = engine
        .request(set, interpolation, &frames)
        .tracks(range)
        .encoding(encoding)
        .evaluate_into(&mut bytes)
        .is_ok();
    let method = generate.0.pick(&VectorMethod::ALL);
    let transforms = engine.transforms(set, interpolation, method, &frames, layout);
    if let Ok(transforms) = &transforms {
        let skeleton = generate.skeleton();
        let bind = [Affine3A::IDENTITY; 3];
        let bind = [None, Some(&bind[..]), Some(&bind[..1])];
        let bind = generate.0.pick(&bind);
        if let Ok(model) = engine.local_to_model(transforms, &skeleton, bind) {
            let _ = (
                model.get(generate.count(), 0),
                model.position(0, generate.count()),
            );
        }
    }
    let follow = generate.follow(set);
    let _ = engine.follow(set, &follow, &frames, layout).is_ok();
    let chunk = generate.count();
    if count < limit {
        let streamed: Result<(), Error> = engine
            .request(set, interpolation, &frames)
            .layout(layout)
            .stream(chunk, |chunk| {
                let _ = (chunk.rotations().is_some(), chunk.rates().is_some());
                Ok(())
            });
        let _ = streamed.is_ok();
    }
    let Ok(clip) = engine.upload(set, interpolation) else {
        return;
    };
    let _ = clip.timeline(&frames).is_ok();
    let _ = clip.request(&frames).layout(layout).evaluate().is_ok();
    let _ = clip.rates(&frames, layout).is_ok();
    let _ = clip.evaluate_into(&frames, layout, &mut output[..]).is_ok();
    let _ = clip
        .request(&frames)
        .layout(layout)
        .encoding(encoding)
        .evaluate_bytes()
        .is_ok();
    let request = clip.request(&frames).layout(layout).encoding(encoding);
    let _ = request.evaluate_into(&mut bytes).is_ok();
    let request = request
        .tracks(generate.range(tracks))
        .samples(generate.range(3));
    let _ = request.evaluate_into(&mut bytes).is_ok();
}

/// Calls passes over poses, and smoothing.
fn combine(generate: &mut Generator, engine: &Engine) {
    let (a, b) = (generate.rotations(), generate.rotations());
    let weights = [generate.number() as f32, generate.number() as f32];
    let _ = engine.mix(&a, &b, weights[0]).is_ok();
    let _ = engine.blend(&[(&a, weights[0]), (&b, weights[1])]).is_ok();
    let _ = engine.blend(&[]).is_ok();
    let reference: Vec<Quat> = (0..generate.0.next() % 4)
        .map(|_| generate.quat())
        .collect();
    let _ = engine.add(&a, &b, &reference, weights[1]).is_ok();
    let skeleton = generate.skeleton();
    if let Ok(world) = engine.world(&a, &skeleton) {
        let _ = (
            world.position(generate.count(), 0),
            world.rotation(0, generate.count()),
        );
    }
    let smoothing = generate.smoothing();
    let _ = smoothing.check().is_ok();
    let _ = engine.smooth(&a, &smoothing).is_ok();
    let points: Vec<Vec3> = (0..6).map(|_| generate.small()).collect();
    if let Ok(vectors) = Vectors::of(&points, generate.0.pick(&[1, 2, 3, 4]), generate.layout()) {
        let _ = engine.smooth_vectors(&vectors, &smoothing).is_ok();
        let _ = vectors.get(generate.count(), generate.count()).is_none();
    }
}

/// Calls functions whose arguments are only numbers.
fn small_things(generate: &mut Generator) {
    let layout = generate.layout();
    let _ = layout.index(
        generate.count(),
        generate.count(),
        generate.count(),
        generate.count(),
    );
    for kind in Encoding::ALL {
        let rows: Vec<[f32; 4]> = (0..3).map(|_| generate.quat().to_array()).collect();
        let mut bytes = vec![0; kind.bytes() * 3 + usize::from(generate.wild(3))];
        let _ = kind.encode(&rows, &mut bytes).is_ok();
        let _ = kind.decode(&bytes[..kind.bytes().min(bytes.len())]).is_ok();
        let _ = kind.decode(&[]).is_err();
    }
    let count = generate.count();
    if count as u64 > 1 << 32 {
        assert!(OutputBuffer::new(count).is_err());
        assert!(Skeleton::chain(count, generate.number()).is_err());
    }
    let text = generate.0.pick(&[
        "", "xyz", "XYX", "xxx", "\u{fc}yz", "abcdefgh", "-9e999/0", "1/0", "30/1",
    ]);
    let _ = (
        text.parse::<EulerSequence>().is_ok(),
        text.parse::<FrameRate>().is_ok(),
    );
    let parts = [1, 1 << 40, u64::MAX];
    if let Ok(rate) = FrameRate::new(generate.0.pick(&parts), generate.0.pick(&parts)) {
        let _ = (rate.time_of(u64::MAX), rate.per_second());
    }
    let _ = tumble::Method::named(text).is_none();
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1200,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn nothing_panics_on_the_cpu(seed in any::<u64>()) {
        let mut generate = Generator(Random(seed));
        let engine = Engine::new(tumble::Device::Cpu).unwrap();
        let set = generate.set();
        ask(&mut generate, &set);
        evaluate(&mut generate, &engine, &set);
        combine(&mut generate, &engine);
        small_things(&mut generate);
    }
}

/// The same on a Vulkan device, fewer times: the checks are those of the CPU.
#[test]
fn nothing_panics_on_a_device() {
    for device in vulkan_devices().into_iter().take(1) {
        let engine = Engine::new(device).unwrap();
        for seed in 0..40 {
            let mut generate = Generator(Random(seed));
            let set = generate.set();
            evaluate(&mut generate, &engine, &set);
            combine(&mut generate, &engine);
        }
    }
}
