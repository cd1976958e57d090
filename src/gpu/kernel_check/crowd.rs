//! Trials of the kernels over a crowd.

use crate::machine::crowd::CrowdCurves;
use crate::shader::{
    CHANNELS, CrowdBase, CrowdChange, CrowdChannel, CrowdClip, CrowdDispatch, CrowdEntry,
    CrowdLink, CrowdPosition, CrowdSpan, FORM_ARC, FORM_ARC_KEYS, FORM_CONSTANT, FORM_CUBIC,
    FORM_CUBIC_KEYS, FORM_LINE, FORM_POLYNOMIAL, KEY_AT_END, Kernel, ON_KEY, ROTATION,
    RUNS_BACKWARDS, SPEED_MAGNITUDE, START_BIAS, TangentWeights,
};
use crate::twin::crowd_compact::SOURCE_FLOAT;
use crate::twin::crowd_entries::change;
use crate::twin::crowd_matrices::Rows;

use bytemuck::Zeroable as _;

use super::random::Random;
use super::{Trial, bytes, groups};

/// Instances of the window, and those before it.
const INSTANCES: u32 = 11;
pub(super) const BEFORE: u32 = 1;
pub(super) const JOINTS: u32 = 7;
pub(super) const CLIPS: u32 = 3;
pub(super) const BASES: u32 = 2;
/// Cells of segments and keys, before the masks.
pub(super) const CELLS: u32 = 72;
pub(super) const MASKS: u32 = 3;

pub(super) fn trials(kernel: Kernel, random: &mut Random) -> Vec<Trial> {
    use CrowdCurves::{Any, Compact, Plain};
    match kernel {
        Kernel::CrowdTimes => vec![times(random)],
        Kernel::CrowdWalk => vec![walk(random)],
        Kernel::CrowdWalkAll => vec![walk_all(random)],
        Kernel::CrowdSkin => vec![skin(random)],
        Kernel::CrowdHalf => vec![half(random)],
        Kernel::CrowdGather => vec![gathered(random)],
        Kernel::CrowdScatter => vec![scattered(random)],
        Kernel::CrowdPlainRotations => vec![joints(random, 1, Plain, false)],
        Kernel::CrowdPlainLocals => vec![joints(random, 1, Plain, true)],
        Kernel::CrowdRotations => vec![joints(random, 3, Any, false)],
        Kernel::CrowdCompactRotations => vec![joints(random, 3, Compact, false)],
        Kernel::CrowdCompactLocals => vec![joints(random, 3, Compact, true)],
        _ => vec![joints(random, 3, Any, true)],
    }
}

/// A number below 2^`bits`, of any magnitude.
fn number(random: &mut Random, bits: u32) -> u64 {
    let word = u64::from(random.word()) << 32 | u64::from(random.word());
    let random_bits = random.below(bits + 1);
    word.checked_shr(64 - random_bits).unwrap_or(0)
}

/// An entry at any time of a clip with this period, for a time of the clock.
pub(super) fn entry(random: &mut Random, clip: u32, period: u32, clock: u64) -> CrowdEntry {
    let wrap = random.below(3);
    let within = number(random, 32) % (u64::from(period) * u64::from(wrap.max(1)) + 1);
    let early = match wrap {
        0 if random.once_in(8) => random.below(1 << 15),
        _ => 0,
    };
    let backwards = if random.once_in(2) { RUNS_BACKWARDS } else { 0 };
    let mut speed = number(random, 23) as u32 & SPEED_MAGNITUDE;
    if random.once_in(4) {
        speed = 0; // a layer that stands still, possibly exactly at a key
    }
    let weight = random.below(0x8001);
    let weight = if random.once_in(4) { 0 } else { weight };
    let (mask, additive) = (random.below(MASKS), random.below(2));
    let elapsed = number(random, 40);
    CrowdEntry {
        clip_and_weight: clip | weight << 16,
        speed_and_modes: speed | backwards | mask << 24 | wrap << 29 | additive << 31,
        start: START_BIAS + within as u32 - early,
        anchor: (clock.wrapping_sub(elapsed) >> 8) as u32,
    }
}

