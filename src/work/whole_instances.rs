//! Instances that a card evaluates as wholes: one kernel has all steps of a frame, and a workgroup of it takes a few
//! instances, whose positions and matrices stay in its memory (`shaders/crowd/whole.wgsl`).

use crate::machine::crowd::CrowdCurves;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{
    CROWD_WORKGROUP, CrowdDispatch, CrowdPosition, CrowdWholeDispatch, Kernel, LINE_VECTORS,
    MAX_WHOLE_JOINTS, MAX_WHOLE_POSITIONS,
};

// Every Vulkan device has this much memory for a workgroup, and this many invocations in one.
const _: () = {
    let positions = MAX_WHOLE_POSITIONS as usize * size_of::<CrowdPosition>();
    let rows = 3 * MAX_WHOLE_JOINTS as usize * size_of::<[f32; 4]>();
    assert!(positions + rows <= 16_384 && CROWD_WORKGROUP <= 128);
};

/// How the instances of a crowd are evaluated as wholes, for one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct WholeInstances {
    pub(crate) kernel: Kernel,
    output: CrowdOutput,
    /// Instances of a workgroup.
    instances: u32,
}

impl WholeInstances {
    /// `None` if an instance is too large for a workgroup's memory.
    pub(crate) fn new(
        arguments: &CrowdDispatch,
        output: CrowdOutput,
        curves: CrowdCurves,
    ) -> Option<Self> {
        use CrowdCurves::{Any, Compact, Plain};
        let CrowdDispatch {
            joints,
            layers,
            bases,
            ..
        } = *arguments;
        let is_rotations = output.values == CrowdValues::Rotations;
        let room = (MAX_WHOLE_JOINTS / joints).min(MAX_WHOLE_POSITIONS / (layers * bases));
        // For matrices, an invocation finds its instance and its joint by operations on bits, without a division.
        // Therefore the number of instances must be a power of two.
        let is_divided = |instances: &u32| is_rotations || instances.is_power_of_two();
        // The number of iterations of a workgroup over its joints. Rotations are stored immediately. They may begin
        // within a line; then the invocations before them are idle.
        let line = LINE_VECTORS << u32::from(output.is_half);
        let rounds = |instances: u32| {
            let joints = instances * joints;
            let fills_lines = !is_rotations || joints.is_multiple_of(line);
            let idle = if fills_lines { 0 } else { line - 1 };
            (joints + idle).div_ceil(CROWD_WORKGROUP)
        };
        let instances = (1..=room)
            .filter(is_divided)
            .min_by(|&a, &b| (rounds(a) * b).cmp(&(rounds(b) * a)).then(b.cmp(&a)))?;
        Some(Self {
            kernel: match (is_rotations, curves) {
                (true, Plain) => Kernel::CrowdPlainWholeRotations,
                (true, Any) => Kernel::CrowdWholeRotations,
                (true, Compact) => Kernel::CrowdCompactWholeRotations,
                (false, Plain) => Kernel::CrowdPlainWholeMatrices,
                (false, Any) => Kernel::CrowdWholeMatrices,
                // One kernel for all steps would need 256 registers on AMD's cards, so there is a kernel for each step.
                (false, Compact) => return None,
            },
            output,
            instances,
        })
    }

    /// The arguments of a dispatch over as many instances as `arguments` counts, and how many workgroups it has.
    /// `levels` has the index of the first link of each level of the skeleton, and the end of the last level.
    pub(crate) fn dispatch(
        &self,
        arguments: CrowdDispatch,
        levels: &[u32],
    ) -> (CrowdWholeDispatch, u32) {
        use CrowdValues::{Model, Skinning};
        let level_count = levels.len() - 1;
        let walks = matches!(self.output.values, Model | Skinning);
        let pushed = CrowdWholeDispatch {
            count: arguments.count,
            first_instance: arguments.first_instance,
            joints: arguments.joints,
            layers: arguments.layers,
            bases: arguments.bases,
            first_link: levels[level_count],
            clock_low: arguments.clock_low,
            clock_high: arguments.clock_high,
            masks: arguments.masks,
            references: arguments.references,
            instances: self.instances,
            joint_share: joint_share(arguments.joints),
            levels: if walks { level_count as u32 } else { 0 },
            is_skinning: (self.output.values == Skinning).into(),
            is_half: self.output.is_half.into(),
        };
        (pushed, arguments.count.div_ceil(self.instances))
    }
}

/// The factor with which kernels compute the instance of a joint index by a multiplication: 2^20 divided by the number
/// of joints of an instance, rounded up.
pub(crate) fn joint_share(joints: u32) -> u32 {
    const SHARE_BITS: u32 = 20;
    (1u32 << SHARE_BITS).div_ceil(joints)
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::shader::MAX_SUBGROUP_JOINTS;

    fn instances(joints: u32, positions: [u32; 2], output: CrowdOutput) -> Option<u32> {
        let [layers, bases] = positions;
        let arguments = CrowdDispatch {
            joints,
            layers,
            bases,
            ..CrowdDispatch::zeroed()
        };
        let whole = WholeInstances::new(&arguments, output, CrowdCurves::Any);
        whole.map(|whole| whole.instances)
    }

    /// Each with how many instances keep most invocations busy.
    #[test]
    fn workgroups_have_as_many_instances_as_keep_them_busy() {
        let matrices = CrowdOutput::from(CrowdValues::Model);
        let rotations = CrowdOutput::from(CrowdValues::Rotations);
        for (joints, of_matrices, of_rotations) in [
            (1, 128, 128),
            (7, 32, 35),
            (20, 8, 12),
            (21, 8, 11),
            (60, 4, 4),
            (64, 4, 4),
            (65, 2, 3),
            (128, 2, 2),
            (129, 1, 1),
            (256, 1, 1),
        ] {
            assert_eq!(instances(joints, [1, 1], matrices), Some(of_matrices));
            assert_eq!(instances(joints, [1, 1], rotations), Some(of_rotations));
        }
        // In half precision a line has 16 rotations, so up to 15 invocations are idle at its start: 7 × 35 + 15 are
        // more than two rounds of 128 invocations.
        let half = CrowdOutput::half(CrowdValues::Rotations);
        assert_eq!(instances(7, [1, 1], half), Some(34));
    }

    /// Every joint of a workgroup or of a subgroup finds its instance by a product.
    #[test]
    fn joints_are_divided_among_instances() {
        for joints in 1..=MAX_SUBGROUP_JOINTS {
            let share = joint_share(joints);
            let all = joints.max(MAX_SUBGROUP_JOINTS / joints * joints);
            for index in [0, joints - 1, joints, all - 1, all / 2] {
                assert_eq!((index * share) >> 20, index / joints, "{index}, {joints}");
            }
        }
    }

    #[test]
    fn large_instances_are_not_evaluated_as_wholes() {
        for values in CrowdValues::ALL {
            let output = CrowdOutput::from(values);
            assert_eq!(instances(257, [1, 1], output), None);
            assert_eq!(instances(1, [4, 32], output), Some(1));
            assert_eq!(instances(1, [4, 33], output), None);
        }
    }
}
