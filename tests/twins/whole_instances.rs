//! The kernels over whole instances of a crowd, each function beside its twin. An invocation of an entry point runs
//! alone: what others of its workgroup would leave in its memory lies there before.

use crate::math::canonical::canonical;
use crate::shader::{
    CHANNELS, CrowdBase, CrowdClip, CrowdEntry, CrowdPosition, CrowdSpan, LINE_VECTORS,
    MAX_WHOLE_JOINTS, MAX_WHOLE_POSITIONS, ON_KEY, ROTATION, SCALE, TRANSLATION,
};
use crate::twin::crowd_layers::Layers;
use crate::twin::crowd_matrices::{Rows, affine_product, row_product, to_any_half, transform};
use crate::twin::crowd_times::base_positions;

use super::cells::Cells;
use super::crowd::{
    BASES, CELLS, CLIPS, CrowdDispatch, JOINTS, LayerScene, ToCells as _, cells, channel, entry,
    half_of, period, position, rows,
};
use super::trial::{Twin, TwinTrial, UNTOUCHED, with_globals};
use crate::gpu::kernel_check::random::Random;

const ROTATIONS: &str = "crowd_whole_rotations";
const MATRICES: &str = "crowd_whole_matrices";

/// Invocations of a workgroup.
const LANES: u32 = 64;

/// What is pushed.
#[derive(Default, Clone, Copy)]
struct Pushed {
    crowd: CrowdDispatch,
    instances: u32,
    levels: u32,
    is_skinning: bool,
    is_half: bool,
}

impl Cells for Pushed {
    fn put(&self, cells: &mut Vec<u64>) {
        self.crowd.put(cells);
        let bits = [self.is_skinning, self.is_half].map(u32::from);
        ([self.instances, self.levels], bits).put(cells);
    }
}

/// A crowd whose entry points can be run: of one layer, with everything that they read but the skeleton.
struct WholeScene {
    joints: u32,
    first_instance: u32,
    clock: u64,
    entries: Vec<CrowdEntry>,
    clips: Vec<CrowdClip>,
    bases: Vec<CrowdBase>,
    spans: Vec<CrowdSpan>,
    layers: LayerScene,
    /// Those in a workgroup's memory.
    positions: Vec<CrowdPosition>,
}

impl WholeScene {
    /// So many instances of a skeleton of so many joints.
    fn new(random: &mut Random, instances: u32, joints: u32) -> Self {
        let (mut clips, mut bases, mut spans) = (Vec::new(), Vec::new(), Vec::new());
        let period = period(random);
        for _ in 0..CLIPS {
            let base_count = 1 + random.below(BASES);
            clips.push(CrowdClip {
                period,
                first_base: bases.len() as u32,
                bases: base_count,
            });
            for _ in 0..base_count {
                let count = 1 + random.below(2);
                bases.push(CrowdBase {
                    first: spans.len() as u32,
                    count,
                    step: count - 1,
                });
                for start in &[0, random.below(period)][..count as usize] {
                    spans.push(CrowdSpan {
                        start: start | if random.once_in(2) { ON_KEY } else { 0 },
                        whole: *start as i32,
                        scale: canonical(random.parameter() / period as f32),
                        offset: random.parameter(),
                    });
                }
            }
        }
        let mut layers = LayerScene::new(random);
        let channels = CLIPS * joints * CHANNELS;
        layers.channels = (0..channels).map(|_| channel(random)).collect();
        // Of one layer nothing lies behind the segments and the keys.
        layers.cells = cells(random, CELLS);
        let first_instance = random.below(2);
        let mut clock = 0;
        let entries = (0..first_instance + instances).map(|_| {
            let (mut entry, entry_clock) = entry(random, period);
            if random.once_in(4) {
                entry.speed_and_modes &= !0x7f_ffff; // it may stand at a key
            }
            clock = entry_clock;
            entry
        });
        let entries = entries.collect();
        let positions = 0..MAX_WHOLE_POSITIONS;
        Self {
            joints,
            first_instance,
            clock,
            entries,
            clips,
            bases,
            spans,
            layers,
            positions: positions.map(|_| position(random)).collect(),
        }
    }