fn times(random: &mut Random) -> Trial {
    const LAYERS: u32 = 2;
    const MAX_BASES: u32 = 3;
    const CLOCK: u64 = 0x00ab_cdef_0123_4567;
    let (mut clips, mut bases, mut spans) = (Vec::new(), Vec::new(), Vec::new());
    for clip in 0..CLIPS {
        let period = 1 + number(random, 30) as u32;
        let base_count = 1 + clip % MAX_BASES;
        clips.push(CrowdClip {
            period,
            first_base: bases.len() as u32,
            bases: base_count,
        });
        for _ in 0..base_count {
            let count = 1 + random.below(9);
            let mut starts: Vec<u32> = (1..count)
                .map(|_| (number(random, 31) % u64::from(period + 1)) as u32)
                .collect();
            starts.push(0);
            starts.sort_unstable();
            let step = if count < 2 {
                0
            } else {
                1 << (count - 1).ilog2()
            };
            bases.push(CrowdBase {
                first: spans.len() as u32,
                count,
                step,
            });
            spans.extend(starts.into_iter().map(|start| CrowdSpan {
                start: start | if random.once_in(2) { ON_KEY } else { 0 },
                whole: (start as i32).wrapping_add(random.below(1 << 20) as i32),
                scale: random.number(),
                offset: random.parameter(),
            }));
        }
    }
    let mut entries = Vec::new();
    for _ in 0..(BEFORE + 4 * INSTANCES) * LAYERS {
        let clip = random.below(CLIPS);
        let mut entry = entry(random, clip, clips[clip as usize].period, CLOCK);
        let clip = &clips[clip as usize];
        if entry.speed_and_modes & SPEED_MAGNITUDE == 0 {
            let base = &bases[(clip.first_base + random.below(clip.bases)) as usize];
            let span = &spans[(base.first + random.below(base.count)) as usize];
            entry.start = START_BIAS + (span.start & !ON_KEY);
        }
        entries.push(entry);
    }
    let count = 4 * INSTANCES * LAYERS * MAX_BASES;
    let dispatch = CrowdDispatch {
        count,
        first_instance: BEFORE,
        layers: LAYERS,
        bases: MAX_BASES,
        clock_low: CLOCK as u32,
        clock_high: (CLOCK >> 32) as u32,
        ..CrowdDispatch::zeroed()
    };
    let inputs = [bytes(&entries), bytes(&clips), bytes(&bases), bytes(&spans)];
    Trial::new(inputs, &dispatch, groups(count as usize, false))
}

pub(super) fn channel(random: &mut Random) -> CrowdChannel {
    let forms = [FORM_CONSTANT, FORM_ARC, FORM_CUBIC, FORM_POLYNOMIAL];
    let form = forms[random.below(4) as usize];
    CrowdChannel {
        first: random.below(3),
        count: 1 + random.below(2),
        form_and_base: form << 24 | random.below(BASES),
        keys: random.below(60),
    }
}

/// A channel of one form, or a constant one, for the kernels without branches.
pub(super) fn plain(random: &mut Random, form: u32) -> CrowdChannel {
    let channel = channel(random);
    let (first, base) = (channel.first + 1, channel.form_and_base & 0x00ff_ffff);
    match random.once_in(3) {
        true => CrowdChannel {
            first,
            count: 0,
            form_and_base: FORM_CONSTANT << 24 | base,
            keys: first,
        },
        false => CrowdChannel {
            first,
            form_and_base: form << 24 | base,
            ..channel
        },
    }
}

/// Channels that are stored compactly, with two spans each, and their cells, of which the first has an index.
pub(super) struct CompactGroups {
    pub(super) cells: Vec<[f32; 4]>,
    channels: Vec<CrowdChannel>,
}

impl CompactGroups {
    pub(super) fn new(random: &mut Random, first: u32) -> Self {
        // Keys, of which the last is at the end of the last span.
        const ROWS: usize = 3;
        const CUBICS: usize = 5;
        const OTHERS: usize = 2;
        let mut key = [0; CUBICS].map(|_| random.unit());
        let mut row = |random: &mut Random| {
            for key in &mut key {
                let step = random.step();
                *key = random.near(*key, step);
            }
            // Some keys are multiplied by 4, as keys that were added with the opposite sign.
            key.map(|key| match random.once_in(3) {
                true => key.map(|component| component * 4.0),
                false => key,
            })
        };
        let (mut cells, mut channels) = (Vec::new(), Vec::new());
        let of_sources = CUBICS.div_ceil(4);
        let segments = (ROWS * (1 + of_sources + CUBICS)) as u32;
        for index in 0..ROWS {
            let weights = random.weights();
            let kind = match index {
                1 => weights.kind,
                _ => KEY_AT_END,
            };
            cells.push(bytemuck::cast(TangentWeights { kind, ..weights }));
            for _ in 0..of_sources {
                // Segments of degree 6, 8 and 10.
                let [degree_6, degree_8, degree_10] = [0, 7, 16].map(|row| (segments + row) << 2);
                let sources = [0, 0, degree_6, degree_8 | 1, degree_10 | 2];
                let word = |()| {
                    let source = sources[random.below(5) as usize];
                    f32::from_bits(SOURCE_FLOAT | source)
                };
                cells.push([(); 4].map(word));
            }
            cells.extend(row(random));
        }
        cells.extend((0..7 + 9 + 11).map(|_| random.rotation()));
        let keys_of_row = (1 + of_sources) as u32;
        channels.extend((0..CUBICS as u32).map(|member| CrowdChannel {
            first: first + keys_of_row + member,
            count: CUBICS as u32,
            form_and_base: FORM_CUBIC_KEYS << 24,
            keys: first,
        }));
        for form in [FORM_ARC_KEYS, FORM_LINE] {
            let start = first + cells.len() as u32;
            for _ in 0..ROWS {
                let keys = row(random);
                cells.extend_from_slice(&keys[..OTHERS]);
            }
            channels.extend((0..OTHERS as u32).map(|member| CrowdChannel {
                first: start + member,
                count: OTHERS as u32,
                form_and_base: form << 24,
                keys: start + member,
            }));
        }
        Self { cells, channels }
    }

