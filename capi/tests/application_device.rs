//! Crowds and clips on an application's Vulkan device, through the functions that C has.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use std::ffi::{CStr, c_void};
use std::process::Command;
use std::ptr::{null, null_mut};
use std::sync::atomic::{AtomicUsize, Ordering};

use ash::vk::{self, Handle};
use tumble_capi::clip::*;
use tumble_capi::crowd::layer::TumbleCrowdLayer;
use tumble_capi::crowd::library::*;
use tumble_capi::crowd::output::*;
use tumble_capi::crowd::player::*;
use tumble_capi::crowd::stages::*;
use tumble_capi::crowd::target::*;
use tumble_capi::engine::*;
use tumble_capi::interpolation::*;
use tumble_capi::request::*;
use tumble_capi::result::*;
use tumble_capi::samples::*;
use tumble_capi::set::*;
use tumble_capi::timed::*;
use tumble_capi::vulkan::*;

use crate::application::{Application, Commands};
use crate::layer::Layer;
use crate::support::vulkan_devices;

const JOINTS: usize = 3;
const INSTANCES: usize = 33;
const FRAMES: usize = 3;

pub(crate) fn words() -> String {
    // SAFETY: text that ends with a zero.
    let words = unsafe { CStr::from_ptr(tumble_last_error()) };
    words.to_string_lossy().into_owned()
}

#[track_caller]
pub(crate) fn done(result: TumbleResult) {
    assert_eq!(result, TumbleResult::Ok, "{}", words());
}

#[track_caller]
pub(crate) fn fails(result: TumbleResult, code: TumbleResult, says: &str) {
    assert_eq!(result, code, "{}", words());
    assert!(words().contains(says), "{}", words());
}

/// The structure as an application in C fills it in.
pub(crate) fn handles(application: &Application) -> TumbleVulkan {
    let get = application.entry.static_fn().get_instance_proc_addr;
    TumbleVulkan {
        size: size_of::<TumbleVulkan>(),
        get_instance_proc_addr: Some(function(get)),
        instance: pointer(application.instance.handle()),
        physical_device: pointer(application.physical_device),
        device: pointer(application.device.handle()),
        queue: pointer(application.queue),
        queue_family: 0,
        api_version: vk::API_VERSION_1_1,
        shader_float_controls: 0,
        shader_int64: application.shader_int64.into(),
        copy_queue: (application.copy_queue).map_or(null_mut(), |queue| pointer(queue.queue)),
        copy_queue_family: application.copy_queue.map_or(0, |queue| queue.family),
        lock_queue: None,
        unlock_queue: None,
        queue_user: null_mut(),
        pipeline_cache: 0,
    }
}

/// How often a queue was locked, and unlocked.
#[derive(Default)]
struct Uses([AtomicUsize; 2]);

unsafe extern "C" fn lock_queue(user: *mut c_void) {
    // SAFETY: the pointer that the application passed with the function.
    let Uses([locked, unlocked]) = unsafe { &*user.cast() };
    let before = locked.fetch_add(1, Ordering::SeqCst);
    assert_eq!(
        before,
        unlocked.load(Ordering::SeqCst),
        "it is locked already"
    );
}

unsafe extern "C" fn unlock_queue(user: *mut c_void) {
    // SAFETY: as above.
    let Uses([_, unlocked]) = unsafe { &*user.cast() };
    unlocked.fetch_add(1, Ordering::SeqCst);
}

pub(crate) fn pointer(handle: impl Handle) -> *mut c_void {
    std::ptr::with_exposed_provenance_mut(handle.as_raw() as usize)
}

fn function(function: vk::PFN_vkGetInstanceProcAddr) -> unsafe extern "C" fn() {
    // SAFETY: pointers to functions have one size, and this one is cast back before it is called.
    unsafe { std::mem::transmute(function) }
}

pub(crate) fn open(vulkan: &TumbleVulkan, engine: &mut *mut TumbleEngine) -> TumbleResult {
    // SAFETY: a structure, and room for the handle.
    unsafe { tumble_engine_from_vulkan(vulkan, null(), engine) }
}

