//! The check of kernels: before the first result of a kernel is used, its output on the device is compared, bit for
//! bit, with the output of its twin for the same inputs.

mod crowd;
mod from_keys;
pub(crate) mod passes;
mod poses;
pub(crate) mod random;
mod segments;
pub(crate) mod self_test;
mod whole_instances;

use bytemuck::NoUninit;

use crate::gpu::pipeline::Pipeline;
use crate::gpu::run_once::run_on;
use crate::machine::error::VulkanError;
pub(crate) use crate::machine::reports::KernelCheck;
use crate::shader::Kernel;

#[cfg(test)]
pub(crate) use from_keys::StoredKey;

/// The contents of a result before a kernel runs, which stay where it stores nothing.
const UNTOUCHED: u32 = u32::MAX;

/// The number of values after a result that no kernel may write.
const GUARD: usize = 16;

/// One dispatch of a kernel: its inputs, and the output of its twin.
pub(super) struct Trial {
    /// The buffers that it reads, in the order of their bindings.
    inputs: Vec<Vec<u8>>,
    /// The push constants of the dispatch.
    arguments: Vec<u8>,
    groups: [u32; 3],
    /// The contents of the output before the dispatch.
    before: Vec<u32>,
    expected: Vec<u32>,
}

impl Trial {
    pub(super) fn new<const N: usize>(
        inputs: [Vec<u8>; N],
        arguments: &impl NoUninit,
        groups: [u32; 3],
    ) -> Self {
        Self {
            inputs: inputs.into(),
            arguments: bytemuck::bytes_of(arguments).to_vec(),
            groups,
            before: Vec::new(),
            expected: Vec::new(),
        }
    }

    /// Expects a value as the `index`th of its type.
    pub(super) fn expect<T: NoUninit>(&mut self, index: usize, value: &T) {
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(bytemuck::bytes_of(value));
        self.expect_words(index * words.len(), &words);
    }

    fn expect_words(&mut self, first: usize, words: &[u32]) {
        let end = first + words.len();
        if self.expected.len() < end {
            self.expected.resize(end, UNTOUCHED);
        }
        self.expected[first..end].copy_from_slice(words);
    }

    /// Runs the trial, and counts the values that differ.
    fn differing(&self, pipeline: &Pipeline) -> Result<usize, VulkanError> {
        let mut expected = self.expected.clone();
        expected.resize(expected.len() + GUARD, UNTOUCHED);
        let mut found = self.before.clone();
        found.resize(expected.len(), UNTOUCHED);
        let inputs: Vec<&[u8]> = self.inputs.iter().map(Vec::as_slice).collect();
        let output = bytemuck::cast_slice_mut(&mut found);
        run_on(pipeline, &inputs, &self.arguments, self.groups, output)?;
        let pairs = found.iter().zip(&expected);
        Ok(pairs.filter(|(found, expected)| found != expected).count())
    }
}

/// The bytes of a buffer.
pub(super) fn bytes<T: NoUninit>(values: &[T]) -> Vec<u8> {
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

fn trials(kernel: Kernel) -> Vec<Trial> {
    match kernel {
        Kernel::SelfTest => vec![self_test::trial()],
        Kernel::FromKeysArcs | Kernel::FromKeysTwoKeys | Kernel::FromKeysCubics => {
            from_keys::trials(kernel)
        }
        Kernel::PrepareArcs => from_keys::arc_trials(),
        Kernel::PosesAdd
        | Kernel::PosesBlend
        | Kernel::PosesMix
        | Kernel::PosesSmooth
        | Kernel::PosesSteps
        | Kernel::PosesWorld => poses::trials(kernel),
        Kernel::CrowdRotations
        | Kernel::CrowdPlainRotations
        | Kernel::CrowdLocals
        | Kernel::CrowdPlainLocals
        | Kernel::CrowdTimes
        | Kernel::CrowdWalk
        | Kernel::CrowdWalkAll
        | Kernel::CrowdSkin
        | Kernel::CrowdHalf
        | Kernel::CrowdGather
        | Kernel::CrowdScatter => crowd::trials(kernel),
        Kernel::CrowdWholeRotations
        | Kernel::CrowdPlainWholeRotations
        | Kernel::CrowdWholeMatrices
        | Kernel::CrowdPlainWholeMatrices => whole_instances::trials(kernel),
        _ => segments::trials(kernel),
    }
}

/// Runs the trials of a kernel through its pipeline.
pub(crate) fn check(kernel: Kernel, pipeline: &Pipeline) -> Result<KernelCheck, VulkanError> {
    let mut check = KernelCheck {
        name: pipeline.name,
        total: 0,
        differing: 0,
        remembered: false,
    };
    for trial in trials(kernel) {
        check.total += trial.expected.len() + GUARD;
        check.differing += trial.differing(pipeline)?;
    }
    Ok(check)
}
