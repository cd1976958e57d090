//! The recording of the states of a motion library's clips: joints in their parents' frames, the walk along the
//! skeleton, differences where velocities are those, and a copy of each array that is asked for.

use std::ops::Range;

use crate::output::encoding::Encoding;
use crate::output::states::StateArray;
use crate::shader::{Kernel, MOTION_WORKGROUP, MotionDispatch, STATE_VECTORS, WORKGROUP};
use crate::work::recording::{Recording, Resource, Set, workgroups};

/// The values that are computed of each instance.
#[derive(Clone, Copy)]
pub(crate) struct StatesShape<'a> {
    /// Joints of the skeleton.
    pub(crate) joints: u32,
    /// Joints that have a parent.
    pub(crate) links: u32,
    pub(crate) ticks_per_second: f32,
    pub(crate) arrays: &'a [StateArray],
    /// That of rotations: quaternions in f32, or numbers of matrices.
    pub(crate) rotations: Encoding,
    /// Whether velocities are differences between two samples, instead of derivatives.
    pub(crate) are_differences: bool,
    /// The number of instances of all windows.
    pub(crate) instances: usize,
}

impl StatesShape<'_> {
    /// The number of samples of an instance: itself, and those between which velocities are differences.
    pub(crate) fn samples(&self) -> u32 {
        if self.are_differences { 3 } else { 1 }
    }

    /// Bytes of the states of all samples of an instance.
    pub(crate) fn state_bytes(&self) -> u64 {
        u64::from(self.samples()) * u64::from(self.joints) * 16 * u64::from(STATE_VECTORS)
    }

    fn has_velocities(&self) -> bool {
        let mut arrays = self.arrays.iter();
        arrays.any(|array| {
            matches!(
                array,
                StateArray::Velocities | StateArray::AngularVelocities
            )
        })
    }
}

/// The tables and the buffers in a recording.
pub(crate) struct StatesResources {
    pub(crate) clips: Resource,
    pub(crate) bases: Resource,
    pub(crate) spans: Resource,
    pub(crate) channels: Resource,
    pub(crate) cells: Resource,
    pub(crate) links: Resource,
    /// Clips and ticks, window by window: those of the instances, then the ends of their steps.
    pub(crate) samples: Resource,
    /// Steps in a second, of each instance.
    pub(crate) rates: Resource,
    /// The states of a window.
    pub(crate) states: Resource,
    pub(crate) result: Resource,
}

/// Records a window of instances. `ranges` are those of the arrays in the result.
pub(crate) fn record_window(
    recording: &mut Recording,
    shape: &StatesShape<'_>,
    resources: &StatesResources,
    window: Range<u32>,
    ranges: &[Range<u64>],
) {
    const _: () = assert!(MOTION_WORKGROUP == WORKGROUP);
    let StatesResources {
        clips,
        bases,
        spans,
        channels,
        cells,
        links,
        samples,
        rates,
        states,
        result,
    } = *resources;
    let (joints, count) = (shape.joints, window.end - window.start);
    let all = count * shape.samples();
    let arguments = MotionDispatch {
        count: 0,
        first_sample: window.start * shape.samples(),
        joints,
        links: shape.links,
        moves: u32::from(shape.has_velocities() && !shape.are_differences),
        ticks_per_second: shape.ticks_per_second,
        vector: 0,
        numbers: 0,
        detail: 0,
    };
    let dispatch = |recording: &mut Recording, set: Set, arguments: MotionDispatch| {
        recording.dispatch(set, &arguments, workgroups(arguments.count));
    };
    let tables = [samples, clips, bases, spans, channels, cells, states];
    let set = recording.set(Kernel::MotionJoints, tables.map(Into::into));
    let of_joints = MotionDispatch {
        count: all * joints,
        ..arguments
    };
    dispatch(recording, set, of_joints);
    let is_in_world = shape
        .arrays
        .iter()
        .any(|&array| array != StateArray::Rotations);
    if is_in_world && shape.links > 0 {
        let set = recording.set(Kernel::MotionWalk, [links, states].map(Into::into));
        let of_samples = MotionDispatch {
            count: all,
            ..arguments
        };
        dispatch(recording, set, of_samples);
    }
    if shape.are_differences && shape.has_velocities() {
        let set = recording.set(Kernel::MotionDifferences, [rates, states].map(Into::into));
        let of_instances = MotionDispatch {
            count: count * joints,
            first_sample: window.start,
            ..arguments
        };
        dispatch(recording, set, of_instances);
    }
    for (array, range) in shape.arrays.iter().zip(ranges) {
        let encoding = array.encoding(shape.rotations);
        let numbers = encoding.components().len() as u32;
        let each = u64::from(joints) * encoding.bytes() as u64;
        let first = range.start + u64::from(window.start) * each;
        let output = result.slice(first, u64::from(count) * each);
        let (kernel, count) = match encoding {
            Encoding::F32 | Encoding::Vector => (Kernel::MotionStore, count * joints * numbers),
            _ => (Kernel::MotionMatrices, count * joints),
        };
        let set = recording.set(kernel, [states.into(), output]);
        let stored = MotionDispatch {
            count,
            vector: array.vector(),
            numbers,
            detail: encoding.row().detail,
            ..arguments
        };
        dispatch(recording, set, stored);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::recording::tests::letters;

    fn steps(arrays: &[StateArray], are_differences: bool, links: u32) -> String {
        let all = [Encoding::F32, Encoding::SixD]
            .map(|rotations| steps_with(arrays, rotations, are_differences, links));
        assert_eq!(all[0], all[1]);
        all[0].clone()
    }

    fn steps_with(
        arrays: &[StateArray],
        rotations: Encoding,
        are_differences: bool,
        links: u32,
    ) -> String {
        let mut recording = Recording::default();
        let mut next = || recording.resource();
        let resources = StatesResources {
            clips: next(),
            bases: next(),
            spans: next(),
            channels: next(),
            cells: next(),
            links: next(),
            samples: next(),
            rates: next(),
            states: next(),
            result: next(),
        };
        let shape = StatesShape {
            joints: 3,
            links,
            ticks_per_second: 30.0,
            arrays,
            rotations,
            are_differences,
            instances: 5,
        };
        let ranges = StateArray::ranges(arrays, rotations, 15);
        record_window(&mut recording, &shape, &resources, 0..5, &ranges);
        letters(&recording).replace("[Kernel>Kernel]", "|")
    }

    /// `|` waits for kernels. Arrays are stored side by side.
    #[test]
    fn each_step_waits_for_what_it_reads() {
        use StateArray::{Positions, Rotations, Velocities};
        assert_eq!(steps(&[Rotations], false, 2), "D|D");
        assert_eq!(steps(&[Rotations, Velocities], false, 2), "D|D|DD");
        assert_eq!(steps(&[Positions], false, 0), "D|D");
        assert_eq!(steps(&[Positions, Velocities], true, 2), "D|D|D|DD");
        assert_eq!(steps(&[Positions], true, 2), "D|D|D");
    }
}
