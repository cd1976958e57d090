//! The kernels over a crowd, each function beside its twin.

use crate::shader::{
    CHANNELS, CrowdBase, CrowdChange, CrowdChannel, CrowdClip, CrowdEntry, CrowdPosition,
    CrowdSpan, FORM_ARC, FORM_CONSTANT, FORM_CUBIC, FORM_POLYNOMIAL, ON_KEY, ROTATION,
    RUNS_BACKWARDS, SCALE, START_BIAS, TRANSLATION,
};
use crate::twin::crowd_entries::{change, gather, scatter};
use crate::twin::crowd_layers::{Layers, cubic, laid_over, sampled};
use crate::twin::crowd_matrices::{
    Rows, affine_product, row_product, to_any_half, transform, transform_row,
};
use crate::twin::crowd_times::{
    base_positions, in_parts, position_at, span_at, tick_of, wide_remainder,
};
use crate::twin::functions::rotation_added;

use super::cells::Cells;
use super::trial::{Twin, TwinTrial, UNTOUCHED, twin, with_globals};
use crate::gpu::kernel_check::random::Random;

const TIMES: &str = "crowd_times";
const LAYERS: &str = "crowd_rotations";
const LOCALS: &str = "crowd_locals";

impl Cells for CrowdEntry {
    fn put(&self, cells: &mut Vec<u64>) {
        let words = [
            self.clip_and_weight,
            self.speed_and_modes,
            self.start,
            self.anchor,
        ];
        words.put(cells);
    }
}

impl Cells for CrowdChange {
    fn put(&self, cells: &mut Vec<u64>) {
        let words = [
            self.index,
            self.clip_and_weight,
            self.speed_and_modes,
            self.start,
            self.anchor,
        ];
        words.put(cells);
    }
}

impl Cells for CrowdPosition {
    fn put(&self, cells: &mut Vec<u64>) {
        (self.span, self.parameter).put(cells);
    }
}

impl Cells for CrowdChannel {
    fn put(&self, cells: &mut Vec<u64>) {
        [self.first, self.count, self.form_and_base, self.keys].put(cells);
    }
}

impl Cells for CrowdSpan {
    fn put(&self, cells: &mut Vec<u64>) {
        (self.start, self.whole, self.scale, self.offset).put(cells);
    }
}

impl Cells for CrowdBase {
    fn put(&self, cells: &mut Vec<u64>) {
        [self.first, self.count, self.step].put(cells);
    }
}

impl Cells for CrowdClip {
    fn put(&self, cells: &mut Vec<u64>) {
        [self.period, self.first_base, self.bases].put(cells);
    }
}

fn words(value: u64) -> [u32; 2] {
    [value as u32, (value >> 32) as u32]
}

/// A number below 2^`bits`, of any magnitude.
fn number(random: &mut Random, bits: u32) -> u64 {
    let word = u64::from(random.word()) << 32 | u64::from(random.word());
    let length = random.below(bits + 1);
    word.checked_shr(64 - length).unwrap_or(0)
}

/// What comes with a dispatch.
#[derive(Default, Clone, Copy)]
pub(super) struct CrowdDispatch {
    pub(super) count: u32,
    pub(super) first_instance: u32,
    pub(super) joints: u32,
    pub(super) layers: u32,
    pub(super) bases: u32,
    pub(super) first_link: u32,
    pub(super) clock: u64,
    pub(super) masks: u32,
    pub(super) references: u32,
}

impl Cells for CrowdDispatch {
    fn put(&self, cells: &mut Vec<u64>) {
        let [low, high] = words(self.clock);
        let words = [
            self.count,
            self.first_instance,
            self.joints,
            self.layers,
            self.bases,
            self.first_link,
            low,
            high,
            self.masks,
            self.references,
        ];
        Cells::put(&words, cells);
    }
}

