//! The choice of the queue that copies results to the host while another one computes.

use ash::vk;

use crate::machine::error::VulkanError;
use crate::machine::options::ReadBack;

/// A queue of a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct QueueIndex {
    pub(crate) family: u32,
    pub(crate) index: u32,
}

/// The method of copying results from device memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Copies {
    /// In the submission of the kernels.
    Together,
    /// In separate submissions, on the kernels' queue.
    Apart,
    /// In separate submissions, on another queue.
    Beside(QueueIndex),
}

/// The flags of families for other work.
const OTHER_WORK: vk::QueueFlags = vk::QueueFlags::from_raw(
    vk::QueueFlags::VIDEO_DECODE_KHR.as_raw()
        | vk::QueueFlags::VIDEO_ENCODE_KHR.as_raw()
        | vk::QueueFlags::OPTICAL_FLOW_NV.as_raw(),
);

/// The family of the queue that computes: the first with compute and without graphics, because a desktop keeps graphics
/// queues busy; otherwise the first with compute.
pub(crate) fn compute_family(families: &[vk::QueueFamilyProperties]) -> Option<u32> {
    use vk::QueueFlags as Flags;
    let computes = |family: &vk::QueueFamilyProperties| {
        family.queue_count > 0 && family.queue_flags.contains(Flags::COMPUTE)
    };
    let computes_alone = |family: &vk::QueueFamilyProperties| {
        computes(family) && !family.queue_flags.intersects(Flags::GRAPHICS | OTHER_WORK)
    };
    let alone = families.iter().position(computes_alone);
    let index = alone.or_else(|| families.iter().position(computes));
    index.map(|index| index as u32)
}

/// Refuses a family that does not exist, or has none of some flags.
pub(crate) fn check_family(
    families: &[vk::QueueFamilyProperties],
    family: u32,
    any_of: vk::QueueFlags,
    work: &'static str,
) -> Result<(), VulkanError> {
    let found = families.get(family as usize);
    match found.is_some_and(|found| found.queue_flags.intersects(any_of)) {
        true => Ok(()),
        false => Err(VulkanError::QueueFamily {
            family,
            work,
            families: families.len(),
        }),
    }
}

/// The queue that can run at the same time as one of the family `compute` and disturbs it least. The first of these
/// that exists is used: a copy engine; a family with compute and without graphics; a second queue of the same family;
/// any other family with compute or graphics. Families for video and optical flow are not used.
pub(crate) fn copy_queue(
    families: &[vk::QueueFamilyProperties],
    compute: u32,
) -> Option<QueueIndex> {
    use vk::QueueFlags as Flags;
    let rank = |family: u32, properties: &vk::QueueFamilyProperties| {
        let has = |flags| properties.queue_flags.intersects(flags);
        if family == compute {
            return (properties.queue_count > 1).then_some(2);
        }
        // A queue that computes or draws can copy, also where the flag for it is not set.
        match (has(Flags::GRAPHICS), has(Flags::COMPUTE)) {
            _ if properties.queue_count == 0 || has(OTHER_WORK) => None,
            (false, false) => has(Flags::TRANSFER).then_some(0),
            (false, true) => Some(1),
            (true, _) => Some(3),
        }
    };
    let ranked = (0..).zip(families);
    let ranked =
        ranked.filter_map(|(family, properties)| Some((rank(family, properties)?, family)));
    let (_, family) = ranked.min()?;
    Some(QueueIndex {
        family,
        index: u32::from(family == compute),
    })
}

