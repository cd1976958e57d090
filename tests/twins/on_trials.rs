//! Compares whole kernels with the CPU's loops, on the inputs of the check of kernels.

use bytemuck::{AnyBitPattern, NoUninit, Zeroable as _};

use crate::cpu::evaluate::one;
use crate::gpu::kernel_check::random::Random;
use crate::gpu::kernel_check::{Trial, trials};
use crate::output::encoding::Encoding;
use crate::shader::{
    ArcSegment, ArcsDispatch, CrowdBase, CrowdChange, CrowdChannel, CrowdClip, CrowdDispatch,
    CrowdEntry, CrowdLink, CrowdPosition, CrowdSpan, CrowdSubgroupDispatch, END_NEGATED, Form,
    IS_CONSTANT, KERNELS, Kernel, Link, List, ListedSample, PoseDispatch, ROTATION, SCALE,
    START_NEGATED, Store, TRANSLATION, WORKGROUP,
};
use crate::time::runs::Affine;
use crate::twin::crowd_layers::Layers;
use crate::twin::crowd_matrices::{Rows, affine_product, row_product, to_any_half, transform};
use crate::twin::functions::arc_between;
use crate::twin::machine::{Memory, UNTOUCHED};
use crate::twin::{
    crowd_entries, crowd_times, pose_add, pose_blend, pose_mix, pose_smooth, pose_steps, pose_world,
};

/// Trials of each kernel.
const ROUNDS: usize = 8;

impl Trial {
    fn input<T: AnyBitPattern + NoUninit>(&self, i: usize) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.inputs[i])
    }

    fn pushed<T: AnyBitPattern>(&self) -> T {
        bytemuck::pod_read_unaligned(&self.arguments)
    }

    fn before<T: AnyBitPattern + NoUninit>(&self) -> Vec<T> {
        bytemuck::pod_collect_to_vec(&self.before)
    }
}

/// Compares trials of a kernel with the CPU's results.
fn assert_is<T: NoUninit>(kernel: Kernel, of_cpu: impl Fn(&Trial) -> Vec<T>) {
    let random = &mut Random::canonical();
    for round in 0..ROUNDS {
        for (i, trial) in trials(kernel, random).iter().enumerate() {
            let found: Vec<u32> = bytemuck::pod_collect_to_vec(&of_cpu(trial));
            let expected = trial.expected(kernel);
            assert!(found.len() > 16, "{kernel:?} has {} words", found.len());
            assert_eq!(found, expected, "{kernel:?}, trial {i} of round {round}");
        }
    }
}

/// Where they read texel buffers, and store words of 64 bits, kernels store the same.
#[test]
fn kernels_that_read_texels_store_the_same() {
    let mut count = 0;
    for code in &KERNELS {
        for trial in trials(code.kernel, &mut Random::canonical()) {
            let mut memory = trial.memory(code.kernel);
            if memory.read_texels() {
                memory.run::<f32, ()>(trial.groups, |_| ());
                assert_eq!(memory.into_output(), trial.expected(code.kernel));
                count += 1;
            }
        }
    }
    assert!(count > 100, "{count} trials");
}

/// Listed samples, in every encoding: those in segments, and constants.
#[test]
fn listed_samples() {
    let random = &mut Random::canonical();
    for encoding in Encoding::with_all_options() {
        let row = encoding.row();
        let kernel = Kernel::over_segments(Form::Arc, List::Samples, row.store);
        let arcs = [(); 40].map(|()| {
            let [from, to] = random.pair();
            let (middle, tangent) = arc_between(from, to);
            ArcSegment { middle, tangent }
        });
        let constants = [(); 400].map(|()| random.rotation());
        let mut samples = Vec::from_iter((0..400).map(|i| (i | IS_CONSTANT, 0.0)));
        samples.extend((0..200).map(|_| (random.below(40), random.parameter())));
        let expected = samples
            .iter()
            .map(|&(source, parameter)| match source & IS_CONSTANT {
                0 => {
                    let (scale, offset) = (1.0, 0.0);
                    one(&arcs[source as usize], Affine { scale, offset }, parameter)
                }
                _ => constants[(source & !IS_CONSTANT) as usize],
            });
        let expected = Vec::from_iter(expected);
        let mut encoded = vec![0; expected.len() * encoding.bytes()];
        encoding.encode_all(&expected, &mut encoded);
        let count = samples.len() as u32;
        let listed = samples
            .into_iter()
            .map(|(source, parameter)| ListedSample { source, parameter });
        let listed = Vec::from_iter(listed);
        let dispatch = crate::shader::Dispatch {
            item_count: count,
            detail: row.detail,
            ..bytemuck::Zeroable::zeroed()
        };
        let inputs: [&[u8]; 3] = [
            bytemuck::cast_slice(&arcs),
            bytemuck::cast_slice(&constants),
            bytemuck::cast_slice(&listed),
        ];
        let arguments = bytemuck::bytes_of(&dispatch);
        let memory = Memory::new(kernel, inputs.into_iter(), arguments, Vec::new());
        memory.run::<f32, ()>([count.div_ceil(WORKGROUP), 1, 1], |_| ());
        let found = memory.into_output();
        let encoded: Vec<u32> = bytemuck::pod_collect_to_vec(&encoded);
        assert_eq!(found, encoded, "{encoding:?}");
    }
}

