//! Passes from buffer to buffer on an application's device: the bits of passes over results.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use glam::{Quat, Vec3};
use tumble::ash::vk;
use tumble::vulkan::tuning::Mapping;
use tumble::vulkan::{PassTarget, PosePass, VulkanBuffer};
use tumble::{
    Device, Engine, Error, Layout, PassOperand, PoseError, Rotations, SampleTimes, Skeleton, method,
};

use super::layers;
use crate::application::{Application, ApplicationBuffer, Commands};
use crate::support::{Random, hostile_set, vulkan_devices};

const TRACKS: usize = 64;

/// Bytes beside each result, which must stay as they are.
const BESIDE: u64 = 256;

fn references() -> Vec<Quat> {
    let mut random = Random(8);
    (0..TRACKS).map(|_| random.rotation().as_quat()).collect()
}

/// Branches, and three roots.
fn skeleton() -> Skeleton {
    let parents = (0..TRACKS).map(|track| track.checked_sub(1 + track % 3));
    let offsets = (0..TRACKS).map(|track| Vec3::new(0.1, track as f32, -1.0));
    Skeleton::new(parents.collect(), offsets.collect()).unwrap()
}

/// The CPU's results of the passes of a test, one after another, with these weights.
fn expected(layers: &[Rotations], layout: Layout, weights: [f32; 3], mix: f32) -> Vec<Vec<u8>> {
    let cpu = Engine::new(Device::Cpu).unwrap();
    let [first, second, third] = layers else {
        panic!("three layers");
    };
    let [a, b, c] = weights;
    let mixed = cpu.mix(first, second, mix).unwrap();
    let results = [
        cpu.blend(&[(first, a), (second, b), (third, c)]),
        cpu.blend(&[(third, a), (first, b)]),
        cpu.add(first, second, &references(), mix),
    ];
    let mut all: Vec<Vec<u8>> = results
        .into_iter()
        .map(|result| bytemuck::cast_slice(result.unwrap().as_quats()).to_vec())
        .collect();
    all.push(bytemuck::cast_slice(mixed.as_quats()).to_vec());
    if layout == Layout::FrameMajor {
        let world = cpu.world(&mixed, &skeleton()).unwrap();
        all.push(bytemuck::cast_slice(world.as_slice()).to_vec());
    }
    all
}