/// A library of one clip for a chain of joints.
fn library() -> *mut TumbleCrowdLibrary {
    let (mut library, mut set) = (null_mut(), null_mut());
    let (parents, offsets) = ([-1, 0, 1], [[0.0_f32, 1.0, 0.0]; JOINTS]);
    let times = [0.0, 0.5, 1.5];
    let keys: [[f32; 4]; 3] = [
        [0.0, 0.0, 0.0, 1.0],
        [0.6, 0.0, 0.0, 0.8],
        [0.0, 0.8, 0.0, 0.6],
    ];
    // SAFETY: as many numbers as stated, and room for handles.
    unsafe {
        let (parents, offsets) = (parents.as_ptr(), offsets.as_ptr().cast());
        done(tumble_crowd_library_new(
            parents,
            offsets,
            JOINTS,
            0,
            &raw mut library,
        ));
        done(tumble_set_new(&raw mut set));
        for _ in 0..JOINTS {
            done(tumble_set_push(
                set,
                null(),
                times.as_ptr(),
                keys.as_ptr().cast(),
                3,
            ));
        }
        done(tumble_crowd_library_push(
            library,
            set,
            null(),
            null(),
            null_mut(),
        ));
    }
    done(tumble_set_free(set));
    library
}

fn crowd(engine: *const TumbleEngine, library: *const TumbleCrowdLibrary) -> *mut TumbleCrowd {
    let mut crowd = null_mut();
    // SAFETY: room for the handle.
    done(unsafe { tumble_crowd_new(engine, library, INSTANCES, 1, &raw mut crowd) });
    crowd
}

/// Goes on to a frame, in which some do something new.
fn go_on(crowd: *mut TumbleCrowd, frame: usize) {
    let layers: Vec<TumbleCrowdLayer> = (0..INSTANCES)
        .filter(|instance| frame == 0 || instance.is_multiple_of(frame + 4))
        .map(|instance| TumbleCrowdLayer {
            size: size_of::<TumbleCrowdLayer>(),
            instance,
            layer: 0,
            clip: 0,
            time: instance as i64 * 40_000,
            speed: 0.5 + instance as f32 * 0.125,
            weight: 1.0,
            wrap: 1,
            additive: 0,
            mask: 0,
        })
        .collect();
    // SAFETY: as many structures as stated.
    done(unsafe { tumble_crowd_set(crowd, layers.as_ptr(), layers.len()) });
    done(tumble_crowd_advance(crowd, 1.0 / 60.0));
}

/// The bytes of a result in the caller's memory.
fn evaluated(crowd: *mut TumbleCrowd, values: u32, half: bool) -> Vec<u8> {
    let mut count = 0;
    // SAFETY: room for the number, and memory of that size.
    unsafe {
        done(tumble_crowd_output_count(crowd, values, &raw mut count));
        if half {
            let mut found = vec![u16::MAX; count];
            done(tumble_crowd_evaluate_half(
                crowd,
                values,
                found.as_mut_ptr(),
                count,
            ));
            bytemuck::cast_slice(&found).to_vec()
        } else {
            let mut found = vec![f32::NAN; count];
            done(tumble_crowd_evaluate(
                crowd,
                values,
                found.as_mut_ptr(),
                count,
            ));
            bytemuck::cast_slice(&found).to_vec()
        }
    }
}

fn target(
    crowd: *const TumbleCrowd,
    (values, half): (u32, bool),
    buffer: vk::Buffer,
    (offset, size): (u64, u64),
    target: &mut *mut TumbleCrowdTarget,
) -> TumbleResult {
    let buffer = buffer.as_raw();
    // SAFETY: the buffer is the application's, which frees the target first; room for the handle.
    unsafe { tumble_crowd_target_new(crowd, values, half.into(), buffer, offset, size, target) }
}

fn free_target(target: *mut TumbleCrowdTarget) -> TumbleResult {
    // SAFETY: nothing is in flight.
    unsafe { tumble_crowd_target_free(target) }
}

