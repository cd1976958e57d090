//! The entries of a crowd's instances, the changes of them, and the visible instances.

use crate::crowd::fade::Fades;
use crate::crowd::layer::CrowdLayer;
use crate::machine::crowd::{CrowdFrame, EntryChanges, VisibleInstances};
use crate::memory::{OutOfMemoryError, reserved, zeroed};
use crate::output::crowd::listed_changes;
use crate::shader::{CrowdChange, CrowdClip, CrowdEntry};
use crate::twin::crowd_entries::change;
use crate::twin::crowd_times::{ELAPSED_BITS, elapsed};

/// The entries, the clock, and the changes that the device does not know yet.
#[derive(Debug)]
pub(crate) struct Instances {
    /// `[instance][layer]`; [`set`](Self::set) changes them.
    pub(crate) entries: Vec<CrowdEntry>,
    /// A bit for each entry that changed.
    changed: Vec<u64>,
    /// Memory for the changes of a frame.
    listed: Vec<CrowdChange>,
    /// The visible instances in the order of results; `None`: all.
    pub(crate) visible: Option<Vec<u32>>,
    /// Whether the device has this list.
    is_list_known: bool,
    /// Ticks; [`set_clock`](Self::set_clock) changes it.
    pub(crate) clock: u64,
    /// No anchor is before this time of the clock.
    since: u64,
    /// The fades of weights.
    pub(crate) fades: Fades,
}

impl Instances {
    /// Makes instances whose first layer has the entry `still`; the other layers have no weight.
    pub(crate) fn new(
        instances: usize,
        layers: usize,
        still: CrowdEntry,
    ) -> Result<Self, OutOfMemoryError> {
        let count = instances * layers;
        let mut all = Self {
            entries: zeroed(count, "a crowd")?,
            changed: zeroed(count.div_ceil(64), "a crowd")?,
            listed: reserved(listed_changes(count), "a crowd")?,
            visible: None,
            is_list_known: false,
            clock: 0,
            since: 0,
            fades: Fades::default(),
        };
        for (index, entry) in all.entries.iter_mut().enumerate() {
            *entry = still;
            if index % layers > 0 {
                entry.clip_and_weight &= 0xffff;
            }
        }
        all.forget();
        Ok(all)
    }

    pub(crate) fn set(&mut self, index: usize, entry: CrowdEntry) {
        self.entries[index] = entry;
        self.changed[index / 64] |= 1 << (index % 64);
    }

    /// Sets the weight of an entry, in units of 2^-15.
    pub(crate) fn set_weight(&mut self, index: usize, units: u32) {
        let mut entry = self.entries[index];
        if entry.clip_and_weight >> 16 != units {
            entry.clip_and_weight = entry.clip_and_weight & 0xffff | units << 16;
            self.set(index, entry);
        }
    }

    /// Sets the clock. Entries store their anchors modulo 2^40 ticks. Therefore all entries get new anchors when the
    /// clock is 2^39 ticks after the last time at which they did. If the clock goes back, the entries whose anchors
    /// would be later than the clock get new ones.
    pub(crate) fn set_clock(&mut self, clock: u64, clips: &[CrowdClip], masks: usize) {
        let is_late = clock.saturating_sub(self.since) >= 1 << (ELAPSED_BITS - 1);
        let back = self.clock.saturating_sub(clock);
        if is_late || back > 0 {
            for index in 0..self.entries.len() {
                let old = self.entries[index];
                if !is_late && back <= elapsed(&old, self.clock) {
                    continue;
                }
                let layer = CrowdLayer::moved(&old, clips, self.clock, clock);
                // Packing cannot fail here, because the same values were packed before.
                if let Ok(mut entry) = layer.packed(clips, masks, clock) {
                    entry.clip_and_weight = old.clip_and_weight;
                    self.set(index, entry);
                }
            }
            self.since = if is_late {
                clock
            } else {
                self.since.min(clock)
            };
        }
        let mut fades = std::mem::take(&mut self.fades);
        fades.set_clock(clock, clock < self.clock, |index, units| {
            self.set_weight(index, units);
        });
        self.fades = fades;
        self.clock = clock;
    }

