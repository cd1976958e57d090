//! The recording of a crowd's frames, whose steps and their order are those of [`FrameStep`].

use crate::machine::crowd::{
    ChannelForms, CrowdCurves, CrowdFrame, EntryChanges, VisibleInstances,
};
use crate::output::crowd::{CrowdOutput, CrowdStage, FrameStep};
use crate::shader::{
    CROWD_WORKGROUP, CrowdDispatch, CrowdEntry, CrowdPosition, Kernel, MAX_WALKED, WORKGROUP,
};
use crate::work::recording::{Recording, Resource, Set, Slice, workgroups};
use crate::work::subgroup_instances::SubgroupInstances;
use crate::work::whole_instances::WholeInstances;

/// The skeleton and the clips of a crowd, as far as its dispatches depend on them.
#[derive(Clone)]
pub(crate) struct CrowdShape {
    /// The first link of each level of the skeleton below the roots, then the number of links.
    pub(crate) levels: Vec<u32>,
    pub(crate) forms: ChannelForms,
    /// The push constants that all dispatches share.
    pub(crate) arguments: CrowdDispatch,
}

impl CrowdShape {
    /// Which kernels evaluate the channels.
    fn curves(&self) -> CrowdCurves {
        CrowdCurves::new(self.forms, self.arguments.layers)
    }

    /// The kernel of a step that is taken by itself.
    fn kernel(&self, step: FrameStep, device: &CrowdDevice<'_>) -> Kernel {
        let walks_at_once = device.maps_samples && self.arguments.joints <= MAX_WALKED;
        use CrowdCurves::{Any, Compact, Plain};
        match (step, self.curves()) {
            (FrameStep::Positions, _) => Kernel::CrowdTimes,
            (FrameStep::Rotations, Plain) => Kernel::CrowdPlainRotations,
            (FrameStep::Rotations, Any) => Kernel::CrowdRotations,
            (FrameStep::Rotations, Compact) => Kernel::CrowdCompactRotations,
            (FrameStep::Locals, Plain) => Kernel::CrowdPlainLocals,
            (FrameStep::Locals, Any) => Kernel::CrowdLocals,
            (FrameStep::Locals, Compact) => Kernel::CrowdCompactLocals,
            (FrameStep::Walk, _) if walks_at_once => Kernel::CrowdWalkAll,
            (FrameStep::Walk, _) => Kernel::CrowdWalk,
            (FrameStep::Skin, _) => Kernel::CrowdSkin,
            (FrameStep::Half, _) => Kernel::CrowdHalf,
        }
    }

    /// Bytes of the positions of the layers of one instance.
    pub(crate) fn position_bytes(&self) -> u64 {
        let CrowdDispatch { layers, bases, .. } = self.arguments;
        size_of::<CrowdPosition>() as u64 * u64::from(layers) * u64::from(bases)
    }

    /// Bytes of the entries of one instance.
    pub(crate) fn entry_bytes(&self) -> u64 {
        size_of::<CrowdEntry>() as u64 * u64::from(self.arguments.layers)
    }

    /// Bytes of the result of one instance.
    pub(crate) fn bytes(&self, output: CrowdOutput) -> u64 {
        u64::from(self.arguments.joints) * output.bytes() as u64
    }
}

/// The properties of a device that choose the kernels of a frame.
pub(crate) struct CrowdDevice<'a> {
    /// Whether neighbouring invocations run at once. Software devices run those of a workgroup one after another, and
    /// stop at each barrier.
    pub(crate) maps_samples: bool,
    /// The lanes of its subgroups, if they can do all that kernels need.
    pub(crate) subgroup_lanes: Option<u32>,
    /// Whether the device can run a kernel, and gives the CPU's bits with it.
    pub(crate) runs: &'a dyn Fn(Kernel) -> bool,
}

/// The kernel that evaluates whole instances: one kernel for all steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum WholeKernel {
    Subgroups(SubgroupInstances),
    Workgroups(WholeInstances),
}