/// Kernels with other lists store what those with one item an invocation do: an encoding has one value for a rotation.
#[test]
fn every_list_stores_every_encoding_alike() {
    for code in &KERNELS {
        let Some((form, list, store)) = code.segments else {
            continue;
        };
        let plain = Kernel::over_segments(form, list, Store::F32);
        for trial in trials(code.kernel, &mut Random::canonical()) {
            let rotations: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(&trial.expected(plain));
            let (mut found, detail) = (trial.expected(code.kernel), trial.detail(list));
            let mut encodings = Encoding::of_store(store).into_iter();
            let encoding = encodings.find(|encoding| encoding.row().detail == detail);
            let encoding = encoding.expect("one of the store's");
            let words = encoding.bytes() / 4;
            found.resize(rotations.len() * words, UNTOUCHED);
            for (rotation, value) in rotations.iter().zip(found.chunks(words)) {
                if rotation[3].to_bits() == UNTOUCHED {
                    assert_eq!(value, vec![UNTOUCHED; words], "{:?}", code.kernel);
                } else {
                    let mut bytes = vec![0; encoding.bytes()];
                    encoding.encode_all(&[*rotation], &mut bytes);
                    let expected: Vec<u32> = bytemuck::pod_collect_to_vec(&bytes);
                    assert_eq!(value, expected, "{:?}", code.kernel);
                }
            }
        }
    }
}

impl Trial {
    /// The detail that a store needs in addition to a rotation, from the constants of the dispatch.
    fn detail(&self, list: List) -> u32 {
        match list {
            List::Frames | List::Times | List::Samples => {
                self.pushed::<crate::shader::Dispatch>().detail
            }
            List::FramesSpread | List::TimesSpread => self.pushed::<crate::shader::Spread>().detail,
            _ => self.pushed::<crate::shader::Grid>().detail,
        }
    }
}

#[test]
fn prepared_arcs() {
    assert_is(Kernel::PrepareArcs, |trial| {
        let (keys, intervals) = (trial.input::<[f32; 4]>(0), trial.input::<u32>(1));
        assert_eq!(
            trial.pushed::<ArcsDispatch>().count as usize,
            intervals.len()
        );
        let arc = |&interval: &u32| {
            let key = (interval & !(START_NEGATED | END_NEGATED)) as usize;
            let with_sign = |key: usize, flag| match interval & flag {
                0 => keys[key],
                _ => keys[key].map(|c| -c),
            };
            let (middle, tangent) = arc_between(
                with_sign(key, START_NEGATED),
                with_sign(key + 1, END_NEGATED),
            );
            ArcSegment { middle, tangent }
        };
        intervals.iter().map(arc).collect()
    });
}