    /// Limits evaluations to the instances of a list; `None`: all.
    pub(crate) fn set_visible(&mut self, list: Option<Vec<u32>>) {
        self.visible = list;
        self.is_list_known = false;
    }

    /// Number of visible instances.
    pub(crate) fn visible_count(&self, layers: usize) -> usize {
        match &self.visible {
            Some(list) => list.len(),
            None => self.entries.len() / layers,
        }
    }

    /// The changes that the device needs for an evaluation of instances with `layers` layers. Afterwards they count
    /// as known to the device.
    pub(crate) fn take_frame(&mut self, layers: usize) -> CrowdFrame<'_> {
        let instances = self.visible_count(layers) as u32;
        let is_list_known = std::mem::replace(&mut self.is_list_known, true);
        let visible = match &self.visible {
            None => VisibleInstances::All,
            Some(_) if is_list_known => VisibleInstances::AsBefore,
            Some(list) => VisibleInstances::List(list),
        };
        let changes = match self.changed_range() {
            None => EntryChanges::None,
            Some((first, end, count)) if self.is_listed(end - first, count) => {
                self.listed.clear();
                for (index, &word) in self.changed.iter().enumerate() {
                    let mut left = word;
                    while left != 0 {
                        let entry = index * 64 + left.trailing_zeros() as usize;
                        self.listed.push(change(entry as u32, &self.entries[entry]));
                        left &= left - 1;
                    }
                }
                self.changed.fill(0);
                EntryChanges::List(&self.listed)
            }
            Some((first, end, _)) => {
                self.changed.fill(0);
                EntryChanges::Range(first, &self.entries[first..end])
            }
        };
        CrowdFrame {
            clock: self.clock,
            changes,
            instances,
            visible,
        }
    }

    /// A frame that needs no changes, because matrices in a buffer are continued. The changes wait for the next
    /// evaluation.
    #[cfg(feature = "vulkan")]
    pub(crate) fn frame_of_stage(&self, layers: usize) -> CrowdFrame<'_> {
        CrowdFrame {
            clock: self.clock,
            changes: EntryChanges::None,
            instances: self.visible_count(layers) as u32,
            visible: VisibleInstances::All,
        }
    }

    /// The first entry that changed, the end of the range of changes, and the number of changes.
    fn changed_range(&self) -> Option<(usize, usize, usize)> {
        let changed = |word: &u64| *word != 0;
        let first = self.changed.iter().position(changed)?;
        let last = self.changed.iter().rposition(changed)?;
        let words = &self.changed[first..=last];
        let count: u32 = words.iter().map(|word| word.count_ones()).sum();
        let start = first * 64 + self.changed[first].trailing_zeros() as usize;
        let end = last * 64 + 64 - self.changed[last].leading_zeros() as usize;
        Some((start, end, count as usize))
    }

    /// Whether `count` changes in a range take fewer bytes as a list.
    fn is_listed(&self, range: usize, count: usize) -> bool {
        /// The cost of one more kernel, in bytes.
        const DISPATCH: usize = 256;
        let bytes = count * size_of::<CrowdChange>() + DISPATCH;
        count <= listed_changes(self.entries.len()) && bytes < range * size_of::<CrowdEntry>()
    }

    /// Marks all entries as unknown to the device.
    pub(crate) fn forget(&mut self) {
        self.changed.fill(u64::MAX);
        if let Some(last) = self.changed.last_mut() {
            *last >>= self.entries.len().wrapping_neg() % 64;
        }
        self.is_list_known = false;
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;
    use crate::twin::crowd_entries::scatter;

    /// Applies a frame as a device does, and returns the number of bytes that are uploaded for it.
    fn applied(all: &mut Instances, known: &mut [CrowdEntry]) -> usize {
        match all.take_frame(2).changes {
            EntryChanges::None => 0,
            EntryChanges::Range(first, entries) => {
                known[first..][..entries.len()].copy_from_slice(entries);
                size_of_val(entries)
            }
            EntryChanges::List(list) => {
                assert!(list.len() <= listed_changes(known.len()));
                list.iter().for_each(|change| scatter(change, known));
                size_of_val(list)
            }
        }
    }

    #[test]
    fn a_device_knows_every_change_after_a_frame() {
        let mut random = fastrand::Rng::with_seed(3);
        for instances in [1, 31, 32, 33, 1000] {
            let mut all = Instances::new(instances, 2, CrowdEntry::zeroed()).unwrap();
            let mut known = vec![
                CrowdEntry {
                    start: 1,
                    ..CrowdEntry::zeroed()
                };
                2 * instances
            ];
            let whole = size_of_val(&known[..]);
            for round in 0..50 {
                if round % 10 == 0 {
                    all.forget();
                    known.fill(CrowdEntry {
                        start: 2,
                        ..CrowdEntry::zeroed()
                    });
                    assert_eq!(applied(&mut all, &mut known), whole);
                    assert!(known == all.entries);
                }
                let changes = random.usize(0..[3, 40, 3 * instances][round % 3]);
                let mut distinct = std::collections::BTreeSet::new();
                for _ in 0..changes {
                    let index = random.usize(0..2 * instances);
                    let start = random.u32(..);
                    all.set(
                        index,
                        CrowdEntry {
                            start,
                            ..CrowdEntry::zeroed()
                        },
                    );
                    distinct.insert(index);
                }
                let bytes = applied(&mut all, &mut known);
                assert!(known == all.entries);
                let is_listed = distinct.len() <= listed_changes(known.len());
                let limit = if is_listed {
                    20 * distinct.len() + 256
                } else {
                    whole
                };
                assert!(bytes <= limit.min(whole), "{bytes} of {limit}");
                assert_eq!(applied(&mut all, &mut known), 0);
            }
        }
    }

    /// The bytes of a frame in which a hundredth of 10 000 instances changed: 1600 of them are entries.
    #[test]
    fn a_hundredth_of_the_instances_takes_two_kilobytes() {
        let mut all = Instances::new(10_000, 2, CrowdEntry::zeroed()).unwrap();
        let mut known = vec![CrowdEntry::zeroed(); 20_000];
        assert_eq!(applied(&mut all, &mut known), 320_000);
        for index in 0..100 {
            let start = index as u32 + 1;
            all.set(
                index * 199 + 7,
                CrowdEntry {
                    start,
                    ..CrowdEntry::zeroed()
                },
            );
        }
        assert_eq!(applied(&mut all, &mut known), 2000);
        assert!(known == all.entries);
    }

    #[test]
    fn lists_go_to_the_device_once() {
        let mut all = Instances::new(9, 1, CrowdEntry::zeroed()).unwrap();
        let visible = |all: &mut Instances| match all.take_frame(1) {
            CrowdFrame {
                visible: VisibleInstances::List(list),
                instances,
                ..
            } => {
                assert_eq!(list.len(), instances as usize);
                Some(list.to_vec())
            }
            CrowdFrame {
                visible, instances, ..
            } => {
                let is_all = visible == VisibleInstances::All;
                assert_eq!(instances, if is_all { 9 } else { 2 });
                is_all.then(Vec::new)
            }
        };
        assert_eq!(visible(&mut all), Some(vec![]));
        all.set_visible(Some(vec![7, 2]));
        assert_eq!(visible(&mut all), Some(vec![7, 2]));
        assert_eq!(visible(&mut all), None);
        all.forget();
        assert_eq!(visible(&mut all), Some(vec![7, 2]));
        all.set_visible(None);
        assert_eq!(visible(&mut all), Some(vec![]));
        all.set_visible(Some(vec![7, 2]));
        assert_eq!(visible(&mut all), Some(vec![7, 2]));
    }
}
