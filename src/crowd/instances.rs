//! The entries of a crowd's instances, and which of them changed.

use crate::crowd::layer::CrowdLayer;
use crate::memory::{OutOfMemoryError, zeroed};
use crate::shader::{CrowdClip, CrowdEntry};
use crate::twin::crowd_times::ELAPSED_BITS;

/// The entries, the clock, and the entries that the device does not know yet.
#[derive(Debug)]
pub(crate) struct Instances {
    /// `[instance][layer]`; [`set`](Self::set) changes them.
    pub(crate) entries: Vec<CrowdEntry>,
    /// A bit for each entry that changed; those beyond the last entry mean nothing.
    changed: Vec<u64>,
    /// Ticks; [`set_clock`](Self::set_clock) changes it.
    pub(crate) clock: u64,
    /// The time of the clock that no anchor lies before.
    since: u64,
}

impl Instances {
    /// Instances that stand at the start of the first clip; layers above the first are left out.
    pub(crate) fn new(
        instances: usize,
        layers: usize,
        still: CrowdEntry,
    ) -> Result<Self, OutOfMemoryError> {
        let count = instances * layers;
        let mut all = Self {
            entries: zeroed(count, "a crowd")?,
            changed: zeroed(count.div_ceil(64), "a crowd")?,
            clock: 0,
            since: 0,
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

    /// Sets the clock. Entries have times relative to their anchors, up to 2^40 ticks later; where that would
    /// not do, all get new anchors.
    pub(crate) fn set_clock(&mut self, clock: u64, clips: &[CrowdClip], masks: usize) {
        let is_near = clock >= self.clock && clock - self.since < 1 << (ELAPSED_BITS - 1);
        if !is_near {
            for index in 0..self.entries.len() {
                let layer = CrowdLayer::moved(&self.entries[index], clips, self.clock, clock);
                // What was packed once can be packed again.
                if let Ok(mut entry) = layer.packed(clips, masks, clock) {
                    entry.clip_and_weight = self.entries[index].clip_and_weight;
                    self.set(index, entry);
                }
            }
            self.since = clock;
        }
        self.clock = clock;
    }

    /// The ranges of entries that changed, which count as known when all have been taken.
    pub(crate) fn take_changes(&mut self) -> impl Iterator<Item = (usize, &[CrowdEntry])> {
        let (entries, changed) = (&self.entries, &mut self.changed);
        let (count, mut end) = (entries.len(), 0);
        std::iter::from_fn(move || {
            let first = first_that(changed, end, count, true);
            if first == count {
                changed.fill(0);
                return None;
            }
            end = first_that(changed, first, count, false);
            Some((first, &entries[first..end]))
        })
    }

    /// From now on the device knows nothing.
    pub(crate) fn forget(&mut self) {
        self.changed.fill(u64::MAX);
    }
}

/// The first index from `index` on whose bit is `value`; `count` if none of so many is.
fn first_that(changed: &[u64], mut index: usize, count: usize, value: bool) -> usize {
    while index < count {
        let word = changed[index / 64];
        let word = if value { word } else { !word };
        let left = word >> (index % 64);
        if left != 0 {
            return (index + left.trailing_zeros() as usize).min(count);
        }
        index = (index / 64 + 1) * 64;
    }
    count
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable as _;

    use super::*;

    #[test]
    fn changes_are_ranges_and_are_told_once() {
        let still = CrowdEntry::zeroed();
        let mut all = Instances::new(100, 2, still).unwrap();
        let ranges = |all: &mut Instances| -> Vec<_> {
            let ranges = all
                .take_changes()
                .map(|(first, entries)| (first, entries.len()));
            ranges.collect()
        };
        assert_eq!(ranges(&mut all), [(0, 200)]);
        assert_eq!(ranges(&mut all), []);
        for index in [0, 1, 63, 64, 65, 130, 199] {
            all.set(index, still);
        }
        assert_eq!(ranges(&mut all), [(0, 2), (63, 3), (130, 1), (199, 1)]);
        all.forget();
        assert_eq!(ranges(&mut all), [(0, 200)]);
    }
}