impl WholeKernel {
    /// The kernel that a device uses, if it has one for whole instances: the one by subgroups if the device supports it.
    fn new(
        arguments: &CrowdDispatch,
        output: CrowdOutput,
        curves: CrowdCurves,
        device: &CrowdDevice<'_>,
    ) -> Option<Self> {
        let by_subgroups = device.subgroup_lanes.and_then(|lanes| {
            SubgroupInstances::new(arguments, output, curves, lanes).map(Self::Subgroups)
        });
        let by_workgroups = WholeInstances::new(arguments, output, curves).map(Self::Workgroups);
        let runs = |whole: &Self| device.maps_samples && (device.runs)(whole.kernel());
        by_subgroups.filter(runs).or(by_workgroups.filter(runs))
    }

    fn kernel(&self) -> Kernel {
        match self {
            Self::Subgroups(whole) => whole.kernel(),
            Self::Workgroups(whole) => whole.kernel,
        }
    }
}

/// The kernels that evaluate frames of a crowd.
pub(crate) struct FrameKernels {
    output: CrowdOutput,
    /// The kernel that evaluates whole instances, if one kernel does all steps.
    pub(crate) whole: Option<WholeKernel>,
    /// The kernels, in their order.
    pub(crate) kernels: Vec<Kernel>,
}

impl FrameKernels {
    pub(crate) fn new(shape: &CrowdShape, output: CrowdOutput, device: &CrowdDevice<'_>) -> Self {
        let whole = WholeKernel::new(&shape.arguments, output, shape.curves(), device);
        let of_step = |step| shape.kernel(step, device);
        Self {
            output,
            kernels: match &whole {
                Some(whole) => vec![whole.kernel()],
                None => FrameStep::of(output).map(of_step).collect(),
            },
            whole,
        }
    }

    /// The kernels of a stage, whose matrices are in the result's memory already.
    pub(crate) fn of_stage(
        shape: &CrowdShape,
        stage: CrowdStage,
        device: &CrowdDevice<'_>,
    ) -> Self {
        let of_step = |step| shape.kernel(step, device);
        Self {
            output: stage.output(),
            kernels: FrameStep::of_stage(stage).map(of_step).collect(),
            whole: None,
        }
    }

    /// Records a kernel over the instances of a window.
    fn dispatch(
        &self,
        recording: &mut Recording,
        (kernel, set): (Kernel, Set),
        levels: &[u32],
        instances: u32,
        arguments: CrowdDispatch,
    ) {
        const _: () = assert!(CROWD_WORKGROUP == WORKGROUP);
        let joints = instances * arguments.joints;
        if let Some(whole) = &self.whole {
            let count = instances;
            let arguments = CrowdDispatch { count, ..arguments };
            return match whole {
                WholeKernel::Subgroups(whole) => {
                    let (pushed, groups) = whole.dispatch(&arguments);
                    recording.dispatch(set, &pushed, [groups, 1, 1]);
                }
                WholeKernel::Workgroups(whole) => {
                    let (pushed, groups) = whole.dispatch(arguments, levels);
                    recording.dispatch(set, &pushed, [groups, 1, 1]);
                }
            };
        }
        let count = match kernel {
            Kernel::CrowdTimes => instances * arguments.layers * arguments.bases,
            Kernel::CrowdSkin => 3 * joints,
            Kernel::CrowdHalf => joints * self.output.vector_count() as u32,
            Kernel::CrowdWalkAll => {
                let level_count = levels.len() - 1;
                let walk = CrowdDispatch {
                    count: instances,
                    layers: level_count as u32,
                    first_link: levels[level_count],
                    ..arguments
                };
                return recording.dispatch(set, &walk, [instances, 1, 1]);
            }
            Kernel::CrowdWalk => {
                for level in levels.windows(2).filter(|level| level[0] < level[1]) {
                    let joints = level[1] - level[0];
                    let count = instances * joints;
                    let walk = CrowdDispatch {
                        count,
                        joints,
                        layers: arguments.joints,
                        first_link: level[0],
                        ..arguments
                    };
                    recording.dispatch(set, &walk, workgroups(count));
                }
                return;
            }
            _ => joints,
        };
        recording.dispatch(
            set,
            &CrowdDispatch { count, ..arguments },
            workgroups(count),
        );
    }
}

