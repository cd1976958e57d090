//! Calls from any thread do not hang, and a thread that the system refuses does not end the program.
//! Tests that may hang run in a process of their own, which is ended after a while.
#![allow(unsafe_code)] // the buffers of an application's device

use std::hash::{DefaultHasher, Hash, Hasher};
use std::process::{Child, Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use glam::{DQuat, Quat, Vec3};
use rayon::prelude::*;
use tumble::crowd::{CrowdLayer, CrowdLibrary, CrowdValues};
use tumble::paths::Follow;
use tumble::vulkan::VulkanBuffer;
use tumble::vulkan::tuning::Mapping;
use tumble::{
    Axes, Device, Encoding, Engine, EngineOptions, Error, Interpolation, Layout, OutputBuffer,
    Quantity, SampleTimes, Skeleton, Smoothing, SmoothingKernel, TrackSet, VectorMethod, method,
};

use crate::application::Application;
use crate::support::{Random, vulkan_devices};

/// One of the ignored tests below, in a process of its own.
fn child(test: &str) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    let test = format!("threads::{test}");
    command.args(["--exact", &test, "--ignored", "--nocapture"]);
    command
}

/// Many times as long as a busy machine needs for this work.
const LIMIT: Duration = Duration::from_secs(300);

/// Waits for a process, and ends it after a while.
fn finish(mut child: Child) -> Result<(), String> {
    let started = Instant::now();
    loop {
        match child.try_wait().unwrap() {
            Some(status) if status.success() => return Ok(()),
            Some(status) => return Err(status.to_string()),
            None if started.elapsed() > LIMIT => {
                child.kill().unwrap();
                child.wait().unwrap();
                return Err(format!("it hangs: ended after {LIMIT:?}"));
            }
            None => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

fn runs(mut command: Command) -> Result<(), String> {
    finish(command.stdout(Stdio::null()).spawn().unwrap())
}

/// Rayon's workers take up other tasks while they wait: if a call held a lock meanwhile, the next task on the
/// same thread would wait for it for ever.
#[test]
fn tasks_of_a_callers_own_pool_may_call_everything_at_once() {
    let rounds = std::env::var("SOAK").map_or(2, |_| 200);
    for round in 0..rounds {
        let mut command = child("four_hundred_tasks");
        command.env("RAYON_NUM_THREADS", "3");
        runs(command).unwrap_or_else(|error| panic!("round {round}: {error}"));
    }
}

/// Bits of a result.
fn sum<T: bytemuck::NoUninit>(values: &[T]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytemuck::cast_slice::<T, u8>(values).hash(&mut hasher);
    hasher.finish()
}

/// More rotations than one task of the CPU has, so that every call divides its work.
fn keys() -> TrackSet {
    let mut random = Random(3);
    let times: Vec<f64> = (0..26).map(|i| f64::from(i) * 0.4).collect();
    let mut set = TrackSet::new();
    for track in 0..64 {
        let mut rotation = random.rotation();
        let mut keys = Vec::new();
        for _ in &times {
            let step = DQuat::from_axis_angle(random.direction(), random.between(0.0, 0.8));
            rotation = (rotation * step).normalize();
            keys.push(rotation.as_quat());
        }
        set.push("", &times, &keys).unwrap();
        let moved: Vec<Vec3> = times
            .iter()
            .map(|_| random.direction().as_vec3() * 0.3)
            .collect();
        set.set_translations(track, &times, &moved, &[]).unwrap();
    }
    set
}

fn paths() -> TrackSet {
    let mut random = Random(4);
    let mut set = TrackSet::new();
    let times: Vec<f64> = (0..20).map(f64::from).collect();
    for _ in 0..40 {
        let points: Vec<Vec3> = (0..20u8)
            .map(|i| Vec3::X * f32::from(i) * 2.0 + random.direction().as_vec3())
            .collect();
        set.push_path("", &times, &points, &[]).unwrap();
    }
    set
}

type Call = Box<dyn Fn(u32) -> u64 + Send + Sync>;

/// Every public call that works, on one engine, one clip and one crowd; each takes a rate. The last one
/// has a lock of the caller's around it.
fn calls(engine: &Engine) -> Vec<Call> {
    let set: &'static TrackSet = Box::leak(Box::new(keys()));
    let paths: &'static TrackSet = Box::leak(Box::new(paths()));
    let clip: &'static _ = Box::leak(Box::new(engine.upload(set, method::SLERP).unwrap()));
    let engine: &'static Engine = Box::leak(Box::new(engine.clone()));
    let frames = |rate: u32| SampleTimes::fps(rate);
    let tracks = set.track_count();
    let samples = move |rate: u32| clip.timeline(&frames(rate)).unwrap().len();
    let chain: &'static _ = Box::leak(Box::new(Skeleton::chain(tracks, 0.5).unwrap()));
    let poses = engine.evaluate(set, method::SLERP, &frames(50)).unwrap();
    let poses: &'static _ = Box::leak(Box::new(poses));
    let velocity = Interpolation::from(method::SLERP).with_quantity(Quantity::Velocity(Axes::Body));
    let mut library = CrowdLibrary::new(chain).unwrap();
    let moves = library.push(set, method::SLERP, VectorMethod::Linear);
    moves.unwrap();
    let mut crowd = engine.crowd(&library, 200, 1).unwrap();
    crowd.set(7, 0, CrowdLayer::new(0)).unwrap();
    let crowd = Mutex::new(crowd);
    let (track_major, frame_major) = (Layout::TrackMajor, Layout::FrameMajor);
    vec![
        Box::new(move |rate| sum(clip.evaluate(&frames(rate)).unwrap().as_quats())),
        Box::new(move |rate| {
            let found = clip
                .request(&frames(rate))
                .layout(frame_major)
                .evaluate()
                .unwrap();
            sum(found.as_quats())
        }),
        Box::new(move |rate| {
            let mut output = OutputBuffer::new(tracks * samples(rate)).unwrap();
            let (rate, layout) = (frames(rate), track_major);
            clip.evaluate_into(&rate, layout, &mut output).unwrap();
            sum(&output)
        }),
        Box::new(move |rate| {
            let encoding = Encoding::F16;
            sum(&clip
                .request(&frames(rate))
                .layout(track_major)
                .encoding(encoding)
                .evaluate_bytes()
                .unwrap())
        }),
        Box::new(move |rate| {
            let frames = frames(rate);
            let request = clip.request(&frames).layout(frame_major);
            let request = request.tracks(3..tracks).samples(5..samples(rate));
            let (count, each) = request.size().unwrap();
            let mut output = vec![0_u8; count * each];
            request.evaluate_into(&mut output).unwrap();
            sum(&output)
        }),
        Box::new(move |rate| {
            let mut all: Vec<[f32; 4]> = Vec::new();
            clip.request(&frames(rate))
                .layout(frame_major)
                .stream(10_000, |chunk| {
                    all.extend(chunk.rows);
                    Ok::<(), Error>(())
                })
                .unwrap();
            sum(&all)
        }),
        Box::new(move |rate| {
            let mut all: Vec<[f32; 4]> = Vec::new();
            let (rate, cubic) = (frames(rate), method::C2);
            engine
                .request(set, cubic, &rate)
                .layout(track_major)
                .stream(20_000, |chunk| {
                    all.extend(chunk.rows);
                    Ok::<(), Error>(())
                })
                .unwrap();
            sum(&all)
        }),
        Box::new(move |rate| {
            let found = engine.evaluate(set, method::BESSEL_OVERHAUSER, &frames(rate));
            sum(found.unwrap().as_quats())
        }),
        // This request is evaluated directly from keys.
        Box::new(move |rate| {
            let sparse = SampleTimes::at((0..20).map(|i| f64::from(i * rate) * 0.005).collect());
            let found = engine.evaluate(set, method::CATMULL_ROM, &sparse);
            sum(found.unwrap().as_quats())
        }),
        Box::new(move |rate| {
            let mut output = vec![0u8; (tracks - 1) * samples(rate) * 16];
            let (rate, encoding) = (frames(rate), Encoding::F32);
            engine
                .request(set, method::SLERP, &rate)
                .tracks(1..tracks)
                .encoding(encoding)
                .evaluate_into(&mut output)
                .unwrap();
            sum(&output)
        }),
        Box::new(move |rate| {
            let found = engine.rates(set, velocity, &frames(rate), track_major);
            sum(found.unwrap().as_slice())
        }),
        Box::new(move |rate| {
            let (rate, linear) = (frames(rate), VectorMethod::Linear);
            let local = engine
                .transforms(set, method::SLERP, linear, &rate, frame_major)
                .unwrap();
            let model = engine.local_to_model(&local, chain, None).unwrap();
            sum(model.as_arrays())
        }),
        Box::new(move |rate| {
            let follow = Follow::default();
            let found = engine.follow(paths, &follow, &frames(rate), track_major);
            sum(found.unwrap().rotations.as_quats())
        }),
        Box::new(move |_| {
            let smoothing = Smoothing::new(SmoothingKernel::Gaussian(2.0));
            sum(engine.smooth(poses, &smoothing).unwrap().as_quats())
        }),
        Box::new(move |rate| {
            let mixed = engine.mix(poses, poses, rate as f32 / 100.0).unwrap();
            let blended = engine.blend(&[(&mixed, 0.5), (poses, 0.5)]).unwrap();
            let reference = vec![Quat::IDENTITY; tracks];
            let added = engine.add(&blended, poses, &reference, 0.5).unwrap();
            sum(engine.world(&added, chain).unwrap().as_slice())
        }),
        Box::new(move |rate| {
            let mut crowd = engine.crowd(&library, 100, 1).unwrap();
            crowd.submit(CrowdValues::Local).unwrap();
            let mut output = vec![[0.0; 4]; crowd.output_len(CrowdValues::Local)];
            crowd.wait_into(&mut output).unwrap();
            sum(&output)
                ^ sum(engine
                    .upload(set, method::C2)
                    .unwrap()
                    .evaluate(&frames(rate))
                    .unwrap()
                    .as_quats())
        }),
        Box::new(move |_| {
            let mut crowd = crowd.lock().unwrap();
            let mut output = vec![[0.0; 4]; crowd.output_len(CrowdValues::Model)];
            crowd
                .evaluate_into(CrowdValues::Model, &mut output)
                .unwrap();
            sum(&output)
        }),
    ]
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of tasks_of_a_callers_own_pool_may_call_everything_at_once"]
fn four_hundred_tasks() {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let mut options = EngineOptions::default();
    options.thread_count = Some(2);
    let mut engines = vec![Engine::with_options(Device::Cpu, &options).unwrap()];
    engines.extend(
        vulkan_devices()
            .into_iter()
            .map(|device| Engine::new(device).unwrap()),
    );
    let rates = 30..34;
    let expected = calls(&cpu);
    let expected: Vec<Vec<u64>> = expected
        .iter()
        .map(|call| rates.clone().map(call).collect())
        .collect();
    for engine in [cpu].iter().chain(&engines) {
        let calls = calls(engine);
        let task_of = |calls: &[Call], task: usize| {
            let (call, rate) = (task % calls.len(), task / calls.len() % rates.len());
            let found = calls[call](rates.start + rate as u32);
            let name = engine.device_name();
            assert_eq!(found, expected[call][rate], "call {call}, {name}");
        };
        let tasks = (0..400).into_par_iter();
        tasks.for_each(|task| task_of(&calls, task));
        // The engine's own threads may call the engine, too, but not with a lock around the call.
        let (_, unlocked) = calls.split_last().unwrap();
        tumble::on_threads(|| {
            let tasks = (0..100).into_par_iter();
            tasks.for_each(|task| task_of(unlocked, task));
        })
        .unwrap();
    }
    to_application_buffers();
}

/// Into an application's buffers, one for each task.
fn to_application_buffers() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let set = keys();
    let clip = engine.upload(&set, method::SLERP).unwrap();
    let expected = clip.evaluate(&SampleTimes::fps(40)).unwrap();
    let size = size_of_val(expected.as_quats()) as u64;
    let buffers: Vec<_> = (0..60).map(|_| application.buffer(size)).collect();
    let whole = |buffer| VulkanBuffer::new(buffer, size);
    buffers.par_iter().for_each(|&(buffer, _)| {
        let frames = SampleTimes::fps(40);
        // SAFETY: each buffer is the device's, has memory, and is this task's alone.
        unsafe { clip.request(&frames).to_buffer(whole(buffer)) }.unwrap();
    });
    for (_, memory) in &buffers {
        let expected: &[u8] = bytemuck::cast_slice(expected.as_quats());
        assert!(application.bytes(*memory, size) == expected);
    }
    drop((clip, engine));
    for (buffer, memory) in buffers {
        // SAFETY: nothing uses them any more.
        unsafe {
            application.device.destroy_buffer(buffer, None);
            application.device.free_memory(memory, None);
        }
    }
}

/// Work for one thread starts no others. Work for several is refused with an error, and a copy is made by one
/// thread. Address space for a thousand stacks is more than this process may have.
#[cfg(target_os = "linux")]
#[test]
fn threads_that_the_system_refuses_are_an_error() {
    let child_command = child("refused_threads");
    let mut command = Command::new("sh");
    command
        .args(["-c", "ulimit -v 2000000; exec \"$0\" \"$@\""])
        .arg(child_command.get_program())
        .args(child_command.get_args())
        .env("RAYON_NUM_THREADS", "1000");
    runs(command).unwrap();
}

/// The test above runs this in a separate process.
#[test]
#[ignore = "part of threads_that_the_system_refuses_are_an_error"]
fn refused_threads() {
    let engine = Engine::new(Device::Cpu).unwrap();
    let set = keys();
    let one = set.select([1]).unwrap();
    assert!(
        engine
            .evaluate(&one, method::SLERP, &SampleTimes::fps(10))
            .is_ok()
    );
    for _ in 0..2 {
        let refused = engine.evaluate(&set, method::SLERP, &SampleTimes::fps(60));
        let Err(Error::Threads(refused)) = refused else {
            panic!("a thousand threads");
        };
        assert_eq!(refused.count, 1000);
        assert!(refused.to_string().contains("RAYON_NUM_THREADS"));
    }
    // A small number of threads is granted nevertheless.
    let mut options = EngineOptions::default();
    options.thread_count = Some(2);
    // The thousand threads of the refused engine take a moment to end.
    let started = Instant::now();
    let engine = loop {
        match Engine::with_options(Device::Cpu, &options) {
            Ok(engine) => break engine,
            Err(error) => assert!(started.elapsed().as_secs() < 30, "{error}"),
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    assert!(
        engine
            .evaluate(&set, method::SLERP, &SampleTimes::fps(60))
            .is_ok()
    );
    options.thread_count = Some(1000);
    let refused = Engine::with_options(Device::Cpu, &options);
    assert!(matches!(refused, Err(Error::Threads(_))));
}