/// Clips are evaluated, their poses blended, added and mixed, and the skeleton walked, in one command buffer: on
/// the device alone, with other weights in other commands, submitted as often as an application likes.
#[test]
fn recorded_passes_give_the_bits_of_those_over_results() {
    if vulkan_devices().is_empty() {
        return;
    }
    let frames = SampleTimes::fps(30).between(0.0, 5.0);
    let (references, skeleton) = (references(), skeleton());
    for application in Application::all() {
        let engine = application.engine(Mapping::Automatic);
        for layout in [Layout::TrackMajor, Layout::FrameMajor] {
            let layers = layers(layout);
            let samples = layers[0].sample_count();
            let size = (TRACKS * samples * 16) as u64;
            // The inputs are one after another, from an offset on that kernels can bind.
            let inputs =
                ApplicationBuffer::of(&application, &vec![0; (BESIDE + 3 * size) as usize]);
            let layer = |index: u64| inputs.range(BESIDE + index * size, size);
            let clips: Vec<_> = [method::SLERP, method::BESSEL_OVERHAUSER, method::STEP]
                .into_iter()
                .zip(0..)
                .map(|(method, seed)| engine.upload(&hostile_set(seed, TRACKS), method).unwrap())
                .collect();
            let evaluate: Vec<_> = (clips.iter().zip(0..))
                .map(|(clip, index)| {
                    let request = clip.request(&frames).layout(layout);
                    // SAFETY: the buffer is as it must be, and outlives the target.
                    unsafe { request.target(layer(index)) }.unwrap()
                })
                .collect();
            let expected = [
                expected(&layers, layout, [0.5, 0.3, 0.4], 0.25),
                expected(&layers, layout, [-1.0, 0.0, 2.5], 1.0),
            ];
            let stride = 2 * size + BESIDE;
            let results = vec![0xff; BESIDE as usize + expected[0].len() * stride as usize];
            let results = ApplicationBuffer::of(&application, &results);
            let result = |index: u64| results.range(BESIDE + index * stride, size);
            let [weights, mix] = [[0.5, 0.3, 0.4], [0.25; 3]];
            let [a, b, c] = weights;
            let mixed = result(3);
            let in_order = [(layer(0), a), (layer(1), b), (layer(2), c)];
            let backwards = [(layer(2), a), (layer(0), b)];
            let mut passes = vec![
                PosePass::Blend { layers: &in_order },
                PosePass::Blend { layers: &backwards },
                PosePass::Add {
                    base: layer(0),
                    layer: layer(1),
                    reference: &references,
                    weight: mix[0],
                },
                PosePass::Mix {
                    from: layer(0),
                    to: layer(1),
                    weight: mix[0],
                },
            ];
            if layout == Layout::FrameMajor {
                passes.push(PosePass::World {
                    local: mixed,
                    skeleton: &skeleton,
                });
            }
            let mut targets: Vec<PassTarget> = (passes.into_iter().zip(0..))
                .map(|(pass, index)| {
                    let request = engine.pass(pass, TRACKS, samples, layout);
                    let range = results.range(result(index).offset, request.bytes());
                    // SAFETY: the buffers are as they must be, and outlive the target.
                    let target = unsafe { request.target(range) }.unwrap();
                    assert_eq!(target.bytes(), request.bytes());
                    target
                })
                .collect();
            let commands = Commands::new(&application);
            let first = commands.recorded(|command_buffer| {
                // SAFETY: the commands are in recording, and the targets outlive them.
                unsafe {
                    for target in &evaluate {
                        target.record(command_buffer, 0).unwrap();
                    }
                    for target in &targets {
                        target.record(command_buffer);
                    }
                }
            });
            for (target, weights) in
                targets
                    .iter_mut()
                    .zip([&[-1.0, 0.0, 2.5][..], &[-1.0, 0.0], &[1.0], &[1.0], &[]])
            {
                target.set_weights(weights).unwrap();
            }
            let second = commands.recorded(|command_buffer| {
                for target in &targets {
                    // SAFETY: as above.
                    unsafe { target.record(command_buffer) };
                }
            });
            let runs: [(&[vk::CommandBuffer], usize); 4] = [
                (&[first], 0),
                (&[second], 1),
                (&[second, first], 0),
                (&[first, second], 1),
            ];
            for (run, weights) in runs {
                commands.run(run);
                let found = results.bytes();
                let mut end = 0;
                for (pass, expected) in expected[weights].iter().enumerate() {
                    let start = BESIDE as usize + pass * stride as usize;
                    assert!(found[end..start].iter().all(|&byte| byte == 0xff));
                    end = start + expected.len();
                    assert!(found[start..end] == *expected, "{layout:?}, pass {pass}");
                }
                assert!(found[end..].iter().all(|&byte| byte == 0xff));
            }
        }
    }
}

