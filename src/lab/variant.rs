//! The variants of a kernel over spread runs, as data. All give the same bits, so that each is compared with the
//! kernel's twin. The SPIR-V is changed when it is loaded; the files of the package stay as they are.

use crate::machine::error::VulkanError;
use crate::output::encoding::Encoding;
use crate::output::rotations::Layout;
use crate::shader::{Form, Kernel, List, SPREAD_WORKGROUP, Store, Variants, spirv};
use crate::work::lists::spread::SpreadLanes;

/// How results pass the caches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StoreCaching {
    /// Stores are marked as not temporal, so that what kernels read stays in the caches.
    Streamed,
    /// Stores are as others.
    Cached,
}

/// How numbers are converted to half precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HalfConversion {
    /// The conversion is computed by operations on integers.
    Integers,
    /// The conversion is the device's instruction.
    Device,
}

/// How runs are listed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunList {
    /// The runs of every track.
    EachTrack,
    /// The runs of a few tracks, which are repeated for others with the same times.
    Shared,
    /// The runs of one track, frame by frame: each lane evaluates those of its track, and neighbours have neighbouring
    /// tracks.
    Tracks,
}

/// One way to run a kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct KernelVariant {
    /// The invocations that evaluate a run together.
    pub lanes: u32,
    /// The invocations of a workgroup.
    pub workgroup: u32,
    /// How results pass the caches.
    pub stores: StoreCaching,
    /// How numbers become halves; `None` where the kernel stores none.
    pub halves: Option<HalfConversion>,
    /// How runs are listed.
    pub list: RunList,
}

impl KernelVariant {
    /// The variant of the pipeline: without the lanes and the list, which come with a dispatch.
    pub(super) fn code(self) -> Self {
        Self {
            lanes: 0,
            list: RunList::EachTrack,
            ..self
        }
    }

    /// The same with stores through the caches.
    pub(super) fn cached(self) -> Self {
        let stores = StoreCaching::Cached;
        Self { stores, ..self }
    }

    /// Whether it is one of the few variants that together have every size of workgroups and both kinds of stores.
    pub(super) fn is_typical(self) -> bool {
        (self.stores == StoreCaching::Cached) == (self.workgroup == 64)
    }

    /// The number of pipelines that it needs in addition to the engine's present ones.
    pub(super) fn new_pipelines(self, today: Self) -> usize {
        usize::from(self.code() != today.code())
    }

    /// The lanes of its lists. Frame by frame, the samples of a track are so far from each other.
    pub(super) fn spread_lanes(self, stride: u32) -> SpreadLanes {
        let log2 = self.lanes.ilog2();
        let lanes = match self.list {
            RunList::EachTrack | RunList::Shared => SpreadLanes::new(log2),
            RunList::Tracks => SpreadLanes::with_tracks(log2, stride),
        };
        lanes.with_workgroup(self.workgroup)
    }

    /// The kernel's name and its code in this variant.
    pub(super) fn code_of(self, kernel: Kernel) -> Result<(&'static str, Vec<u32>), VulkanError> {
        let variants = Variants {
            reads_texels: false,
            converts: self.halves == Some(HalfConversion::Device),
        };
        let (name, code, _) = kernel.code(variants);
        let of_workgroup = match self.workgroup {
            SPREAD_WORKGROUP => Ok(code.to_vec()),
            other => spirv::with_workgroup(code, [SPREAD_WORKGROUP, other]),
        };
        let changed = of_workgroup.and_then(|code| match self.stores {
            StoreCaching::Streamed => Ok(code),
            StoreCaching::Cached => spirv::temporal_stores(&code),
        });
        Ok((
            name,
            changed.expect("the kernels passed when they were compiled"),
        ))
    }
}

/// A kernel over spread runs, and what it stores.
#[derive(Debug, Clone, Copy)]
pub(super) struct LabKernel {
    pub(super) form: Form,
    pub(super) encoding: Encoding,
}

impl LabKernel {
    /// Every form with every store, the most used ones first.
    pub(super) fn all() -> Vec<Self> {
        let mut encodings: Vec<Encoding> = Vec::new();
        for encoding in Encoding::ALL {
            let store = encoding.row().store;
            if encodings.iter().all(|known| known.row().store != store) {
                encodings.push(encoding);
            }
        }
        let each = encodings.into_iter();
        each.flat_map(|encoding| [Form::Arc, Form::Polynomial].map(|form| Self { form, encoding }))
            .collect()
    }

