//! Checks of a renderer's uses of the engine, on a device that is made as an application would make it: results from
//! buffer to buffer, recorded into commands with frames in flight, in memory that only the device can access, and
//! copied on a separate queue. Every bit is compared with the CPU's.
#![allow(unsafe_code)] // the device, the buffers and the commands are the application's

use ash::vk;
use glam::{Quat, Vec3};
use tumble::crowd::{Crowd, CrowdError, CrowdOutput, CrowdValues};
use tumble::vulkan::tuning::{ReadBack, Transfer};
use tumble::vulkan::{
    ClipTarget, CommandScopes, CommandUsers, CrowdTarget, PassTarget, PosePass, VulkanDevice,
};
use tumble::{
    Clip, Device, Encoding, Engine, EngineOptions, Error, Layout, Method, SampleTimes, Skeleton,
    method,
};

use crate::application::{Application, ApplicationBuffer, ApplicationMemory, Elapsed};
use crate::differences::Differences;
use crate::golden::GoldenError;
use crate::sets::{SeededRandom, crowd_layer, crowd_library, random_set, shared_set};

/// The number of frames in flight.
const FRAMES: usize = 3;

/// The result of the check of one use of the engine.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RendererCheck {
    /// A description of the use.
    pub name: String,
    /// The number of compared values: rotations, or joints of a crowd.
    pub values: u64,
    /// The number of values whose bits differ from the CPU's, plus the number of bytes next to a result that changed.
    pub differing: u64,
}

/// The results of all checks on a renderer's device.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct RendererReport {
    /// The checks, one for each use of the engine.
    pub checks: Vec<RendererCheck>,
    /// Whether results were in memory that the host cannot access; otherwise the device has no such memory.
    pub memory_is_hidden: bool,
    /// The number of frames in flight.
    pub frames_in_flight: usize,
    /// The family of the queue that copied results; `None` if the device has no family for copies only.
    pub copy_queue_family: Option<u32>,
    /// The messages of the validation layer, if it was requested.
    pub validation_messages: Vec<String>,
}

/// An application's device with an engine on it. Clips, crowds, targets and buffers of both must be dropped before the
/// device; therefore each function here makes them after the renderer.
pub(crate) struct Renderer {
    /// Dropped before its device.
    pub(crate) engine: Engine,
    pub(crate) application: Application,
}

impl Renderer {
    pub(crate) fn new(
        device: &VulkanDevice,
        validation: bool,
        options: &EngineOptions,
    ) -> Result<Self, Error> {
        let application = Application::new(&device.info().uuid, validation)?;
        // SAFETY: the handles belong together; the engine is dropped before them (by the order of `Renderer`'s fields);
        // and the engine and the application never use the queue at the same time.
        let engine = unsafe { Engine::from_vulkan(application.handles(), options) }?;
        Ok(Self {
            engine,
            application,
        })
    }

    /// Evaluates a clip into a buffer, from `offset` on.
    pub(crate) fn to_buffer(
        clip: &Clip,
        frames: &SampleTimes,
        (layout, encoding): (Layout, Encoding),
        (buffer, offset): (&ApplicationBuffer, u64),
    ) -> Result<(), Error> {
        let range = buffer.range(offset, buffer.size - offset);
        let request = clip.request(frames).layout(layout).encoding(encoding);
        // SAFETY: the buffer is of the same application, made for both uses, and nothing uses it now.
        unsafe { request.to_buffer(range) }
    }

    /// Prepares recording of a clip's samples into a buffer, from `offset` on.
    pub(crate) fn clip_target(
        clip: &Clip,
        frames: &SampleTimes,
        (layout, encoding): (Layout, Encoding),
        (buffer, offset): (&ApplicationBuffer, u64),
    ) -> Result<ClipTarget, Error> {
        let range = buffer.range(offset, buffer.size - offset);
        let request = clip.request(frames).layout(layout).encoding(encoding);
        // SAFETY: the buffer is of the same application, made for both uses, and outlives the target, which is
        // made after it.
        unsafe { request.target(range) }
    }

    pub(crate) fn target(
        crowd: &Crowd,
        output: CrowdOutput,
        buffer: &ApplicationBuffer,
    ) -> Result<CrowdTarget, CrowdError> {
        // SAFETY: the buffer is of the same application, and outlives the target, which is made after it.
        unsafe { crowd.target(output, buffer.range(0, buffer.size)) }
    }