/// So many poses that they are added in two windows, the last of which is shorter; and blends of layers in
/// several buffers, where no kernel could bind them.
#[test]
fn long_passes_run_at_once() {
    if vulkan_devices().is_empty() {
        return;
    }
    const LONG_TRACKS: usize = 5;
    let cpu = Engine::new(Device::Cpu).unwrap();
    let frames = SampleTimes::fps(2640).between(0.0, 5.0);
    let [first, second] = [7, 8].map(|seed| {
        let set = hostile_set(seed, LONG_TRACKS);
        let request = cpu.request(&set, method::SLERP, &frames);
        request.layout(Layout::FrameMajor).evaluate().unwrap()
    });
    let samples = first.sample_count();
    let size = first.as_quats().len() * 16;
    assert!(size > 16 << 16, "{size} bytes are one window");
    let references = &references()[..LONG_TRACKS];
    for application in Application::all() {
        let engine = application.engine(Mapping::Automatic);
        // There are 16 unused bytes before the second.
        let bytes = |result: &Rotations| bytemuck::cast_slice::<_, u8>(result.as_quats()).to_vec();
        let one = ApplicationBuffer::of(&application, &bytes(&first));
        let other = ApplicationBuffer::of(&application, &[vec![7; 16], bytes(&second)].concat());
        let result = ApplicationBuffer::of(&application, &vec![0xff; size + 256]);
        let (whole, size) = (result.range(0, size as u64 + 256), size as u64);
        let pass = |pass| {
            let request = engine.pass(pass, LONG_TRACKS, samples, Layout::FrameMajor);
            // SAFETY: the buffers are as they must be, and nothing uses them meanwhile.
            unsafe { request.to_buffer(whole) }.unwrap();
            let found = result.bytes();
            assert!(found[size as usize..].iter().all(|&byte| byte == 0xff));
            found[..size as usize].to_vec()
        };
        let (first_range, second_range) = (one.range(0, size), other.range(16, size));
        let layers = [(first_range, 0.6), (second_range, 0.5)];
        let blended = pass(PosePass::Blend { layers: &layers });
        let expected = cpu.blend(&[(&first, 0.6), (&second, 0.5)]).unwrap();
        assert!(blended == bytes(&expected));
        let aligned = ApplicationBuffer::of(&application, &bytes(&second));
        let added = pass(PosePass::Add {
            base: first_range,
            layer: aligned.range(0, size),
            reference: references,
            weight: 0.7,
        });
        let expected = cpu.add(&first, &second, references, 0.7).unwrap();
        assert!(added == bytes(&expected));
    }
}