/// Several frames in flight, each into a buffer of its own: the bytes that the CPU gives.
#[test]
fn frames_are_recorded_into_an_applications_commands() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let library = library();
    let (mut engine, mut cpu) = (null_mut(), null_mut());
    done(open(&handles(&application), &mut engine));
    // SAFETY: text, null and room for the handle.
    done(unsafe { tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut cpu) });
    for output in [(0, false), (2, false), (2, true)] {
        let (recorded, expected) = (crowd(engine, library), crowd(cpu, library));
        let size = evaluated(expected, output.0, output.1).len() as u64;
        let commands = Commands::new(&application);
        let buffers = [0; FRAMES].map(|_| application.buffer(256 + size));
        let mut targets = [null_mut(); FRAMES];
        for (slot, &(buffer, _)) in targets.iter_mut().zip(&buffers) {
            for wrong in [(16, size), (256, size - 1)] {
                let made = target(recorded, output, buffer, wrong, slot);
                fails(made, TumbleResult::WrongSize, "does not fit");
            }
            done(target(recorded, output, buffer, (256, size), slot));
        }
        let (mut frames, mut expected_bits) = (Vec::new(), Vec::new());
        for (frame, &target) in targets.iter().enumerate() {
            go_on(recorded, frame);
            go_on(expected, frame);
            frames.push(commands.recorded(|commands| {
                // SAFETY: the commands are in recording, and submitted below in this order.
                done(unsafe { tumble_crowd_record(recorded, target, pointer(commands)) });
            }));
            expected_bits.push(evaluated(expected, output.0, output.1));
        }
        commands.run(&frames);
        for (&(_, memory), expected_frame) in buffers.iter().zip(&expected_bits) {
            let found = application.bytes(memory, 256 + size);
            assert!(found[256..] == *expected_frame, "{output:?}");
        }
        // The engine can also write into the host's memory.
        assert!(evaluated(recorded, output.0, output.1) == expected_bits[FRAMES - 1]);
        // A frame that is thrown away is reported to the crowd.
        let last = FRAMES;
        go_on(recorded, last);
        go_on(expected, last);
        // SAFETY: thrown away; then submitted below.
        unsafe {
            let record =
                |commands| done(tumble_crowd_record(recorded, targets[0], pointer(commands)));
            commands.recorded(record);
            done(tumble_crowd_forget_recorded(recorded));
            commands.run(&[commands.recorded(record)]);
        }
        let found = application.bytes(buffers[0].1, 256 + size);
        assert!(
            found[256..] == evaluated(expected, output.0, output.1),
            "{output:?}"
        );

        // Refused: a target of another crowd, a null command buffer, and a target that was freed.
        let other = crowd(engine, library);
        // SAFETY: nothing is recorded.
        unsafe {
            let commands = pointer(frames[0]);
            let refused = tumble_crowd_record(other, targets[0], commands);
            fails(
                refused,
                TumbleResult::InvalidArgument,
                "the target was made by another crowd",
            );
            let refused = tumble_crowd_record(recorded, targets[0], null_mut());
            fails(refused, TumbleResult::InvalidPointer, "`commands` is null");
            done(free_target(targets[0]));
            let refused = tumble_crowd_record(recorded, targets[0], commands);
            fails(
                refused,
                TumbleResult::InvalidHandle,
                "this crowd target was freed",
            );
        }
        fails(
            free_target(targets[0]),
            TumbleResult::InvalidHandle,
            "was freed",
        );
        let mut none = null_mut();
        let made = target(recorded, output, vk::Buffer::null(), (256, size), &mut none);
        fails(made, TumbleResult::InvalidPointer, "VK_NULL_HANDLE");
        for &target in &targets[1..] {
            done(free_target(target));
        }
        for crowd in [recorded, expected, other] {
            done(tumble_crowd_free(crowd));
        }
        for (buffer, memory) in buffers {
            // SAFETY: nothing is in flight.
            unsafe {
                application.device.destroy_buffer(buffer, None);
                application.device.free_memory(memory, None);
            }
        }
    }
    done(tumble_crowd_library_free(library));
    done(tumble_engine_free(cpu));
    done(tumble_engine_free(engine));
}

