//! Stages of crowds that are recorded into an application's commands, after it has changed the matrices in its buffer.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use tumble::crowd::{Crowd, CrowdError, CrowdLibrary, CrowdStage, CrowdValues};
use tumble::vulkan::tuning::Mapping;
use tumble::vulkan::{CommandScopes, CommandUsers, CrowdTarget, VulkanBuffer};
use tumble::{Engine, EngineOptions, method};

use super::visible::some;
use super::{bits, cpu, evaluated, layer, library, skeleton};
use crate::application::{Application, ApplicationBuffer, Commands};
use crate::support::{Random, vulkan_devices};

/// Bytes before and after the matrices, which nothing may write.
const AROUND: usize = 256;
const UNTOUCHED: u8 = 0xa5;

/// A buffer of matrices with bytes around them.
struct Matrices<'a> {
    buffer: ApplicationBuffer<'a>,
    rows: usize,
}

impl<'a> Matrices<'a> {
    fn new(application: &'a Application, rows: usize) -> Self {
        let bytes = vec![UNTOUCHED; rows * 16 + 2 * AROUND];
        let buffer = ApplicationBuffer::of(application, &bytes);
        Self { buffer, rows }
    }

    fn range(&self) -> VulkanBuffer {
        (self.buffer).range(AROUND as u64, (self.rows * 16) as u64)
    }

    fn read(&self) -> Vec<[f32; 4]> {
        let bytes = self.buffer.bytes();
        let (before, others) = bytes.split_at(AROUND);
        let (rows, after) = others.split_at(self.rows * 16);
        assert!(before.iter().chain(after).all(|&byte| byte == UNTOUCHED));
        bytemuck::pod_collect_to_vec(rows)
    }

    fn write(&self, rows: &[[f32; 4]]) {
        let around = [UNTOUCHED; AROUND];
        let bytes = [&around, bytemuck::cast_slice(rows), &around].concat();
        self.buffer.write(&bytes);
    }

    fn target(&self, crowd: &Crowd, values: CrowdValues) -> CrowdTarget {
        // SAFETY: the buffer is as it must be, and outlives the target.
        unsafe { crowd.target(values, self.range()) }.unwrap()
    }

    fn stage(&self, crowd: &Crowd, stage: CrowdStage) -> CrowdTarget {
        // SAFETY: as above.
        unsafe { crowd.stage_target(stage, self.range()) }.unwrap()
    }
}

/// Changes a few numbers, also to values that no evaluation gives.
fn change(random: &mut Random, rows: &mut [[f32; 4]]) {
    for _ in 0..rows.len() / 9 {
        let row = random.next() as usize % rows.len();
        let column = random.next() as usize % 4;
        let any = random.between(-3.0, 3.0) as f32;
        rows[row][column] = random.pick(&[any, any, any, 0.0, -0.0, 1e-41, -3e-38, 4e-20, 500.0]);
    }
}

/// A crowd on an application's device, and the same one on the CPU.
fn crowds(
    random: &mut Random,
    engine: Engine,
    library: &CrowdLibrary,
    instances: usize,
) -> [Crowd; 2] {
    let layers = 1 + instances % 2;
    let mut crowds =
        [engine, cpu()].map(|engine| engine.crowd(library, instances, layers).unwrap());
    for slot in 0..layers * instances {
        let plays = layer(random, library);
        for crowd in &mut crowds {
            crowd.set(slot / layers, slot % layers, plays).unwrap();
        }
    }
    for crowd in &mut crowds {
        crowd.advance(0.3).unwrap();
    }
    crowds
}

fn assert_bits(found: &[[f32; 4]], expected: &[[f32; 4]], step: &str) {
    assert!(bits(found) == bits(expected), "{step}");
}

fn record(crowd: &mut Crowd, commands: &Commands<'_>, targets: &[&CrowdTarget]) {
    let recorded = commands.recorded(|command_buffer| {
        for target in targets {
            // SAFETY: the commands are in recording, and submitted below.
            unsafe { crowd.record(target, command_buffer) }.unwrap();
        }
    });
    commands.run(&[recorded]);
}