#[test]
fn poses() {
    let detail = |trial: &Trial| trial.pushed::<PoseDispatch>().detail as usize;
    let count = |trial: &Trial| trial.pushed::<PoseDispatch>().count as usize;
    let rotations = |trial: &Trial, i| trial.input::<[f32; 4]>(i);
    assert_is(Kernel::PosesAdd, |trial| {
        let [base, added, reference] = [0, 1, 2].map(|i| rotations(trial, i));
        let weight = reference[base.len()][0];
        let pose = |i: usize| pose_add::pose(base[i], added[i], reference[i], weight);
        (0..base.len()).map(pose).collect()
    });
    assert_is(Kernel::PosesBlend, |trial| {
        let (layers, weights) = (rotations(trial, 0), trial.input::<f32>(1));
        let count = count(trial);
        let pose = |i| pose_blend::pose(&layers, &weights, count, i);
        (0..count).map(pose).collect()
    });
    assert_is(Kernel::PosesMix, |trial| {
        let (from, to) = (rotations(trial, 0), rotations(trial, 1));
        let weight = trial.input::<f32>(2)[0];
        let pairs = from.iter().zip(&to);
        pairs
            .map(|(&from, &to)| pose_mix::pose(from, to, weight))
            .collect()
    });
    assert_is(Kernel::PosesSteps, |trial| {
        let (values, are_rotations) = (rotations(trial, 0), detail(trial) == 1);
        let pose = |pair: &[[f32; 4]]| pose_steps::pose(pair[0], pair[1], are_rotations);
        values.windows(2).map(pose).collect()
    });
    assert_is(Kernel::PosesSmooth, |trial| {
        let (values, steps) = (rotations(trial, 0), rotations(trial, 1));
        let (weights, are_rotations) = (trial.input::<f32>(2), detail(trial) % 2 == 1);
        let pose = |(i, &value): (usize, &[f32; 4])| {
            let mut sum = [0.0; 4];
            for (m, weight) in weights.iter().enumerate() {
                let after = steps[i + weights.len() + m];
                let before = steps[i + weights.len() - 1 - m];
                for c in 0..4 {
                    sum[c] += (after[c] - before[c]) * weight;
                }
            }
            pose_smooth::moved(value, sum, are_rotations)
        };
        values.iter().enumerate().map(pose).collect()
    });
    assert_is(Kernel::PosesWorld, |trial| {
        let (local, links) = (rotations(trial, 0), trial.input::<Link>(1));
        let mut world = vec![[0.0; 4]; 2 * local.len()];
        let frames = local
            .chunks(links.len())
            .zip(world.chunks_mut(2 * links.len()));
        frames.for_each(|(local, world)| pose_world::pose(local, &links, world));
        world
    });
}