/// Commands that evaluate local matrices and continue them to model matrices: the bytes that the CPU gives.
#[test]
fn stages_are_recorded_into_an_applications_commands() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let library = library();
    let (mut engine, mut cpu) = (null_mut(), null_mut());
    done(open(&handles(&application), &mut engine));
    // SAFETY: text, null and room for the handle.
    done(unsafe { tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut cpu) });
    let (recorded, expected) = (crowd(engine, library), crowd(cpu, library));
    let (local, model) = (
        TumbleCrowdValues::Local as u32,
        TumbleCrowdValues::Model as u32,
    );
    go_on(recorded, 0);
    go_on(expected, 0);
    let expected_bits = evaluated(expected, model, false);
    let size = expected_bits.len() as u64;
    // The stage on the host.
    let mut poses: Vec<f32> = bytemuck::pod_collect_to_vec(&evaluated(expected, local, false));
    let count = poses.len();
    let on_host = |poses: &mut [f32], count| {
        let poses = poses.as_mut_ptr();
        // SAFETY: at least as many floats, or the call is refused.
        unsafe { tumble_crowd_library_local_to_model(library, poses, count) }
    };
    done(on_host(&mut poses, count));
    assert!(bytemuck::cast_slice::<f32, u8>(&poses) == expected_bits);
    let part = on_host(&mut poses, count - 1);
    fails(part, TumbleResult::WrongSize, "no multiple of 36");
    // SAFETY: as many floats.
    let unbound =
        unsafe { tumble_crowd_library_model_to_skinning(library, poses.as_mut_ptr(), count) };
    fails(
        unbound,
        TumbleResult::WrongState,
        "no inverse bind matrices",
    );
    let (buffer, memory) = application.buffer(size);
    let [mut evaluation, mut stage] = [null_mut(); 2];
    done(target(
        recorded,
        (local, false),
        buffer,
        (0, size),
        &mut evaluation,
    ));
    let stage_target = |stage: u32, size: u64, made: &mut *mut TumbleCrowdTarget| {
        let buffer = buffer.as_raw();
        // SAFETY: as for `target`.
        unsafe { tumble_crowd_stage_target_new(recorded, stage, buffer, 0, size, made) }
    };
    let argument = TumbleResult::InvalidArgument;
    fails(stage_target(3, size, &mut stage), argument, "`stage` is 3");
    let wrong = TumbleResult::WrongSize;
    fails(stage_target(0, size - 1, &mut stage), wrong, "does not fit");
    let state = TumbleResult::WrongState;
    let skinning = TumbleCrowdStage::LocalToSkinning as u32;
    let unbound = stage_target(skinning, size, &mut stage);
    fails(unbound, state, "no inverse bind matrices");
    let to_model = TumbleCrowdStage::LocalToModel as u32;
    done(stage_target(to_model, size, &mut stage));
    let commands = Commands::new(&application);
    let frame = commands.recorded(|commands| {
        for target in [evaluation, stage] {
            // SAFETY: the commands are in recording, and submitted below.
            done(unsafe { tumble_crowd_record(recorded, target, pointer(commands)) });
        }
    });
    commands.run(&[frame]);
    assert!(application.bytes(memory, size) == expected_bits);
    // Barriers only for the commands that are named.
    let between = |target, commands, before, after| {
        // SAFETY: the commands are in recording, and submitted below, or the call is refused.
        unsafe { tumble_crowd_record_between(recorded, target, commands, before, after) }
    };
    let [any, kernels] =
        [TumbleCommandUsers::Any, TumbleCommandUsers::Kernels].map(|users| users as u32);
    let frame = commands.recorded(|commands| {
        let commands = pointer(commands);
        let unknown = between(evaluation, commands, any, 6);
        fails(unknown, argument, "`after` is 6; its constants are 0 to 5");
        done(between(evaluation, commands, any, kernels));
        done(between(stage, commands, kernels, any));
    });
    commands.run(&[frame]);
    assert!(application.bytes(memory, size) == expected_bits);
    for target in [evaluation, stage] {
        done(free_target(target));
    }
    for crowd in [recorded, expected] {
        done(tumble_crowd_free(crowd));
    }
    done(tumble_crowd_library_free(library));
    done(tumble_engine_free(cpu));
    done(tumble_engine_free(engine));
    // SAFETY: nothing is in flight.
    unsafe {
        application.device.destroy_buffer(buffer, None);
        application.device.free_memory(memory, None);
    }
}

