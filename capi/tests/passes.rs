//! Passes over rotations in an application's buffers, through the functions that C has.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use std::ptr::{null, null_mut};

use ash::vk::Handle;
use glam::{Quat, Vec3};
use tumble::{Device, Engine, Layout, Rotations, SampleTimes, Skeleton, method};
use tumble_capi::engine::*;
use tumble_capi::pass::*;
use tumble_capi::result::*;

use crate::application::{Application, ApplicationBuffer, Commands};
use crate::application_device::{done, fails, handles, open, pointer};
use crate::support::{hostile_set, vulkan_devices};

const TRACKS: usize = 5;
/// Where a result begins in its buffer: bytes before it must not change.
const BEFORE: u64 = 256;

/// Three layers, frame by frame.
fn layers(engine: &Engine) -> Vec<Rotations> {
    let methods = [method::SLERP, method::CATMULL_ROM, method::STEP];
    let evaluated = methods.into_iter().zip(0..).map(|(method, seed)| {
        let frames = SampleTimes::fps(30).between(0.0, 3.0);
        let clip = engine.upload(&hostile_set(seed, TRACKS), method).unwrap();
        let request = clip.request(&frames).layout(Layout::FrameMajor);
        request.evaluate().unwrap()
    });
    evaluated.collect()
}

/// A structure with nothing but its shape.
fn of(operation: TumblePassOperation, samples: usize) -> TumblePass {
    TumblePass {
        size: size_of::<TumblePass>(),
        operation: operation as u32,
        layout: 1,
        track_count: TRACKS,
        sample_count: samples,
        inputs: null(),
        input_count: 0,
        weights: null(),
        weight_count: 0,
        reference: null(),
        parents: null(),
        offsets: null(),
    }
}

impl Inputs<'_> {
    fn pass(&self, operation: TumblePassOperation, samples: usize) -> TumblePass {
        TumblePass {
            inputs: self.ranges.as_ptr(),
            input_count: self.ranges.len(),
            weights: self.weights.as_ptr(),
            weight_count: self.weights.len(),
            ..of(operation, samples)
        }
    }
}

/// The buffers that a pass reads, and their weights.
struct Inputs<'a> {
    ranges: Vec<TumbleBufferRange>,
    weights: &'a [f32],
}

/// A pass, the weights that are set later, and the result before and after that.
type Row<'a> = (TumblePass, &'a [f32], [Vec<u8>; 2]);

fn bytes(engine: *const TumbleEngine, pass: &TumblePass) -> u64 {
    let mut bytes = 0;
    // SAFETY: a structure, and room for the number.
    done(unsafe { tumble_pass_bytes(engine, pass, &raw mut bytes) });
    bytes
}