    /// What is pushed, for workgroups of so many instances.
    fn pushed(&self, instances: u32) -> Pushed {
        let crowd = CrowdDispatch {
            count: self.entries.len() as u32 - self.first_instance,
            first_instance: self.first_instance,
            joints: self.joints,
            layers: 1,
            bases: BASES,
            clock: self.clock,
            ..CrowdDispatch::default()
        };
        Pushed {
            crowd,
            instances,
            ..Pushed::default()
        }
    }

    fn put(&self, trial: &mut TwinTrial) {
        trial.global("first_entry", [0u32]);
        trial.global("entries", self.entries.as_slice().to_cells());
        trial.global("clips", self.clips.as_slice().to_cells());
        trial.global("time_bases", self.bases.as_slice().to_cells());
        trial.global("spans", self.spans.as_slice().to_cells());
        trial.global("channels", self.layers.channels.as_slice().to_cells());
        trial.global("cells", self.layers.cells.as_slice().to_cells());
        put_positions(trial, &self.positions);
    }

    /// The entries from an instance of the dispatch on.
    fn entries_from(&self, first: u32) -> &[CrowdEntry] {
        &self.entries[(self.first_instance + first) as usize..]
    }

    /// Finds the positions of so many instances from one on that are an invocation's part.
    fn find_positions(&mut self, first: u32, instances: u32, lane: u32) {
        for index in (lane..instances * BASES).step_by(LANES as usize) {
            let entry = self.entries_from(first)[(index / BASES) as usize];
            let before = self.positions[index as usize - (index % BASES) as usize..].to_vec();
            let mut found: [CrowdPosition; BASES as usize] = [before[0], before[1]];
            let (clips, bases, spans) = (&self.clips, &self.bases, &self.spans);
            base_positions(&entry, self.clock, clips, bases, spans, &mut found);
            self.positions[index as usize] = found[(index % BASES) as usize];
        }
    }

    /// The crowd of the instances from one on.
    fn twin_from(&self, first: u32) -> Layers<'_> {
        Layers {
            entries: self.entries_from(first),
            channels: &self.layers.channels,
            cells: &self.layers.cells,
            positions: &self.positions,
            joints: self.joints,
            layers: 1,
            bases: BASES,
            masks: 0,
            references: 0,
        }
    }
}

/// The matrix of a joint in its parent's frame.
fn transformed(twin: &Layers<'_>, instance: u32, joint: u32) -> Rows {
    let [rotation, moved, scale] =
        [ROTATION, TRANSLATION, SCALE].map(|kind| twin.layered(instance, joint, kind));
    transform(rotation, moved, scale)
}

/// The matrix in a workgroup's memory.
fn matrix(memory: &[[f32; 4]], index: u32) -> Rows {
    let first = 3 * index as usize;
    [memory[first], memory[first + 1], memory[first + 2]]
}

/// The rows of so many matrices in a workgroup's memory.
fn memory(random: &mut Random, matrices: u32) -> Vec<[f32; 4]> {
    (0..3 * matrices).map(|_| random.vector()).collect()
}

/// A workgroup of four, and an invocation of it; returns the number of the workgroup.
fn invocation(random: &mut Random, trial: &mut TwinTrial) -> (u32, u32) {
    let group = [random.below(2), random.below(2)];
    let lane = random.below(LANES);
    trial.argument([group[0], group[1], 0]);
    trial.argument([2u32, 2, 1]);
    trial.argument(lane);
    (2 * group[1] + group[0], lane)
}

/// Expects those vectors of a result that are there.
fn expect_stored(trial: &mut TwinTrial, is_half: bool, stored: &[Option<[f32; 4]>]) {
    trial.output(if is_half { "halves" } else { "values" });
    for vector in stored {
        match (is_half, vector) {
            (false, Some(vector)) => trial.expect(*vector),
            (false, None) => trial.expect([UNTOUCHED; 4]),
            (true, Some(vector)) => trial.expect(halves(*vector)),
            (true, None) => trial.expect([UNTOUCHED; 2]),
        }
    }
}

