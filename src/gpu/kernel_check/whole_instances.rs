//! Trials of the kernels over whole instances of a crowd.

use crate::machine::crowd::CrowdCurves;
use crate::math::canonical::canonical;
use crate::output::crowd::{CrowdOutput, CrowdValues};
use crate::shader::{
    CHANNELS, CrowdBase, CrowdChannel, CrowdClip, CrowdDispatch, CrowdEntry, CrowdSpan,
    CrowdWholeDispatch, FORM_ARC, FORM_CUBIC, Kernel, ON_KEY, ROTATION, SPEED_MAGNITUDE,
    START_BIAS,
};
use crate::twin::crowd_matrices::Rows;
use crate::work::subgroup_instances::SubgroupInstances;
use crate::work::whole_instances::joint_share;

use bytemuck::Zeroable as _;

use super::crowd::{
    BASES, BEFORE, CELLS, CLIPS, CompactGroups, JOINTS, LEVELS, MASKS, channel, entry,
    links_of_levels, plain, rows,
};
use super::random::Random;
use super::{Trial, bytes};

/// The number of instances of the window, and of a workgroup. The number for a workgroup is a power of two, and so
/// large that an invocation has several joints and several time bases.
const INSTANCES: u32 = 38;
const OF_WORKGROUP: u32 = 16;
const CLOCK: u64 = 0x00ab_cdef_0123_4567;

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    use CrowdValues::{Local, Model, Rotations, Skinning};
    if matches!(
        kernel,
        Kernel::CrowdSubgroupRotations | Kernel::CrowdSubgroupRotationsF16
    ) {
        // Subgroups evaluate two instances or one, each with two time bases; one is for subgroups with the fewest
        // lanes.
        return [2, 1]
            .map(|instances| of_subgroups(random, instances))
            .into();
    }
    let curves = match kernel {
        Kernel::CrowdPlainWholeRotations | Kernel::CrowdPlainWholeMatrices => CrowdCurves::Plain,
        Kernel::CrowdCompactWholeRotations => CrowdCurves::Compact,
        _ => CrowdCurves::Any,
    };
    let outputs = match kernel {
        Kernel::CrowdWholeRotations
        | Kernel::CrowdPlainWholeRotations
        | Kernel::CrowdCompactWholeRotations => {
            vec![CrowdOutput::from(Rotations), CrowdOutput::half(Rotations)]
        }
        _ => vec![
            CrowdOutput::half(Local),
            CrowdOutput::from(Model),
            CrowdOutput::from(Skinning),
            CrowdOutput::half(Skinning),
        ],
    };
    let trial = |output| WholeScene::new(random, curves, &SMALL).trial(output);
    outputs.into_iter().map(trial).collect()
}

/// A trial of the kernel whose subgroups take whole instances, for subgroups of any number of lanes.
fn of_subgroups(random: &mut Random, instances: u32) -> Trial {
    let scene = WholeScene::new(random, CrowdCurves::Plain, &LARGE);
    let arguments = CrowdDispatch {
        count: INSTANCES - 1,
        first_instance: BEFORE,
        joints: LARGE.joints,
        bases: BASES,
        clock_low: CLOCK as u32,
        clock_high: (CLOCK >> 32) as u32,
        ..CrowdDispatch::zeroed()
    };
    let pushed = SubgroupInstances::pushed(instances.ilog2(), &arguments);
    // As many workgroups as are needed if each has only one subgroup. With more subgroups, some find nothing to do.
    let groups = [2, INSTANCES.div_ceil(instances).div_ceil(2), 1];
    Trial::new(scene.inputs(), &pushed, groups)
}

/// How large a scene is.
struct Size {
    joints: u32,
    /// The most spans of a time base.
    spans: u32,
    /// The number of cells with segments and keys; the masks follow them.
    cells: u32,
}

const SMALL: Size = Size {
    joints: JOINTS,
    spans: 2,
    cells: CELLS,
};

/// Enough joints that a lane has several, and enough spans that the search for some takes several steps.
const LARGE: Size = Size {
    joints: 44,
    spans: 40,
    cells: 256,
};

/// Everything that the kernels read.
struct WholeScene {
    layers: u32,
    entries: Vec<CrowdEntry>,
    clips: Vec<CrowdClip>,
    bases: Vec<CrowdBase>,
    spans: Vec<CrowdSpan>,
    channels: Vec<CrowdChannel>,
    cells: Vec<[f32; 4]>,
    /// The cell of the first mask, and that of the first reference pose.
    tables: [u32; 2],
    bind: Vec<Rows>,
}