/// At once, and recorded with other weights that are set later: the bits of the CPU.
#[test]
fn passes_give_the_bits_of_the_cpu() {
    use TumblePassOperation::{Add, Blend, Mix, World};
    if vulkan_devices().is_empty() {
        return;
    }
    let cpu = Engine::new(Device::Cpu).unwrap();
    let layers = layers(&cpu);
    let [first, second, third] = &layers[..] else {
        panic!("three layers")
    };
    let samples = first.sample_count();
    let reference: Vec<Quat> = first.as_quats()[..TRACKS].to_vec();
    let parents = [-1, 0, 1, 0, -1];
    let offsets: [[f32; 3]; TRACKS] = std::array::from_fn(|joint| [0.5, joint as f32, -1.0]);
    let skeleton = Skeleton::new(
        parents.map(|parent| usize::try_from(parent).ok()).to_vec(),
        offsets.map(Vec3::from).to_vec(),
    )
    .unwrap();

    for application in Application::all() {
        let mut engine = null_mut();
        done(open(&handles(&application), &mut engine));
        let commands = Commands::new(&application);
        let each = (TRACKS * samples * 16) as u64;
        let stride = each.next_multiple_of(256);
        let mut all = vec![0; (3 * stride) as usize];
        for (layer, to) in layers.iter().zip(all.chunks_exact_mut(stride as usize)) {
            to[..each as usize].copy_from_slice(bytemuck::cast_slice(layer.as_quats()));
        }
        let inputs = ApplicationBuffer::of(&application, &all);
        let range = |layer: u64| TumbleBufferRange {
            buffer: inputs.buffer.as_raw(),
            offset: layer * stride,
            size: each,
        };
        let three = |weights| Inputs {
            ranges: vec![range(2), range(0), range(1)],
            weights,
        };
        let two = |weights| Inputs {
            ranges: vec![range(0), range(1)],
            weights,
        };
        let one = Inputs {
            ranges: vec![range(2)],
            weights: &[],
        };
        let blended = three(&[0.5, -0.25, 1.5]);
        let mixed = two(&[0.25]);
        let blend = |[a, b, c]: [f32; 3]| {
            let blended = cpu.blend(&[(third, a), (first, b), (second, c)]).unwrap();
            bytemuck::cast_slice(blended.as_quats()).to_vec()
        };
        let mix = |weight| {
            let mixed = cpu.mix(first, second, weight).unwrap();
            bytemuck::cast_slice(mixed.as_quats()).to_vec()
        };
        let add = |weight| {
            let added = cpu.add(first, second, &reference, weight).unwrap();
            bytemuck::cast_slice(added.as_quats()).to_vec()
        };
        let world = |local: &Rotations| -> Vec<u8> {
            let world = cpu.world(local, &skeleton).unwrap();
            bytemuck::cast_slice(world.as_slice()).to_vec()
        };
        let rows: [Row<'_>; 4] = [
            (
                blended.pass(Blend, samples),
                &[1.0, 2.0, 0.0],
                [blend([0.5, -0.25, 1.5]), blend([1.0, 2.0, 0.0])],
            ),
            (mixed.pass(Mix, samples), &[1.0], [mix(0.25), mix(1.0)]),
            (
                TumblePass {
                    reference: reference.as_ptr().cast(),
                    ..mixed.pass(Add, samples)
                },
                &[0.0],
                [add(0.25), add(0.0)],
            ),
            (
                TumblePass {
                    parents: parents.as_ptr(),
                    offsets: offsets.as_ptr().cast(),
                    ..one.pass(World, samples)
                },
                &[],
                [world(third), world(third)],
            ),
        ];
        for (pass, weights, [expected, later]) in rows {
            let size = bytes(engine, &pass);
            assert_eq!(size, expected.len() as u64);
            let buffer = ApplicationBuffer::of(&application, &vec![0xff; (BEFORE + size) as usize]);
            let raw = buffer.buffer.as_raw();
            let found = || buffer.bytes()[BEFORE as usize..].to_vec();
            // SAFETY: the buffers are the application's, which frees the target first; as many weights as stated; the
            // commands are in recording, and submitted below.
            unsafe {
                done(tumble_pass_to_buffer(
                    engine,
                    &raw const pass,
                    raw,
                    BEFORE,
                    size,
                ));
                assert!(found() == expected, "{pass:?}");
                let mut target = null_mut();
                let out = &raw mut target;
                done(tumble_pass_target_new(
                    engine,
                    &raw const pass,
                    raw,
                    BEFORE,
                    size,
                    out,
                ));
                let record = |commands| done(tumble_pass_record(target, pointer(commands)));
                let as_made = commands.recorded(record);
                done(tumble_pass_set_weights(
                    target,
                    weights.as_ptr(),
                    weights.len(),
                ));
                let changed = commands.recorded(record);
                for (commands_of, expected) in
                    [(changed, &later), (as_made, &expected), (changed, &later)]
                {
                    commands.run(&[commands_of]);
                    assert!(found() == *expected, "{pass:?}");
                }
                let refused = tumble_pass_set_weights(target, [0.5; 4].as_ptr(), 4);
                fails(
                    refused,
                    TumbleResult::InvalidArgument,
                    "4 weights, and the pass takes",
                );
                done(tumble_pass_target_free(target));
                let refused = tumble_pass_record(target, null_mut());
                fails(
                    refused,
                    TumbleResult::InvalidHandle,
                    "this pass target was freed",
                );
            }
            assert!(
                buffer.bytes()[..BEFORE as usize]
                    .iter()
                    .all(|&byte| byte == 0xff)
            );
        }
        done(tumble_engine_free(engine));
    }
}

