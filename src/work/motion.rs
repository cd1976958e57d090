//! The recording of the states of a motion library's clips. Its steps are: joints in their parents' frames; the walk
//! along the skeleton or along the tree of a robot; differences, if velocities are differences; a copy of each
//! requested array.

use std::ops::Range;

use crate::output::encoding::Encoding;
use crate::output::states::{StoredArray, StoredNumbers};
use crate::shader::{Kernel, MOTION_WORKGROUP, MotionDispatch, STATE_VECTORS, WORKGROUP};
use crate::work::recording::{Recording, Resource, Set, workgroups};

/// The values that are computed of each instance.
#[derive(Clone, Copy)]
pub(crate) struct StatesShape<'a> {
    /// Joints of the skeleton.
    pub(crate) joints: u32,
    /// Joints that have a parent.
    pub(crate) links: u32,
    /// Frames of a robot's tree; 0 for a skeleton.
    pub(crate) frames: u32,
    pub(crate) ticks_per_second: f32,
    pub(crate) arrays: &'a [StoredArray],
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

    /// Bytes of the states of all samples of an instance: of its joints, and of its frames.
    pub(crate) fn state_bytes(&self) -> [u64; 2] {
        let state = u64::from(self.samples()) * 16 * u64::from(STATE_VECTORS);
        [self.joints, self.frames].map(|count| u64::from(count) * state)
    }

    fn has_velocities(&self) -> bool {
        self.arrays.iter().any(|array| array.needs_velocities)
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
    /// Clips and ticks, window by window: first of the instances, then of both ends of their steps.
    pub(crate) samples: Resource,
    /// Steps in a second, of each instance.
    pub(crate) rates: Resource,
    /// The states of a window.
    pub(crate) states: Resource,
    /// For a robot.
    pub(crate) tree: Option<TreeResources>,
    pub(crate) result: Resource,
}

/// The tables of a robot's tree, and the states of its frames in a window.
#[derive(Clone, Copy)]
pub(crate) struct TreeResources {
    pub(crate) frames: Resource,
    pub(crate) picks: Resource,
    pub(crate) states: Resource,
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
        tree,
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
    let of_samples = MotionDispatch {
        count: all,
        ..arguments
    };
    let walks = shape.arrays.iter().any(|array| array.needs_walk);
    if walks {
        if let Some(tree) = tree {
            let tables = [tree.frames, states, tree.states];
            let set = recording.set(Kernel::MotionTree, tables.map(Into::into));
            let of_frames = MotionDispatch {
                links: shape.frames,
                ..of_samples
            };
            dispatch(recording, set, of_frames);
        } else if shape.links > 0 {
            let set = recording.set(Kernel::MotionWalk, [links, states].map(Into::into));
            dispatch(recording, set, of_samples);
        }
    }
    if shape.are_differences && shape.has_velocities() {
        let of_frames = tree.filter(|_| walks);
        let of_frames = of_frames.map(|tree| (shape.frames, tree.states));
        for (joints, states) in [(joints, states)].into_iter().chain(of_frames) {
            let set = recording.set(Kernel::MotionDifferences, [rates, states].map(Into::into));
            let of_instances = MotionDispatch {
                count: count * joints,
                first_sample: window.start,
                joints,
                ..arguments
            };
            dispatch(recording, set, of_instances);
        }
    }
    for (array, range) in shape.arrays.iter().zip(ranges) {
        let each = 4 * u64::from(array.numbers);
        let first = range.start + u64::from(window.start) * each;
        let output = result.slice(first, u64::from(count) * each);
        let of_array = MotionDispatch {
            count: count * array.numbers,
            ..arguments
        };
        match (array.from, tree) {
            (StoredNumbers::OfJoints { vector, encoding }, _) => {
                let (kernel, count) = match encoding {
                    Encoding::F32 | Encoding::Vector => (Kernel::MotionStore, of_array.count),
                    _ => (Kernel::MotionMatrices, count * joints),
                };
                let set = recording.set(kernel, [states.into(), output]);
                let stored = MotionDispatch {
                    count,
                    vector,
                    numbers: encoding.components().len() as u32,
                    detail: encoding.row().detail,
                    ..of_array
                };
                dispatch(recording, set, stored);
            }
            (StoredNumbers::Picked { first, of_frames }, Some(tree)) => {
                let (joints, states) = match of_frames {
                    true => (shape.frames, tree.states),
                    false => (joints, states),
                };
                let bound = [tree.picks.into(), states.into(), output];
                let set = recording.set(Kernel::MotionPick, bound);
                let stored = MotionDispatch {
                    vector: first,
                    numbers: array.numbers,
                    joints: joints * STATE_VECTORS,
                    ..of_array
                };
                dispatch(recording, set, stored);
            }
            // Never happens: only requests with a tree have such arrays.
            (StoredNumbers::Picked { .. }, None) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::states::StateArray;
    use crate::work::recording::tests::letters;

    fn steps(arrays: &[StateArray], are_differences: bool, links: u32) -> String {
        let all = [Encoding::F32, Encoding::SixD].map(|rotations| {
            let stored = arrays.iter().map(|array| array.stored(3, rotations));
            let stored: Vec<StoredArray> = stored.collect();
            steps_of(&stored, are_differences, links, 0)
        });
        assert_eq!(all[0], all[1]);
        all[0].clone()
    }

    fn steps_of(arrays: &[StoredArray], are_differences: bool, links: u32, frames: u32) -> String {
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
            tree: (frames > 0).then(|| TreeResources {
                frames: next(),
                picks: next(),
                states: next(),
            }),
            result: next(),
        };
        let shape = StatesShape {
            joints: 3,
            links,
            frames,
            ticks_per_second: 30.0,
            arrays,
            are_differences,
            instances: 5,
        };
        let ranges = StoredArray::ranges(arrays, 5);
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

    #[test]
    fn bodies_wait_for_the_walk_along_the_tree() {
        let picked = |of_frames, needs_velocities| StoredArray {
            numbers: 2,
            from: StoredNumbers::Picked {
                first: 0,
                of_frames,
            },
            needs_walk: of_frames,
            needs_velocities,
        };
        let joints = picked(false, true);
        let (positions, velocities) = (picked(true, false), picked(true, true));
        assert_eq!(steps_of(&[joints], false, 0, 4), "D|D");
        let both = [joints, positions];
        // The values of joints do not wait for the walk.
        assert_eq!(steps_of(&both, false, 0, 4), "D|DD|D");
        let all = [joints, positions, velocities];
        // The differences of tracks and of frames do not wait for each other.
        assert_eq!(steps_of(&all, true, 0, 4), "D|D|DD|DDD");
    }
}
