//! Measures parts of an evaluation separately: `cargo bench`. `tumble bench` and `benches/peers` measure whole
//! evaluations and compare with other code.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::{DQuat, DVec3, Quat, Vec3};
use tumble::crowd::{
    BodyStates, BodyTables, CrowdLayer, CrowdLibrary, CrowdValues, KeyPrecision, LayerBlend,
    MotionBuilder, MotionStates, MotionTables,
};
use tumble::trees::{
    BodyOrder, BodyRows, Configuration, ConfigurationRates, JointKind, JointTracks, Siblings, Tree,
    TreeBody, TreeJoint,
};
use tumble::{
    Device, Encoding, Engine, EngineOptions, Layout, METHODS, SampleTimes, Skeleton, TrackSet,
    VectorMethod, method,
};

fn main() {
    divan::main();
}

const TRACKS: usize = 256;
const KEYS: usize = 26;

/// Tracks whose keys turn by about `step` radians from one to the next.
fn set(step: f32) -> TrackSet {
    let mut set = TrackSet::new();
    let times: Vec<f64> = (0..KEYS).map(|i| i as f64 + 0.3 * (i % 3) as f64).collect();
    for track in 0..TRACKS {
        let key = |i: usize| {
            let angle = step * (i as f32 + (i as f32 + track as f32).sin());
            Quat::from_rotation_y(angle) * Quat::from_rotation_x(0.4 * angle.cos())
        };
        let keys: Vec<Quat> = (0..KEYS).map(key).collect();
        set.push("", &times, &keys).expect("unit keys in order");
    }
    set
}

fn one_thread() -> Engine {
    let mut options = EngineOptions::default();
    options.thread_count = Some(1);
    Engine::with_options(Device::Cpu, &options).expect("a CPU")
}

/// Keys to segments, per key, for each method.
#[divan::bench(args = METHODS.map(|method| method.name))]
fn prepare(bencher: Bencher<'_, '_>, method: &str) {
    let method = tumble::Method::named(method).expect("in the list");
    let (engine, set) = (one_thread(), set(1.0));
    bencher
        .counter(ItemsCount::new(TRACKS * KEYS))
        .bench(|| engine.upload(&set, method));
}

/// The same for Bessel-Overhauser with steps of 3 degrees, which are motion capture's.
#[divan::bench]
fn prepare_small_angle(bencher: Bencher<'_, '_>) {
    let (engine, set) = (one_thread(), set(0.05));
    bencher
        .counter(ItemsCount::new(TRACKS * KEYS))
        .bench(|| engine.upload(&set, method::BESSEL_OVERHAUSER));
}

/// Segments to rotations, per rotation, for each method.
#[divan::bench(args = METHODS.map(|method| method.name))]
fn evaluate(bencher: Bencher<'_, '_>, method: &str) {
    let method = tumble::Method::named(method).expect("in the list");
    let clip = one_thread().upload(&set(1.0), method).expect("good keys");
    let frames = SampleTimes::fps(40);
    let rotations = TRACKS * clip.timeline(&frames).expect("frames").len();
    let mut output = vec![Quat::IDENTITY; rotations];
    bencher
        .counter(ItemsCount::new(rotations))
        .bench_local(|| clip.evaluate_into(&frames, Layout::TrackMajor, &mut output));
}

/// f32 to shorter rotations, per rotation.
#[divan::bench(args = [Encoding::F16, Encoding::Snorm16])]
fn encode(bencher: Bencher<'_, '_>, encoding: Encoding) {
    let rotations = vec![[0.5, -0.5, 0.1, 0.7]; 1 << 14];
    let mut output = vec![0; rotations.len() * encoding.bytes()];
    bencher
        .counter(ItemsCount::new(rotations.len()))
        .bench_local(|| {
            encoding
                .encode(divan::black_box(&rotations), &mut output)
                .unwrap();
        });
}

/// A frame of a crowd, each character at a different time in a clip of arcs, per joint.
#[divan::bench(args = [CrowdValues::Rotations, CrowdValues::Model])]
fn crowd(bencher: Bencher<'_, '_>, values: CrowdValues) {
    frame_of_crowd(bencher, values, 1, LayerBlend::Over);
}