impl WholeScene {
    fn new(random: &mut Random, curves: CrowdCurves, size: &Size) -> Self {
        let &Size {
            joints,
            spans: max_spans,
            cells,
        } = size;
        let is_plain = curves == CrowdCurves::Plain;
        let layers = if is_plain { 1 } else { 4 };
        let (mut clips, mut bases, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        for clip in 0..CLIPS {
            let period = 1000 + random.below(1 << 20);
            let base_count = 1 + clip % BASES;
            clips.push(CrowdClip {
                period,
                first_base: bases.len() as u32,
                bases: base_count,
            });
            for _ in 0..base_count {
                let count = 1 + random.below(max_spans);
                bases.push(CrowdBase {
                    first: spans.len() as u32,
                    count,
                    step: if count < 2 {
                        0
                    } else {
                        1 << (count - 1).ilog2()
                    },
                });
                let starts = (1..max_spans).map(|_| random.below(period));
                let mut starts = Vec::from_iter(starts);
                starts.truncate(count as usize - 1);
                starts.push(0);
                starts.sort_unstable();
                // Parameters are about -1 to 1.
                spans.extend(starts.into_iter().map(|start| CrowdSpan {
                    start: start | if random.once_in(2) { ON_KEY } else { 0 },
                    whole: start as i32,
                    scale: canonical(random.parameter() / period as f32),
                    offset: random.parameter(),
                }));
            }
        }
        let compact = (curves == CrowdCurves::Compact).then(|| CompactGroups::new(random, cells));
        let channels = (0..CLIPS * joints * CHANNELS).map(|index| {
            let any = match (&compact, is_plain, index % CHANNELS == ROTATION) {
                (Some(groups), ..) => groups.channel(random),
                (None, true, true) => plain(random, FORM_ARC),
                (None, true, false) => plain(random, FORM_CUBIC),
                (None, false, _) => channel(random),
            };
            let base = random.below(clips[(index / (joints * CHANNELS)) as usize].bases);
            CrowdChannel {
                form_and_base: any.form_and_base & 0xff00_0000 | base,
                ..any
            }
        });
        let channels = channels.collect();
        let compact = compact.map(|groups| groups.cells).unwrap_or_default();
        let entries = (0..(BEFORE + INSTANCES) * layers).map(|_| {
            let clip = random.below(CLIPS);
            let played = &clips[clip as usize];
            let mut entry = entry(random, clip, played.period, CLOCK);
            if random.once_in(4) {
                // At the start of a span, where a key may be.
                let base = &bases[(played.first_base + random.below(played.bases)) as usize];
                let span = &spans[(base.first + random.below(base.count)) as usize];
                entry.speed_and_modes &= !SPEED_MAGNITUDE;
                entry.start = START_BIAS + (span.start & !ON_KEY);
            }
            entry
        });
        let entries = entries.collect();
        let masks = cells + compact.len() as u32;
        let mut cells: Vec<[f32; 4]> = (0..cells).map(|_| random.rotation()).collect();
        cells.extend(compact);
        let rest = MASKS * joints + CLIPS * joints * CHANNELS;
        cells.extend((0..rest).map(|_| random.rotation()));
        if curves != CrowdCurves::Any {
            cells[0] = [0.0; 4];
        }
        Self {
            tables: [masks, masks + MASKS * joints],
            layers,
            entries,
            bind: (0..JOINTS).map(|_| rows(random)).collect(),
            clips,
            bases,
            spans,
            channels,
            cells,
        }
    }

    fn trial(&self, output: CrowdOutput) -> Trial {
        let is_rotations = output.values == CrowdValues::Rotations;
        let walks = matches!(output.values, CrowdValues::Model | CrowdValues::Skinning);
        let (links, first_link) = links_of_levels();
        let [masks, references] = self.tables;
        let pushed = CrowdWholeDispatch {
            count: INSTANCES,
            first_instance: BEFORE,
            joints: JOINTS,
            layers: self.layers,
            bases: BASES,
            first_link,
            clock_low: CLOCK as u32,
            clock_high: (CLOCK >> 32) as u32,
            masks,
            references,
            instances: OF_WORKGROUP,
            joint_share: joint_share(JOINTS),
            levels: if walks { LEVELS.len() as u32 } else { 0 },
            is_skinning: (output.values == CrowdValues::Skinning).into(),
            is_half: output.is_half.into(),
        };
        // One workgroup too many, which must do nothing.
        let groups = [2, INSTANCES.div_ceil(OF_WORKGROUP).div_ceil(2), 1];
        let mut inputs = self.inputs();
        if !is_rotations {
            inputs.extend([bytes(&links), bytes(&self.bind)]);
        }
        Trial::new(inputs, &pushed, groups)
    }

    /// The buffers that all kernels read.
    fn inputs(&self) -> Vec<Vec<u8>> {
        vec![
            bytes(&self.entries),
            bytes(&self.clips),
            bytes(&self.bases),
            bytes(&self.spans),
            bytes(&self.channels),
            bytes(&self.cells),
        ]
    }
}
