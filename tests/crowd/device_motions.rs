//! States of clips that lie on a device: the CPU's bits.

use super::skeleton;
use super::states::{StateResults, TICKS, instances, sets, states};
use crate::support::{Random, vulkan_devices};
use tumble::crowd::{
    CrowdError, DeviceMotions, FrameStep, KeyPrecision, MotionBuilder, MotionStates, MotionTables,
    StateArray,
};
use tumble::vulkan::VulkanError;
use tumble::{Device, Encoding, Engine, EngineOptions, MatrixOrder, Method, VectorMethod, method};

type Tables = (MotionTables, Vec<[u32; 4]>, Vec<[f32; 4]>);

fn tables(
    random: &mut Random,
    joints: usize,
    (method, vectors): (Method, VectorMethod),
    precision: KeyPrecision,
) -> Tables {
    let skeleton = skeleton(random, joints);
    let mut builder = MotionBuilder::new(&skeleton, TICKS, precision).unwrap();
    for set in sets(random, joints) {
        builder.push(&set, method, vectors).unwrap();
    }
    builder.finish()
}

fn frame_steps(at: &[(u32, u32)]) -> Vec<FrameStep> {
    let frame = TICKS / 30;
    let step = |&(_, tick): &(u32, u32)| FrameStep {
        ticks: [tick / frame * frame, (tick / frame + 1) * frame],
        per_second: 30.0,
    };
    at.iter().map(step).collect()
}

/// The bits of an array of the CPU's.
fn bits(of: &StateResults, array: StateArray) -> &[u8] {
    match array {
        StateArray::Rotations => bytemuck::cast_slice(&of.rotations),
        StateArray::Positions => bytemuck::cast_slice(&of.positions),
        StateArray::WorldRotations => bytemuck::cast_slice(&of.world_rotations),
        StateArray::Velocities => bytemuck::cast_slice(&of.velocities),
        StateArray::AngularVelocities => bytemuck::cast_slice(&of.angular_velocities),
        _ => unreachable!("an array that this test does not know: {array:?}"),
    }
}

#[test]
fn states_have_the_bits_of_the_cpu_in_every_form_of_clips() {
    let (mut random, joints) = (Random(7), 11);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let engines: Vec<Engine> = vulkan_devices()
        .into_iter()
        .map(|device| Engine::new(device).unwrap())
        .collect();
    for (method, vectors, precision) in [
        (method::SLERP, VectorMethod::Linear, KeyPrecision::Exact),
        (method::SLERP, VectorMethod::Linear, KeyPrecision::Packed),
        (
            method::BESSEL_OVERHAUSER,
            VectorMethod::BesselOverhauser,
            KeyPrecision::Exact,
        ),
        (method::STEP, VectorMethod::Step, KeyPrecision::Exact),
    ] {
        let (tables, spans, cells) = tables(&mut random, joints, (method, vectors), precision);
        let parts = (&spans[..], &cells[..]);
        let at = instances(&mut random, &tables, 300);
        let steps = frame_steps(&at);
        let mut expected = states(&cpu, &tables, parts, &at);
        let motions = |engine: &Engine| DeviceMotions::new(engine, &tables, parts).unwrap();
        let motions: Vec<DeviceMotions> = engines.iter().map(motions).collect();
        for of_device in &motions {
            // All arrays in one call, and each array in a separate call, which skips steps that the array does not
            // need.
            let each = StateArray::ALL.map(|array| vec![array]);
            for arrays in each.iter().chain([&StateArray::ALL.to_vec()]) {
                let (found, ranges) = of_device.sample(&at, None, arrays, Encoding::F32).unwrap();
                for (&array, range) in arrays.iter().zip(ranges) {
                    let found = &found.bytes()[range];
                    assert!(
                        found == bits(&expected, array),
                        "{array} {method:?} {of_device:?}"
                    );
                }
            }
        }
        // Rotations in other encodings, together with an array of vectors.
        let arrays = [
            StateArray::WorldRotations,
            StateArray::Positions,
            StateArray::Rotations,
        ];
        let matrices = MatrixOrder::ALL.map(Encoding::Matrix3x3);
        for encoding in matrices.into_iter().chain([Encoding::SixD]) {
            let expected = arrays.map(|array| match array.encoding(encoding) {
                Encoding::Vector => bits(&expected, array).to_vec(),
                encoding => {
                    let quaternions: &[[f32; 4]] = bytemuck::cast_slice(bits(&expected, array));
                    let mut bytes = vec![0; quaternions.len() * encoding.bytes()];
                    encoding.encode(quaternions, &mut bytes).unwrap();
                    bytes
                }
            });
            for of_device in &motions {
                let (found, ranges) = of_device.sample(&at, None, &arrays, encoding).unwrap();
                for (expected, range) in expected.iter().zip(ranges) {
                    assert!(
                        found.bytes()[range] == **expected,
                        "{encoding} {of_device:?}"
                    );
                }
            }
        }
        let differences = MotionStates {
            velocities: &mut expected.velocities,
            angular_velocities: &mut expected.angular_velocities,
            ..MotionStates::default()
        };
        tables
            .differences_into(&cpu, parts, &at, &steps, differences)
            .unwrap();
        for of_device in &motions {
            let arrays = [
                StateArray::AngularVelocities,
                StateArray::Rotations,
                StateArray::Velocities,
            ];
            let sampled = of_device.sample(&at, Some(&steps), &arrays, Encoding::F32);
            let (found, ranges) = sampled.unwrap();
            for (array, range) in arrays.into_iter().zip(ranges) {
                let found = &found.bytes()[range];
                assert!(
                    found == bits(&expected, array),
                    "{array} {method:?} {of_device:?}"
                );
            }
        }
    }
}