/// The host, or commands between the stages, change matrices: every stage has the CPU's bits, on every device, with
/// each choice of kernels, also in several windows. Bytes around the range stay.
#[test]
fn stages_continue_what_the_application_has_changed() {
    if vulkan_devices().is_empty() {
        return;
    }
    for application in Application::all() {
        for (mapping, joints, instances) in [
            (Mapping::Samples, 21, 34),
            (Mapping::Samples, 130, 5),
            (Mapping::Runs, 40, 300),
        ] {
            let mut random = Random(joints as u64);
            let library = library(&mut random, joints, &[method::SLERP]);
            // Windows of 256 instances of 40 joints.
            let mut options = EngineOptions::default();
            (options.memory, options.mapping) = (Some(1 << 20), mapping);
            // SAFETY: the handles belong together and outlive the engine.
            let engine = unsafe { Engine::from_vulkan(application.handles(), &options) };
            let engine = engine.unwrap();
            let [mut crowd, mut expected] = crowds(&mut random, engine, &library, instances);
            assert_stages(&application, &mut random, &mut crowd, &mut expected);
        }
    }
}

fn assert_stages(
    application: &Application,
    random: &mut Random,
    crowd: &mut Crowd,
    expected: &mut Crowd,
) {
    let rows = crowd.output_len(CrowdValues::Local);
    let matrices = Matrices::new(application, rows);
    let commands = Commands::new(application);
    let local = matrices.target(crowd, CrowdValues::Local);
    let [to_model, model_to_skinning, to_skinning] =
        CrowdStage::ALL.map(|stage| matrices.stage(crowd, stage));
    let library = expected.library().clone();

    // The host changes the matrices before each of the two stages.
    let mut host = evaluated(expected, CrowdValues::Local);
    record(crowd, &commands, &[&local]);
    assert_bits(&matrices.read(), &host, "local");
    change(random, &mut host);
    matrices.write(&host);
    record(crowd, &commands, &[&to_model]);
    library.local_to_model(&mut host).unwrap();
    assert_bits(&matrices.read(), &host, "model");
    change(random, &mut host);
    matrices.write(&host);
    record(crowd, &commands, &[&model_to_skinning]);
    library.model_to_skinning(&mut host).unwrap();
    assert_bits(&matrices.read(), &host, "skinning");

    // Commands on the device change a few matrices, without a wait. Barriers are only for the kinds
    // of commands that are used.
    let mut host = evaluated(expected, CrowdValues::Local);
    let changed = [[0.5, 0.0, -0.25, 1.0]; 3];
    let first = 3 * (random.next() as usize % (rows / 3));
    host[first..first + 3].copy_from_slice(&changed);
    let recorded = commands.recorded(|command_buffer| {
        let scopes = CommandScopes::default();
        // SAFETY: the commands are in recording, and submitted below; the range is in the buffer.
        unsafe {
            let local_scopes = scopes.with_after(CommandUsers::Copies);
            let recorded = crowd.record_between(&local, command_buffer, local_scopes);
            recorded.unwrap();
            let at = (AROUND + 16 * first) as u64;
            let bytes = bytemuck::cast_slice(&changed);
            let (device, buffer) = (&application.device, matrices.buffer.buffer);
            device.cmd_update_buffer(command_buffer, buffer, at, bytes);
            let stage_scopes = scopes.with_before(CommandUsers::Copies);
            let recorded = crowd.record_between(&to_skinning, command_buffer, stage_scopes);
            recorded.unwrap();
        }
    });
    commands.run(&[recorded]);
    library.local_to_model(&mut host).unwrap();
    library.model_to_skinning(&mut host).unwrap();
    assert_bits(&matrices.read(), &host, "changed by commands");

    // If nothing is changed, stages give the bits of an evaluation without stages.
    record(crowd, &commands, &[&local, &to_model]);
    let model = evaluated(expected, CrowdValues::Model);
    assert_bits(&matrices.read(), &model, "unchanged, model");
    record(crowd, &commands, &[&local, &to_skinning]);
    let skinning = evaluated(expected, CrowdValues::Skinning);
    assert_bits(&matrices.read(), &skinning, "unchanged, skinning");
}

