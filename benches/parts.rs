//! Parts of an evaluation, each alone: `cargo bench`. For comparisons with others, and
//! of whole evaluations, see `tumble bench` and `benches/peers`.

// Tests may use what systems round differently (clippy.toml).
#![allow(clippy::disallowed_methods)]

use divan::Bencher;
use divan::counter::ItemsCount;
use glam::Quat;
use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdValues, LayerBlend};
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