fn halves(vector: [f32; 4]) -> [u32; 2] {
    let [x, y, z, w] = vector.map(|component| u32::from(to_any_half(component)));
    [x | y << 16, z | w << 16]
}

/// The vectors of so many that an invocation stores, of those of a workgroup.
fn stored_by(lane: u32, first_vector: u32, count: u32, is_half: bool) -> impl Iterator<Item = u32> {
    let idle = first_vector % (LINE_VECTORS << u32::from(is_half));
    let all = (lane..idle + count).step_by(LANES as usize);
    all.filter_map(move |next| next.checked_sub(idle))
}

/// The spans and the parameters of positions, which lie apart in a workgroup's memory.
fn put_positions(trial: &mut TwinTrial, positions: &[CrowdPosition]) {
    trial.global("found_spans", spans_of(positions));
    trial.global("found_parameters", parameters_of(positions));
}

fn spans_of(positions: &[CrowdPosition]) -> Vec<u32> {
    positions.iter().map(|position| position.span).collect()
}

fn parameters_of(positions: &[CrowdPosition]) -> Vec<f32> {
    positions
        .iter()
        .map(|position| position.parameter)
        .collect()
}

/// What is pushed with the number of a skeleton's joints alone.
fn of_joints(joints: u32) -> Pushed {
    let crowd = CrowdDispatch {
        joints,
        ..CrowdDispatch::default()
    };
    Pushed {
        crowd,
        ..Pushed::default()
    }
}

/// The first instance of a workgroup, and what is pushed.
fn begin(random: &mut Random, trial: &mut TwinTrial) -> (u32, Pushed) {
    let first = random.below(50);
    let crowd = CrowdDispatch {
        count: first + 1 + random.below(20),
        layers: 1 + random.below(4),
        ..CrowdDispatch::default()
    };
    let pushed = Pushed {
        crowd,
        instances: 1 + random.below(20),
        ..Pushed::default()
    };
    trial.argument(first);
    trial.global("dispatch", pushed);
    trial.global("first_entry", [0u32]);
    (first, pushed)
}

/// Positions in the time bases of some instances: what an invocation leaves of each, its span or its parameter.
fn finds(function: &'static str, sees_spans: bool) -> Twin {
    const INSTANCES: u32 = 40;
    with_globals(ROTATIONS, function, move |random, trial| {
        let mut scene = WholeScene::new(random, INSTANCES, JOINTS);
        trial.samples(10);
        let first = random.below(3);
        let instances = INSTANCES - first;
        let index = random.below(instances * BASES);
        scene.put(trial);
        trial.global("first_entry", [first]);
        trial.global("dispatch", scene.pushed(INSTANCES));
        let before = scene.positions.clone();
        let lane = index % LANES;
        scene.find_positions(first, instances, lane);
        if function == "find_position" {
            trial.argument(index);
            let found = scene.positions[index as usize];
            scene.positions = before;
            scene.positions[index as usize] = found;
        } else {
            trial.argument((instances, lane));
        }
        trial.output(match sees_spans {
            true => "found_spans",
            false => "found_parameters",
        });
        match sees_spans {
            true => trial.expect(spans_of(&scene.positions)),
            false => trial.expect(parameters_of(&scene.positions)),
        }
    })
}