#[test]
fn what_does_not_fit_buffers_is_refused() {
    let nothing = VulkanBuffer::new(vk::Buffer::null(), u64::MAX / 2);
    let mix = |from, to, weight| PosePass::Mix { from, to, weight };
    let refused = |engine: &Engine, pass: PosePass<'_>, layout, result| {
        let request = engine.pass(pass, TRACKS, 4, layout);
        // SAFETY: a refused buffer is not used.
        unsafe { request.target(result) }.unwrap_err()
    };
    let frame_major = Layout::FrameMajor;
    let cpu = Engine::new(Device::Cpu).unwrap();
    let error = refused(&cpu, mix(nothing, nothing, 0.5), frame_major, nothing);
    assert!(matches!(error, Error::BufferOnCpu), "{error}");
    let Some(device) = vulkan_devices().into_iter().next() else {
        return;
    };
    let opened = Engine::new(device).unwrap();
    let error = refused(&opened, mix(nothing, nothing, 0.5), frame_major, nothing);
    assert!(matches!(error, Error::BufferOfOther), "{error}");

    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let size = (TRACKS * 4 * 16) as u64;
    let buffer = ApplicationBuffer::of(&application, &vec![0; 8 * size as usize]);
    let at = |offset| buffer.range(offset, size);
    let [a, b, c] = [0, size, 2 * size].map(at);
    let refused = |pass: PosePass<'_>, result| match refused(&engine, pass, frame_major, result) {
        Error::Pose(error) => error,
        error => panic!("{error}"),
    };
    let (references, skeleton) = (references(), skeleton());
    let world = |local| PosePass::World {
        local,
        skeleton: &skeleton,
    };
    let add = |reference| PosePass::Add {
        base: a,
        layer: b,
        reference,
        weight: 0.5,
    };
    let range_of = |operand, offset, size, needed, step| PoseError::Buffer {
        operand,
        offset,
        size,
        needed,
        step,
    };
    let cases = [
        (PosePass::Blend { layers: &[] }, c, PoseError::NoLayer),
        (
            PosePass::Blend {
                layers: &[(a, 1.0), (b, f32::INFINITY)],
            },
            c,
            PoseError::WeightNotFinite {
                layer: 1,
                weight: f32::INFINITY,
            },
        ),
        (
            PosePass::Blend {
                layers: &[(a, 1.0), (at(size + 8), 1.0)],
            },
            c,
            range_of(PassOperand::Input(1), size + 8, size, size, 16),
        ),
        (
            mix(a, b, 1.5),
            c,
            PoseError::WeightOutOfRange { weight: 1.5 },
        ),
        (
            mix(a, at(size + 16), 0.5),
            c,
            range_of(PassOperand::Input(1), size + 16, size, size, 256),
        ),
        (
            mix(buffer.range(0, size - 1), b, 0.5),
            c,
            range_of(PassOperand::Input(0), 0, size - 1, size, 256),
        ),
        (
            mix(a, b, 0.5),
            at(2 * size + 128),
            range_of(PassOperand::Result, 2 * size + 128, size, size, 256),
        ),
        (mix(a, b, 0.5), b, PoseError::Overlap { input: 1 }),
        (
            mix(a, c, 0.5),
            at(size - 256),
            PoseError::Overlap { input: 0 },
        ),
        (
            world(a),
            b,
            range_of(PassOperand::Result, size, size, 2 * size, 256),
        ),
        (
            add(&references[1..]),
            c,
            PoseError::References {
                references: TRACKS - 1,
                tracks: TRACKS,
            },
        ),
    ];
    for (pass, result, expected) in cases {
        assert_eq!(refused(pass, result), expected, "{pass:?}");
    }
    let track_major = engine.pass(world(a), TRACKS, 4, Layout::TrackMajor);
    let fewer = engine.pass(world(a), TRACKS - 1, 4, frame_major);
    let behind = buffer.range(2 * size, 2 * size);
    // SAFETY: refused, and not used.
    let [track_major, fewer] =
        [track_major, fewer].map(|request| unsafe { request.target(behind) });
    let is_pose = |error: Error, expected: &PoseError| matches!(error, Error::Pose(error) if error == *expected);
    assert!(is_pose(track_major.unwrap_err(), &PoseError::TrackMajor));
    let expected = PoseError::Skeleton {
        skeleton_tracks: TRACKS,
        tracks: TRACKS - 1,
    };
    assert!(is_pose(fewer.unwrap_err(), &expected));

    // SAFETY: the buffers are as they must be, and outlive the target.
    let mut target = unsafe {
        engine
            .pass(mix(a, b, 0.5), TRACKS, 4, frame_major)
            .target(c)
    }
    .unwrap();
    assert_eq!(
        target.set_weights(&[0.5, 0.5]),
        Err(PoseError::WeightCount {
            weights: 2,
            needed: 1,
        })
    );
    let refused = target.set_weights(&[f32::NAN]).unwrap_err();
    assert!(matches!(refused, PoseError::WeightOutOfRange { weight } if weight.is_nan()));

    // An empty input gives an empty result; a range cannot be longer than its buffer.
    let none = engine.pass(mix(a, b, 0.5), TRACKS, 0, frame_major);
    assert_eq!((none.input_bytes(), none.bytes()), (0, 0));
    // SAFETY: as above.
    unsafe { none.to_buffer(c) }.unwrap();
    let endless = buffer.range(0, u64::MAX);
    let request = engine.pass(
        mix(endless, endless, 0.5),
        TRACKS,
        usize::MAX / 64,
        frame_major,
    );
    // SAFETY: refused, and not used.
    let error = unsafe { request.target(c) }.unwrap_err();
    assert!(
        error.to_string().contains("ends beyond the buffer"),
        "{error}"
    );
}