/// A clip's rotations stay on the device.
#[test]
fn clips_are_evaluated_into_an_applications_buffer() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let (mut set, times) = (null_mut(), [0.0, 1.0]);
    let keys = [[0.0_f32, 0.0, 0.0, 1.0], [0.0, 0.6, 0.0, 0.8]];
    let samples = TumbleSamples {
        size: size_of::<TumbleSamples>(),
        sampling: TumbleSampling::Keys as u32,
        rate_frames: 60,
        rate_seconds: 1,
        start: 0.0,
        end: 0.0,
        times: null(),
        time_count: 0,
    };
    const SIZE: u64 = 61 * 16;
    let mut engines = [null_mut(); 2];
    let mut clips = [null_mut(); 2];
    done(open(&handles(&application), &mut engines[0]));
    let mut expected = [f32::NAN; 61 * 4];
    // SAFETY: as many numbers as stated, text, null, a structure, and room for handles.
    unsafe {
        done(tumble_engine_open(
            c"cpu".as_ptr(),
            null(),
            &raw mut engines[1],
        ));
        let (times, keys) = (times.as_ptr(), keys.as_ptr().cast());
        done(tumble_set_with_shared_times(
            times,
            2,
            keys,
            1,
            &raw mut set,
        ));
        for (engine, clip) in engines.iter().zip(&mut clips) {
            done(tumble_upload(*engine, set, null(), clip));
        }
        let (into, count) = (expected.as_mut_ptr(), expected.len());
        done(tumble_clip_evaluate(
            clips[1],
            &raw const samples,
            0,
            into,
            count,
        ));
    }
    let (buffer, memory) = application.buffer(16 + SIZE);
    let evaluate = |clip, buffer: u64, offset, size| {
        let samples = &raw const samples;
        // SAFETY: the buffer is the application's, or is refused.
        unsafe { tumble_clip_evaluate_to_buffer(clip, samples, 0, buffer, offset, size) }
    };
    let raw = buffer.as_raw();
    let argument = TumbleResult::InvalidArgument;
    fails(
        evaluate(clips[1], raw, 16, SIZE),
        argument,
        "tumble_engine_from_vulkan",
    );
    fails(
        evaluate(clips[0], 0, 16, SIZE),
        TumbleResult::InvalidPointer,
        "VK_NULL_HANDLE",
    );
    for (offset, size) in [(8, SIZE), (16, SIZE - 1)] {
        let refused = evaluate(clips[0], raw, offset, size);
        fails(refused, TumbleResult::WrongSize, "the result has 976 bytes");
    }
    done(evaluate(clips[0], raw, 16, SIZE));
    let found = application.bytes(memory, 16 + SIZE);
    assert!(found[16..] == *bytemuck::cast_slice::<_, u8>(&expected));
    for (engine, clip) in engines.into_iter().zip(clips) {
        done(tumble_clip_free(clip));
        done(tumble_engine_free(engine));
    }
    done(tumble_set_free(set));
    // SAFETY: nothing is in flight.
    unsafe {
        application.device.destroy_buffer(buffer, None);
        application.device.free_memory(memory, None);
    }
}

/// A set of three tracks that turn differently.
fn turning_set() -> *mut TumbleSet {
    let mut set = null_mut();
    // SAFETY: as many numbers as stated, and room for the handle.
    unsafe {
        done(tumble_set_new(&raw mut set));
        for track in 1..=3 {
            let times: [f64; 5] = std::array::from_fn(|key| 0.25 * key as f64 * f64::from(track));
            let keys: [[f32; 4]; 5] = [
                [0.0, 0.0, 0.0, 1.0],
                [0.6, 0.0, 0.0, 0.8],
                [0.36, 0.48, 0.0, 0.8],
                [0.0, 0.8, 0.0, 0.6],
                [0.0, 0.0, -0.28, 0.96],
            ];
            let keys: [[f32; 4]; 5] = std::array::from_fn(|key| keys[key * track as usize % 5]);
            let (times, keys) = (times.as_ptr(), keys.as_ptr().cast());
            done(tumble_set_push(set, null(), times, keys, 5));
        }
    }
    set
}

/// A request's bytes in the caller's memory.
fn requested(clip: *const TumbleClip, request: &TumbleRequest) -> Vec<u8> {
    let mut bytes = 0;
    // SAFETY: a structure, room for the number, and memory of that size.
    unsafe {
        done(tumble_request_bytes(clip, request, &raw mut bytes));
        let mut found = vec![0xff_u8; bytes];
        let output = found.as_mut_ptr().cast();
        done(tumble_request_evaluate(clip, request, output, bytes));
        found
    }
}