pub(super) fn whole_instances() -> Vec<Twin> {
    vec![
        with_globals(ROTATIONS, "entry_at", |random, trial| {
            let entries: Vec<CrowdEntry> = (0..8).map(|_| entry(random, 1 << 20).0).collect();
            let (first_entry, index) = (random.below(4), random.below(4));
            trial.argument(index);
            trial.global("first_entry", [first_entry]);
            trial.global("entries", entries.as_slice().to_cells());
            trial.expect(entries[(first_entry + index) as usize..][..1].to_cells());
        }),
        with_globals(ROTATIONS, "position_at", |random, trial| {
            let positions: Vec<CrowdPosition> = (0..4).map(|_| position(random)).collect();
            let index = random.below(4);
            trial.argument(index);
            put_positions(trial, &positions);
            trial.expect(positions[index as usize..][..1].to_cells());
        }),
        with_globals(ROTATIONS, "instances_from", |random, trial| {
            let (first, pushed) = begin(random, trial);
            trial.expect(pushed.instances.min(pushed.crowd.count - first));
        }),
        with_globals(ROTATIONS, "instances_from", |random, trial| {
            let (first, pushed) = begin(random, trial);
            trial.output("first_entry");
            trial.expect(first * pushed.crowd.layers);
        }),
        finds("find_position", true),
        finds("find_position", false),
        finds("find_positions", true),
        finds("find_positions", false),
        with_globals(ROTATIONS, "before_in_line", |random, trial| {
            let (vector, is_half) = (random.below(1000), random.once_in(2));
            trial.argument(vector);
            let pushed = Pushed {
                is_half,
                ..Pushed::default()
            };
            trial.global("dispatch", pushed);
            trial.expect(vector % if is_half { 16 } else { 8 });
        }),
        with_globals(ROTATIONS, "finish", |random, trial| {
            let (vector, is_half) = (random.below(3), random.once_in(2));
            let value = [0; 4].map(|_| half_of(random));
            trial.argument(vector);
            trial.argument(value);
            let pushed = Pushed {
                is_half,
                ..Pushed::default()
            };
            trial.global("dispatch", pushed);
            let mut stored = vec![None; vector as usize];
            stored.push(Some(value));
            expect_stored(trial, is_half, &stored);
        }),
        with_globals(ROTATIONS, "main", |random, trial| {
            // Three workgroups have instances, the last of them a few.
            let mut scene = WholeScene::new(random, 70, JOINTS);
            let (group, lane) = invocation(random, trial);
            trial.samples(10);
            let mut pushed = scene.pushed(33);
            pushed.is_half = random.once_in(2);
            trial.global("dispatch", pushed);
            scene.put(trial);
            let first = group * pushed.instances;
            let mut stored = vec![None; (pushed.crowd.count * JOINTS) as usize];
            if first < pushed.crowd.count {
                let instances = pushed.instances.min(pushed.crowd.count - first);
                scene.find_positions(first, instances, lane);
                let first_vector = first * JOINTS;
                let twin = scene.twin_from(first);
                for index in stored_by(lane, first_vector, instances * JOINTS, pushed.is_half) {
                    let rotation = twin.layered(index / JOINTS, index % JOINTS, ROTATION);
                    stored[(first_vector + index) as usize] = Some(rotation);
                }
            }
            expect_stored(trial, pushed.is_half, &stored);
        }),
        with_globals(MATRICES, "transform_joint", |random, trial| {
            const INSTANCES: u32 = 2;
            let scene = WholeScene::new(random, INSTANCES + 1, JOINTS);
            let (first, instance, joint) = (
                random.below(2),
                random.below(INSTANCES),
                random.below(JOINTS),
            );
            trial.argument((instance, joint));
            scene.put(trial);
            trial.global("first_entry", [first]);
            trial.global("dispatch", scene.pushed(INSTANCES));
            let mut rows = memory(random, INSTANCES * JOINTS);
            trial.global("rows", rows.as_slice().to_cells());
            trial.output("rows");
            let row = 3 * (instance * JOINTS + joint) as usize;
            let found = transformed(&scene.twin_from(first), instance, joint);
            rows[row..row + 3].copy_from_slice(&found);
            trial.expect(rows);
        }),
        with_globals(MATRICES, "walk", |random, trial| {
            const JOINTS: u32 = 4;
            let (instance, joint) = (random.below(3), random.below(JOINTS));
            let parent = (joint + 1 + random.below(JOINTS - 1)) % JOINTS;
            trial.argument((instance, [joint, parent]));
            trial.global("dispatch", of_joints(JOINTS));
            let mut rows = memory(random, 3 * JOINTS);
            trial.global("rows", rows.as_slice().to_cells());
            trial.output("rows");
            walk(&mut rows, instance * JOINTS, [joint, parent]);
            trial.expect(rows);
        }),
        with_globals(MATRICES, "row_at", |random, trial| {
            const JOINTS: u32 = 3;
            let (row, is_skinning) = (random.below(4 * 3 * JOINTS), !random.once_in(4));
            trial.argument(row);
            let pushed = Pushed {
                is_skinning,
                ..of_joints(JOINTS)
            };
            trial.global("dispatch", pushed);
            let memory = memory(random, 4 * JOINTS);
            let bind: Vec<Rows> = (0..JOINTS).map(|_| rows(random)).collect();
            trial.expect(row_at(&memory, row, is_skinning.then_some(&bind)));
            trial.global("rows", memory);
            trial.global("bind", bind.as_slice().to_cells());
        }),
        matrices_main(false),
        matrices_main(true),
    ]
}

