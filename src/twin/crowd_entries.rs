//! Twin of `shaders/crowd/gather.wgsl` and `shaders/crowd/scatter.wgsl`.

use crate::shader::{CrowdChange, CrowdEntry};

/// The entries of the instances of a list, with `layers` layers each, one after another.
pub(crate) fn gather<'a>(
    all: &'a [CrowdEntry],
    visible: &'a [u32],
    layers: usize,
) -> impl Iterator<Item = CrowdEntry> + 'a {
    let of = move |&instance: &u32| &all[instance as usize * layers..][..layers];
    visible.iter().flat_map(of).copied()
}

/// The input of `scatter`.
pub(crate) fn change(index: u32, entry: &CrowdEntry) -> CrowdChange {
    CrowdChange {
        index,
        clip_and_weight: entry.clip_and_weight,
        speed_and_modes: entry.speed_and_modes,
        start: entry.start,
        anchor: entry.anchor,
    }
}

/// Writes a changed entry to its index, as the kernel does.
#[cfg(test)]
pub(crate) fn scatter(change: &CrowdChange, all: &mut [CrowdEntry]) {
    all[change.index as usize] = CrowdEntry {
        clip_and_weight: change.clip_and_weight,
        speed_and_modes: change.speed_and_modes,
        start: change.start,
        anchor: change.anchor,
    };
}