/// Requests of a clip, recorded into an application's commands in every encoding, give the CPU's bytes.
#[test]
fn clips_are_recorded_into_an_applications_commands() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let commands = Commands::new(&application);
    let set = turning_set();
    let samples = TumbleSamples {
        size: size_of::<TumbleSamples>(),
        sampling: TumbleSampling::Range as u32,
        rate_frames: 60,
        rate_seconds: 1,
        start: -0.25,
        end: 3.5,
        times: null(),
        time_count: 0,
    };
    let whole = TumbleRequest {
        size: size_of::<TumbleRequest>(),
        samples: &raw const samples,
        layout: 0,
        matrix_order: 0,
        encoding: null(),
        sequence: null(),
        first_track: 0,
        track_count: 0,
        first_sample: 0,
        sample_count: 0,
    };
    let (mut engine, mut cpu) = (null_mut(), null_mut());
    done(open(&handles(&application), &mut engine));
    // SAFETY: text, null and room for the handle.
    done(unsafe { tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut cpu) });
    let upload = |engine, interpolation| {
        let mut clip = null_mut();
        // SAFETY: a structure, and room for the handle.
        done(unsafe { tumble_upload(engine, set, interpolation, &raw mut clip) });
        clip
    };
    let mut requests = Vec::new();
    for index in 0..tumble_encoding_count() {
        let encoding = tumble_encoding_name(index);
        requests.push(TumbleRequest {
            encoding,
            layout: index as u32 % 2,
            ..whole
        });
        requests.push(TumbleRequest {
            encoding,
            matrix_order: 1,
            sequence: c"zxz".as_ptr(),
            first_track: 1,
            track_count: 1,
            first_sample: 20,
            ..whole
        });
    }
    assert!(requests.len() >= 16 && tumble_encoding_name(requests.len() / 2).is_null());
    let target = |clip, request: &TumbleRequest, buffer: vk::Buffer, (offset, size)| {
        let mut target = null_mut();
        let buffer = buffer.as_raw();
        // SAFETY: the buffer is the application's, which frees the target first; room for the handle.
        let made =
            unsafe { tumble_clip_target_new(clip, request, buffer, offset, size, &raw mut target) };
        (made, target)
    };
    let record = |target, commands, offset| {
        // SAFETY: the commands are in recording, or the call is refused before they are used.
        unsafe { tumble_clip_record(target, commands, offset) }
    };
    let free = |target| {
        // SAFETY: nothing is in flight.
        unsafe { tumble_clip_target_free(target) }
    };
    for name in [c"slerp", c"bessel-overhauser"] {
        let interpolation = TumbleInterpolation {
            size: size_of::<TumbleInterpolation>(),
            method: name.as_ptr(),
            // SAFETY: numbers and null are zeros.
            ..unsafe { std::mem::zeroed() }
        };
        let recorded = upload(engine, &raw const interpolation);
        let expected = upload(cpu, &raw const interpolation);
        for request in &requests {
            let expected = requested(expected, request);
            assert!(requested(recorded, request) == expected);
            let size = expected.len() as u64;
            // Divisible by the size of a value in every encoding.
            const VALUES: u64 = 144;
            let second = size.next_multiple_of(VALUES);
            let (buffer, memory) = application.buffer(VALUES + second + size);
            let (made, target) = target(recorded, request, buffer, (VALUES, second + size));
            done(made);
            let all = commands.recorded(|commands| {
                done(record(target, pointer(commands), 0));
                done(record(target, pointer(commands), second));
            });
            // Recorded commands may be submitted again.
            commands.run(&[all]);
            commands.run(&[all]);
            let found = application.bytes(memory, VALUES + second + size);
            let (first, behind) = found[VALUES as usize..].split_at(second as usize);
            assert!(first[..expected.len()] == expected && behind == expected);
            done(free(target));
            // SAFETY: nothing is in flight.
            unsafe {
                application.device.destroy_buffer(buffer, None);
                application.device.free_memory(memory, None);
            }
        }
        record_at_new_times(&application, recorded, expected);
        done(tumble_clip_free(recorded));
        done(tumble_clip_free(expected));
    }

    // Refused: ranges that are too short, and null buffers, structures and handles.
    let (clip, of_cpu) = (upload(engine, null()), upload(cpu, null()));
    let size = requested(of_cpu, &whole).len() as u64;
    let (buffer, memory) = application.buffer(16 + size);
    let fits = (16, size);
    for wrong in [(8, size), (16, size - 1)] {
        fails(
            target(clip, &whole, buffer, wrong).0,
            TumbleResult::WrongSize,
            "does not fit",
        );
    }
    let argument = TumbleResult::InvalidArgument;
    let (made, _) = target(of_cpu, &whole, buffer, fits);
    fails(made, argument, "tumble_engine_from_vulkan");
    let (made, _) = target(clip, &whole, vk::Buffer::null(), fits);
    fails(made, TumbleResult::InvalidPointer, "VK_NULL_HANDLE");
    for (wrong, code, says) in [
        (
            TumbleRequest { size: 8, ..whole },
            argument,
            "set it to `sizeof`",
        ),
        (
            TumbleRequest {
                samples: null(),
                ..whole
            },
            TumbleResult::InvalidPointer,
            "`samples` is null",
        ),
        (
            TumbleRequest {
                encoding: c"f64".as_ptr(),
                ..whole
            },
            argument,
            "`request->encoding`: there is no encoding `f64`; there are f32, f16",
        ),
        (
            TumbleRequest {
                sequence: c"XXY".as_ptr(),
                ..whole
            },
            argument,
            "`request->sequence`: `XXY` is not a sequence",
        ),
        (
            TumbleRequest {
                matrix_order: 2,
                ..whole
            },
            argument,
            "`request->matrix_order` is 2",
        ),
        (
            TumbleRequest { layout: 2, ..whole },
            argument,
            "`layout` is 2",
        ),
        (
            TumbleRequest {
                first_track: 3,
                track_count: 1,
                ..whole
            },
            TumbleResult::OutOfRange,
            "tracks 3..4",
        ),
        (
            TumbleRequest {
                first_sample: 1,
                sample_count: usize::MAX,
                ..whole
            },
            TumbleResult::OutOfRange,
            "samples 1..",
        ),
    ] {
        fails(target(clip, &wrong, buffer, fits).0, code, says);
    }
    let (made, good) = target(clip, &whole, buffer, fits);
    done(made);
    fails(
        record(good, null_mut(), 0),
        TumbleResult::InvalidPointer,
        "`commands` is null",
    );
    commands.recorded(|commands| {
        for offset in [8, 16] {
            let refused = record(good, pointer(commands), offset);
            fails(refused, TumbleResult::WrongSize, "does not fit");
        }
    });
    let mut output = [0_u8; 15];
    // SAFETY: `output` has as many bytes as are passed.
    let refused =
        unsafe { tumble_request_evaluate(clip, &raw const whole, output.as_mut_ptr().cast(), 15) };
    fails(refused, TumbleResult::WrongSize, "the output has 15 bytes");
    // A target needs neither its clip nor its engine.
    for clip in [clip, of_cpu] {
        done(tumble_clip_free(clip));
    }
    done(tumble_engine_free(engine));
    commands.run(&[commands.recorded(|commands| done(record(good, pointer(commands), 0)))]);
    done(free(good));
    fails(
        free(good),
        TumbleResult::InvalidHandle,
        "this clip target was freed",
    );
    fails(
        record(good, pointer(vk::CommandBuffer::from_raw(8)), 0),
        TumbleResult::InvalidHandle,
        "was freed",
    );
    done(tumble_engine_free(cpu));
    done(tumble_set_free(set));
    // SAFETY: nothing is in flight.
    unsafe {
        application.device.destroy_buffer(buffer, None);
        application.device.free_memory(memory, None);
    }
}