fn layered(
    trial: &Trial,
    joint_values: impl Fn(&Layers<'_>, u32, u32) -> Vec<[f32; 4]>,
) -> Vec<[f32; 4]> {
    let pushed = trial.pushed::<CrowdDispatch>();
    let entries = trial.input::<CrowdEntry>(0);
    let layers = Layers {
        entries: &entries[(pushed.first_instance * pushed.layers) as usize..],
        channels: &trial.input::<CrowdChannel>(1),
        cells: &trial.input(2),
        positions: &trial.input::<CrowdPosition>(3),
        joints: pushed.joints,
        layers: pushed.layers,
        bases: pushed.bases,
        masks: pushed.masks,
        references: pushed.references,
    };
    let joints = 0..pushed.count;
    joints
        .flat_map(|i| joint_values(&layers, i / pushed.joints, i % pushed.joints))
        .collect()
}

#[test]
fn joints_of_crowds() {
    for kernel in [
        Kernel::CrowdRotations,
        Kernel::CrowdPlainRotations,
        Kernel::CrowdCompactRotations,
    ] {
        assert_is(kernel, |trial| {
            layered(trial, |layers, instance, joint| {
                vec![layers.layered(instance, joint, ROTATION)]
            })
        });
    }
    for kernel in [
        Kernel::CrowdLocals,
        Kernel::CrowdPlainLocals,
        Kernel::CrowdCompactLocals,
    ] {
        assert_is(kernel, |trial| {
            layered(trial, |layers, instance, joint| {
                let [rotation, moved, scale] = [ROTATION, TRANSLATION, SCALE]
                    .map(|kind| layers.layered(instance, joint, kind));
                transform(rotation, moved, scale).into()
            })
        });
    }
}

#[test]
fn positions_of_crowds() {
    assert_is(Kernel::CrowdTimes, |trial| {
        let pushed = trial.pushed::<CrowdDispatch>();
        let clock = u64::from(pushed.clock_low) | u64::from(pushed.clock_high) << 32;
        let (entries, clips) = (trial.input::<CrowdEntry>(0), trial.input::<CrowdClip>(1));
        let (bases, spans) = (trial.input::<CrowdBase>(2), trial.input::<CrowdSpan>(3));
        let window = &entries[(pushed.first_instance * pushed.layers) as usize..];
        let mut all = Vec::new();
        for entry in window {
            let untouched = CrowdPosition {
                span: UNTOUCHED,
                parameter: f32::from_bits(UNTOUCHED),
            };
            let mut found = vec![untouched; pushed.bases as usize];
            crowd_times::base_positions(entry, clock, &clips, &bases, &spans, &mut found);
            all.extend(found);
        }
        // Nothing is stored behind the last position.
        let is_there = |position: &CrowdPosition| position.span != UNTOUCHED;
        all.truncate(all.iter().rposition(is_there).map_or(0, |last| last + 1));
        all
    });
}

/// With any number of lanes.
#[test]
fn rotations_of_crowds_by_subgroups() {
    let [of_words, of_halves] = [
        Kernel::CrowdSubgroupRotations,
        Kernel::CrowdSubgroupRotationsF16,
    ];
    let rotations = |trial: &Trial| -> Vec<[f32; 4]> {
        let pushed = trial.pushed::<CrowdSubgroupDispatch>();
        let clock = u64::from(pushed.clock_low) | u64::from(pushed.clock_high) << 32;
        let (entries, clips) = (trial.input::<CrowdEntry>(0), trial.input::<CrowdClip>(1));
        let (bases, spans) = (trial.input::<CrowdBase>(2), trial.input::<CrowdSpan>(3));
        let entries = &entries[pushed.first_instance as usize..][..pushed.count as usize];
        let max_bases = clips.iter().map(|clip| clip.bases).max().unwrap();
        let mut positions = vec![CrowdPosition::zeroed(); entries.len() * max_bases as usize];
        let of_instances = positions.chunks_mut(max_bases as usize);
        for (entry, found) in entries.iter().zip(of_instances) {
            crowd_times::base_positions(entry, clock, &clips, &bases, &spans, found);
        }
        let layers = Layers {
            entries,
            channels: &trial.input::<CrowdChannel>(4),
            cells: &trial.input(5),
            positions: &positions,
            joints: pushed.joints,
            layers: 1,
            bases: max_bases,
            masks: 0,
            references: 0,
        };
        let joints = 0..pushed.count * pushed.joints;
        let rotation = |i| layers.layered(i / pushed.joints, i % pushed.joints, ROTATION);
        joints.map(rotation).collect()
    };
    assert_is(of_words, rotations);
    assert_is(of_halves, |trial| {
        let rotations = rotations(trial).into_iter();
        rotations.map(|value| value.map(to_any_half)).collect()
    });
    for kernel in [of_words, of_halves] {
        for trial in trials(kernel, &mut Random::canonical()) {
            let expected = trial.expected(kernel);
            for lanes in [8, 16, 64] {
                let memory = trial.memory(kernel).with_subgroups_of(lanes);
                memory.run::<f32, ()>(trial.groups, |_| ());
                assert_eq!(memory.into_output(), expected, "{lanes} lanes");
            }
        }
    }
}

#[test]
fn matrices_of_crowds() {
    for (kernel, is_level) in [(Kernel::CrowdWalk, true), (Kernel::CrowdWalkAll, false)] {
        assert_is(kernel, |trial| {
            let pushed = trial.pushed::<CrowdDispatch>();
            let links = trial.input::<CrowdLink>(0);
            let first = pushed.first_link as usize;
            let (joints, links) = match is_level {
                true => (pushed.layers, &links[first..]),
                false => (pushed.joints, &links[..first]),
            };
            let mut matrices = trial.before::<Rows>();
            for pose in matrices.chunks_mut(joints as usize) {
                for link in links {
                    let joint = link.joint as usize;
                    pose[joint] = affine_product(&pose[link.parent as usize], &pose[joint]);
                }
            }
            matrices
        });
    }
    assert_is(Kernel::CrowdSkin, |trial| {
        let bind = trial.input::<Rows>(0);
        let matrices = trial.before::<Rows>().into_iter().zip(bind.iter().cycle());
        matrices
            .map(|(matrix, bind)| matrix.map(|row| row_product(row, bind)))
            .collect()
    });
    assert_is(Kernel::CrowdHalf, |trial| {
        trial
            .input::<[f32; 4]>(0)
            .into_iter()
            .map(|value| value.map(to_any_half))
            .collect()
    });
}

#[test]
fn entries_of_crowds() {
    assert_is(Kernel::CrowdGather, |trial| {
        let pushed = trial.pushed::<CrowdDispatch>();
        let (all, visible) = (trial.input::<CrowdEntry>(0), trial.input::<u32>(1));
        let window = &visible[pushed.first_instance as usize..];
        crowd_entries::gather(&all, window, pushed.layers as usize).collect()
    });
    assert_is(Kernel::CrowdScatter, |trial| {
        let mut all = trial.before::<CrowdEntry>();
        let changes = trial.input::<CrowdChange>(0);
        let counted = &changes[..trial.pushed::<CrowdDispatch>().count as usize];
        counted
            .iter()
            .for_each(|change| crowd_entries::scatter(change, &mut all));
        all
    });
}