    /// One of the channels, or one of any other form.
    pub(super) fn channel(&self, random: &mut Random) -> CrowdChannel {
        let other = channel(random);
        let compact = self.channels[random.below(self.channels.len() as u32) as usize];
        let base = other.form_and_base & 0x00ff_ffff;
        match random.once_in(3) {
            true => other,
            false => CrowdChannel {
                form_and_base: compact.form_and_base | base,
                ..compact
            },
        }
    }
}

fn joints(random: &mut Random, layers: u32, curves: CrowdCurves, are_locals: bool) -> Trial {
    let entries: Vec<_> = (0..(BEFORE + INSTANCES) * layers)
        .map(|_| {
            let clip = random.below(CLIPS);
            entry(random, clip, 1 << 20, 0)
        })
        .collect();
    let compact = (curves == CrowdCurves::Compact).then(|| CompactGroups::new(random, CELLS));
    let channels: Vec<_> = (0..CLIPS * JOINTS * CHANNELS)
        .map(|i| match (&compact, curves, i % CHANNELS == ROTATION) {
            (Some(groups), ..) => groups.channel(random),
            (None, CrowdCurves::Plain, true) => plain(random, FORM_ARC),
            (None, CrowdCurves::Plain, false) => plain(random, FORM_CUBIC),
            (None, ..) => channel(random),
        })
        .collect();
    let compact = compact.map(|groups| groups.cells).unwrap_or_default();
    let masks = CELLS + compact.len() as u32;
    let references = masks + MASKS * JOINTS;
    let mut cells: Vec<[f32; 4]> = (0..CELLS).map(|_| random.rotation()).collect();
    cells.extend(compact);
    let rest = MASKS * JOINTS + CLIPS * JOINTS * CHANNELS;
    cells.extend((0..rest).map(|_| random.rotation()));
    if curves != CrowdCurves::Any {
        cells[0] = [0.0; 4];
    }
    let positions: Vec<_> = (0..INSTANCES * layers * BASES)
        .map(|_| CrowdPosition {
            span: random.below(2) | if random.once_in(4) { ON_KEY } else { 0 },
            parameter: random.parameter(),
        })
        .collect();
    let count = INSTANCES * JOINTS;
    let dispatch = CrowdDispatch {
        count,
        first_instance: BEFORE,
        joints: JOINTS,
        layers,
        bases: BASES,
        masks,
        references,
        ..CrowdDispatch::zeroed()
    };
    let inputs = [
        bytes(&entries),
        bytes(&channels),
        bytes(&cells),
        bytes(&positions),
    ];
    Trial::new(inputs, &dispatch, groups(count as usize, !are_locals))
}

pub(super) fn rows(random: &mut Random) -> Rows {
    [random.vector(), random.vector(), random.vector()]
}

fn walk(random: &mut Random) -> Trial {
    // The links of all levels. The kernel computes the last level.
    const LINKS: [[u32; 2]; 6] = [[1, 0], [2, 0], [6, 1], [3, 2], [5, 2], [4, 1]];
    const LEVEL: usize = 4;
    const POSES: usize = 19;
    let before: Vec<_> = (0..POSES * JOINTS as usize).map(|_| rows(random)).collect();
    let links = LINKS.map(|[joint, parent]| CrowdLink { joint, parent });
    let first_link = LINKS.len() - LEVEL;
    let count = POSES * LEVEL;
    let dispatch = CrowdDispatch {
        count: count as u32,
        joints: LEVEL as u32,
        layers: JOINTS,
        first_link: first_link as u32,
        ..CrowdDispatch::zeroed()
    };
    Trial::new([bytes(&links)], &dispatch, groups(count, true)).over(&before)
}