    /// A buffer in which all bits are set, so that bytes that are not written are detected.
    fn untouched(&mut self, size: u64) -> Result<ApplicationBuffer, Error> {
        let buffer = self.application.buffer(size, ApplicationMemory::Device)?;
        self.fill(&buffer)?;
        Ok(buffer)
    }

    fn fill(&mut self, buffer: &ApplicationBuffer) -> Result<Elapsed, Error> {
        let application = &self.application;
        let commands = application.recorded(false, |commands| {
            application.fill(commands, buffer, u32::MAX);
            Ok::<_, Error>(())
        })?;
        Ok(self.application.run(&[commands])?)
    }

    /// The bytes of a buffer, copied by the application's commands.
    fn bytes(
        &mut self,
        from: &ApplicationBuffer,
        through: &ApplicationBuffer,
        size: usize,
    ) -> Result<Vec<u8>, Error> {
        let application = &self.application;
        let commands = application.recorded(false, |commands| {
            application.copy(commands, from, through, size as u64);
            Ok::<_, Error>(())
        })?;
        self.application.run(&[commands])?;
        Ok(through.bytes(size)?)
    }
}

/// Records a clip's samples, `offset` bytes after the start of the target's range.
pub(crate) fn record_clip(
    target: &ClipTarget,
    commands: vk::CommandBuffer,
    offset: u64,
) -> Result<(), Error> {
    // SAFETY: the commands are in recording and of the same device; callers here wait for them before the
    // target goes.
    Ok(unsafe { target.record(commands, offset) }?)
}

/// Records an evaluation of a crowd.
pub(crate) fn record(
    crowd: &mut Crowd,
    target: &CrowdTarget,
    commands: vk::CommandBuffer,
) -> Result<(), CrowdError> {
    // SAFETY: the commands are in recording and of the same device; callers here submit them once, in the
    // order of the calls, to the engine's queue, and wait for them before the target goes.
    unsafe { crowd.record(target, commands) }
}

/// The scopes of a recording between others of the same target.
fn in_row() -> CommandScopes {
    CommandScopes::default()
        .with_before(CommandUsers::KernelsAndCopies)
        .with_after(CommandUsers::KernelsAndCopies)
}

/// As [`record_clip`], between recordings of the same target.
pub(crate) fn record_clip_in_row(
    target: &ClipTarget,
    commands: vk::CommandBuffer,
) -> Result<(), Error> {
    // SAFETY: as in `record_clip`; nothing else uses the result's memory.
    Ok(unsafe { target.record_between(commands, 0, in_row()) }?)
}

/// As [`record`], between recordings of the same target.
pub(crate) fn record_in_row(
    crowd: &mut Crowd,
    target: &CrowdTarget,
    commands: vk::CommandBuffer,
) -> Result<(), CrowdError> {
    // SAFETY: as in `record`; nothing else uses the result's memory.
    unsafe { crowd.record_between(target, commands, in_row()) }
}

/// Records a pass.
fn record_pass(target: &PassTarget, commands: vk::CommandBuffer) {
    // The inputs are results of clips, which kernels wrote.
    let scopes = CommandScopes::default().with_before(CommandUsers::KernelsAndCopies);
    // SAFETY: as in `record_clip`; the result's memory is used by passes and clips alone until all is read back.
    unsafe { target.record_between(commands, scopes) }
}

/// Makes a device as a renderer does, and checks the uses of the engine on it. With `validation`, the Khronos
/// validation layer checks the application's calls and the engine's.
///
/// # Errors
/// When the device cannot be made, or fails.
pub fn renderer(
    device: &VulkanDevice,
    validation: bool,
    seed: u64,
) -> Result<RendererReport, GoldenError> {
    let cpu = Engine::new(Device::Cpu)?;
    let mut renderer = Renderer::new(device, validation, &EngineOptions::default())?;
    let mut report = RendererReport {
        checks: Vec::new(),
        memory_is_hidden: false,
        frames_in_flight: FRAMES,
        copy_queue_family: None,
        validation_messages: Vec::new(),
    };
    // Under the validation layer every call takes longer. Then only the first two methods are used, which is enough,
    // because methods differ only on the host.
    let methods = [method::SLERP, method::C2, method::BESSEL_OVERHAUSER];
    let methods = if validation { &methods[..2] } else { &methods };
    buffer_to_buffer(&mut renderer, &cpu, seed, methods, &mut report)?;
    passes(&mut renderer, &cpu, seed, &mut report)?;
    frames_in_flight(&mut renderer, &cpu, seed, &mut report)?;
    report.validation_messages = renderer.application.validation_messages();
    if let Some(queue) = renderer.application.copy_queue {
        drop(renderer);
        let options = EngineOptions::default()
            .with_transfer(Transfer::Staged)
            .with_read_back(ReadBack::Overlapped);
        let renderer = Renderer::new(device, validation, &options)?;
        report
            .checks
            .push(copied_beside(&renderer.engine, &cpu, seed)?);
        report.copy_queue_family = Some(queue.family);
        let messages = renderer.application.validation_messages();
        report.validation_messages.extend(messages);
    }
    Ok(report)
}