/// The tables and the buffers of a crowd in a recording.
pub(crate) struct CrowdResources {
    pub(crate) clips: Resource,
    pub(crate) bases: Resource,
    pub(crate) spans: Resource,
    pub(crate) channels: Resource,
    pub(crate) cells: Resource,
    pub(crate) links: Resource,
    pub(crate) bind: Resource,
    /// All entries, `[instance][layer]`.
    pub(crate) entries: Resource,
    /// Changed entries, before they are copied to the others.
    pub(crate) changes: Resource,
    /// The visible instances.
    pub(crate) visible: Resource,
    /// The entries of a window's visible instances.
    pub(crate) gathered: Resource,
    /// The position of each layer of a window's instances in its clip.
    pub(crate) positions: Resource,
    /// The values of a window in 32 bits, if a kernel rounds them to 16 bits.
    pub(crate) values: Option<Resource>,
    pub(crate) result: Resource,
}

/// The inputs of a frame's recording.
const VISIBLE: usize = 0;
const CHANGES: usize = 1;

/// The bytes of a frame that its recording writes.
pub(crate) fn inputs<'a>(frame: &CrowdFrame<'a>) -> [&'a [u8]; 2] {
    let visible = match frame.visible {
        VisibleInstances::List(list) => bytemuck::cast_slice(list),
        VisibleInstances::All | VisibleInstances::AsBefore => &[],
    };
    let changes = match frame.changes {
        EntryChanges::None => &[],
        EntryChanges::Range(_, changed) => bytemuck::cast_slice(changed),
        EntryChanges::List(list) => bytemuck::cast_slice(list),
    };
    let mut inputs: [&[u8]; 2] = [&[]; 2];
    (inputs[VISIBLE], inputs[CHANGES]) = (visible, changes);
    inputs
}

/// Frames of a crowd in a recording, whose kernels are bound.
pub(crate) struct Frames {
    shape: CrowdShape,
    kernels: FrameKernels,
    resources: CrowdResources,
    scatter: Set,
    gather: Set,
    /// The number of instances of a window.
    window: u32,
    windows: Vec<WindowSets>,
}

/// The sets of a window's kernels.
struct WindowSets {
    all: Vec<Set>,
    /// The sets of those that read entries, for gathered entries.
    on_gathered: Vec<Set>,
}

impl Frames {
    /// Adds the sets for windows of `window` instances, `room` in all.
    pub(crate) fn new(
        recording: &mut Recording,
        shape: CrowdShape,
        kernels: FrameKernels,
        resources: CrowdResources,
        [window, room]: [u32; 2],
    ) -> Self {
        let CrowdResources {
            entries,
            changes,
            visible,
            gathered,
            values,
            result,
            ..
        } = resources;
        let slices = |resources: &[Resource]| -> Vec<Slice> {
            resources.iter().map(|&resource| resource.into()).collect()
        };
        let scatter = recording.set(Kernel::CrowdScatter, slices(&[changes, entries]));
        let gather = recording.set(Kernel::CrowdGather, slices(&[entries, visible, gathered]));
        let each = shape.bytes(kernels.output);
        let windows = (0..room).step_by(window as usize).map(|first| {
            let count = window.min(room - first);
            let output = result.slice(u64::from(first) * each, u64::from(count) * each);
            let values = values.map_or(output, Slice::from);
            let mut sets = |kernels: &[Kernel], entries: Resource| -> Vec<Set> {
                let bound = kernels.iter().map(|&kernel| {
                    let bindings = resources.bindings(kernel, entries, values, output);
                    recording.set(kernel, bindings)
                });
                bound.collect()
            };
            let read_entries = &kernels.kernels[..kernels.kernels.len().min(2)];
            WindowSets {
                all: sets(&kernels.kernels, entries),
                on_gathered: sets(read_entries, gathered),
            }
        });
        let windows = windows.collect();
        Self {
            shape,
            kernels,
            resources,
            scatter,
            gather,
            window,
            windows,
        }
    }