impl CrowdDispatch {
    fn put(&self, trial: &mut TwinTrial) {
        let mut cells = Vec::new();
        Cells::put(self, &mut cells);
        trial.global("dispatch", cells);
    }
}

/// An entry that may stand anywhere in a clip of a period, and a time of the clock.
pub(super) fn entry(random: &mut Random, period: u32) -> (CrowdEntry, u64) {
    let wrap = random.below(3);
    let within = number(random, 32) % (u64::from(period) * u64::from(wrap.max(1)) + 1);
    let early = match wrap {
        0 if random.once_in(8) => random.below(1 << 15),
        _ => 0,
    };
    let backwards = if random.once_in(2) { RUNS_BACKWARDS } else { 0 };
    let (speed, mask, additive) = (number(random, 23) as u32, random.below(3), random.below(2));
    let anchor = random.word();
    let elapsed = number(random, 40) + (u64::from(random.word()) << 40);
    let result = CrowdEntry {
        clip_and_weight: random.below(2) | random.below(0x8001) << 16,
        speed_and_modes: speed | backwards | mask << 24 | wrap << 29 | additive << 31,
        start: START_BIAS + within as u32 - early,
        anchor,
    };
    (result, (u64::from(anchor) << 8).wrapping_add(elapsed))
}

pub(super) fn period(random: &mut Random) -> u32 {
    1 + number(random, 30) as u32
}

/// Time bases and their spans, for clips of a period.
fn time_bases(random: &mut Random, period: u32, count: u32) -> (Vec<CrowdBase>, Vec<CrowdSpan>) {
    let (mut bases, mut spans) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let length = 1 + random.below(6);
        let first = spans.len() as u32;
        let mut starts: Vec<u32> = (1..length)
            .map(|_| (number(random, 31) % u64::from(period + 1)) as u32)
            .collect();
        starts.push(0);
        starts.sort_unstable();
        spans.extend(starts.into_iter().map(|start| CrowdSpan {
            start: start | if random.once_in(2) { ON_KEY } else { 0 },
            whole: (start as i32).wrapping_add(random.below(1 << 20) as i32),
            scale: random.number(),
            offset: random.parameter(),
        }));
        bases.push(CrowdBase {
            first,
            count: length,
            step: if length < 2 {
                0
            } else {
                1 << (length - 1).ilog2()
            },
        });
    }
    (bases, spans)
}