/// The same with a second layer over the first, as in a fade, and with one that is added.
#[divan::bench(args = LayerBlend::ALL)]
fn crowd_of_two_layers(bencher: Bencher<'_, '_>, blend: LayerBlend) {
    frame_of_crowd(bencher, CrowdValues::Rotations, 2, blend);
}

fn frame_of_crowd(bencher: Bencher<'_, '_>, values: CrowdValues, layers: usize, blend: LayerBlend) {
    const CHARACTERS: usize = 1000;
    let skeleton = Skeleton::chain(TRACKS / 4, 0.1).expect("a skeleton");
    let mut library = CrowdLibrary::new(&skeleton).expect("joints");
    let set = set(0.3).select(0..TRACKS / 4).expect("tracks");
    let clip = library.push(&set, method::SLERP, VectorMethod::Linear);
    let clip = clip.expect("a clip");
    let mut crowd = one_thread()
        .crowd(&library, CHARACTERS, layers)
        .expect("a crowd");
    for instance in 0..CHARACTERS {
        let plays = CrowdLayer::new(clip).at(instance as i64 * 9_973);
        crowd.set(instance, 0, plays).expect("an instance");
        if layers > 1 {
            let mut above = plays.at(instance as i64 * 7_919);
            (above.weight, above.blend) = (0.3, blend);
            crowd.set(instance, 1, above).expect("an instance");
        }
    }
    let mut output = vec![[0.0; 4]; crowd.output_len(values)];
    bencher
        .counter(ItemsCount::new(CHARACTERS * skeleton.len()))
        .bench_local(|| {
            crowd.advance(1.0 / 60.0).expect("a short step");
            crowd.evaluate_into(values, &mut output)
        });
}

/// The number of instances of one request to a library of motions.
const INSTANCES: usize = 4096;

/// A library of clips at 30 Hz whose joints rotate and move a little from key to key, with instances at scattered times.
struct Motions {
    tables: MotionTables,
    spans: Vec<[u32; 4]>,
    cells: Vec<[f32; 4]>,
    at: Vec<(u32, u32)>,
}

fn motions(skeleton: &Skeleton) -> Motions {
    const CLIPS: usize = 200;
    const TICKS: u32 = 705_600;
    let mut builder = MotionBuilder::new(skeleton, TICKS, KeyPrecision::Exact).expect("a library");
    for clip in 0..CLIPS {
        let keys = 60 + clip * 37 % 500;
        let times: Vec<f64> = (0..keys).map(|key| key as f64 / 30.0).collect();
        let mut set = TrackSet::new();
        for joint in 0..skeleton.len() {
            let phase = |key: usize| 0.1 * key as f32 + (joint * 7 + clip) as f32;
            let rotation = |key| {
                Quat::from_rotation_y(phase(key).sin()) * Quat::from_rotation_x(phase(key).cos())
            };
            let keys: Vec<Quat> = (0..keys).map(rotation).collect();
            set.push("", &times, &keys).expect("unit keys in order");
            let position = |key| Vec3::new(phase(key).sin(), phase(key).cos(), phase(key).sin());
            let positions: Vec<Vec3> = (0..times.len()).map(position).collect();
            set.set_translations(joint, &times, &positions, &[])
                .expect("as many keys");
        }
        builder
            .push(&set, method::SLERP, VectorMethod::Linear)
            .expect("a clip");
    }
    let (tables, spans, cells) = builder.finish();
    let instance = |index: usize| {
        let clip = index * 7_919 % CLIPS;
        let ticks = u64::from(tables.ticks(clip).unwrap_or(1));
        (clip as u32, (index as u64 * 104_729_123 % ticks) as u32)
    };
    let at = (0..INSTANCES).map(instance).collect();
    Motions {
        tables,
        spans,
        cells,
        at,
    }
}