    /// Records a frame with at most as many instances as there is room for: the changes that the device does not know
    /// yet, then the dispatches. The inputs of the recording are [`inputs`].
    pub(crate) fn record(&self, recording: &mut Recording, frame: &CrowdFrame<'_>) {
        // Earlier evaluations may still use the crowd's buffers, and any work may use the result's buffer.
        recording.wait_for_all();
        self.record_changes(recording, frame);
        let arguments = CrowdDispatch {
            clock_low: frame.clock as u32,
            clock_high: (frame.clock >> 32) as u32,
            ..self.shape.arguments
        };
        let is_gathered = frame.visible != VisibleInstances::All;
        let firsts = (0..frame.instances).step_by(self.window as usize);
        for (first_instance, window) in firsts.zip(&self.windows) {
            let instances = self.window.min(frame.instances - first_instance);
            let mut arguments = CrowdDispatch {
                first_instance,
                ..arguments
            };
            let mut read_entries = window.all.as_slice();
            if is_gathered {
                let count = instances * arguments.layers;
                let gathered = CrowdDispatch { count, ..arguments };
                recording.dispatch(self.gather, &gathered, workgroups(count));
                read_entries = &window.on_gathered;
            }
            for (index, (&kernel, &set)) in self.kernels.kernels.iter().zip(&window.all).enumerate()
            {
                let set = *read_entries.get(index).unwrap_or(&set);
                arguments.first_instance = match is_gathered && index < read_entries.len() {
                    true => 0,
                    false => first_instance,
                };
                let levels = &self.shape.levels;
                (self.kernels).dispatch(recording, (kernel, set), levels, instances, arguments);
            }
        }
        recording.publish();
    }

    fn record_changes(&self, recording: &mut Recording, frame: &CrowdFrame<'_>) {
        let CrowdResources {
            entries,
            changes,
            visible,
            ..
        } = self.resources;
        if let VisibleInstances::List(list) = frame.visible {
            let size = size_of_val(list) as u64;
            recording.write_input(visible.slice(0, size), VISIBLE);
        }
        match frame.changes {
            EntryChanges::None => {}
            EntryChanges::Range(first, changed) => {
                let offset = first * size_of::<CrowdEntry>();
                let to = entries.slice(offset as u64, size_of_val(changed) as u64);
                recording.write_input(to, CHANGES);
            }
            EntryChanges::List(list) => {
                let size = size_of_val(list) as u64;
                recording.write_input(changes.slice(0, size), CHANGES);
                let count = list.len() as u32;
                let arguments = CrowdDispatch {
                    count,
                    ..self.shape.arguments
                };
                recording.dispatch(self.scatter, &arguments, workgroups(count));
            }
        }
    }
}

/// Stages of a crowd in a recording, whose kernels are bound. They change matrices in place.
pub(crate) struct Stages {
    shape: CrowdShape,
    kernels: FrameKernels,
    /// The number of instances of a window.
    window: u32,
    /// The sets of each window's kernels.
    windows: Vec<Vec<Set>>,
}

/// The tables of a crowd and the memory of the matrices in a recording of stages.
pub(crate) struct StageResources {
    pub(crate) links: Resource,
    pub(crate) bind: Resource,
    pub(crate) matrices: Resource,
}

impl Stages {
    /// Adds the sets for windows of `window` instances, `room` in all.
    pub(crate) fn new(
        recording: &mut Recording,
        shape: CrowdShape,
        kernels: FrameKernels,
        resources: &StageResources,
        [window, room]: [u32; 2],
    ) -> Self {
        let each = shape.bytes(kernels.output);
        let windows = (0..room).step_by(window as usize).map(|first| {
            let count = window.min(room - first);
            let matrices =
                (resources.matrices).slice(u64::from(first) * each, u64::from(count) * each);
            let sets = kernels.kernels.iter().map(|&kernel| {
                let table = match kernel {
                    Kernel::CrowdSkin => resources.bind,
                    _ => resources.links,
                };
                recording.set(kernel, [table.into(), matrices])
            });
            sets.collect()
        });
        let windows = windows.collect();
        Self {
            shape,
            kernels,
            window,
            windows,
        }
    }

