//! How many invocations evaluate a run together on cards of each vendor, by the mean length of runs. `tumble lab`
//! measures it on a card, and says which numbers follow from its rules.

use crate::machine::options::RunLanes;

/// Vendors by their PCI number.
const BY_VENDOR: [(u32, RunLanes); 1] = [(NVIDIA, RunLanes([4, 4, 8, 8, 8]))];

const NVIDIA: u32 = 0x10de;

/// The numbers for a vendor's cards; NVIDIA's for vendors that were not measured. Few lanes suit short runs: they lose
/// less time before the first sample of a run, and fewer of them have no sample in its first and its last iteration.
/// Eight lanes store a whole line of memory.
pub(crate) fn run_lanes(vendor: u32) -> RunLanes {
    let mut rows = BY_VENDOR.iter();
    rows.find(|(known, _)| *known == vendor)
        .map_or(BY_VENDOR[0].1, |(_, lanes)| *lanes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The class of runs follows from their mean length. If no kernel takes a number of lanes, the nearest one is used.
    #[test]
    fn lanes_are_those_of_the_class_of_runs() {
        let lanes = run_lanes(NVIDIA);
        assert_eq!(lanes, run_lanes(0));
        for (mean, expected) in [(4, 4), (15, 4), (16, 8), (48, 8), (200, 8)] {
            assert_eq!(lanes.of_class(RunLanes::class(100, 100 * mean)), expected);
        }
        let classes = [0, 7, 8, 15, 16, 31, 32, 127, 128, 5000];
        let found = classes.map(|mean| RunLanes::class(3, 3 * mean));
        assert_eq!(found, [0, 0, 1, 1, 2, 2, 3, 3, 4, 4]);
        let odd = RunLanes([0, 5, 12, 64, 32]);
        let used = [0, 1, 2, 3, 4].map(|class| odd.of_class(class));
        assert_eq!(used, [4, 4, 8, 32, 32]);
    }
}