/// All arrays of a skeleton's library, per joint.
#[divan::bench]
fn joints_of_motions(bencher: Bencher<'_, '_>) {
    const JOINTS: usize = 24;
    let skeleton = Skeleton::chain(JOINTS, 0.1).expect("a skeleton");
    let Motions {
        tables,
        spans,
        cells,
        at,
    } = motions(&skeleton);
    let engine = one_thread();
    let mut four = [0, 1].map(|_| vec![[0.0; 4]; INSTANCES * JOINTS]);
    let mut three = [0, 1, 2].map(|_| vec![[0.0; 3]; INSTANCES * JOINTS]);
    bencher
        .counter(ItemsCount::new(INSTANCES * JOINTS))
        .bench_local(|| {
            let [rotations, world_rotations] = four.each_mut().map(|array| &mut array[..]);
            let [positions, velocities, angular_velocities] =
                three.each_mut().map(|array| &mut array[..]);
            let states = MotionStates {
                rotations,
                positions,
                world_rotations,
                velocities,
                angular_velocities,
            };
            tables.sample_into(&engine, (&spans, &cells), &at, states)
        });
}

const BODIES: usize = 30;

/// A free body from which chains of six others hang, each by a hinge.
fn robot() -> Tree {
    let body = |index: usize| TreeBody {
        name: format!("b{index}"),
        parent: match index {
            0 => None,
            index if index % 6 == 1 => Some(0),
            index => Some(index - 1),
        },
        position: DVec3::Z * 0.1,
        rotation: DQuat::IDENTITY,
        joints: vec![TreeJoint {
            axis: DVec3::AXES[index % 3],
            ..TreeJoint::new(
                format!("j{index}"),
                if index == 0 {
                    JointKind::Free
                } else {
                    JointKind::Hinge
                },
            )
        }],
        mass_centre: None,
    };
    Tree::new((0..BODIES).map(body).collect()).expect("a tree")
}

/// All arrays of a robot's library, per body.
#[divan::bench]
fn bodies_of_motions(bencher: Bencher<'_, '_>) {
    let tree = robot();
    let tracks = JointTracks {
        free: vec![0],
        scalars: (0..BODIES as u32 - 1)
            .map(|index| [1 + index / 3, index % 3])
            .collect(),
        ..JointTracks::default()
    };
    let order = tree.order(BodyOrder::DepthFirst, Siblings::File);
    let frames = tree.frames(&tracks, &order, &[]).expect("frames");
    let count = 1 + (BODIES - 1).div_ceil(3);
    let skeleton = Skeleton::new(vec![None; count], vec![Vec3::ZERO; count]).expect("a skeleton");
    let Motions {
        tables,
        spans,
        cells,
        at,
    } = motions(&skeleton);
    let tables = BodyTables::new(tables, frames).expect("frames of the tracks");
    let engine = one_thread();
    let mut scalars = [0, 1].map(|_| vec![0.0; INSTANCES * (BODIES - 1)]);
    let mut rotations = vec![[0.0; 4]; INSTANCES * BODIES];
    let mut three = [0, 1, 2].map(|_| vec![[0.0; 3]; INSTANCES * BODIES]);
    bencher
        .counter(ItemsCount::new(INSTANCES * BODIES))
        .bench_local(|| {
            let [joint_values, joint_rates] = scalars.each_mut().map(|array| &mut array[..]);
            let [positions, velocities, angular_velocities] =
                three.each_mut().map(|array| &mut array[..]);
            let rotations = &mut rotations[..];
            let states = BodyStates {
                joint_values,
                joint_rates,
                positions,
                rotations,
                velocities,
                angular_velocities,
            };
            tables.sample_into(&engine, (&spans, &cells), &at, None, states)
        });
}

/// Forward kinematics in f64 with velocities, per configuration.
#[divan::bench]
fn forward(bencher: Bencher<'_, '_>) {
    const COUNT: usize = 256;
    let tree = robot();
    let order = tree.order(BodyOrder::DepthFirst, Siblings::File);
    let walk = tree.walk(&order, &[]).expect("bodies");
    let mut memory = tree.walk_memory();
    let mut motions = vec![tumble::trees::BodyMotion::default(); COUNT * BODIES];
    let at = |sample: usize, (at, rates): &mut (Configuration, ConfigurationRates)| {
        at.scalars.fill(0.01 * sample as f64);
        rates.scalars.fill(1.0);
    };
    bencher
        .counter(ItemsCount::new(COUNT))
        .bench_local(|| walk.bodies_into(&mut memory, COUNT, at, BodyRows::Motions(&mut motions)));
}
