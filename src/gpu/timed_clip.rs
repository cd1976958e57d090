//! Samples of a clip at times that are known only when they are recorded: the host finds the segment of each sample,
//! and the commands contain the list of these.

use std::sync::{Arc, Mutex};

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::clip::ResultRange;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::handles::VulkanBuffer;
use crate::gpu::job::{ClipBuffers, Job};
use crate::gpu::recorded::{Commands, Recorded};
use crate::machine::error::{EvaluateError, VulkanError};
use crate::output::window::Window;
use crate::prepare::clip_data::ClipData;
use crate::shader::{Item, List};
use crate::threads::{lock, on_threads};
use crate::time::error::SampleTimesError;
use crate::time::frames::SampleTimes;
use crate::work::lists::{ListRequest, ListRoom, Lister};
use crate::work::recording::{Resource, Set};

/// The inputs of a recording.
const ITEMS: usize = 0;
const DISTANCES: usize = 1;

const LIST: &str = "the list of samples";

/// Samples of a clip, prepared for recording into an application's commands, each time at other times.
pub(crate) struct TimedClip {
    engine: Arc<VulkanEngine>,
    clip: Arc<ClipData>,
    window: Window,
    range: ResultRange,
    work: Mutex<TimedWork>,
    // The descriptor sets refer to these buffers. The caller guarantees that no work that uses them is in flight when
    // the target is dropped.
    _segments: Arc<ClipBuffers>,
    lists: [Buffer; 2],
}

/// The recording, which is filled anew each time, and the lists that it writes.
struct TimedWork {
    recorded: Recorded,
    /// The kernel of each group of the clip.
    sets: Vec<Set>,
    items: Resource,
    distances: Resource,
    result: Resource,
    lister: Lister,
    lists: HostLists,
}

/// The list of a window in the host's memory, in words.
#[derive(Default)]
struct HostLists {
    items: Vec<u32>,
    distances: Vec<u32>,
}

impl<'r> ListRoom<'r> for &'r mut HostLists {
    type Error = EvaluateError;

    fn room(self, bytes: [Option<usize>; 3]) -> Result<[&'r mut [u8]; 3], EvaluateError> {
        let HostLists { items, distances } = self;
        let [item_bytes, distance_bytes, _] = bytes.map(Option::unwrap_or_default);
        items.resize(item_bytes / size_of::<u32>(), 0);
        distances.resize(distance_bytes / size_of::<u32>(), 0);
        Ok([
            bytemuck::cast_slice_mut(items),
            bytemuck::cast_slice_mut(distances),
            &mut [],
        ])
    }
}

impl TimedClip {
    pub(crate) fn new(
        engine: &Arc<VulkanEngine>,
        job: Job<'_>,
        clip: Arc<ClipData>,
        window: Window,
        buffer: VulkanBuffer,
    ) -> Result<Self, EvaluateError> {
        let range = ResultRange::new(engine, job.encoding, buffer, window.len())?;
        let capacity = 2 * window.len().max(1) as u64;
        let new = |name, each: usize| {
            let size = capacity * each as u64;
            (engine.device.physical).check_range(LIST, size)?;
            Buffer::new(&engine.device, name, size, Residence::Device)
        };
        let lists = [
            new("tumble timed items", size_of::<Item>())?,
            new("tumble timed distances", size_of::<f32>())?,
        ];
        let mut recorded = Recorded::new(&engine.device);
        let [items, distances] = [&lists[0], &lists[1]].map(|list| recorded.whole(list));
        let result = recorded.resource(range.binding());
        let mut sets = Vec::new();
        for (segments, constants) in &job.buffers.groups {
            let [segments, constants] = [segments, constants].map(|buffer| recorded.whole(buffer));
            let bindings = [segments, constants, items, distances, result];
            let kernel = job.kernel(List::Times);
            sets.push((recorded.recording).set(kernel, bindings.map(Into::into)));
        }
        recorded.bind(|kernel| engine.pipeline(kernel))?;
        let work = TimedWork {
            recorded,
            sets,
            items,
            distances,
            result,
            lister: Lister::default(),
            lists: HostLists::default(),
        };
        Ok(Self {
            engine: Arc::clone(engine),
            clip,
            window,
            range,
            work: Mutex::new(work),
            _segments: Arc::clone(job.buffers),
            lists,
        })
    }

    /// The range of the results.
    pub(crate) fn range(&self) -> &ResultRange {
        &self.range
    }

    /// The device that the commands are recorded for.
    pub(crate) fn engine(&self) -> &VulkanEngine {
        &self.engine
    }

    /// Records an evaluation at these times, seconds.
    pub(crate) fn record_at(
        &self,
        commands: Commands<'_>,
        offset: u64,
        times: &[f64],
    ) -> Result<(), EvaluateError> {
        let samples = self.window.samples.len();
        if times.len() != samples {
            let times = times.len();
            return Err(SampleTimesError::Count { times, samples }.into());
        }
        let first = self.range.first(offset)?;
        let timeline = SampleTimes::at(times.to_vec()).resolve(self.clip.track_count(), None)?;
        let timeline = self.clip.folded(&timeline)?;
        if self.window.len() == 0 {
            return Ok(());
        }
        let mut work = lock(&self.work);
        let TimedWork {
            recorded,
            sets,
            items,
            distances,
            result,
            lister,
            lists,
        } = &mut *work;
        let request = ListRequest {
            maps_samples: false,
            run_lanes: self.engine.run_lanes,
            clip: &self.clip,
            timeline: &timeline,
        };
        let list = || lister.list_items(request, &self.window, &mut *lists);
        let listed = on_threads(list)??;
        let inputs: [&[u8]; 2] = [
            bytemuck::cast_slice(&lists.items),
            bytemuck::cast_slice(&lists.distances),
        ];
        for (memory, list) in self.lists.iter().zip(inputs) {
            if list.len() as u64 > memory.size {
                return Err(EvaluateError::Vulkan(VulkanError::TooLarge {
                    subject: LIST,
                    bytes: list.len() as u64,
                    limit: memory.size,
                }));
            }
        }
        let recording = &mut recorded.recording;
        recording.clear_steps();
        recording.wait_for_all();
        for (input, resource) in [(ITEMS, *items), (DISTANCES, *distances)] {
            let size = inputs[input].len() as u64;
            if size > 0 {
                recording.write_input(resource.slice(0, size), input);
            }
        }
        let stride = self.window.stride() as u32;
        let stored = self.engine.stored(self.range.encoding, stride, first);
        let mut sets = listed.dispatched().map(|group| sets[group.group]);
        listed.record(recording, &mut sets, stored);
        listed.patch(recording, *result, stored);
        recording.publish();
        recorded.record(commands, &inputs);
        Ok(())
    }
}