/// More instances than a window has, from several threads, of a skeleton with one joint.
#[test]
fn windows_and_threads_do_not_change_states() {
    let mut random = Random(12);
    let kind = (method::SLERP, VectorMethod::Linear);
    let (tables, spans, cells) = tables(&mut random, 1, kind, KeyPrecision::Exact);
    let parts = (&spans[..], &cells[..]);
    let at = instances(&mut random, &tables, 60_000);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let expected = states(&cpu, &tables, parts, &at);
    for device in vulkan_devices() {
        let engine = Engine::new(device).unwrap();
        let motions = DeviceMotions::new(&engine, &tables, parts).unwrap();
        std::thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    let array = StateArray::Positions;
                    let sampled = motions.sample(&at, None, &[array], Encoding::F32);
                    let (found, ranges) = sampled.unwrap();
                    assert!(found.bytes()[ranges[0].clone()] == *bits(&expected, array));
                });
            }
        });
        let sampled = motions.sample(&[], None, &StateArray::ALL, Encoding::SixD);
        let (found, ranges) = sampled.unwrap();
        assert!(found.bytes().is_empty() && ranges.len() == 5);
    }
}

#[test]
fn requests_that_cannot_be_met_are_refused() {
    let mut random = Random(5);
    let kind = (method::SLERP, VectorMethod::Linear);
    let (tables, spans, cells) = tables(&mut random, 3, kind, KeyPrecision::Exact);
    let parts = (&spans[..], &cells[..]);
    let cpu = Engine::new(Device::Cpu).unwrap();
    let refused = DeviceMotions::new(&cpu, &tables, parts).unwrap_err();
    assert_eq!(refused, CrowdError::OnCpu);
    for device in vulkan_devices() {
        let engine = Engine::new(device.clone()).unwrap();
        let broken = DeviceMotions::new(&engine, &tables, (&spans[1..], &cells)).unwrap_err();
        assert_eq!(broken, CrowdError::BrokenTables);
        let motions = DeviceMotions::new(&engine, &tables, parts).unwrap();
        let arrays = &[StateArray::Rotations];
        let sample = |at, steps, encoding| motions.sample(at, steps, arrays, encoding);
        let missing = sample(&[(3, 0)], None, Encoding::F32).unwrap_err();
        assert!(matches!(missing, CrowdError::Missing { index: 3, .. }));
        let refused = sample(&[(0, 0)], None, Encoding::F16).unwrap_err();
        let encoding = Encoding::F16;
        assert_eq!(refused, CrowdError::StateEncoding { encoding });
        let steps = sample(&[(0, 0)], Some(&[]), Encoding::F32).unwrap_err();
        assert!(matches!(
            steps,
            CrowdError::OutputLength {
                length: 0,
                needed: 1
            }
        ));
        // The budget is that of the engine.
        let mut options = EngineOptions::default();
        options.memory = Some(2 * motions.bytes() - 2);
        let small = Engine::with_options(device, &options).unwrap();
        let refused = DeviceMotions::new(&small, &tables, parts).unwrap_err();
        let message = refused.to_string();
        let CrowdError::Vulkan(VulkanError::OverBudget { bytes, budget, .. }) = refused else {
            panic!("{refused}")
        };
        assert_eq!((bytes, budget), (motions.bytes(), 2 * motions.bytes() - 2));
        let enough = format!("a budget of at least {}", 2 * motions.bytes());
        assert!(message.contains(&enough), "{message}");
    }
}