/// Every encoding in both layouts, for arcs and polynomials, at frames and at explicit times, after bytes that must
/// not change. Each is evaluated twice by the engine's submission, and twice by recorded commands of the application.
fn buffer_to_buffer(
    renderer: &mut Renderer,
    cpu: &Engine,
    seed: u64,
    methods: &[Method],
    report: &mut RendererReport,
) -> Result<(), GoldenError> {
    let set = random_set(seed ^ 0x17, 37, 14, &[0.0, 1e-4, 0.02, 0.4, 2.0], true);
    let mut random = SeededRandom(seed);
    let mut times: Vec<f64> = (0..90).map(|_| random.between(-0.5, 7.0)).collect();
    times.sort_by(f64::total_cmp);
    let requests = [
        ("frames", SampleTimes::fps(60).between(-0.5, 6.0)),
        ("times", SampleTimes::at(times)),
    ];
    for &method in methods {
        for (name, frames) in &requests {
            let mut check = RendererCheck {
                name: format!("buffer to buffer, {method}, {name}"),
                values: 0,
                differing: 0,
            };
            let clip = renderer.engine.upload(&set, method)?;
            let expected_clip = cpu.upload(&set, method)?;
            let samples = clip.timeline(frames).map_err(Error::from)?.len();
            let largest = Encoding::ALL.map(Encoding::bytes).into_iter().max();
            let offset_rotations = 256;
            let room =
                (clip.track_count() * samples + offset_rotations) * largest.unwrap_or_default();
            let buffer = renderer.untouched(room as u64)?;
            report.memory_is_hidden = buffer.is_hidden;
            let host = (renderer.application).buffer(room as u64, ApplicationMemory::Host);
            let host = host.map_err(Error::from)?;
            for encoding in Encoding::ALL {
                if !encoding.stores_rotations() {
                    continue; // not for rotations
                }
                for layout in [Layout::TrackMajor, Layout::FrameMajor] {
                    let each = encoding.bytes();
                    let offset = offset_rotations * each;
                    let expected = expected_clip
                        .request(frames)
                        .layout(layout)
                        .encoding(encoding)
                        .evaluate_bytes()?;
                    let like = (layout, encoding);
                    // The same place by a range that begins three values earlier, not at a cache line, and commands
                    // that are recorded with an offset of three values in it.
                    let further = 3 * each;
                    let range = (&buffer, (offset - further) as u64);
                    let target = Renderer::clip_target(&clip, frames, like, range)?;
                    let recorded = renderer.application.recorded(false, |commands| {
                        record_clip(&target, commands, further as u64)
                    })?;
                    // Attempts with new lists, with kept lists, and with recorded commands.
                    for attempt in 0..4 {
                        match attempt {
                            0 | 1 => {
                                Renderer::to_buffer(&clip, frames, like, (&buffer, offset as u64))?;
                            }
                            _ => drop(renderer.application.run(&[recorded]).map_err(Error::from)?),
                        }
                        let found = renderer.bytes(&buffer, &host, offset + expected.len())?;
                        let (before, found) = found.split_at(offset);
                        check.values += (expected.len() / each) as u64;
                        check.differing += Differences::of(found, &expected, each).count;
                        check.differing +=
                            before.iter().filter(|&&byte| byte != 0xff).count() as u64;
                        renderer.fill(&buffer)?;
                    }
                    drop(target);
                    renderer.application.forget_commands();
                }
            }
            report.checks.push(check);
        }
    }
    Ok(())
}