pub(super) fn times() -> Vec<Twin> {
    let two = |random: &mut Random| {
        let (a, mut b) = (number(random, 64), number(random, 64));
        if random.once_in(4) {
            b = a & 0xffff_ffff | b << 32; // the same lower word
        }
        if random.once_in(4) {
            b = a >> 32 << 32 | b & 0xffff_ffff;
        }
        [words(a), words(b)]
    };
    let whole = |[low, high]: [u32; 2]| u64::from(low) | u64::from(high) << 32;
    let both = move |[a, b]: [[u32; 2]; 2]| (whole(a), whole(b));
    vec![
        twin(TIMES, "wide_less", two, move |pair| {
            let (a, b) = both(pair);
            a < b
        }),
        twin(TIMES, "wide_sum", two, move |pair| {
            let (a, b) = both(pair);
            words(a.wrapping_add(b))
        }),
        twin(TIMES, "wide_difference", two, move |pair| {
            let (a, b) = both(pair);
            words(a.wrapping_sub(b))
        }),
        twin(
            TIMES,
            "wide_product",
            |random| (number(random, 32) as u32, number(random, 32) as u32),
            |(a, b)| words(u64::from(a) * u64::from(b)),
        ),
        twin(
            TIMES,
            "wide_remainder",
            |random| {
                let (x, q) = (number(random, 63), 1 + number(random, 62));
                [words(x), words(q)]
            },
            move |pair| {
                let (x, q) = both(pair);
                words(wide_remainder(x, q))
            },
        ),
        twin(TIMES, "in_parts", Random::word, |ticks| {
            words(in_parts(ticks))
        }),
        with_globals(TIMES, "tick_of", |random, trial| {
            let period = period(random);
            let (entry, clock) = entry(random, period);
            trial.argument(entry);
            trial.argument(period);
            let dispatch = CrowdDispatch {
                clock,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.expect(tick_of(&entry, period, clock));
        }),
        with_globals(TIMES, "span_at", |random, trial| {
            let period = period(random);
            let (bases, spans) = time_bases(random, period, 2);
            let base = bases[random.below(2) as usize];
            let tick = match random.once_in(2) {
                true => spans[random.below(spans.len() as u32) as usize].start & !ON_KEY,
                false => random.below(period + 1),
            };
            trial.argument(base);
            trial.argument(tick);
            trial.expect(span_at(&base, &spans, tick));
            trial.global("spans", spans);
        }),
        with_globals(TIMES, "crowd_work", |random, trial| {
            const BASES: u32 = 3;
            let periods = [period(random), period(random)];
            let counts = [1 + random.below(BASES), 1 + random.below(BASES)];
            let (mut bases, mut spans, mut clips) = (Vec::new(), Vec::new(), Vec::new());
            for (period, count) in periods.into_iter().zip(counts) {
                let (mut clip_bases, more) = time_bases(random, period, count);
                clip_bases
                    .iter_mut()
                    .for_each(|base| base.first += spans.len() as u32);
                clips.push(CrowdClip {
                    period,
                    first_base: bases.len() as u32,
                    bases: count,
                });
                bases.extend(clip_bases);
                spans.extend(more);
            }
            let (first_instance, layers) = (random.below(2), 1 + random.below(2));
            let (layer, base) = (random.below(2), random.below(BASES));
            let index = layer * BASES + base;
            let mut entries = vec![[0u32; 4]; (first_instance * layers + layer) as usize];
            let (mut played, clock) = entry(random, periods[0].min(periods[1]));
            if random.once_in(4) {
                // It stands at a key.
                played.speed_and_modes &= !0x7f_ffff;
            }
            entries.push([
                played.clip_and_weight,
                played.speed_and_modes,
                played.start,
                played.anchor,
            ]);
            trial.argument(index);
            let dispatch = CrowdDispatch {
                first_instance,
                layers,
                bases: BASES,
                clock,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.output("positions");
            trial.expect(vec![[UNTOUCHED; 2]; index as usize]);
            let clip = (played.clip_and_weight & 0xffff) as usize;
            if base < counts[clip] {
                let mut found = [CrowdPosition {
                    span: 0,
                    parameter: 0.0,
                }; BASES as usize];
                base_positions(&played, clock, &clips, &bases, &spans, &mut found);
                let at = &bases[(clips[clip].first_base + base) as usize];
                let tick = tick_of(&played, clips[clip].period, clock);
                assert_eq!(found[base as usize], position_at(at, &spans, tick));
                trial.expect(found[base as usize]);
            } else {
                trial.expect([UNTOUCHED; 2]);
            }
            trial.global("entries", entries);
            trial.global("clips", clips);
            trial.global("time_bases", bases);
            trial.global("spans", spans);
        }),
    ]
}

pub(super) const JOINTS: u32 = 2;
pub(super) const BASES: u32 = 2;
pub(super) const CLIPS: u32 = 2;
/// Cells of segments and keys, before the masks.
pub(super) const CELLS: u32 = 72;

/// Everything that the kernels over layers read.
pub(super) struct LayerScene {
    pub(super) entries: Vec<CrowdEntry>,
    pub(super) channels: Vec<CrowdChannel>,
    pub(super) cells: Vec<[f32; 4]>,
    pub(super) positions: Vec<CrowdPosition>,
    pub(super) layers: u32,
    pub(super) first_instance: u32,
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

pub(super) fn position(random: &mut Random) -> CrowdPosition {
    CrowdPosition {
        span: random.below(2) | if random.once_in(4) { ON_KEY } else { 0 },
        parameter: random.parameter(),
    }
}

pub(super) fn cells(random: &mut Random, count: u32) -> Vec<[f32; 4]> {
    (0..count).map(|_| random.rotation()).collect()
}

impl LayerScene {
    /// For two instances of a window.
    pub(super) fn new(random: &mut Random) -> Self {
        let (layers, first_instance) = (1 + random.below(3), random.below(2));
        let masks = 3 * JOINTS;
        let references = CLIPS * JOINTS * CHANNELS;
        let mut entries: Vec<_> = (0..(2 + first_instance) * layers)
            .map(|_| entry(random, 1 << 20).0)
            .collect();
        for entry in &mut entries {
            if random.once_in(4) {
                entry.clip_and_weight &= 0xffff;
            }
        }
        Self {
            entries,
            channels: (0..CLIPS * JOINTS * CHANNELS)
                .map(|_| channel(random))
                .collect(),
            cells: cells(random, CELLS + masks + references),
            positions: (0..2 * layers * BASES).map(|_| position(random)).collect(),
            layers,
            first_instance,
        }
    }

    pub(super) fn twin(&self) -> Layers<'_> {
        Layers {
            entries: &self.entries[(self.first_instance * self.layers) as usize..],
            channels: &self.channels,
            cells: &self.cells,
            positions: &self.positions,
            joints: JOINTS,
            layers: self.layers,
            bases: BASES,
            masks: CELLS,
            references: CELLS + 3 * JOINTS,
        }
    }

    pub(super) fn put(&self, trial: &mut TwinTrial) {
        trial.global("entries", self.entries.as_slice().to_cells());
        trial.global("channels", self.channels.as_slice().to_cells());
        trial.global("cells", self.cells.as_slice().to_cells());
        trial.global("positions", self.positions.as_slice().to_cells());
        let dispatch = CrowdDispatch {
            first_instance: self.first_instance,
            joints: JOINTS,
            layers: self.layers,
            bases: BASES,
            masks: CELLS,
            references: CELLS + 3 * JOINTS,
            ..CrowdDispatch::default()
        };
        dispatch.put(trial);
    }
}

impl LayerScene {
    /// One layer, whose rotations are arcs and constants, and all others cubics and constants.
    fn make_plain(&mut self) {
        self.layers = 1;
        self.cells[0] = [0.0; 4];
        for (kind, channel) in (0..).zip(&mut self.channels) {
            *channel = match kind % CHANNELS == ROTATION {
                true => plain(*channel, FORM_ARC),
                false => plain(*channel, FORM_CUBIC),
            };
        }
    }
}

/// The channel in a form, or as a constant where its first key has an even index.
pub(super) fn plain(channel: CrowdChannel, form: u32) -> CrowdChannel {
    let is_constant = channel.keys.is_multiple_of(2);
    let form = if is_constant { FORM_CONSTANT } else { form };
    let first = channel.first + 1;
    CrowdChannel {
        first,
        count: if is_constant { 0 } else { channel.count },
        form_and_base: form << 24 | channel.form_and_base & 0x00ff_ffff,
        keys: if is_constant { first } else { channel.keys },
    }
}

fn plain_value(function: &'static str, form: u32) -> Twin {
    with_globals("crowd_plain_locals", function, move |random, trial| {
        let (channel, position) = (plain(channel(random), form), position(random));
        let mut cells = cells(random, CELLS);
        cells[0] = [0.0; 4];
        trial.argument(channel);
        trial.argument(position);
        trial.expect(sampled(&cells, &channel, position));
        trial.global("cells", cells);
    })
}

pub(super) trait ToCells {
    fn to_cells(&self) -> Vec<u64>;
}

impl<T: Cells> ToCells for [T] {
    fn to_cells(&self) -> Vec<u64> {
        let mut cells = Vec::new();
        self.put(&mut cells);
        cells
    }
}

pub(super) fn layers() -> Vec<Twin> {
    let four = |random: &mut Random| [0; 4].map(|_| random.vector::<4>());
    vec![
        twin(
            LAYERS,
            "cubic",
            move |random| (four(random), random.parameter()),
            |(c, s)| -> [f32; 4] {
                std::array::from_fn(|i| cubic(c[0][i], c[1][i], c[2][i], c[3][i], s))
            },
        ),
        twin(
            LAYERS,
            "rotation_added",
            |random| {
                let rotations = [random.rotation(), random.rotation(), random.rotation()];
                (rotations, random.number())
            },
            |([base, layer, reference], weight)| rotation_added(base, layer, reference, weight),
        ),
        twin(
            LAYERS,
            "laid_over",
            |random| {
                let kind = [ROTATION, TRANSLATION, SCALE][random.below(3) as usize];
                let rotations = [random.rotation(), random.rotation(), random.rotation()];
                (kind, random.once_in(2), rotations, random.number())
            },
            |(kind, additive, [below, layer, reference], weight)| {
                laid_over(kind, additive, below, layer, reference, weight)
            },
        ),
        with_globals(LAYERS, "sampled", |random, trial| {
            let (channel, position, cells) =
                (channel(random), position(random), cells(random, CELLS));
            trial.argument(channel);
            trial.argument(position);
            trial.expect(sampled(&cells, &channel, position));
            trial.global("cells", cells);
        }),
        with_globals(LAYERS, "layer_value", |random, trial| {
            let scene = LayerScene::new(random);
            let (joint, kind) = (random.below(JOINTS), random.below(CHANNELS));
            let layer = random.below(2 * scene.layers);
            let entry = scene.entries[0];
            trial.argument(layer);
            trial.argument(entry);
            trial.argument((joint, kind));
            scene.put(trial);
            trial.expect(scene.twin().layer_value(layer, &entry, joint, kind));
        }),
        with_globals(LAYERS, "layered", |random, trial| {
            let scene = LayerScene::new(random);
            let (instance, joint) = (random.below(2), random.below(JOINTS));
            let kind = random.below(CHANNELS);
            trial.argument((instance, joint, kind));
            scene.put(trial);
            trial.expect(scene.twin().layered(instance, joint, kind));
        }),
        with_globals(LAYERS, "crowd_work", |random, trial| {
            let scene = LayerScene::new(random);
            let (instance, joint) = (random.below(2), random.below(JOINTS));
            let index = instance * JOINTS + joint;
            trial.argument(index);
            scene.put(trial);
            trial.output("rotations");
            trial.expect(vec![[UNTOUCHED; 4]; index as usize]);
            trial.expect(scene.twin().layered(instance, joint, ROTATION));
        }),
        plain_value("arc_value", FORM_ARC),
        plain_value("cubic_value", FORM_CUBIC),
        with_globals("crowd_plain_locals", "layered", |random, trial| {
            let mut scene = LayerScene::new(random);
            scene.make_plain();
            let (instance, joint) = (random.below(2), random.below(JOINTS));
            let kind = random.below(CHANNELS);
            trial.argument((instance, joint, kind));
            scene.put(trial);
            trial.expect(scene.twin().layered(instance, joint, kind));
        }),
        with_globals(LOCALS, "crowd_work", |random, trial| {
            let scene = LayerScene::new(random);
            let (instance, joint) = (random.below(2), random.below(JOINTS));
            let index = instance * JOINTS + joint;
            trial.argument(index);
            scene.put(trial);
            trial.output("rotations");
            trial.expect(vec![[UNTOUCHED; 12]; index as usize]);
            let layered = |kind| scene.twin().layered(instance, joint, kind);
            trial.expect(transform(
                layered(ROTATION),
                layered(TRANSLATION),
                layered(SCALE),
            ));
        }),
    ]
}

pub(super) fn rows(random: &mut Random) -> Rows {
    [random.vector(), random.vector(), random.vector()]
}

/// Entries of any words.
fn any_entries(random: &mut Random, count: u32) -> Vec<CrowdEntry> {
    let any = |random: &mut Random| CrowdEntry {
        clip_and_weight: random.word(),
        speed_and_modes: random.word(),
        start: random.word(),
        anchor: random.word(),
    };
    (0..count).map(|_| any(random)).collect()
}

pub(super) fn entries() -> Vec<Twin> {
    vec![
        with_globals("crowd_gather", "crowd_work", |random, trial| {
            const INSTANCES: u32 = 5;
            let layers = 1 + random.below(4);
            let all = any_entries(random, INSTANCES * layers);
            let visible: Vec<u32> = (0..4).map(|_| random.below(INSTANCES)).collect();
            let (first_instance, index) = (random.below(2), random.below(3 * layers));
            trial.argument(index);
            let dispatch = CrowdDispatch {
                first_instance,
                layers,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.global("all", all.as_slice().to_cells());
            trial.global("visible", visible.clone());
            trial.output("gathered");
            trial.expect(vec![[UNTOUCHED; 4]; index as usize]);
            let window = &visible[first_instance as usize..];
            let mut gathered = gather(&all, window, layers as usize);
            trial.expect(gathered.nth(index as usize).unwrap());
        }),
        with_globals("crowd_scatter", "crowd_work", |random, trial| {
            const ENTRIES: u32 = 5;
            let mut all = any_entries(random, ENTRIES);
            let changes: Vec<CrowdChange> = any_entries(random, 4)
                .iter()
                .map(|entry| change(random.below(ENTRIES), entry))
                .collect();
            let index = random.below(4);
            trial.argument(index);
            trial.global("changes", changes.as_slice().to_cells());
            trial.global("all", all.as_slice().to_cells());
            trial.output("all");
            scatter(&changes[index as usize], &mut all);
            trial.expect(all);
        }),
    ]
}

pub(super) fn matrices() -> Vec<Twin> {
    vec![
        twin(
            LOCALS,
            "transform_row",
            |random| (random.vector(), random.vector(), random.number()),
            |(rotation, scale, moved)| transform_row(rotation, scale, moved),
        ),
        twin(
            "crowd_walk",
            "row_product",
            |random| (random.vector(), rows(random)),
            |(row, other)| row_product(row, &other),
        ),
        with_globals("crowd_walk", "crowd_work", |random, trial| {
            const JOINTS: u32 = 3;
            const LEVEL: u32 = 2;
            let mut all: Vec<Rows> = (0..2 * JOINTS).map(|_| rows(random)).collect();
            let first_link = random.below(2);
            let (joint, parent) = [(0, 1), (1, 2), (2, 0)][random.below(3) as usize];
            let (instance, link) = (random.below(2), random.below(LEVEL));
            let mut links = vec![[9u32; 2]; (first_link + LEVEL) as usize];
            links[(first_link + link) as usize] = [joint, parent];
            trial.argument(instance * LEVEL + link);
            let dispatch = CrowdDispatch {
                joints: LEVEL,
                layers: JOINTS,
                first_link,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.global("links", links);
            trial.global("matrices", all.as_slice().to_cells());
            trial.output("matrices");
            let at = |joint: u32| (instance * JOINTS + joint) as usize;
            all[at(joint)] = affine_product(&all[at(parent)], &all[at(joint)]);
            trial.expect(all);
        }),
        with_globals("crowd_walk_all", "main", |random, trial| {
            const JOINTS: u32 = 100;
            // An invocation alone: it copies rows, walks the links that are its own, and stores its rows; what
            // others would copy lies there before.
            let all: Vec<[f32; 4]> = (0..3 * 3 * JOINTS).map(|_| random.vector()).collect();
            let mut memory: Vec<[f32; 4]> = (0..384).map(|_| random.vector()).collect();
            let (group, lane) = ([random.below(2), random.below(2)], random.below(80) % 64);
            let instance = 2 * group[1] + group[0];
            let links: Vec<[u32; 2]> = (1..JOINTS)
                .map(|joint| [joint, random.below(joint)])
                .collect();
            let bounds = [[0, 80], [80, JOINTS - 1]];
            trial.argument([group[0], group[1], 0]);
            trial.argument([2u32, 2, 1]);
            trial.argument(lane);
            let dispatch = CrowdDispatch {
                count: 3,
                joints: JOINTS,
                layers: 2,
                first_link: JOINTS - 1,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.global("links", [&links[..], &bounds].concat());
            trial.global("rows", memory.clone());
            trial.global("matrices", all.clone());
            trial.output("matrices");
            let mut after = all;
            if instance < 3 {
                let first = (instance * 3 * JOINTS) as usize;
                let copied = (lane..3 * JOINTS).step_by(64).map(|row| row as usize);
                copied
                    .clone()
                    .for_each(|row| memory[row] = after[first + row]);
                for [from, to] in bounds {
                    for link in (from + lane..to).step_by(64) {
                        let [joint, parent] = links[link as usize].map(|joint| 3 * joint as usize);
                        let at = |memory: &[[f32; 4]], at: usize| {
                            [memory[at], memory[at + 1], memory[at + 2]]
                        };
                        let product = affine_product(&at(&memory, parent), &at(&memory, joint));
                        memory[joint..joint + 3].copy_from_slice(&product);
                    }
                }
                copied.for_each(|row| after[first + row] = memory[row]);
            }
            trial.expect(after);
        }),
        with_globals("crowd_skin", "crowd_work", |random, trial| {
            const JOINTS: u32 = 2;
            let mut all: Vec<Rows> = (0..2 * JOINTS).map(|_| rows(random)).collect();
            let bind = [rows(random), rows(random)];
            let index = random.below(2 * JOINTS * 3);
            trial.argument(index);
            let dispatch = CrowdDispatch {
                joints: JOINTS,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            trial.global("bind", bind);
            trial.global("matrices", all.as_slice().to_cells());
            trial.output("matrices");
            let (matrix, row) = (index / 3, index % 3);
            let matrix_rows = &mut all[matrix as usize];
            matrix_rows[row as usize] =
                row_product(matrix_rows[row as usize], &bind[(matrix % JOINTS) as usize]);
            trial.expect(all);
        }),
        twin(
            "crowd_half",
            "to_any_half",
            |random| [0; 4].map(|_| half_of(random)),
            |value| value.map(|component| u32::from(to_any_half(component))),
        ),
        with_globals("crowd_half", "crowd_work", |random, trial| {
            trial.argument(1u32);
            half(random, trial, 1);
        }),
        with_globals("crowd_half", "main", |random, trial| {
            // The second row of workgroups, of one each.
            trial.argument([1, 1, 0]);
            trial.argument([1u32, 2, 1]);
            let dispatch = CrowdDispatch {
                count: 66,
                ..CrowdDispatch::default()
            };
            dispatch.put(trial);
            half(random, trial, 65);
        }),
    ]
}

/// A number near the largest half, or any.
pub(super) fn half_of(random: &mut Random) -> f32 {
    match random.once_in(4) {
        true => 65_520.0 + 100.0 * random.number(),
        false => random.finite(),
    }
}

/// Rounds the value at an index.
fn half(random: &mut Random, trial: &mut TwinTrial, index: usize) {
    let mut values = vec![[0.0; 4]; index];
    let value = [0; 4].map(|_| half_of(random));
    values.push(value);
    trial.global("values", values);
    trial.output("halves");
    trial.expect(vec![[UNTOUCHED; 2]; index]);
    let [x, y, z, w] = value.map(|component| u32::from(to_any_half(component)));
    trial.expect([x | y << 16, z | w << 16]);
}