    /// Records the stages of the first instances, at most as many as there is room for.
    pub(crate) fn record(&self, recording: &mut Recording, instances: u32) {
        recording.wait_for_all();
        let firsts = (0..instances).step_by(self.window as usize);
        for (first, sets) in firsts.zip(&self.windows) {
            let count = self.window.min(instances - first);
            for (&kernel, &set) in self.kernels.kernels.iter().zip(sets) {
                let (levels, arguments) = (&self.shape.levels, self.shape.arguments);
                (self.kernels).dispatch(recording, (kernel, set), levels, count, arguments);
            }
        }
        recording.publish();
    }
}

impl CrowdResources {
    /// The resources that a kernel binds.
    fn bindings(
        &self,
        kernel: Kernel,
        entries: Resource,
        values: Slice,
        output: Slice,
    ) -> Vec<Slice> {
        let Self {
            clips,
            bases,
            spans,
            channels,
            cells,
            links,
            bind,
            positions,
            ..
        } = *self;
        let (read, written): (&[Resource], &[Slice]) = match kernel {
            Kernel::CrowdTimes => (&[entries, clips, bases, spans], &[positions.into()]),
            Kernel::CrowdWalk | Kernel::CrowdWalkAll => (&[links], &[values]),
            Kernel::CrowdSkin => (&[bind], &[values]),
            Kernel::CrowdHalf => (&[], &[values, output]),
            Kernel::CrowdRotations
            | Kernel::CrowdPlainRotations
            | Kernel::CrowdCompactRotations
            | Kernel::CrowdLocals
            | Kernel::CrowdPlainLocals
            | Kernel::CrowdCompactLocals => (&[entries, channels, cells, positions], &[values]),
            Kernel::CrowdSubgroupRotations | Kernel::CrowdSubgroupRotationsF16 => {
                (&[entries, clips, bases, spans, channels, cells], &[output])
            }
            // Over whole instances: the result is bound in both precisions.
            Kernel::CrowdWholeRotations
            | Kernel::CrowdPlainWholeRotations
            | Kernel::CrowdCompactWholeRotations => (
                &[entries, clips, bases, spans, channels, cells],
                &[output; 2],
            ),
            _ => (
                &[entries, clips, bases, spans, channels, cells, links, bind],
                &[output; 2],
            ),
        };
        let read = read.iter().map(|&resource| resource.into());
        read.chain(written.iter().copied()).collect()
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::output::crowd::CrowdValues;
    use crate::shader::CrowdChange;
    use crate::work::recording::tests::letters;

    /// Instances of three joints on two levels.
    fn shape() -> CrowdShape {
        CrowdShape {
            levels: vec![0, 1, 1, 2],
            forms: ChannelForms::Arcs,
            arguments: CrowdDispatch {
                joints: 3,
                layers: 1,
                bases: 1,
                ..CrowdDispatch::zeroed()
            },
        }
    }

    fn device(maps_samples: bool) -> CrowdDevice<'static> {
        CrowdDevice {
            maps_samples,
            subgroup_lanes: None,
            runs: &|_| true,
        }
    }

    /// The steps of a recording: `^` waits for all that was before, `|` for kernels.
    fn short(recording: &Recording) -> String {
        let [all, kernel] = ["[Any>KernelAndCopy]", "[Kernel>Kernel]"];
        letters(recording).replace(all, "^").replace(kernel, "|")
    }