/// The loader and the instance are asked whether handles belong to each other, as far as they know.
/// A clip at a new time in each frame, recorded without a submission, has the bits of listed times.
fn record_at_new_times(
    application: &Application,
    recorded: *const TumbleClip,
    expected: *const TumbleClip,
) {
    let listed = |times: &[f64]| TumbleSamples {
        size: size_of::<TumbleSamples>(),
        sampling: TumbleSampling::Times as u32,
        times: times.as_ptr(),
        time_count: times.len(),
        // SAFETY: numbers and null are zeros.
        ..unsafe { std::mem::zeroed() }
    };
    let request = |samples: &TumbleSamples| TumbleRequest {
        size: size_of::<TumbleRequest>(),
        samples,
        // SAFETY: numbers and null are zeros.
        ..unsafe { std::mem::zeroed() }
    };
    let some_time = listed(&[0.0]);
    let times = [0.3, 1.25, -4.0];
    let bits = times.map(|time| requested(expected, &request(&listed(&[time]))));
    let size = bits[0].len() as u64;
    let (buffer, memory) = application.buffer(3 * size);
    let mut target = null_mut();
    let (one_sample, handle) = (request(&some_time), buffer.as_raw());
    // SAFETY: the buffer is the application's, which frees the target first; room for the handle.
    done(unsafe {
        tumble_timed_target_new(
            recorded,
            &raw const one_sample,
            handle,
            0,
            3 * size,
            &raw mut target,
        )
    });
    let record = |commands, offset, times: &[f64]| {
        // SAFETY: the commands are in recording, or the call is refused before they are used.
        unsafe { tumble_timed_target_record(target, commands, offset, times.as_ptr(), times.len()) }
    };
    let commands = Commands::new(application);
    let all = commands.recorded(|commands| {
        let commands = pointer(commands);
        let two = record(commands, 0, &[0.0, 1.0]);
        fails(two, TumbleResult::InvalidInput, "2");
        let infinite = record(commands, 0, &[f64::INFINITY]);
        fails(infinite, TumbleResult::InvalidInput, "inf");
        let too_late = record(commands, 3 * size, &[0.0]);
        fails(too_late, TumbleResult::WrongSize, "does not fit");
        for (frame, time) in (0_u64..).zip(times) {
            done(record(commands, frame * size, &[time]));
        }
    });
    commands.run(&[all]);
    assert!(application.bytes(memory, 3 * size) == bits.concat());
    // SAFETY: nothing is in flight.
    unsafe {
        done(tumble_timed_target_free(target));
        application.device.destroy_buffer(buffer, None);
        application.device.free_memory(memory, None);
    }
}