/// The links of a skeleton, level by level: each a joint and its parent.
pub(super) const LEVELS: [&[[u32; 2]]; 3] =
    [&[[1, 0], [2, 0]], &[[6, 1]], &[[3, 2], [5, 6], [4, 6]]];

/// These links, followed by the first and the last index of each level.
pub(super) fn links_of_levels() -> (Vec<CrowdLink>, u32) {
    let link = |[joint, parent]: [u32; 2]| CrowdLink { joint, parent };
    let mut links: Vec<_> = LEVELS.concat().into_iter().map(link).collect();
    let mut first = 0;
    let first_link = links.len() as u32;
    for level in LEVELS {
        links.push(link([first, first + level.len() as u32]));
        first += level.len() as u32;
    }
    (links, first_link)
}

fn walk_all(random: &mut Random) -> Trial {
    const POSES: usize = 19;
    let before: Vec<_> = (0..POSES * JOINTS as usize).map(|_| rows(random)).collect();
    let (links, first_link) = links_of_levels();
    let dispatch = CrowdDispatch {
        count: POSES as u32,
        joints: JOINTS,
        layers: LEVELS.len() as u32,
        first_link,
        ..CrowdDispatch::zeroed()
    };
    // Each workgroup evaluates a pose; one workgroup too many is dispatched and must do nothing.
    Trial::new([bytes(&links)], &dispatch, [4, 5, 1]).over(&before)
}

fn skin(random: &mut Random) -> Trial {
    const POSES: usize = 5;
    let before: Vec<_> = (0..POSES * JOINTS as usize).map(|_| rows(random)).collect();
    let bind: Vec<_> = (0..JOINTS).map(|_| rows(random)).collect();
    let count = 3 * before.len();
    let dispatch = CrowdDispatch {
        count: count as u32,
        joints: JOINTS,
        ..CrowdDispatch::zeroed()
    };
    Trial::new([bytes(&bind)], &dispatch, groups(count, false)).over(&before)
}

fn half(random: &mut Random) -> Trial {
    const VALUES: usize = 139;
    // A number near the largest half float, or any other number.
    let number = |random: &mut Random| match random.once_in(4) {
        true => 65_520.0 + 100.0 * random.number(),
        false => random.finite(),
    };
    let values: Vec<[f32; 4]> = (0..VALUES)
        .map(|_| [0; 4].map(|_| number(random)))
        .collect();
    let dispatch = CrowdDispatch {
        count: VALUES as u32,
        ..CrowdDispatch::zeroed()
    };
    Trial::new([bytes(&values)], &dispatch, groups(VALUES, true))
}

/// Entries of random words.
fn any_entries(random: &mut Random, count: u32) -> Vec<CrowdEntry> {
    let any = |random: &mut Random| CrowdEntry {
        clip_and_weight: random.word(),
        speed_and_modes: random.word(),
        start: random.word(),
        anchor: random.word(),
    };
    (0..count).map(|_| any(random)).collect()
}

fn gathered(random: &mut Random) -> Trial {
    const LAYERS: u32 = 3;
    const ALL: u32 = 60;
    const VISIBLE: u32 = 45;
    let entries = any_entries(random, ALL * LAYERS);
    let visible: Vec<u32> = (0..BEFORE + VISIBLE).map(|_| random.below(ALL)).collect();
    let count = VISIBLE * LAYERS;
    let dispatch = CrowdDispatch {
        count,
        first_instance: BEFORE,
        layers: LAYERS,
        ..CrowdDispatch::zeroed()
    };
    let inputs = [bytes(&entries), bytes(&visible)];
    Trial::new(inputs, &dispatch, groups(count as usize, false))
}

fn scattered(random: &mut Random) -> Trial {
    const ENTRIES: u32 = 300;
    let before = any_entries(random, ENTRIES);
    let entries = any_entries(random, ENTRIES).into_iter().zip(0..);
    let changes: Vec<CrowdChange> = entries
        .filter(|_| random.once_in(3))
        .map(|(entry, index)| change(index, &entry))
        .collect();
    // The count leaves out the last change, so that a kernel that ignores the count is found.
    let count = changes.len() - 1;
    let dispatch = CrowdDispatch {
        count: count as u32,
        ..CrowdDispatch::zeroed()
    };
    Trial::new([bytes(&changes)], &dispatch, groups(count, true)).over(&before)
}