    /// The steps of a frame of 40 instances, in windows of 32.
    fn steps(output: CrowdOutput, maps_samples: bool, frame: &CrowdFrame<'_>) -> String {
        let mut recording = Recording::default();
        let shape = shape();
        let kernels = FrameKernels::new(&shape, output, &device(maps_samples));
        let has_values = output.is_half && kernels.whole.is_none();
        let mut next = || recording.resource();
        let resources = CrowdResources {
            clips: next(),
            bases: next(),
            spans: next(),
            channels: next(),
            cells: next(),
            links: next(),
            bind: next(),
            entries: next(),
            changes: next(),
            visible: next(),
            gathered: next(),
            positions: next(),
            result: next(),
            values: has_values.then(next),
        };
        let frames = Frames::new(&mut recording, shape, kernels, resources, [32, 40]);
        frames.record(&mut recording, frame);
        short(&recording)
    }

    fn frame<'a>(changes: EntryChanges<'a>, visible: VisibleInstances<'a>) -> CrowdFrame<'a> {
        CrowdFrame {
            clock: 7,
            changes,
            instances: 40,
            visible,
        }
    }

    /// A level without links has no dispatch.
    #[test]
    fn each_step_waits_for_what_it_reads() {
        let half = CrowdOutput::half(CrowdValues::Skinning);
        let unchanged = || frame(EntryChanges::None, VisibleInstances::All);
        // The next window may overwrite the positions without a further barrier, because a later step of this window
        // has already waited for the step that reads them.
        let window = "D|D|D|D|D|D";
        let expected = format!("^{window}{window}[Kernel>Any]");
        assert_eq!(steps(half, false, &unchanged()), expected);
        let rotations = CrowdValues::Rotations.into();
        assert_eq!(
            steps(rotations, false, &unchanged()),
            "^D|D|D|D[Kernel>Any]"
        );
        // With whole instances, windows do not depend on each other.
        assert_eq!(steps(half, true, &unchanged()), "^DD[Kernel>Any]");
    }

    /// Stages wait for the matrices, and each for the stage before it.
    #[test]
    fn stages_are_the_last_steps_of_a_frame() {
        use CrowdStage::{LocalToModel, LocalToSkinning, ModelToSkinning};
        let stages = |stage, maps_samples, instances| {
            let mut recording = Recording::default();
            let shape = shape();
            let kernels = FrameKernels::of_stage(&shape, stage, &device(maps_samples));
            let mut next = || recording.resource();
            let resources = StageResources {
                links: next(),
                bind: next(),
                matrices: next(),
            };
            let stages = Stages::new(&mut recording, shape, kernels, &resources, [32, 40]);
            stages.record(&mut recording, instances);
            short(&recording)
        };
        assert_eq!(stages(LocalToModel, false, 32), "^D|D[Kernel>Any]");
        assert_eq!(stages(ModelToSkinning, false, 32), "^D[Kernel>Any]");
        assert_eq!(stages(LocalToSkinning, false, 32), "^D|D|D[Kernel>Any]");
        assert_eq!(stages(LocalToSkinning, true, 32), "^D|D[Kernel>Any]");
        assert_eq!(stages(LocalToSkinning, true, 40), "^D|D|D|D[Kernel>Any]");
        assert_eq!(stages(LocalToModel, true, 0), "^");
    }

    #[test]
    fn changes_come_before_all_that_read_them() {
        let (entries, change) = ([CrowdEntry::zeroed()], CrowdChange::zeroed());
        let rotations = CrowdValues::Rotations.into();
        let listed = [3, 1];
        let range = frame(EntryChanges::Range(2, &entries), VisibleInstances::All);
        let after = "D|D|D|D[KernelAndCopy>Any]";
        let expected = format!("^W[Copy>Kernel]{after}");
        assert_eq!(steps(rotations, false, &range), expected);
        let changes = [change];
        let both = frame(
            EntryChanges::List(&changes),
            VisibleInstances::List(&listed),
        );
        let after = "D|D|D|D|D|D[KernelAndCopy>Any]";
        let expected = format!("^WW[Copy>Kernel]D|{after}");
        assert_eq!(steps(rotations, false, &both), expected);
        let [visible, changed] = inputs(&both);
        assert_eq!(visible, bytemuck::cast_slice::<u32, u8>(&listed));
        assert_eq!(changed, bytemuck::bytes_of(&change));
    }
}