#[test]
fn handles_that_do_not_belong_together_are_refused() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let good = handles(&application);
    let mut engine = null_mut();
    unsafe extern "system" fn knows_none(
        _: vk::Instance,
        _: *const std::ffi::c_char,
    ) -> vk::PFN_vkVoidFunction {
        None
    }
    let argument = TumbleResult::InvalidArgument;
    let pointer = TumbleResult::InvalidPointer;
    let none = null_mut();
    let family = TumbleVulkan {
        queue_family: 99,
        ..good
    };
    let copies = TumbleVulkan {
        copy_queue: good.queue,
        copy_queue_family: 98,
        ..good
    };
    let device = TumbleVulkan {
        physical_device: std::ptr::without_provenance_mut(16),
        ..good
    };
    let version = TumbleVulkan {
        api_version: vk::API_VERSION_1_0,
        ..good
    };
    let functions = TumbleVulkan {
        get_instance_proc_addr: Some(function(knows_none)),
        ..good
    };
    let truth = TumbleVulkan {
        shader_int64: 2,
        ..good
    };
    let controls = TumbleVulkan {
        shader_float_controls: 7,
        ..good
    };
    for (wrong, code, says) in [
        (
            family,
            argument,
            "the queue is of family 99, which cannot compute; the device has",
        ),
        (
            copies,
            argument,
            "the queue is of family 98, which cannot copy",
        ),
        (device, argument, "is none of the"),
        (
            version,
            argument,
            "`api_version` is 4194304, Vulkan 1.0; give the version for which the instance was made",
        ),
        (
            functions,
            argument,
            "does not know vkEnumeratePhysicalDevices",
        ),
        (truth, argument, "`vulkan->shader_int64` is 2"),
        (
            TumbleVulkan {
                lock_queue: Some(lock_queue),
                ..good
            },
            argument,
            "`vulkan->lock_queue` and `vulkan->unlock_queue` belong together",
        ),
        (
            TumbleVulkan {
                copy_queue: good.queue,
                copy_queue_family: good.queue_family,
                ..good
            },
            argument,
            "the copy queue is the compute queue",
        ),
        (controls, argument, "`vulkan->shader_float_controls` is 7"),
        (
            TumbleVulkan {
                instance: none,
                ..good
            },
            pointer,
            "`vulkan->instance` is null",
        ),
        (
            TumbleVulkan {
                device: none,
                ..good
            },
            pointer,
            "`vulkan->device` is null",
        ),
        (
            TumbleVulkan {
                queue: none,
                ..good
            },
            pointer,
            "`vulkan->queue` is null",
        ),
        (
            TumbleVulkan { size: 8, ..good },
            argument,
            "set it to `sizeof`",
        ),
    ] {
        fails(open(&wrong, &mut engine), code, says);
        assert!(engine.is_null());
    }
    done(open(&good, &mut engine));
    done(tumble_engine_free(engine));
    let uses = Uses::default();
    let locked = TumbleVulkan {
        lock_queue: Some(lock_queue),
        unlock_queue: Some(unlock_queue),
        queue_user: (&raw const uses).cast_mut().cast(),
        ..good
    };
    done(open(&locked, &mut engine));
    done(tumble_engine_free(engine));
    let [locked, unlocked] = uses.0.map(AtomicUsize::into_inner);
    assert!(locked > 0 && locked == unlocked, "{locked}, {unlocked}");
}

/// The tests of this file once more, under the validation layers.
#[test]
fn no_layer_has_anything_to_say() {
    for layer in Layer::all() {
        let mut command = Command::new(std::env::current_exe().unwrap());
        command.args([
            "application_device::",
            "passes::",
            "--nocapture",
            "--skip",
            "no_layer_has",
        ]);
        let messages = layer.messages(&mut command);
        assert_eq!(messages, Vec::<String>::new(), "{}", layer.name);
    }
}
