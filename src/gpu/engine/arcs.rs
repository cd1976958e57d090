//! Arcs that the device prepares. The host uploads the keys of a clip and the list of their intervals instead of
//! segments, and one dispatch for each group writes these segments.

use crate::gpu::buffer::{Buffer, Residence};
use crate::gpu::device::QueueLane;
use crate::gpu::engine::VulkanEngine;
use crate::gpu::physical::upload_memory::KernelReads;
use crate::gpu::submission::Submission;
use crate::gpu::upload::Upload;
use crate::machine::error::VulkanError;
use crate::machine::options::PrepareArcs;
use crate::machine::reports::DeviceKind;
use crate::prepare::clip_data::ClipData;
use crate::shader::{ArcsDispatch, Kernel};
use crate::work::recording::{Slice, workgroups};

/// The number of keys from which on a card prepares the arcs: 1 MiB of arcs. The upload of fewer arcs takes no longer
/// than a dispatch.
const MANY_KEYS: usize = (1 << 20) / 32;

/// The number of keys from which on the arcs between them are prepared on a device.
pub(super) fn prepared_from(option: PrepareArcs, kind: DeviceKind) -> usize {
    match (option, kind) {
        (PrepareArcs::OnDevice, _) => 0,
        (PrepareArcs::Automatic, DeviceKind::Discrete) => MANY_KEYS,
        (PrepareArcs::Automatic | PrepareArcs::OnHost, _) => usize::MAX,
    }
}

impl VulkanEngine {
    /// Whether the device prepares the arcs between `keys` keys.
    pub(crate) fn prepares_arcs(&self, keys: usize) -> bool {
        self.prepares_arcs_from < usize::MAX && keys >= self.prepares_arcs_from
    }

    /// A buffer for arcs that the device prepares: a spare one that is long enough, or a new one.
    pub(super) fn room_for_arcs(
        &self,
        bytes: u64,
        spare: &mut Vec<Buffer>,
    ) -> Result<Buffer, VulkanError> {
        match spare.iter().position(|buffer| buffer.size >= bytes) {
            Some(index) => Ok(spare.swap_remove(index)),
            None => Buffer::new(&self.device, "tumble segments", bytes, Residence::Device),
        }
    }