    pub(super) fn kernel(self) -> Kernel {
        Kernel::over_segments(self.form, List::FramesSpread, self.encoding.row().store)
    }

    /// The variant that the engine runs today for results in an order, then the others.
    pub(super) fn variants(
        self,
        layout: Layout,
        today_lanes: u32,
        converts: bool,
        largest: u32,
    ) -> Vec<KernelVariant> {
        let is_half = self.encoding.row().store == Store::F16;
        let conversions: &[Option<HalfConversion>] = match (is_half, converts) {
            (false, _) => &[None],
            (true, true) => &[Some(HalfConversion::Device), Some(HalfConversion::Integers)],
            (true, false) => &[Some(HalfConversion::Integers)],
        };
        let (list, all_lanes): (_, &[u32]) = match layout {
            Layout::TrackMajor => (RunList::EachTrack, &[4, 8, 16, 32]),
            Layout::FrameMajor => (RunList::Tracks, &[8, 32, 128]),
        };
        let today = KernelVariant {
            lanes: today_lanes,
            workgroup: SPREAD_WORKGROUP,
            stores: StoreCaching::Streamed,
            halves: conversions[0],
            list,
        };
        let mut all = vec![today];
        for &halves in conversions {
            for stores in [StoreCaching::Streamed, StoreCaching::Cached] {
                for workgroup in [64, SPREAD_WORKGROUP, 256]
                    .into_iter()
                    .filter(|&n| n <= largest)
                {
                    for &lanes in all_lanes.iter().filter(|&&lanes| lanes <= workgroup) {
                        let variant = KernelVariant {
                            lanes,
                            workgroup,
                            stores,
                            halves,
                            list,
                        };
                        all.extend((variant != today).then_some(variant));
                    }
                }
            }
        }
        if layout == Layout::TrackMajor {
            all.extend(all_lanes.iter().map(|&lanes| KernelVariant {
                lanes,
                list: RunList::Shared,
                ..today
            }));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Today's is the first, and no two are alike.
    #[test]
    fn variants_are_all_there_are() {
        let kernels = LabKernel::all();
        assert_eq!(kernels.len(), 18);
        let f16 = kernels
            .iter()
            .find(|one| one.encoding == Encoding::F16)
            .unwrap();
        for (kernel, converts, count) in
            [(&kernels[0], true, 28), (f16, false, 28), (f16, true, 52)]
        {
            let all = kernel.variants(Layout::TrackMajor, 8, converts, 1024);
            assert_eq!(all.len(), count);
            assert!((1..count).all(|i| !all[..i].contains(&all[i])));
            assert_eq!((all[0].lanes, all[0].workgroup), (8, 128));
            assert_eq!(
                kernel.variants(Layout::TrackMajor, 8, converts, 128).len(),
                (count - 4) / 3 * 2 + 4
            );
            // Frame by frame, lanes of a run are not divided among workgroups.
            let by_frames = kernel.variants(Layout::FrameMajor, 128, converts, 1024);
            assert_eq!(by_frames.len(), (count - 4) / 12 * 8);
            assert!((1..by_frames.len()).all(|i| !by_frames[..i].contains(&by_frames[i])));
            assert!(by_frames.iter().all(|one| one.lanes <= one.workgroup));
        }
    }

    /// Code of other workgroups has one or two constants more, and that of today's is what is shipped.
    #[test]
    fn code_is_changed_where_it_says_so() {
        for lab_kernel in LabKernel::all() {
            let kernel = lab_kernel.kernel();
            let (_, shipped, _) = kernel.code(Variants::default());
            let all = lab_kernel.variants(Layout::TrackMajor, 8, false, 1024);
            assert_eq!(all[0].code_of(kernel).unwrap().1, shipped);
            let bound_of = |code: &[u32]| code[3] - shipped[3];
            for variant in all {
                let code = variant.code_of(kernel).unwrap().1;
                let constants = bound_of(&code);
                match variant.workgroup {
                    SPREAD_WORKGROUP => assert_eq!(constants, 0),
                    _ => assert!((1..=2).contains(&constants), "{lab_kernel:?}: {constants}"),
                }
                let length = shipped.len() + 4 * constants as usize;
                match variant.stores {
                    StoreCaching::Streamed => assert_eq!(code.len(), length),
                    StoreCaching::Cached => assert!(code.len() < length),
                }
            }
        }
    }
}