/// Walks a link of an instance whose matrices begin at an index.
fn walk(memory: &mut [[f32; 4]], first: u32, link: [u32; 2]) {
    let [joint, parent] = link.map(|joint| first + joint);
    let product = affine_product(&matrix(memory, parent), &matrix(memory, joint));
    memory[3 * joint as usize..][..3].copy_from_slice(&product);
}

/// A row as it is stored: times the inverse bind matrix of its joint, if there are such.
fn row_at(memory: &[[f32; 4]], row: u32, bind: Option<&Vec<Rows>>) -> [f32; 4] {
    let value = memory[row as usize];
    bind.map_or(value, |bind| {
        row_product(value, &bind[row as usize / 3 % bind.len()])
    })
}

/// The entry point: what it stores, or what it leaves in the workgroup's memory, where others store most of it.
fn matrices_main(sees_memory: bool) -> Twin {
    with_globals(MATRICES, "main", move |random, trial| {
        const JOINTS: u32 = 5;
        const INSTANCES: u32 = 60;
        /// The levels of the skeleton, and where they begin and end among the links.
        const LINKS: [[u32; 2]; 4] = [[1, 0], [2, 0], [3, 0], [4, 1]];
        const LEVELS: [[u32; 2]; 2] = [[0, 3], [3, 4]];
        let mut scene = WholeScene::new(random, INSTANCES, JOINTS);
        let (group, lane) = invocation(random, trial);
        trial.samples(10);
        let mut pushed = scene.pushed(25);
        pushed.crowd.first_link = LINKS.len() as u32;
        pushed.levels = random.below(3);
        pushed.is_skinning = random.once_in(2);
        pushed.is_half = random.once_in(2);
        trial.global("dispatch", pushed);
        scene.put(trial);
        let bind: Vec<Rows> = (0..JOINTS).map(|_| rows(random)).collect();
        trial.global("links", [&LINKS[..], &LEVELS].concat());
        trial.global("bind", bind.as_slice().to_cells());
        let mut memory = memory(random, MAX_WHOLE_JOINTS);
        trial.global("rows", memory.as_slice().to_cells());
        let first = group * pushed.instances;
        let mut stored = vec![None; (3 * pushed.crowd.count * JOINTS) as usize];
        if first < pushed.crowd.count {
            let instances = pushed.instances.min(pushed.crowd.count - first);
            scene.find_positions(first, instances, lane);
            let twin = scene.twin_from(first);
            for index in (lane..instances * JOINTS).step_by(LANES as usize) {
                let found = transformed(&twin, index / JOINTS, index % JOINTS);
                memory[3 * index as usize..][..3].copy_from_slice(&found);
            }
            for [begin, end] in &LEVELS[..pushed.levels as usize] {
                let links = &LINKS[*begin as usize..*end as usize];
                for index in (lane as usize..instances as usize * links.len()).step_by(64) {
                    let instance = (index / links.len()) as u32;
                    walk(&mut memory, instance * JOINTS, links[index % links.len()]);
                }
            }
            let first_vector = 3 * first * JOINTS;
            let count = 3 * instances * JOINTS;
            for row in stored_by(lane, first_vector, count, pushed.is_half) {
                let value = row_at(&memory, row, pushed.is_skinning.then_some(&bind));
                stored[(first_vector + row) as usize] = Some(value);
            }
        }
        if !sees_memory {
            expect_stored(trial, pushed.is_half, &stored);
            return;
        }
        let room = vec![UNTOUCHED; 3 * (INSTANCES * JOINTS) as usize * 4];
        trial.global("values", room.clone());
        trial.global("halves", room);
        trial.output("rows");
        trial.expect(memory);
    })
}