    /// Prepares the arcs of a clip that are only listed, from the constants of each group into its segments, and
    /// waits until they are there.
    pub(super) fn prepare_arcs(
        &self,
        clip: &ClipData,
        buffers: &[(Buffer, Buffer)],
    ) -> Result<(), VulkanError> {
        let groups = clip.groups.iter().map(|group| &*group.segments.intervals);
        let listed = groups.zip(buffers).filter(|(list, _)| !list.is_empty());
        let listed: Vec<(&[u32], _)> = listed.collect();
        if listed.is_empty() {
            return Ok(());
        }
        let mut uploads = Vec::with_capacity(listed.len());
        for &(intervals, _) in &listed {
            let (mut upload, reads) = (Upload::default(), KernelReads::Once);
            let name = "tumble intervals";
            let room = upload.room(&self.device, name, reads, size_of_val(intervals))?;
            room.copy_from_slice(bytemuck::cast_slice(intervals));
            uploads.push(upload);
        }
        // Created last, so that it is dropped first: it waits for its work before the buffers are freed.
        let mut submission = Submission::new(&self.device, QueueLane::Kernels)?;
        submission.begin()?;
        let work = &mut submission.work;
        let lists: Vec<_> = (uploads.iter())
            .filter_map(|upload| upload.copied_in(work))
            .collect();
        for ((intervals, (segments, constants)), list) in listed.iter().zip(lists) {
            let [constants, segments] = [constants, segments].map(|buffer| work.whole(buffer));
            let bindings = [constants, list, segments].map(Slice::from);
            let set = work.recording.set(Kernel::PrepareArcs, bindings);
            let count = intervals.len() as u32;
            let push = ArcsDispatch { count };
            work.recording.dispatch(set, &push, workgroups(count));
        }
        // Make the arcs visible to all work that is submitted later, also to an application's.
        work.recording.publish();
        work.bind(|kernel| self.pipeline(kernel))?;
        submission.run()?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Quat;

    use super::*;
    use crate::machine::options::{EngineOptions, Reads, Transfer, Uploads};
    use crate::math::quaternion::dot;
    use crate::method::SLERP;
    use crate::prepare::clip_data::PrepareRequest;
    use crate::prepare::prepared::Prepared;
    use crate::shader::ArcSegment;
    use crate::tracks::set::TrackSet;
    use crate::work::lists::may_be_tiny;
    use crate::{Device, Engine};

    /// Every device of this machine, with arcs prepared on it.
    fn engines(change: impl Fn(&mut EngineOptions)) -> Vec<Engine> {
        let devices = Device::list().unwrap_or_default();
        if devices.is_empty() {
            eprintln!("NO VULKAN DEVICE: this test compared nothing");
        }
        let open = |device| {
            let mut options = EngineOptions {
                prepare_arcs: PrepareArcs::OnDevice,
                ..EngineOptions::default()
            };
            change(&mut options);
            let engine = Engine::with_options(device, &options).unwrap();
            assert_eq!(engine.choices().unwrap().arcs_prepared_from, Some(0));
            engine
        };
        devices.into_iter().map(open).collect()
    }

    fn vulkan(engine: &Engine) -> Arc<VulkanEngine> {
        engine.opened().expect("a Vulkan device").engine()
    }

    /// The first bytes of a buffer of the device.
    fn read_back(engine: &VulkanEngine, buffer: &Buffer, bytes: usize) -> Vec<u8> {
        let size = bytes as u64;
        let host = Buffer::new(&engine.device, "test", size, Residence::Readback).unwrap();
        let mut submission = Submission::new(&engine.device, QueueLane::Kernels).unwrap();
        submission.begin().unwrap();
        let work = &mut submission.work;
        let [from, to] = [buffer, &host].map(|buffer| work.whole(buffer));
        work.recording.copy(from.slice(0, size), to);
        work.recording.read_by_host(to);
        submission.run().unwrap();
        host.invalidate(&(0..bytes)).unwrap();
        host.bytes(0..bytes).to_vec()
    }

    /// Tracks with keys of each kind: equal ones, close ones, half turns (exact, and within rounding), other
    /// signs, components below 2^-64 and between, and lengths that are not quite 1; at uneven times. One track has
    /// one key.
    fn keys_of_all_kinds(tracks: usize, keys: usize) -> TrackSet {
        let mut random = fastrand::Rng::with_seed(73);
        let mut component = move || random.f32() * 2.0 - 1.0;
        let mut set = TrackSet::new();
        for track in 0..tracks {
            let count = if track == 1 { 1 } else { keys };
            let (mut times, mut all) = (Vec::new(), Vec::<Quat>::new());
            let mut time = 0.0;
            for key in 0..count {
                time += [0.01, 1.0, 1e-5, 300.0][key % 4];
                times.push(time);
                let other = [(); 4].map(|()| component());
                let before = all.last().map_or(other, Quat::to_array);
                let near = |by: f32| std::array::from_fn(|c| before[c] + other[c] * by);
                let [x, y, z, w] = before;
                let next: [f32; 4] = match (key + track) % 9 {
                    0 => before,
                    1 => near(1e-7),
                    2 => near(1e-3),
                    3 => [w, -z, y, -x],
                    4 => before.map(|c| -c),
                    5 => [1e-25, other[1], -1e-30, other[3]],
                    6 => [-0.0, other[1] * 1e-14, 1.0, 1e-38],
                    7 => [1.0, 0.0, 1e-42, 0.0],
                    _ => other,
                };
                let length = dot(next.map(f64::from), next.map(f64::from)).sqrt();
                let off = if key % 5 == 4 { 1.0 + 3e-7 } else { 1.0 };
                let scaled = next.map(|c| (f64::from(c) / length * off) as f32);
                all.push(Quat::from_array(scaled));
            }
            set.push("", &times, &all).unwrap();
        }
        set
    }

    fn prepared(engine: &VulkanEngine, set: &TrackSet, lists_arcs: bool) -> ClipData {
        let request = PrepareRequest {
            group_bytes: Some(engine.group_bytes),
            lists_arcs,
            ..PrepareRequest::all(set)
        };
        ClipData::new(set, SLERP.into(), request).unwrap()
    }

    /// Catches an arc that the device computes otherwise, and one that it writes elsewhere or leaves out.
    #[test]
    fn the_device_prepares_the_arcs_that_the_host_would_upload() {
        type Change = fn(&mut EngineOptions);
        let changes: [Change; 4] = [
            |_| {},
            |options| (options.transfer, options.uploads) = (Transfer::Staged, Uploads::Staged),
            |options| (options.reads, options.uploads) = (Reads::TexelBuffers, Uploads::Direct),
            |options| options.memory = Some(200_000),
        ];
        let sets = [(1, 2), (2, 1), (5, 300), (3000, 13), (2, 9001)]
            .map(|(tracks, keys)| keys_of_all_kinds(tracks, keys));
        let (mut compared, mut negated) = (0, 0);
        for engine in changes.iter().flat_map(engines) {
            let engine = vulkan(&engine);
            for set in &sets {
                let [expected, listed] = [false, true].map(|lists| prepared(&engine, set, lists));
                // Reused buffers are longer and contain other arcs, so the device must write exactly the new ones.
                let mut spare = None;
                for _ in 0..2 {
                    let buffers = engine.upload(&listed, spare.take()).unwrap();
                    assert_eq!(listed.groups.len(), expected.groups.len());
                    let groups = expected.groups.iter().zip(&buffers.groups);
                    for (group, (segments, constants)) in groups {
                        let bytes = group.segments.as_bytes();
                        let found = read_back(&engine, segments, bytes.len());
                        assert!(found == bytes, "arcs of {} keys", set.key_count());
                        let bytes: &[u8] = bytemuck::cast_slice(&group.constants);
                        assert!(read_back(&engine, constants, bytes.len()) == bytes);
                        compared += group.segments.len();
                    }
                    spare = Some(buffers);
                }
                let flags = |group: &Prepared| {
                    let flagged = group.segments.intervals.iter();
                    flagged.filter(|&interval| interval >> 30 != 0).count()
                };
                negated += listed.groups.iter().map(flags).sum::<usize>();
            }
        }
        assert!(compared == 0 || compared > 100_000 && negated > 10_000);
    }

    /// The bytes uploaded for 4096 tracks of 26 keys, as the documents count them; and the host's list of arcs is never
    /// computed in addition.
    #[test]
    fn fewer_bytes_are_uploaded() {
        let keys = 4096 * 26;
        let arcs = 4096 * 25;
        let mut set = TrackSet::new();
        let times: Vec<f64> = (0..26).map(f64::from).collect();
        for _ in 0..4096 {
            set.push("", &times, &[Quat::IDENTITY; 26]).unwrap();
        }
        let bytes = |lists_arcs| {
            let request = PrepareRequest {
                group_bytes: Some(1 << 30),
                lists_arcs,
                ..PrepareRequest::all(&set)
            };
            let clip = ClipData::new(&set, SLERP.into(), request).unwrap();
            let each = clip.groups.iter().map(|group| {
                let listed = size_of_val(&*group.segments.intervals);
                let constants = size_of_val(&*group.constants);
                group.segments.as_bytes().len() + listed + constants
            });
            each.sum::<usize>()
        };
        assert_eq!(bytes(false), keys * 16 + arcs * size_of::<ArcSegment>());
        assert_eq!(bytes(false), 4_980_736);
        assert_eq!(bytes(true), keys * 16 + arcs * 4);
        assert_eq!(bytes(true), 2_113_536);
    }

    /// An item of the work list has the mark for the filter of tiny components whenever the arc may need it, and seldom
    /// otherwise.
    #[test]
    fn tiny_components_are_expected_where_they_may_be() {
        let set = keys_of_all_kinds(200, 100);
        let clip = |lists_arcs| {
            let request = PrepareRequest {
                lists_arcs,
                ..PrepareRequest::all(&set)
            };
            ClipData::new(&set, SLERP.into(), request).unwrap()
        };
        let (computed, listed) = (clip(false), clip(true));
        let mut counts = [0; 4];
        for (computed, listed) in computed.groups.iter().zip(&listed.groups) {
            assert_eq!(computed.segments.len(), listed.segments.len());
            for index in 0..computed.segments.len() as u32 {
                let [needs, asks] = [computed, listed].map(|group| may_be_tiny(group, index));
                counts[usize::from(needs) * 2 + usize::from(asks)] += 1;
            }
        }
        let [neither, asked, missed, both] = counts;
        assert_eq!(missed, 0, "{counts:?}");
        assert!(
            neither > 1000 && both > 1000 && asked < both / 4,
            "{counts:?}"
        );
    }

    #[test]
    fn cards_prepare_many_arcs() {
        use DeviceKind::{Cpu, Discrete, Integrated};
        use PrepareArcs::{Automatic, OnDevice, OnHost};
        for (option, kind, from) in [
            (Automatic, Discrete, 32_768),
            (Automatic, Integrated, usize::MAX),
            (Automatic, Cpu, usize::MAX),
            (OnHost, Discrete, usize::MAX),
            (OnDevice, Cpu, 0),
        ] {
            assert_eq!(prepared_from(option, kind), from, "{option:?}, {kind:?}");
        }
    }
}