/// A stage continues as many instances as are visible, and no others; changes of layers remain for the next evaluation.
#[test]
fn stages_continue_visible_instances_alone() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let mut random = Random(3);
    let library = library(&mut random, 9, &[method::SLERP]);
    let engine = application.engine(Mapping::Automatic);
    let [mut crowd, mut expected] = crowds(&mut random, engine, &library, 50);
    let matrices = Matrices::new(&application, 27 * 50);
    let commands = Commands::new(&application);
    let local = matrices.target(&crowd, CrowdValues::Local);
    let stage = matrices.stage(&crowd, CrowdStage::LocalToModel);
    let mut host = evaluated(&mut expected, CrowdValues::Local);
    record(&mut crowd, &commands, &[&local]);
    for count in [0, 1, 33] {
        let plays = layer(&mut random, &library);
        for crowd in [&mut crowd, &mut expected] {
            crowd.set(7, 0, plays).unwrap();
        }
        crowd.set_visible(&some(&mut random, 50, count)).unwrap();
        record(&mut crowd, &commands, &[&stage]);
        library.local_to_model(&mut host[..27 * count]).unwrap();
        assert_bits(&matrices.read(), &host, "visible");
    }
    crowd.set_all_visible();
    record(&mut crowd, &commands, &[&local]);
    let all = evaluated(&mut expected, CrowdValues::Local);
    assert_bits(&matrices.read(), &all, "all");
}

#[test]
fn ranges_that_do_not_fit_a_stage_are_refused() {
    if vulkan_devices().is_empty() {
        return;
    }
    let application = Application::new();
    let engine = application.engine(Mapping::Automatic);
    let mut random = Random(5);
    let library = library(&mut random, 4, &[method::SLERP]);
    let mut crowd = engine.crowd(&library, 6, 1).unwrap();
    let matrices = Matrices::new(&application, 12 * 6);
    let each = 4 * 48;
    let refused = |crowd: &Crowd, buffer| {
        // SAFETY: ranges that are refused.
        unsafe { crowd.stage_target(CrowdStage::LocalToSkinning, buffer) }.unwrap_err()
    };
    let size = 6 * each;
    for (offset, size) in [
        (0, 0),
        (0, size - 1),
        (16, size),
        (u64::MAX, size),
        (u64::MAX - 255, u64::MAX),
        (512, u64::MAX),
    ] {
        let error = refused(&crowd, matrices.buffer.range(offset, size));
        let is_range = matches!(error, CrowdError::Buffer { .. } | CrowdError::Vulkan(_));
        assert!(is_range, "{offset}, {size}: {error}");
    }
    let after_end = refused(&crowd, matrices.buffer.range(1024, size)).to_string();
    assert!(after_end.contains("ends beyond the buffer"), "{after_end}");
    let null = VulkanBuffer::new(ash::vk::Buffer::null(), size);
    let null = refused(&crowd, null).to_string();
    assert!(null.contains("null"), "{null}");
    let on_cpu = cpu().crowd(&library, 6, 1).unwrap();
    assert_eq!(refused(&on_cpu, matrices.range()), CrowdError::OtherDevice);

    // The range has room for two instances. First two are visible, then three, which is refused; so
    // is a target of another crowd.
    crowd.set_visible(&[4, 1]).unwrap();
    let range = matrices.buffer.range(256, 2 * each);
    // SAFETY: the buffer is as it must be, and outlives the target.
    let two = unsafe { crowd.stage_target(CrowdStage::LocalToModel, range) }.unwrap();
    assert_eq!(two.output(), CrowdValues::Model.into());
    crowd.set_visible(&[4, 1, 2]).unwrap();
    let mut other = engine.crowd(&library, 6, 1).unwrap();
    Commands::new(&application).recorded(|command_buffer| {
        // SAFETY: nothing is recorded.
        let [three, of_other] = [&mut crowd, &mut other]
            .map(|crowd| unsafe { crowd.record(&two, command_buffer) }.unwrap_err());
        let (offset, size, needed) = (256, 2 * each, 3 * each);
        let small = CrowdError::Buffer {
            offset,
            size,
            needed,
        };
        assert_eq!((three, of_other), (small, CrowdError::OtherCrowd));
    });

    // Without inverse bind matrices.
    let mut unbound = CrowdLibrary::new(&skeleton(&mut random, 4)).unwrap();
    let set = super::clip(&mut random, 4, 3);
    unbound
        .push(&set, method::SLERP, tumble::VectorMethod::Linear)
        .unwrap();
    let unbound = engine.crowd(&unbound, 6, 1).unwrap();
    assert_eq!(
        refused(&unbound, matrices.range()),
        CrowdError::NoInverseBind
    );
    matrices.stage(&unbound, CrowdStage::LocalToModel);
}
