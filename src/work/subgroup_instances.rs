//! Instances that a card's subgroups evaluate as wholes: as [`WholeInstances`](super::whole_instances::WholeInstances),
//! with neither memory of a workgroup nor barriers (`shaders/crowd/subgroup_rotations.wgsl`).

use crate::machine::crowd::CrowdCurves;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{
    CROWD_WORKGROUP, CrowdDispatch, CrowdSubgroupDispatch, Kernel, LINE_VECTORS,
    MAX_SUBGROUP_JOINTS, MAX_SUBGROUP_POSITIONS,
};
use crate::work::whole_instances::joint_share;

/// How the instances of a crowd are evaluated by subgroups, for one output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SubgroupInstances {
    /// Instances of a subgroup, as a power of two.
    instances_log2: u32,
    /// Lanes of a subgroup.
    lanes: u32,
    /// Whether values are stored in half precision.
    is_half: bool,
}

impl SubgroupInstances {
    /// The instances of a subgroup, for rotations of one layer of arcs. `None` for other crowds, and if no number of
    /// instances fits whose joints fill whole cache lines. Finding the times takes about as long as evaluating the
    /// joints of one instance. Therefore a subgroup gets as many instances as fit.
    pub(crate) fn new(
        arguments: &CrowdDispatch,
        output: CrowdOutput,
        curves: CrowdCurves,
        lanes: u32,
    ) -> Option<Self> {
        let CrowdDispatch { joints, bases, .. } = *arguments;
        let fits = |instances_log2: &u32| {
            let all = joints << instances_log2;
            bases << instances_log2 <= MAX_SUBGROUP_POSITIONS
                && all <= MAX_SUBGROUP_JOINTS
                && all.is_multiple_of(LINE_VECTORS << u32::from(output.is_half))
        };
        let largest = MAX_SUBGROUP_POSITIONS.ilog2();
        let instances_log2 = (0..=largest).rev().find(fits)?;
        let is_plain = curves == CrowdCurves::Plain;
        (is_plain && output.values == CrowdValues::Rotations).then_some(Self {
            instances_log2,
            lanes,
            is_half: output.is_half,
        })
    }

    pub(crate) fn kernel(self) -> Kernel {
        match self.is_half {
            true => Kernel::CrowdSubgroupRotationsF16,
            false => Kernel::CrowdSubgroupRotations,
        }
    }

    /// The arguments of a dispatch over as many instances as `arguments` counts, and how many workgroups it has.
    pub(crate) fn dispatch(self, arguments: &CrowdDispatch) -> (CrowdSubgroupDispatch, u32) {
        let subgroups = arguments.count.div_ceil(1 << self.instances_log2);
        let of_workgroup = (CROWD_WORKGROUP / self.lanes).max(1);
        let pushed = Self::pushed(self.instances_log2, arguments);
        (pushed, subgroups.div_ceil(of_workgroup))
    }

    /// The arguments of a dispatch whose subgroups take 2^`instances_log2` instances.
    pub(crate) fn pushed(instances_log2: u32, arguments: &CrowdDispatch) -> CrowdSubgroupDispatch {
        let positions = (arguments.bases << instances_log2).next_power_of_two();
        CrowdSubgroupDispatch {
            count: arguments.count,
            first_instance: arguments.first_instance,
            joints: arguments.joints,
            clock_low: arguments.clock_low,
            clock_high: arguments.clock_high,
            instances_log2,
            positions_log2: positions.ilog2(),
            // A mask in which every bit at a multiple of `positions` is set.
            position_lanes: u32::MAX / ((1 << positions) - 1),
            joint_share: joint_share(arguments.joints),
            detail: 0,
        }
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    fn arguments(joints: u32, bases: u32) -> CrowdDispatch {
        CrowdDispatch {
            count: 10_000,
            joints,
            bases,
            ..CrowdDispatch::zeroed()
        }
    }

    #[test]
    fn subgroups_take_as_many_instances_as_there_is_room_for() {
        let rotations = CrowdOutput::from(CrowdValues::Rotations);
        let instances = |joints, bases| {
            let found = SubgroupInstances::new(
                &arguments(joints, bases),
                rotations,
                CrowdCurves::Plain,
                32,
            );
            found.map(|found| 1 << found.instances_log2)
        };
        assert_eq!(instances(60, 1), Some(4));
        assert_eq!(instances(60, 2), Some(2));
        assert_eq!(instances(64, 4), Some(1));
        assert_eq!(instances(256, 1), Some(4));
        assert_eq!(instances(512, 1), Some(2));
        // Refused: joints that end within a line, too many time bases, and too many joints.
        assert_eq!(instances(21, 1), None);
        assert_eq!(instances(60, 3), None);
        assert_eq!(instances(64, 5), None);
        assert_eq!(instances(1032, 1), None);
        // In half precision, a line has twice as many values.
        let half = CrowdOutput::half(CrowdValues::Rotations);
        let of_half =
            |joints| SubgroupInstances::new(&arguments(joints, 1), half, CrowdCurves::Plain, 32);
        assert_eq!(of_half(60).map(|found| found.instances_log2), Some(2));
        assert_eq!(of_half(2), None);
    }

    #[test]
    fn other_outputs_have_other_kernels() {
        use CrowdCurves::{Any, Compact, Plain};
        let of = |output, curves| SubgroupInstances::new(&arguments(60, 1), output, curves, 32);
        let rotations = CrowdOutput::from(CrowdValues::Rotations);
        let half = CrowdOutput::half(CrowdValues::Rotations);
        let kernel = |output| of(output, Plain).map(|found| found.kernel() as usize);
        assert_eq!(
            kernel(rotations),
            Some(Kernel::CrowdSubgroupRotations as usize)
        );
        assert_eq!(
            kernel(half),
            Some(Kernel::CrowdSubgroupRotationsF16 as usize)
        );
        for curves in [Any, Compact] {
            assert!(of(rotations, curves).is_none() && of(half, curves).is_none());
        }
        assert_eq!(of(CrowdValues::Local.into(), Plain), None);
    }

    /// Every joint of a subgroup finds its instance by a product.
    #[test]
    fn joints_are_divided_among_instances() {
        let rotations = CrowdOutput::from(CrowdValues::Rotations);
        for joints in 1..=MAX_SUBGROUP_JOINTS {
            let arguments = arguments(joints, 1);
            let Some(found) = SubgroupInstances::new(&arguments, rotations, CrowdCurves::Plain, 32)
            else {
                continue;
            };
            let (pushed, groups) = found.dispatch(&arguments);
            assert_eq!(groups, (10_000u32 >> found.instances_log2).div_ceil(2));
            for index in 0..joints << found.instances_log2 {
                assert_eq!((index * pushed.joint_share) >> 20, index / joints);
            }
        }
    }
}
