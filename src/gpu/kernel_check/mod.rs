//! The check of kernels. Before the first result of a kernel is used, its output on the device is compared, bit for
//! bit, with the result of its entry point in Rust ([`entries`](crate::twin::entries)) for the same inputs.

mod crowd;
mod from_keys;
mod motion;
pub(crate) mod passes;
mod poses;
pub(crate) mod random;
pub(crate) mod segments;
pub(crate) mod self_test;
mod whole_instances;

use bytemuck::NoUninit;
use random::Random;

use crate::gpu::pipeline::Pipeline;
use crate::gpu::run_once::run_on;
use crate::machine::error::VulkanError;
pub(crate) use crate::machine::reports::KernelCheck;
use crate::shader::Kernel;
use crate::twin::machine::{Memory, UNTOUCHED};

/// The number of values after a result that no kernel may write.
const GUARD: usize = 16;

/// One dispatch of a kernel. Before it, the output contains [`UNTOUCHED`], or values that the trial states.
pub(crate) struct Trial {
    /// The buffers that it reads, in the order of their bindings.
    pub(crate) inputs: Vec<Vec<u8>>,
    /// The push constants of the dispatch.
    pub(crate) arguments: Vec<u8>,
    pub(crate) groups: [u32; 3],
    /// The contents of the output before the dispatch.
    pub(crate) before: Vec<u32>,
}

impl Trial {
    fn new(inputs: impl Into<Vec<Vec<u8>>>, arguments: &impl NoUninit, groups: [u32; 3]) -> Self {
        Self {
            inputs: inputs.into(),
            arguments: bytemuck::bytes_of(arguments).to_vec(),
            groups,
            before: Vec::new(),
        }
    }

    /// A trial over an output that the kernel changes in part.
    fn over<T: NoUninit>(self, before: &[T]) -> Self {
        let before = bytemuck::pod_collect_to_vec(&bytes(before));
        Self { before, ..self }
    }

    /// The kernel's memory before the dispatch.
    pub(crate) fn memory(&self, kernel: Kernel) -> Memory {
        let inputs = self.inputs.iter().map(Vec::as_slice);
        Memory::new(kernel, inputs, &self.arguments, self.before.clone())
    }

    /// The output after the dispatch.
    pub(crate) fn expected(&self, kernel: Kernel) -> Vec<u32> {
        let memory = self.memory(kernel);
        memory.run::<f32, ()>(self.groups, |_| ());
        memory.into_output()
    }

    /// Runs the trial on a device, over an output.
    pub(crate) fn run(&self, pipeline: &Pipeline, output: &mut [u8]) -> Result<(), VulkanError> {
        let inputs: Vec<&[u8]> = self.inputs.iter().map(Vec::as_slice).collect();
        run_on(pipeline, &inputs, &self.arguments, self.groups, output)
    }

    /// Runs the trial, and counts the values that differ, of all.
    fn differing(&self, kernel: Kernel, pipeline: &Pipeline) -> Result<[usize; 2], VulkanError> {
        self.differing_from(self.expected(kernel), pipeline)
    }

    /// Runs the trial, and counts the values that differ from an output, of all.
    pub(crate) fn differing_from(
        &self,
        mut expected: Vec<u32>,
        pipeline: &Pipeline,
    ) -> Result<[usize; 2], VulkanError> {
        expected.resize(expected.len() + GUARD, UNTOUCHED);
        let mut found = self.before.clone();
        found.resize(expected.len(), UNTOUCHED);
        self.run(pipeline, bytemuck::cast_slice_mut(&mut found))?;
        let pairs = found.iter().zip(&expected);
        let differing = pairs.filter(|(found, expected)| found != expected).count();
        Ok([differing, expected.len()])
    }
}

/// The bytes of a buffer.
fn bytes<T: NoUninit>(values: &[T]) -> Vec<u8> {
    bytemuck::cast_slice(values).to_vec()
}

/// Workgroups of 64 for this number of invocations, in one column or in one row.
fn groups(invocations: usize, in_row: bool) -> [u32; 3] {
    let count = (invocations as u32).div_ceil(64);
    match in_row {
        true => [count, 1, 1],
        false => [1, count, 1],
    }
}

/// Trials of a kernel; each call makes others.
pub(crate) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    match kernel {
        Kernel::SelfTest => vec![self_test::trial()],
        Kernel::FromKeysArcs | Kernel::FromKeysTwoKeys | Kernel::FromKeysCubics => {
            from_keys::trials(kernel, random)
        }
        Kernel::PrepareArcs => from_keys::arc_trials(random),
        Kernel::PosesAdd
        | Kernel::PosesBlend
        | Kernel::PosesMix
        | Kernel::PosesSmooth
        | Kernel::PosesSteps
        | Kernel::PosesWorld => poses::trials(kernel, random),
        Kernel::CrowdRotations
        | Kernel::CrowdPlainRotations
        | Kernel::CrowdLocals
        | Kernel::CrowdPlainLocals
        | Kernel::CrowdCompactRotations
        | Kernel::CrowdCompactLocals
        | Kernel::CrowdTimes
        | Kernel::CrowdWalk
        | Kernel::CrowdWalkAll
        | Kernel::CrowdSkin
        | Kernel::CrowdHalf
        | Kernel::CrowdGather
        | Kernel::CrowdScatter => crowd::trials(kernel, random),
        Kernel::CrowdWholeRotations
        | Kernel::CrowdPlainWholeRotations
        | Kernel::CrowdWholeMatrices
        | Kernel::CrowdPlainWholeMatrices
        | Kernel::CrowdCompactWholeRotations
        | Kernel::CrowdSubgroupRotations
        | Kernel::CrowdSubgroupRotationsF16 => whole_instances::trials(kernel, random),
        Kernel::MotionJoints
        | Kernel::MotionWalk
        | Kernel::MotionDifferences
        | Kernel::MotionStore
        | Kernel::MotionMatrices
        | Kernel::MotionTree
        | Kernel::MotionPick => motion::trials(kernel, random),
        _ => segments::trials(kernel, random),
    }
}

/// Runs the trials of a kernel through its pipeline.
pub(crate) fn check(kernel: Kernel, pipeline: &Pipeline) -> Result<KernelCheck, VulkanError> {
    let mut check = KernelCheck {
        name: pipeline.name,
        total: 0,
        differing: 0,
        remembered: false,
        replaced: false,
    };
    for trial in trials(kernel, &mut Random::canonical()) {
        let [differing, total] = trial.differing(kernel, pipeline)?;
        check.differing += differing;
        check.total += total;
    }
    check.replaced = check.differing > 0 && kernel.is_replaceable();
    Ok(check)
}