/// Evaluates two clips, blends, mixes and adds their poses, and evaluates a skeleton, in one submission; twice.
fn passes(
    renderer: &mut Renderer,
    cpu: &Engine,
    seed: u64,
    report: &mut RendererReport,
) -> Result<(), GoldenError> {
    const TRACKS: usize = 37;
    let layout = Layout::FrameMajor;
    let frames = SampleTimes::fps(60).between(-0.5, 6.0);
    let angles = [0.0, 1e-4, 0.02, 0.4, 2.0];
    let (mut clips, mut layers) = (Vec::new(), Vec::new());
    for (salt, method) in [(0x43, method::SLERP), (0x47, method::BESSEL_OVERHAUSER)] {
        let set = random_set(seed ^ salt, TRACKS, 14, &angles, true);
        clips.push(renderer.engine.upload(&set, method)?);
        layers.push(
            cpu.request(&set, method, &frames)
                .layout(layout)
                .evaluate()?,
        );
    }
    let [from, to] = [&layers[0], &layers[1]];
    let mut random = SeededRandom(seed ^ 0x53);
    let mut coordinate = || random.between(-1.0, 1.0) as f32;
    let reference: Vec<Quat> = from.as_quats()[..TRACKS].to_vec();
    let parents = (0..TRACKS).map(|track| track.checked_sub(1 + track % 3));
    let offsets = (0..TRACKS).map(|_| Vec3::from_array([(); 3].map(|()| coordinate())));
    let skeleton = Skeleton::new(parents.collect(), offsets.collect()).map_err(Error::from)?;
    let mixed = cpu.mix(from, to, 0.4)?;
    let world = cpu.world(&mixed, &skeleton)?;
    let expected: [Vec<u8>; 4] = [
        bytemuck::cast_slice(cpu.blend(&[(to, 0.3), (from, 0.9)])?.as_quats()).to_vec(),
        bytemuck::cast_slice(mixed.as_quats()).to_vec(),
        bytemuck::cast_slice(cpu.add(from, to, &reference, 0.7)?.as_quats()).to_vec(),
        bytemuck::cast_slice(world.as_slice()).to_vec(),
    ];
    let samples = from.sample_count();
    let size = size_of_val(from.as_quats()) as u64;
    let step = size.next_multiple_of(256);
    let room = 5 * step + 2 * size;
    let buffer = renderer.untouched(room)?;
    let host = (renderer.application).buffer(room, ApplicationMemory::Host);
    let host = host.map_err(Error::from)?;
    let range = |index: u64| buffer.range(index * step, size);
    let [from, to] = [range(0), range(1)];
    let passes = [
        PosePass::Blend {
            layers: &[(to, 0.3), (from, 0.9)],
        },
        PosePass::Mix {
            from,
            to,
            weight: 0.4,
        },
        PosePass::Add {
            base: from,
            layer: to,
            reference: &reference,
            weight: 0.7,
        },
        PosePass::World {
            local: range(3),
            skeleton: &skeleton,
        },
    ];
    let mut of_clips = Vec::new();
    for (clip, index) in clips.iter().zip(0..) {
        let begins = (&buffer, index * step);
        of_clips.push(Renderer::clip_target(
            clip,
            &frames,
            (layout, Encoding::F32),
            begins,
        )?);
    }
    let mut of_passes = Vec::new();
    for (pass, index) in passes.into_iter().zip(2..) {
        let request = renderer.engine.pass(pass, TRACKS, samples, layout);
        let result = buffer.range(index * step, request.bytes());
        // SAFETY: the buffer is of the same application, and outlives the target, which is made after it.
        of_passes.push(unsafe { request.target(result) }?);
    }
    let recorded = renderer.application.recorded(false, |commands| {
        for target in &of_clips {
            record_clip(target, commands, 0)?;
        }
        for target in &of_passes {
            record_pass(target, commands);
        }
        Ok::<_, Error>(())
    })?;
    let names = ["blend", "mix", "add", "world"];
    let mut checks = names.map(|pass| RendererCheck {
        name: format!("passes from buffer to buffer, {pass}"),
        values: 0,
        differing: 0,
    });
    for _ in 0..2 {
        (renderer.application)
            .run(&[recorded])
            .map_err(Error::from)?;
        let found = renderer.bytes(&buffer, &host, room as usize)?;
        for ((check, expected), index) in checks.iter_mut().zip(&expected).zip(2..) {
            let start = (index * step) as usize;
            let (found, behind) = found[start..].split_at(expected.len());
            let beside = behind.len().min((step - size) as usize);
            check.values += (expected.len() / size_of::<Quat>()) as u64;
            check.differing += Differences::of(found, expected, size_of::<Quat>()).count;
            let changed = behind[..beside].iter().filter(|&&byte| byte != 0xff);
            check.differing += changed.count() as u64;
        }
        renderer.fill(&buffer)?;
    }
    drop((of_clips, of_passes));
    renderer.application.forget_commands();
    report.checks.extend(checks);
    Ok(())
}

