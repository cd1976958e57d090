//! Instances that a card evaluates as wholes: one kernel has all steps of a frame, and a workgroup of it takes a few
//! instances, whose positions and matrices stay in its memory (`shaders/crowd/whole.wgsl`).

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
    /// `None` where an instance is too large for a workgroup's memory. `is_plain` says that instances have one layer,
    /// and that all rotations are arcs.
    pub(crate) fn new(
        arguments: &CrowdDispatch,
        output: CrowdOutput,
        is_plain: bool,
    ) -> Option<Self> {
        let CrowdDispatch {
            joints,
            layers,
            bases,
            ..
        } = *arguments;
        let is_rotations = output.values == CrowdValues::Rotations;
        let room = (MAX_WHOLE_JOINTS / joints).min(MAX_WHOLE_POSITIONS / (layers * bases));
        // The number of iterations of a workgroup over its joints. Rotations are stored immediately. They may begin
        // within a line; then the invocations before them are idle.
        let line = LINE_VECTORS << u32::from(output.is_half);
        let rounds = |instances: u32| {
            let joints = instances * joints;
            let fills_lines = !is_rotations || joints.is_multiple_of(line);
            let idle = if fills_lines { 0 } else { line - 1 };
            (joints + idle).div_ceil(CROWD_WORKGROUP)
        };
        let instances =
            (1..=room).min_by(|&a, &b| (rounds(a) * b).cmp(&(rounds(b) * a)).then(b.cmp(&a)))?;
        Some(Self {
            kernel: match (is_rotations, is_plain) {
                (true, true) => Kernel::CrowdPlainWholeRotations,
                (true, false) => Kernel::CrowdWholeRotations,
                (false, true) => Kernel::CrowdPlainWholeMatrices,
                (false, false) => Kernel::CrowdWholeMatrices,
            },
            output,
            instances,
        })
    }

    /// The arguments of a dispatch over as many instances as `arguments` counts, and how many workgroups it has.
    /// `levels` says where the levels of the skeleton begin among the links, and where they end.
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
            levels: if walks { level_count as u32 } else { 0 },
            is_skinning: (self.output.values == Skinning).into(),
            is_half: self.output.is_half.into(),
        };
        (pushed, arguments.count.div_ceil(self.instances))
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    fn instances(joints: u32, positions: [u32; 2], output: CrowdOutput) -> Option<u32> {
        let [layers, bases] = positions;
        let arguments = CrowdDispatch {
            joints,
            layers,
            bases,
            ..CrowdDispatch::zeroed()
        };
        let whole = WholeInstances::new(&arguments, output, false);
        whole.map(|whole| whole.instances)
    }

    /// Each with how many instances keep most invocations busy.
    #[test]
    fn workgroups_have_as_many_instances_as_keep_them_busy() {
        let matrices = CrowdOutput::from(CrowdValues::Model);
        let rotations = CrowdOutput::from(CrowdValues::Rotations);
        for (joints, of_matrices, of_rotations) in [
            (1, 128, 128),
            (7, 18, 17),
            (20, 6, 6),
            (21, 6, 5),
            (60, 2, 2),
            (64, 2, 2),
            (65, 1, 1),
            (128, 1, 1),
        ] {
            assert_eq!(instances(joints, [1, 1], matrices), Some(of_matrices));
            assert_eq!(instances(joints, [1, 1], rotations), Some(of_rotations));
        }
        // In half precision, a line has twice as many values, and 20 × 6 values end within a line.
        let half = CrowdOutput::half(CrowdValues::Rotations);
        assert_eq!(instances(20, [1, 1], half), Some(5));
    }

    #[test]
    fn large_instances_are_not_evaluated_as_wholes() {
        for values in CrowdValues::ALL {
            let output = CrowdOutput::from(values);
            assert_eq!(instances(129, [1, 1], output), None);
            assert_eq!(instances(1, [4, 32], output), Some(1));
            assert_eq!(instances(1, [4, 33], output), None);
        }
    }
}