#[test]
fn passes_that_cannot_be_are_refused() {
    use TumblePassOperation::{Add, Blend, Mix, World};
    if vulkan_devices().is_empty() {
        return;
    }
    const SAMPLES: usize = 4;
    const SIZE: u64 = (TRACKS * SAMPLES * 16) as u64;
    let application = Application::new();
    let (mut engine, mut cpu) = (null_mut(), null_mut());
    done(open(&handles(&application), &mut engine));
    // SAFETY: text, null and room for the handle.
    done(unsafe { tumble_engine_open(c"cpu".as_ptr(), null(), &raw mut cpu) });
    let buffer = ApplicationBuffer::of(&application, &[0; 2048]);
    let range = |offset| TumbleBufferRange {
        buffer: buffer.buffer.as_raw(),
        offset,
        size: SIZE,
    };
    let inputs = |offsets: &[u64], weights| Inputs {
        ranges: offsets.iter().map(|&offset| range(offset)).collect(),
        weights,
    };
    let (argument, size, no_pointer) = (
        TumbleResult::InvalidArgument,
        TumbleResult::WrongSize,
        TumbleResult::InvalidPointer,
    );
    let two = inputs(&[0, 512], &[0.5]);
    let too_much = inputs(&[0, 512], &[1.5]);
    let askew = inputs(&[0, 520], &[0.5]);
    let overlapping = inputs(&[0, 1024], &[0.5]);
    let one = inputs(&[0], &[]);
    let none = inputs(&[], &[]);
    let nan = inputs(&[0], &[f32::NAN]);
    let parents = [-1, 0, 1, 9, 0];
    let below = [-1, 0, 1, -2, 0];
    let chain = [-1, 0, 1, 2, 3];
    let world = TumblePass {
        parents: chain.as_ptr(),
        ..one.pass(World, SAMPLES)
    };
    let good = two.pass(Mix, SAMPLES);
    for (pass, code, says) in [
        (
            TumblePass { size: 8, ..good },
            argument,
            "set it to `sizeof`",
        ),
        (
            TumblePass {
                operation: 4,
                ..good
            },
            argument,
            "`pass->operation` is 4",
        ),
        (TumblePass { layout: 2, ..good }, argument, "`layout` is 2"),
        (
            TumblePass {
                inputs: null(),
                ..good
            },
            no_pointer,
            "`pass->inputs` is null",
        ),
        (
            one.pass(Mix, SAMPLES),
            argument,
            "`pass->input_count` is 1; this operation takes 2",
        ),
        (
            TumblePass {
                weight_count: 0,
                ..good
            },
            argument,
            "`pass->weight_count` is 0; this operation takes 1",
        ),
        (one.pass(Blend, SAMPLES), argument, "give a weight for each"),
        (none.pass(Blend, SAMPLES), argument, "no layer to blend"),
        (
            nan.pass(Blend, SAMPLES),
            argument,
            "the weight of layer 0 is NaN",
        ),
        (too_much.pass(Mix, SAMPLES), argument, "the weight is 1.5"),
        (
            askew.pass(Mix, SAMPLES),
            size,
            "input 1: the buffer's range",
        ),
        (
            overlapping.pass(Mix, SAMPLES),
            argument,
            "the result overlaps input 1",
        ),
        (
            two.pass(Add, SAMPLES),
            no_pointer,
            "`pass->reference` is null",
        ),
        (two.pass(Mix, usize::MAX), size, "does not fit"),
        (
            TumblePass {
                track_count: usize::MAX,
                ..two.pass(Add, SAMPLES)
            },
            argument,
            "`pass->reference` would have",
        ),
        (
            TumblePass { layout: 0, ..world },
            argument,
            "TUMBLE_LAYOUT_FRAME_MAJOR",
        ),
        (
            TumblePass {
                parents: null(),
                ..world
            },
            no_pointer,
            "`parents` is null",
        ),
        (
            TumblePass {
                parents: parents.as_ptr(),
                ..world
            },
            TumbleResult::InvalidInput,
            "9",
        ),
        (
            TumblePass {
                parents: below.as_ptr(),
                ..world
            },
            argument,
            "`parents[3]` is -2",
        ),
    ] {
        let raw = buffer.buffer.as_raw();
        let mut target = null_mut();
        // SAFETY: a refused buffer is not used.
        unsafe {
            let refused = tumble_pass_to_buffer(engine, &raw const pass, raw, 1024, 1024);
            fails(refused, code, says);
            let out = &raw mut target;
            let refused = tumble_pass_target_new(engine, &raw const pass, raw, 1024, 1024, out);
            fails(refused, code, says);
        }
        assert!(target.is_null());
    }
    let raw = buffer.buffer.as_raw();
    let pass = &raw const good;
    // SAFETY: as above.
    unsafe {
        let refused = tumble_pass_to_buffer(cpu, pass, raw, 1024, SIZE);
        fails(refused, argument, "tumble_engine_from_vulkan");
        let refused = tumble_pass_to_buffer(engine, pass, 0, 1024, SIZE);
        fails(refused, no_pointer, "VK_NULL_HANDLE");
        for (offset, room) in [(1000, SIZE), (1024, SIZE - 1)] {
            let refused = tumble_pass_to_buffer(engine, pass, raw, offset, room);
            fails(refused, size, "the result: the buffer's range");
        }
        let refused = tumble_pass_to_buffer(engine, null(), raw, 1024, SIZE);
        fails(refused, no_pointer, "`pass` is null");
        let refused = tumble_pass_bytes(engine, pass, null_mut());
        fails(refused, no_pointer, "`bytes` is null");
        done(tumble_pass_to_buffer(engine, pass, raw, 1024, SIZE));
    }
    done(tumble_engine_free(cpu));
    done(tumble_engine_free(engine));
}