/// A crowd recorded into the application's commands: three frames, each with a separate buffer, submitted without a
/// wait between them.
fn frames_in_flight(
    renderer: &mut Renderer,
    cpu: &Engine,
    seed: u64,
    report: &mut RendererReport,
) -> Result<(), GoldenError> {
    const LAYERS: usize = 2;
    const INSTANCES: usize = 33;
    let mut random = SeededRandom(seed ^ 0x29);
    let methods = [method::SLERP, method::BESSEL_OVERHAUSER];
    let library = crowd_library(&mut random, 21, &methods)?;
    for values in [
        CrowdValues::Rotations,
        CrowdValues::Local,
        CrowdValues::Model,
        CrowdValues::Skinning,
    ] {
        for output in [CrowdOutput::from(values), CrowdOutput::half(values)] {
            let mut crowd = renderer.engine.crowd(&library, INSTANCES, LAYERS)?;
            let mut expected_crowd = cpu.crowd(&library, INSTANCES, LAYERS)?;
            let each = output.bytes();
            let size = (crowd.output_len(output) * each / output.vector_count()) as u64;
            let mut buffers = Vec::new();
            for _ in 0..FRAMES {
                let host = (renderer.application).buffer(size, ApplicationMemory::Host);
                buffers.push((renderer.untouched(size)?, host.map_err(Error::from)?));
            }
            // Created after the buffers that they refer to, and dropped before them.
            let targets = (buffers.iter())
                .map(|(buffer, _)| Renderer::target(&crowd, output, buffer))
                .collect::<Result<Vec<_>, _>>()?;
            let (mut frames, mut expected) = (Vec::new(), Vec::new());
            for (frame, (target, (buffer, host))) in targets.iter().zip(&buffers).enumerate() {
                for index in 0..INSTANCES * LAYERS {
                    if frame == 0 || random.below(7) == 0 {
                        let plays = crowd_layer(&mut random, &library);
                        crowd.set(index / LAYERS, index % LAYERS, plays)?;
                        expected_crowd.set(index / LAYERS, index % LAYERS, plays)?;
                    }
                }
                crowd.advance_ticks(70_560)?;
                expected_crowd.advance_ticks(70_560)?;
                let application = &renderer.application;
                frames.push(application.recorded(false, |commands| {
                    record(&mut crowd, target, commands)?;
                    application.copy(commands, buffer, host, size);
                    Ok::<_, CrowdError>(())
                })?);
                let vectors = expected_crowd.output_len(output);
                expected.push(if output.is_half {
                    let mut found = vec![[0u16; 4]; vectors];
                    expected_crowd.evaluate_half_into(values, &mut found)?;
                    bytemuck::cast_slice(&found).to_vec()
                } else {
                    let mut found = vec![[0f32; 4]; vectors];
                    expected_crowd.evaluate_into(values, &mut found)?;
                    bytemuck::cast_slice::<_, u8>(&found).to_vec()
                });
            }
            renderer.application.run(&frames).map_err(Error::from)?;
            let mut check = RendererCheck {
                name: format!(
                    "{FRAMES} frames in flight, {values:?} in {} bits",
                    if output.is_half { 16 } else { 32 }
                ),
                values: 0,
                differing: 0,
            };
            for ((_, host), expected) in buffers.iter().zip(&expected) {
                let found = host.bytes(size as usize).map_err(Error::from)?;
                check.values += (expected.len() / each) as u64;
                check.differing += Differences::of(&found, expected, each).count;
            }
            report.checks.push(check);
            drop(targets);
            renderer.application.forget_commands();
        }
    }
    Ok(())
}

/// Results of several windows, each copied on a separate queue while the next window is evaluated.
fn copied_beside(engine: &Engine, cpu: &Engine, seed: u64) -> Result<RendererCheck, Error> {
    let set = shared_set(seed ^ 0x31, 1024, 26, 0.4, 0.6, 4);
    let frames = SampleTimes::fps(400).between(0.0, 10.0);
    let [found, expected] =
        [engine, cpu].map(|engine| engine.evaluate(&set, method::SLERP, &frames));
    let (found, expected) = (found?, expected?);
    let [found, expected] = [found.as_quats(), expected.as_quats()];
    let values = expected.len() as u64;
    let [found, expected] = [found, expected].map(bytemuck::cast_slice);
    Ok(RendererCheck {
        name: "copied on a queue of their own, slerp".to_owned(),
        values,
        differing: Differences::of(found, expected, size_of::<Quat>()).count,
    })
}