/// The method of copying for a device whose results are staged.
pub(crate) fn copies(
    families: &[vk::QueueFamilyProperties],
    compute: u32,
    read_back: ReadBack,
    is_software: bool,
) -> Copies {
    let beside = || copy_queue(families, compute).map(Copies::Beside);
    match read_back {
        ReadBack::SameQueue => Copies::Together,
        ReadBack::Automatic if is_software => Copies::Together,
        ReadBack::Automatic => beside().unwrap_or(Copies::Together),
        ReadBack::Overlapped => beside().unwrap_or(Copies::Apart),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::physical::cards::{Card, card};

    fn of(name: &str) -> Option<QueueIndex> {
        let Card { families, .. } = card(name);
        copy_queue(&families, compute_family(&families).unwrap())
    }

    fn queue(family: u32, index: u32) -> Option<QueueIndex> {
        Some(QueueIndex { family, index })
    }

    /// The queue for copies is that of a copy engine, else that of a family that computes without graphics, else a
    /// second queue of the same family; with a single queue there is none.
    #[test]
    fn each_card_copies_on_the_queue_that_is_least_in_the_way() {
        assert_eq!(of("H200"), queue(1, 0));
        assert_eq!(of("RTX 4060"), queue(1, 0));
        assert_eq!(of("RX 7900 XTX, RADV"), queue(1, 1));
        assert_eq!(of("RX 7900 XTX, AMD's driver"), queue(2, 0));
        assert_eq!(of("Steam Deck"), queue(1, 1));
        assert_eq!(of("Arc A770, Mesa 23"), None);
        assert_eq!(of("Arc A770, Mesa 24"), queue(2, 0));
        assert_eq!(of("Apple M2, MoltenVK"), queue(1, 0));
        assert_eq!(of("lavapipe"), None);
        assert_eq!(of("SwiftShader"), None);
    }

    /// Kernels run in a family without graphics, if a card has one.
    #[test]
    fn each_card_computes_where_it_does_not_draw() {
        for (name, family) in [
            ("H200", 2),
            ("RTX 4060", 2),
            ("RX 7900 XTX, RADV", 1),
            ("RX 7900 XTX, AMD's driver", 1),
            ("Arc A770, Mesa 23", 0),
            ("Arc A770, Mesa 24", 1),
            ("Apple M2, MoltenVK", 0),
            ("lavapipe", 0),
        ] {
            assert_eq!(compute_family(&card(name).families), Some(family), "{name}");
        }
        assert_eq!(compute_family(&[]), None);
    }

    #[test]
    fn families_that_are_not_there_or_cannot_are_refused() {
        let families = card("RTX 4060").families;
        let check = |family, flags| check_family(&families, family, flags, "compute");
        assert_eq!(check(2, vk::QueueFlags::COMPUTE), Ok(()));
        for family in [1, 5, u32::MAX] {
            let refused = check(family, vk::QueueFlags::COMPUTE).unwrap_err();
            let expected = format!("family {family}, which cannot compute; the device has 5");
            assert!(refused.to_string().contains(&expected), "{refused}");
        }
    }

    #[test]
    fn a_second_queue_of_the_family_serves_where_no_other_family_does() {
        let mut families = card("lavapipe").families;
        families[0].queue_count = 2;
        assert_eq!(copy_queue(&families, 0), queue(0, 1));
        // A family for video could copy, but it is not used for this.
        let mut video = card("H200").families;
        video.retain(|family| family.queue_flags.intersects(OTHER_WORK));
        assert!(!video.is_empty());
        assert!(
            video
                .iter()
                .all(|family| family.queue_flags.contains(vk::QueueFlags::TRANSFER))
        );
        families[0].queue_count = 1;
        families.extend(video);
        assert_eq!(copy_queue(&families, 0), None);
        // The compute family here is 2, which is not the first one.
        let families = card("RTX 4060").families;
        assert_eq!(copy_queue(&families, 2), queue(1, 0));
    }

    #[test]
    fn nothing_is_chosen_for_software_unless_it_is_forced() {
        let settings = [
            ReadBack::Automatic,
            ReadBack::SameQueue,
            ReadBack::Overlapped,
        ];
        let of = |name, is_software| {
            let families = card(name).families;
            settings.map(|read_back| copies(&families, 0, read_back, is_software))
        };
        let (family, index) = (1, 0);
        let beside = Copies::Beside(QueueIndex { family, index });
        let software = [Copies::Together, Copies::Together, Copies::Apart];
        assert_eq!(of("lavapipe", true), software);
        assert_eq!(of("H200", false), [beside, Copies::Together, beside]);
        assert_eq!(of("H200", true)[0], Copies::Together);
    }
}
